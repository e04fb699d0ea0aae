"""The knobs of edits: what a panel shows for each parameter, and the edit that knobs stand for.

Made from the edits' own fields, so that a knob cannot mean something else than a recipe does.
"""

from collections.abc import Mapping
from dataclasses import MISSING, Field, dataclass, fields
from functools import cache
from typing import Any, Literal, get_args, get_origin, get_type_hints

from bvbedit.edit.operation import Edit
from bvbedit.edit.operations import OPERATIONS, edit_of
from bvbedit.edit.region import HALF_ANGLES, PLAIN_ANGLES, Region
from bvbedit.errors import BvbError

Kind = Literal["number", "numbers", "choice", "switch", "file", "axis"]
ANGLES = (*HALF_ANGLES, *PLAIN_ANGLES)
# What a slider spans, where that is less than what is allowed, and whether it moves in ratios.
SPANS: Mapping[str, tuple[float, float, bool]] = {
    "gain.factor": (0.1, 10, True),
    "tint.rgb": (0, 2, False),
    "tint.saturation": (0, 3, False),
    "broaden.factor": (0.25, 4, True),
    "sharpen.factor": (0.25, 4, True),
    "raise_grazing.amount": (-1, 5, False),
    "raise_grazing.power": (0.5, 10, False),
    "denoise.strength": (1e-3, 10, True),
    "blend.t": (0, 1, False),
    "move_points.rgb": (1e-3, 1e3, True),
    "refine.factor": (2, 8, False),
    "remove_knots.tolerance": (1e-5, 1, True),
    "elevate.by": (1, 4, False),
    "reduce.by": (1, 3, False),
    "reduce.tolerance": (1e-5, 1, True),
    "store.step": (1e-6, 1e-1, True),
}
# Where knobs stand that a recipe would have to be told.
STARTS: Mapping[str, Any] = {
    "gain.factor": 1.0,
    "tint.rgb": (1.0, 1.0, 1.0),
    "broaden.factor": 1.0,
    "sharpen.factor": 1.0,
    "raise_grazing.amount": 0.0,
    "blend.t": 0.0,
    "blend.partner": "",
    "move_points.at": (0.0, 0.0, 180.0),
    "move_points.rgb": (0.1, 0.1, 0.1),
    "insert_knots.axis": 0,
    "insert_knots.at": 0.5,
    "refine.axis": 0,
    "remove_knots.axis": 0,
    "remove_knots.tolerance": 1e-3,
    "elevate.axis": 0,
    "reduce.axis": 0,
    "store.precision": "float32",
}
# Numbers for each of several things, and what these are.
PARTS: Mapping[str, tuple[str, ...]] = {
    "tint.rgb": ("red", "green", "blue"),
    "move_points.rgb": ("red", "green", "blue"),
    "move_points.at": ("θ_i", "θ_o", "φ"),
}
# What a knob is called, where the parameter's name is a symbol.
LABELS: Mapping[str, str] = {"blend.t": "share"}
# What a knob does to the look, beyond what its parameter is.
LOOKS: Mapping[str, str] = {
    "gain.factor": "2 makes the material twice as bright, 0.5 half as bright.",
    "tint.rgb": "Multiplies each channel: more red and less blue is warmer.",
    "tint.hue": "Turns all colours around the wheel; greys and brightness stay.",
    "tint.saturation": "0 makes it grey, above 1 colours become stronger.",
    "broaden.factor": "Above 1 the highlight becomes wider and duller, as a rougher surface's.",
    "sharpen.factor": "Above 1 the highlight becomes smaller and crisper, as a polished surface's.",
    "broaden.keep_energy": "On: as much light is reflected as before, so that a wider highlight is dimmer.",
    "sharpen.keep_energy": "On: as much light is reflected as before, so that a smaller highlight is brighter.",
    "raise_grazing.amount": "The rim of a ball becomes brighter, as if it were coated; below 0 it darkens.",
    "raise_grazing.power": "5 is a coat's narrow rim; lower values reach towards the middle.",
    "denoise.strength": "Higher values smooth away more grain, and in the end the highlight, too.",
    "blend.t": "0 is this material, 1 the other one; between them it looks like both.",
    "blend.space": "linear mixes light, as two paints side by side; log keeps highlights distinct.",
    "move_points.rgb": "The reflectance that the material is to have there.",
    "move_points.at": "Light, view, and the angle between them; a control point that is picked fills it in.",
    "make_plausible.energy": "Dims what would send out more light than it receives, and glow.",
    "make_plausible.colour": "On: what is dimmed keeps its colour.",
    "insert_knots.at": "The look stays; edits can be finer there afterwards. Or click on an axis of the volume.",
    "refine.factor": "The look stays; every edit can be finer afterwards.",
    "remove_knots.tolerance": "A higher tolerance makes the file smaller and loses more detail.",
    "elevate.by": "The look stays; the net becomes larger and smoother to sculpt.",
    "reduce.by": "A smaller net; details may soften.",
}


