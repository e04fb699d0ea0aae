"""Environments are looked up and drawn as they say: chi-square tests, integrals by quadrature, extremes."""

import functools
import math
from statistics import NormalDist

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from bvbedit.render.environment import EnvironmentDensity, solid_angles
from bvbedit.render.environment_kernels import draw, look_up, pdf_of
from bvbedit.render.lights import GradientEnvironment
from tests.render.environments import arriving
from tests.render.environments import drawn as drawn_by

LAST = 1 - 2**-53
LARGEST = float(np.finfo(np.float32).max)
# All chi-square tests together fail with this probability where everything is right (Sidak).
ALPHA = 0.01
PICTURES = ("one texel", "column", "row", "two rows", "random", "zeros", "hot texel", "hot poles", "hot seam", "range")


@functools.cache
def picture(name):
    rng = np.random.default_rng(PICTURES.index(name))
    match name:
        case "one texel":
            texels = np.full((1, 1, 3), 0.7)
        case "column":
            texels = rng.random((5, 1, 3))
        case "row":
            texels = rng.random((1, 5, 3))
        case "two rows":
            texels = rng.random((2, 3, 3))
        case "random":
            texels = rng.random((6, 9, 3))
        case "zeros":
            texels = rng.random((7, 8, 3)) * (rng.random((7, 8, 1)) < 0.2)
        case "hot texel":
            texels = np.full((16, 32, 3), 0.01)
            texels[4, 9] = (3000.0, 2000.0, 1000.0)
        case "hot poles":
            texels = np.full((8, 16, 3), 0.1)
            texels[0, 3] = texels[-1, 5] = 100.0
        case "hot seam":
            texels = np.zeros((8, 16, 3))
            texels[2, 0], texels[5, -1] = 5.0, 9.0
        case "range":
            texels = 10.0 ** rng.uniform(-30, 30, (6, 8, 3))
    return texels.astype(np.float32)


@functools.cache
def density(name):
    found = EnvironmentDensity.of(picture(name))
    assert found is not None
    return found


def naive_look_up(texels, direction):
    """Return the bilinear look-up from the definition of the conventions, for one direction."""
    height, width, _ = texels.shape
    x, y, z = direction
    row = np.arctan2(np.hypot(x, y), z) / np.pi * height
    column = (0.5 + np.arctan2(x, y) / (2 * np.pi)) * width
    total = np.zeros(3)
    # Texel centres at (r + 1/2, c + 1/2); the picture goes on below its last row and above its first as they are.
    for r in range(-1, height + 1):
        for c in range(-1, width + 1):
            weight = max(0.0, 1 - abs(row - (r + 0.5))) * max(0.0, 1 - abs(column - (c + 0.5)))
            total += weight * texels[min(max(r, 0), height - 1), c % width].astype(np.float64)
    return total


def evenly(rng, count):
    """Return unit directions (count, 3), even over the sphere."""
    v = rng.normal(size=(count, 3))
    return v / np.linalg.norm(v, axis=1, keepdims=True)


def grid(texels, fine):
    """Return directions (n, 3) and solid angles (n,) of cells within the patches, ``fine`` x ``fine`` in each."""
    height, width, _ = texels.shape
    theta = np.concatenate([[0.0], np.arange(height) + 0.5, [height]]) * np.pi / height
    z = np.interp((np.arange((height + 1) * fine) + 0.5) / fine, np.arange(height + 2), np.cos(theta))
    azimuth = (((np.arange(width * fine) + 0.5) / fine + 0.5) / width - 0.5) * 2 * np.pi
    z, azimuth = (x.ravel() for x in np.meshgrid(z, azimuth, indexing="ij"))
    radius = np.sqrt(1 - z * z)
    solid = np.repeat(solid_angles(height, width) / fine**2, width * fine * fine)
    return np.stack([radius * np.sin(azimuth), radius * np.cos(azimuth), z], axis=-1), solid


def extreme_directions():
    """Return the poles, the seam and the axes, and the same a little aside."""
    axes = np.vstack([np.eye(3), -np.eye(3), [(0.0, -0.6, 0.8), (-0.0, -0.6, -0.8), (1e-300, 0.0, -1.0)]])
    aside = axes + 1e-9 * np.array([1.0, -2.0, 1.5])
    others = np.array([(1e-17, -0.8, 0.6), (-1e-17, -0.8, 0.6), (-1e-300, -1.0, 0.0)])
    return np.vstack([axes, aside / np.linalg.norm(aside, axis=1, keepdims=True), others])


@pytest.mark.parametrize("name", PICTURES)
def test_look_up_is_bilinear(name, rng):
    texels = picture(name)
    for direction in np.vstack([evenly(rng, 60), extreme_directions()]):
        expected = naive_look_up(texels, direction)
        # Near a hot texel the last bit of the weights is what counts.
        np.testing.assert_allclose(look_up(texels, *direction), expected, rtol=1e-12, atol=1e-13 * texels.max())


