"""What all tests share: reproducible randomness, and threads that leave the cores to the other worker."""

import os

# Threads that spin while they wait keep the other worker from its core: tests of kernels took twice the time. Read when
# the first parallel kernel runs, and when numpy is loaded. Fits took a fifth longer with two threads of BLAS.
os.environ.setdefault("OMP_WAIT_POLICY", "passive")
os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")

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
