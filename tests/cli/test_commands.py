"""The command line as a user meets it: files in, files out, one JSON object, exit status 0, 1 or 2."""

import json
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

import bvbedit
from bvbedit.cli import demo

# What saves trying charts and encodings where they are not what is tested.
SHARP = ("--chart", "half-diff", "--encoding", "root")


def one_object(out):
    assert out.count("\n") == 1
    return json.loads(out)


def test_fit_writes_a_model_and_tells_what_the_contract_lists(run, folder, tmp_path):
    target = tmp_path / "model.bvb"
    status, out, err = run("fit", folder / "satin.binary", target, "--size", "10,6,4", "--json")
    assert (status, err) == (0, "")
    told = one_object(out)
    keys = [
        "file",
        "file_bytes",
        "payload_bytes",
        "chart",
        "encoding",
        "degrees",
        "size",
        "knots",
        "condition",
        "seconds",
        "metrics",
    ]
    assert set(keys) <= set(told)
    assert told["size"] == [10, 6, 4]
    assert told["file_bytes"] == target.stat().st_size
    assert told["precision"] == "quantised"
    assert 8 * (6 + 2) < told["payload_bytes"] < 10 * 6 * 4 * 3 * 2 + 8 * (6 + 2)
    assert told["soundness"]["reciprocity"] == 0 or told["chart"] == "in-out"
    assert told["metrics"]["grid"]["log_cosine_rms"] < 0.1
    assert bvbedit.load(target).spline.size == (10, 6, 4)


def test_fit_without_options_chooses_and_tells_why(run, folder, tmp_path):
    status, out, _ = run(
        "fit", folder / "satin.binary", tmp_path / "m.bvb", "--explain", tmp_path / "why.png", "--json"
    )
    told = one_object(out)
    assert status == 0
    assert told["knots"] == "dominant"
    assert {t["chart"] for t in told["tried"]} == {"half-diff", "in-out"}
    assert (told["chart"], told["encoding"]["name"]) in {(t["chart"], t["encoding"]) for t in told["tried"]}
    assert told["size"] in [step["size"] for step in told["curve"]]
    # 1 % of noise: of pairs that a material cannot tell apart, 1 % of log(1 + f cos cos).
    assert 0 < told["noise"]["grid"] < 0.01
    from PIL import Image

    with Image.open(tmp_path / "why.png") as picture:
        assert picture.size == (960, 600)


def test_fit_keeps_a_file_bound_and_a_tolerance(run, folder, tmp_path):
    fit = ("fit", folder / "small.npz")
    told = one_object(run(*fit, tmp_path / "m.bvb", "--max-bytes", 6000, *SHARP, "--json")[1])
    assert told["file_bytes"] <= 6000
    told = one_object(run(*fit, tmp_path / "m.bvb", "--tolerance", 0.02, *SHARP, "--json")[1])
    assert max(told["metrics"][s]["log_cosine_rms"] for s in ("grid", "nodes")) <= 0.021
    status, out, err = run(*fit, tmp_path / "n.bvb", "--tolerance", 1e-6, *SHARP)
    assert (status, out, err.count("\n")) == (1, "", 1)
    assert "cannot be reached" in err
    assert not (tmp_path / "n.bvb").exists()


@pytest.mark.parametrize("bound", [2700, 9000])
def test_fit_keeps_a_payload_bound(run, folder, tmp_path, bound):
    status, out, _ = run("fit", folder / "small.npz", tmp_path / "m.bvb", "--max-payload", bound, *SHARP, "--json")
    assert status == 0
    # No more is spent than the material has features for.
    assert one_object(out)["payload_bytes"] <= bound


@pytest.mark.parametrize("precision", ["float16", "float32", "float64"])
def test_fit_stores_in_the_precision_asked_for(run, folder, tmp_path, precision):
    target = tmp_path / "m.bvb"
    run("fit", folder / "small.npz", target, "--size", "6,5,4", "--precision", precision, *SHARP)
    status, out, _ = run("info", target, "--json")
    told = one_object(out)
    assert status == 0
    assert told["precision"] == precision
    assert told["step"] is None
    assert told["payload_bytes"] == 6 * 5 * 4 * 3 * np.dtype(precision).itemsize + 8 * (2 + 1)
    assert np.load(target)["control"].dtype == precision


def test_info_prints_a_table_for_people(run, folder):
    status, out, err = run("info", folder / "satin.bvb")
    assert (status, err) == (0, "")
    assert "half-diff" in out
    assert "12 x 8 x 5" in out
    status, out, _ = run("info", folder / "satin.binary")
    assert status == 0
    assert "rusinkiewicz" in out


