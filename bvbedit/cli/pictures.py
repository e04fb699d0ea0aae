"""Commands that make pictures: render, view."""

from pathlib import Path

from bvbedit.cli.models import Json
from bvbedit.cli.output import progress, report


def render(
    first: Path,
    /,
    *files: Path,
    scene: str = "sphere",
    width: int = 256,
    height: int = 256,
    spp: int = 64,
    seed: int = 0,
    exposure: float = 0.0,
    as_json: Json = False,
) -> None:
    """Render models or measurements, side by side, to a picture.

    Parameters
    ----------
    first
        The first file to render: MERL .binary, RGL .bsdf, table .npz or model .bvb.
    files
        More files to render, and last the picture to write: .png (tone-mapped) or .exr (linear).
    scene
        A scene by name, or a lat-long .exr environment for the sphere.
    width
        Width of each picture in pixels.
    height
        Height in pixels.
    spp
        Samples per pixel.
    seed
        Chooses the random numbers: the same for all materials, so that pictures differ only where these do.
    exposure
        Stops: each doubles the brightness of a .png.
    as_json
        Print one JSON object.
    """
    from time import perf_counter

    import numpy as np

    from bvbedit import api
    from bvbedit.errors import BvbError
    from bvbedit.io import check_target
    from bvbedit.io.exr import write_exr
    from bvbedit.io.png import write_png
    from bvbedit.render.tonemap import tone_map

    if not files:
        raise BvbError("Nothing to render to. Name the models first and the .png or .exr to write last.")
    *more, target = files
    models = [first, *more]
    check_target(target, (".png", ".exr"))
    start = perf_counter()
    pictures = []
    for n, file in enumerate(models):
        brdf = api.load(file)
        with progress(f"Rendering {file.name} ({n + 1} of {len(models)})") as watch:
            pictures.append(api.render(brdf, scene, width=width, height=height, spp=spp, seed=seed, progress=watch))
    row = np.concatenate(pictures, axis=1)
    if target.suffix.lower() == ".exr":
        write_exr(target, row)
    else:
        write_png(target, tone_map(row, exposure))
    report(
        {
            "file": str(target),
            "files": [str(m) for m in models],
            "width": row.shape[1],
            "height": row.shape[0],
            "spp": spp,
            "seed": seed,
            "seconds": perf_counter() - start,
        },
        as_json,
    )


def view(model: Path, /, *, screenshot: Path, measured: Path | None = None, as_json: Json = False) -> None:
    """Draw a model's iso-value surfaces, control net and lobes into a picture.

    Parameters
    ----------
    model
        The .bvb file to look at.
    screenshot
        The .png file to write.
    measured
        The measurement whose lobes are drawn beside the model's.
    as_json
        Print one JSON object.
    """
    import bvbedit_gui
    from bvbedit import api
    from bvbedit.brdf.spline_brdf import SplineBrdf
    from bvbedit.errors import BvbError
    from bvbedit.io import check_target

    check_target(screenshot, (".png",))
    brdf = api.load(model)
    if not isinstance(brdf, SplineBrdf):
        raise BvbError(f"{model} is a measurement, not a model. Fit it first: bvbedit fit {model} {model.stem}.bvb")
    reference = None if measured is None else api.load(measured)
    with progress(f"Drawing {model.name}"):
        bvbedit_gui.screenshot(brdf, screenshot, measured=reference, title=model.name)
    report({"file": str(screenshot), "file_bytes": screenshot.stat().st_size}, as_json)
