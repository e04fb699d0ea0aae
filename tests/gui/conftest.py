"""What the viewer's tests share: small models, a browser, and viewers in folders of their own."""

import shutil

import pytest

import bvbedit
from bvbedit.brdf.analytic import GGX, Schlick
from tests.gui import browser

MODELS = {
    "gold": (GGX(0.3, Schlick((0.9, 0.6, 0.2))), "half-diff", (8, 6, 4)),
    "blue": (GGX(0.5, Schlick((0.3, 0.5, 0.8))), "half-diff", (8, 6, 4)),
    # In this chart surfaces of equal luminance have outlines of which every side says something.
    "satin": (GGX(0.45, Schlick((0.3, 0.5, 0.8))), "in-out", (10, 10, 12)),
}


@pytest.fixture(scope="session")
def models(tmp_path_factory):
    """A folder with small models: gold.bvb, blue.bvb, satin.bvb."""
    home = tmp_path_factory.mktemp("models")
    for name, (brdf, chart, size) in MODELS.items():
        bvbedit.save(bvbedit.fit(brdf, chart=chart, encoding="root", size=size), home / f"{name}.bvb")
    return home


@pytest.fixture
def folder(models, tmp_path):
    """A folder of one's own with the models."""
    return shutil.copytree(models, tmp_path / "folder")


@pytest.fixture(scope="module")
def chromium():
    """A browser. Ends with the module: other tests run event loops of their own."""
    if browser.missing():
        pytest.skip(browser.missing())
    with browser.chromium() as running:
        yield running


@pytest.fixture
def context(chromium):
    """A browser without cookies and tabs."""
    fresh = chromium.new_context(viewport={"width": 1400, "height": 850}, service_workers="block")
    yield fresh
    # Not with close(): the pages would ask whether unsaved work is to be left.
    for page in fresh.pages:
        page.close(run_before_unload=False)
    fresh.close()
