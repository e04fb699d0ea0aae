"""What the tests of the command line share."""

import sys

import numpy as np
import pytest

import bvbedit
from bvbedit.cli import main


@pytest.fixture
def run(monkeypatch, capsys):
    """Run a command in this process; return (status, stdout, stderr)."""

    def call(*arguments):
        monkeypatch.setattr(sys, "argv", ["bvbedit", *map(str, arguments)])
        status = 0
        try:
            main()
        except SystemExit as stop:
            status = stop.code or 0
        out, err = capsys.readouterr()
        return status, out, err

    return call


@pytest.fixture(scope="session")
def folder(tmp_path_factory):
    """A folder with a MERL table, a small table that is fitted quickly, and a model of each of two materials."""
    from bvbedit.brdf.analytic import Lambert
    from bvbedit.brdf.charts import HALF_DIFF, grid_points
    from bvbedit.brdf.goniophotometer import measure
    from bvbedit.brdf.materials import material_named
    from bvbedit.brdf.measured import MeasuredBrdf

    home = tmp_path_factory.mktemp("files")
    satin = material_named("satin-paint").brdf
    bvbedit.save(measure(satin, "merl", noise=0.01, seed=3), home / "satin.binary")
    # On a chart for fitting, a table is fitted at its own nodes.
    axes = tuple(np.linspace(0, 1, n) for n in (31, 26, 21))
    wi, wo = HALF_DIFF.to_directions(grid_points(axes))
    valid = np.minimum(wi[:, 2], wo[:, 2]) > 1e-6
    values = np.zeros((len(wi), 3))
    values[valid] = satin.evaluate(wi[valid], wo[valid])
    shape = tuple(len(u) for u in axes)
    table = MeasuredBrdf(values.reshape(*shape, 3), valid.reshape(shape), axes, HALF_DIFF)
    bvbedit.save(table, home / "small.npz")
    for name, brdf, size in (("satin", table, (12, 8, 5)), ("grey", Lambert(0.5), (6, 5, 4))):
        model = bvbedit.fit(brdf, chart="half-diff", encoding="root", size=size, precision="float32")
        bvbedit.save(model, home / f"{name}.bvb")
    return home
