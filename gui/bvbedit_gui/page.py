"""The page: where the panels are and what stands in them. It only names the viewer's variables and methods."""

from typing import TYPE_CHECKING

from trame.ui.html import DivLayout
from trame.widgets import client, html
from trame.widgets import vuetify3 as v3

from bvbedit_gui.dialogs import dialogs, start_page
from bvbedit_gui.preview_view import SCENES
from bvbedit_gui.side import side
from bvbedit_gui.style import SCRIPT, STYLE
from bvbedit_gui.widgets import (
    axis_name,
    button,
    hint,
    marks,
    number_row,
    panel,
    part,
    picture,
    select,
    stale,
    toggle,
    variable,
    view_buttons,
)

if TYPE_CHECKING:
    from bvbedit_gui.viewer import Viewer


def build(viewer: "Viewer") -> None:
    """Make the page of a viewer on its server. Needs a running event loop."""
    server = viewer.server
    server.state.trame__title = "bvbedit"
    server.state.trame__template_error_reconnect = (
        '<trame-reconnect :max-retry="100000" :delay="1000" message="The connection is lost; trying again ... '
        "What is unsaved was kept: if bvbedit view has ended, start it anew where it was started, and open the address "
        'that it tells."/>'
    )
    for name, method in (("undo", viewer.editing.undo), ("redo", viewer.editing.redo), ("save", viewer.saving.save)):
        server.trigger(name)(viewer.started(method))
    with DivLayout(server):
        client.Style(STYLE)
        client.Script(SCRIPT)
        with v3.VApp(theme=("theme",), classes="fill"):
            with part(server, "bar"):
                _bar(viewer)
            with v3.VMain(classes="fill"):
                with html.Div(classes="desk", v_show="documents.length"):
                    with html.Div(classes="panels"):
                        with part(server, "volume"):
                            _volume(viewer)
                        with part(server, "lobes"):
                            _lobes(viewer)
                        with part(server, "figures"):
                            _figures()
                        with part(server, "preview"):
                            _preview(viewer)
                    side(viewer)
                with part(server, "start"):
                    start_page(viewer)
            with part(server, "dialogs"):
                dialogs(viewer)
            v3.VSnackbar(
                "{{ toast }}",
                model_value=("toast !== ''",),
                update_modelValue="toast = ''",
                timeout=(4000,),
                location="bottom",
                **marks(data_test="toast"),
            )


def _bar(viewer: "Viewer") -> None:
    with v3.VAppBar(height=44, flat=True, border=True):
        html.Span("bvbedit", classes="text-subtitle-1 font-weight-bold mx-3")
        with html.Div(style="width: 230px", v_show="documents.length"):
            select(
                "material",
                "current",
                ("documents.map(d => ({ value: d.key, title: d.name + (d.unsaved && d.model ? ' •' : '') }))",),
                help="The material that is worked on; a dot says that it is not saved.",
            )
        button("mdi-folder-open-outline", "Open ...", (viewer.show_dialog, "['open']"), test="open")
        button(
            "mdi-content-save-outline",
            "Save (Ctrl+S)",
            "trigger('save')",
            disabled="!is_model",
            test="save",
        )
        button(
            "mdi-content-save-edit-outline",
            "Save as ...",
            (viewer.show_dialog, "['save']"),
            disabled="!is_model",
            test="save as",
        )
        button(
            "mdi-script-text-outline",
            "Copy as recipe ...",
            (viewer.show_dialog, "['recipe']"),
            disabled="!is_model",
            test="recipe",
        )
        button(
            "mdi-close", "Close this material", (viewer.opening.close, "[]"), disabled="!documents.length", test="close"
        )
        v3.VDivider(vertical=True, classes="mx-1")
        button(
            "mdi-undo",
            "Undo (Ctrl+Z)",
            "trigger('undo')",
            disabled="!can_undo && !edit_pending",
            test="undo",
        )
        button("mdi-redo", "Redo (Ctrl+Shift+Z)", "trigger('redo')", disabled="!can_redo", test="redo")
        v3.VSpacer()
        with html.Div(style="width: 220px", v_show="documents.length"):
            select(
                "compare with",
                "against",
                ("against_items",),
                help="Shown beside it in the preview, over its lobe, in the plots, and as a difference in the volume.",
            )
        button(
            "mdi-theme-light-dark",
            "Light or dark",
            "theme = theme === 'light' ? 'dark' : 'light'",
            test="theme",
        )
        button("mdi-help-circle-outline", "Help", "dialog = 'help'", test="help")


