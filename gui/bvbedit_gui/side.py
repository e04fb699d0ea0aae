"""The side of the page: editing, fitting, what is shown of the volume, and the history."""

from collections.abc import Iterator
from contextlib import contextmanager
from typing import TYPE_CHECKING

from trame.widgets import html
from trame.widgets import vuetify3 as v3

from bvbedit.edit.operations import OPERATIONS
from bvbedit_gui.editing import OFFERED
from bvbedit_gui.knobs import ANGLES, is_regional, knobs_of
from bvbedit_gui.widgets import (
    COMPACT,
    ENTER,
    axis_name,
    hint,
    knob_row,
    marks,
    message,
    number_row,
    part,
    select,
    toggle,
    variable,
)

if TYPE_CHECKING:
    from bvbedit_gui.viewer import Viewer
TABS = (("edit", "Edit"), ("fit", "Fit"), ("view", "View"), ("history", "History"))
ANGLE_WORDS = {
    "theta_h": ("θ_h", "Half angle: 0 is the middle of the highlight."),
    "theta_d": ("θ_d", "Difference angle: 0 is light from where it is looked at, 90 the rim."),
    "phi_d": ("φ_d", "How light and view lie around the half vector."),
    "theta_i": ("θ_i", "Elevation of the light."),
    "theta_o": ("θ_o", "Elevation of the view."),
    "phi": ("φ", "Azimuth between light and view: 0 the same side, 180 the mirror side."),
}


def side(viewer: "Viewer") -> None:
    """Build the side of the page."""
    with html.Aside(classes="side", **marks(aria_label="controls")):
        with v3.VTabs(v_model=("tab",), density="compact", grow=True, height=34):
            for value, title in TABS:
                v3.VTab(title, value=value, classes="text-none", min_width=0, **marks(data_test=f"tab {value}"))
        with html.Div(classes="side-room"):
            with _tab(viewer, "edit"):
                _edit(viewer)
            with _tab(viewer, "fit"):
                _fit(viewer)
            with _tab(viewer, "view"):
                _view()
            with _tab(viewer, "history"):
                _history(viewer)


@contextmanager
def _tab(viewer: "Viewer", name: str) -> Iterator[None]:
    with part(viewer.server, name), html.Div(v_show=f"tab === '{name}'"):
        yield


def _edit(viewer: "Viewer") -> None:
    with v3.VAlert(v_if="!is_model", type="info", variant="tonal", density="compact", classes="ma-2 text-body-2"):
        html.Span("A measurement cannot be edited itself. ")
        html.A("Fit it with a model first.", href="#", click="tab = 'fit'", click_prevent=True)
    with v3.VAlert(v_if="kept_here", type="warning", variant="tonal", density="compact", classes="ma-2 text-body-2"):
        html.Div("Unsaved work on {{ kept_here }} was kept when the viewer ended.")
        v3.VBtn(
            "Recover", size="x-small", color="primary", click=(viewer.started(viewer.opening.recover), "[kept_here]")
        )
        v3.VBtn("Discard", size="x-small", variant="text", click=(viewer.opening.discard_kept, "[kept_here]"))
        message("open")
    with html.Div(v_show="is_model", classes="pa-2"):
        items = [{"value": op, "title": op.replace("_", " ")} for op in OFFERED]
        select("edit", "op", (f"{items}",))
        for op in OFFERED:
            with html.Div(v_if=f"op === '{op}'", classes="mt-1"):
                about = OPERATIONS[op].about
                html.P(about[0].upper() + about[1:] + ".", classes="text-caption text-medium-emphasis mb-1")
                for knob in knobs_of(op):
                    knob_row(knob)
        regional = [op for op in OFFERED if is_regional(op)]
        with html.Div(v_show=f"{regional}.includes(op)", classes="region mt-2"):
            _region(viewer)
        html.Div("{{ picked }}", v_show="picked", classes="text-caption mt-2 picked", **marks(data_test="picked"))
        html.Div(
            "{{ edit_note }}", v_show="edit_note", classes="text-caption mt-1 note", **marks(data_test="edit note")
        )
        html.Div(
            "{{ albedo_note }}",
            v_show="albedo_note",
            classes=("albedo_above ? 'text-caption mt-1 note text-error' : 'text-caption mt-1 note'",),
            **marks(data_test="albedo note"),
        )
        message("edit")
        with html.Div(classes="foot d-flex align-center mt-2"):
            v3.VBtn(
                "Apply",
                color="primary",
                size="small",
                click=viewer.started(viewer.editing.apply),
                classes="mr-2",
                **marks(data_test="apply"),
            )
            v3.VBtn(
                "Cancel",
                size="small",
                variant="tonal",
                click=viewer.editing.cancel,
                disabled=("!edit_pending",),
                **marks(data_test="cancel"),
            )
            v3.VSpacer()
            with v3.VSwitch(
                label="live",
                v_model=("live",),
                density="compact",
                hide_details=True,
                color="primary",
                classes="flex-grow-0",
                **marks(data_test="live"),
            ):
                hint("Shows what the knobs would do while they move. Apply makes it part of the history.")


