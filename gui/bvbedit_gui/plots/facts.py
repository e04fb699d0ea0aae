"""The figures of a model for a table: what it is, what it takes, how near it is, and whether it is plausible."""

from typing import NamedTuple

import numpy as np

from bvbedit.brdf.base import Brdf
from bvbedit.brdf.charts import IN_OUT
from bvbedit.brdf.encodings import Log, Root
from bvbedit.brdf.geometry import spherical
from bvbedit.brdf.measured import MeasuredBrdf
from bvbedit.brdf.metrics import estimate
from bvbedit.brdf.repair import is_symmetric, rounding
from bvbedit.brdf.rgl import RglBrdf
from bvbedit.brdf.spline_brdf import SplineBrdf
from bvbedit.io.budget import file_bytes, payload_bytes
from bvbedit_gui.plots.albedos import AlbedoCurve, albedo_curve, albedo_number
from bvbedit_gui.plots.ticks import number

# Pairs of each sample set by which the distance from the reference is estimated.
PAIRS = 20_000
# Parameters along each axis at which negative values are counted.
PLACES = np.linspace(0.0, 1.0, 41)
# Pairs by which reciprocity is measured, up to this elevation: beyond it nobody looks.
EXCHANGED, HIGHEST, SEED = 4096, np.radians(80.0), 2
# Part of the mean reflectance below which a difference is rounding.
DARKEST = 1e-6

CHART_HELP = {
    "in-out": "Angles of light and view: suits rough and matt surfaces; a sharp highlight runs diagonally through it.",
    "half-diff": "Angles about the half vector: a highlight stays in one place, so that sharp ones stay sharp.",
}
ENCODING_HELP = {
    "linear": "Reflectance itself is fitted: bright highlights count most, dark parts are left to chance.",
    "root": "A root of reflectance is fitted: highlights and dark parts are both kept about as eyes see them.",
    "log": "The logarithm of reflectance is fitted: dark parts are kept as faithfully as the brightest highlight.",
}
STORAGE_HELP = {
    "quantised": "Control points are whole multiples of a small step: the smallest file, and no difference is seen.",
    "float16": "Control points have three digits: half the bytes of float32; steps may show in very smooth gradients.",
    "float32": "Control points have seven digits: nothing is lost that could be seen.",
    "float64": "Control points are stored exactly as they are edited.",
}


class Row(NamedTuple):
    """One figure."""

    label: str
    value: str
    help: str
    """What it means for the look, in one plain sentence."""


def figures(model: SplineBrdf, reference: Brdf | None, *, albedo: AlbedoCurve | None = None) -> list[Row]:
    """Return the figures of ``model``, and how far it is from ``reference``.

    ``albedo`` is its ``albedo_curve`` where that is known already. Raises BvbError where a file cannot hold the model.
    """
    return [*_structure(model), *_bytes(model, reference), *_distance(model, reference), *_soundness(model, albedo)]


def measured_bytes(reference: Brdf | None) -> int | None:
    """Return the bytes of a measurement as its file format holds it: 8 a number in MERL's, 4 in RGL's; else None."""
    if isinstance(reference, MeasuredBrdf):
        return 8 * reference.values.size
    if isinstance(reference, RglBrdf):
        return 4 * sum(a.size for a in (reference.rgb, reference.vndf, reference.ndf, reference.sigma))
    return None


def _structure(model: SplineBrdf) -> list[Row]:
    size, encoding = model.spline.size, model.encoding
    parameter = ""
    if isinstance(encoding, Root):
        parameter = f", 1/{encoding.k:g}"
    elif isinstance(encoding, Log):
        parameter = f", from {number(encoding.eps)}/sr"
    return [
        Row("chart", model.chart.name, CHART_HELP[model.chart.name]),
        Row("encoding", encoding.name + parameter, ENCODING_HELP[encoding.name]),
        Row(
            "degrees",
            " x ".join(map(str, model.spline.degrees)),
            "Of the polynomials between knots along the three axes: 1 shows creases, 3 is smooth even in reflections.",
        ),
        Row(
            "size",
            " x ".join(map(str, size)),
            "Control points along the three axes: more of them follow finer detail, and more of the noise.",
        ),
        Row("control points", f"{int(np.prod(size)):,}", "Colours that can be edited one by one to shape the look."),
    ]


