"""What a fit comes near to: looked up at the right pairs, weighed as the metric weighs, its noise told by its sides."""

import functools
import gc
import pickle
import weakref

import numpy as np
import pytest

from bvbedit import threads
from bvbedit.brdf.analytic import Lambert
from bvbedit.brdf.base import Brdf
from bvbedit.brdf.charts import HALF_DIFF, IN_OUT, RUSINKIEWICZ, RUSINKIEWICZ_360, Chart, grid_points
from bvbedit.brdf.encodings import Linear, Log, Root
from bvbedit.brdf.fit import fit_net
from bvbedit.brdf.geometry import elevation
from bvbedit.brdf.losses import LOSSES, SMALLEST_SHARE
from bvbedit.brdf.measured import MeasuredBrdf
from bvbedit.brdf.problem import BEYOND, HELD, LARGEST_SECANT, Table, charts_for, pose, secants, tabulate
from bvbedit.brdf.sample_sets import node_blocks
from bvbedit.spline.fitting import loft
from bvbedit.spline.knots import place_knots
from tests.brdf.samples import Glossy
from tests.spline.refusals import refusal

LOG_COSINE = LOSSES["log_cosine_rms"]
MIRROR = np.array([1.0, -1.0, 1.0])
SMALL = tuple(np.linspace(0, 1, n) for n in (16, 13, 10))

each_chart = pytest.mark.parametrize("chart", [IN_OUT, HALF_DIFF], ids=lambda c: c.name)
each_loss = pytest.mark.parametrize("loss", LOSSES.values(), ids=list(LOSSES))
each_encoding = pytest.mark.parametrize("encoding", [Linear(), Root(), Log()], ids=repr)


class Skewed(Brdf):
    """Neither symmetric nor reciprocal, different in each channel: the value tells which pair was asked for."""

    def _evaluate(self, wi, wo):
        a, b = np.array([[0.1, 0.2, 0.3], [0.3, -0.1, 0.2], [-0.2, 0.3, 0.1]]), np.array([[-0.3, 0.1, 0.2]] * 3)
        return 1 + wi @ a + wo @ b, np.ones(len(wi), bool)


class Sided(Brdf):
    """One grey where wo is turned from wi anti-clockwise, another where it is clockwise."""

    left, right = 0.2, 0.6

    def _evaluate(self, wi, wo):
        cross = wi[:, 0] * wo[:, 1] - wi[:, 1] * wo[:, 0]
        f = np.where(cross > 1e-9, self.left, np.where(cross < -1e-9, self.right, 0.5 * (self.left + self.right)))
        return f[:, None] * np.ones(3), np.ones(len(f), bool)


class Noisy(Brdf):
    """Grey, each reading with normal noise of its own."""

    def __init__(self, deviation: float, reciprocal: bool) -> None:
        self.deviation, self.reciprocal, self.rng = deviation, reciprocal, np.random.default_rng(11)

    def _evaluate(self, wi, wo):  # noqa: ARG002
        return 1 + self.deviation * self.rng.normal(size=(len(wi), 3)), np.ones(len(wi), bool)


class Blind(Brdf):
    """Grey that depends on the elevations, blind where the light stands high and the viewer low on one side."""

    def _evaluate(self, wi, wo):
        f = (0.1 + wi[:, 2] * wo[:, 2])[:, None] * np.array([1.0, 0.5, 2.0])
        return f, (wi[:, 2] < 0.7) | (wi[:, 0] * wo[:, 1] - wi[:, 1] * wo[:, 0] > 1e-9)


class Twisted(Brdf):
    """Reciprocal, but another one when light and viewer are mirrored; blind where the difference is large."""

    reciprocal = True

    def _evaluate(self, wi, wo):
        twist = (wi[:, 0] * wo[:, 1] - wi[:, 1] * wo[:, 0]) * (wi[:, 2] - wo[:, 2])
        return (0.5 + 0.4 * twist)[:, None] * np.array([1.0, 0.5, 2.0]), twist < 0.2


