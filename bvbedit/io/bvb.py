"""The .bvb format: a zip archive of meta.json, knots_0 ..., control, and perhaps pdf; see ``dumps`` and ``loads``."""

import io
import json
import os
from collections.abc import Mapping, Sequence
from typing import Any

from bvbedit.brdf.charts import chart_named
from bvbedit.brdf.encodings import encoding_from_dict
from bvbedit.brdf.sampling import coded, decoded, half_vector_density
from bvbedit.brdf.spline_brdf import SplineBrdf
from bvbedit.brdf.storage import MOST_PLANES, Storage, storage_named, unpacked
from bvbedit.errors import BvbError
from bvbedit.io.archive import Archive, Array, write_archive
from bvbedit.io.files import reading, replacing
from bvbedit.spline.arguments import shown
from bvbedit.spline.tensor import TensorSpline

FORMAT = "bvbedit"
VERSION = 1
META = "meta.json"

# Limits far above any net that makes sense and far below what would hurt; in bytes ...
LARGEST_FILE = 1 << 28
LARGEST_META = 1 << 24
# ... and in numbers, which take 8 bytes in memory however small they are stored.
MOST_KNOTS = 1 << 18
MOST_CONTROL = 1 << 24


def dumps(
    model: SplineBrdf,
    precision: str | None = None,
    *,
    pdf: bool = False,
    recipe: Mapping[str, Any] | None = None,
) -> bytes:
    """Return ``model`` as the bytes of a .bvb file, its control points rounded to ``precision``.

    That is one of ``PRECISIONS``, or the model's own storage; "quantised", where that has no step, takes 2**-12 of the
    largest |control point|. ``pdf`` adds the density by which directions are drawn, a few KB; ``recipe`` tells how the
    model came about, as JSON can hold it. Raises BvbError for an
    unknown precision, control points that it cannot hold, a report that is no JSON, and more of anything than ``loads``
    would take.
    """
    control = model.spline.control
    storage = model.storage
    if precision is not None and precision != storage.precision:
        storage = storage_named(precision, control)
    array, axes = storage.packed(control)
    meta = {
        "format": FORMAT,
        "version": VERSION,
        "chart": model.chart.name,
        "encoding": model.encoding.to_dict(),
        "degrees": list(model.spline.degrees),
        "storage": _described(storage, axes),
        "report": dict(model.report),
    }
    if recipe is not None:
        meta["recipe"] = dict(recipe)
    try:
        text = json.dumps(meta, allow_nan=False)
    except (TypeError, ValueError, RecursionError) as error:
        raise BvbError(
            f"The model's report or recipe is no JSON: {shown(str(error))}. Give texts and finite numbers."
        ) from None
    longest = max(len(t) for t in model.spline.knots)
    if control.size > MOST_CONTROL or longest > MOST_KNOTS or len(text) > LARGEST_META:
        raise BvbError(
            f"{control.size:,} control values, {longest:,} knots on an axis and {len(text):,} bytes of report are too "
            f"much for a file. Keep within {MOST_CONTROL:,}, {MOST_KNOTS:,} and {LARGEST_META:,}."
        )
    arrays = {f"knots_{axis}": knots for axis, knots in enumerate(model.spline.knots)}
    more = {"pdf": coded(half_vector_density(model))} if pdf else {}
    stream = io.BytesIO()
    write_archive(stream, {**arrays, "control": array, **more}, {META: text}, level=9)
    return stream.getvalue()


