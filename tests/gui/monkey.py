"""Random actions on a viewer, as a page with a bug or a hostile one could send them, from a seeded generator."""

from collections.abc import Callable
from pathlib import Path
from random import Random
from typing import Any

from bvbedit.spline.tensor import TensorSpline
from bvbedit_gui.editing import OFFERED
from bvbedit_gui.knobs import knobs_of

RUBBISH: tuple[Any, ...] = (
    *(None, "", " ", "x", "..", "../x.bvb", "/etc/passwd", "a\x00.bvb", "nan", "document 99", "document x", "document"),
    *(
        [],
        [None],
        ["a", 1],
        [1.0, float("nan"), 2],
        [[[]]],
        {},
        {"a": 1},
        {"width": None},
        {"width": 1e300, "height": 1},
    ),
    *(True, False, float("nan"), float("inf"), -float("inf"), 1e308, -1e308, 1e-320, -1, 0, 2**64, 10**400, 7.5),
    *("é" * 300, "<b>", "{{ name }}", "knob_gain_factor", "-1", "1e400"),
)
CHOICES: dict[str, tuple[Any, ...]] = {
    "theme": ("light", "dark"),
    "against": ("nothing", "source", "before", "document 1", "document 2"),
    "op": OFFERED,
    "live": (True, True, False),
    "what": ("luminance", "red", "green", "blue", "difference"),
    "iso": (-3.0, -1.0, 0.0, 1.0),
    "iso_count": (1, 2, 6),
    "iso_gap": (0.01, 0.5, 2.0),
    "opacity": (0.02, 0.5, 1),
    "mode": ("turn", "pick", "knot"),
    "theta_i": (0, 30.5, 89),
    "lobe_scale": ("auto", "linear", "root", "log"),
    "lobe_beside": ("none", "wire", "beside"),
    "figure": ("line", "albedo", "numbers"),
    "line_axis": (0, 1, 2),
    "line_scale": ("log", "linear"),
    "probe": ([0.3, 0.5, 0.5], [0, 0, 0], [1, 1, 1]),
    "figure_size": tuple({"size": {"width": w, "height": h}} for w, h in ((480, 300), (0, 0), (1e5, 1e5))),
    "scene": ("sphere", "sphere", "sphere", "furnace", "sky.toml", "bad.toml"),
    "exposure": (-10, 0, 1.5, 10),
    "layout": ("alone", "beside", "difference"),
    "save_name": ("a.bvb", "b.bvb", "new", "sub/c.bvb", "no/d.bvb"),
    "save_precision": ("as it is", "quantised", "float16", "float32", "float64"),
    "save_pdf": (False, False, False, True),
    "named": ("first", "the other", "first"),
    "current": (1, 2, 3),
    "dialog": ("", "open", "save", "recipe", "help"),
    "tab": ("edit", "fit", "view", "history"),
    "fit_by": ("size",),
    "fit_size": ([4, 4, 4], [5, 4, 4]),
    "fit_chart": ("half-diff", "in-out"),
    "fit_encoding": ("root", "log"),
    "fit_knots": ("averaged", "uniform"),
    "fit_of": ("model",),
}
NAMES = ("a.bvb", "b.bvb", "sub/c.bvb", "m.npz", "damaged.bvb", "absent.bvb", "link.bvb")


def choices() -> dict[str, tuple[Any, ...]]:
    """Return good values of variables that the page sets, limits among them."""
    out = dict(CHOICES)
    for n in range(3):
        out |= {f"slice_{n}": (0.0, 0.37, 1.0), f"slice_{n}_on": (True, False)}
    for name in ("show_net", "show_knots"):
        out[name] = (True, False)
    for name, top in (("theta_h", 90), ("theta_d", 90), ("phi_d", 90), ("theta_i", 90), ("theta_o", 90), ("phi", 180)):
        out |= {f"region_{name}_on": (True, False), f"region_{name}": ([0, top], [10, 30], [20, 20])}
    out["region_falloff"] = (0, 5, 90)
    for op in OFFERED:
        for knob in knobs_of(op):
            out[knob.state] = _knob_choices(knob)
    return out


