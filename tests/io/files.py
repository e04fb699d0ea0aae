"""Small sound files of each format, as bytes."""

from pathlib import Path

import numpy as np

from bvbedit.brdf.analytic import GGX, Schlick
from bvbedit.brdf.charts import HALF_DIFF
from bvbedit.brdf.encodings import Root
from bvbedit.brdf.spline_brdf import SplineBrdf, keep_faces
from bvbedit.io.bvb import dumps
from bvbedit.spline.knots import clamped
from bvbedit.spline.tensor import TensorSpline
from tests.io.rgl_files import bsdf_bytes, ggx_fields


def model(seed: int = 0) -> SplineBrdf:
    """Return a small random model, with a report."""
    rng = np.random.default_rng(seed)
    knots = (clamped([0.2, 0.5, 0.6], 3), clamped([0.3], 3), clamped([], 2))
    control = keep_faces(rng.uniform(0, 2, (7, 5, 3, 3)), HALF_DIFF)
    return SplineBrdf(TensorSpline((3, 3, 2), knots, control), HALF_DIFF, Root(2.5), {"source": "ä b.binary"})


def bvb() -> bytes:
    return dumps(model())


def quantised() -> bytes:
    return dumps(model(), "quantised")


def bsdf() -> bytes:
    return bsdf_bytes(ggx_fields(GGX(0.3, Schlick((0.9, 0.6, 0.3))), 0.3, elevations=4, density=8, samples=6))


def merl(dims: tuple[int, int, int] = (90, 90, 180), seed: int = 0) -> bytes:
    """Return a MERL file of random raw values, some of them negative: invalid."""
    raw = np.random.default_rng(seed).uniform(-0.1, 2.0, (3, int(np.prod(dims)))).astype("<f8")
    return np.array(dims, "<i4").tobytes() + raw.tobytes()


def written(path: Path, content: bytes) -> Path:
    path.write_bytes(content)
    return path