def _nodes(chart: Chart, axes: tuple[np.ndarray, ...] = SMALL) -> tuple[np.ndarray, np.ndarray]:
    return chart.to_directions(grid_points(axes))


def _off_horizon(wi: np.ndarray, wo: np.ndarray) -> np.ndarray:
    return np.minimum(wi[:, 2], wo[:, 2]) > 2e-4


@functools.cache
def _table(chart: Chart) -> Table:
    return tabulate(Glossy(0.3), chart, SMALL)


@each_chart
def test_a_table_holds_all_pairs_that_the_chart_cannot_tell_apart(chart):
    """The pair itself, its mirror image, and where the chart folds them the exchanged ones: equal parameters."""
    brdf, (wi, wo) = Skewed(), _nodes(chart)
    table = tabulate(brdf, chart, SMALL)
    pairs = [(wi, wo), (wi * MIRROR, wo * MIRROR), (wo, wi), (wo * MIRROR, wi * MIRROR)]
    above = _off_horizon(wi, wo)
    assert len(table.sides) == len(table.trusted) == (4 if chart.reciprocal else 2)
    for side, trusted, (i, o) in zip(table.sides, table.trusted, pairs, strict=False):
        f, backed = brdf.evaluate_trusted(i[above], o[above])
        np.testing.assert_allclose(side.reshape(-1, 3)[above], f, rtol=1e-12)
        np.testing.assert_array_equal(trusted.reshape(-1)[above], backed)
        there = chart.to_parameters(i, o)
        np.testing.assert_allclose(there[above], chart.to_parameters(wi, wo)[above], rtol=0, atol=1e-7)
    assert not np.allclose(table.sides[0], table.sides[1])
    np.testing.assert_allclose(table.shares.sum(axis=1), 1.0)


def test_a_reciprocal_material_is_looked_up_at_mirror_images_alone():
    table = tabulate(Glossy(0.3), HALF_DIFF, SMALL)
    assert len(table.sides) == 2
    np.testing.assert_allclose(table.sides[0], table.sides[1], rtol=1e-9)
    np.testing.assert_array_equal(table.shares, 0.5)


def test_a_reciprocal_material_that_tells_sides_apart_is_looked_up_on_one_side_of_the_in_out_chart():
    """The other side is the exchanged pair's; on a grid whose elevations differ both are looked up."""
    for axes in (SMALL, (SMALL[0], SMALL[0], SMALL[2])):
        table = tabulate(Twisted(), IN_OUT, axes)
        wi, wo = _nodes(IN_OUT, axes)
        assert len(table.sides) == 2
        above = _off_horizon(wi, wo)
        for side, trusted, mirror in zip(table.sides, table.trusted, (1.0, MIRROR), strict=True):
            f, backed = Twisted().evaluate_trusted(wi * mirror, wo * mirror)
            np.testing.assert_allclose(side.reshape(-1, 3)[above], f[above], rtol=1e-12)
            np.testing.assert_array_equal(trusted.reshape(-1)[above], backed[above])
        assert not np.allclose(table.sides[0], table.sides[1])


def test_charts_are_those_whose_grids_carry_the_size():
    charts = (IN_OUT, HALF_DIFF)
    assert charts_for(Glossy(), charts, (20, 20, 20)) == charts
    assert charts_for(Glossy(), charts, (20, 20, 80)) == (IN_OUT,)
    table = MeasuredBrdf(np.ones((9, 9, 9, 3)), np.ones((9, 9, 9), bool), (np.linspace(0, 1, 9),) * 3, HALF_DIFF)
    assert charts_for(table, charts, (20, 20, 20)) == (IN_OUT,)
    assert "9 x 9 x 9 in half-diff" in refusal(lambda: charts_for(table, charts, (20, 20, 400)))


