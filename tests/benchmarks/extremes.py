"""The spline kernel at the extremes against 50 digits, in ulps of the largest control point.

python -m tests.benchmarks.extremes prints every operation with every extreme, or the message of the refusal; then the
same in short, as README.md has it.
"""

from collections.abc import Iterable

import numpy as np
from rich.box import MARKDOWN
from rich.console import Console
from rich.table import Table

from bvbedit.spline.operations import join, product
from tests.spline.test_extremes import (
    KNOTS,
    MANY,
    NETS,
    OPERATIONS,
    as_exact,
    clamped,
    curve,
    exact,
    measured,
    sampled_error,
)

LOW, HIGH = (0, 1, 2, 3), (5, 8, 12, 16)
USUAL_NET, *OTHER_NETS = NETS
GROUPS = {
    "ordinary knots": ["ordinary knots"],
    "n = p + 1, knots p + 1 times": ["n = p + 1", "knots p + 1 times"],
    "knots one ulp apart": ["knots one ulp apart", "one ulp apart, p + 1 times", "one ulp from the ends"],
    "domains [1e6, 1e6 + 1], [-1e-9, 1e-9]": ["domain [1e6, 1e6 + 1]", "domain [-1e-9, 1e-9]"],
    "control points 1e300, 1e-300, 1e4 beside 1e-5, 0": OTHER_NETS,
}
Found = list[float | str]


def found(operation: str, degrees: Iterable[int], extreme: str) -> Found:
    knots, net = (extreme, USUAL_NET) if extreme in KNOTS else ("ordinary knots", extreme)
    return [measured(operation, p, knots, net) for p in degrees if p in OPERATIONS[operation].degrees]


def shown(results: Found, whole: bool = True) -> str:
    """Return the largest error and the message of a refusal, if ``whole``, else that there is one."""
    numbers = [r for r in results if not isinstance(r, str)]
    told = [f"{max(numbers):,.0f}" if max(numbers) >= 10 else f"{max(numbers):.1f}"] if numbers else []
    refusals = [r for r in results if isinstance(r, str)]
    return " or ".join(told + ([f"refused: {refusals[0]}" if whole else "refused"] if refusals else []))


def many_knots() -> dict[str, float]:
    """Return the errors with 100,000 knots on one axis, at sampled control points."""
    rng = np.random.default_rng(0)
    s = curve(3, clamped(3, rng.uniform(0, 1, MANY - 8)), rng.uniform(-1, 1, MANY - 4))
    f, line = as_exact(s), curve(1, [0, 0, 1, 1], [-1.0, 1.0])
    back = s.insert_knots(0, [0.1, 0.5, 0.5, 0.9]).remove_knots(0, 1e-14)[0]
    return {
        "insert knots": sampled_error(s.insert_knots(0, np.sort(rng.uniform(0, 1, 20_000))), f),
        "split": max(sampled_error(part, f) for part in s.split(0, 0.37)),
        "restrict": sampled_error(s.restrict([(0.2, 0.7)]), f),
        "elevate to 16": sampled_error(s.elevate(0, 13), f),
        "elevate, reduce": sampled_error(s.elevate(0, 2).reduce(0, 2)[0], f),
        "insert, remove": sampled_error(back, f),
        "split, join": sampled_error(join(*s.split(0, 0.37), 0)[0], f),
        "product": sampled_error(product(s, line), exact.product(f, as_exact(line))),
    }


def main() -> None:
    every = Table(
        "operation", "extreme", "degrees 0 ... 3", "4 ... 16", title="errors in ulps of the largest control point"
    )
    short = Table("ulps of the largest control point, degrees 0 ... 3 / 4 ... 16", box=MARKDOWN)
    for group in (*GROUPS, f"{MANY:,} knots, cubic"):
        short.add_column(group)
    many = many_knots()
    for operation in OPERATIONS:
        cells = []
        for group in GROUPS.values():
            low, high = [], []
            for extreme in group:
                here = found(operation, LOW, extreme), found(operation, HIGH, extreme)
                every.add_row(operation, extreme, *map(shown, here))
                low += here[0]
                high += here[1]
            parts = list(dict.fromkeys(shown(r, whole=False) for r in (low, high)))
            cells.append(" / ".join(parts))
        every.add_section()
        short.add_row(operation, *cells, f"{many[operation]:.1f}" if operation in many else "")
    Console(width=180).print(every)
    Console(width=300).print(short)


if __name__ == "__main__":
    main()
