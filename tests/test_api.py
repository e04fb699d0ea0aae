"""The Python surface: what it refuses, what quantising costs, the paper's configuration untouched."""

import numpy as np
import pytest

import bvbedit
from bvbedit import BvbError
from bvbedit.brdf.charts import HALF_DIFF, IN_OUT, grid_points
from bvbedit.brdf.encodings import Linear
from bvbedit.brdf.fit import fit_net
from bvbedit.brdf.measured import MeasuredBrdf
from bvbedit.brdf.metrics import estimate
from bvbedit.brdf.storage import Storage
from bvbedit.io.budget import payload_bytes
from tests.brdf.samples import Glossy

# Grey, at few nodes of the chart in which it is fitted: soon refused where that takes a trial.
GREY = MeasuredBrdf(
    np.full((20, 15, 10, 3), 0.15), np.ones((20, 15, 10), bool), [np.linspace(0, 1, n) for n in (20, 15, 10)], HALF_DIFF
)
GLOSSY = Glossy(0.4)
# What saves trying charts and encodings where they are not what is tested.
SHARP = {"chart": "half-diff", "encoding": "root"}


@pytest.mark.parametrize(
    ("options", "says"),
    [
        ({"degrees": (3, 3)}, "2 degrees given"),
        ({"degrees": ("3", 3, 3)}, "Degree '3' is not supported"),
        ({"degrees": 3}, "Degrees: 3 is no list"),
        ({"chart": "rusinkiewicz"}, "for tables only"),
        ({"chart": "polar"}, "Unknown chart 'polar'"),
        ({"encoding": "square"}, "Unknown encoding 'square'"),
        ({"precision": "float8"}, "Unknown precision 'float8'"),
        ({"size": (4, 4, 4), "max_bytes": 5000}, "exclude each other"),
        ({"size": (5, 5)}, r"Size \(5, 5\) is not three"),
        ({"size": (5, 5, 1 << 40)}, "too large"),
        ({"size": (4, 4, 4), "degrees": (3, 3, 4)}, "4 control points along"),
        ({"knots": "random"}, "Unknown knot placement 'random'"),
        ({"metric": "psnr"}, "Unknown metric 'psnr'"),
        ({"metric": "e_rms", "chart": "half-diff"}, "e_rms is the paper's error, of its chart and encoding"),
        ({"metric": "e_rms", "encoding": "root"}, "Choose chart in-out and encoding linear, or another metric"),
        ({"size": (4, 4, 4), "tolerance": 0.1}, "exclude each other"),
        ({"max_payload": 10}, "10 bytes hold no net"),
        ({"max_bytes": 900}, "900 bytes hold no net"),
        ({"max_bytes": 1200}, "1200 bytes hold no net"),
        ({"max_bytes": 0}, "max_bytes is 0"),
        ({"max_payload": 2.5}, "max_payload is 2.5"),
        ({"tolerance": 0}, "tolerance is 0"),
        ({"tolerance": float("nan")}, "tolerance is nan"),
        ({"weights": 2.0}, "weights is 2.0"),
        ({"weights": lambda points: points}, "weights returned"),
        ({"weights": lambda points: -points[:, 0]}, "weights returned"),
        ({"weights": lambda points: 0 * points[:, 0]}, "weights are zero"),
        ({"smoothing": -1}, "smoothing is -1"),
        ({"source": 7}, "source is 7"),
        ({"thorough": "yes"}, "thorough is 'yes'"),
    ],
)
def test_impossible_fits_are_refused(options, says):
    with pytest.raises(BvbError, match=says):
        bvbedit.fit(GREY, **(SHARP | options))


@pytest.mark.parametrize("metric", ["log_cosine_rms", "fores", "relative_l1"])
def test_quantising_adds_a_small_share_to_the_error_of_every_metric(metric):
    axes = [np.linspace(0, 1, n) for n in (46, 36, 25)]
    wi, wo = (np.abs(w) for w in HALF_DIFF.to_directions(grid_points(axes)))
    table = MeasuredBrdf(GLOSSY.evaluate(wi, wo).reshape(46, 36, 25, 3), np.ones((46, 36, 25), bool), axes, HALF_DIFF)
    model = bvbedit.fit(table, size=(10, 6, 5), metric=metric, **SHARP)
    assert model.storage.precision == "quantised"
    exact, stored = estimate(model, table).to_dict(), model.report["metrics"]
    assert all(stored[part][metric] < 1.15 * exact[part][metric] for part in ("grid", "nodes"))
    assert payload_bytes(model) < 0.5 * payload_bytes(model.stored_as(Storage("float16")))


def test_the_published_configuration_is_that_of_the_net_but_for_its_storage():
    options = {"size": (5, 5, 8), "knots": "piegl-tiller"}
    model = bvbedit.fit(GLOSSY, chart="in-out", encoding="linear", precision="float32", **options)
    expected = fit_net(GLOSSY, IN_OUT, Linear(), **options)
    np.testing.assert_array_equal(model.spline.control, expected.spline.control)
    assert (model.report["solver"], model.report["knots"]) == ("lofting", "piegl-tiller")
    assert model.storage == Storage("float32")
