"""Speed of the CAGD kernel beside pantr and beside a copy: python -m tests.benchmarks.kernel.

Needs the extra ``bench``. Ratios within this run, medians of rounds that alternate between the opponents, on the cubic
20 x 20 x 80 x 3 net. Results are compared before they are timed.
"""

import os

import numpy as np
from pantr.bspline import Bspline, BsplineSpace, BsplineSpace1D
from rich.console import Console
from rich.table import Table

from bvbedit.spline.compatible import blend
from bvbedit.spline.knots import place_knots
from bvbedit.spline.tensor import TensorSpline
from tests.benchmarks import speed

INSERTED = np.sort(np.random.default_rng(1).uniform(0.01, 0.99, 20))
TOLERANCE = 1e-10
# Milliseconds each: many rounds cost nothing and calm a noisy machine.
ROUNDS = 41


def opponent(spline: TensorSpline) -> Bspline:
    space = BsplineSpace([BsplineSpace1D(t, p) for t, p in zip(spline.knots, spline.degrees, strict=True)])
    return Bspline(space, spline.control)


def on_axis(values: np.ndarray, axis: int) -> list[np.ndarray | None]:
    return [values if a == axis else None for a in range(3)]


def insertion_and_removal(rows: Table) -> None:
    spline = speed.spline()
    theirs = opponent(spline)
    for axis in range(3):
        new = on_axis(INSERTED, axis)
        fine, their_fine = spline.insert_knots(axis, INSERTED), theirs.insert_knots(new)
        np.testing.assert_allclose(fine.control, their_fine.control_points, atol=1e-13)
        their_time, our_time = speed.medians(
            lambda new=new: theirs.insert_knots(new),
            lambda axis=axis: spline.insert_knots(axis, INSERTED),
            rounds=ROUNDS,
        )
        rows.add_row(f"insert 20 knots, axis {axis}", *told(their_time, our_time))
        back, bound = fine.remove_knots(axis, TOLERANCE)
        assert back.size == spline.size
        assert bound < TOLERANCE
        np.testing.assert_allclose(their_fine.remove_knots(new, num=1, tol=TOLERANCE).control_points, back.control)
        their_time, our_time = speed.medians(
            lambda new=new, fine=their_fine: fine.remove_knots(new, num=1, tol=TOLERANCE),
            lambda axis=axis, fine=fine: fine.remove_knots(axis, TOLERANCE),
            rounds=ROUNDS,
        )
        rows.add_row(f"remove them, finding which, axis {axis}", *told(their_time, our_time))


def elevation(rows: Table) -> None:
    spline = speed.spline()
    theirs = opponent(spline)

    def ours() -> TensorSpline:
        return spline.elevate(0).elevate(1).elevate(2)

    np.testing.assert_allclose(ours().control, theirs.elevate_degree(1).control_points, atol=1e-12)
    rows.add_row(
        "elevate all three axes by one", *told(*speed.medians(lambda: theirs.elevate_degree(1), ours, rounds=ROUNDS))
    )


def blending(rows: Table) -> None:
    a = speed.spline()
    knots = [place_knots("averaged", u, n, 3) for u, n in zip(speed.axes(), speed.SIZE, strict=True)]
    b = TensorSpline(a.degrees, knots, a.control[::-1])
    whole = blend(a, b, 0.3)
    copy, ours = speed.medians(whole.control.copy, lambda: blend(a, b, 0.3), rounds=ROUNDS)
    rows.add_row(
        f"blend two nets over different knots, to {' x '.join(map(str, whole.size))}",
        f"{1e3 * ours:.2f} ms",
        f"{1e3 * copy:.2f} ms (copy)",
        f"{ours / copy:.1f} copies",
        "< 30 copies",
    )


def told(theirs: float, ours: float) -> tuple[str, str, str, str]:
    return f"{1e3 * ours:.2f} ms", f"{1e3 * theirs:.2f} ms", f"{theirs / ours:.1f} x as fast", ">= 1 x"


def main() -> None:
    rows = Table(
        "what", "bvbedit", "pantr", "ratio", "promised", title=f"{os.cpu_count()} CPUs, numpy {np.__version__}"
    )
    insertion_and_removal(rows)
    elevation(rows)
    blending(rows)
    Console(width=120).print(rows)


if __name__ == "__main__":
    main()
