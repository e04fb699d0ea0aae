"""The plot that explains a fit: how the error falls with the number of control points, and where the fit stands."""

from pathlib import Path
from typing import Any

import numpy as np

# Blue and orange of Okabe & Ito: told apart by all.
COLOURS = {"grid": "#0072b2", "nodes": "#d55e00"}


def plot_curve(model: Any, source: str, target: Path) -> None:
    """Write the error curve in the report of ``model`` to ``target`` (.png or .svg)."""
    import matplotlib

    matplotlib.use("Agg")
    from matplotlib import pyplot

    from bvbedit.io.files import replacing

    told = model.report
    points = [int(np.prod(step["size"])) for step in told["curve"]]
    metric = told["metric"]
    size = model.spline.size
    figure, axes = pyplot.subplots(figsize=(8, 5), layout="constrained")
    # A fit for a scene has one error, over what that scene looks at, and the metrics do not tell it.
    known = metric in told["metrics"]["grid"]
    for name, colour in COLOURS.items() if known else [("grid", COLOURS["grid"])]:
        errors = [step[name] for step in told["curve"]]
        axes.plot(points, errors, "o-", color=colour, label=f"{name if known else 'scene'}, quick fit")
        if known:
            error, label = told["metrics"][name][metric], f"{name}, this model"
            axes.plot([np.prod(size)], [error], "*", color=colour, markersize=16, label=label)
    axes.axvline(float(np.prod(size)), color="0.7", linewidth=1, zorder=0)
    axes.set(xscale="log", yscale="log", xlabel="control points", ylabel=metric.replace("_", " "))
    tried = "\n".join(f"{t['chart']} {t['encoding']}: {np.sqrt(t['grid'] * t['nodes']):.3g}" for t in told["tried"])
    axes.annotate(
        f"tried, mean of both\n{tried}", (0.98, 0.97), xycoords="axes fraction", ha="right", va="top", fontsize=9
    )
    axes.set_title(
        f"{source}: {model.chart.name}, {model.encoding.name}, {' x '.join(map(str, size))} control points", fontsize=11
    )
    axes.grid(True, which="both", color="0.92")
    axes.legend(frameon=False, loc="lower left")
    with replacing(target) as stream:
        figure.savefig(stream, format=target.suffix[1:].lower(), dpi=120)
    pyplot.close(figure)
