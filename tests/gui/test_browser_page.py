"""The page in the browser: by keyboard alone, loaded again, in two tabs, cut off; what it asks, and its errors."""

import numpy as np
import pytest

from bvbedit_gui.themes import DARK, LIGHT
from tests.gui.browser import Desk, Relay, served

# What a user who has no mouse must be able to reach in the page of a model.
CONTROLS = (
    *("current", "open", "save as", "recipe", "close", "against", "theme", "help"),
    *("mode=turn", "look oblique", "look 2", "maximise volume", "slider iso"),
    *("slider theta_i", "field theta_i", "lobe_scale", "lobe side"),
    *("figure=albedo", "line_scale=log", "slider probe 1"),
    *("scene", "slider exposure", "field exposure"),
    *("tab edit", "op", "slider knob_gain_factor", "field knob_gain_factor", "region_theta_h_on", "region_falloff"),
    *("everywhere", "apply", "live"),
)
FOCUSED = """() => {
  const at = document.activeElement, marked = at.closest('[data-test]'), row = at.closest('[data-test^="row "]');
  return [marked, row].filter(x => x).map(x => x.dataset.test);
}"""

# By how many pixels an image differs from its room.
MISFIT = """name => {
  const room = document.querySelector(`[data-picture="${name}"]`), image = room.querySelector("img");
  return [image.naturalWidth - room.clientWidth, image.naturalHeight - room.clientHeight];
}"""


def edge(desk, name):
    """Return the commonest colour of the outermost pixels of a picture."""
    picture = desk.picture(name)
    border = np.concatenate([picture[2], picture[-3], picture[:, 2], picture[:, -3]])
    colours, counts = np.unique(border, axis=0, return_counts=True)
    return tuple(int(c) for c in colours[np.argmax(counts)])


def rgb(colour):
    return tuple(bytes.fromhex(colour[1:]))


def near(a, b):
    return max(abs(x - y) for x, y in zip(a, b, strict=True)) <= 3


def brighten(desk, factor):
    """Apply a gain."""
    steps = len(desk.state("history"))
    desk.fill("knob_gain_factor", factor)
    desk.wait("edit_pending", "pending => pending")
    desk.click("apply")
    desk.wait("history", f"history => history.length === {steps + 1} && history[{steps}].here")


@pytest.fixture
def relay():
    opened = []

    def to(viewer):
        opened.append(Relay(viewer.port))
        return opened[-1], viewer.url.replace(str(viewer.port), str(opened[-1].port))

    yield to
    for one in opened:
        one.close()


def reach_by_tab(desk):
    """Press Tab until every control was focused."""
    wanted, reached = set(CONTROLS), set()
    for _ in range(200):
        desk.page.keyboard.press("Tab")
        reached |= set(desk.page.evaluate(FOCUSED))
        if wanted <= reached | {name.split()[-1] for name in reached}:
            return
    raise AssertionError(f"not reached: {wanted - reached}")


def test_by_keyboard_alone(context, folder):
    with served(folder, "gold.bvb") as viewer:
        desk = Desk(context, viewer.url)
        desk.page.locator('[data-picture="volume"] img').wait_for()
        reach_by_tab(desk)
        for name, variable, key, change in (
            ("iso", "iso", "ArrowLeft", -0.01),
            ("theta_i", "theta_i", "ArrowRight", 1),
            ("exposure", "exposure", "ArrowRight", 0.1),
        ):
            before = desk.state(variable)
            desk.mark(f"slider {name}").get_by_role("slider").focus()
            desk.page.keyboard.press(key)
            after = desk.wait(variable, f"value => value !== {before}")
            assert after == pytest.approx(before + change, abs=1e-9)
        desk.mark("theme").focus()
        desk.page.keyboard.press("Enter")
        desk.wait("theme", "theme => theme === 'dark'")
        for name in ("volume", "preview"):
            desk.soon(lambda name=name: edge(desk, name), lambda colour: near(colour, rgb(DARK.paper)))
        desk.page.keyboard.press("Enter")
        for name in ("volume", "preview"):
            desk.soon(lambda name=name: edge(desk, name), lambda colour: near(colour, rgb(LIGHT.paper)))
        assert desk.complaints == []


def apart(a, b):
    """The share of pixels that differ by more than what pictures lose on their way to the page."""
    return (np.abs(a.astype(int) - b) > 12).any(axis=-1).mean()


