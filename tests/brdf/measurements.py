"""Simulated measurements that several tests share."""

import functools

from bvbedit.brdf.goniophotometer import measure
from bvbedit.brdf.materials import material_named
from bvbedit.brdf.measured import MeasuredBrdf


# A table and its logarithms take 100 MB.
@functools.lru_cache(maxsize=4)
def measured(material: str, grid: str = "merl", noise: float = 0.05, seed: int = 1) -> MeasuredBrdf:
    """Return the table that an instrument makes of a sample material."""
    return measure(material_named(material).brdf, grid, noise, seed)
