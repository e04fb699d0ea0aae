"""What the tests of the command line share."""

import sys

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
    """A folder with a MERL table and a model of it."""
    from bvbedit.brdf.goniophotometer import measure
    from bvbedit.brdf.materials import material_named

    home = tmp_path_factory.mktemp("files")
    table = measure(material_named("satin-paint").brdf, "merl", noise=0.01, seed=3)
    bvbedit.save(table, home / "satin.binary")
    model = bvbedit.fit(table, chart="half-diff", encoding="root", size=(12, 8, 5), precision="float32")
    bvbedit.save(model, home / "satin.bvb")
    return home
