"""OpenEXR and PNG: exact round trips whatever the memory layout, and what is refused."""

import struct
import subprocess
import sys
from concurrent.futures import ThreadPoolExecutor

import numpy as np
import OpenEXR
import pytest
from PIL import Image

from bvbedit import BvbError
from bvbedit.io import exr
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
    [
        np.ones((4, 4)),
        np.ones((4, 4, 4)),
        np.ones((0, 4, 3)),
        np.full((4, 4, 3), np.nan),
        np.full((4, 4, 3), 1e39),
        np.ones((4, 4, 3), complex),
        [[[1, 2, 3]], [[1, 2]]],
        "a picture",
        None,
    ],
)
@pytest.mark.filterwarnings("error")
def test_what_is_no_picture_is_not_written(bad, tmp_path):
    with pytest.raises(BvbError, match=r"p\.exr"):
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


def test_the_library_s_remarks_on_damaged_files_are_not_printed(picture, tmp_path, capfd):
    path = tmp_path / "p.exr"
    write_exr(path, picture)
    half = path.read_bytes()[: path.stat().st_size // 2]
    with pytest.raises(BvbError):
        read_exr(written(path, half))
    assert capfd.readouterr() == ("", "")
    print("heard", file=sys.stderr)
    assert capfd.readouterr().err == "heard\n"


def test_threads_that_read_pictures_leave_the_standard_streams_alone(picture, tmp_path, capfd):
    write_exr(tmp_path / "p.exr", picture)
    with ThreadPoolExecutor(8) as threads:
        list(threads.map(lambda _: read_exr(tmp_path / "p.exr"), range(200)))
    print("heard")
    print("heard", file=sys.stderr)
    assert capfd.readouterr() == ("heard\n", "heard\n")


def test_pictures_are_read_where_there_is_no_standard_error(picture, tmp_path):
    write_exr(tmp_path / "p.exr", picture)
    code = "import os, sys; os.close(2); from bvbedit.io.exr import read_exr; print(read_exr(sys.argv[1]).shape)"
    done = subprocess.run([sys.executable, "-c", code, tmp_path / "p.exr"], capture_output=True, text=True, check=True)
    assert done.stdout == "(17, 31, 3)\n"


def test_memory_that_is_short_is_no_damage_and_no_full_disk(picture, tmp_path, monkeypatch):
    path = tmp_path / "p.exr"
    write_exr(path, picture)

    def short(*_: object, **__: object) -> None:
        raise MemoryError

    monkeypatch.setattr(OpenEXR, "File", short)
    for use in (lambda: read_exr(path), lambda: write_exr(tmp_path / "q.exr", picture)):
        with pytest.raises(MemoryError):
            use()
    assert list(tmp_path.iterdir()) == [path]


def test_the_values_of_all_channels_and_parts_are_counted_before_they_are_read(picture, tmp_path, monkeypatch):
    header = {"compression": OpenEXR.ZIP_COMPRESSION, "type": OpenEXR.scanlineimage}
    depth = picture[..., 0].copy()
    OpenEXR.File(header, {"RGB": picture, "Z": depth}).write(str(tmp_path / "depth.exr"))
    both = [OpenEXR.Part(header | {"name": n}, {"RGB": p}) for n, p in {"a": picture, "b": picture * 2}.items()]
    OpenEXR.File(both).write(str(tmp_path / "parts.exr"))
    for name in ("depth.exr", "parts.exr"):
        np.testing.assert_array_equal(read_exr(tmp_path / name), picture)
    monkeypatch.setattr(exr, "LARGEST_PICTURE", picture.size)
    for name, claim in {"depth.exr": "2,108", "parts.exr": "3,162"}.items():
        with pytest.raises(BvbError, match=f"claims 31 x 17 pixels, {claim} values"):
            read_exr(tmp_path / name)


def test_exr_headers_of_any_length_are_read(picture, tmp_path):
    header = {"compression": OpenEXR.ZIP_COMPRESSION, "type": OpenEXR.scanlineimage, "a": "x" * 100_000}
    OpenEXR.File(header, {"RGB": picture}).write(str(tmp_path / "p.exr"))
    np.testing.assert_array_equal(read_exr(tmp_path / "p.exr"), picture)


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
    shapes = ((4, 4), (4, 4, 4), (0, 4, 3))
    for bad in (*(np.zeros(s, np.uint8) for s in shapes), np.zeros((4, 4, 3)), [[[1, 2, 3]], [[1, 2]]], "a picture"):
        with pytest.raises(BvbError, match=r"p\.png"):
            write_png(path, bad)
    assert not path.exists()
    write_png(path, rng.integers(0, 256, (40, 50, 3), dtype=np.uint8))
    sound = path.read_bytes()
    huge = sound[:16] + struct.pack(">2I", 2**30, 2**30) + sound[24:]
    for content in (b"", sound[:30], sound[: len(sound) // 2], huge, b"GIF89a" + sound[6:]):
        with pytest.raises(BvbError, match=r"p\.png"):
            read_png(written(path, content))


def test_grey_png_of_16_bits_is_refused_and_of_8_is_read(rng, tmp_path):
    """Pillow would turn every value above 255 into white."""
    grey = rng.integers(0, 256, (9, 14), dtype=np.uint8)
    Image.fromarray(grey.astype(np.uint16) * 257).save(tmp_path / "16.png")
    Image.fromarray(grey).save(tmp_path / "8.png")
    with pytest.raises(BvbError, match=r"16\.png is grey of 16 bits"):
        read_png(tmp_path / "16.png")
    np.testing.assert_array_equal(read_png(tmp_path / "8.png"), np.repeat(grey[..., None], 3, axis=-1))