@dataclass(frozen=True)
class Knob:
    """What a panel shows for one parameter of an edit."""

    op: str
    name: str
    kind: Kind
    label: str
    help: str
    start: Any
    unit: str = ""
    low: float = 0.0
    """What is allowed."""
    high: float = 0.0
    first: float = 0.0
    """What the slider spans."""
    last: float = 0.0
    ratio: bool = False
    whole: bool = False
    optional: bool = False
    options: tuple[str, ...] = ()
    parts: tuple[str, ...] = ()

    @property
    def state(self) -> str:
        """The name of the page's variable."""
        return f"knob_{self.op}_{self.name}"


@cache
def knobs_of(op: str) -> tuple[Knob, ...]:
    """Return the knobs of an operation, without those of its region."""
    kind = OPERATIONS[op]
    regional = {f.name for f in fields(Region)}
    hints = get_type_hints(kind)
    return tuple(_knob(op, f, hints[f.name]) for f in fields(kind) if f.name not in ("op", "label", *regional))


def is_regional(op: str) -> bool:
    """Return whether an operation can be confined to a region of angles."""
    return issubclass(OPERATIONS[op], Region)


def _knob(op: str, f: "Field[Any]", hint: Any) -> Knob:
    key = f"{op}.{f.name}"
    limits = f.metadata.get("limits")
    about = str(limits.about if limits else f.metadata["about"])
    label = LABELS.get(key, f.name.replace("_", " "))
    start = STARTS.get(key, None if f.default is MISSING else f.default)
    told = " ".join(part for part in (about[0].upper() + about[1:] + ".", LOOKS.get(key, "")) if part)
    if limits is None:
        if hint is bool:
            return Knob(op, f.name, "switch", label, told, start)
        if get_origin(hint) is Literal:
            return Knob(op, f.name, "choice", label, told, start, options=tuple(str(o) for o in get_args(hint)))
        return Knob(op, f.name, "file", label, told, start)
    if f.name == "axis":
        return Knob(op, f.name, "axis", label, "Along which angle.", start, low=0, high=2, whole=True)
    first, last, ratio = SPANS.get(key, (limits.low, limits.high, False))
    parts = PARTS.get(key, ())
    return Knob(
        op,
        f.name,
        "numbers" if parts else "number",
        label,
        told,
        list(start) if parts else start,
        unit=limits.unit,
        low=limits.low,
        high=limits.high,
        first=first,
        last=last,
        ratio=ratio,
        whole=limits.whole,
        optional=f.default is None,
        parts=parts,
    )


def starts() -> dict[str, Any]:
    """Return the page's variables of all knobs and where they stand at first."""
    return {knob.state: knob.start for op in OPERATIONS for knob in knobs_of(op)}


def region_starts() -> dict[str, Any]:
    """Return the page's variables of the region: which angles are confined, to what, and how softly."""
    out: dict[str, Any] = {"region_falloff": 5.0}
    for name in ANGLES:
        out |= {f"region_{name}_on": False, f"region_{name}": [0, 180 if name == "phi" else 90]}
    return out


def region_of(state: Mapping[str, Any]) -> dict[str, Any]:
    """Return the region that the page's variables stand for, as edits have it; empty for all directions.

    Raises BvbError where an interval is none.
    """
    out: dict[str, Any] = {name: state[f"region_{name}"] for name in ANGLES if state[f"region_{name}_on"]}
    for name, given in out.items():
        if not isinstance(given, list):
            raise BvbError(f"{name} is {given}. Give two angles, the smaller one first.")
    return {**out, "falloff": state["region_falloff"]} if out else {}


def edit_from(op: str, state: Mapping[str, Any]) -> Edit:
    """Return the edit that the page's variables stand for. Raises BvbError for what it cannot be."""
    values: dict[str, Any] = {"op": op}
    for knob in knobs_of(op):
        value = state[knob.state]
        if value is None or value == "":
            continue
        values[knob.name] = _number(value, knob.whole) if knob.kind in ("number", "numbers", "axis") else value
    if op == "tint":
        # Two ways to say a colour, of which an edit takes one: factors that change nothing stand back.
        if values.get("rgb") == [1.0, 1.0, 1.0] and (values.get("hue") or values.get("saturation") != 1):
            del values["rgb"]
        else:
            values.pop("hue", None)
            values.pop("saturation", None)
    if is_regional(op):
        values |= region_of(state)
    return edit_of(values)


def _number(value: Any, whole: bool) -> Any:
    if isinstance(value, list | tuple):
        return [_number(inner, whole) for inner in value]
    if isinstance(value, str | int | float) and not isinstance(value, bool):
        try:
            number = float(value)
        except (ValueError, OverflowError):
            return value
        return int(number) if whole and number.is_integer() else number
    return value
