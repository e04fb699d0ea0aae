"""Commands on models and measurements: fit, info, compare, export."""

from pathlib import Path
from typing import Annotated, Any

from cyclopts import Parameter, Token

from bvbedit.cli.output import progress, report


def _three_numbers(_type: Any, tokens: tuple[Token, ...]) -> tuple[int, int, int]:
    parts = tokens[0].value.replace("x", ",").split(",")
    if len(parts) != 3 or not all(p.strip().isdigit() for p in parts):
        raise ValueError(f"{tokens[0].value!r} is not a size. Give three whole numbers, like 20,20,80.")
    return int(parts[0]), int(parts[1]), int(parts[2])


Size = Annotated[tuple[int, int, int] | None, Parameter(converter=_three_numbers, n_tokens=1, accepts_keys=False)]


def _strength(_type: Any, tokens: tuple[Token, ...]) -> float | str:
    text = tokens[0].value
    try:
        return "auto" if text == "auto" else float(text)
    except ValueError:
        raise ValueError(f"{text!r} is no strength. Give auto, or a number from 0 up.") from None


Smoothing = Annotated[float | str | None, Parameter(converter=_strength, n_tokens=1)]
Json = Annotated[bool, Parameter(name="--json", negative="")]


def fit(
    source: Path,
    target: Path,
    /,
    *,
    chart: str = "auto",
    encoding: str = "auto",
    size: Size = None,
    degree: int = 3,
    knots: str = "dominant",
    max_bytes: int | None = None,
    max_payload: int | None = None,
    tolerance: float | None = None,
    metric: str = "log_cosine_rms",
    scene: str | None = None,
    image_tolerance: float | None = None,
    precision: str = "auto",
    thorough: bool = False,
    smoothing: Smoothing = None,
    pdf: bool = False,
    explain: Path | None = None,
    as_json: Json = False,
) -> None:
    """Fit a B-spline volume to a measured BRDF.

    Without a size or a bound the net is as large as the knee of its error curve asks for.

    Parameters
    ----------
    source
        MERL .binary, RGL .bsdf, table .npz or model .bvb, told apart by content.
    target
        The .bvb file to write.
    chart
        half-diff (sharp highlights), in-out (the paper's) or auto (the better one by a quick trial).
    encoding
        root, log or linear: what is approximated; or auto.
    size
        Control points along each axis, like 20,20,80.
    degree
        Degree along every axis, 0 to 16.
    knots
        dominant (where the material has features), free (moved from there), averaged, piegl-tiller (the paper's) or
        uniform.
    max_bytes
        Largest file, in place of a size.
    max_payload
        Most bytes of control points and interior knots as stored, in place of a size.
    tolerance
        Largest metric, in place of a size: the smallest net that keeps it on both sets of samples. With a scene, the
        largest root mean square error of its pixels, as a share of white.
    metric
        What is to be small: log_cosine_rms, fores, relative_l1, or e_rms, the paper's error in its chart and encoding.
    scene
        Only what this scene (a name, a .toml or an .exr) shows of the material counts, in place of the metric.
    image_tolerance
        Largest error of a pixel in that scene, as a share of white, in place of a size: the smallest file for it.
    precision
        quantised, float16, float32 or float64 control points in the file; auto is quantised.
    thorough
        Take more steps on the metric itself, and some seconds longer.
    smoothing
        For noisy data: auto, or a strength from 0 up; how much differences of the net are penalised.
    pdf
        Keep in the file, in some 4 KB more, by what renderers draw directions of light.
    explain
        A .png or .svg file to plot the error curve to: why the net has the size it has.
    as_json
        Print one JSON object.
    """
    from functools import partial
    from time import perf_counter

    from bvbedit import api
    from bvbedit.errors import BvbError
    from bvbedit.io import check_target

    start = perf_counter()
    check_target(target, (".bvb",))
    if explain is not None:
        check_target(explain, (".png", ".svg"))
    if image_tolerance is not None and scene is None:
        raise BvbError("--image-tolerance needs a --scene to look at. Name one.")
    if image_tolerance is not None and any(x is not None for x in (size, max_bytes, max_payload, tolerance)):
        raise BvbError("--image-tolerance and another bound or size exclude each other. Give one of them.")
    brdf = api.load(source)
    chosen = partial(
        api.fit,
        brdf,
        chart=chart,
        encoding=encoding,
        degrees=(degree,) * 3,
        knots=knots,
        metric=metric,
        scene=scene,
        precision=precision,
        thorough=thorough,
        smoothing=smoothing,
        source=source.name,
    )
    with progress(f"Fitting {source.name}") as watch:
        if scene is not None and image_tolerance is not None:
            from bvbedit.image_tolerance import fit_to_image

            model = fit_to_image(
                brdf,
                scene,
                image_tolerance,
                fit_within=lambda most: chosen(max_bytes=most),
                progress=watch,
            )
        else:
            model = chosen(size=size, max_bytes=max_bytes, max_payload=max_payload, tolerance=tolerance, progress=watch)
    api.save(model, target, pdf=pdf)
    if explain is not None:
        from bvbedit.cli.explanation import plot_curve

        plot_curve(model, source.name, explain)
    result = describe_model(model, target)
    report({**result, "seconds": perf_counter() - start}, as_json)