@pytest.mark.parametrize("name", PICTURES)
def test_the_density_integrates_to_one(name):
    directions, solid = grid(picture(name), 3)
    assert solid.sum() == pytest.approx(4 * np.pi, rel=1e-12)
    _, pdf = arriving(density(name), directions)
    assert pdf @ solid == pytest.approx(1.0, rel=1e-12)


def test_solid_angles_of_small_caps():
    # 1 - cos(a) cancels here; its series does not.
    a = math.pi / 2 / 100_000
    assert solid_angles(100_000, 1)[[0, -1]] == pytest.approx(math.pi * a**2 * (1 - a**2 / 12), rel=1e-13)


@pytest.mark.parametrize("name", PICTURES)
def test_draws_follow_the_density(name, rng):
    """Counts in a grid that does not know the patches, whose probabilities are sums over a finer one."""
    texels, count, fine = picture(name), 1 << 17, 16
    directions, solid = grid(texels, fine)
    expected = count * arriving(density(name), directions)[1] * solid
    drawn, _, _ = drawn_by(density(name), rng.random((count, 2)))

    # Boxes that are unions of cells: parts of a patch, four by four, so that also what is within is put to the test.
    def box(w):
        height, width, _ = texels.shape
        theta = np.concatenate([[0.0], np.arange(height) + 0.5, [height]]) * np.pi / height
        row = 4 * np.interp(-w[:, 2], -np.cos(theta), np.arange(height + 2))
        column = 4 * (((0.5 + np.arctan2(w[:, 0], w[:, 1]) / (2 * np.pi)) * width - 0.5) % width)
        across = 4 * width
        return np.minimum(row.astype(int), 4 * height + 3) * across + np.minimum(column.astype(int), across - 1)

    boxes = 16 * (texels.shape[0] + 1) * texels.shape[1]
    wanted, counts = np.zeros(boxes), np.bincount(box(drawn), minlength=boxes)
    np.add.at(wanted, box(directions), expected)
    assert counts[wanted == 0].sum() == 0
    rare = wanted < 10
    wanted = np.append(wanted[~rare], wanted[rare].sum())
    counts = np.append(counts[~rare], counts[rare].sum())
    if wanted[-1] < 10:  # still too few for a bin: into the one before
        wanted, counts = np.append(wanted[:-2], wanted[-2:].sum()), np.append(counts[:-2], counts[-2:].sum())
    assert len(wanted) > 8
    chi2, freedom = float(np.sum((counts - wanted) ** 2 / wanted)), len(wanted) - 1
    # Wilson & Hilferty's normal approximation of chi-square.
    normal = ((chi2 / freedom) ** (1 / 3) - (1 - 2 / (9 * freedom))) / math.sqrt(2 / (9 * freedom))
    assert normal < NormalDist().inv_cdf((1 - ALPHA) ** (1 / len(PICTURES)))


@pytest.mark.parametrize("name", PICTURES)
def test_what_a_draw_tells_is_what_is_there(name, rng):
    d = density(name)
    directions, radiance, pdf = drawn_by(d, rng.random((2000, 2)))
    np.testing.assert_allclose(np.linalg.norm(directions, axis=1), 1, rtol=1e-15)
    again, pdf_again = arriving(d, directions)
    np.testing.assert_array_equal(radiance, again)
    np.testing.assert_array_equal(pdf, pdf_again)
    assert pdf.min() > 0
    for n in range(0, 2000, 100):
        assert pdf_of(d.texels, d.scale, *directions[n]) == pdf[n]
        np.testing.assert_array_equal(look_up(d.texels, *directions[n]), radiance[n])


@pytest.mark.parametrize("name", PICTURES)
def test_extreme_numbers(name):
    d = density(name)
    ends = (0.0, 2.0**-60, 0.5, LAST)
    for u in ends:
        for v in ends:
            x, y, z, pdf = draw(d.texels, d.rows, d.columns, d.scale, u, v)
            assert math.hypot(x, y, z) == pytest.approx(1, rel=1e-15)
            # At the edge of a patch the direction may belong to the next one, and that may be black.
            nearby = max(pdf_of(d.texels, d.scale, x + a, y + b, z + c) for a in NEAR for b in NEAR for c in NEAR)
            assert pdf >= 0
            assert nearby > 0


NEAR = (-1e-9, 0.0, 1e-9)


@pytest.mark.parametrize("name", PICTURES)
def test_all_that_shines_can_be_drawn(name, rng):
    directions = np.vstack([evenly(rng, 5000), extreme_directions()])
    radiance, pdf = arriving(density(name), directions)
    bright = radiance.max(axis=1) > 0
    assert (pdf[bright] > 0).all()
    # No draw counts more than four times what an exact density would make of it.
    assert (radiance.mean(axis=1)[bright] * density(name).scale <= 4 * pdf[bright] * (1 + 1e-12)).all()


