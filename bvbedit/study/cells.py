"""One cell of a study: a model of a material in a configuration, and all that is measured of it.

A function of what pickles, and deterministic but for times, so that any process on any machine may do it.
"""

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property, lru_cache
from pathlib import Path
from time import perf_counter
from typing import Any

import numpy as np

from bvbedit.brdf.base import Brdf
from bvbedit.brdf.geometry import Floats, spherical
from bvbedit.brdf.highlight import highlight_width
from bvbedit.brdf.metrics import compare, estimate, lengths_on_grid
from bvbedit.edit.recipe import Source
from bvbedit.errors import BvbError
from bvbedit.render import render
from bvbedit.render.image_metrics import compare_pictures
from bvbedit.spline.diagnostics import conditions
from bvbedit.study.plan import Configuration, Pictures

# The albedo is compared at these elevations, by so many directions drawn for the measurement, the same for both.
ELEVATIONS = np.radians(np.arange(0.0, 81.0, 10.0))
DIRECTIONS, SEED = 4096, 5
# Pairs whose evaluation is timed, and how often: the quickest counts, as others' work only slows down.
PAIRS, TIMES = 1 << 17, 3
# Bytes of a parameter of an analytic model.
PARAMETER = 4


@dataclass(frozen=True)
class Task:
    """A cell to measure."""

    material: str
    source: Source
    configuration: Configuration
    pictures: Pictures
    stride: int


class Reference:
    """A measurement with what its models are compared with: worked out once for all of them."""

    def __init__(self, brdf: Brdf) -> None:
        self.brdf = brdf
        self._pictures: dict[tuple[str, int, int], Any] = {}
        self._lengths: dict[int, tuple[float, float]] = {}
        self._albedo: tuple[Floats, Floats, Floats, Floats] | None = None

    def picture(self, scene: str, side: int, spp: int) -> Any:
        """Return the picture of the measurement."""
        key = scene, side, spp
        if key not in self._pictures:
            self._pictures[key] = render(self.brdf, scene, width=side, height=side, spp=spp, density=self.brdf.density)
        return self._pictures[key]

    @cached_property
    def highlight(self) -> float:
        """The half-width of its highlight in degrees."""
        return highlight_width(self.brdf)

    def lengths(self, stride: int) -> tuple[float, float]:
        """Return the largest and the mean length of its reflectance over the paper's grid, in 1/sr."""
        if stride not in self._lengths:
            self._lengths[stride] = lengths_on_grid(self.brdf, stride)
        return self._lengths[stride]

    def albedo_error(self, model: Brdf) -> float:
        """Return the largest difference of the directional albedo over elevations and channels."""
        if self._albedo is None:
            u = np.random.default_rng(SEED).random((DIRECTIONS, 2))
            wo = np.repeat(spherical(ELEVATIONS, np.zeros(1)).reshape(-1, 3), DIRECTIONS, axis=0)
            wi, density, _ = self.brdf.sample_unit(np.ascontiguousarray(wo), np.tile(u, (len(ELEVATIONS), 1)))
            share = np.divide(wi[:, 2], density, out=np.zeros_like(density), where=density > 0)
            self._albedo = wi, wo, share, self.brdf.evaluate_unit(wi, wo)[0]
        wi, wo, share, f = self._albedo
        missed = (model.evaluate_unit(wi, wo)[0] - f) * share[:, None]
        return float(np.abs(missed.reshape(len(ELEVATIONS), DIRECTIONS, 3).mean(axis=1)).max())


@lru_cache(maxsize=1)
def _reference(source: Source) -> Reference:
    # One at a time: a MERL table is 70 MB, and cells come material by material.
    return Reference(source.read())


def measured(task: Task) -> dict[str, Any]:
    """Return the row of a cell, by the names of its columns; what goes wrong is told in it, not raised."""
    configuration = task.configuration
    row: dict[str, Any] = {
        "material": task.material,
        "configuration": configuration.name,
        "series": configuration.series,
        "kind": "spline" if configuration.fit is not None else "analytic",
    }
    try:
        return {**row, "status": "done", **_figures(task)}
    except BvbError as error:
        reason = str(error)
    except MemoryError:
        reason = "Not enough memory. Run fewer jobs."
    except Exception as error:  # one cell must not stop the others
        reason = f"It failed unexpectedly: {error!r}. Please report this."
    return {**row, "status": "failed", "reason": " ".join(reason.split())}


