"""Which configuration to use for a material, by what a study measured: the smallest, or the best within a bound."""

import math
import re
import shlex
from collections.abc import Sequence
from dataclasses import asdict, dataclass
from difflib import get_close_matches
from pathlib import Path
from typing import Any

import numpy as np

from bvbedit.errors import BvbError
from bvbedit.study.frontier import frontier
from bvbedit.study.quantities import BYTES, ERROR, EVALUATION, Quantity, pae, render_seconds
from bvbedit.study.table import Row, Table

# How a configuration that is bound by bytes rather than by size tells it.
BOUND_BY_BYTES = re.compile(r"\b([1-9]\d{0,9}) bytes$")


@dataclass(frozen=True)
class Choice:
    """A configuration with what it costs and what it is off by."""

    configuration: str
    error: float
    """Log-cosine RMS, the larger of grid and nodes; with a scene the PAE of its picture."""
    file_bytes: int | None
    nanoseconds: float | None
    """Per evaluation."""
    render_seconds: float | None
    """Of the scene's picture; None without a scene."""
    command: str
    """The command line that makes the model."""


@dataclass(frozen=True)
class Advice:
    """What to use, and what stands beside it on the frontier of error over cost."""

    material: str
    scene: str | None
    bound: str
    """max_error, max_bytes or max_time."""
    value: float
    choice: Choice
    cheaper: Choice | None
    """The next that costs less, and is worse; None if there is none."""
    better: Choice | None
    """The next that is better, and costs more; None if there is none."""
    analytic: str | None
    """The best analytic model within the bound, where it is better than the choice by what was asked for."""

    def to_dict(self) -> dict[str, Any]:
        """Return it as JSON can hold it."""
        return asdict(self)


def recommend(
    table: Table,
    material: str,
    *,
    scene: str | None = None,
    max_error: float | None = None,
    max_bytes: float | None = None,
    max_time: float | None = None,
    source: str | None = None,
) -> Advice:
    """Return which spline to use for ``material``, a name in ``table``.

    With ``max_error`` the smallest file whose error is within it; with ``max_bytes``, and with ``max_time``
    (nanoseconds per evaluation), the least error within it. The error is log-cosine RMS, the larger of grid and nodes;
    with a ``scene`` the largest error (PAE) of its picture in 0 ... 1, and ``max_time`` is its seconds. Of equal ones
    that of less error, of less cost, the first in the table. Cells in which error or cost is unknown do not count.
    ``source`` is the file that commands name. Raises BvbError for an unknown material or scene, none or several bounds,
    one that is no number above zero, and one that nothing meets.
    """
    bound, limit = _bound({"max_error": max_error, "max_bytes": max_bytes, "max_time": max_time})
    if material not in table.materials:
        raise BvbError(_unknown(table, material))
    if scene is not None and scene not in table.scenes:
        scenes = f"It has {', '.join(table.scenes)}" if table.scenes else "It has none: leave --scene out"
        raise BvbError(f"The study has no scene {scene!r}. {scenes}.")
    error = ERROR if scene is None else pae(scene)
    cost = BYTES if bound != "max_time" else EVALUATION if scene is None else render_seconds(scene)
    rows = [row for row in table.done if row.material == material]
    known = _known(rows, "spline", cost, error)
    if not known:
        raise BvbError(f"No cell of {material} in the study has both {_words(error)} and {_words(cost)}. Run it again.")
    costs, errors = _values(known, cost), _values(known, error)
    edge = frontier(costs, errors)
    within = _within(edge, costs, errors, bound, limit)
    if within is None:
        raise BvbError(_unmet(material, known, edge, costs, errors, bound, limit, cost, error))
    file = source if source is not None else f"{material}.binary"

    def choice(place: int) -> Choice | None:
        return _choice(known[edge[place]], error, scene, file) if 0 <= place < len(edge) else None

    chosen = choice(within)
    assert chosen is not None
    models = _known(rows, "analytic", cost, error)
    rival = _rival(models, cost, error, bound, limit, (costs[edge[within]], errors[edge[within]]))
    return Advice(material, scene, bound, limit, chosen, choice(within - 1), choice(within + 1), rival)


