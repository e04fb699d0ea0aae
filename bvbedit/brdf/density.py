"""Densities of directions: what light is sampled by. Arguments are unit vectors (n, 3); nothing is checked."""

from abc import ABC, abstractmethod

from bvbedit.brdf.geometry import Floats


class Density(ABC):
    """A density of wi over solid angle, given wo, both on or above the horizon."""

    @abstractmethod
    def sample(self, wo: Floats, u: Floats) -> tuple[Floats, Floats]:
        """Return wi (n, 3) for ``wo`` (n, 3) and ``u`` (n, 2) in [0, 1), and its density (n,).

        A rejected sample has wi = n and density zero.
        """

    @abstractmethod
    def pdf(self, wi: Floats, wo: Floats) -> Floats:
        """Return the density (n,) of ``wi`` (n, 3) given ``wo`` (n, 3)."""