@each_chart
def test_only_the_pair_itself_is_looked_up_on_request(chart):
    table = tabulate(Skewed(), chart, SMALL, mirrored=False)
    assert len(table.sides) == 1
    np.testing.assert_array_equal(table.sides[0], tabulate(Skewed(), chart, SMALL).sides[0])


@each_chart
def test_layers_may_be_looked_up_in_any_number_at_once(chart, monkeypatch):
    tables = []
    for rows in (1, 300, 5000, 1 << 20):
        monkeypatch.setattr(threads, "ROWS", rows)
        tables.append(tabulate(Blind(), chart, SMALL))  # a new one each time, whose tables are not kept
    for other in tables[1:]:
        for name in ("sides", "trusted", "cosines"):
            for a, b in zip(getattr(tables[0], name), getattr(other, name), strict=True):
                np.testing.assert_array_equal(a, b)


def test_tables_are_kept_of_the_last_material_alone_and_while_it_lives():
    looked_up = []

    class Counted(Lambert):
        def _evaluate(self, wi, wo):
            looked_up.append(len(wi))
            return super()._evaluate(wi, wo)

    def tabulated(brdf, **options):
        before = len(looked_up)
        return tabulate(brdf, IN_OUT, SMALL, **options), len(looked_up) > before

    one, other = Counted((0.1, 0.2, 0.3)), Counted((0.4, 0.5, 0.6))
    first, new = tabulated(one)
    assert new
    assert tabulated(one) == (first, False)
    # Another grid, chart or number of sides is another table.
    for again in (tabulate(one, IN_OUT), tabulate(one, HALF_DIFF, SMALL), tabulate(one, IN_OUT, SMALL, mirrored=False)):
        assert again is not first
    assert tabulated(one) == (first, False)
    assert tabulated(other)[1]
    assert tabulated(one)[1]
    # What stands at the same place in memory afterwards is another material.
    kept = weakref.ref(tabulated(one)[0])
    del first, one
    gc.collect()
    assert kept() is None
    assert tabulated(Counted((0.1, 0.2, 0.3)))[1]


def test_fits_leave_a_table_as_it_is():
    brdf = Glossy()
    table = tabulate(brdf, HALF_DIFF)
    arrays = (*table.sides, *table.trusted, table.densities, table.shares, *table.cosines)
    before = [a.copy() for a in arrays]
    fit_net(brdf, HALF_DIFF, Root(), size=(8, 6, 5))
    fit_net(brdf, HALF_DIFF, Log(), size=(8, 6, 5), knots="free", metric="fores")
    assert tabulate(brdf, HALF_DIFF) is table
    for a, b in zip(arrays, before, strict=True):
        np.testing.assert_array_equal(a, b)


@each_chart
def test_nodes_are_trusted_where_data_stand_behind_each_side(chart):
    brdf, (wi, wo) = Blind(), _nodes(chart)
    table = tabulate(brdf, chart, SMALL)
    pairs = [(wi, wo), (wi * MIRROR, wo * MIRROR), (wo, wi), (wo * MIRROR, wi * MIRROR)]
    for trusted, (i, o) in zip(table.trusted, pairs, strict=False):
        backed = brdf.evaluate_trusted(np.maximum(i, [-1, -1, 0]), np.maximum(o, [-1, -1, 0]))[1]
        np.testing.assert_array_equal(trusted.reshape(-1), backed & _off_horizon(wi, wo))
        assert 0 < np.count_nonzero(trusted) < trusted.size


@each_chart
def test_nodes_on_the_horizon_are_filled_but_not_trusted(chart):
    table = tabulate(Lambert(0.5), chart, SMALL)
    low = ~_off_horizon(*_nodes(chart)).reshape(table.trusted[0].shape)
    assert low.any()
    for side, trusted in zip(table.sides, table.trusted, strict=True):
        assert not trusted[low].any()
        np.testing.assert_allclose(side[low], 0.5 / np.pi, rtol=1e-12)


