"""The Python surface: what it refuses before any work is done."""

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
        ({"max_payload": 100}, "hold no net"),
    ],
)
def test_impossible_fits_are_refused(options, says):
    with pytest.raises(BvbError, match=says):
        bvbedit.fit(GREY, **options)
