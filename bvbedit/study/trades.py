"""What is traded for what: clouds of (cost, error) per class and per material, their frontiers, what halving costs."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from bvbedit.brdf.geometry import Floats
from bvbedit.study.frontier import apart, cost_of_halving, frontier, knee, mean_cost_of_halving
from bvbedit.study.plots import Numbers
from bvbedit.study.quantities import BYTES, ERROR, EVALUATION, Quantity, pae, render_seconds
from bvbedit.study.table import Row, Table


@dataclass(frozen=True)
class Trade:
    """An error that can be made smaller at a cost."""

    name: str
    title: str
    cost: Quantity
    error: Quantity


@dataclass(frozen=True)
class Point:
    """A configuration for a material, or on the mean over materials."""

    configuration: str
    series: str
    analytic: bool
    cost: float
    error: float


@dataclass(frozen=True)
class Cloud:
    """What can be had for a material or a class of them; ``edge`` are the points of the frontier, costs rising."""

    label: str
    points: tuple[Point, ...]
    edge: tuple[Point, ...]
    clear: tuple[Point, ...]
    """Those points of the frontier that clearly differ in cost; the knee is one of them."""
    knee: Point | None
    dropped: tuple[str, ...] = ()
    """Configurations that are not known for more than half of the materials of the class."""

    @property
    def curve(self) -> tuple[Floats, Floats]:
        """Costs (n,) and errors (n,) of the points that clearly differ in cost."""
        return np.array([p.cost for p in self.clear]), np.array([p.error for p in self.clear])


def trades(table: Table) -> list[Trade]:
    """Return what is traded in ``table``: error for bytes and evaluation time, image error for render time."""
    found = [
        Trade("error-over-bytes", "error over bytes", BYTES, ERROR),
        Trade("error-over-evaluation", "error over evaluation time", EVALUATION, ERROR),
    ]
    for scene in table.scenes:
        name, title = f"image-over-render-{scene}", f"image error over render time, “{scene}”"
        found.append(Trade(name, title, render_seconds(scene), pae(scene)))
    return found


def cloud(label: str, points: Sequence[Point], dropped: Sequence[str] = ()) -> Cloud:
    """Return ``points`` with their frontier, which is that of the splines alone: analytic models are no family."""
    splines = [p for p in points if not p.analytic]
    costs, errors = np.array([p.cost for p in splines]), np.array([p.error for p in splines])
    edge = tuple(splines[i] for i in frontier(costs, errors))
    clear = [edge[i] for i in apart(np.array([p.cost for p in edge]))]
    at = knee(np.array([p.cost for p in clear]), np.array([p.error for p in clear]))
    return Cloud(label, tuple(points), edge, tuple(clear), None if at is None else clear[at], tuple(dropped))


def cloud_of_material(table: Table, material: str, trade: Trade) -> Cloud:
    """Return what can be had for one material."""
    return cloud(material, [p for row in table.done if row.material == material and (p := _point(row, trade))])


def cloud_of_class(table: Table, label: str, materials: Sequence[str], trade: Trade) -> Cloud:
    """Return what can be had for ``materials`` on the geometric mean.

    A configuration counts if it is known for more than half of the materials of which any is. Where a cell is missing,
    see ``fair_means``.
    """
    gathered: dict[str, dict[str, Point]] = {}
    for row in table.done:
        if row.material in materials and (point := _point(row, trade)):
            gathered.setdefault(row.configuration, {})[row.material] = point
    have = list(dict.fromkeys(name for points in gathered.values() for name in points))
    kept = {name: points for name, points in gathered.items() if 2 * len(points) > len(have)}
    costs, errors = (
        fair_means([[getattr(p[m], what) if m in p else np.nan for m in have] for p in kept.values()])
        for what in ("cost", "error")
    )
    means = []
    for (name, points), cost, error in zip(kept.items(), costs, errors, strict=True):
        first = next(iter(points.values()))
        means.append(Point(name, first.series, first.analytic, float(cost), float(error)))
    return cloud(label, means, [name for name in gathered if name not in kept])


def fair_means(values: Sequence[Sequence[float]]) -> Floats:
    """Return the geometric mean of each of the rows (n, k) of positive ``values``, nan being unknown.

    Of rows that are complete it is that. Where values are missing, hard columns would make the mean of some rows
    larger than that of others: the product of a row's and a column's factor is fitted to the logarithms instead, and
    the mean taken over all columns. Two rows are comparable if more than half of each is known.
    """
    if len(values) == 0:
        return np.empty(0)
    logs = np.log(np.asarray(values, dtype=np.float64))
    known = np.isfinite(logs)
    if known.all():
        return np.asarray(np.exp(logs.mean(axis=1)))
    i, j = np.nonzero(known)
    n, k = logs.shape
    design = np.zeros((len(i), n + k))
    design[np.arange(len(i)), i] = 1.0
    design[np.arange(len(i)), n + j] = 1.0
    factors = np.linalg.lstsq(design, logs[known], rcond=None)[0]
    return np.asarray(np.exp(factors[:n] + factors[n:].mean()))


def _point(row: Row, trade: Trade) -> Point | None:
    cost, error = trade.cost.floored(row), trade.error.floored(row)
    if cost is None or error is None or cost <= 0:
        return None
    return Point(row.configuration, row.series, row.kind == "analytic", cost, error)


def halving_numbers(clouds: Sequence[tuple[Trade, Cloud]]) -> Numbers:
    """Return what half of the error costs, as a factor: on the mean of each frontier, at its ends and at its knee."""
    lines = []
    for trade, found in clouds:
        costs, errors = found.curve
        if len(costs) == 0:
            continue
        at_knee = None if found.knee is None else cost_of_halving(costs, errors, found.knee.error)
        lines.append(
            (
                found.label,
                trade.title,
                trade.cost.unit,
                float(costs[0]),
                float(costs[-1]),
                float(errors[0]),
                float(errors[-1]),
                mean_cost_of_halving(costs, errors),
                cost_of_halving(costs, errors, float(errors[0])),
                at_knee,
                # A factor of two that only just fits would be lost to rounding.
                cost_of_halving(costs, errors, min(2 * float(errors[-1]) * (1 + 1e-12), float(errors[0]))),
            )
        )
    header = (
        "class",
        "trade",
        "unit of cost",
        "least cost",
        "largest cost",
        "largest error",
        "least error",
        "cost of halving, mean",
        "from the largest error",
        "from the knee",
        "to the least error",
    )
    return Numbers(header, tuple(lines))
