"""Dialogs of the page, and what it shows while nothing is open."""

from collections.abc import Iterator
from contextlib import contextmanager
from typing import TYPE_CHECKING

from trame.widgets import html
from trame.widgets import vuetify3 as v3

from bvbedit_gui.saving import PRECISIONS
from bvbedit_gui.widgets import COMPACT, ENTER, marks, message, select

if TYPE_CHECKING:
    from bvbedit_gui.viewer import Viewer

HELP = (
    (
        "What is seen",
        "A material is a volume: each point of the box is one way of lighting and looking, and holds a colour. "
        "Surfaces in the box join points of equal brightness. A lobe shows how light from one direction (orange) is "
        "thrown back: the farther, the brighter. The preview is what a renderer makes of it.",
    ),
    (
        "Editing",
        "Choose an edit and move its knobs: volume, lobes, plots and preview follow. Apply makes it a step of the "
        "history, Cancel leaves it. Confine it to angles below the knobs, or pick control points in the volume. What "
        "was done can be undone, saved with the model, and copied as a recipe that does it to other materials.",
    ),
    (
        "Mouse and keys",
        "Drag turns a scene, the wheel zooms, Shift and drag moves it. Ctrl+Z undoes, Ctrl+Shift+Z does again, Ctrl+S "
        "saves. Tab reaches every control; arrow keys move sliders.",
    ),
    (
        "Safety",
        "Files are opened and saved only in the folder where the viewer was started, and those named then. What is "
        "unsaved is kept beside its file, and offered when the viewer is started again.",
    ),
)


@contextmanager
def _dialog(name: str, title: str, width: int = 520) -> Iterator[None]:
    with (
        v3.VDialog(
            model_value=(f"dialog === '{name}'",),
            update_modelValue=f"dialog = $event ? '{name}' : (dialog === '{name}' ? '' : dialog)",
            max_width=width,
            scrollable=True,
        ),
        v3.VCard(title=title, **marks(data_dialog=name)),
    ):
        yield


def dialogs(viewer: "Viewer") -> None:
    """Build all dialogs."""
    with _dialog("open", "Open", 640):
        # Above what is scrolled: it is to be seen wherever that was clicked.
        with html.Div(classes="px-4"):
            message("open")
        with v3.VCardText(classes="scroll", style="max-height: 65vh"):
            _choices(viewer)
        with v3.VCardActions():
            v3.VSpacer()
            v3.VBtn("Cancel", click="dialog = ''")
    with _dialog("save", "Save or export"):
        with v3.VCardText(classes="pt-3"):
            v3.VTextField(
                label=("'file, in ' + folder",),
                v_model=("save_name",),
                update_modelValue="save_name = $event; save_confirm = ''",
                keydown_enter=(viewer.started(viewer.saving.save_as), "[]"),
                **ENTER,
                autofocus=True,
                **marks(data_test="save name"),
                classes="mb-3",
                **COMPACT,
            )
            select(
                "control points stored as",
                "save_precision",
                (f"{list(PRECISIONS)}",),
                help="quantised and float16 are small; float64 keeps every bit.",
            )
            v3.VSwitch(
                label="with the density for sampling (4 KB more, quicker to render)",
                v_model=("save_pdf",),
                v_show="!/[.](binary|npz)$/i.test(save_name)",
                density="compact",
                hide_details=True,
                color="primary",
            )
            html.P(
                "A name in .bvb keeps the model and its history; .binary is a MERL table, .npz a table on the model's "
                "chart, for other tools.",
                classes="text-caption text-medium-emphasis mt-1",
            )
            message("save")
            with v3.VAlert(v_if="save_confirm", type="warning", variant="tonal", density="compact", classes="mt-2"):
                html.Span("{{ save_confirm }}")
                v3.VBtn(
                    "Replace",
                    size="small",
                    classes="ml-2",
                    click=(viewer.started(viewer.saving.save_as), "[]", "{ over: true }"),
                    **marks(data_test="replace"),
                )
        with v3.VCardActions():
            v3.VSpacer()
            v3.VBtn("Cancel", click="dialog = ''")
            v3.VBtn(
                "Save",
                color="primary",
                variant="flat",
                loading=("saving",),
                click=(viewer.started(viewer.saving.save_as), "[]"),
                **marks(data_test="save now"),
            )
    with _dialog("recipe", "Recipe", 680):
        with v3.VCardText():
            html.P(
                "What was done, for bvbedit run: save it as a .toml file in {{ folder }}.", classes="text-caption mb-2"
            )
            html.Pre("{{ recipe }}", classes="recipe", **marks(data_test="recipe text"))
            message("save")
        with v3.VCardActions():
            v3.VSpacer()
            v3.VBtn("Close", click="dialog = ''")
            v3.VBtn(
                "Copy",
                color="primary",
                variant="flat",
                **marks(data_test="copy", data_copies="recipe"),
            )
    with _dialog("close", "Close without saving?", 420):
        with v3.VCardText():
            html.P("{{ (documents.find(d => d.key === closing) || {}).name }} has changes that are not saved.")
            message("open")
        with v3.VCardActions():
            v3.VBtn("Keep it open", click="dialog = ''; closing = null")
            v3.VSpacer()
            v3.VBtn(
                "Close it",
                color="error",
                click=(viewer.opening.close, "[closing]", "{ discard: true }"),
                **marks(data_test="discard"),
            )
            v3.VBtn(
                "Save",
                color="primary",
                variant="flat",
                click=viewer.started(viewer.saving.save),
                **marks(data_test="save and close"),
            )
    with _dialog("help", "Help", 640):
        with v3.VCardText(classes="scroll", style="max-height: 70vh"):
            for title, text in HELP:
                html.H3(title, classes="text-subtitle-2 mt-2")
                html.P(text, classes="text-body-2")
        with v3.VCardActions():
            v3.VSpacer()
            v3.VBtn("Close", click="dialog = ''", **marks(data_test="close help"))


