"""Make the pictures of the viewer in the README: python samples/viewer.py (needs Chromium and the test extra)."""

import re
import signal
import subprocess
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import bvbedit
from bvbedit.brdf.materials import material_named

HERE = Path(__file__).parent
CHROMIUM = "/usr/bin/chromium"
SIZE = {"width": 1280, "height": 720}
# Seconds for which nothing may change.
STILL = 4


@contextmanager
def page(folder: Path, *files: str) -> Iterator[Any]:
    """Yield a page of the viewer, started in ``folder`` with these files."""
    from playwright.sync_api import sync_playwright

    command = [sys.executable, "-m", "bvbedit", "view", *files, "--no-browser"]
    server = subprocess.Popen(command, cwd=folder, stdout=subprocess.PIPE, text=True)
    try:
        assert server.stdout is not None
        address = re.search(r"http://\S+", server.stdout.readline())
        assert address is not None
        with sync_playwright() as play:
            browser = play.chromium.launch(executable_path=CHROMIUM, args=["--no-sandbox", "--disable-gpu"])
            shown = browser.new_page(viewport=SIZE)  # type: ignore[arg-type]
            shown.goto(address.group())
            yield shown
            browser.close()
    finally:
        server.send_signal(signal.SIGINT)
        server.wait(30)


def choose(shown: Any, name: str, value: str) -> None:
    """Choose a value of one of the page's selects."""
    shown.locator(f'[data-test="{name}"]').first.click()
    shown.locator(".v-overlay .v-list-item").filter(has_text=value).last.click()


def rest(shown: Any) -> None:
    """Wait until the preview has all its samples, nothing changes any more, and the tooltip is gone."""
    shown.mouse.move(640, 20)
    same, before = 0, b""
    # What was seen before may have had all of them, too: only what stays is done.
    while same < STILL:
        shown.wait_for_timeout(1000)
        now = shown.screenshot()
        done = "64 samples" in shown.locator('[data-test="preview note"]').inner_text()
        same = same + 1 if done and now == before else 0
        before = now


def fitted(folder: Path) -> None:
    """Take a sample, fit it, and look at what it is made of."""
    with page(folder) as shown:
        shown.locator("[data-test=sample]").filter(has_text="gold-metallic-paint").click()
        shown.locator("[data-test=fit]").click()
        shown.wait_for_function(
            "document.querySelector('[data-test=\"fit result\"]').innerText.length > 3", timeout=120_000
        )
        shown.locator('[data-test="tab view"]').click()
        shown.locator("[data-test=show_net] input").click(force=True)
        shown.locator("[data-test=slice_2_on] input").click(force=True)
        rest(shown)
        shown.screenshot(path=HERE / "viewer.png")


def edited(folder: Path) -> None:
    """Blend two materials, in the dark."""
    for name in ("car-paint", "blue-plastic"):
        bvbedit.save(bvbedit.fit(material_named(name).brdf, max_bytes=24 * 1024), folder / f"{name}.bvb")
    with page(folder, "car-paint.bvb", "blue-plastic.bvb") as shown:
        shown.locator("[data-test=theme]").click()
        choose(shown, "against", "before the edits")
        choose(shown, "op", "tint")
        shown.locator('[data-test="field knob_tint_rgb 1"] input').fill("4")
        shown.locator('[data-test="region_theta_d_on"] input').click(force=True)
        shown.locator('[data-test="region_theta_d 0"]').fill("55")
        shown.locator('[data-test="region_theta_d 0"]').blur()
        shown.locator("[data-test=apply]").click()
        shown.locator("[data-test=everywhere]").click()
        choose(shown, "op", "blend")
        choose(shown, "knob_blend_partner", "blue-plastic.bvb")
        shown.locator('[data-test="field knob_blend_t"] input').fill("0.4")
        shown.locator('[data-test="lobe_beside=beside"]').click()
        shown.locator('[data-test="figure=albedo"]').click()
        rest(shown)
        shown.screenshot(path=HERE / "viewer-blend.png")


if __name__ == "__main__":
    with TemporaryDirectory() as work:
        fitted(Path(work))
        edited(Path(work))
