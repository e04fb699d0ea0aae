"""Running studies: rows are what they say, and the same whoever makes them, at once or after an interruption."""

import os
import signal
import subprocess
import sys
import time
from contextlib import suppress
from pathlib import Path

import numpy as np
import pytest

import bvbedit
from bvbedit import BvbError
from bvbedit.brdf.goniophotometer import measure
from bvbedit.brdf.materials import material_named
from bvbedit.brdf.measured import MeasuredBrdf
from bvbedit.brdf.metrics import estimate
from bvbedit.io.bvb import dumps
from bvbedit.study.plan import Pictures, Plan, Series, read_plan
from bvbedit.study.run import CELLS, materials_of, run_study
from bvbedit.study.table import RESULTS, read_table, times

PLAN = Plan(
    series=(
        Series("half", chart="half-diff", encoding="root", size=((6, 5, 4), (8, 6, 4))),
        Series("never", chart="half-diff", encoding="root", size=(95, 95, 95)),
    ),
    pictures=Pictures(("sphere",), side=16, spp=2),
    stride=15,
)


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    """Return a folder with two small measurements: every third node along each axis."""
    out = tmp_path_factory.mktemp("materials")
    for name in ("copper", "grey-felt"):
        read = measure(material_named(name).brdf, "half-diff", 0.02, 1)
        few = tuple(axis[::3] for axis in read.axes)
        coarse = MeasuredBrdf(read.values[::3, ::3, ::3], read.valid[::3, ::3, ::3], few, read.chart)
        bvbedit.save(coarse, out / f"{name}.npz")
    return out


@pytest.fixture(scope="module")
def rows(folder, tmp_path_factory):
    return run_study(PLAN, materials_of([folder]), tmp_path_factory.mktemp("study"))


def without_times(rows):
    return [{k: v for k, v in row.to_dict().items() if k not in times(["sphere"])} for row in rows]


def test_rows_are_what_was_made(folder, rows):
    assert [row.material for row in rows] == ["copper"] * 3 + ["grey-felt"] * 3
    row = rows[1].to_dict()
    brdf = bvbedit.load(folder / "copper.npz")
    model = next(c for c in PLAN.configurations if c.name == row["configuration"]).fit.fitted(brdf)
    assert row["size"] == "8x6x4"
    assert row["file_bytes"] == len(dumps(model))
    found = estimate(bvbedit.io.bvb.loads(dumps(model)), brdf, stride=PLAN.stride)
    assert row["grid_log_cosine_rms"] == pytest.approx(found.grid.log_cosine_rms, rel=1e-9)
    assert row["e_max"] == pytest.approx(found.paper.e_max, rel=1e-9)
    assert row["r_max"] >= row["r_avg"] > 0
    assert 0 <= row["sphere_mae"] <= row["sphere_pae"] <= 1
    assert row["numbers"] == 8 * 6 * 4 * 3 + (8 + 6 + 4 - 3 * 4)
    assert row["evaluations_per_second"] > 0


def test_what_cannot_be_made_is_a_row_with_its_reason(rows):
    for row in rows[2::3]:
        assert row.status == "failed"
        assert "more than the data carry" in row.reason
        assert row.file_bytes is None


def test_one_process_and_two_make_the_same_table(folder, rows, tmp_path):
    again = run_study(PLAN, materials_of([folder]), tmp_path / "two", jobs=2)
    assert without_times(again) == without_times(rows)


def test_a_cluster_makes_the_same_table(folder, rows, tmp_path):
    distributed = pytest.importorskip("distributed", reason="the package distributed is not installed")
    with distributed.LocalCluster(
        n_workers=2, threads_per_worker=1, dashboard_address=None, host="127.0.0.1"
    ) as cluster:
        again = run_study(PLAN, materials_of([folder]), tmp_path / "dask", dask=cluster.scheduler_address)
    assert without_times(again) == without_times(rows)