def test_compare_of_a_file_with_itself_is_zero_and_of_a_model_is_small(run, folder):
    status, out, _ = run("compare", folder / "satin.bvb", folder / "satin.bvb", "--json")
    told = one_object(out)
    assert status == 0
    assert told["grid"]["log_cosine_rms"] == told["nodes"]["relative_l1"] == told["paper"]["e_max"] == 0
    status, out, _ = run("compare", folder / "satin.bvb", folder / "satin.binary", "--json")
    assert 0 < one_object(out)["grid"]["log_cosine_rms"] < 0.1


def test_render_writes_a_row_of_pictures(run, folder, tmp_path):
    target = tmp_path / "row.png"
    arguments = ["--width", 24, "--height", 20, "--spp", 4, "--json"]
    status, out, _ = run("render", folder / "satin.bvb", folder / "satin.binary", target, *arguments)
    told = one_object(out)
    assert status == 0
    assert (told["width"], told["height"], told["spp"], told["seed"]) == (48, 20, 4, 0)
    from PIL import Image

    with Image.open(target) as picture:
        assert picture.size == (48, 20)


def test_render_writes_linear_exr(run, folder, tmp_path):
    from bvbedit.io.exr import read_exr

    target = tmp_path / "one.exr"
    run("render", folder / "satin.bvb", target, "--width", 16, "--height", 16, "--spp", 4)
    expected = bvbedit.render(bvbedit.load(folder / "satin.bvb"), width=16, height=16, spp=4)
    np.testing.assert_array_equal(read_exr(target), expected)


@pytest.mark.parametrize("suffix", ["binary", "npz"])
def test_export_agrees_with_the_model_at_its_nodes(run, folder, tmp_path, suffix):
    target = tmp_path / f"table.{suffix}"
    status, _, err = run("export", folder / "satin.bvb", target)
    assert (status, err) == (0, "")
    model, table = bvbedit.load(folder / "satin.bvb"), bvbedit.load(target)
    from bvbedit.brdf.charts import grid_points

    points = grid_points(table.axes)[table.valid.reshape(-1)][::997]
    wi, wo = table.chart.to_directions(points)
    # Nodes on the horizon are looked up from just above it.
    wi, wo = (w[np.minimum(wi[:, 2], wo[:, 2]) > 1e-2] for w in (wi, wo))
    np.testing.assert_allclose(table.evaluate(wi, wo), model.evaluate(wi, wo), rtol=2e-3, atol=1e-6)


def test_sample_list_and_make(run, tmp_path):
    status, out, _ = run("sample", "list", "--json")
    names = one_object(out)
    assert status == 0
    assert len(names) >= 6
    assert {"gold-metallic-paint", "teflon", "chrome"} <= set(names)
    status, out, _ = run("sample", "make", "teflon", tmp_path / "t.binary", "--noise", 0.05, "--seed", 1, "--json")
    assert status == 0
    assert (tmp_path / "t.binary").stat().st_size == 34_992_012
    assert one_object(out)["chart"] == "rusinkiewicz"


def test_all_samples_of_the_database_are_made_and_kept(run, tmp_path):
    options = ["--all", tmp_path / "db", "--count", 1, "--json"]
    status, out, err = run("sample", "make", *options)
    told = one_object(out)
    assert (status, err, told["made"], told["kept"]) == (0, "", 1, 0)
    assert told["bytes"] == 34_992_012
    (made,) = told["materials"]
    assert Path(made["file"]).stat().st_size == 34_992_012
    told = one_object(run("sample", "make", *options)[1])
    assert (told["made"], told["kept"], told["materials"][0]["status"]) == (0, 1, "kept")
    assert "db-000" in run("sample", "list")[1]


