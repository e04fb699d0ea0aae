"""Widths of highlights: those of known lobes, and none where there is no highlight."""

import numpy as np
import pytest

from bvbedit.brdf.analytic import GGX, Lambert, Schlick, Sum
from bvbedit.brdf.highlight import highlight_width

METAL = Schlick((0.9, 0.9, 0.9))


@pytest.mark.parametrize("alpha", [0.005, 0.02, 0.08])
def test_a_narrow_lobe_of_ggx_has_the_width_of_its_distribution(alpha):
    # D = alpha^2 / (pi ((alpha^2 - 1) cos^2 + 1)^2) is half its peak where tan theta_h = alpha sqrt(sqrt(2) - 1), but
    # for the fourth power of the cosine, which narrow lobes do not see.
    expected = np.degrees(np.arctan(alpha * np.sqrt(np.sqrt(2) - 1)))
    assert highlight_width(GGX(alpha, METAL)) == pytest.approx(expected, rel=0.02)


def test_what_has_no_highlight_is_told_as_ninety_degrees():
    assert highlight_width(Lambert((0.8, 0.5, 0.2))) == 90.0
    assert highlight_width(Lambert((0.0, 0.0, 0.0))) == 90.0
    faint = Sum((Lambert((0.9, 0.9, 0.9)), GGX(0.5, Schlick((0.02, 0.02, 0.02)))), ((1.0,) * 3, (1.0,) * 3))
    assert highlight_width(faint) == 90.0


def test_a_body_beneath_does_not_change_the_width():
    lobe = GGX(0.05, METAL)
    assert highlight_width(Sum((Lambert((0.5, 0.5, 0.5)), lobe), ((1.0,) * 3, (1.0,) * 3))) == pytest.approx(
        highlight_width(lobe), rel=0.05
    )
