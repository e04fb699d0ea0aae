"""OpenEXR and PNG: exact round trips whatever the memory layout, and what is refused."""

import struct

import numpy as np
import OpenEXR
import pytest

from bvbedit import BvbError
from bvbedit.io.exr import read_exr, write_exr
from bvbedit.io.png import read_png, write_png
from tests.io.files import written


@pytest.fixture
def picture(rng) -> np.ndarray:
    return np.exp(rng.uniform(-20, 12, (17, 31, 3))).astype(np.float32)


def test_exr_round_trip_is_exact_for_any_layout(picture, tmp_path):
    layouts = (picture, np.asfortranarray(picture), picture[::-1, ::-1], picture[..., ::-1], picture.astype(float))
    for layout in layouts:
        write_exr(tmp_path / "p.exr", layout)
        again = read_exr(tmp_path / "p.exr")
        assert again.dtype == np.float32
        np.testing.assert_array_equal(again, layout)


@pytest.mark.parametrize(
    "bad",
    [np.ones((4, 4)), np.ones((4, 4, 4)), np.ones((0, 4, 3)), np.full((4, 4, 3), np.nan), np.full((4, 4, 3), 1e39)],
)
def test_what_is_no_picture_is_not_written(bad, tmp_path):
    with np.errstate(over="ignore"), pytest.raises(BvbError, match=r"p\.exr"):
        write_exr(tmp_path / "p.exr", bad)
    assert list(tmp_path.iterdir()) == []


def test_damaged_exr_files_are_refused(picture, tmp_path):
    path = tmp_path / "p.exr"
    write_exr(path, picture)
    sound = path.read_bytes()
    for length in (0, 3, 50, len(sound) // 2, len(sound) - 1):
        with pytest.raises(BvbError, match=r"p\.exr"):
            read_exr(written(path, sound[:length]))
    at = sound.index(b"dataWindow\0box2i\0") + len(b"dataWindow\0box2i\0") + 4
    huge = sound[:at] + struct.pack("<4i", 0, 0, 2**20, 2**20) + sound[at + 16 :]
    with pytest.raises(BvbError, match=r"p\.exr"):
        read_exr(written(path, huge))


def test_exr_files_of_other_channels_are_refused(picture, tmp_path):
    path = tmp_path / "p.exr"
    header = {"compression": OpenEXR.ZIP_COMPRESSION, "type": OpenEXR.scanlineimage}
    for channels in ({"Y": picture[..., 0].copy()}, {"R": picture[..., 0].copy(), "G": picture[..., 1].copy()}):
        OpenEXR.File(header, channels).write(str(path))
        with pytest.raises(BvbError, match=r"p\.exr"):
            read_exr(path)
    spoiled = picture.copy()
    spoiled[3, 4, 1] = np.inf
    OpenEXR.File(header, {"RGB": spoiled}).write(str(path))
    with pytest.raises(BvbError, match="finite"):
        read_exr(path)


def test_exr_of_half_floats_and_alpha_is_read(picture, tmp_path):
    path = tmp_path / "p.exr"
    half = np.minimum(picture, 6e4).astype(np.float16)
    rgba = np.concatenate([half, np.ones((17, 31, 1), np.float16)], axis=-1)
    OpenEXR.File({"compression": OpenEXR.ZIP_COMPRESSION, "type": OpenEXR.scanlineimage}, {"RGBA": rgba}).write(
        str(path)
    )
    np.testing.assert_array_equal(read_exr(path), half.astype(np.float32))


def test_png_round_trip_is_exact(rng, tmp_path):
    pixels = rng.integers(0, 256, (9, 14, 3), dtype=np.uint8)
    for layout in (pixels, pixels[::-1, ::-1], np.asfortranarray(pixels)):
        write_png(tmp_path / "p.png", layout)
        np.testing.assert_array_equal(read_png(tmp_path / "p.png"), layout)


def test_bad_png_files_and_pictures_are_refused(rng, tmp_path):
    path = tmp_path / "p.png"
    for bad in (np.zeros((4, 4), np.uint8), np.zeros((4, 4, 3)), np.zeros((4, 4, 4), np.uint8)):
        with pytest.raises(BvbError, match=r"p\.png"):
            write_png(path, bad)
    assert not path.exists()
    write_png(path, rng.integers(0, 256, (40, 50, 3), dtype=np.uint8))
    sound = path.read_bytes()
    huge = sound[:16] + struct.pack(">2I", 2**30, 2**30) + sound[24:]
    for content in (b"", sound[:30], sound[: len(sound) // 2], huge, b"GIF89a" + sound[6:]):
        with pytest.raises(BvbError, match=r"p\.png"):
            read_png(written(path, content))
