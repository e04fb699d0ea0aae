"""The .bvb format: a zip archive of meta.json, knots_0 ..., and control; see ``dumps`` and ``loads``."""

import io
import json
import os
from typing import Any

import numpy as np

from bvbedit.brdf.charts import chart_named
from bvbedit.brdf.encodings import encoding_from_dict
from bvbedit.brdf.spline_brdf import SplineBrdf
from bvbedit.errors import BvbError
from bvbedit.io.archive import Archive, write_archive
from bvbedit.io.files import reading, replacing
from bvbedit.spline.arguments import shown
from bvbedit.spline.tensor import TensorSpline

FORMAT = "bvbedit"
VERSION = 1
PRECISIONS = ("float16", "float32", "float64")
META = "meta.json"

# Limits far above any net that makes sense and far below what would hurt; in bytes ...
LARGEST_FILE = 1 << 28
LARGEST_META = 1 << 24
# ... and in numbers, which take 8 bytes in memory however small they are stored.
MOST_KNOTS = 1 << 18
MOST_CONTROL = 1 << 24


def dumps(model: SplineBrdf, precision: str = "float32") -> bytes:
    """Return ``model`` as the bytes of a .bvb file, its control points rounded to ``precision``.

    Raises BvbError for an unknown precision, control points that it cannot hold, a report that is no JSON, and more
    of anything than ``loads`` would take.
    """
    if precision not in PRECISIONS:
        raise BvbError(f"Unknown precision {precision!r}. Choose one of {', '.join(PRECISIONS)}.")
    control = model.spline.control
    largest = float(np.abs(control).max())
    if largest > float(np.finfo(precision).max):
        raise BvbError(f"A control point of {largest:g} does not fit into {precision}. Save in a higher precision.")
    meta = {
        "format": FORMAT,
        "version": VERSION,
        "chart": model.chart.name,
        "encoding": model.encoding.to_dict(),
        "degrees": list(model.spline.degrees),
        "report": dict(model.report),
    }
    try:
        text = json.dumps(meta, allow_nan=False)
    except (TypeError, ValueError, RecursionError) as error:
        raise BvbError(f"The model's report is no JSON: {shown(str(error))}. Give texts and finite numbers.") from None
    longest = max(len(t) for t in model.spline.knots)
    if control.size > MOST_CONTROL or longest > MOST_KNOTS or len(text) > LARGEST_META:
        raise BvbError(
            f"{control.size:,} control values, {longest:,} knots on an axis and {len(text):,} bytes of report are too "
            f"much for a file. Keep within {MOST_CONTROL:,}, {MOST_KNOTS:,} and {LARGEST_META:,}."
        )
    arrays = {f"knots_{axis}": knots for axis, knots in enumerate(model.spline.knots)}
    arrays["control"] = control.astype(precision)
    stream = io.BytesIO()
    write_archive(stream, arrays, {META: text}, level=9)
    return stream.getvalue()


def loads(content: bytes, name: str = "model") -> SplineBrdf:
    """Return the model in the bytes of a .bvb file; ``name`` stands for it in messages.

    Raises BvbError, before memory is taken, for anything that is not a sound model of this version.
    """
    archive = Archive(io.BytesIO(content), name)
    meta = archive.object(META, LARGEST_META)
    if meta.get("format") != FORMAT:
        raise archive.corrupt(f"its format is {shown(meta.get('format'))}, not {FORMAT!r}")
    version = meta.get("version")
    if not isinstance(version, int) or isinstance(version, bool) or version < 1:
        raise archive.corrupt(f"its version is {shown(version)}")
    if version > VERSION:
        raise BvbError(
            f"{name} has format version {shown(version)}; this bvbedit reads up to {VERSION}. Update bvbedit."
        )
    try:
        degrees = _whole_numbers(meta.get("degrees"))
        knots = [archive.array(f"knots_{a}", ("float64",), 1, MOST_KNOTS) for a in range(len(degrees))]
        control = archive.array("control", PRECISIONS, len(degrees) + 1, MOST_CONTROL)
        spline = TensorSpline(degrees, knots, control)
        encoding = meta.get("encoding")
        report = meta.get("report", {})
        if not isinstance(encoding, dict) or not isinstance(report, dict):
            raise BvbError("encoding and report must be objects.")
        return SplineBrdf(spline, chart_named(meta.get("chart", "")), encoding_from_dict(encoding), report)
    except BvbError as error:
        if str(error).startswith(name):
            raise
        raise BvbError(f"{name} is not a sound model: {error}") from None


def _whole_numbers(value: Any) -> list[int]:
    if not isinstance(value, list) or not all(isinstance(v, int) and not isinstance(v, bool) for v in value):
        raise BvbError(f"degrees are {shown(value)}, not a list of whole numbers.")
    if len(value) != 3:
        raise BvbError(f"{len(value)} degrees given: a BRDF has three parameters.")
    return value


def save_bvb(model: SplineBrdf, path: str | os.PathLike[str], precision: str = "float32") -> None:
    """Write ``model`` to ``path``. Raises BvbError as ``dumps`` does, or where the file cannot be written."""
    content = dumps(model, precision)
    with replacing(path) as stream:
        stream.write(content)


def load_bvb(path: str | os.PathLike[str]) -> SplineBrdf:
    """Return the model in the file ``path``. Raises BvbError as ``loads`` does, or where it cannot be read."""
    return loads(_content(path), str(path))


def stored_precision(path: str | os.PathLike[str]) -> str:
    """Return the precision in which the file ``path`` holds its control points."""
    archive = Archive(io.BytesIO(_content(path)), str(path))
    return str(archive.array("control", PRECISIONS, 4, MOST_CONTROL).dtype)


def _content(path: str | os.PathLike[str]) -> bytes:
    with reading(path) as stream:
        if os.fstat(stream.fileno()).st_size > LARGEST_FILE:
            raise BvbError(f"{path} is larger than any model ({LARGEST_FILE >> 20} MiB). Name a .bvb file.")
        return stream.read()