def _knob_choices(knob: Any) -> tuple[Any, ...]:
    if knob.kind == "switch":
        return True, False
    if knob.kind == "choice":
        return tuple(knob.options)
    if knob.kind == "file":
        return "a.bvb", "b.bvb", "", "absent.bvb"
    if knob.kind == "axis":
        return 0, 1, 2
    # Nets that are refined by the largest factor make each step take seconds.
    high = 3 if knob.state == "knob_refine_factor" else knob.high
    numbers = [knob.start, knob.low, high, knob.first, min(knob.last, high)]
    if knob.parts:
        return knob.start, *([n] * len(knob.parts) for n in (knob.low, knob.first, knob.last))
    return (*numbers, None) if knob.optional else tuple(numbers)


class Monkey:
    """Draws actions: a name, and what does it."""

    def __init__(self, viewer: Any, seed: int) -> None:
        self.viewer = viewer
        self.random = Random(seed)
        self.choices = choices()
        # What trame keeps for itself is not the viewer's.
        self.variables = sorted(k for k in viewer.state.to_dict() if not k.startswith("trame__"))
        v = viewer
        self.methods: list[tuple[int, Callable[..., Any], Callable[[], tuple[Any, ...]]]] = [
            (6, v.editing.apply, tuple),
            (2, v.editing.cancel, tuple),
            (4, v.editing.undo, tuple),
            (3, v.editing.redo, tuple),
            (2, v.editing.go_to, lambda: (self.one(0, 0, 1, 2, 5),)),
            (2, v.editing.name_state, tuple),
            (2, v.saving.save, tuple),
            (3, lambda over: v.saving.save_as(over=over), lambda: (self.one(True, False),)),
            (2, v.opening.open_file, lambda: (self.one(*NAMES),)),
            (1, v.opening.open_sample, lambda: (self.one("chrome", "matte-paper", "unknown"),)),
            (1, v.opening.recover, lambda: (self.one(*NAMES),)),
            (1, v.opening.discard_kept, lambda: (self.one(*NAMES),)),
            (2, v.show_dialog, lambda: (self.one("open", "save", "recipe", "help", ""),)),
            (1, v.opening.close, tuple),
            (1, lambda key: v.opening.close(key, discard=True), lambda: (self.one(1, 2, 3),)),
            (2, v.editing.reset_region, tuple),
            (1, v.volume.look_from, lambda: (self.one("oblique", "0", "1", "2"),)),
            (1, v.lobes.look_from, lambda: (self.one("oblique", "side", "top"),)),
            (5, self.click, lambda: (self.random.uniform(0, 640), self.random.uniform(0, 480))),
            (1, v.volume.area.process_resize_event, lambda: self.one((640, 480), (300, 200), (1, 1))),
            (1, v.lobes.area.process_resize_event, lambda: self.one((480, 360), (100, 300), (0, 0))),
            (1, v.preview.area.process_resize_event, lambda: self.one((320, 240), (100, 300), (0, 0))),
        ]

    def one(self, *values: Any) -> Any:
        """Draw one of these."""
        return self.random.choice(values)

    def draw(self) -> tuple[str, Callable[[], Any]]:
        """Return an action in words, and what does it."""
        kind = self.random.random()
        if kind < 0.45:
            name = self.one(*self.choices)
            value = self.one(*self.choices[name])
            return f"{name} = {value!r}", lambda: self.viewer.state.update({name: value})
        if kind < 0.65:
            name, value = self.one(*self.variables), self.one(*RUBBISH)
            return f"{name} = {value!r:.40}", lambda: self.viewer.state.update({name: value})
        weights = [weight for weight, _, _ in self.methods]
        _, method, arguments = self.random.choices(self.methods, weights)[0]
        given = arguments()
        # The camera's names and the files' come from the page as well.
        if given and method != self.click and self.random.random() < 0.15:
            given = (self.one(*RUBBISH), *given[1:])
        return f"{getattr(method, '__qualname__', method)}{given!r:.60}", lambda: method(*given)

    def click(self, x: float, y: float) -> None:
        """Press and release the button there."""
        for kind in ("LeftButtonPress", "LeftButtonRelease"):
            event = {
                "type": kind,
                "x": x,
                "y": y,
                "shiftKey": self.one(0, 1),
                "controlKey": 0,
                "altKey": 0,
                "w": 640,
                "h": 480,
            }
            self.viewer.volume.area.process_interaction_event(event)


def damaged(path: Path) -> None:
    """Write a file that is no model."""
    path.write_bytes(b"PK\x03\x04 no model")


def points(spline: TensorSpline) -> int:
    """Count control points."""
    return spline.size[0] * spline.size[1] * spline.size[2]
