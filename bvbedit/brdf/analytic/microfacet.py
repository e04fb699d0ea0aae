"""Microfacet models: f = F D G / (4 cos theta_i cos theta_o)."""

from dataclasses import dataclass

import numpy as np

from bvbedit.brdf.analytic.common import DIFFUSE_SHARE, ROUGHNESS, Analytic, Colour, Pair, colour, number
from bvbedit.brdf.analytic.densities import Beckmann, Cosine, Mixture, VisibleGGX
from bvbedit.brdf.analytic.fresnel import Fresnel, checked_fresnel
from bvbedit.brdf.density import Density
from bvbedit.brdf.geometry import Floats


@dataclass(frozen=True)
class CookTorrance(Analytic):
    """f = diffuse/pi + specular F D G / (4 cos theta_i cos theta_o), D Beckmann's, G of V-shaped grooves.

    D = exp(-tan^2 theta_h / m^2) / (pi m^2 cos^4 theta_h), G = min(1, 2 (n.h)(n.wo)/(wo.h), 2 (n.h)(n.wi)/(wo.h)):
    Cook & Torrance, "A reflectance model for computer graphics", ACM Transactions on Graphics 1(1), 1982. The paper
    writes F/pi with a D that lacks 1/pi and has no 4; the factor here is the one that follows from its own geometry
    (Walter et al. 2007, equation 20) and keeps the albedo within 1.
    Raises BvbError for m outside [1e-4, 2] or colours outside [0, 1].
    """

    m: float
    fresnel: Fresnel
    specular: Colour = 1.0
    diffuse: Colour = 0.0

    def __post_init__(self) -> None:
        object.__setattr__(self, "m", number("CookTorrance", "m", self.m, *ROUGHNESS))
        object.__setattr__(self, "specular", colour("CookTorrance", "specular", self.specular, 0.0, 1.0))
        object.__setattr__(self, "diffuse", colour("CookTorrance", "diffuse", self.diffuse, 0.0, 1.0))
        checked_fresnel("CookTorrance", self.fresnel)

    @property
    def density(self) -> Density:
        return Mixture([Cosine(), Beckmann(self.m)], [DIFFUSE_SHARE, 1 - DIFFUSE_SHARE])

    def facets(self, pair: Pair) -> Floats:
        """Return D G / (4 cos theta_i cos theta_o) (n,), in 1/sr: the lobe of facets that reflect all."""
        m2 = self.m**2
        D = np.exp(-pair.tan2_h / m2) / (np.pi * m2 * pair.cos2_h**2)
        # G / (4 cos_i cos_o) with the cosines cancelled; 2 (n.h)/(wo.h) = 4 (cos_i + cos_o)/|wi + wo|^2.
        groove = 4 * pair.sum_z / pair.sum2
        smaller, larger = np.minimum(pair.cos_i, pair.cos_o), np.maximum(pair.cos_i, pair.cos_o)
        V = np.minimum(1 / smaller, groove) / (4 * larger)
        return np.asarray(D * V)

    def reflectance(self, pair: Pair) -> Floats:
        lobe = self.facets(pair)[:, None] * self.fresnel(pair.cos_d)
        return np.asarray(np.asarray(self.diffuse) / np.pi + lobe * np.asarray(self.specular))


@dataclass(frozen=True)
class GGX(Analytic):
    """f = F D G / (4 cos theta_i cos theta_o), D the Trowbridge-Reitz (GGX) distribution, G Smith's.

    D = 1 / (pi alpha^2 (cos^2 theta_h + sin^2 theta_h / alpha^2)^2): Trowbridge & Reitz 1975; Walter, Marschner, Li &
    Torrance, "Microfacet models for refraction through rough surfaces", EGSR 2007, equations 20 and 33.
    G = 1 / (1 + Lambda(wi) + Lambda(wo)), Lambda = (sqrt(1 + alpha^2 tan^2 theta) - 1)/2: masking and shadowing
    correlated by height, Heitz, "Understanding the masking-shadowing function in microfacet-based BRDFs", JCGT 3(2),
    2014, equations 72 and 99. Light that would bounce twice is lost, so a rough metal is darker than F.
    Raises BvbError for alpha outside [1e-4, 2].
    """

    alpha: float
    fresnel: Fresnel

    def __post_init__(self) -> None:
        object.__setattr__(self, "alpha", number("GGX", "alpha", self.alpha, *ROUGHNESS))
        checked_fresnel("GGX", self.fresnel)

    @property
    def density(self) -> Density:
        return VisibleGGX(self.alpha)

    def facets(self, pair: Pair) -> Floats:
        """Return D G / (4 cos theta_i cos theta_o) (n,), in 1/sr: the lobe of facets that reflect all."""
        a2 = self.alpha**2
        D = 1 / (np.pi * a2 * (pair.cos2_h + pair.sin2_h / a2) ** 2)
        # G / (4 cos_i cos_o), where cos theta (1 + 2 Lambda) = sqrt(alpha^2 + (1 - alpha^2) cos^2 theta).
        root_i = np.sqrt(a2 + (1 - a2) * pair.cos_i**2)
        root_o = np.sqrt(a2 + (1 - a2) * pair.cos_o**2)
        V = 0.5 / (pair.cos_o * root_i + pair.cos_i * root_o)
        return np.asarray(D * V)

    def reflectance(self, pair: Pair) -> Floats:
        return np.asarray(self.facets(pair)[:, None] * self.fresnel(pair.cos_d))
