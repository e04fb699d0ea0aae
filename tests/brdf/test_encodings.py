"""Encodings: inverse to one another, monotone, never negative, never infinite, and told apart by their dictionaries."""

import json
import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from bvbedit import BvbError
from bvbedit.brdf.encodings import ENCODINGS, Linear, Log, Root, encoding_from_dict, encoding_named

ALL = [Linear(), Root(), Root(1.0), Root(2.5), Root(16.0), Log(), Log(1e-12), Log(1e6)]

each = pytest.mark.parametrize("encoding", ALL, ids=repr)


@pytest.mark.parametrize(
    ("encoding", "f", "y"),
    [
        (Linear(), 0.7, 0.7),
        (Root(), 8.0, 2.0),
        (Root(2.0), 9.0, 3.0),
        (Log(), 1e-3 * (math.e - 1), 1.0),
        (Log(0.5), 1.0, math.log(3.0)),
    ],
)
def test_formulas(encoding, f, y):
    assert float(encoding.encode(np.array(f))) == pytest.approx(y, rel=1e-15)
    assert float(encoding.decode(np.array(y))) == pytest.approx(f, rel=1e-14)


@each
@given(f=st.floats(0, 1e5, allow_subnormal=False))
def test_reflectance_comes_back(encoding, f):
    back = float(encoding.decode(encoding.encode(np.array(f))))
    assert back == pytest.approx(f, rel=2e-13, abs=1e-300)


@each
def test_encoding_starts_at_zero_and_rises(encoding):
    f = np.concatenate([[0.0], 10.0 ** np.linspace(-12, 100, 3000)])
    y = encoding.encode(f)
    assert y[0] == 0
    assert (np.diff(y) > 0).all()
    assert (np.diff(encoding.decode(y)) >= 0).all()


@each
def test_negatives_count_as_zero_on_both_sides(encoding):
    bad = np.array([-1e-300, -1.0, -1e300, -0.0])
    assert (encoding.encode(bad) == 0).all()
    assert (encoding.decode(bad) == 0).all()


@each
def test_no_finite_value_becomes_infinite(encoding):
    """A wild control point is a bright spot; infinity would spread over a whole picture."""
    wild = np.array([1e3, 1e30, 1e100, 1e200, 1e300, np.finfo(float).max])
    with np.errstate(over="ignore"):
        assert np.isfinite(encoding.encode(wild)).all()
        decoded = encoding.decode(wild)
    assert np.isfinite(decoded).all()
    assert (np.diff(decoded) >= 0).all()


@each
def test_inputs_are_left_alone_and_shapes_kept(encoding):
    f = np.array([[-1.0, 0.0, 2.0]])
    kept = f.copy()
    assert encoding.encode(f).shape == encoding.decode(f).shape == (1, 3)
    np.testing.assert_array_equal(f, kept)


@each
def test_dictionaries_describe_encodings_as_json_can_hold_them(encoding):
    description = json.loads(json.dumps(encoding.to_dict()))
    assert encoding_from_dict(description) == encoding
    assert type(encoding_from_dict(description)) is type(encoding)


def test_names_give_the_usual_parameters():
    assert [encoding_named(n) for n in ENCODINGS] == [Linear(), Root(3.0), Log(1e-3)]
    assert encoding_named("root") != encoding_from_dict({"name": "root", "k": 2.0})


@pytest.mark.parametrize(
    "make",
    [
        *[lambda k=k: Root(k) for k in (0.5, 0, -3, 17, math.nan, math.inf, "3", None, True)],
        *[lambda e=e: Log(e) for e in (0.0, -1e-3, 1e-13, 1e7, math.nan, math.inf, "1e-3", None, True)],
    ],
)
def test_bad_parameters_are_refused(make):
    with pytest.raises(BvbError, match="It must be a number in"):
        make()


@pytest.mark.parametrize(
    "description",
    [{}, {"name": "sqrt"}, {"name": None}, {"name": ["root"]}, None, "root", ["root"]],
)
def test_bad_descriptions_are_refused(description):
    with pytest.raises(BvbError, match=r"Unknown encoding|describes no encoding"):
        encoding_from_dict(description)


@pytest.mark.parametrize(("name", "known"), [("root", "k"), ("log", "eps"), ("linear", "none")])
def test_unknown_parameters_list_the_known_ones(name, known):
    with pytest.raises(BvbError, match=rf"no parameters \['gain'\]. It has {known}\."):
        encoding_from_dict({"name": name, "gain": 1})


@pytest.mark.parametrize("k", [2, np.int64(2), np.float32(2)])
def test_parameters_of_any_number_type_become_float(k):
    assert json.dumps(Root(k).to_dict()) == '{"name": "root", "k": 2.0}'


def test_unknown_names_list_the_known_ones():
    with pytest.raises(BvbError, match="linear, root, log"):
        encoding_named("logarithm")
