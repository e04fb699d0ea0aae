"""Small models to edit, and edits drawn by hypothesis."""

import functools
from pathlib import Path

import numpy as np
from hypothesis import strategies as st

from bvbedit.brdf.base import Brdf
from bvbedit.brdf.charts import HALF_DIFF, IN_OUT, Chart, grid_points
from bvbedit.brdf.encodings import Encoding, Linear, Log, Root
from bvbedit.brdf.losses import LOSSES
from bvbedit.brdf.plan import plan
from bvbedit.brdf.problem import tabulate
from bvbedit.brdf.spline_brdf import SplineBrdf, face_spread, keep_faces
from bvbedit.edit.appearance import Broaden, Denoise, Gain, RaiseGrazing, Sharpen, Tint
from bvbedit.edit.combining import Blend, MakePlausible, MovePoints
from bvbedit.edit.fitting import Fit
from bvbedit.edit.operation import Edit
from bvbedit.edit.operations import KINDS
from bvbedit.edit.parameters import limits_of
from bvbedit.edit.structural import InsertKnots, Reduce, RemoveKnots, Store
from bvbedit.spline.knots import clamped, greville
from bvbedit.spline.tensor import TensorSpline

CHARTS = (HALF_DIFF, IN_OUT)
ROOT = Root()
ENCODINGS = (Linear(), ROOT, Log())

# A recipe of gold.bvb.
LOOK = """\
source = "gold.bvb"

[[steps]]
op = "tint"
label = "warm"
rgb = [1.0, 0.8, 0.6]

[[steps]]
op = "gain"
factor = 2

[[outputs]]
file = "{name}-warm.bvb"
"""


@functools.cache
def smooth(chart: Chart = HALF_DIFF, encoding: Encoding = ROOT, size: tuple[int, int, int] = (8, 6, 5)) -> SplineBrdf:
    """A coloured body with a soft lobe: smooth, positive, sound at degenerate faces."""
    knots = [clamped(np.arange(1, n - 3) / (n - 3), 3) for n in size]
    wi, wo = chart.to_directions(grid_points(tuple(greville(t, 3) for t in knots)))
    h = wi + wo
    tangent2 = (h[:, 0] ** 2 + h[:, 1] ** 2) / np.maximum(h[:, 2], 0.05) ** 2
    f = np.array([0.2, 0.1, 0.05]) + (0.5 * np.exp(-4 * tangent2))[:, None] * np.array([1.0, 0.9, 0.8])
    net = keep_faces(encoding.encode(f).reshape(*size, 3), chart)
    return SplineBrdf(TensorSpline((3, 3, 3), knots, net), chart, encoding)


@functools.cache
def lofted(brdf: Brdf, chart: Chart, encoding: Encoding, size: tuple[int, int, int]) -> SplineBrdf:
    """A quick fit of a material."""
    shape = (46, 26, 11) if chart is HALF_DIFF else (46, 46, 46)
    table = tabulate(brdf, chart, tuple(np.linspace(0, 1, n) for n in shape))
    made = plan(table, encoding, LOSSES["log_cosine_rms"], (1, 1), degrees=(3, 3, 3), placement="dominant", points=1000)
    return SplineBrdf(made.lofted(size), chart, encoding)


def spread(model: SplineBrdf) -> float:
    """By how much the control points of degenerate faces differ."""
    return face_spread(model.spline.control, model.chart)


# Texts that would be read as numbers, lists or truths among them.
TEXTS = st.text(st.characters(exclude_categories=["C", "Zl", "Zp"]), max_size=8) | st.sampled_from(
    ["", "3", "-1e5", "nan", "true", "a,b", "1;2", "0..20", '"', '"warm"', "it's warm", "a=b", " 7 "]
)
PATHS = (st.text(st.characters(exclude_categories=["C", "Zl", "Zp"]), min_size=1, max_size=8) | TEXTS).map(Path)


@st.composite
def _numbers(draw: st.DrawFn, kind: type, *names: str) -> dict[str, float]:
    """Numbers for these fields, within their limits."""
    out = {}
    for name in names:
        limits = limits_of(kind)[name]
        numbers = st.integers if limits.whole else st.floats
        out[name] = draw(numbers(limits.low, limits.high))
    return out


@st.composite
def _regions(draw: st.DrawFn) -> dict[str, object]:
    out: dict[str, object] = {}
    for name in ("theta_h", "theta_d", "phi_d", "theta_i", "theta_o", "phi"):
        if draw(st.integers(0, 3)) == 0:
            high = limits_of(Gain)[name].high
            out[name] = tuple(sorted(draw(st.tuples(st.floats(0, high), st.floats(0, high)))))
    if draw(st.booleans()):
        out["falloff"] = draw(st.floats(0, 90))
    return out


def _triples(low: float, high: float) -> st.SearchStrategy[tuple[float, float, float]]:
    return st.tuples(*[st.floats(low, high)] * 3)


