"""Themes: text that can be read, and channels that are told apart by every eye."""

from itertools import combinations

import numpy as np
import pytest

from bvbedit_gui.themes import THEMES

# Linear RGB as the colour-blind see it (Machado, Oliveira & Fernandes 2009, severity 1).
EYES = {
    "usual": np.eye(3),
    "protan": [[0.152286, 1.052583, -0.204868], [0.114503, 0.786281, 0.099216], [-0.003882, -0.048116, 1.051998]],
    "deutan": [[0.367322, 0.860646, -0.227968], [0.280085, 0.672501, 0.047413], [-0.011820, 0.042940, 0.968881]],
    "tritan": [[1.255528, -0.076749, -0.178779], [-0.078411, 0.930809, 0.147602], [0.004733, 0.691367, 0.303900]],
}
# Linear sRGB to XYZ, D65.
XYZ = np.array([[0.4124, 0.3576, 0.1805], [0.2126, 0.7152, 0.0722], [0.0193, 0.1192, 0.9505]])


def linear(colour):
    v = np.array([int(colour[k : k + 2], 16) for k in (1, 3, 5)]) / 255
    return np.where(v <= 0.04045, v / 12.92, ((v + 0.055) / 1.055) ** 2.4)


def contrast(a, b):
    """Return the contrast ratio of WCAG 2."""
    lights = sorted(float(XYZ[1] @ linear(c)) + 0.05 for c in (a, b))
    return lights[1] / lights[0]


def lab(colour, eye):
    t = np.cbrt(XYZ @ np.clip(np.asarray(eye) @ linear(colour), 0, 1) / XYZ.sum(axis=1))
    return np.array([116 * t[1] - 16, 500 * (t[0] - t[1]), 200 * (t[1] - t[2])])


@pytest.mark.parametrize("theme", THEMES.values(), ids=list(THEMES))
def test_text_and_lines_stand_out(theme):
    assert contrast(theme.ink, theme.paper) >= 7
    assert all(contrast(colour, theme.paper) >= 3 for colour in theme.series)
    assert contrast(theme.faint, theme.paper) < 2


@pytest.mark.parametrize("eye", EYES.values(), ids=list(EYES))
@pytest.mark.parametrize("theme", THEMES.values(), ids=list(THEMES))
def test_channels_differ_for_every_eye(theme, eye):
    for a, b in combinations(theme.series, 2):
        # In CIELAB 2 is just noticed side by side.
        assert np.linalg.norm(lab(a, eye) - lab(b, eye)) > 20