def _described(storage: Storage, axes: Sequence[int]) -> dict[str, Any]:
    if storage.step is None:
        return {"precision": storage.precision}
    return {"precision": storage.precision, "step": storage.step, "differences": list(axes)}


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
        degrees = _whole_numbers(meta.get("degrees"), "degrees")
        if len(degrees) != 3:
            raise BvbError(f"{len(degrees)} degrees given: a BRDF has three parameters.")
        knots = [archive.array(f"knots_{a}", ("float64",), 1, MOST_KNOTS) for a in range(len(degrees))]
        storage, axes = _storage(meta.get("storage"))
        size = tuple(len(t) - p - 1 for t, p in zip(knots, degrees, strict=True))
        spline = TensorSpline(degrees, knots, unpacked(_net(archive, storage, size), storage, axes))
        encoding = meta.get("encoding")
        report = meta.get("report", {})
        if not isinstance(encoding, dict) or not isinstance(report, dict):
            raise BvbError("encoding and report must be objects.")
        model = SplineBrdf(
            spline, chart_named(meta.get("chart", "")), encoding_from_dict(encoding), report, storage=storage
        )
        if "pdf.npy" not in archive:
            return model
        codes = archive.array("pdf", ("uint8",), 3, MOST_CONTROL)
        return SplineBrdf(spline, model.chart, model.encoding, report, storage=storage, density=decoded(codes, model))
    except BvbError as error:
        if str(error).startswith(name):
            raise
        raise BvbError(f"{name} is not a sound model: {error}") from None


def _whole_numbers(value: Any, name: str) -> list[int]:
    if not isinstance(value, list) or not all(isinstance(v, int) and not isinstance(v, bool) for v in value):
        raise BvbError(f"{name} are {shown(value)}, not a list of whole numbers.")
    return value


def _storage(value: Any) -> tuple[Storage, list[int]]:
    """Return the storage that meta.json describes, and the axes along which differences were taken."""
    if not isinstance(value, dict):
        raise BvbError(f"storage is {shown(value)}, not an object.")
    storage = Storage(value.get("precision", ""), value.get("step"))
    axes = _whole_numbers(value.get("differences", []), "differences")
    if value != _described(storage, axes):
        raise BvbError(f"storage is {shown(value)}, with entries missing or unknown.")
    return storage, axes


def _net(archive: Archive, storage: Storage, size: tuple[int, ...]) -> Array:
    """Return the member ``control``: of the storage's type, within limits; of planes the shape is right as well."""
    if storage.step is None:
        return archive.array("control", (storage.precision,), len(size) + 1, MOST_CONTROL)
    planes = archive.array("control", ("uint8",), len(size) + 2, MOST_PLANES * MOST_CONTROL)
    if planes.shape[1:] != (3, *size):
        raise BvbError(f"its planes have shape {shown(planes.shape)}, its knots and degrees ask for size {size}.")
    if planes[0].size > MOST_CONTROL:
        raise BvbError(f"control has {planes[0].size:,} entries, more than the {MOST_CONTROL:,} allowed.")
    return planes


def save_bvb(
    model: SplineBrdf,
    path: str | os.PathLike[str],
    precision: str | None = None,
    *,
    pdf: bool = False,
    recipe: Mapping[str, Any] | None = None,
) -> None:
    """Write ``model`` to ``path``, in its own storage or as ``precision`` says, with its density and its recipe.

    Raises BvbError as ``dumps`` does, or where the file cannot be written.
    """
    content = dumps(model, precision, pdf=pdf, recipe=recipe)
    with replacing(path) as stream:
        stream.write(content)


def load_bvb(path: str | os.PathLike[str]) -> SplineBrdf:
    """Return the model in the file ``path``. Raises BvbError as ``loads`` does, or where it cannot be read."""
    return loads(_content(path), str(path))


def load_recipe(path: str | os.PathLike[str]) -> dict[str, Any] | None:
    """Return how the model in a .bvb file came about, as it was saved, or None. Raises BvbError as ``load_bvb``."""
    recipe = Archive(io.BytesIO(_content(path)), str(path)).object(META, LARGEST_META).get("recipe")
    if recipe is not None and not isinstance(recipe, dict):
        raise BvbError(f"{path} is not a sound model: its recipe is {shown(recipe)}, not an object.")
    return recipe


def _content(path: str | os.PathLike[str]) -> bytes:
    with reading(path) as stream:
        if os.fstat(stream.fileno()).st_size > LARGEST_FILE:
            raise BvbError(f"{path} is larger than any model ({LARGEST_FILE >> 20} MiB). Name a .bvb file.")
        return stream.read()
