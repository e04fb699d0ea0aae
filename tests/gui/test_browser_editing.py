"""A session in the browser from opening to saving, and its recipe replayed by the commands."""

import subprocess

import numpy as np

import bvbedit
from bvbedit.edit.document import Document, digest
from bvbedit_gui.volume import luminance, net_points
from tests.gui.browser import COMMAND, Desk, served

# Samples along each axis of the box for the outlines that are worked out here.
FINE = 201
# Shares of the slider of the iso-value.
SHARES = (0.25, 0.5)


def outline(model, iso, desk):
    """Return what of the picture the surface of a value covers, seen along the last axis, inside the box's edges."""
    axis = np.linspace(0, 1, FINE)
    field = luminance(model.encoding.decode(model.spline.evaluate_grid((axis, axis, axis))))
    covered = (field.min(axis=2) < iso) & (field.max(axis=2) > iso)
    (left, bottom), (right, top) = desk.point_at(np.array([[0, 0, 0.5], [1, 1, 0.5]]), "2")
    columns = np.arange(int(np.ceil(left)) + 2, int(right) - 2)
    rows = np.arange(int(np.ceil(top)) + 2, int(bottom) - 2)
    u = (columns + 0.5 - left) / (right - left)
    v = (bottom - rows - 0.5) / (bottom - top)
    expected = covered[np.ix_(np.round(u * (FINE - 1)).astype(int), np.round(v * (FINE - 1)).astype(int))].T
    return rows, columns, expected


def overlap(a, b):
    return (a & b).sum() / (a | b).sum()


def seen(desk, rows, columns):
    return np.ptp(desk.picture("volume")[np.ix_(rows, columns)].astype(int), axis=2) > 12


def look_at_outlines(desk, model):
    """Surfaces stand where the field has their value: compared with outlines worked out from the net alone."""
    desk.click("tab view")
    desk.fill("iso_count", 1)
    desk.fill("opacity", 1)
    desk.click("look 2")
    pictures, expectations = [], []
    for share in SHARES:
        before = desk.state("iso")
        desk.slide("iso", share)
        iso = 10 ** desk.wait("iso", f"iso => iso !== {before}")
        rows, columns, expected = outline(model, iso, desk)
        assert 0.05 < expected.mean() < 0.95
        desk.soon(lambda r=rows, c=columns, e=expected: overlap(seen(desk, r, c), e), lambda share: share > 0.9)
        pictures.append(seen(desk, rows, columns))
        expectations.append(expected)
        shown = desk.mark("iso text").inner_text()
        assert float(shown.split()[0]) == float(f"{iso:.3g}")
    assert overlap(*pictures) < 0.9
    assert overlap(*expectations) < 0.9
    assert overlap(pictures[0], expectations[1]) < 0.9


def tint_a_region(desk, model):
    """Pick a control point in the picture, tint there, take it back, do it again."""
    desk.click("look oblique")
    desk.click("mode=pick")
    points = net_points(model)
    places = desk.point_at(points, "oblique")
    apart = np.linalg.norm(places[:, None] - places[None], axis=2) + 1e9 * np.eye(len(places))
    middle = np.linalg.norm(places - places.mean(axis=0), axis=1)
    chosen = int(np.argmax(np.where(middle < np.median(middle), apart.min(axis=1), 0)))
    assert apart[chosen].min() > 2
    index = tuple(int(i) for i in np.unravel_index(chosen, model.spline.size))
    desk.click("tab edit")

    def told():
        # Again where a picture of the new side was still on its way.
        desk.click_volume(places[chosen])
        desk.page.wait_for_timeout(100)
        return desk.state("picked")

    desk.soon(told, lambda words: f"Control point {index}" in words)
    for name, angle in zip(("theta_h", "theta_d", "phi_d"), model.chart.angles(points[[chosen]])[0], strict=True):
        assert desk.state(f"region_{name}_on")
        np.testing.assert_allclose(desk.state(f"region_{name}"), angle, atol=0.06)
    lobes = desk.picture("lobes")
    desk.choose("op", "tint")
    desk.fill("knob_tint_rgb 0", 0.5)
    desk.fill("knob_tint_rgb 2", 1.5)
    desk.wait("edit_pending", "pending => pending")
    assert desk.state("knob_tint_rgb") == [0.5, 1, 1.5]
    assert not desk.state("can_undo")
    desk.click("apply")
    desk.wait("history", "history => history.length === 2 && history[1].here")
    assert desk.state("history")[1]["line"].startswith("tint")
    assert desk.state("knob_tint_rgb") == [1, 1, 1]
    desk.page.locator(".panel-head").first.click(position={"x": 2, "y": 2})
    desk.page.keyboard.press("Control+z")
    desk.wait("history", "history => history[0].here")
    desk.page.keyboard.press("Control+Shift+Z")
    desk.wait("history", "history => history[1].here")
    return lobes