@given(
    height=st.integers(1, 4),
    width=st.integers(1, 5),
    seed=st.integers(0, 1 << 30),
    share=st.sampled_from([0.1, 0.3, 1.0]),
    size=st.sampled_from([1e-45, 1e-30, 1.0, 1e30, LARGEST]),
)
def test_pictures_with_black_texels(height, width, seed, share, size):
    rng = np.random.default_rng(seed)
    texels = (rng.random((height, width, 3)) * (rng.random((height, width, 3)) < share) * size).astype(np.float32)
    found = EnvironmentDensity.of(texels)
    if not texels.any():
        assert found is None
        return
    assert found is not None
    directions, solid = grid(texels, 2)
    radiance, pdf = arriving(found, directions)
    assert pdf @ solid == pytest.approx(1, rel=1e-12)
    assert ((pdf > 0) == (radiance.max(axis=1) > 0)).all()
    _, radiance, pdf = drawn_by(found, rng.random((50, 2)))
    assert (pdf > 0).all()
    assert (radiance.max(axis=1) > 0).all()


def test_black_pictures_have_no_density():
    assert EnvironmentDensity.of(np.zeros((4, 8, 3), dtype=np.float32)) is None


def test_even_light_is_drawn_evenly(rng):
    for shape in ((1, 1), (3, 1), (1, 4), (4, 8)):
        for value in (1e-44, 1.0, LARGEST):
            d = EnvironmentDensity.of(np.full((*shape, 3), value, dtype=np.float32))
            assert d is not None
            np.testing.assert_allclose(drawn_by(d, rng.random((100, 2)))[2], 1 / (4 * np.pi), rtol=1e-13)
            assert d.unevenness == pytest.approx(1.0, rel=1e-13)


def test_all_light_of_one_texel_is_near_it(rng):
    texels = np.zeros((64, 128, 3), dtype=np.float32)
    texels[20, 100] = 1.0
    d = EnvironmentDensity.of(texels)
    assert d is not None
    directions, _, _ = drawn_by(d, rng.random((4096, 2)))
    theta = np.arccos(directions[:, 2]) / np.pi * 64
    column = (0.5 + np.arctan2(directions[:, 0], directions[:, 1]) / (2 * np.pi)) * 128
    assert np.abs(theta - 20.5).max() <= 1 + 1e-9
    assert np.abs(column - 100.5).max() <= 1 + 1e-9


def test_drawing_by_the_picture_needs_far_fewer_draws(rng):
    """The irradiance of the ground: quadrature, and a thousand draws each way."""
    name, count = "hot texel", 1024
    d = density(name)
    directions, solid = grid(picture(name), 8)
    truth = solid @ (arriving(d, directions)[0] * np.maximum(directions[:, 2:], 0))

    def terms(w, radiance, pdf):
        return radiance * np.maximum(w[:, 2:], 0) / pdf[:, None]

    drawn = terms(*drawn_by(d, rng.random((count, 2))))
    error = drawn.std(axis=0) / math.sqrt(count)
    assert (np.abs(drawn.mean(axis=0) - truth) < 3 * error).all()
    even = evenly(rng, 1 << 17)
    uniform = terms(even, arriving(d, even)[0], np.full(len(even), 1 / (4 * np.pi)))
    assert (uniform.var(axis=0) > 100 * drawn.var(axis=0)).all()


def test_whether_it_pays():
    gradient = EnvironmentDensity.of(GradientEnvironment((0.1, 0.2, 0.4), (0.4, 0.4, 0.4), (0.1, 0.1, 0.1)).texels())
    spot, glitter = np.full((64, 128, 3), 0.1, dtype=np.float32), np.full((64, 128, 3), 0.1, dtype=np.float32)
    spot[20:22, 30:32] = 1000.0
    glitter[20, 30] = 3.0
    assert gradient is not None
    assert gradient.unevenness < 1.1
    bright, faint = EnvironmentDensity.of(spot), EnvironmentDensity.of(glitter)
    assert bright is not None
    assert faint is not None
    assert bright.unevenness > 100
    assert faint.unevenness < 1.1


@pytest.mark.parametrize("name", ["random", "hot poles"])
def test_unevenness_is_the_variance_of_even_draws(name):
    directions, solid = grid(picture(name), 1)
    _, pdf = arriving(density(name), directions)
    assert density(name).unevenness == pytest.approx(4 * np.pi * (solid @ pdf**2), rel=1e-12)


def test_densities_do_not_change():
    mine = np.ones((2, 4, 3), dtype=np.float32)
    d = EnvironmentDensity.of(mine)
    assert d is not None
    for table in (d.texels, d.rows, d.columns):
        assert not table.flags.writeable
    assert mine.flags.writeable