def command_of(row: Row, source: str, target: str) -> str:
    """Return the command line that fits the model of ``row`` to the file ``source``.

    A configuration whose name ends in "16384 bytes" is bound by bytes, any other one by its size. Degrees that differ
    from axis to axis are told as a comment, for the command knows one for all.
    """
    words = ["bvbedit", "fit", source, target]
    for option, value in (("--chart", row.chart), ("--encoding", row.encoding), ("--knots", row.knots)):
        if value is not None:
            words += [option, value]
    bytes_bound = BOUND_BY_BYTES.search(row.configuration)
    if bytes_bound is not None:
        words += ["--max-bytes", bytes_bound[1]]
    elif row.size is not None:
        words += ["--size", row.size.replace("x", ",")]
    degrees = [] if row.degrees is None else row.degrees.split("x")
    if len(set(degrees)) == 1:
        words += ["--degree", degrees[0]]
    if row.precision is not None:
        words += ["--precision", row.precision]
    line = shlex.join(words)
    return line if len(set(degrees)) < 2 else f"{line} # with degrees {', '.join(degrees)}, by bvbedit.fit"


def _bound(given: dict[str, float | None]) -> tuple[str, float]:
    named = {name: value for name, value in given.items() if value is not None}
    if len(named) != 1:
        options = [f"--{name.replace('_', '-')}" for name in (named or given)]
        said = "exclude each other. Give one of them" if named else "are missing. Give one of them"
        raise BvbError(f"{', '.join(options[:-1])} and {options[-1]} {said}.")
    (name, value), *_ = named.items()
    if not math.isfinite(value) or value < 0 or (value == 0 and name != "max_error"):
        raise BvbError(f"--{name.replace('_', '-')} is {value!r}. Give a number above zero.")
    return name, float(value)


def _unknown(table: Table, material: str) -> str:
    names = table.materials
    close = get_close_matches(material, names, n=3, cutoff=0.5)
    if close:
        return f"{material!r} is not in the study. Did you mean {' or '.join(close)}? It has {len(names)} materials."
    listed = f"{', '.join(names[:8])}{' ...' if len(names) > 8 else ''}" or "none"
    return f"{material!r} is not in the study, which has {listed}. Name one of these, or run bvbedit study with it."


def _known(rows: Sequence[Row], kind: str, cost: Quantity, error: Quantity) -> list[Row]:
    return [r for r in rows if r.kind == kind and cost.value(r) is not None and error.value(r) is not None]


def _values(rows: Sequence[Row], quantity: Quantity) -> Any:
    return np.array([quantity.value(row) for row in rows], dtype=np.float64)


def _within(edge: Sequence[int], costs: Any, errors: Any, bound: str, limit: float) -> int | None:
    """Return the place on the frontier of the answer: its first point that is good enough, or its last affordable."""
    if bound == "max_error":
        return next((n for n, i in enumerate(edge) if errors[i] <= limit), None)
    return max((n for n, i in enumerate(edge) if costs[i] <= limit), default=None)


def _unmet(
    material: str,
    rows: Sequence[Row],
    edge: Sequence[int],
    costs: Any,
    errors: Any,
    bound: str,
    limit: float,
    cost: Quantity,
    error: Quantity,
) -> str:
    if bound == "max_error":
        at = edge[-1]
        least = f"an error of {errors[at]:.4g}, of {rows[at].configuration!r} ({costs[at]:,.0f} bytes)"
        return (
            f"Nothing measured for {material} has {_words(error)} within {limit:g}: the least is {least}. Allow more."
        )
    at = edge[0]
    least = f"{costs[at]:,.4g} {cost.unit}" if bound == "max_time" else f"{costs[at]:,.0f} bytes"
    return (
        f"Nothing measured for {material} has {_words(cost)} within {limit:,g} {cost.unit}: the least is {least}, of "
        f"{rows[at].configuration!r}. Allow more."
    )


def _words(quantity: Quantity) -> str:
    return {"error": "a log-cosine RMS", "file_bytes": "a file", "evaluation": "an evaluation"}.get(
        quantity.name, f"a {quantity.label}"
    )


def _rival(
    models: Sequence[Row], cost: Quantity, error: Quantity, bound: str, limit: float, answer: tuple[float, float]
) -> str | None:
    """Return in words the analytic model that would be the answer, were it a file that can be edited."""
    costs, errors = _values(models, cost), _values(models, error)
    edge = frontier(costs, errors)
    place = _within(edge, costs, errors, bound, limit)
    if place is None:
        return None
    at = edge[place]
    goal = costs[at] < answer[0] if bound == "max_error" else errors[at] < answer[1]
    return f"{models[at].configuration}: error {errors[at]:.4g}, {costs[at]:,.4g} {cost.unit}" if goal else None


def _choice(row: Row, error: Quantity, scene: str | None, source: str) -> Choice:
    found = error.value(row)
    assert found is not None
    seconds = None if scene is None else render_seconds(scene).value(row)
    target = f"{Path(source).stem}.bvb"
    return Choice(
        row.configuration, found, row.file_bytes, EVALUATION.value(row), seconds, command_of(row, source, target)
    )
