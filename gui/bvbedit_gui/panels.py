"""The panels of a picture: a volume with its colour bar, lobes with their titles, in the current renderer of a plotter.

Knows nothing of windows, layouts or files.
"""

from typing import TYPE_CHECKING, Any, cast

import numpy as np

from bvbedit.brdf.encodings import Encoding
from bvbedit.brdf.spline_brdf import SplineBrdf
from bvbedit_gui import volume
from bvbedit_gui.drawing import font, number, write
from bvbedit_gui.lobe_scene import CHALK, LIGHT, MIRROR, LobeScene
from bvbedit_gui.lobes import Lobe
from bvbedit_gui.themes import LIGHT as BY_DAY
from bvbedit_gui.volume_scene import VolumeScene

if TYPE_CHECKING:
    from pyvista import Plotter

# vtkTextProperty: take the font from a file.
VTK_FONT_FILE = 4
SCALE_WORDS = {"linear": "linear", "root": "cube root", "log": "logarithmic"}


def show_volume(plotter: "Plotter", model: SplineBrdf, *, text_size: int) -> None:
    """Show iso-surfaces and control net of ``model`` in its parameter box, with its axes and a colour bar.

    ``text_size`` in pixels.
    """
    scene = VolumeScene(plotter, BY_DAY, text_size)
    shown = volume.field(model, model.chart)
    low, high = shown.ends
    values = volume.iso_values(low, high)
    # The map's ends lie a little outside the values, so that the outermost surfaces do not take its extreme colours.
    first, last = shown.level(np.array([values[0], values[-1]] if values else [low, high]))
    scene.colour_by(first - 0.3, last + 0.3, signed=False)
    scene.show_chart(model.chart)
    scene.show_surfaces(volume.iso_surfaces(shown, volume.grid(shown), values), opacity=0.5)
    scene.show_net(volume.net_points(model), shown.level(volume.net_values(model)))
    scene.look_from("oblique")
    marks = {float(shown.level(v)): number(v) for v in values or [high]}
    _add_bar(plotter, scene, marks, text_size)


def _add_bar(plotter: "Plotter", scene: VolumeScene, marks: dict[float, str], text_size: int) -> None:
    """Add a colour bar with these marks: levels, and what is written beside them."""
    scene.colours.annotations = marks
    # PyVista's decorator hides the signature from type checkers.
    bar = cast(Any, plotter).add_scalar_bar(
        title="luminance of f, 1/sr",
        mapper=plotter.actors["surfaces"].mapper,
        n_labels=0,
        vertical=False,
        width=0.7,
        height=0.075,
        position_x=0.15,
        position_y=0.04,
        color=BY_DAY.ink,
        title_font_size=text_size,
        label_font_size=text_size,
        unconstrained_font_size=True,
    )
    for style in (bar.GetTitleTextProperty(), bar.GetAnnotationTextProperty()):
        style.SetFontFamily(VTK_FONT_FILE)
        style.SetFontFile(font())


def show_lobe(
    plotter: "Plotter",
    lobe: Lobe,
    scale: Encoding,
    peak: float,
    theta_i: float,
    *,
    title: str,
    text_size: int,
) -> None:
    """Show a lobe with its ground grid and the incident and mirror directions.

    ``peak`` (1/sr) is the length drawn as radius 1, so that lobes shown with one peak and one scale can be compared;
    what is longer is cut there. ``theta_i`` in radians; ``title`` one line or more; ``text_size`` in pixels.
    """
    small = round(0.85 * text_size)
    scene = LobeScene(plotter, text_size)
    scene.show(lobe, scale, peak, theta_i)
    scene.look_from("oblique")
    write(plotter, title, (0.03, 0.96), CHALK, text_size)
    write(plotter, f"{SCALE_WORDS[scale.name]} radius", (0.03, 0.1), CHALK, small)
    write(plotter, "light", (0.97, 0.96), LIGHT, small, align="right")
    write(plotter, "mirror", (0.97, 0.88), MIRROR, small, align="right")
