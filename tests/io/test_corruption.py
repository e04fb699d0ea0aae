"""Damaged files of every format are refused in one line or do no harm; memory stays within bounds."""

import json
import subprocess
import sys
from collections.abc import Callable

import numpy as np
import pytest

from tests.brdf.samples import random_pairs
from tests.io import corruption, files
from tests.io.test_bvb import archive, members


# A MERL file is 35 MB long, and all that it claims stands in its first 12 bytes: fewer copies try that as often.
@pytest.mark.parametrize(
    ("suffix", "make", "count"),
    [(".bvb", files.bvb, 200), (".bvb", files.quantised, 200), (".bsdf", files.bsdf, 200), (".binary", files.merl, 80)],
)
def test_damaged_files_are_refused_or_harmless(suffix: str, make: Callable[[], bytes], count: int):
    command = [sys.executable, "-m", "tests.io.corruption", suffix, str(count), "7"]
    done = subprocess.run(command, input=make(), capture_output=True, timeout=400, check=False)
    assert done.returncode == 0, done.stderr.decode()[-2000:]
    told = json.loads(done.stdout)
    assert sum(told["outcomes"].values()) == count
    assert set(told["outcomes"]) <= {"refused", "harmless"}
    assert told["outcomes"]["refused"] > count / 4
    assert told["peak_mb"] < 1024


@pytest.mark.parametrize("make", [files.bvb, files.quantised])
@pytest.mark.parametrize("member", ["meta.json", "control.npy", "knots_0.npy"])
def test_damage_that_the_checksums_of_an_archive_cannot_see(member: str, make: Callable[[], bytes], tmp_path):
    """Members are damaged before they are packed, as by a writer that is wrong or means harm."""
    parts = members(make())
    wi, wo = random_pairs(np.random.default_rng(1), 50)
    outcomes = set()
    for damaged in corruption.corruptions(parts[member], 150, 11):
        if isinstance(damaged, tuple):
            at, new = damaged
            damaged = parts[member][:at] + new + parts[member][at + len(new) :]
        path = files.written(tmp_path / "m.bvb", archive(parts | {member: damaged}))
        outcomes.add(corruption.outcome(path, wi, wo))
    assert outcomes == {"refused", "harmless"}


def test_the_generator_is_deterministic_and_damages():
    content = files.bsdf()
    first, again = (list(corruption.corruptions(content, 100, 3)) for _ in range(2))
    assert first == again
    changed = [d != content if isinstance(d, bytes) else content[d[0] : d[0] + len(d[1])] != d[1] for d in first]
    assert sum(changed) > 80
    assert sum(isinstance(d, bytes) for d in first) > 20
