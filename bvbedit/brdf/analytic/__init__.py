"""Reflectance in closed form: the classic models, sums of them, and a clear coat over them.

Each model is a small frozen value: built once with its parameters checked, evaluated without further checks, reciprocal
to the last bit, finite for every pair of directions. Colours are one number for all channels, or three (RGB).
"""

from bvbedit.brdf.analytic.common import Analytic, Colour, Pair
from bvbedit.brdf.analytic.empirical import BlinnPhong, CosineLobe, Lafortune, Lambert, Ward
from bvbedit.brdf.analytic.fresnel import ExactFresnel, Fresnel, Schlick
from bvbedit.brdf.analytic.layered import Coated, Sum
from bvbedit.brdf.analytic.microfacet import GGX, CookTorrance

__all__ = [
    "GGX",
    "Analytic",
    "BlinnPhong",
    "Coated",
    "Colour",
    "CookTorrance",
    "CosineLobe",
    "ExactFresnel",
    "Fresnel",
    "Lafortune",
    "Lambert",
    "Pair",
    "Schlick",
    "Sum",
    "Ward",
]