def start_page(viewer: "Viewer") -> None:
    """Build what is shown while nothing is open."""
    with (
        html.Div(v_if="!documents.length", classes="start scroll", **marks(data_test="start")),
        html.Div(classes="start-inner"),
    ):
        html.H1("bvbedit", classes="text-h5")
        html.P(
            "Measured materials as editable B-spline volumes. Open one, or begin with a sample.",
            classes="text-body-2 text-medium-emphasis mb-3",
        )
        message("open")
        _choices(viewer)


def _choices(viewer: "Viewer") -> None:
    """Show what can be opened: what was kept, files of the folder, samples."""
    with html.Div(v_if="kept_files.length", classes="mb-3"):
        html.H3("Not saved when the viewer ended", classes="text-subtitle-2")
        with html.Div(v_for="name in kept_files", key=("name",), classes="d-flex align-center"):
            html.Span("{{ name }}", classes="text-body-2 mr-2")
            v3.VBtn(
                "Recover",
                size="x-small",
                color="primary",
                click=(viewer.started(viewer.opening.recover), "[name]"),
                **marks(data_test="recover"),
            )
            v3.VBtn("Discard", size="x-small", variant="text", click=(viewer.opening.discard_kept, "[name]"))
    html.H3("Files in {{ folder }}", classes="text-subtitle-2")
    html.P(
        "No materials here: models (.bvb), MERL (.binary), RGL (.bsdf) and tables (.npz) would be listed.",
        v_if="!material_files.length",
        classes="text-caption",
    )
    with html.Div(classes="choices"):
        v3.VBtn(
            "{{ name }}",
            v_for="name in material_files",
            key=("name",),
            size="small",
            variant="tonal",
            classes="text-none ma-1",
            loading=("opening === name",),
            click=(viewer.started(viewer.opening.open_file), "[name]"),
            **marks(data_test="file"),
        )
    html.H3("Samples", classes="text-subtitle-2 mt-3")
    with (
        html.Div(classes="choices"),
        v3.VBtn(
            v_for="sample in samples",
            key=("sample.name",),
            variant="tonal",
            classes="text-none ma-1 sample",
            height="auto",
            click=(viewer.opening.open_sample, "[sample.name]"),
            **marks(data_test="sample"),
        ),
        html.Div(classes="sample-inner"),
    ):
        html.Div("{{ sample.name }}", classes="font-weight-bold")
        html.Div("{{ sample.about }}", classes="text-caption sample-about")
