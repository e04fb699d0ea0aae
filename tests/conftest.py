"""What all tests share: reproducible randomness."""

import numpy as np
import pytest
from hypothesis import settings

# The same examples in every run, and no deadline: the first call of a kernel compiles it.
settings.register_profile("bvbedit", derandomize=True, deadline=None, database=None)
settings.load_profile("bvbedit")


@pytest.fixture
def rng() -> np.random.Generator:
    """A fresh generator with the same seed for each test."""
    return np.random.default_rng(20080613)
