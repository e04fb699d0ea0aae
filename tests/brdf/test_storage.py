"""How control points are stored: exact there and back, as near as half a step, small, and nothing believed."""

import sys
import zlib
from itertools import product

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra import numpy as arrays

from bvbedit import BvbError
from bvbedit.brdf.storage import (
    LARGEST_CODE,
    LARGEST_STEP,
    MOST_PLANES,
    PRECISIONS,
    Storage,
    storage_named,
    unpacked,
)

pytestmark = pytest.mark.filterwarnings("error")

FLOATS = ("float16", "float32", "float64")
# 1 to 4 axes and 1 to 5 channels, the last.
SHAPES = arrays.array_shapes(min_dims=2, max_dims=5, min_side=1, max_side=5)
STEPS = st.floats(sys.float_info.min, LARGEST_STEP)
WHOLE = st.one_of(
    st.integers(-3, 3),
    st.integers(-40_000, 40_000),
    st.integers(-LARGEST_CODE, LARGEST_CODE),
    st.sampled_from([-LARGEST_CODE, LARGEST_CODE]),
)
CODES = SHAPES.flatmap(lambda shape: arrays.arrays(np.int64, shape, elements=WHOLE))
NETS = SHAPES.flatmap(lambda shape: arrays.arrays(np.float64, shape, elements=st.floats(-1e4, 1e4)))