BAD = [
    (["fit", "{here}/missing.binary", "{out}/m.bvb"], "missing.binary"),
    (["fit", "{here}", "{out}/m.bvb"], "folder"),
    (["fit", "{here}/small.npz", "{out}/m.bvb", "--chart", "polar"], "polar"),
    (["fit", "{here}/small.npz", "{out}/m.bvb", "--chart", "rusinkiewicz"], "rusinkiewicz"),
    (["fit", "{here}/small.npz", "{out}/m.bvb", "--encoding", "cube"], "cube"),
    (["fit", "{here}/small.npz", "{out}/m.bvb", "--knots", "random"], "random"),
    (["fit", "{here}/small.npz", "{out}/m.bvb", "--size", "20,20,800"], "800"),
    (["fit", "{here}/small.npz", "{out}/m.bvb", "--size", "3,3,3", *SHARP], "3"),
    (["fit", "{here}/small.npz", "{out}/m.bvb", "--degree", "17"], "17"),
    (["fit", "{here}/small.npz", "{out}/m.bvb", "--max-bytes", "10", *SHARP], "10"),
    (["fit", "{here}/small.npz", "{out}/m.bvb", "--size", "8,8,8", "--max-bytes", "9999"], "exclude"),
    (["fit", "{here}/small.npz", "{out}/m.bvb", "--precision", "int8"], "int8"),
    (["fit", "{here}/small.npz", "{out}/no/such/folder/m.bvb"], "no/such/folder"),
    (["fit", "{here}/small.npz", "{out}/m.txt"], ".txt"),
    (["render", "{here}/satin.bvb", "{out}/p.jpg"], ".jpg"),
    (["render", "{here}/satin.bvb", "{out}/p.png", "--scene", "moon"], "moon"),
    (["render", "{here}/satin.bvb", "{out}/p.png", "--width", "0"], "0"),
    (["render", "{here}/satin.bvb"], "Nothing to render"),
    (["sample", "make", "unobtainium", "{out}/u.binary"], "unobtainium"),
    (["sample", "make", "teflon", "{out}/t.binary", "--noise", "7"], "7"),
    (["sample", "make", "teflon", "{out}/t.binary", "--grid", "paper"], "paper"),
    (["sample", "make", "db-000-chrome", "{out}/t.binary"], "db-000-matte"),
    (["sample", "make", "teflon"], "Nothing to make"),
    (["sample", "make", "teflon", "{out}/t.binary", "--jobs", "2"], "--all"),
    (["sample", "make", "teflon", "--all", "{out}"], "each has its own"),
    (["sample", "make", "--all", "{out}/db", "--count", "0"], "count is 0"),
    (["sample", "make", "--all", "{out}/db", "--jobs", "999"], "999"),
    (["compare", "{here}/satin.bvb", "{here}/nothing.bvb"], "nothing.bvb"),
    (["export", "{here}/satin.bvb", "{out}/t.csv"], ".csv"),
    (["view", "{here}/satin.binary", "--screenshot", "{out}/p.png"], "Fit it first"),
]


@pytest.mark.parametrize(("arguments", "named"), BAD, ids=[" ".join(a).replace("/", "|") for a, _ in BAD])
def test_what_cannot_be_done_ends_with_one_line_and_status_1(run, folder, tmp_path, arguments, named):
    status, out, err = run(*(a.format(here=folder, out=tmp_path) for a in arguments))
    assert (status, out) == (1, "")
    assert err.startswith("error: ")
    assert err.count("\n") == 1
    assert named in err
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize(
    "arguments", [["fit"], ["fit", "a", "b", "--size", "20,20"], ["fit", "a", "b", "--nonsense"], ["frobnicate"]]
)
def test_wrong_usage_ends_with_status_2(run, arguments):
    status, out, err = run(*arguments)
    assert (status, out) == (2, "")
    assert err


def test_help_lists_every_command(run):
    status, out, _ = run("--help")
    assert status == 0
    for command in ["fit", "info", "compare", "render", "export", "sample", "demo", "view"]:
        assert command in out


def test_start_up_imports_neither_numba_nor_pyvista(folder):
    """numba costs 0.25 s and pyvista 0.3 s at import; `--help` and `info` need neither."""
    code = (
        "import sys; sys.argv = ['bvbedit', *sys.argv[1:]]\n"
        "from bvbedit.cli import main\n"
        "try: main()\n"
        "except SystemExit: pass\n"
        "heavy = {'numba', 'pyvista', 'OpenEXR', 'nlopt', 'mitsuba'} & set(sys.modules)\n"
        "sys.exit(f'imported {heavy}' if heavy else 0)"
    )
    for arguments in (["--help"], ["info", str(folder / "satin.bvb")]):
        subprocess.run([sys.executable, "-c", code, *arguments], check=True, capture_output=True, timeout=60)


def test_demo_does_the_whole_job(run, tmp_path, monkeypatch):
    """With small nets and pictures: the same steps in less time."""
    label, options = demo.FITS["paper"]
    small = {
        "paper": (label, options | {"size": (8, 8, 12)}),
        "adaptive": (demo.FITS["adaptive"][0], {"max_bytes": 4096}),
    }
    monkeypatch.setattr(demo, "FITS", small)
    monkeypatch.setattr(demo, "PICTURE", {"width": 48, "height": 48, "spp": 4})
    out = tmp_path / "demo"
    status, printed, err = run("demo", "--out", out, "--json")
    assert err == ""  # no terminal, no progress
    told = one_object(printed)
    assert status == 0
    assert {"report.md", "comparison.png", "edited.png", "paper.bvb", "adaptive.bvb", "edited.bvb"} <= set(
        told["files"]
    )
    assert "| log-cosine RMS, grid |" in Path(told["report"]).read_text()
