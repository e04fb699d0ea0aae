"""A CAGD toolkit for editing measured BRDFs as B-spline volumes.

>>> import bvbedit
>>> bvbedit.fit  # doctest: +ELLIPSIS
<function fit at ...>
"""

from importlib import import_module
from typing import TYPE_CHECKING, Any

from bvbedit.errors import BvbError

if TYPE_CHECKING:
    from bvbedit.api import Comparison, blend, compare, fit, load, render, save
    from bvbedit.brdf.spline_brdf import SplineBrdf
    from bvbedit.spline.tensor import TensorSpline

__version__ = "0.1.0"

__all__ = ["BvbError", "Comparison", "SplineBrdf", "TensorSpline", "blend", "compare", "fit", "load", "render", "save"]

_HOMES = {"SplineBrdf": "bvbedit.brdf.spline_brdf", "TensorSpline": "bvbedit.spline.tensor"}


def __getattr__(name: str) -> Any:
    # Looked up on first use, so that `bvbedit --help` does not pay for numpy.
    if name not in __all__:
        raise AttributeError(f"module 'bvbedit' has no attribute {name!r}")
    return getattr(import_module(_HOMES.get(name, "bvbedit.api")), name)
