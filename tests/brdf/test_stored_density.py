"""The density that a file holds: nearly the one that is built, exact in itself, never that of another model."""

import numpy as np
import pytest

import bvbedit
from bvbedit.brdf.charts import HALF_DIFF, IN_OUT
from bvbedit.brdf.encodings import Log, Root
from bvbedit.brdf.fit import fit_net
from bvbedit.brdf.geometry import spherical
from bvbedit.brdf.sampling import coded, decoded, half_vector_density
from bvbedit.errors import BvbError
from bvbedit.io.bvb import dumps, loads
from tests.brdf.samples import Glossy


@pytest.fixture(scope="module", params=["half-diff", "in-out"])
def model(request):
    if request.param == "half-diff":
        return fit_net(Glossy(0.1), HALF_DIFF, Root(), size=(20, 14, 5))
    return fit_net(Glossy(0.4), IN_OUT, Log(), size=(10, 10, 8))


def test_a_stored_density_is_the_one_that_is_built_to_an_eighth_of_an_octave(model):
    built, stored = half_vector_density(model).spline.control, loads(dumps(model, pdf=True)).density.spline.control
    seen = built > 1e-9 * built.max(axis=(1, 2), keepdims=True)
    # Both are normalised, so that a common factor may differ too.
    assert np.abs(np.log2(stored[seen] / built[seen])).max() < 0.125 + 0.07
    assert stored.min() >= 0


def test_samples_by_a_stored_density_have_the_same_mean_and_hardly_more_noise(model):
    stored = loads(dumps(model, pdf=True))
    u = np.random.default_rng(0).random((1 << 16, 2))
    wo = spherical(np.radians(50.0), 0.3)
    ours, theirs = (m.sample(wo, u)[2].mean(axis=1) for m in (model, stored))
    error = np.hypot(ours.std(), theirs.std()) / np.sqrt(len(u))
    assert abs(ours.mean() - theirs.mean()) < 4 * error
    assert theirs.std() < 1.1 * ours.std()
    wi, pdf, _ = stored.sample(wo, u)
    np.testing.assert_allclose(stored.pdf(wi[pdf > 0], wo), pdf[pdf > 0], rtol=1e-9)


def test_it_takes_a_few_kilobytes_and_only_on_request(model):
    assert 500 < len(dumps(model, pdf=True)) - len(dumps(model)) < 6000


def test_coding_twice_changes_nothing_more(model):
    once = decoded(coded(half_vector_density(model)), model)
    np.testing.assert_array_equal(coded(decoded(coded(once), model)), coded(once))


def test_an_edited_model_has_a_density_of_its_own(model, tmp_path):
    bvbedit.save(model, tmp_path / "a.bvb", pdf=True)
    loaded = bvbedit.load(tmp_path / "a.bvb")
    edited = loaded.with_spline(loaded.spline.with_control(loaded.spline.control[::-1].copy()))
    np.testing.assert_array_equal(edited.density.spline.control, half_vector_density(edited).spline.control)
    bvbedit.save(edited, tmp_path / "b.bvb")
    again = bvbedit.load(tmp_path / "b.bvb")
    np.testing.assert_array_equal(again.density.spline.control, half_vector_density(again).spline.control)


@pytest.mark.parametrize(
    ("codes", "words"),
    [
        (np.ones((24, 9, 13), np.uint8), "shape"),
        (np.ones((24, 9, 13), np.uint16), "uint16"),
        (None, "zero everywhere"),
    ],
)
def test_what_is_no_density_of_this_model_is_refused(model, codes, words):
    codes = np.zeros_like(coded(half_vector_density(model))) if codes is None else codes
    with pytest.raises(BvbError, match=words):
        decoded(codes, model)
