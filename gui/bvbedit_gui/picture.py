"""The picture of a model: its volume beside its lobes, drawn off-screen and written as PNG."""

import os
from typing import TYPE_CHECKING, Any

import numpy as np

from bvbedit.brdf.base import Brdf
from bvbedit.brdf.spline_brdf import SplineBrdf
from bvbedit.errors import BvbError
from bvbedit.io import check_target
from bvbedit.io.png import write_png
from bvbedit_gui import lobes, panels
from bvbedit_gui.drawing import number, write
from bvbedit_gui.opengl import require_opengl
from bvbedit_gui.themes import LIGHT

if TYPE_CHECKING:
    from pyvista import Plotter

# The paper's three angles of incidence in degrees: what is written, what is drawn. At 90 itself no reflectance exists.
INCIDENCES = ((0, 0.0), (45, 45.0), (90, 89.0))
SMALLEST, LARGEST = 400, 8192
# Where the lobes begin, as a share of the width: without and with measured lobes.
SPLIT = (0.6, 0.44)
VOLUME_CAPTION = "Surfaces of equal luminance; dots: control points at their Greville abscissae"
LOBES_CAPTION = "Lobes: the length of f (rings: 1/sr) in its own colour"
# A model that leaves the measurement behind by more than this is cut, lest its spike shrink everything else.
MOST_OVERSHOOT = 2.0


def screenshot(
    model: SplineBrdf,
    path: str | os.PathLike[str],
    *,
    measured: Brdf | None = None,
    width: int = 1600,
    height: int = 1000,
    title: str | None = None,
) -> None:
    """Write a picture of ``model`` as PNG: its volume over the parameter box, and its lobes at 0, 45 and 90 degrees.

    Beside each lobe stands that of ``measured``, where given, on the same scale. ``width`` and ``height`` in pixels;
    ``title`` stands on top, before the model in words. The lobes are those of Lee & Park 2008, Fig. 2.
    Raises BvbError for another file type than .png, sizes outside 400 ... 8192 pixels, a file that cannot be written,
    and a machine without OpenGL.
    """
    check_target(path, (".png",))
    for name, pixels in (("width", width), ("height", height)):
        if not SMALLEST <= pixels <= LARGEST:
            raise BvbError(f"{name} is {pixels}. Choose {SMALLEST} ... {LARGEST} pixels.")
    require_opengl()
    import pyvista as pv

    split = SPLIT[measured is not None]
    columns = 2 if measured is None else 3
    # Weights in thousandths: PyVista takes whole numbers.
    shares = [split, *[(1 - split) / (columns - 1)] * (columns - 1)]
    groups: list[Any] = [(0, range(columns)), (range(1, 4), 0)]
    plotter = pv.Plotter(
        off_screen=True,
        window_size=[width, height],
        shape=(4, columns),
        groups=groups,
        row_weights=[85, 305, 305, 305],
        col_weights=[round(1000 * share) for share in shares],
        border=False,
    )
    try:
        text_size = max(8, round(min(height / 60, width / 95)))
        size = " x ".join(str(n) for n in model.spline.size)
        words = f"{title or 'B-spline volume BRDF'}: {model.chart.name}, {model.encoding.name}, {size} control points"
        plotter.subplot(0, 0)
        plotter.renderer.set_background(LIGHT.paper)
        write(plotter, words, (0.01, 0.88), LIGHT.ink, round(1.4 * text_size), bold=True)
        write(plotter, VOLUME_CAPTION, (0.01, 0.36), LIGHT.ink, text_size)
        write(plotter, LOBES_CAPTION, (split, 0.36), LIGHT.ink, text_size)
        plotter.subplot(1, 0)
        panels.show_volume(plotter, model, text_size=text_size)
        for row, (written, drawn) in enumerate(INCIDENCES, start=1):
            _show_lobes(plotter, row, model, measured, written, drawn, text_size)
        plotter.enable_anti_aliasing("ssaa", all_renderers=True)
        picture = np.asarray(plotter.screenshot(return_img=True), dtype=np.uint8)
    finally:
        plotter.close()
    write_png(path, picture)


def _show_lobes(
    plotter: "Plotter", row: int, model: SplineBrdf, measured: Brdf | None, written: int, drawn: float, text_size: int
) -> None:
    """Show the lobes of model and measurement in the panels of ``row``, on the scale that suits the measurement."""
    theta_i = float(np.radians(drawn))
    brdfs = {"model": model} if measured is None else {"model": model, "measured": measured}
    shown = {name: lobes.lobe(brdf, theta_i) for name, brdf in brdfs.items()}
    peaks = {name: lobe.peak for name, lobe in shown.items()}
    reference = list(shown)[-1]
    scale = lobes.fitting_scale(shown[reference])
    # A black material has no length to scale by.
    peak = min(max(peaks.values()), MOST_OVERSHOOT * peaks[reference] or np.inf) or 1.0
    for column, (name, brdf) in enumerate(brdfs.items(), start=1):
        title = f"{name}, θ_i = {written}°" + (f" (drawn at {drawn:g}°)" if written != drawn else "")
        title += f"\npeak {number(peaks[name])}/sr"
        if peaks[name] > peak:
            title += f", cut at {number(peak)}"
        if theta_i > brdf.reliable_elevation + 1e-9:
            title += f", unreliable beyond {np.degrees(brdf.reliable_elevation):.3g}°"
        plotter.subplot(row, column)
        panels.show_lobe(plotter, shown[name], scale, peak, theta_i, title=title, text_size=text_size)