@each_chart
def test_cosines_are_those_of_the_nodes_down_to_80_degrees(chart):
    table = _table(chart)
    for cosine, w in zip(table.cosines, _nodes(chart), strict=True):
        expected = np.cos(np.minimum(elevation(w), np.radians(80)))
        np.testing.assert_allclose(cosine.reshape(-1), expected, rtol=0, atol=1e-12)


@each_chart
def test_a_measurement_on_the_fits_own_chart_is_taken_at_its_own_nodes(chart, rng):
    values, valid = rng.uniform(0, 2, (16, 13, 10, 3)), rng.uniform(size=(16, 13, 10)) < 0.8
    values[0, 0, 0] = -1.0
    measured = MeasuredBrdf(values, valid | (values[..., 0] < 0), SMALL, chart)
    table = tabulate(measured, chart)
    assert table.axes is measured.axes
    (side,), (trusted,) = table.sides, table.trusted
    np.testing.assert_array_equal(side, measured.filled)
    reliable = np.minimum(*(w[:, 2] for w in _nodes(chart))) >= np.cos(np.radians(85))
    np.testing.assert_array_equal(trusted, measured.valid & reliable.reshape(valid.shape))
    assert table.clamped == measured.clamped > 0
    # In another process, too.
    sent = pickle.loads(pickle.dumps(measured))
    assert tabulate(sent, chart).axes is sent.axes


@each_chart
def test_by_default_the_grid_is_the_one_the_chart_is_fitted_on(chart):
    table = tabulate(Lambert(0.5), chart)
    assert all(a is b for a, b in zip(table.axes, chart.fitting_grid, strict=True))
    assert table.densities.shape == (2, *(len(u) for u in chart.fitting_grid))


def _sides_of(brdf: Brdf) -> tuple[float, float]:
    """Return the share of pairs that are turned anti-clockwise: all of the grid, and of the nodes by count."""
    wi, wo = (np.concatenate(w) for w in zip(*node_blocks(brdf, 3), strict=True))
    cross = wi[:, 0] * wo[:, 1] - wi[:, 1] * wo[:, 0]
    return 1.0, np.count_nonzero(cross > 1e-6) / np.count_nonzero(np.abs(cross) > 1e-6)


def _all_around() -> MeasuredBrdf:
    """A table of the sided material with phi_d all around the half vector."""
    axes = tuple(np.arange(n) / n for n in (24, 24, 48))
    wi, wo = RUSINKIEWICZ_360.to_directions(grid_points(axes))
    f = Sided().evaluate(wi, wo).reshape(24, 24, 48, 3)
    return MeasuredBrdf(f, np.ones((24, 24, 48), bool), axes, RUSINKIEWICZ_360)


@pytest.mark.parametrize("brdf", [Sided(), _all_around()], ids=["analytic", "table all around"])
def test_the_sides_of_the_in_out_chart_count_as_much_as_each_set_lies_on_them(brdf):
    """Mirror images are one point of the chart, but the metric sees them on the sides on which its pairs are."""
    table = tabulate(brdf, IN_OUT, SMALL)
    inside = np.zeros(table.trusted[0].shape, bool)
    inside[2:-3, 2:-3, 2:-2] = True
    for which, share in enumerate(_sides_of(brdf)):
        balance = (1.0, 0.0) if which == 0 else (0.0, 1.0)
        values = pose(table, Linear(), LOG_COSINE, balance).values[inside]
        expected = share * Sided.left + (1 - share) * Sided.right
        # What keeps the model at the data beyond 80 degrees counts both sides alike, a few percent.
        np.testing.assert_allclose(values, expected, rtol=0, atol=0.06 if which else 0.03)