def _figures(task: Task) -> dict[str, Any]:
    reference = _reference(task.source)
    start = perf_counter()
    model, row = _made(task.configuration, reference.brdf)
    row["fit_seconds"] = perf_counter() - start
    row |= _errors(model, reference, task.stride)
    row["evaluations_per_second"] = _speed(model)
    for scene in task.pictures.scenes:
        row |= _picture_errors(model, reference, scene, task.pictures)
    return row


def _made(configuration: Configuration, brdf: Brdf) -> tuple[Brdf, dict[str, Any]]:
    """Return the model as its file holds it, and what it is."""
    if configuration.fit is not None:
        from bvbedit.io.budget import payload_bytes
        from bvbedit.io.bvb import dumps, loads

        fitted = configuration.fit.fitted(brdf)
        written = dumps(fitted)
        model = loads(written)
        spline = model.spline
        inner = sum(len(t) - 2 * (p + 1) for t, p in zip(spline.knots, spline.degrees, strict=True))
        return model, {
            "chart": model.chart.name,
            "encoding": model.encoding.name,
            "knots": configuration.fit.knots,
            "precision": model.storage.precision,
            "degrees": "x".join(map(str, spline.degrees)),
            "size": "x".join(map(str, spline.size)),
            "numbers": int(np.prod(spline.size)) * 3 + inner,
            "file_bytes": len(written),
            "payload_bytes": payload_bytes(fitted),
            "condition": max(conditions(spline)),
        }
    from bvbedit.brdf.analytic_fit import fit_analytic

    assert configuration.analytic is not None
    found = fit_analytic(brdf, configuration.analytic)
    size = PARAMETER * found.parameter_count
    return found.model, {"numbers": found.parameter_count, "file_bytes": size, "payload_bytes": size}


def _errors(model: Brdf, reference: Reference, stride: int) -> dict[str, Any]:
    found = compare(model, reference.brdf) if stride == 1 else estimate(model, reference.brdf, stride=stride)
    row: dict[str, Any] = {}
    for name, errors in (("grid", found.grid), ("nodes", found.nodes)):
        for metric in ("log_cosine_rms", "fores", "relative_l1"):
            row[f"{name}_{metric}"] = _real(getattr(errors, metric))
    for name in ("e_max", "e_avg", "e_max_45", "e_avg_45"):
        row[name] = _real(getattr(found.paper, name))
    row["r_max"], row["r_avg"] = reference.lengths(stride)
    row["highlight"] = reference.highlight
    row["albedo_error"] = _real(reference.albedo_error(model))
    return row


def _picture_errors(model: Brdf, reference: Reference, scene: str, pictures: Pictures) -> dict[str, Any]:
    expected = reference.picture(scene, pictures.side, pictures.spp)
    start = perf_counter()
    picture = render(
        model,
        scene,
        width=pictures.side,
        height=pictures.side,
        spp=pictures.spp,
        density=reference.brdf.density,
    )
    seconds = perf_counter() - start
    found = compare_pictures(picture, expected)
    name = Path(scene).stem
    return {
        f"{name}_mae": found.mae,
        f"{name}_pae": found.pae,
        f"{name}_psnr": _real(found.psnr),
        f"{name}_seconds": seconds,
    }


def _speed(model: Brdf) -> float:
    """Return evaluations in a second, of random pairs."""
    drawn = np.random.default_rng(SEED).random((2, PAIRS, 2))
    wi, wo = (spherical(np.arccos(u[:, 0]), 2 * np.pi * u[:, 1]) for u in drawn)
    seconds = []
    for _ in range(TIMES):
        start = perf_counter()
        model.evaluate_unit(wi, wo)
        seconds.append(perf_counter() - start)
    return PAIRS / min(seconds)


def _real(value: Any) -> float | None:
    """Return a number that JSON can hold, or None."""
    return float(value) if isinstance(value, int | float | np.floating) and np.isfinite(value) else None


def versions() -> Mapping[str, str]:
    """Return what results depend on besides the plan: versions of what computes them."""
    import platform
    from importlib.metadata import version

    names = ("bvbedit", "numpy", "numba", "nlopt", "embreex")
    return {"python": platform.python_version(), **{name: version(name) for name in names}}
