"""Small parts of the page, each used in several panels: fields with sliders, messages, pictures with a title."""

import re
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from html import escape
from typing import Any

from trame.ui.html import DivLayout
from trame.widgets import client, html, rca
from trame.widgets import vuetify3 as v3

from bvbedit_gui.knobs import Knob

COMPACT = {"density": "compact", "hide_details": True, "variant": "outlined"}
# Trame leaves out events that it does not know to be a widget's.
ENTER = {"__events": [("keydown_enter", "keydown.enter")]}


def marks(**names: str) -> dict[str, Any]:
    """Return attributes that no widget knows: roles and names for those who do not see, and marks for tests.

    Variables of the page may stand in them, as in its texts: ``{{ name }}``.
    """
    return {"raw_attrs": [_attribute(name.replace("_", "-"), value) for name, value in names.items()]}


def _attribute(name: str, value: str) -> str:
    if "{{" not in value:
        return f'{name}="{escape(value)}"'
    inserted = re.sub(r"{{ (.*?) }}", r"${\1}", value)
    return f':{name}="`{escape(inserted)}`"'


@contextmanager
def part(server: Any, name: str) -> Iterator[None]:
    """Make what stands in this a template of its own, shown here.

    A template is drawn anew as a whole when one of its variables changes: a page of one template alone took 25 ms of
    each step of a slider, wherever it stood.
    """
    client.ServerTemplate(name=name)
    with DivLayout(server, name, connect_parent=False, classes="part"):
        yield


def axis_name(axis: int) -> str:
    """Return what the page writes for an axis of the present chart."""
    return f"{{{{ axis_names[{axis}] }}}}"


def message(place: str) -> None:
    """Show what could not be done at this place, until it is closed."""
    v3.VAlert(
        f"{{{{ error_{place} }}}}",
        v_if=f"error_{place}",
        type="error",
        density="compact",
        variant="tonal",
        closable=True,
        close_label="Close the message",
        click_close=f"error_{place} = ''",
        classes="ma-1 text-body-2 flex-grow-0",
        **marks(role="alert", data_place=place),
    )


def hint(text: str) -> None:
    """Say more about the control that this stands in, when it is pointed at or focused."""
    v3.VTooltip(text, activator="parent", location="start", max_width=300, open_delay=400)


def button(
    icon: str,
    text: str,
    click: Any,
    *,
    disabled: str = "false",
    active: str = "false",
    test: str = "",
    **more: Any,
) -> None:
    """Show a button with an icon, named for those who do not see it and explained to those who point at it."""
    with v3.VBtn(
        icon=True,
        size="small",
        density="comfortable",
        variant="text",
        rounded="sm",
        disabled=(disabled,),
        active=(active,),
        **marks(aria_label=text, data_test=test or text),
        click=click,
        **more,
    ):
        v3.VIcon(icon)
        v3.VTooltip(text, activator="parent", location="bottom", open_delay=400)


def select(label: str, model: str, items: Any, *, test: str = "", help: str = "", **more: Any) -> None:
    """Show a choice of one of several."""
    with v3.VSelect(
        label=label,
        v_model=(model,),
        items=items,
        **marks(data_test=test or model),
        **{**COMPACT, "classes": "small", **more},
    ):
        if help:
            hint(help)


def toggle(model: str, choices: Sequence[tuple[str, str, str]], **more: Any) -> None:
    """Show buttons of which one is pressed: value, icon or text, and what it means."""
    with v3.VBtnToggle(
        v_model=(model,),
        mandatory=True,
        density="compact",
        variant="outlined",
        divided=True,
        **marks(data_test=model),
        **more,
    ):
        for value, face, help in choices:
            with v3.VBtn(value=value, size="x-small", **marks(aria_label=help, data_test=f"{model}={value}")):
                if face.startswith("mdi-"):
                    v3.VIcon(face)
                else:
                    html.Span(face)
                v3.VTooltip(help, activator="parent", location="bottom", open_delay=400)


def number_row(
    label: str,
    value: str,
    assign: Callable[[str], str],
    first: float,
    last: float,
    *,
    ratio: bool = False,
    whole: bool = False,
    unit: str = "",
    help: str = "",
    test: str = "",
    step: float | None = None,
    low: float | None = None,
    high: float | None = None,
    bound: bool = False,
) -> None:
    """Show a number as a slider and a field, with its unit and limits.

    ``value`` is an expression of the page, ``assign`` makes a statement that gives it another value. The slider spans
    ``first`` ... ``last``, in ratios if so; the field takes anything that ``low`` and ``high`` allow: what
    lies beyond is told where it is used, or, ``bound``, brought between them.
    """
    shown_low, shown_high = (first if low is None else low), (last if high is None else high)
    typed = f"Math.min(Math.max(Number($event), {shown_low}), {shown_high})" if bound else "Number($event)"
    limits = f"{_limit(shown_low)} ... {_limit(shown_high)}" + (f" {unit}" if unit else "")
    with html.Div(classes="d-flex align-center knob", **marks(data_test=f"row {test}")):
        with html.Label(label, classes="text-caption knob-label"):
            hint(f"{help} Limits: {limits}." if help else f"Limits: {limits}.")
        if ratio:
            position = f"Math.log10(Math.max({value} || {first}, {first}))"
            moved = assign("Number(Math.pow(10, $event).toPrecision(3))")
            span = {"min": f"Math.log10({first})", "max": f"Math.log10({last})", "step": "0.005"}
        else:
            position = f"Number({value} ?? {first})"
            digits = "Math.round($event)" if whole else "Number(Number($event).toPrecision(6))"
            moved = assign(digits)
            step = 1 if whole else step or (last - first) / 200
            span = {"min": f"{first}", "max": f"{last}", "step": f"{step}"}
        v3.VSlider(
            model_value=(position,),
            update_modelValue=moved,
            min=(span["min"],),
            max=(span["max"],),
            step=(span["step"],),
            density="compact",
            hide_details=True,
            thumb_size=14,
            track_size=3,
            color="primary",
            **marks(aria_label=f"{label}, slider", data_test=f"slider {test}"),
            classes="mx-2",
        )
        v3.VTextField(
            model_value=(value,),
            update_modelValue=assign(f"$event === '' ? null : {typed}"),
            type="number",
            step="any",
            density="compact",
            variant="outlined",
            hide_details=True,
            single_line=True,
            suffix={"degrees": "°"}.get(unit, unit),
            **marks(aria_label=f"{label}, {limits}", data_test=f"field {test}"),
            classes="knob-field",
        )