def test_a_set_without_a_pair_lies_on_no_side():
    """Nodes where theta_h is 81 degrees are all beyond 80 degrees: the paper's grid alone counts."""
    shape = (20, 20, 40)
    valid = np.zeros(shape, bool)
    valid[19:] = True
    axes = tuple(np.arange(n) / n for n in shape)
    table = MeasuredBrdf(np.full((*shape, 3), 0.3), valid, axes, RUSINKIEWICZ)
    assert next(node_blocks(table, 1), None) is None
    posed = pose(tabulate(table, IN_OUT, SMALL), Root(), LOG_COSINE, (1.0, 1.0))
    assert np.isfinite(posed.values).all()
    assert np.isfinite(posed.weights).all()


@each_encoding
@each_chart
def test_values_are_the_means_of_the_sides_by_their_weights(chart, encoding):
    """Node by node: a side counts where it is trusted, by the share of the sets on it."""
    table, balance = tabulate(Blind(), chart, SMALL), (0.3, 1.0)
    values = pose(table, encoding, LOG_COSINE, balance).values
    seen = 0
    for node in np.ndindex(*table.trusted[0].shape):
        counts = []
        for k, trusted in enumerate(table.trusted):
            density = sum(
                lam * s[k] * d[node] for lam, s, d in zip(balance, table.shares, table.densities, strict=True)
            )
            counts.append((density + BEYOND * sum(balance) / len(table.sides)) * trusted[node])
        if sum(counts) == 0:
            continue
        seen += 1
        mean = sum(c * encoding.encode(side[node]) for c, side in zip(counts, table.sides, strict=True)) / sum(counts)
        np.testing.assert_allclose(values[node], mean, rtol=1e-12)
    assert seen > 500


@each_encoding
@each_chart
def test_weights_are_the_density_times_the_square_of_the_slope_of_the_metric(chart, encoding):
    """To first order |T(f(y)) - T(f(y0))|^2 = W (y - y0)^2, summed over the sets by their balance."""
    table, balance = _table(chart), (0.3, 1.0)
    posed = pose(table, encoding, LOG_COSINE, balance)
    y, h = posed.values, 1e-5 * posed.values
    ahead, behind = (LOG_COSINE.transform(encoding.decode(x), *table.cosines) for x in (y + h, y - h))
    slope = (ahead - behind) / (2 * h)
    density = sum(lam * d for lam, d in zip(balance, table.densities, strict=True)) + BEYOND * sum(balance)
    known = np.all(table.trusted, axis=0)
    expected = (density * np.mean(slope**2, axis=-1))[known]
    assert known.mean() > 0.7
    np.testing.assert_allclose(posed.weights[known], expected, rtol=1e-6)


@each_loss
def test_weights_of_other_powers_are_those_of_reweighted_squares(loss):
    """W ~ D T'(y)^2 |e|^(p - 2), the error expected being a share of T."""

    class Grey(Brdf):
        reciprocal = True

        def _evaluate(self, wi, wo):
            return (0.5 + wi[:, 2] * wo[:, 2])[:, None] * np.ones(3), np.ones(len(wi), bool)

    table = tabulate(Grey(), IN_OUT, SMALL)
    posed = pose(table, Root(), loss, (1.0, 1.0))
    f = Root().decode(posed.values)
    t = loss.transform(f, *table.cosines)[..., 0]
    slope = (loss.slope(f, *table.cosines) * Root().slope(posed.values))[..., 0]
    density = table.densities.sum(axis=0) + 2 * BEYOND
    known = np.any(table.trusted, axis=0) & (t > SMALLEST_SHARE * 1.01 * t.mean())
    assert known.mean() > 0.5
    quotient = posed.weights / (density * slope**2 * t ** (loss.power - 2))
    np.testing.assert_allclose(quotient[known] / quotient[known][0], 1.0, rtol=1e-9)


@each_loss
@pytest.mark.parametrize("factor", [1e-6, 3.0, 1e6])
def test_a_balance_of_another_scale_is_the_same_balance(loss, factor):
    table = _table(HALF_DIFF)
    one, other = (pose(table, Root(), loss, b) for b in ((0.2, 1.0), (0.2 * factor, factor)))
    np.testing.assert_allclose(other.weights, factor * one.weights, rtol=1e-12)
    np.testing.assert_allclose(other.values, one.values, rtol=1e-12)


