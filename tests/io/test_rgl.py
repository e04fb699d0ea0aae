"""RGL files: read as written, checked against Mitsuba's own reader, and refused where they are no such file."""

from pathlib import Path

import numpy as np
import pytest

import bvbedit
from bvbedit import BvbError
from bvbedit.brdf.analytic import GGX, Schlick
from bvbedit.brdf.rgl import RglBrdf
from bvbedit.io.rgl import load_rgl
from tests.brdf.samples import random_pairs
from tests.io.rgl_files import bsdf_bytes, ggx_fields

METAL = GGX(0.3, Schlick((0.9, 0.6, 0.3)))


@pytest.fixture(scope="module")
def fields() -> dict[str, np.ndarray]:
    return ggx_fields(METAL, 0.3, elevations=6, density=24, samples=12)


def written(folder: Path, fields: dict[str, np.ndarray]) -> Path:
    path = folder / "metal.bsdf"
    path.write_bytes(bsdf_bytes(fields))
    return path


def test_what_is_written_is_read(tmp_path, fields):
    brdf = bvbedit.load(written(tmp_path, fields))
    assert isinstance(brdf, RglBrdf)
    assert brdf.description == "Generated GGX metal"
    assert brdf.jacobian
    for name in ("theta_i", "sigma", "ndf"):
        np.testing.assert_array_equal(getattr(brdf, name), fields[name])
    np.testing.assert_array_equal(brdf.rgb, fields["rgb"][0])
    # Only the scale of the density has no meaning.
    vndf = fields["vndf"][0].astype(float)
    expected = vndf / vndf.max(axis=(1, 2), keepdims=True)
    np.testing.assert_allclose(brdf.vndf / brdf.vndf.max(axis=(1, 2), keepdims=True), expected, rtol=1e-12)


def test_two_azimuths_are_read_at_zero(tmp_path, fields):
    two = {
        name: np.concatenate([a, 3 * a]) if name in ("vndf", "rgb", "luminance") else a for name, a in fields.items()
    }
    brdf = load_rgl(written(tmp_path, two | {"phi_i": np.array([-1.0, 1.0], np.float32)}))
    np.testing.assert_allclose(brdf.rgb, 2 * fields["rgb"][0].astype(float), rtol=1e-6)


def test_mitsuba_evaluates_the_file_to_the_same(tmp_path, fields, rng):
    mi = pytest.importorskip("mitsuba", reason="needs the extra 'mitsuba': pip install 'bvbedit[mitsuba]'")
    mi.set_variant("scalar_rgb")
    path = written(tmp_path, fields)
    theirs = mi.load_dict({"type": "measured", "filename": str(path)})
    ours = load_rgl(path)
    surface, context = mi.SurfaceInteraction3f(), mi.BSDFContext()

    def f_cosine(wi: np.ndarray, wo: np.ndarray) -> np.ndarray:
        surface.wi = mi.Vector3f(*wi)
        return np.array(theirs.eval(context, surface, mi.Vector3f(*wo)))

    wi, wo = random_pairs(rng, 500, np.radians(84))
    expected = [0.5 * (f_cosine(i, o) / o[2] + f_cosine(o, i) / i[2]) for i, o in zip(wi, wo, strict=True)]
    # Mitsuba computes in float32.
    np.testing.assert_allclose(ours.evaluate(wi, wo), np.maximum(expected, 0), rtol=2e-3, atol=1e-5)


def changed(fields: dict[str, np.ndarray], **changes: np.ndarray | None) -> bytes:
    return bsdf_bytes({name: a for name, a in (fields | changes).items() if a is not None})


def test_what_is_no_such_file_is_refused(tmp_path, fields):
    sound = bsdf_bytes(fields)
    azimuths = np.linspace(-3, 3, 4).astype(np.float32)
    bad = {
        "spectral": changed(fields, rgb=None, spectra=fields["rgb"]),
        "anisotropic": changed(fields, phi_i=azimuths),
        "no field ndf": changed(fields, ndf=None),
        "azimuths": changed(fields, phi_i=azimuths[:2]),
        "cut off": sound[:40],
        "does not lie within": sound[:-500],
        "version is 2.0": sound[:12] + bytes([2, 0]) + sound[14:],
        "claims": sound[:14] + b"\xff\xff\xff\xff" + sound[18:],
        "type 77": sound.replace(b"phi_i\x01\x00\x0a", b"phi_i\x01\x00\x4d"),
        "dimensions": sound.replace(b"phi_i\x01\x00", b"phi_i\xff\xff"),
        "stands twice": sound.replace(b"sigma", b"phi_i"),
        "holds nan": changed(fields, rgb=np.full_like(fields["rgb"], np.nan)),
    }
    path = tmp_path / "bad.bsdf"
    for word, content in bad.items():
        path.write_bytes(content)
        with pytest.raises(BvbError, match=word) as refusal:
            bvbedit.load(path)
        assert str(refusal.value).startswith(str(path))
        assert "\n" not in str(refusal.value)


def test_sizes_that_overflow_64_bits_are_refused(tmp_path, fields):
    sound = bsdf_bytes(fields)
    at = sound.index(b"rgb\x05\x00\x0a") + 6 + 8
    huge = sound[:at] + np.array([2**32, 2**32, 1, 1, 1], "<u8").tobytes() + sound[at + 40 :]
    path = tmp_path / "huge.bsdf"
    path.write_bytes(huge)
    with pytest.raises(BvbError, match="does not lie within"):
        load_rgl(path)


def test_fields_that_lie_over_one_another_are_counted_each(tmp_path, fields):
    """A byte may stand for a number of every field, and takes 8 bytes of memory for each."""
    zeros = np.zeros(1, np.uint8)
    sound = bsdf_bytes(fields | {"sigma": np.zeros((1, 1), np.uint8), "ndf": np.zeros((1, 1), np.uint8), "end": zeros})
    content = bytearray(sound + bytes(9 << 20))
    for name in (b"sigma", b"ndf"):
        at = content.index(name + b"\x02\x00\x01") + len(name) + 3
        content[at : at + 24] = np.array([len(sound), 9, 1 << 20], "<u8").tobytes()
    path = tmp_path / "over.bsdf"
    path.write_bytes(content)
    with pytest.raises(BvbError, match=r"claims 18,8\S* numbers in all"):
        load_rgl(path)