def decoded(planes: np.ndarray, axes: tuple[int, ...]) -> np.ndarray:
    """Return the codes (n_1, ..., n_d, channels) by the words of the format alone, in Python's whole numbers."""
    folded = sum(plane.astype(object) * 256**k for k, plane in enumerate(planes))
    codes = np.vectorize(lambda z: z // 2 if z % 2 == 0 else -(z + 1) // 2, otypes=[object])(folded)
    for axis in axes:
        lines = np.moveaxis(codes, axis + 1, 0)
        for i in range(1, len(lines)):
            lines[i] = lines[i] + lines[i - 1]
    if len(codes) == 3:
        codes = np.stack([codes[0] + codes[1], codes[1], codes[2] + codes[1]])
    return np.moveaxis(codes, 0, -1)


@given(CODES, STEPS)
def test_whole_multiples_of_any_step_come_back_bit_for_bit(codes, step):
    storage = Storage("quantised", step)
    control = codes * step
    planes, axes = storage.packed(control)
    assert planes.dtype == np.uint8
    assert planes.shape[1:] == (codes.shape[-1], *codes.shape[:-1])
    assert len(planes) <= MOST_PLANES
    assert planes[-1].any() or len(planes) == 1
    np.testing.assert_array_equal(decoded(planes, axes), codes)
    back = unpacked(planes, storage, axes)
    assert back.dtype == np.float64
    np.testing.assert_array_equal(back, control)
    np.testing.assert_array_equal(storage.rounded(control), control)


@given(NETS, st.floats(1e-4, 1e6))
def test_any_net_comes_back_as_rounded_to_the_nearest_multiple(control, step):
    storage = Storage("quantised", step)
    rounded = storage.rounded(control)
    planes, axes = storage.packed(control)
    assert unpacked(planes, storage, axes).tobytes() == rounded.tobytes()
    assert not np.signbit(rounded[rounded == 0]).any()
    ulps = 4 * np.finfo(float).eps * np.abs(control)
    assert (np.abs(rounded - control) <= step / 2 + ulps).all()
    np.testing.assert_array_equal(storage.rounded(rounded), rounded)


@given(NETS)
@pytest.mark.parametrize("precision", FLOATS)
def test_a_float_net_is_itself_in_that_type(precision, control):
    storage = Storage(precision)
    array, axes = storage.packed(control)
    assert (array.dtype, array.shape, axes) == (precision, control.shape, ())
    np.testing.assert_array_equal(array, control.astype(precision))
    np.testing.assert_array_equal(unpacked(array, storage, axes), storage.rounded(control))
    assert storage.rounded(control).dtype == np.float64


def test_extremes_that_alternate_on_four_axes_fit_the_planes():
    """The largest differences there are: each axis doubles those of the colours."""
    signs = np.indices((4, 4, 4, 4)).sum(axis=0)[..., None] + np.array([0, 1, 0])
    codes = LARGEST_CODE * (1 - 2 * (signs % 2))
    storage = Storage("quantised", 0.25)
    planes, axes = storage.packed(codes * 0.25)
    np.testing.assert_array_equal(unpacked(planes, storage, axes), codes * 0.25)
    for subset in product((False, True), repeat=4):
        wanted = tuple(a for a in range(4) if subset[a])
        np.testing.assert_array_equal(unpacked(_planes(codes, wanted), storage, wanted), codes * 0.25)


def _planes(codes: np.ndarray, axes: tuple[int, ...]) -> np.ndarray:
    """Return the planes of a net (n_1, ..., n_d, 3) differenced along the given axes, whether that is best or not."""
    c = np.moveaxis(codes, -1, 0)
    c = np.stack([c[0] - c[1], c[1], c[2] - c[1]])
    for axis in axes:
        c = np.diff(c, axis=axis + 1, prepend=0)
    folded = np.where(c < 0, -2 * c - 1, 2 * c)
    return np.stack([(folded // 256**k % 256).astype(np.uint8) for k in range(MOST_PLANES)])


@pytest.mark.parametrize("value", [0.0, 1.0, -3.7, 1e6])
def test_a_constant_net_takes_next_to_nothing(value):
    control = np.full((30, 20, 10, 3), value)
    storage = storage_named("quantised", control)
    assert storage.payload_bytes(control, (29, 19, 9)) < 150
    np.testing.assert_array_equal(storage.rounded(control), control)


@pytest.mark.parametrize("shape", [(1, 1), (1, 3), (1, 1, 1, 3), (1, 1, 1, 1, 5)])
def test_a_single_point(shape, rng):
    control = rng.normal(size=shape)
    storage = Storage("quantised", 1e-9)
    planes, axes = storage.packed(control)
    np.testing.assert_array_equal(unpacked(planes, storage, axes), storage.rounded(control))
    np.testing.assert_allclose(storage.rounded(control), control, rtol=0, atol=0.51e-9)


@pytest.mark.parametrize("axis", range(3))
def test_differences_are_taken_where_they_pay(axis, rng):
    """Layers that repeat along an axis cost one layer; noise is not differenced at all, which would spread it."""
    noise = rng.integers(-3000, 3000, (12, 12, 12, 3)).astype(float)
    storage = Storage("quantised", 1.0)
    assert storage.packed(noise)[1] == ()
    layers = noise.copy()
    layers[:] = noise.take([0], axis=axis)
    planes, axes = storage.packed(layers)
    assert axis in axes
    assert len(zlib.compress(planes.tobytes(), 9)) < len(zlib.compress(storage.packed(noise)[0].tobytes(), 9)) / 6


def test_a_grey_net_takes_one_channel(rng):
    grey = np.repeat(rng.integers(-100, 100, (16, 16, 16, 1)).astype(float), 3, axis=-1)
    storage = Storage("quantised", 1.0)
    one = storage.payload_bytes(grey[..., :1], (15, 15, 15))
    assert storage.payload_bytes(grey, (15, 15, 15)) < 1.05 * one


def test_the_payload_is_what_deflation_leaves_and_the_interior_knots(rng):
    control = np.cumsum(rng.normal(size=(10, 6, 4, 3)), axis=0)
    storage = Storage("quantised", 0.01)
    deflated = len(zlib.compress(storage.packed(control)[0].tobytes(), 9))
    assert storage.payload_bytes(control, (3, 3, 3)) == deflated + (6 + 2 + 0) * 8
    for precision, item in zip(FLOATS, (2, 4, 8), strict=True):
        assert Storage(precision).payload_bytes(control, (3, 1, 0)) == 10 * 6 * 4 * 3 * item + (6 + 4 + 3) * 8


def test_a_smooth_net_takes_less_than_half_of_float16_at_its_error():
    u, v, w = np.meshgrid(np.linspace(0, 1, 40), np.linspace(0, 1, 20), np.linspace(0, 1, 10), indexing="ij")
    lobe = np.exp(-8 * u) * (1 + 0.3 * v * v) + 0.1 * np.cos(np.pi * w) * v
    control = lobe[..., None] * np.array([1.0, 0.9, 0.7])
    storage = storage_named("quantised", control)
    error = np.abs(storage.rounded(control) - control).max()
    assert error < np.abs(Storage("float16").rounded(control) - control).max()
    assert storage.payload_bytes(control, (39, 19, 9)) < control.size * 2 / 2


@given(NETS)
def test_by_name_the_step_is_a_4096th_of_the_largest(control):
    for precision in FLOATS:
        assert storage_named(precision, control) == Storage(precision)
    largest = np.abs(control).max()
    storage = storage_named("quantised", control)
    if largest > 1e-300:
        assert storage == Storage("quantised", largest / 4096)
    error = np.abs(storage.rounded(control) - control).max()
    assert error <= max(largest / 8192, sys.float_info.min)


@pytest.mark.parametrize("largest", [0.0, 5e-324, 1e-305, 1e300, sys.float_info.max])
def test_by_name_any_net_has_a_step(largest):
    control = np.array([[-largest], [largest / 3], [largest]])
    storage = storage_named("quantised", control)
    planes, axes = storage.packed(control)
    np.testing.assert_array_equal(unpacked(planes, storage, axes), storage.rounded(control))


@pytest.mark.parametrize(
    ("precision", "step", "word"),
    [
        ("float8", None, "Unknown precision 'float8'. Choose one of float16, float32, float64, quantised."),
        (16, None, "Unknown precision 16"),
        (["float16"], None, "Unknown precision"),
        ("float16", 0.1, "float16 has no step, and 0.1 was given"),
        ("quantised", None, "A step of None"),
        ("quantised", 0, "A step of 0 "),
        ("quantised", np.float16(0), "A step of np.float16"),
        ("quantised", -1.0, "A step of -1.0"),
        ("quantised", float("nan"), "A step of nan"),
        ("quantised", float("inf"), "A step of inf"),
        ("quantised", 1e300, "A step of 1e\\+300"),
        ("quantised", 10**999, "A step of 1000"),
        ("quantised", True, "A step of True"),
        ("quantised", "0.1", "A step of '0.1'"),
    ],
)
def test_what_is_no_storage_is_refused(precision, step, word):
    with pytest.raises(BvbError, match=word) as refusal:
        Storage(precision, step)
    assert "\n" not in str(refusal.value)


def test_a_step_is_a_float_whatever_number_was_given():
    for step in (2, np.float16(2), np.float32(2), np.int64(2)):
        assert type(Storage("quantised", step).step) is float
        assert Storage("quantised", step) == Storage("quantised", 2.0)
    assert Storage() == Storage("float32")
    assert set(PRECISIONS) == {*FLOATS, "quantised"}


def test_what_does_not_fit_is_refused():
    control = np.array([[1.0], [-1e6]])
    with pytest.raises(BvbError, match=r"A control point of 1e\+06 does not fit into float16. Save in a higher"):
        Storage("float16").packed(control)
    with pytest.raises(BvbError, match="does not fit into float16"):
        Storage("float16").rounded(control)
    for step in (1e-4, 1e-300, sys.float_info.min):
        for way in (Storage.packed, Storage.rounded):
            with pytest.raises(BvbError, match=r"A control point of 1e\+06 is more than 2,147,483,647 steps"):
                way(Storage("quantised", step), control)
    largest = np.array([[LARGEST_CODE + 0.49], [-LARGEST_CODE - 0.49]])
    np.testing.assert_array_equal(Storage("quantised", 1).rounded(largest), [[LARGEST_CODE], [-LARGEST_CODE]])
    with pytest.raises(BvbError, match="steps of 1"):
        Storage("quantised", 1).rounded(largest * (1 + 1e-9))


@pytest.mark.parametrize(
    ("planes", "axes", "word"),
    [
        (np.zeros((1, 3, 4), np.int8), (), "no planes"),
        (np.zeros((1, 3, 4), np.float32), (), "no planes"),
        (np.zeros((1, 3), np.uint8), (), "no planes"),
        (np.zeros((0, 3, 4), np.uint8), (), "no planes"),
        (np.zeros((1, 0, 4), np.uint8), (), "no planes"),
        (np.zeros((6, 3, 4), np.uint8), (), "no planes"),
        (np.zeros((1, 3, 4), np.uint8), (1,), "along axes"),
        (np.zeros((1, 3, 4), np.uint8), (-1,), "along axes"),
        (np.zeros((1, 3, 4, 4), np.uint8), (1, 0), "along axes"),
        (np.zeros((1, 3, 4, 4), np.uint8), (0, 0), "along axes"),
        (np.zeros((1, 3, 4, 4), np.uint8), (10**99,), "along axes"),
        (np.full((4, 1, 1), 255, np.uint8), (), "beyond 2,147,483,647 steps"),
        (np.full((5, 3, 4), 255, np.uint8), (0,), "beyond 2,147,483,647 steps"),
        # Each colour fits, and their sums do not.
        (np.repeat([0xFE, 0xFF, 0xFF, 0xFF], 3).astype(np.uint8).reshape(4, 3, 1), (), "beyond 2,147,483,647 steps"),
        # Four times as many of them would leave 64 bits.
        (np.full((5, 1, 2**23), 255, np.uint8), (0,), "sum up beyond any net"),
    ],
)
def test_planes_that_no_net_was_packed_into_are_refused(planes, axes, word):
    with pytest.raises(BvbError, match=word) as refusal:
        unpacked(planes, Storage("quantised", 0.5), axes)
    assert "\n" not in str(refusal.value)


@given(
    arrays.arrays(np.uint8, st.tuples(st.integers(1, 5), *[st.integers(1, 4)] * 3)),
    st.sampled_from([(), (0,), (1,), (0, 1)]),
)
def test_random_planes_are_decoded_as_the_format_says_or_refused(planes, axes):
    codes = decoded(planes, axes)
    try:
        control = unpacked(planes, Storage("quantised", 1.0), axes)
    except BvbError:
        assert np.abs(codes).max() > LARGEST_CODE
    else:
        np.testing.assert_array_equal(control, codes.astype(float))