@each_chart
def test_the_weights_of_another_metric_may_stand_in(chart):
    own, lent, log_cosine = (
        pose(_table(chart), Root(), LOSSES[loss], (1.0, 0.5), surrogate=LOSSES[surrogate])
        for loss, surrogate in (("fores", "fores"), ("fores", "log_cosine_rms"), ("log_cosine_rms", "log_cosine_rms"))
    )
    np.testing.assert_array_equal(lent.weights, log_cosine.weights)
    assert not np.allclose(lent.weights, own.weights)
    assert lent.loss.name == "fores"


@each_chart
def test_weights_grow_where_a_first_fit_is_so_far_off_that_the_tangent_does_not_tell(chart):
    """Weight times squared deviation is then the square of what the metric sees, to first order or beyond it."""
    problem = pose(_table(chart), Root(), LOSSES["log_cosine_rms"], (1.0, 1.0))
    knots = [place_knots("averaged", u, 5, 3) for u in problem.table.axes]
    spline = loft(problem.values, problem.table.axes, knots, (3, 3, 3)).spline
    grown = secants(problem, spline)
    assert grown.min() == 1.0
    fitted = spline.evaluate_grid(problem.table.axes)
    t = [problem.loss.transform(Root().decode(y), *problem.table.cosines) for y in (fitted, problem.values)]
    f = Root().decode(problem.values)
    slope = problem.loss.slope(f, *problem.table.cosines) * Root().slope(problem.values)
    seen = np.sum((t[0] - t[1]) ** 2, axis=-1)
    told = np.sum((slope * (fitted - problem.values)) ** 2, axis=-1) * grown
    np.testing.assert_array_less(seen, told * (1 + 1e-9) + 1e-30)
    far = (grown > 1) & (grown < LARGEST_SECANT)
    assert far.any()
    np.testing.assert_allclose(told[far], seen[far], rtol=1e-9)


@each_chart
def test_beyond_80_degrees_a_small_weight_remains(chart):
    """Of a constant value all slopes are one here: the weights are the densities, and what is left without them."""
    axes = tuple(np.linspace(0, 1, n) for n in (31, 29, 19))
    posed = pose(tabulate(Lambert(0.5), chart, axes), Linear(), LOSSES["relative_l1"], (0.4, 1.0))
    known = posed.table.trusted[0]
    beyond = (posed.table.densities == 0).all(axis=0)
    assert np.count_nonzero(beyond & known) > 50
    np.testing.assert_allclose(posed.weights[beyond & known], BEYOND * 1.4, rtol=1e-12)
    expected = np.tensordot([0.4, 1.0], posed.table.densities, 1) + BEYOND * 1.4
    np.testing.assert_allclose(posed.weights[known], expected[known], rtol=1e-12)
    assert HELD <= BEYOND <= 0.2


@each_chart
def test_nodes_without_data_hold_their_neighbours_with_a_small_weight(chart, rng):
    valid = np.ones((16, 13, 10), bool)
    valid[5:8, 4:9, 3:6] = False
    values = rng.uniform(0.5, 1.5, (16, 13, 10, 3))
    values[~valid] = 1e4
    posed = pose(tabulate(MeasuredBrdf(values, valid, SMALL, chart), chart), Linear(), LOG_COSINE, (1.0, 1.0))
    below = [slice(5, 8), slice(4, 9), slice(3, 6)]
    first = chart.hold_order[0]
    below[first] = slice(below[first].start - 1, below[first].start)
    held = posed.values[5:8, 4:9, 3:6]
    np.testing.assert_array_equal(held, np.broadcast_to(posed.values[tuple(below)], held.shape))
    flat = MeasuredBrdf(np.where(valid[..., None], np.ones(3), 1e4), valid, SMALL, chart)
    weights = pose(tabulate(flat, chart), Linear(), LOSSES["relative_l1"], (0.4, 1.0)).weights
    np.testing.assert_allclose(weights[~valid], HELD * 1.4, rtol=1e-12)


