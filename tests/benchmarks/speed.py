"""Speed and memory beside scipy and beside numpy's reading of a file: python -m tests.benchmarks.speed [CHROME.binary].

Needs the extra ``bench``. Every figure is a ratio within this run, medians of several rounds that alternate between
the opponents; without a file the generated chrome takes its place.
"""

import itertools
import os
import resource
import subprocess
import sys
import tempfile
from collections.abc import Callable, Sequence
from pathlib import Path
from statistics import median
from time import perf_counter

import numba
import numpy as np
from rich.console import Console
from rich.table import Table
from scipy.interpolate import BSpline, NdBSpline, make_lsq_spline

import bvbedit
from bvbedit.brdf.goniophotometer import measure
from bvbedit.brdf.materials import material_named
from bvbedit.spline.fitting import loft
from bvbedit.spline.knots import place_knots
from bvbedit.spline.tensor import TensorSpline

SIZE, NODES = (20, 20, 80), (91, 91, 361)
ROUNDS = 5
# numba imports scipy where it finds it, as it does beside the opponents only: 0.2 s that users do not pay.
COMMAND = "import sys; sys.modules['scipy'] = None; from bvbedit.cli import main; main()"


def seconds(work: Callable[[], object]) -> float:
    start = perf_counter()
    work()
    return perf_counter() - start


def medians(*works: Callable[[], object], rounds: int = ROUNDS) -> list[float]:
    """Return the median time of each work, their rounds interleaved so that a noisy minute hits all alike."""
    for work in works:
        work()
    times = [[seconds(work) for work in works] for _ in range(rounds)]
    return [median(t) for t in zip(*times, strict=True)]


def axes() -> list[np.ndarray]:
    return [np.linspace(0, 1, m) for m in NODES]


def spline() -> TensorSpline:
    knots = [place_knots("piegl-tiller", u, n, 3) for u, n in zip(axes(), SIZE, strict=True)]
    return TensorSpline((3, 3, 3), knots, np.random.default_rng(0).uniform(size=(*SIZE, 3)))


def on_threads(count: int, work: Callable[[], object]) -> Callable[[], object]:
    def run() -> None:
        before = numba.get_num_threads()
        numba.set_num_threads(count)
        work()
        numba.set_num_threads(before)

    return run


def scattered(rows: Table) -> None:
    s = spline()
    points = np.random.default_rng(1).uniform(size=(1_000_000, 3))
    theirs = NdBSpline(s.knots, s.control, 3)
    np.testing.assert_allclose(s.evaluate(points[:1000]), theirs(points[:1000]), atol=1e-12)
    ours = lambda: s.evaluate(points)  # noqa: E731
    scipy, one, two = medians(lambda: theirs(points), on_threads(1, ours), on_threads(2, ours))
    rows.add_row("1,000,000 scattered points, 1 thread", f"{scipy / one:.1f} x scipy", ">= 4.5 x")
    rows.add_row("1,000,000 scattered points, 2 threads", f"{scipy / two:.1f} x scipy", ">= 7 x")


def best_order(step: Callable[[np.ndarray, int], np.ndarray], data: np.ndarray) -> tuple[tuple[int, ...], np.ndarray]:
    """Return the quickest order of the axes for a separable opponent, and what it computes."""

    def whole(order: Sequence[int]) -> np.ndarray:
        out = data
        for axis in order:
            out = step(out, axis)
        return out

    orders = list(itertools.permutations(range(3)))
    return min(orders, key=lambda order: seconds(lambda: whole(order))), whole(orders[0])


def grid(rows: Table) -> None:
    s = spline()
    u = axes()

    def step(data: np.ndarray, axis: int) -> np.ndarray:
        return BSpline(s.knots[axis], data, 3, axis=axis)(u[axis])

    order, expected = best_order(step, s.control)
    np.testing.assert_allclose(s.evaluate_grid(u), expected, atol=1e-12)

    def theirs() -> None:
        out = s.control
        for axis in order:
            out = step(out, axis)

    scipy, ours = medians(theirs, lambda: s.evaluate_grid(u))
    rows.add_row("grid of 91 x 91 x 361", f"{scipy / ours:.1f} x scipy's best order", ">= 2.5 x")