def _volume(viewer: "Viewer") -> None:
    view = viewer.volume

    def head() -> None:
        toggle(
            "mode",
            (
                ("turn", "mdi-rotate-3d-variant", "Drag to turn, wheel to zoom"),
                ("pick", "mdi-cursor-default-click-outline", "Click a control point: its region is chosen; Shift adds"),
                ("knot", "mdi-vector-polyline-plus", "Click on an axis: a knot is inserted there"),
            ),
            classes="mr-2",
        )
        sides = [(str(n), axis_name(n)) for n in range(3)]
        view_buttons("look", (("oblique", "3D"), *sides), view.look_from)

    with panel("volume", "Volume", head):
        view.send = picture("volume", view.area)
        with html.Div(classes="bar", **marks(aria_label="colour bar")):
            html.Span("{{ bar_title }}", classes="text-caption bar-title")
            with html.Div(classes="bar-colours", style=("{ background: bar_css }",)):
                html.Span(
                    "{{ tick.text }}",
                    v_for="tick in bar_ticks",
                    key=("tick.at",),
                    classes="bar-tick text-caption",
                    style=("{ left: tick.at + '%' }",),
                )
        with html.Div(classes="px-2 controls"):
            _iso_row()


def _iso_row() -> None:
    """Show the slider of the iso-value, in decades within what the field spans."""
    with html.Div(classes="d-flex align-center knob", **marks(data_test="row iso")):
        html.Label("iso-value", classes="text-caption knob-label")
        v3.VSlider(
            v_model=("iso",),
            min=("iso_low",),
            max=("iso_high",),
            # Until the material is seen, its values are not known.
            disabled=("stale_volume",),
            step=(0.01,),
            density="compact",
            hide_details=True,
            thumb_size=14,
            track_size=3,
            color="primary",
            **marks(aria_label="iso-value, decades", data_test="slider iso"),
            classes="mx-1",
        )
        html.Span("{{ iso_text }} /sr", classes="text-caption iso-text", **marks(data_test="iso text"))


def _lobes(viewer: "Viewer") -> None:
    view = viewer.lobes

    def head() -> None:
        toggle(
            "lobe_beside",
            (
                ("none", "mdi-circle-outline", "The lobe alone"),
                ("wire", "mdi-web", "What it is compared with as a wire over it"),
                ("beside", "mdi-view-split-vertical", "What it is compared with beside it"),
            ),
            classes="mr-2",
            disabled=("against === 'nothing'",),
        )
        view_buttons("lobe", (("oblique", "3D"), ("side", "side"), ("top", "top")), view.look_from)

    with panel("lobes", "Lobes", head):
        view.send = picture("lobes", view.area)
        html.Div("{{ lobe_note }}", classes="text-caption px-2 note")
        with html.Div(classes="px-2 controls d-flex align-center"):
            with html.Div(classes="flex-grow-1"):
                number_row(
                    "θ_i",
                    "theta_i",
                    variable("theta_i"),
                    0,
                    89,
                    unit="degrees",
                    step=1,
                    bound=True,
                    test="theta_i",
                    help="Where light comes from, measured from the normal; orange arrow. Blue: the mirror direction.",
                )
            with html.Div(style="width: 96px", classes="ml-1"):
                select(
                    "radius",
                    "lobe_scale",
                    ("['auto', 'linear', 'root', 'log']",),
                    help="Root and log make dim parts visible beside a bright highlight.",
                )


