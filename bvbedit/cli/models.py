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
Json = Annotated[bool, Parameter(name="--json", negative="")]


def fit(
    source: Path,
    target: Path,
    /,
    *,
    chart: str = "half-diff",
    encoding: str = "root",
    size: Size = None,
    degree: int = 3,
    knots: str = "averaged",
    max_bytes: int | None = None,
    max_payload: int | None = None,
    precision: str = "float32",
    as_json: Json = False,
) -> None:
    """Fit a B-spline volume to a measured BRDF.

    Parameters
    ----------
    source
        MERL .binary, RGL .bsdf, table .npz or model .bvb, told apart by content.
    target
        The .bvb file to write.
    chart
        half-diff (sharp highlights) or in-out (the paper's).
    encoding
        root, log or linear: what is approximated.
    size
        Control points along each axis, like 20,20,80.
    degree
        Degree along every axis, 0 to 16.
    knots
        averaged, piegl-tiller (the paper's) or uniform.
    max_bytes
        Largest file, in place of a size. The default is 49152.
    max_payload
        Most bytes of control points and interior knots, in place of a size.
    precision
        float16, float32 or float64 control points in the file.
    as_json
        Print one JSON object.
    """
    from time import perf_counter

    from bvbedit import api
    from bvbedit.io import check_target

    start = perf_counter()
    check_target(target, (".bvb",))
    brdf = api.load(source)
    with progress(f"Fitting {source.name}") as watch:
        model = api.fit(
            brdf,
            chart=chart,
            encoding=encoding,
            size=size,
            degrees=(degree,) * 3,
            knots=knots,
            max_bytes=max_bytes,
            max_payload=max_payload,
            precision=precision,
            progress=watch,
        )
    model = model.told(source=source.name)
    api.save(model, target, precision=precision)
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
    from bvbedit.brdf.spline_brdf import face_spread, payload_bytes
    from bvbedit.io.bvb import stored_precision

    spline = model.spline
    precision = stored_precision(file)
    told = dict(model.report)
    return {
        "file": str(file),
        "file_bytes": file.stat().st_size,
        "payload_bytes": payload_bytes(spline.size, spline.degrees, precision),
        "precision": precision,
        "chart": model.chart.name,
        "encoding": model.encoding.to_dict(),
        "degrees": list(spline.degrees),
        "size": list(spline.size),
        "face_spread": face_spread(spline.control, model.chart),
        **{k: told.get(k) for k in ("source", "knots", "condition", "seconds", "notes", "metrics")},
    }


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


def export(source: Path, target: Path, /, *, as_json: Json = False) -> None:
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
    from bvbedit.brdf.charts import HALF_DIFF, Rusinkiewicz
    from bvbedit.brdf.goniophotometer import measure
    from bvbedit.brdf.measured import MeasuredBrdf
    from bvbedit.brdf.spline_brdf import SplineBrdf
    from bvbedit.io import check_target

    check_target(target, (".binary", ".npz"))
    brdf = api.load(source)
    merl = target.suffix == ".binary"
    if isinstance(brdf, MeasuredBrdf) and (not merl or isinstance(brdf.chart, Rusinkiewicz)):
        table = brdf
    elif merl:
        table = measure(brdf, "merl")
    else:
        folded = isinstance(brdf, SplineBrdf) and brdf.chart is HALF_DIFF
        table = measure(brdf, "half-diff" if folded else "paper")
    api.save(table, target)
    report(
        {
            "file": str(target),
            "file_bytes": target.stat().st_size,
            "chart": table.chart.name,
            "size": list(table.valid.shape),
            "valid": float(table.valid.mean()),
        },
        as_json,
    )