def test_nobody_answers_at_an_address(folder, tmp_path, monkeypatch):
    pytest.importorskip("distributed", reason="the package distributed is not installed")
    monkeypatch.setattr("bvbedit.study.run.PATIENCE", 1)
    with pytest.raises(BvbError, match="No Dask scheduler answers at"):
        run_study(PLAN, materials_of([folder]), tmp_path / "dask", dask="tcp://127.0.0.1:9")


def test_killed_in_the_middle_it_goes_on_to_the_same_table(folder, rows, tmp_path):
    out = tmp_path / "killed"
    plan = tmp_path / "plan.toml"
    plan.write_text(
        """
        stride = 15
        [pictures]
        side = 16
        spp = 2
        [[series]]
        name = "half"
        chart = "half-diff"
        encoding = "root"
        size = [[6, 5, 4], [8, 6, 4]]
        [[series]]
        name = "never"
        chart = "half-diff"
        encoding = "root"
        size = [95, 95, 95]
        """
    )
    command = [sys.executable, "-m", "bvbedit", "study", str(folder), "--plan", str(plan), "--out", str(out)]
    child = subprocess.Popen(command, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL, start_new_session=True)
    try:
        wait_for(lambda: len(list((out / CELLS).glob("*.json"))) >= 2, child)
        workers = [int(pid) for pid in Path(f"/proc/{child.pid}/task/{child.pid}/children").read_text().split()]
        child.kill()
        child.wait()
        # Who works for it ends as well, and gives its memory back.
        assert workers
        end = time.monotonic() + 60
        while any(map(runs, workers)):
            assert time.monotonic() < end
            time.sleep(0.02)
    finally:
        with suppress(ProcessLookupError):
            os.killpg(child.pid, signal.SIGKILL)
    assert not (out / RESULTS).exists()
    before = {path: path.stat().st_mtime_ns for path in (out / CELLS).glob("*.json")}
    assert 2 <= len(before) < 6
    subprocess.run(command, check=True, capture_output=True)
    assert all(path.stat().st_mtime_ns == changed for path, changed in before.items())
    assert without_times(read_table(out / RESULTS).rows) == without_times(rows)


def runs(pid):
    """Return whether a process is there, and more than a line of the system's table."""
    try:
        return Path(f"/proc/{pid}/stat").read_text().rpartition(")")[2].split()[0] != "Z"
    except FileNotFoundError:
        return False


def wait_for(condition, child):
    """Wait until something is so, as long as the child lives."""
    while not condition():
        assert child.poll() is None, "the study ended by itself"
        time.sleep(0.02)


def test_results_of_another_plan_are_left_alone(folder, tmp_path):
    out = tmp_path / "study"
    few = Plan(series=(Series("s", chart="half-diff", encoding="root", size=(4, 4, 4)),), pictures=Pictures((), 8, 1))
    run_study(few, materials_of([folder / "copper.npz"]), out)
    table = (out / RESULTS).read_text()
    other = Plan(series=(Series("t", chart="half-diff", encoding="root", size=(5, 4, 4)),), pictures=Pictures((), 8, 1))
    with pytest.raises(BvbError, match="other plan"):
        run_study(other, materials_of([folder / "copper.npz"]), out)
    with pytest.raises(BvbError, match="other materials"):
        run_study(few, materials_of([folder]), out)
    assert (out / RESULTS).read_text() == table


@pytest.mark.parametrize(
    ("paths", "word"),
    [
        (["nothing.binary"], "does not exist"),
        (["empty"], "no materials"),
        ([], "No materials"),
        (["gold"], "no sample"),
    ],
)
def test_what_is_no_material_is_told(tmp_path, monkeypatch, paths, word):
    (tmp_path / "empty").mkdir()
    monkeypatch.chdir(tmp_path)
    with pytest.raises(BvbError, match=word):
        materials_of([Path(path) for path in paths])


