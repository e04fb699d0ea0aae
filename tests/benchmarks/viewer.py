"""How quickly the viewer follows: python -m tests.benchmarks.viewer [MINUTES].

In headless Chromium, all in one run: from what the user does in the page until the picture that shows it is decoded
there. Ratios are to a round trip that does nothing, measured between the others. MINUTES of random use, 1 if not
given, end it: the server must not grow.
"""

import random
import sys
import tempfile
from pathlib import Path
from statistics import median
from time import monotonic, perf_counter
from typing import Any

import numpy as np
from rich.console import Console
from rich.table import Table

import bvbedit
from bvbedit.brdf.analytic import GGX, Schlick
from tests.gui.browser import Desk, chromium, missing, served

STEPS = 30
# Frames are counted over so many seconds of dragging.
DRAGGING = 4.0

# Counts the pictures that are decoded and shown, and waits until the next one of some panels.
WATCH = """
window.arrivals = {};
window.loaded = (name) => window.arrivals[name] || (window.arrivals[name] = []);
document.addEventListener("load", event => {
  const panel = event.target.closest && event.target.closest("[data-picture]");
  if (panel) window.loaded(panel.dataset.picture).push(performance.now());
}, true);
window.quiet = (ms) => new Promise(done => {
  const look = () => {
    const last = Math.max(0, ...Object.values(window.arrivals).map(times => times.at(-1) || 0));
    performance.now() - last > ms ? done() : setTimeout(look, 20);
  };
  look();
});
// Does what a control does, and returns after how many milliseconds each panel had shown its next picture.
window.after = async (act, panels) => {
  const before = panels.map(name => window.loaded(name).length), start = performance.now();
  await act();
  return await new Promise((done, failed) => {
    const look = () => {
      const times = panels.map((name, n) => window.loaded(name)[before[n]]);
      if (times.every(time => time !== undefined)) return done(times.map(time => time - start));
      performance.now() - start > 60000 ? failed(new Error("no picture of " + panels)) : setTimeout(look, 1);
    };
    look();
  });
};
window.press = (name, key) => {
  const thumb = document.querySelector(`[data-test="slider ${name}"] [role=slider]`);
  thumb.focus();
  thumb.dispatchEvent(new KeyboardEvent("keydown", { key, code: key, bubbles: true }));
};
"""


def rss(pid: int) -> float:
    """Return the memory of a process and its children in MB."""
    total = 0.0
    waiting = [pid]
    while waiting:
        one = waiting.pop()
        status = Path(f"/proc/{one}/status")
        total += next(int(line.split()[1]) / 1024 for line in status.read_text().splitlines() if "VmRSS" in line)
        for task in Path(f"/proc/{one}/task").iterdir():
            waiting += [int(child) for child in (task / "children").read_text().split()]
    return total


class Times:
    """Milliseconds of one thing, round for round."""

    def __init__(self, label: str, target: str) -> None:
        self.label, self.target = label, target
        self.all: list[float] = []

    def row(self, trivial: float) -> tuple[str, ...]:
        """Return the row of the table."""
        middle, late = median(self.all), float(np.percentile(self.all, 95))
        return self.label, f"{len(self.all)}", f"{middle:.0f}", f"{late:.0f}", f"{middle / trivial:.1f}", self.target


def settle(desk: Desk) -> None:
    desk.page.evaluate("window.quiet(250)")


def step(desk: Desk, slider: str, n: int, panels: list[str]) -> float:
    """Move a slider by a step, to and fro; return the milliseconds until the last of the panels has followed."""
    key = "ArrowRight" if n % 2 else "ArrowLeft"
    took = desk.page.evaluate(
        "([name, key, panels]) => window.after(() => window.press(name, key), panels)", [slider, key, panels]
    )
    return float(max(took))


def nothing(desk: Desk) -> float:
    """Return the milliseconds of a round trip that does nothing."""
    # Redo is refused at once where nothing was undone.
    return float(
        desk.page.evaluate(
            "async () => { const start = performance.now(); await window.trame.trigger('redo'); "
            "return performance.now() - start; }"
        )
    )


def steps(desk: Desk, rows: Table) -> None:
    trivial = Times("a round trip that does nothing", "")
    iso = Times("a step of the iso-value until the volume shows it", "120, 95 %: 250")
    theta = Times("a step of theta_i until the lobes show it", "120")
    mixed = Times("a step of a blend until lobes and preview show it", "300")
    volume = Times("a step of a blend until the volume shows it", "")
    desk.choose("op", "blend")
    desk.choose("knob_blend_partner", "blue.bvb")
    desk.slide("knob_blend_t", 0.5)
    desk.wait("edit_pending", "pending => pending")
    # At an end of the slider a step would change nothing.
    desk.slide("iso", 0.5)
    for n in range(STEPS):
        for times, slider, panels in (
            (iso, "iso", ["volume"]),
            (theta, "theta_i", ["lobes"]),
            (mixed, "knob_blend_t", ["lobes", "preview"]),
            (volume, "knob_blend_t", ["volume"]),
        ):
            settle(desk)
            times.all.append(step(desk, slider, n, panels))
        settle(desk)
        trivial.all.append(nothing(desk))
    for times in (trivial, iso, theta, mixed, volume):
        rows.add_row(*times.row(median(trivial.all)))
    desk.click("cancel")
    settle(desk)


