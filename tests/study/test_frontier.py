"""Frontiers, knees, costs of halving, and the means over materials that they are made of."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from bvbedit.study.frontier import apart, cost_at, cost_of_halving, frontier, knee, mean_cost_of_halving
from bvbedit.study.quantities import BYTES, ERROR
from bvbedit.study.trades import Point, Trade, cloud, cloud_of_class, cloud_of_material, fair_means, halving_numbers
from tests.study.tables import made_table

TRADE = Trade("t", "error over bytes", BYTES, ERROR)
COSTS = 2.0 ** np.arange(8)
FEW = st.one_of(st.sampled_from([1.0, 2.0, 3.0, 4.0, np.nan]), st.floats(0.5, 5))


@given(st.lists(st.tuples(FEW, FEW), max_size=12))
def test_the_frontier_is_what_no_other_point_beats(points):
    costs, errors = np.array(points).reshape(-1, 2).T
    kept = frontier(costs, errors)

    def beaten(i):
        return any(
            (c <= costs[i] and e <= errors[i] and (c, e) != (costs[i], errors[i]))
            or (j < i and (c, e) == (costs[i], errors[i]))
            for j, (c, e) in enumerate(points)
        )

    known = [i for i, p in enumerate(points) if not np.isnan(p).any()]
    assert sorted(kept) == [i for i in known if not beaten(i)]
    assert (np.diff(costs[kept]) > 0).all()
    assert (np.diff(errors[kept]) < 0).all()


def test_the_knee_is_the_corner():
    errors = np.array([100, 50, 25, 1, 0.97, 0.94, 0.92, 0.9])
    assert knee(COSTS, errors) == 3
    # Units do not matter, nor do powers.
    assert knee(1000 * COSTS**2, errors / 7) == 3


def test_a_power_law_has_no_knee_nor_have_two_points_nor_has_a_bulge():
    assert knee(COSTS, COSTS**-0.7) is None
    assert knee(COSTS[:2], np.array([2.0, 1.0])) is None
    assert knee(COSTS, np.array([100, 99, 98, 97, 96, 95, 94, 1.0])) is None
    assert knee(np.array([]), np.array([])) is None


def test_a_fall_of_the_error_at_the_same_cost_is_no_knee():
    costs, errors = np.append(0.999, COSTS), np.append(50.0, COSTS**-0.7)
    assert knee(costs, errors) == 1
    kept = apart(costs)
    assert kept == list(range(1, 9))
    assert knee(costs[kept], errors[kept]) is None
    assert apart(np.array([3.0])) == [0]
    assert apart(np.array([])) == []


@pytest.mark.parametrize("power", [0.25, 1.0, 3.0])
def test_on_a_power_law_half_of_the_error_costs_the_same_factor_everywhere(power):
    errors = 3 * COSTS ** (-1 / power)
    for error in np.linspace(2 * errors[-1] * (1 + 1e-9), errors[0], 5):
        assert cost_of_halving(COSTS, errors, error) == pytest.approx(2**power)
    assert mean_cost_of_halving(COSTS, errors) == pytest.approx(2**power)


def test_costs_are_interpolated_between_points_and_never_beyond():
    costs, errors = np.array([10.0, 1000.0]), np.array([0.1, 0.001])
    assert cost_at(costs, errors, 0.01) == pytest.approx(100)
    assert cost_at(costs, errors, 0.1) == pytest.approx(10)
    assert cost_at(costs, errors, 0.2) is cost_at(costs, errors, 0.0009) is None
    assert cost_of_halving(costs, errors, 0.0015) is None
    assert cost_at(np.array([]), np.array([]), 1.0) is None
    assert mean_cost_of_halving(costs, np.array([0.1, 0.06])) is None
    assert mean_cost_of_halving(costs[:1], errors[:1]) is None


def test_means_are_geometric_and_a_missing_cell_does_not_move_them(rng):
    rows, columns = rng.lognormal(size=5), rng.lognormal(size=7)
    values = rows[:, None] * columns
    whole = np.exp(np.log(values).mean(axis=1))
    np.testing.assert_allclose(fair_means(values), whole)
    values[0, 3] = values[2, :3] = np.nan
    np.testing.assert_allclose(fair_means(values), whole)
    assert fair_means([]).shape == (0,)


def test_classes_leave_out_what_is_known_for_half_of_the_materials():
    table = made_table(4, failing=0)
    rows = [r for r in table.rows if r.configuration != "paper 20" or r.material in table.materials[:2]]
    found = cloud_of_class(type(table)(tuple(rows)), "all", table.materials, TRADE)
    assert found.dropped == ("paper 20",)
    assert "paper 20" not in {p.configuration for p in found.points}
    assert len(found.points) == len(table.configurations) - 1


def test_analytic_models_are_points_but_stand_on_no_frontier():
    found = cloud_of_material(made_table(failing=0), "satin", TRADE)
    models = [p for p in found.points if p.analytic]
    assert len(models) == 5
    assert not any(p.analytic for p in found.edge)
    assert min(p.cost for p in models) < min(p.cost for p in found.edge)
    assert set(found.clear) <= set(found.edge)
    assert found.knee is None or found.knee in found.clear


def test_the_table_of_halving():
    points = [Point(f"{c:g}", "s", False, c, 1 / c) for c in COSTS]
    numbers = halving_numbers([(TRADE, cloud("glossy", points)), (TRADE, cloud("none", []))])
    (line,) = numbers.rows
    assert len(line) == len(numbers.header)
    assert line[:7] == ("glossy", "error over bytes", "bytes", 1.0, 128.0, 1.0, 1 / 128)
    assert line[7:9] == (pytest.approx(2), pytest.approx(2))
    assert line[9] is None
    assert line[10] == pytest.approx(2)