def view_buttons(prefix: str, views: Sequence[tuple[str, str]], look_from: Any) -> None:
    """Show buttons that look at a scene from its views: their names, and what is written on them."""
    for name, face in views:
        v3.VBtn(
            face,
            size="x-small",
            variant="text",
            min_width=30,
            classes="px-1 text-none",
            click=(look_from, f"['{name}']"),
            **marks(aria_label=f"look from: {name}", data_test=f"{prefix} {name}"),
        )


def _limit(value: float) -> str:
    """Return a limit in words."""
    if abs(value) >= 1e100:
        return "any"
    return f"{value:,.0f}" if abs(value) >= 1000 else f"{value:.6g}"


def variable(name: str) -> Callable[[str], str]:
    """Return what assigns to a variable of the page."""
    return lambda expression: f"{name} = {expression}"


def element(name: str, n: int) -> Callable[[str], str]:
    """Return what assigns to one of the numbers in a list of the page."""
    return lambda expression: f"{name} = {name}.map((x, i) => i === {n} ? ({expression}) : x)"


def knob_row(knob: Knob) -> None:
    """Show the knob of an edit's parameter."""
    if knob.kind == "switch":
        with v3.VSwitch(
            label=knob.label,
            v_model=(knob.state,),
            density="compact",
            hide_details=True,
            color="primary",
            **marks(data_test=knob.state),
        ):
            hint(knob.help)
    elif knob.kind == "choice":
        select(knob.label, knob.state, (f"{list(knob.options)}",), help=knob.help, classes="small mt-2")
    elif knob.kind == "file":
        select(
            "the other material (.bvb)",
            knob.state,
            ("model_files",),
            help="A model under the folder, saved before: that is how a recipe can name it.",
            no_data_text="No .bvb file in the folder: save one first.",
            click=None,
        )
    elif knob.kind == "axis":
        with html.Div(classes="d-flex align-center knob"):
            html.Label("along", classes="text-caption knob-label")
            with v3.VBtnToggle(
                v_model=(knob.state,), mandatory=True, density="compact", variant="outlined", divided=True
            ):
                for axis in range(3):
                    v3.VBtn(axis_name(axis), value=(f"{axis}",), size="small")
    else:
        span: dict[str, Any] = {
            "ratio": knob.ratio,
            "whole": knob.whole,
            "unit": knob.unit,
            "help": knob.help,
            "low": knob.low,
            "high": knob.high,
        }
        if knob.parts:
            for n, part in enumerate(knob.parts):
                number_row(
                    part,
                    f"{knob.state}[{n}]",
                    element(knob.state, n),
                    knob.first,
                    knob.last,
                    test=f"{knob.state} {n}",
                    **span,
                )
        else:
            number_row(knob.label, knob.state, variable(knob.state), knob.first, knob.last, test=knob.state, **span)


@contextmanager
def panel(name: str, title: str, head: Callable[[], None]) -> Iterator[None]:
    """Show a panel with a title, its controls beside that, and a button that gives it all the room."""
    hidden = f"maximised === '' || maximised === '{name}'"
    with html.Section(
        v_show=hidden,
        classes=(f"maximised === '{name}' ? 'panel panel-max' : 'panel panel-{name}'",),
        **marks(data_panel=name, aria_label=title),
    ):
        with html.Div(classes="panel-head"):
            html.H2(title, classes="text-subtitle-2 mr-2")
            head()
            v3.VSpacer()
            with v3.VBtn(
                icon=True,
                size="x-small",
                variant="text",
                **marks(aria_label=f"{title}: all the room, or a part of it", data_test=f"maximise {name}"),
                click=f"maximised = maximised === '{name}' ? '' : '{name}'",
            ):
                v3.VIcon(icon=(f"maximised === '{name}' ? 'mdi-arrow-collapse' : 'mdi-arrow-expand'",))
        yield
        message(name)


def stale(name: str) -> None:
    """Say that a panel shows another material still."""
    html.Div("working ...", v_if=f"stale_{name}", classes="stale-word text-caption", **marks(data_test=f"stale {name}"))


def picture(name: str, area: Any, *, fps: float = 30.0) -> Callable[[], None]:
    """Show an area; return what sends a new picture of it."""
    with html.Div(classes=(f"stale_{name} ? 'picture stale' : 'picture'",), **marks(data_picture=name)):
        stale(name)
        view = rca.RemoteControlledArea(
            name=name,
            display="image",
            # Until a picture of another size comes, the last one keeps its proportions.
            image_style=("{ width: '100%', height: '100%', objectFit: 'contain' }",),
            event_throttle_ms=(30,),
        )
    handler = view.create_view_handler(area, encoder="jpeg", target_fps=fps, interactive_quality=80, still_quality=95)
    return lambda: handler.update()