def turning(desk: Desk, rows: Table) -> None:
    """Drag the volume around, and count the pictures."""
    box = desk.page.locator('[data-picture="volume"]').bounding_box()
    middle = box["x"] + box["width"] / 2, box["y"] + box["height"] / 2
    before = desk.page.evaluate("window.loaded('volume').length")
    desk.page.mouse.move(*middle)
    desk.page.mouse.down()
    start = perf_counter()
    while (angle := perf_counter() - start) < DRAGGING:
        desk.page.mouse.move(middle[0] + 90 * np.sin(3 * angle), middle[1] + 40 * np.cos(2 * angle))
    desk.page.mouse.up()
    count = desk.page.evaluate("window.loaded('volume').length") - before
    rows.add_row("turning the volume", f"{count}", f"{count / DRAGGING:.0f} a second", "", "", "")
    desk.click("look oblique")
    settle(desk)


def use_at_random(desk: Desk, minutes: float, seed: int = 0) -> int:
    """Do what users do, in an order drawn by a seed; return how much was done."""
    rng = random.Random(seed)
    sliders = ("iso", "theta_i", "exposure", "knob_blend_t", "probe 1")

    def slide() -> None:
        desk.page.evaluate(
            "([name, key]) => window.press(name, key)", [rng.choice(sliders), rng.choice(("ArrowLeft", "ArrowRight"))]
        )

    def look() -> None:
        desk.click(rng.choice(("look 0", "look 1", "look 2", "look oblique", "lobe side", "lobe oblique")))

    def edit() -> None:
        # By the time that it is clicked the edit may be done or gone, and the button with it.
        button = desk.mark(rng.choice(("apply", "cancel")))
        if button.is_enabled():
            button.dispatch_event("click")

    def back() -> None:
        desk.page.evaluate("name => window.trame.trigger(name)", rng.choice(("undo", "undo", "redo")))

    def figure() -> None:
        desk.click(rng.choice(("figure=line", "figure=albedo", "figure=numbers", "figure=line")))

    def theme() -> None:
        desk.click("theme")

    doings: list[Any] = [slide] * 20 + [look, look, edit, back, figure, theme]
    done, end = 0, monotonic() + 60 * minutes
    while monotonic() < end:
        rng.choice(doings)()
        # As quickly as a hurried user: pictures are overtaken by others.
        desk.page.wait_for_timeout(rng.choice((10, 30, 100, 300)))
        done += 1
    desk.page.evaluate("() => { window.trame.state.set('figure', 'line') }")
    settle(desk)
    return done


def main() -> None:
    if missing():
        raise SystemExit(missing())
    minutes = float(sys.argv[1]) if len(sys.argv) > 1 else 1.0
    rows = Table(
        "what", "times", "median, ms", "95 %, ms", "ratio", "target, ms", title="The viewer in headless Chromium"
    )
    with tempfile.TemporaryDirectory() as home, chromium() as browser:
        folder = Path(home)
        for name, roughness, colour in (("gold", 0.3, (0.9, 0.6, 0.2)), ("blue", 0.5, (0.3, 0.5, 0.8))):
            brdf = GGX(roughness, Schlick(colour))
            fitted = bvbedit.fit(brdf, chart="half-diff", encoding="root", size=(20, 14, 8))
            bvbedit.save(fitted, folder / f"{name}.bvb")
        with served(folder, "gold.bvb") as viewer:
            context = browser.new_context(viewport={"width": 1600, "height": 1000})
            context.add_init_script(WATCH)
            load = Times("loading the page until all pictures are shown", "")
            for _ in range(5):
                desk = Desk(context, viewer.url)
                shown = "() => ['volume', 'lobes', 'preview'].every(name => window.loaded(name).length)"
                desk.page.wait_for_function(shown)
                load.all.append(
                    desk.page.evaluate("Math.max(...Object.values(window.arrivals).map(times => times[0]))")
                )
                if len(load.all) < 5:
                    desk.page.close()
            settle(desk)
            steps(desk, rows)
            rows.add_row(*load.row(float("nan"))[:4])
            turning(desk, rows)
            before = rss(viewer.process.pid)
            done = use_at_random(desk, minutes)
            after = rss(viewer.process.pid)
            grown = f"{before:.0f} MB, then {after:.0f} MB"
            rows.add_row(f"{minutes:g} min of random use", f"{done}", grown, "", "", "< 100 MB more in 5 min")
            if desk.complaints:
                print("complaints of the page:", *desk.complaints, sep="\n  ")
            desk.page.close(run_before_unload=False)
            context.close()
    Console(width=140).print(rows)


if __name__ == "__main__":
    main()