def info(file: Path, /, *, as_json: Json = False) -> None:
    """Tell what a file holds.

    Parameters
    ----------
    file
        MERL .binary, RGL .bsdf, table .npz or model .bvb.
    as_json
        Print one JSON object.
    """
    from bvbedit.brdf.measured import MeasuredBrdf
    from bvbedit.brdf.spline_brdf import SplineBrdf
    from bvbedit.io import load

    brdf = load(file)
    if isinstance(brdf, SplineBrdf):
        report(describe_model(brdf, file), as_json)
        return
    result: dict[str, Any] = {"file": str(file), "file_bytes": file.stat().st_size, "kind": type(brdf).__name__}
    if isinstance(brdf, MeasuredBrdf):
        result |= {
            "chart": brdf.chart.name,
            "size": list(brdf.valid.shape),
            "valid": float(brdf.valid.mean()),
            "clamped": brdf.clamped,
            "largest": float(brdf.values[brdf.valid].max()),
        }
    report(result, as_json)


def describe_model(model: Any, file: Path) -> dict[str, Any]:
    """Return what ``fit`` and ``info`` tell of a saved model."""
    from bvbedit.brdf.spline_brdf import face_spread

    spline, storage = model.spline, model.storage
    told = dict(model.report)
    return {
        "file": str(file),
        "file_bytes": file.stat().st_size,
        "payload_bytes": storage.payload_bytes(spline.control, spline.degrees),
        "precision": storage.precision,
        "step": storage.step,
        "chart": model.chart.name,
        "encoding": model.encoding.to_dict(),
        "degrees": list(spline.degrees),
        "size": list(spline.size),
        "face_spread": face_spread(spline.control, model.chart),
        **{k: told.get(k) for k in ("source", "knots", "condition", "seconds", "notes", "metrics")},
        "soundness": told["soundness"] if "soundness" in told else soundness_of(model),
        **{k: told[k] for k in ("image", "noise", "smoothing", "tried", "curve") if k in told},
    }


def soundness_of(model: Any) -> dict[str, Any]:
    """Return what can be said of an edited model, whose measurement is not at hand."""
    from bvbedit.brdf.soundness import soundness

    return soundness(model)


def compare(a: Path, b: Path, /, *, as_json: Json = False) -> None:
    """Measure how far A is from the reference B, each a measurement or a model.

    Parameters
    ----------
    a
        The file to judge.
    b
        The reference.
    as_json
        Print one JSON object.
    """
    from bvbedit import api

    first, second = api.load(a), api.load(b)
    with progress(f"Comparing {a.name} with {b.name}") as watch:
        result = api.compare(first, second, progress=watch)
    report(result.to_dict(), as_json)


def export_table(source: Path, target: Path, /, *, as_json: Json = False) -> None:
    """Write a model or a measurement as a MERL table (.binary) or a table on its own chart (.npz).

    Parameters
    ----------
    source
        MERL .binary, RGL .bsdf, table .npz or model .bvb.
    target
        The .binary or .npz file to write.
    as_json
        Print one JSON object.
    """
    from bvbedit import api
    from bvbedit.io import check_target
    from bvbedit.io.export import TABLES, export

    check_target(target, TABLES)
    table, missed = export(api.load(source), target)
    report(
        {
            "file": str(target),
            "file_bytes": target.stat().st_size,
            "chart": table.chart.name,
            "size": list(table.valid.shape),
            "valid": float(table.valid.mean()),
            "resampling_error": {"grid": missed.grid.log_cosine_rms, "nodes": missed.nodes.log_cosine_rms},
        },
        as_json,
    )
