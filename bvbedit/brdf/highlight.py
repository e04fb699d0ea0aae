"""How wide a material's highlight is: what tells diffuse from glossy and mirror-like."""

import numpy as np

from bvbedit.brdf.base import Brdf
from bvbedit.brdf.charts import HALF_DIFF
from bvbedit.brdf.geometry import LUMINANCE

# The highlight is looked at where the difference angle is this, across the plane of incidence, up to a half angle of
# 60 degrees: far from grazing, where nearly all materials shine.
THETA_D, FARTHEST, NODES = 20.0, 60.0, 3001
# Less bright than so many times the rest, it is none.
FAINT = 2.0


def highlight_width(brdf: Brdf) -> float:
    """Return the half angle (degrees) at which the highlight of ``brdf`` has fallen half way to what is around it.

    90 where there is no highlight: where its luminance is nowhere twice the darkest.
    """
    theta_h = FARTHEST * np.linspace(0, 1, NODES) ** 2
    across = np.stack([np.sqrt(theta_h / 90), np.full(NODES, THETA_D / 90), np.ones(NODES)], axis=1)
    f = brdf.evaluate(*HALF_DIFF.to_directions(across)) @ LUMINANCE
    # The first nodes lie within a ten-thousandth of a degree.
    peak, base = float(f[:5].max()), float(f.min())
    if peak < FAINT * base or peak == 0:
        return 90.0
    return float(theta_h[np.argmax(f < (peak + base) / 2)])