def lofting(rows: Table) -> None:
    s = spline()
    u = axes()
    data = s.evaluate_grid(u) + np.random.default_rng(2).normal(0, 0.1, (*NODES, 3))

    def step(values: np.ndarray, axis: int) -> np.ndarray:
        moved = np.moveaxis(values, axis, 0)
        flat = make_lsq_spline(u[axis], moved.reshape(len(moved), -1), s.knots[axis], 3).c
        return np.moveaxis(flat.reshape(-1, *moved.shape[1:]), 0, axis)

    order, expected = best_order(step, data)
    np.testing.assert_allclose(loft(data, u, s.knots, s.degrees).spline.control, expected, atol=1e-8)

    def theirs() -> None:
        out = data
        for axis in order:
            out = step(out, axis)

    scipy, ours = medians(theirs, lambda: loft(data, u, s.knots, s.degrees))
    rows.add_row("lofting 91 x 91 x 361 x 3 to 20 x 20 x 80", f"{scipy / ours:.1f} x scipy", ">= 4 x")
    code = (
        "from tests.benchmarks import speed; from tests.memory import peak_mb;"
        "s = speed.spline(); data = speed.np.random.default_rng(0).uniform(size=(*speed.NODES, 3));"
        "speed.loft(data, speed.axes(), s.knots, s.degrees); print(peak_mb())"
    )
    peak = float(subprocess.run([sys.executable, "-c", code], capture_output=True, check=True, text=True).stdout)
    rows.add_row("its peak memory, imports and table included", f"{peak:.0f} MB", "< 400 MB")


def command(*arguments: str) -> tuple[float, float]:
    """Return the wall and CPU seconds of ``bvbedit`` with ``arguments``."""
    before = resource.getrusage(resource.RUSAGE_CHILDREN)
    wall = seconds(lambda: subprocess.run([sys.executable, "-c", COMMAND, *arguments], capture_output=True, check=True))
    after = resource.getrusage(resource.RUSAGE_CHILDREN)
    return wall, after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime


def commands(rows: Table, chrome: Path, folder: Path) -> None:
    model = folder / "out.bvb"

    def read_and_log() -> None:
        raw = np.fromfile(chrome, "<f8", offset=12)
        with np.errstate(invalid="ignore", divide="ignore"):
            np.log(raw)

    paper = "--chart in-out --encoding linear --size 20,20,80 --knots piegl-tiller --precision float32"
    fits = {
        "the paper's fit": (paper.split(), "<= 4 x {0:.3f} + 1.5 = {1:.2f} s"),
        "automatic fit, the knee": ([], "<= 3 s"),
        "automatic fit, 48 KiB": (["--max-bytes", "49152"], "<= 3 s"),
    }
    start = median(command("--version")[0] for _ in range(ROUNDS))
    for label, (options, promised) in fits.items():
        fit = ["fit", str(chrome), str(model), *options]
        command(*fit)
        read_and_log()
        rounds = [(seconds(read_and_log), command(*fit)[0] - start) for _ in range(ROUNDS)]
        base, wall = (median(t) for t in zip(*rounds, strict=True))
        rows.add_row(f"{label} of chrome, start to file", f"{wall:.2f} s", promised.format(base, 4 * base + 1.5))
    peak = resource.getrusage(resource.RUSAGE_CHILDREN).ru_maxrss / 1024
    rows.add_row("their peak memory", f"{peak:.0f} MB", "< 700 MB")
    for arguments in (["--help"], ["info", str(model)]):
        command(*arguments)
        cpu = median(command(*arguments)[1] for _ in range(ROUNDS))
        rows.add_row(f"bvbedit {arguments[0]}", f"{cpu:.2f} s of CPU", "< 0.3 s")


def main() -> None:
    rows = Table(
        "what",
        "measured",
        "promised",
        title=f"{os.cpu_count()} CPUs, numpy {np.__version__}, numba {numba.__version__}",
    )
    scattered(rows)
    grid(rows)
    lofting(rows)
    with tempfile.TemporaryDirectory() as folder:
        chrome = Path(sys.argv[1]) if len(sys.argv) > 1 else Path(folder) / "chrome.binary"
        if len(sys.argv) == 1:
            bvbedit.save(measure(material_named("chrome").brdf, "merl"), chrome)
        commands(rows, chrome, Path(folder))
    Console(width=120).print(rows)


if __name__ == "__main__":
    main()
