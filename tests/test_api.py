"""The Python surface: what it refuses."""

import pytest

import bvbedit
from bvbedit import BvbError
from bvbedit.brdf.analytic import Lambert

GREY = Lambert(0.5)


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
        bvbedit.fit(GREY, **options)
