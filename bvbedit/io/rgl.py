"""The RGL database's .bsdf format (Dupuy & Jakob 2018): a list of named tensors, then their bytes.

"tensor_file\\0", two version bytes, uint32 count of fields; for each a uint16 length of the name, the name, uint16
dimensions, uint8 type, uint64 offset, uint64 sizes. Little-endian throughout.
"""

import math
import os
import struct
from typing import Any

import numpy as np
from numpy.typing import NDArray

from bvbedit.brdf.geometry import Floats
from bvbedit.brdf.rgl import RglBrdf
from bvbedit.errors import BvbError
from bvbedit.io.files import reading

MAGIC = b"tensor_file\0"
VERSION = (1, 0)
TYPES = {1: "<u1", 2: "<i1", 3: "<u2", 4: "<i2", 5: "<u4", 6: "<i4", 7: "<u8", 8: "<i8", 9: "<f2", 10: "<f4", 11: "<f8"}

# Far above any file of the database (0.6 to 15 MB in RGB) and far below what would hurt.
LARGEST_FILE = 1 << 28
# Numbers, which take 8 bytes in memory however small they are stored, and may lie over one another in the file.
MOST_NUMBERS = 1 << 24
MOST_FIELDS = 256
MOST_DIMENSIONS = 8
WANTED = ("phi_i", "theta_i", "sigma", "ndf", "vndf", "rgb", "jacobian")


def load_rgl(path: str | os.PathLike[str]) -> RglBrdf:
    """Return the isotropic RGB measurement in the file ``path``.

    Raises BvbError for anisotropic and spectral files, and for what is truncated, damaged or no such file.
    """
    with reading(path) as stream:
        if os.fstat(stream.fileno()).st_size > LARGEST_FILE:
            raise BvbError(f"{path} is larger than any isotropic RGB measurement. Name the file *_rgb.bsdf.")
        content = stream.read()
    try:
        fields = _fields(content)
        if "spectra" in fields or "wavelengths" in fields:
            raise BvbError("it is spectral. Get the material's *_rgb.bsdf.")
        missing = [name for name in WANTED if name not in fields]
        if missing:
            raise BvbError(f"it has no field {', '.join(missing)}. Get the file again from where it came.")
        if len(fields["phi_i"]) > 2:
            raise BvbError(f"it is anisotropic ({len(fields['phi_i'])} azimuths). Choose an isotropic material.")
        count = sum(fields[name].size for name in WANTED)
        if count > MOST_NUMBERS:
            raise BvbError(f"it claims {count:,} numbers in all. Get the material's isotropic *_rgb.bsdf.")
        description = fields.get("description", np.zeros(0, "<u1")).tobytes().decode("utf-8", "replace")
        return RglBrdf(
            theta_i=fields["theta_i"],
            sigma=fields["sigma"],
            ndf=fields["ndf"],
            vndf=_at_azimuth_zero(fields["vndf"], fields["phi_i"]),
            rgb=_at_azimuth_zero(fields["rgb"], fields["phi_i"]),
            jacobian=bool(fields["jacobian"].any()),
            description=" ".join(description.split()),
        )
    except BvbError as error:
        raise BvbError(f"{path} is not a sound RGL measurement: {error}") from None


def _fields(content: bytes) -> dict[str, NDArray[Any]]:
    """Return the tensors of a file by name, read-only views. Raises BvbError where one leaves the file."""
    again = "Get the file again from where it came."
    place = len(MAGIC)

    def take(form: str) -> tuple[Any, ...]:
        nonlocal place
        size = struct.calcsize(form)
        if place + size > len(content):
            raise BvbError(f"its list of fields is cut off at byte {len(content):,}. {again}")
        place += size
        return struct.unpack_from(form, content, place - size)

    version = take("<2B")
    if not content.startswith(MAGIC) or version != VERSION:
        raise BvbError(f"its version is {'.'.join(map(str, version))}, not 1.0. {again}")
    (count,) = take("<I")
    if not 1 <= count <= MOST_FIELDS:
        raise BvbError(f"it claims {count:,} fields. {again}")
    out: dict[str, NDArray[Any]] = {}
    for _ in range(count):
        (length,) = take("<H")
        name = take(f"<{length}s")[0].decode("ascii", "replace")
        dimensions, code, offset = take("<HBQ")
        if not 1 <= dimensions <= MOST_DIMENSIONS:
            raise BvbError(f"its field {name[:40]!r} claims {dimensions} dimensions. {again}")
        shape = take(f"<{dimensions}Q")
        if code not in TYPES or name in out:
            raise BvbError(f"its field {name[:40]!r} has the type {code} or stands twice. {again}")
        # Python's whole numbers: sizes that overflow 64 bits must not come out small.
        dtype = np.dtype(TYPES[code])
        elements = math.prod(shape)
        if elements == 0 or offset + elements * dtype.itemsize > len(content):
            raise BvbError(
                f"its field {name[:40]!r} of shape {shape} does not lie within {len(content):,} bytes. {again}"
            )
        out[name] = np.frombuffer(content, dtype, elements, offset).reshape(shape)
    return out


def _at_azimuth_zero(stack: NDArray[Any], phi_i: NDArray[Any]) -> Floats:
    """Return ``stack`` (phi_i, ...) at phi_i = 0, linear between two azimuths: wi's is turned away beforehand."""
    if phi_i.ndim != 1 or len(stack) != len(phi_i):
        raise BvbError(f"{len(stack)} images for {phi_i.shape} azimuths. Get the file again from where it came.")
    first = np.asarray(stack[0], dtype=np.float64)
    if len(phi_i) == 1 or not phi_i[1] > phi_i[0]:
        return first
    share = float(np.clip(-phi_i[0] / (phi_i[1] - phi_i[0]), 0.0, 1.0))
    return np.asarray((1.0 - share) * first + share * stack[1], dtype=np.float64)
