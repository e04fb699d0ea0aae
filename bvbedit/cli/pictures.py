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


def view(
    *models: Path,
    measured: Path | None = None,
    screenshot: Path | None = None,
    host: str = "127.0.0.1",
    port: int | None = None,
    browser: bool = True,
    as_json: Json = False,
) -> None:
    """Open materials in the viewer, in the browser, to look at and to edit; or draw one into a picture.

    Parameters
    ----------
    models
        Models .bvb, measurements to fit, or none: then there are samples to begin with. Files in the present folder
        can be opened from the page.
    measured
        The measurement that the first model is compared with.
    screenshot
        Draw iso-value surfaces, control net and lobes of the model into this .png file instead, and end.
    host
        The address to listen on. Any other than this machine's own lets others in who are told the page's address.
    port
        The port to listen on, in place of a free one.
    browser
        Open the page in the browser. Without: only print its address.
    as_json
        Print one JSON object: with a screenshot.
    """
    import bvbedit_gui
    from bvbedit.errors import BvbError

    if screenshot is None:
        if as_json:
            raise BvbError("--json is for --screenshot: a viewer has no result. Leave it out.")
        bvbedit_gui.view(models, measured=measured, host=host, port=port, browser=browser, tell=_tell)
        return
    if len(models) != 1:
        raise BvbError("A screenshot shows one model. Name one.")
    _screenshot(models[0], screenshot, measured, as_json)


def _tell(line: str) -> None:
    # At once, also where a pipe would keep it back.
    print(line, flush=True)


def _screenshot(model: Path, screenshot: Path, measured: Path | None, as_json: bool) -> None:
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