def _region(viewer: "Viewer") -> None:
    with html.Div(classes="d-flex align-center"):
        html.Span("only in a region of angles", classes="text-caption font-weight-bold")
        v3.VSpacer()
        v3.VBtn(
            "everywhere",
            size="x-small",
            variant="text",
            classes="text-none",
            click=viewer.editing.reset_region,
            **marks(data_test="everywhere"),
        )
    for name in ANGLES:
        symbol, help = ANGLE_WORDS[name]
        top = 180 if name == "phi" else 90
        with html.Div(classes="d-flex align-center knob", **marks(data_test=f"row region_{name}")):
            with v3.VCheckboxBtn(
                v_model=(f"region_{name}_on",),
                density="compact",
                classes="flex-grow-0",
                **marks(aria_label=f"confine to {symbol}", data_test=f"region_{name}_on"),
            ):
                hint(help)
            html.Label(symbol, classes="text-caption region-label")
            v3.VRangeSlider(
                v_model=(f"region_{name}",),
                min=(0,),
                max=(top,),
                step=(0.5,),
                strict=True,
                density="compact",
                hide_details=True,
                thumb_size=12,
                track_size=3,
                disabled=(f"!region_{name}_on",),
                color="primary",
                **marks(aria_label=f"{symbol} from, to", data_test=f"region_{name}"),
                classes="mx-1",
            )
            for end, other in ((0, 1), (1, 0)):
                given = "Number($event.target.value)"
                pair = [given, given]
                pair[other] = f"region_{name}[{other}]"
                html.Input(
                    type="number",
                    value=(f"region_{name}[{end}]",),
                    change=f"region_{name} = [{', '.join(pair)}]",
                    disabled=(f"!region_{name}_on",),
                    classes="region-field",
                    **marks(
                        aria_label=f"{symbol} {('from', 'to')[end]}, 0 ... {top} degrees",
                        data_test=f"region_{name} {end}",
                        min="0",
                        max=str(top),
                        step="any",
                    ),
                )
            html.Span("°", classes="text-caption")
    number_row(
        "falloff",
        "region_falloff",
        variable("region_falloff"),
        0,
        45,
        unit="degrees",
        high=90,
        low=0,
        step=0.5,
        test="region_falloff",
        help="How softly the effect ends outside.",
    )


def _fit(viewer: "Viewer") -> None:
    with html.Div(classes="pa-2"):
        toggle(
            "fit_of",
            (
                ("source", "the measurement", "A new model of the measurement"),
                ("model", "the present model", "This model anew, edits and all: smaller, or of another kind"),
            ),
            classes="small mb-2",
            v_show="can_fit_source && is_model",
        )
        select(
            "chart",
            "fit_chart",
            ("['auto', 'half-diff', 'in-out']",),
            help="half-diff for sharp highlights, in-out for rough materials; auto tries both.",
            classes="small mb-2",
        )
        select(
            "encoding",
            "fit_encoding",
            ("['auto', 'root', 'log', 'linear']",),
            help="What is approximated: root and log keep dim parts right beside a highlight.",
            classes="small mb-2",
        )
        select(
            "knots",
            "fit_knots",
            ("['dominant', 'averaged', 'free', 'uniform', 'piegl-tiller']",),
            help="dominant: where the material has features. averaged: by the data. free: moved, slow.",
            classes="small mb-2",
        )
        toggle(
            "fit_by",
            (
                ("bytes", "bytes", "The best file of so many bytes"),
                ("tolerance", "tolerance", "The smallest file that is as near as this"),
                ("size", "size", "So many control points"),
                ("knee", "by itself", "As large as is worth it"),
            ),
            classes="small mb-2",
        )
        with html.Div(v_if="fit_by === 'bytes'"):
            number_row(
                "at most",
                "fit_kib",
                variable("fit_kib"),
                2,
                256,
                ratio=True,
                unit="KiB",
                low=1,
                high=1 << 20,
                test="fit_kib",
                help="Of the file without its history.",
            )
        with html.Div(v_if="fit_by === 'tolerance'"):
            number_row(
                "error",
                "fit_tolerance",
                variable("fit_tolerance"),
                1e-4,
                1,
                ratio=True,
                low=1e-12,
                high=1e12,
                test="fit_tolerance",
                help="log_cosine_rms: 0.01 is a difference that is hard to see.",
            )
        with html.Div(v_if="fit_by === 'size'"):
            for axis in range(3):
                number_row(
                    axis_name(axis),
                    f"fit_size[{axis}]",
                    (lambda n: lambda e: f"fit_size = fit_size.map((x, i) => i === {n} ? ({e}) : x)")(axis),
                    4,
                    80,
                    whole=True,
                    low=4,
                    high=1000,
                    test=f"fit_size {axis}",
                    help="Control points along this axis.",
                )
        with html.Div(classes="d-flex align-center mt-2"):
            v3.VBtn(
                "Fit",
                color="primary",
                size="small",
                click=viewer.started(viewer.fitting.fit),
                disabled=("fitting || !documents.length",),
                classes="mr-2",
                **marks(data_test="fit"),
            )
            v3.VBtn(
                "Stop",
                size="small",
                variant="tonal",
                click=viewer.fitting.stop,
                disabled=("!fitting",),
                **marks(data_test="stop"),
            )
        v3.VProgressLinear(
            v_if="fitting",
            model_value=("fit_share",),
            indeterminate=("fit_share === 0",),
            height=6,
            color="primary",
            classes="mt-2",
            **marks(aria_label="share of the fit that is done"),
        )
        html.Div("{{ fit_result }}", v_show="fit_result", classes="text-caption mt-2", **marks(data_test="fit result"))
        message("fit")


