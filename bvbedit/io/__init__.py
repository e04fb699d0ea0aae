"""Files in and out, one module per format. Knows nothing of rendering or editing."""

import os

from bvbedit.brdf.base import Brdf
from bvbedit.brdf.measured import MeasuredBrdf
from bvbedit.brdf.spline_brdf import SplineBrdf
from bvbedit.errors import BvbError
from bvbedit.io.files import as_path, check_target, make_folder, reading

__all__ = ["check_target", "load", "make_folder", "save"]


def load(path: str | os.PathLike[str]) -> Brdf:
    """Return the BRDF in the file ``path``, its format told by its content: MERL, RGL, .bvb model or .npz table.

    Raises BvbError for a missing file, a folder, an empty or foreign file, and one that is damaged.
    """
    with reading(path) as stream:
        head = stream.read(16)
    if not head:
        raise BvbError(f"{path} is empty. Get the file again from where it came.")
    if head.startswith(b"tensor_file\0"):
        from bvbedit.io.rgl import load_rgl

        return load_rgl(path)
    if head.startswith(b"PK"):
        from bvbedit.io.archive import Archive
        from bvbedit.io.bvb import META, load_bvb
        from bvbedit.io.table import load_table

        with reading(path) as stream:
            is_model = META in Archive(stream, str(path))
        return load_bvb(path) if is_model else load_table(path)
    if int.from_bytes(head[:4], "little", signed=True) == 90 or as_path(path).suffix.lower() == ".binary":
        from bvbedit.io.merl import load_merl

        return load_merl(path)
    raise BvbError(f"{path} is neither MERL, RGL, .bvb nor .npz. Name a file in one of these formats.")


def save(model: Brdf, path: str | os.PathLike[str], *, precision: str | None = None, pdf: bool = False) -> None:
    """Write ``model`` to ``path``: a SplineBrdf as .bvb, a MeasuredBrdf as .binary (on MERL's nodes) or .npz.

    ``precision`` (float16, float32, float64 or quantised) is that of the control points in a .bvb file, in place of the
    model's own storage; quantised, unless that says how, to 2**-12 of the largest. ``pdf`` adds to a .bvb the density
    by which directions of light are drawn, some 4 KB, so that a renderer need not build it. The file is written beside
    its target and moved into place. Raises BvbError for another suffix, and where it cannot be written.
    """
    suffix = as_path(path).suffix.lower()
    if isinstance(model, SplineBrdf):
        from bvbedit.io.bvb import save_bvb

        check_target(path, (".bvb",))
        save_bvb(model, path, precision, pdf=pdf)
    elif isinstance(model, MeasuredBrdf):
        from bvbedit.io.merl import save_merl
        from bvbedit.io.table import save_table

        check_target(path, (".binary", ".npz"))
        (save_merl if suffix == ".binary" else save_table)(model, path)
    else:
        raise BvbError(f"A {type(model).__name__} has no file format. Fit it first, or measure it.")