def _figures() -> None:
    def head() -> None:
        toggle(
            "figure",
            (
                ("line", "line", "Reflectance along a line through the volume"),
                ("albedo", "albedo", "How much light is reflected, by elevation"),
                ("numbers", "numbers", "Size, bytes, errors"),
            ),
            classes="mr-2",
        )
        with html.Div(v_if="figure === 'line'", classes="d-flex"):
            with v3.VBtnToggle(
                v_model=("line_axis",),
                mandatory=True,
                density="compact",
                variant="outlined",
                divided=True,
                **marks(data_test="line_axis"),
                classes="mr-1",
            ):
                for axis in range(3):
                    v3.VBtn(axis_name(axis), value=(f"{axis}",), size="x-small", classes="text-none")
            toggle("line_scale", (("log", "log", "Decades"), ("linear", "lin", "Linear")))

    with panel("figures", "Figures", head):
        with html.Div(classes=("stale_figures ? 'figure-room stale' : 'figure-room'",), v_show="figure !== 'numbers'"):
            stale("figures")
            client.SizeObserver("figure_size")
            html.Div(v_html=("figure_svg",), classes="figure", **marks(data_test="figure"))
        with (
            html.Div(classes="figure-room scroll", v_if="figure === 'numbers'"),
            v3.VTable(density="compact", classes="text-caption"),
            html.Tbody(),
            html.Tr(v_for="row in figure_rows", key=("row.label",)),
        ):
            html.Td("{{ row.label }}")
            html.Td("{{ row.value }}", classes="text-no-wrap")
            html.Td("{{ row.help }}", classes="text-medium-emphasis")
        with html.Div(v_show="figure === 'line'", classes="px-2 controls probe"):
            for axis in range(3):
                with html.Div(v_show=f"line_axis !== {axis}"):
                    html.Label(axis_name(axis), classes="text-caption mr-1")
                    v3.VSlider(
                        model_value=(f"probe[{axis}]",),
                        update_modelValue=f"probe = probe.map((x, i) => i === {axis} ? Number($event.toFixed(4)) : x)",
                        min=(0,),
                        max=(1,),
                        step=(0.005,),
                        density="compact",
                        hide_details=True,
                        thumb_size=14,
                        track_size=3,
                        color="primary",
                        **marks(aria_label=f"place of the line along axis {axis}", data_test=f"slider probe {axis}"),
                    )


def _preview(viewer: "Viewer") -> None:
    view = viewer.preview

    def head() -> None:
        toggle(
            "layout",
            (
                ("alone", "mdi-circle-outline", "The picture alone"),
                ("beside", "mdi-view-split-vertical", "Beside what it is compared with"),
                ("difference", "mdi-vector-difference", "And what differs, amplified"),
            ),
            disabled=("against === 'nothing'",),
            classes="mr-2",
        )
        with html.Div(style="width: 140px"):
            select("", "scene", (f"{list(SCENES)}.concat(scene_files)",), test="scene", help="Where it is looked at.")

    with panel("preview", "Preview", head):
        view.send = picture("preview", view.area)
        html.Div(
            "{{ preview_names }}",
            classes="text-caption px-2 note line",
            **marks(title="{{ preview_names }}", data_test="preview names"),
        )
        with html.Div(classes="text-caption px-2 note line", **marks(data_test="preview note")):
            html.Span("{{ preview_note }}")
            hint("MAE: mean absolute error, PAE: the largest, of the 8-bit picture against the one beside it.")
        with html.Div(classes="px-2 controls"):
            number_row(
                "exposure",
                "exposure",
                variable("exposure"),
                -6,
                6,
                unit="EV",
                step=0.1,
                bound=True,
                test="exposure",
                low=-10,
                high=10,
                help="Each step doubles the brightness of the picture; the material stays.",
            )
