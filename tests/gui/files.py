"""Small files to open, and what is seen in scenes, for tests of the viewer."""

from pathlib import Path
from typing import Any

import numpy as np

import bvbedit
from bvbedit.brdf.spline_brdf import SplineBrdf
from tests.edit.samples import smooth


def model_file(folder: Path, name: str = "gold.bvb", model: SplineBrdf | None = None) -> Path:
    """Write a small model in full precision; return the path."""
    path = folder / name
    bvbedit.save(model or smooth(), path, precision="float64")
    return path


def table_file(folder: Path, name: str = "table.npz") -> Path:
    """Write a small measurement: a table of a dim colour with a lobe; return the path."""
    axes = {f"axis_{n}": np.linspace(0, 1, 9) for n in range(3)}
    u = np.linspace(0, 1, 9)[:, None, None, None]
    values = np.array([0.3, 0.2, 0.1]) * (0.2 + np.exp(-6 * u**2)) * np.ones((9, 9, 9, 3))
    np.savez(folder / name, values=values, valid=np.ones((9, 9, 9), bool), chart="half-diff", **axes)
    return folder / name


def dimmed(model: SplineBrdf, factor: float = 0.5) -> SplineBrdf:
    """Return the model with all control points multiplied."""
    return model.with_spline(model.spline.with_control(factor * model.spline.control))


def mesh(view: Any, name: str) -> Any:
    """Return the mesh that an actor of a view's scene shows, or None where it is not seen."""
    actor = view.plotter.actors[name]
    # What stands between the mesh and the mapper is done when a picture is made, or when it is asked for.
    actor.mapper.Update()
    return actor.mapper.dataset.copy() if actor.visibility and actor.mapper.dataset.n_points else None


def points(view: Any, name: str) -> Any:
    """Return the points of the mesh that an actor shows; none where it is not seen."""
    shown = mesh(view, name)
    return np.zeros((0, 3)) if shown is None else np.array(shown.points)