def test_the_database_is_measured_with_the_noise_of_each():
    sources = materials_of([Path("database")])
    assert len(sources) == 100
    assert len({(source.noise, source.seed) for source in sources.values()}) == 100
    name, source = next(iter(sources.items()))
    assert name == source.sample
    np.testing.assert_array_equal(source.read().values, material_named(name).measured("merl").values)


def test_the_sample_s_plan_is_made_whole(folder, tmp_path):
    plan = read_plan(Path(__file__).parents[2] / "samples" / "study.toml")
    rows = run_study(plan, materials_of([folder / "copper.npz"]), tmp_path / "study", jobs=2)
    assert [row.status for row in rows] == ["done"] * len(plan.configurations)
    by_name = {row.configuration: row for row in rows}
    # What the plan is to show: dominant points along the highlight beat the paper's nets at a fraction of their bytes.
    paper, ours = by_name["paper 10x10x40"], by_name["half-diff root 6144 bytes"]
    assert ours.nodes_log_cosine_rms < paper.nodes_log_cosine_rms
    assert ours.file_bytes < paper.file_bytes / 4


def test_materials_of_one_name_are_told_apart(folder, tmp_path):
    (tmp_path / "copper.npz").write_bytes((folder / "copper.npz").read_bytes())
    names = list(materials_of([folder / "copper.npz", tmp_path / "copper.npz", Path("copper")]))
    assert len(set(names)) == 3


def test_a_damaged_measurement_is_a_row(folder, tmp_path):
    broken = tmp_path / "broken.npz"
    broken.write_bytes((folder / "copper.npz").read_bytes()[:1000])
    plan = Plan(series=(Series("s", chart="half-diff", encoding="root", size=(4, 4, 4)),), pictures=Pictures((), 8, 1))
    (row,) = run_study(plan, materials_of([broken]), tmp_path / "study")
    assert row.status == "failed"
    assert "broken.npz" in row.reason


def row_or_lost(task):
    """A row without measuring; where the net is 5 x 4 x 4 the process ends, as when memory runs out."""
    if task.configuration.fit.size == (5, 4, 4):
        os._exit(1)
    told = {"material": task.material, "configuration": task.configuration.name, "series": "s", "kind": "spline"}
    return {**told, "status": "done", "file_bytes": os.getpid()}


@pytest.mark.parametrize("jobs", [1, 2])
def test_a_lost_process_costs_its_own_cell_alone(jobs, folder, tmp_path, monkeypatch):
    monkeypatch.setattr("bvbedit.study.run.measured", row_or_lost)
    sizes = ((4, 4, 4), (5, 4, 4), *((6, 4, n) for n in range(4, 12)))
    plan = Plan(series=(Series("s", chart="half-diff", encoding="root", size=sizes),), pictures=Pictures((), 8, 1))
    rows = run_study(plan, materials_of([folder / "copper.npz"]), tmp_path / "study", jobs=jobs)
    assert [row.status for row in rows] == ["done", "failed", *["done"] * 8]
    assert "the process ended" in rows[1].reason
    # The first processes, one for each cell that was in hand with the lost one, and as many as at first for all others.
    assert len({row.file_bytes for row in rows if row.done}) <= jobs + (jobs - 1) + jobs


def test_a_full_disk_ends_it_in_one_line_and_loses_nothing(folder, tmp_path, monkeypatch):
    from bvbedit.study import run as running

    two = Series("s", chart="half-diff", encoding="root", size=((4, 4, 4), (5, 4, 4)))
    plan = Plan(series=(two,), pictures=Pictures((), 8, 1))
    write, written = running._write, []

    def full(place, row):
        if written:
            raise BvbError(f"{place} cannot be written: no space left on device. Make room.")
        written.append(place)
        write(place, row)

    monkeypatch.setattr(running, "_write", full)
    with pytest.raises(BvbError, match="no space left"):
        run_study(plan, materials_of([folder / "copper.npz"]), tmp_path / "study")
    monkeypatch.undo()
    assert len(run_study(plan, materials_of([folder / "copper.npz"]), tmp_path / "study")) == 2