def _bytes(model: SplineBrdf, reference: Brdf | None) -> list[Row]:
    payload, whole, before = payload_bytes(model), file_bytes(model), measured_bytes(reference)
    rows = [
        Row("payload", bytes_in_words(payload), "The control net and inner knots alone: what a renderer must hold."),
        Row("file", bytes_in_words(whole), "The .bvb file it would be saved as, compressed and with its report."),
    ]
    if before is not None:
        rows.append(
            Row(
                "compression",
                f"{number(before / whole)} : 1 of {bytes_in_words(before)}",
                "How many times smaller the file is than the measurement; the errors below tell what that costs.",
            )
        )
    step = model.storage.step
    precision = model.storage.precision + ("" if step is None else f", step {number(step)}")
    return [*rows, Row("storage", precision, STORAGE_HELP[model.storage.precision])]


def _distance(model: SplineBrdf, reference: Brdf | None) -> list[Row]:
    if reference is None:
        return []
    found = estimate(model, reference, PAIRS)
    sets = (
        ("grid", found.grid, "all directions alike"),
        ("nodes", found.nodes, "highlights in the first place"),
    )
    rows = []
    for name, errors, what in sets:
        rows += [
            Row(
                f"log-cosine RMS, {name}",
                number(errors.log_cosine_rms),
                f"Error of what is seen with the cosines, {what}: below 0.01 it is hard to see, above 0.1 it is plain.",
            ),
            Row(
                f"Fores, {name}",
                number(errors.fores),
                f"Error of cube roots, {what}: the simple figure that best agrees with what people see.",
            ),
            Row(
                f"relative L1, {name}",
                f"{number(100 * errors.relative_l1)} %" if np.isfinite(errors.relative_l1) else "infinite",
                f"Share of the reflected light that is elsewhere, {what}: large for a highlight slightly moved.",
            ),
        ]
    return rows


def _soundness(model: SplineBrdf, albedo: AlbedoCurve | None) -> list[Row]:
    curve = albedo_curve(model) if albedo is None else albedo
    largest, at, channel = curve.largest
    share = negative_share(model)
    apart = reciprocity_error(model)
    return [
        Row(
            "largest albedo",
            f"{albedo_number(largest)} ({channel}, θ_o = {at:g}°)",
            "The greatest share of light that is reflected: above 1 the material glows in a bright room."
            if not curve.creates_energy
            else "More light is reflected than arrives: the material glows, the more the more often light meets it.",
        ),
        Row(
            "negative values",
            f"{number(100 * share)} % clamped" if share else "none",
            "Share of the volume where the spline is below zero and drawn black: dark rims beside highlights.",
        ),
        Row(
            "reciprocity",
            "exact" if apart == 0 else f"{number(100 * apart)} % apart in the mean",
            "Whether light and viewer may be exchanged: if not, a picture depends on which way its light is traced.",
        ),
    ]


def negative_share(model: SplineBrdf) -> float:
    """Return the share of a channel's encoded values, even over the chart's cube, that are below zero and clamped."""
    y = model.spline.evaluate_grid((PLACES, PLACES, PLACES))
    return float(np.count_nonzero(y < -rounding(model.spline)) / y.size)


def reciprocity_error(model: SplineBrdf) -> float:
    """Return the mean over pairs of |f(wi, wo) - f(wo, wi)| over the mean of both; zero where none can be."""
    if model.chart is not IN_OUT or is_symmetric(model.spline):
        return 0.0
    rng = np.random.default_rng(SEED)
    theta = np.arccos(rng.uniform(np.cos(HIGHEST), 1.0, (2, EXCHANGED)))
    wi, wo = spherical(theta[0], 0.0), spherical(theta[1], rng.uniform(0.0, 2 * np.pi, EXCHANGED))
    f, g = model.evaluate_unit(wi, wo)[0], model.evaluate_unit(wo, wi)[0]
    mean = 0.5 * (f + g)
    least = max(DARKEST * float(mean.mean()), np.finfo(np.float64).tiny)
    apart = float((np.abs(f - g) / np.maximum(mean, least)).mean())
    # Knots that differ in the last digit make values do so.
    return apart if apart > 1e-9 else 0.0


def bytes_in_words(count: int) -> str:
    """Return ``count`` bytes as B, KiB or MiB."""
    for unit, size in (("MiB", 1 << 20), ("KiB", 1 << 10)):
        if count >= size:
            return f"{count / size:.1f} {unit}"
    return f"{count} B"