def _fits() -> st.SearchStrategy[dict[str, object]]:
    bounds = [
        st.fixed_dictionaries({"size": st.tuples(*[st.integers(17, 200)] * 3)}),
        st.fixed_dictionaries({"max_bytes": st.integers(1, 1 << 30)}),
        st.fixed_dictionaries({"max_payload": st.integers(1, 1 << 30)}),
        st.fixed_dictionaries({"tolerance": st.floats(1e-12, 1e12)}),
        st.just({}),
    ]
    how = st.fixed_dictionaries(
        {},
        optional={
            "chart": st.sampled_from(["auto", "in-out", "half-diff"]),
            "encoding": st.sampled_from(["auto", "linear", "root", "log"]),
            "degrees": st.tuples(*[st.integers(0, 16)] * 3),
            "knots": st.sampled_from(["dominant", "free", "averaged", "piegl-tiller", "uniform"]),
            "metric": st.sampled_from(["log_cosine_rms", "fores", "relative_l1"]),
            "precision": st.sampled_from(["auto", "float16", "float32", "float64", "quantised"]),
            "thorough": st.booleans(),
        },
    )
    return st.builds(dict.__or__, st.one_of(bounds), how)


@st.composite
def edits(draw: st.DrawFn) -> Edit:
    """Any edit with any parameters."""
    kind = draw(st.sampled_from(KINDS))
    given: dict[str, object] = {"label": draw(st.none() | TEXTS)}
    if kind in (Gain, Tint, Denoise, Blend):
        given |= draw(_regions())
    if kind in (Gain, Tint):
        given["part"] = draw(st.sampled_from(["all", "body", "highlight"]))
    if kind is Tint:
        if draw(st.booleans()):
            given["rgb"] = draw(_triples(0, 1e6))
        else:
            given["hue"], given["saturation"] = draw(st.floats(1, 180)), draw(st.floats(0, 10))
    if kind in (Broaden, Sharpen):
        given |= {"keep_energy": draw(st.booleans()), "part": draw(st.sampled_from(["all", "highlight"]))}
    if kind is Blend:
        given |= {"partner": draw(PATHS), "t": draw(st.floats(-10, 10) | _triples(-10, 10))}
        given["space"] = draw(st.sampled_from(["net", "linear", "log"]))
    if kind is MovePoints:
        rows = draw(st.lists(st.tuples(st.floats(0, 90), st.floats(0, 90), st.floats(0, 180)), min_size=1, max_size=3))
        given |= {"at": tuple(rows), "rgb": tuple(draw(_triples(0, 1e5)) for _ in rows)}
    if kind is MakePlausible:
        given |= {name: draw(st.booleans()) for name in ("energy", "negative", "reciprocity")}
    if kind is InsertKnots:
        given["at"] = draw(st.floats(0, 1) | st.lists(st.floats(0, 1), min_size=1, max_size=3).map(tuple))
    if kind is Reduce and draw(st.booleans()):
        given |= draw(_numbers(Reduce, "tolerance"))
    if kind is Fit:
        given |= draw(_fits())
    if kind is Store:
        given["precision"] = draw(st.sampled_from(["float16", "float32", "float64", "quantised"]))
        if given["precision"] == "quantised" and draw(st.booleans()):
            given["step"] = draw(st.floats(1e-9, 1e9))
    names = [n for n in ("factor", "amount", "power", "strength", "axis", "by") if n in limits_of(kind)]
    names += ["tolerance"] if kind is RemoveKnots else []
    return kind(**given, **draw(_numbers(kind, *names)))


def quick_edits(partner: Path | None = None) -> st.SearchStrategy[Edit]:
    """Edits that can be made to a small model one after the other."""
    some: list[st.SearchStrategy[Edit]] = [
        st.builds(Gain, factor=st.floats(0.5, 2)),
        st.builds(Gain, factor=st.floats(0.5, 2), theta_h=st.just((0, 20)), falloff=st.floats(1, 30)),
        st.builds(Tint, rgb=_triples(0.5, 1.5)),
        st.builds(Tint, hue=st.floats(1, 40), part=st.sampled_from(["all", "body", "highlight"])),
        st.builds(RaiseGrazing, amount=st.floats(-0.5, 3)),
        st.builds(Denoise, strength=st.floats(0, 1)),
        st.builds(Broaden, factor=st.floats(0.7, 1.4), keep_energy=st.just(False)),
        st.builds(MovePoints, at=st.just((20, 30, 150)), rgb=_triples(0.1, 0.5)),
        st.builds(InsertKnots, axis=st.integers(0, 2), at=st.sampled_from([0.3, (0.2, 0.7)])),
        st.builds(Store, precision=st.sampled_from(["float16", "float32", "quantised"])),
    ]
    if partner is not None:
        some.append(st.builds(Blend, partner=st.just(partner), t=st.floats(0, 1)))
    return st.one_of(some)
