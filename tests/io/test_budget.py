"""Bytes: counted as they are saved, and never more than allowed."""

import functools

import numpy as np
import pytest

import bvbedit
from bvbedit.brdf.charts import HALF_DIFF
from bvbedit.brdf.encodings import Root
from bvbedit.brdf.losses import LOSSES
from bvbedit.brdf.plan import Plan, plan
from bvbedit.brdf.problem import tabulate
from bvbedit.brdf.samples import Samples, draw_samples
from bvbedit.brdf.spline_brdf import SplineBrdf
from bvbedit.brdf.storage import PRECISIONS, Storage, storage_named
from bvbedit.io.budget import (
    LARGER_STEPS,
    SMALLER_STEPS,
    file_bytes,
    first_guess,
    kept_within,
    payload_bytes,
    size_within,
)
from bvbedit.io.bvb import dumps
from tests.brdf.samples import Glossy
from tests.io import files
from tests.spline.refusals import refusal

LOG_COSINE = LOSSES["log_cosine_rms"]
each_precision = pytest.mark.parametrize("precision", PRECISIONS)
each_count = pytest.mark.parametrize("count", [file_bytes, payload_bytes], ids=["file", "payload"])


@functools.cache
def _planned() -> tuple[Plan, Samples]:
    table = tabulate(Glossy(0.25), HALF_DIFF, tuple(np.linspace(0, 1, n) for n in (46, 31, 13)))
    made = plan(table, Root(), LOG_COSINE, (1.0, 1.0), degrees=(3, 3, 3), placement="dominant", points=20_000)
    return made, draw_samples(Glossy(0.25), HALF_DIFF, 1000, seed=5)


def _quick(size: tuple[int, ...], precision: str) -> SplineBrdf:
    """Return the quick fit of a size, stored as the plan has it."""
    made, samples = _planned()
    spline = made.lofted(size)
    storage = made.storage(precision, spline, samples)
    return SplineBrdf(spline, HALF_DIFF, Root(), storage=storage)


@each_precision
def test_bytes_of_a_file_are_those_on_disk(precision, tmp_path):
    model = files.model().stored_as(storage_named(precision, files.model().spline.control))
    path = tmp_path / "m.bvb"
    bvbedit.save(model, path, precision=None)
    assert file_bytes(model) == path.stat().st_size == len(dumps(model))


@pytest.mark.parametrize(("precision", "each"), [("float16", 2), ("float32", 4), ("float64", 8)])
def test_the_payload_of_a_float_net_is_its_numbers_and_interior_knots(precision, each):
    """7 x 5 x 3 control points of three channels, 3 + 1 + 0 interior knots of 8 bytes."""
    model = files.model().stored_as(Storage(precision))
    assert payload_bytes(model) == 7 * 5 * 3 * 3 * each + 8 * 4


def test_the_payload_of_a_quantised_net_is_less_for_larger_steps():
    sizes = [
        payload_bytes(_quick((16, 12, 5), "quantised").stored_as(Storage("quantised", s))) for s in (1e-4, 1e-3, 1e-2)
    ]
    assert sizes[0] > sizes[1] > sizes[2] > 8 * (12 + 8 + 1)


@each_count
@each_precision
@pytest.mark.parametrize("budget", [4000, 9000, 20_000])
def test_the_size_chosen_is_the_largest_whose_quick_fit_takes_the_bytes_allowed(precision, budget, count):
    """To a fifth: what deflation makes of a net, and how long a report is, turns out later."""
    made, samples = _planned()
    size = size_within(made, samples, budget, precision, count)
    taken = count(_quick(size, precision))
    assert taken <= budget
    most = made.walk(10**6)[-1]
    if size != most:
        report = 1100 if count is file_bytes else 0
        assert taken > 0.75 * (budget - report)


@each_count
def test_more_bytes_never_make_a_smaller_net(count):
    made, samples = _planned()
    budgets = (2500, 3500, 5000, 8000, 12_000, 30_000)
    points = [int(np.prod(size_within(made, samples, b, "quantised", count))) for b in budgets]
    assert points == sorted(points)
    assert points[-1] > 4 * points[0]


def test_sizes_are_on_the_walk():
    made, samples = _planned()
    size = size_within(made, samples, 6000, "float16", payload_bytes)
    assert size in made.walk(int(np.prod(size)))


@each_count
@each_precision
def test_bytes_that_hold_no_net_are_refused_with_what_it_takes(precision, count):
    made, samples = _planned()
    smallest = count(_quick((4, 4, 4), precision))
    message = refusal(lambda: size_within(made, samples, smallest - 1, precision, count))
    assert f"takes {smallest}" in message
    assert size_within(made, samples, smallest, precision, count) == (4, 4, 4)


@each_count
def test_endless_bytes_hold_the_largest_net_that_the_data_carry(count):
    made, samples = _planned()
    assert size_within(made, samples, 10**8, "quantised", count) == made.walk(10**9)[-1]


@each_precision
def test_the_first_guess_is_within_a_factor_of_three(precision):
    model = _quick((20, 16, 6), precision)
    assert 1 / 3 < first_guess(payload_bytes(model), precision) / (20 * 16 * 6) < 3
    assert first_guess(1, precision) >= 1


@each_count
@pytest.mark.parametrize("share", [0.85, 0.9, 0.97, 0.999, 1.0, 1.2, 3.0])
def test_a_kept_model_is_within_its_budget(share, count):
    model = _quick((16, 12, 5), "quantised")
    budget = int(share * count(model))
    kept = kept_within(model, budget, count)
    if kept is not None:
        assert count(kept) <= budget
        np.testing.assert_array_equal(kept.spline.control, model.spline.control)
        assert (kept.storage.step / model.storage.step) == pytest.approx(
            min((1.0, *LARGER_STEPS, *SMALLER_STEPS), key=lambda s: abs(s - kept.storage.step / model.storage.step))
        )
    if share >= 1:
        assert kept is not None
        assert kept.storage.step <= model.storage.step
    if share == 3.0:
        # Bytes that are left are spent on smaller steps.
        assert kept.storage.step < model.storage.step
    if share == 0.97:
        assert kept.storage.step > model.storage.step


def test_what_would_cost_more_than_it_is_worth_is_not_kept():
    model = _quick((16, 12, 5), "quantised")
    assert kept_within(model, payload_bytes(model) // 3, payload_bytes) is None


@pytest.mark.parametrize("precision", ["float16", "float32", "float64"])
def test_float_nets_are_kept_as_they_are_or_not_at_all(precision):
    model = _quick((8, 8, 5), precision)
    taken = payload_bytes(model)
    assert kept_within(model, taken, payload_bytes) is model
    assert kept_within(model, taken - 1, payload_bytes) is None