def _view() -> None:
    with html.Div(classes="pa-2"):
        select(
            "shown",
            "what",
            ("what_items",),
            help="What surfaces and slices are of. A difference: more than what it is compared with, or less.",
            classes="small mb-2",
        )
        number_row(
            "surfaces",
            "iso_count",
            variable("iso_count"),
            1,
            6,
            whole=True,
            bound=True,
            test="iso_count",
            help="How many: that of the slider, and others at lower values.",
        )
        number_row(
            "apart by",
            "iso_gap",
            variable("iso_gap"),
            0.1,
            2,
            unit="decades",
            step=0.05,
            low=0.01,
            high=10,
            bound=True,
            test="iso_gap",
            help="How far the surfaces' values are from one another.",
        )
        number_row(
            "opacity",
            "opacity",
            variable("opacity"),
            0.05,
            1,
            step=0.05,
            low=0.02,
            high=1,
            bound=True,
            test="opacity",
            help="Lower values let inner surfaces show through.",
        )
        for name, label, help in (
            (
                "show_net",
                "control net",
                "Control points at their Greville abscissae, large and bright where values are.",
            ),
            (
                "show_knots",
                "knot planes",
                "Where the polynomial pieces meet: details can be as fine as these lie close.",
            ),
        ):
            with v3.VSwitch(
                label=label,
                v_model=(name,),
                density="compact",
                hide_details=True,
                color="primary",
                disabled=("!is_model",),
                **marks(data_test=name),
            ):
                hint(help)
        html.Div("slices", classes="text-caption font-weight-bold mt-1")
        for axis in range(3):
            with html.Div(classes="d-flex align-center knob"):
                v3.VCheckboxBtn(
                    v_model=(f"slice_{axis}_on",),
                    density="compact",
                    classes="flex-grow-0",
                    **marks(aria_label=f"slice across axis {axis}", data_test=f"slice_{axis}_on"),
                )
                html.Label(axis_name(axis), classes="text-caption region-label")
                v3.VSlider(
                    v_model=(f"slice_{axis}",),
                    min=(0,),
                    max=(1,),
                    step=(0.005,),
                    density="compact",
                    hide_details=True,
                    thumb_size=14,
                    track_size=3,
                    color="primary",
                    disabled=(f"!slice_{axis}_on",),
                    **marks(aria_label=f"place of the slice across axis {axis}", data_test=f"slider slice_{axis}"),
                )


def _history(viewer: "Viewer") -> None:
    with html.Div(classes="pa-2"):
        with (
            v3.VList(density="compact", classes="history", **marks(data_test="history")),
            v3.VListItem(
                v_for="(step, n) in history",
                key=("n",),
                active=("step.here",),
                disabled=("step.past",),
                click=(viewer.started(viewer.editing.go_to), "[step.position]"),
                classes="px-2",
                density="compact",
            ),
            html.Div(classes="text-caption step"),
        ):
            html.Span("{{ step.past ? 'before' : step.position }}", classes="step-number")
            html.Span("{{ step.line }}")
            v3.VChip("{{ step.name }}", v_if="step.name", size="x-small", classes="ml-1")
        with html.Div(v_if="is_model", classes="d-flex align-center mt-2"):
            v3.VTextField(
                label="name of this state",
                v_model=("named",),
                keydown_enter=viewer.editing.name_state,
                **ENTER,
                **marks(data_test="named"),
                **COMPACT,
            )
            v3.VBtn("Name it", size="small", variant="tonal", click=viewer.editing.name_state, classes="ml-2")
        html.P(
            "Click a line to go there. Lines marked before were done before the file was opened.",
            classes="text-caption text-medium-emphasis mt-2",
        )
