"""Commands that make pictures: render, view."""

from pathlib import Path

from bvbedit.cli.models import Json
from bvbedit.cli.output import progress, report


def render(
    first: Path,
    /,
    *files: Path,
    scene: str = "sphere",
    row: bool = False,
    difference: bool = False,
    swatches: bool = False,
    width: int = 256,
    height: int = 256,
    spp: int = 64,
    noise: float | None = None,
    time_limit: float | None = None,
    seed: int = 0,
    exposure: float = 0.0,
    as_json: Json = False,
) -> None:
    """Render models or measurements to a picture. Ctrl-C keeps what there is of it.

    Parameters
    ----------
    first
        The first file to render: MERL .binary, RGL .bsdf, table .npz or model .bvb.
    files
        More files to render, and last the picture to write: .png (tone-mapped) or .exr (linear).
    scene
        A scene by name (sphere, studio, furnace), a .toml scene, or a lat-long .exr environment for the sphere.
    row
        Each file in a picture of its own, side by side; also without asking where the scene shows one model.
    difference
        The first file beside each other one, with the differences amplified, from the same random numbers (.png).
    swatches
        A sheet of small pictures with names, some to a row (.png).
    width
        Width of each picture in pixels.
    height
        Height in pixels.
    spp
        Samples per pixel, at most.
    noise
        Stop when the standard error is this share of the picture's mean.
    time_limit
        Seconds for each picture after which no more samples are begun.
    seed
        Chooses the random numbers: the same for all materials.
    exposure
        Stops: each doubles the brightness of a .png.
    as_json
        Print one JSON object.
    """
    from time import perf_counter

    from bvbedit import api
    from bvbedit.cli import layouts
    from bvbedit.errors import BvbError
    from bvbedit.io import check_target

    if not files:
        raise BvbError("Nothing to render to. Name the models first and the .png or .exr to write last.")
    *more, target = files
    models = [first, *more]
    chosen = [name for name, wanted in (("row", row), ("difference", difference), ("swatches", swatches)) if wanted]
    if len(chosen) > 1:
        raise BvbError(f"--{chosen[0]} and --{chosen[1]} exclude each other. Choose one.")
    if difference and len(models) < 2:
        raise BvbError("A difference needs two files at least. Name the reference first.")
    check_target(target, (".png",) if difference or swatches else (".png", ".exr"))
    start = perf_counter()
    options = {"width": width, "height": height, "spp": spp, "noise": noise, "time_limit": time_limit, "seed": seed}
    shot = layouts.Shot([api.load(file) for file in models], [file.name for file in models], scene, options, exposure)
    told = layouts.LAYOUTS[chosen[0] if chosen else "picture"](shot, target)
    report(
        {
            "file": str(target),
            "files": [str(m) for m in models],
            "scene": scene,
            **told,
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
