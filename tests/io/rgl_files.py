"""Generated .bsdf files: a GGX metal in the parameterisation of Dupuy & Jakob (2018)."""

import struct
from collections.abc import Mapping

import numpy as np

from bvbedit.brdf.base import Brdf
from bvbedit.brdf.geometry import Floats, elevation, spherical

CODES = {"u1": 1, "u4": 5, "f4": 10, "f8": 11}


def bsdf_bytes(fields: Mapping[str, np.ndarray]) -> bytes:
    """Return a .bsdf file that holds ``fields`` in their order, each of a type in ``CODES``."""
    head = 18 + sum(2 + len(name) + 11 + 8 * a.ndim for name, a in fields.items())
    table, body = b"", b""
    for name, a in fields.items():
        table += struct.pack(
            f"<H{len(name)}sHBQ", len(name), name.encode(), a.ndim, CODES[a.dtype.str[1:]], head + len(body)
        )
        table += struct.pack(f"<{a.ndim}Q", *a.shape)
        body += a.tobytes()
    return b"tensor_file\0" + bytes([1, 0]) + struct.pack("<I", len(fields)) + table + body


def ggx_fields(
    brdf: Brdf, alpha: float, *, elevations: int = 8, density: int = 48, samples: int = 32
) -> dict[str, np.ndarray]:
    """Return the fields that tell ``brdf``, its microfacets distributed by GGX of roughness ``alpha``."""
    theta_i = np.linspace(0, np.pi / 2, elevations)
    u = np.linspace(0, 1, density)
    theta_m, phi_m = (u**2 * np.pi / 2)[None, :], ((2 * u - 1) * np.pi)[:, None]

    def ndf(theta: Floats) -> Floats:
        c = np.cos(theta)
        return alpha**2 / (np.pi * (c**2 * (alpha**2 - 1) + 1) ** 2)

    def sigma(theta: Floats) -> Floats:
        return 0.5 * (np.cos(theta) + np.sqrt(np.cos(theta) ** 2 + (alpha * np.sin(theta)) ** 2))

    vndf = np.empty((elevations, density, density))
    rgb = np.empty((elevations, 3, samples, samples))
    for n, theta in enumerate(theta_i):
        wi = spherical(theta, 0.0)
        facing = np.maximum(spherical(theta_m, phi_m) @ wi, 0)
        vndf[n] = ndf(theta_m) * facing * np.sin(theta_m) * u
        v = np.linspace(0, 1, samples)
        y, x = _points(vndf[n], v)
        wm = spherical(x**2 * np.pi / 2, (2 * y[:, None] - 1) * np.pi)
        wo = 2 * (wm @ wi)[..., None] * wm - wi
        above = wo[..., 2] > 0
        f = np.zeros((*above.shape, 3))
        held = spherical(min(theta, 1.5), 0.0)
        f[above] = brdf.evaluate(held, wo[above]) * wo[above][:, 2:]
        rgb[n] = np.moveaxis(f * (4 * sigma(theta) / ndf(elevation(wm)))[..., None], -1, 0)

    fine = (np.linspace(0, 1, 128) ** 2 * np.pi / 2)[None, :]
    float32 = np.float32
    return {
        "description": np.frombuffer(b"Generated GGX metal", np.uint8),
        "phi_i": np.zeros(1, float32),
        "theta_i": theta_i.astype(float32),
        "sigma": np.repeat(sigma(fine), 2, axis=0).astype(float32),
        "ndf": np.repeat(ndf(fine), 2, axis=0).astype(float32),
        "vndf": vndf[None].astype(float32),
        "luminance": rgb.mean(axis=1)[None].astype(float32),
        "rgb": rgb[None].astype(float32),
        "jacobian": np.ones(1, np.uint8),
    }


def _points(density: Floats, v: Floats) -> tuple[Floats, Floats]:
    """Return the points y (rows,) and x (rows, columns) that uniform samples ``v`` on both axes are mapped to.

    Found by brute force: the density is tabulated finely, summed, and the sums are inverted.
    """
    fine = np.linspace(0, 1, 4001)
    nodes = np.linspace(0, 1, len(density))
    rows = np.array([np.interp(fine, nodes, row) for row in density])
    totals = np.interp(fine, nodes, np.trapezoid(rows, fine, axis=1))
    y = _inverse(totals, v, fine)
    at = y * (len(density) - 1)
    below = np.minimum(at.astype(int), len(density) - 2)
    share = (at - below)[:, None]
    x = np.array([_inverse(row, v, fine) for row in (1 - share) * rows[below] + share * rows[below + 1]])
    return y, x


def _inverse(density: Floats, v: Floats, at: Floats) -> Floats:
    sums = np.concatenate([[0.0], np.cumsum(density[1:] + density[:-1])])
    if sums[-1] == 0:
        return v
    rising = np.concatenate([[True], np.diff(sums) > 0])
    return np.interp(v * sums[-1], sums[rising], at[rising])
