"""What is done in the worker's process: functions that pickle, called with a function that is told the share done."""

from collections.abc import Callable

from bvbedit.brdf.spline_brdf import SplineBrdf
from bvbedit.edit.fitting import Fit, FitOptions
from bvbedit.edit.recipe import Source

Progress = Callable[[float], None]


def fitted(source: Source, options: FitOptions, *, progress: Progress) -> SplineBrdf:
    """Return the model that ``options`` make of a measurement."""
    return options.fitted(source.read(), progress)


def refitted(model: SplineBrdf, edit: Fit, *, progress: Progress) -> SplineBrdf:
    """Return the model, fitted anew."""
    return edit.fitted(model, progress)