def blend(desk):
    """Blend with another model by the slider; every picture follows before it is applied."""
    desk.click("everywhere")
    desk.choose("op", "blend")
    desk.choose("knob_blend_partner", "blue.bvb")
    before = {name: desk.picture(name) for name in ("lobes", "preview", "volume")}
    desk.slide("knob_blend_t", 0.5)
    desk.wait("knob_blend_t", "t => Math.abs(t - 0.5) < 0.02")
    desk.wait("edit_pending", "pending => pending")
    for name, picture in before.items():
        desk.soon(lambda name=name, was=picture: (desk.picture(name) != was).mean(), lambda share: share > 0.005)
    desk.click("apply")
    desk.wait("history", "history => history.length === 3 && history[2].here")
    assert desk.state("history")[2]["line"].startswith("blend")


def insert_a_knot(desk):
    """Click on an axis."""
    desk.click("mode=knot")
    place = desk.point_at(np.array([[0.37, 0.0, 0.0]]), "oblique")[0]
    desk.click_volume(place)
    desk.wait("history", "history => history.length === 4 && history[3].here")
    assert desk.state("history")[3]["line"].startswith("insert")


def fit_again(desk):
    """Fit the present model under a budget; how far it is is seen meanwhile."""
    desk.click("tab fit")
    desk.choose("fit_chart", "half-diff")
    desk.choose("fit_encoding", "root")
    desk.fill("fit_kib", 2)
    desk.page.evaluate(
        "() => { window.shares = []; window.trame.state.watch(['fit_share'], share => window.shares.push(share)) }"
    )
    desk.click("fit")
    desk.page.get_by_label("share of the fit that is done").wait_for()
    desk.wait("fitting", "fitting => !fitting")
    assert desk.state("error_fit") == ""
    assert "half-diff, root" in desk.mark("fit result").inner_text()
    shares = desk.page.evaluate("window.shares")
    assert len(set(shares)) >= 3
    assert max(shares) > 50
    desk.wait("history", "history => history.length === 5 && history[4].here")


def save(desk, folder):
    desk.click("save as")
    desk.mark("save name").locator("input").fill("mine")
    assert desk.state("unsaved")
    desk.click("save now")
    desk.wait("unsaved", "unsaved => !unsaved")
    desk.dialog("save").wait_for(state="hidden")
    assert "mine.bvb" in desk.state("toast")
    assert (folder / "mine.bvb").exists()


def replay(folder):
    """The saved model's recipe makes the same net to the last bit in another process."""
    (folder / "mine.toml").write_text(command(folder, "history", "mine.bvb", "--recipe"))
    command(folder, "run", "mine.toml")
    again, saved = (digest(bvbedit.load(folder / name)) for name in ("mine-again.bvb", "mine.bvb"))
    assert again == saved


def command(folder, *arguments):
    done = subprocess.run([*COMMAND, *arguments], cwd=folder, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    return done.stdout


def test_a_session_from_opening_to_a_replayed_recipe(context, folder):
    with served(folder, "gold.bvb") as viewer:
        desk = Desk(context, viewer.url)
        desk.page.locator('[data-picture="volume"] img').wait_for()
        gold = Document.open(folder / "gold.bvb").model
        desk.open("satin.bvb")
        desk.wait("documents", "documents => documents.length === 2")
        # Values of its surfaces are chosen when the field is known.
        desk.wait("stale_volume", "stale => !stale")
        look_at_outlines(desk, bvbedit.load(folder / "satin.bvb"))
        desk.choose("current", "gold.bvb")
        desk.wait("axis_names", "names => names[0] === 'θ_h'")
        lobes = tint_a_region(desk, gold)
        desk.soon(lambda: desk.picture("lobes"), lambda now: (now != lobes).any())
        blend(desk)
        insert_a_knot(desk)
        fit_again(desk)
        save(desk, folder)
        assert {k: v for k in ("edit", "fit", "open", "save", "volume") if (v := desk.state(f"error_{k}"))} == {}
        assert desk.complaints == []
    replay(folder)
