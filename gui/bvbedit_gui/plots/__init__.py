"""Plots and figures of a model as SVG text and words: pure functions that know nothing of pages, windows or files."""

from bvbedit_gui.plots.albedo_picture import draw_albedo
from bvbedit_gui.plots.albedos import AlbedoCurve, albedo_curve
from bvbedit_gui.plots.facts import Row, figures
from bvbedit_gui.plots.line_picture import draw_iso_line
from bvbedit_gui.plots.lines import IsoLine, iso_line

__all__ = ["AlbedoCurve", "IsoLine", "Row", "albedo_curve", "draw_albedo", "draw_iso_line", "figures", "iso_line"]