def test_what_is_shown_is_made_as_large_as_its_room(context, folder):
    with served(folder, "gold.bvb") as viewer:
        desk = Desk(context, viewer.url)
        for name in ("volume", "lobes", "preview"):
            desk.page.locator(f'[data-picture="{name}"] img').wait_for()
        desk.page.locator(".figure svg").wait_for()
        for size in ((1280, 720), (1600, 1000)):
            desk.page.set_viewport_size({"width": size[0], "height": size[1]})
            for name in ("volume", "lobes", "preview"):
                desk.soon(lambda name=name: desk.page.evaluate(MISFIT, name), lambda misfit: misfit == [0, 0])
            width, height = (round(desk.page.locator(".figure").bounding_box()[side]) for side in ("width", "height"))
            desk.wait("figure_svg", f"""svg => svg.includes('viewBox="0 0 {width} {height}"')""")
            # However long the words below it are, the picture is not made again for the room that they leave.
            desk.wait("preview_note", "note => note.includes('64 samples')")
        assert desk.complaints == []


def test_reload_second_tab_and_a_cut_connection(context, folder, relay):
    with served(folder, "gold.bvb") as viewer:
        line, url = relay(viewer)
        desk = Desk(context, url)
        brighten(desk, 1.5)
        desk.fill("theta_i", 30)
        desk.click("tab history")
        kept = ("history", "theta_i", "tab", "iso", "current", "unsaved")
        for name, value in (("theta_i", 30), ("tab", "history")):
            desk.soon(lambda name=name: desk.known(name), lambda known, value=value: known == value)
        before = {name: desk.state(name) for name in kept}
        desk.page.reload()
        desk.wait("documents", "documents => documents && documents.length === 1")
        assert "secret" not in desk.page.url
        assert {name: desk.state(name) for name in kept} == before
        desk.page.locator('[data-picture="lobes"] img').wait_for()

        second = Desk(context, url)
        assert {name: second.state(name) for name in kept} == before
        # Earlier passes would differ from what is seen after all of them.
        desk.wait("preview_note", "note => note.includes('64 samples')")
        before_it = desk.picture("preview")
        second.click("tab edit")
        brighten(second, 3)
        desk.wait("history", "history => history.length === 3 && history[2].here")
        desk.soon(lambda: apart(desk.picture("preview"), before_it), lambda share: share > 0.02)
        assert second.complaints == []
        second.page.close()

        assert desk.complaints == []
        before = {name: desk.state(name) for name in kept}
        desk.page.evaluate("window.notLoadedAgain = true")
        line.cut()
        desk.page.get_by_text("The connection is lost").wait_for()
        desk.page.locator('[data-picture="volume"] img').wait_for()
        desk.page.get_by_text("The connection is lost").wait_for(state="hidden")
        desk.wait("documents", "documents => documents && documents.length === 1")
        assert {name: desk.state(name) for name in kept} == before
        assert desk.page.evaluate("window.notLoadedAgain")
        desk.complaints.clear()
        desk.click("undo")
        desk.wait("history", "history => history[1].here")
        desk.soon(lambda: apart(desk.picture("preview"), before_it), lambda share: share < 0.02)
        assert desk.complaints == []


def test_start_page_sample_errors_and_questions(context, folder):
    (folder / "damaged.bvb").write_bytes((folder / "gold.bvb").read_bytes()[:700])
    with served(folder) as viewer:
        desk = Desk(context, viewer.url)
        desk.mark("start").wait_for()
        samples = desk.mark("start").locator('[data-test="sample"]')
        assert any(text.startswith("chrome") for text in samples.all_inner_texts())
        desk.page.get_by_text("damaged.bvb").click()
        told = desk.mark("start").get_by_role("alert")
        told.wait_for()
        assert "damaged.bvb" in told.inner_text()
        samples.get_by_text("matte-paper").click()
        desk.wait("documents", "documents => documents.length === 1 && !documents[0].model")
        assert desk.state("tab") == "fit"

        desk.open("damaged.bvb")
        told = desk.dialog("open").get_by_role("alert")
        told.wait_for()
        assert "damaged.bvb" in told.inner_text()
        assert "Error(" not in told.inner_text()
        assert len(desk.state("documents")) == 1
        desk.page.keyboard.press("Escape")
        desk.dialog("open").wait_for(state="hidden")

        desk.choose("fit_chart", "half-diff")
        desk.choose("fit_encoding", "root")
        desk.click("fit_by=size")
        for axis in range(3):
            desk.fill(f"fit_size {axis}", 5)
            desk.wait("fit_size", f"size => size[{axis}] === 5")
        desk.click("fit")
        desk.wait("is_model", "model => model")
        desk.wait("fitting", "fitting => !fitting")
        assert "5 x 5 x 5" in desk.mark("fit result").inner_text()
        assert desk.state("unsaved")

        with desk.page.expect_event("dialog") as asked:
            desk.page.close(run_before_unload=True)
        assert asked.value.type == "beforeunload"
        asked.value.dismiss()
        desk.click("close")
        desk.dialog("close").get_by_text("Keep it open").click()
        desk.dialog("close").wait_for(state="hidden")
        assert len(desk.state("documents")) == 1
        desk.click("close")
        desk.click("discard")
        desk.mark("start").wait_for()
        assert not desk.state("unsaved")
        assert desk.complaints == []