@pytest.mark.parametrize(("reciprocal", "sides"), [(True, 2), (False, 4)])
@pytest.mark.parametrize("encoding", [Linear(), Root()], ids=repr)
def test_the_variance_is_that_of_the_mean_of_independent_readings(encoding, reciprocal, sides):
    """Each reading has the deviation s; the mean over k sides, s / sqrt(k); three channels add up."""
    s = 0.02
    table = tabulate(Noisy(s, reciprocal), HALF_DIFF, tuple(np.linspace(0, 1, n) for n in (31, 31, 19)))
    posed = pose(table, encoding, LOG_COSINE, (1.0, 1.0))
    trusted = np.all(table.trusted, axis=0)
    slope = 1 / encoding.slope(encoding.encode(np.ones(1)))[0]
    assert len(table.sides) == sides
    expected = 3 * (s * slope) ** 2 / sides
    # Some 13,000 nodes tell a variance to 1 or 2 %.
    assert posed.variance[trusted].mean() == pytest.approx(expected, rel=0.04)
    found = np.sum((posed.values[trusted] - encoding.encode(np.ones(3))) ** 2, axis=-1).mean()
    assert posed.variance[trusted].mean() == pytest.approx(found, rel=0.06)


@each_encoding
def test_symmetric_data_have_no_variance(encoding):
    posed = pose(_table(HALF_DIFF), encoding, LOG_COSINE, (1.0, 1.0))
    assert (posed.variance == 0).all()


def test_a_single_trusted_side_tells_no_variance():
    """Mirror images of trusted pairs are not trusted: each node knows one reading, whatever it is."""

    class OneSided(Noisy):
        def _evaluate(self, wi, wo):
            cross = wi[:, 0] * wo[:, 1] - wi[:, 1] * wo[:, 0]
            return super()._evaluate(wi, wo)[0], cross > 1e-9

    table = tabulate(OneSided(0.1, reciprocal=True), HALF_DIFF, SMALL)
    posed = pose(table, Linear(), LOG_COSINE, (1.0, 1.0))
    both = np.count_nonzero(np.stack(table.trusted), axis=0)
    assert both.max() == 1
    assert (posed.variance == 0).all()


def test_sides_that_the_metric_sees_differently_tell_no_variance():
    """On in-out one side may be all that a set sees: how far the other is from it is no noise."""
    assert pose(_table(IN_OUT), Root(), LOG_COSINE, (1.0, 1.0)).variance is None


@each_chart
def test_nothing_to_be_trusted_is_refused(chart):
    class Blank(Brdf):
        def _evaluate(self, wi, wo):  # noqa: ARG002
            return np.ones((len(wi), 3)), np.zeros(len(wi), bool)

    assert "No node" in refusal(lambda: tabulate(Blank(), chart, SMALL))


@each_encoding
@each_loss
@pytest.mark.parametrize("value", [0.0, 1e-300, 1e-5, 1e4, 1e300])
def test_flat_tables_of_any_brightness_pose_a_finite_problem(value, loss, encoding):
    shape = (6, 6, 6)
    axes = (np.linspace(0, 1, 6),) * 3
    table = tabulate(MeasuredBrdf(np.full((*shape, 3), value), np.ones(shape, bool), axes, HALF_DIFF), HALF_DIFF)
    with np.errstate(all="raise", under="ignore"):
        posed = pose(table, encoding, loss, (1.0, 1.0))
    assert np.isfinite(posed.values).all()
    assert np.isfinite(posed.weights).all()
    assert posed.weights.min() >= 0
    assert posed.weights.any()
    np.testing.assert_allclose(encoding.decode(posed.values), min(value, 1e5), rtol=1e-6, atol=1e-12)
