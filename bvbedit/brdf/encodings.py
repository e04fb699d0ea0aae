"""Encodings: maps from reflectance to the value that a spline approximates, and back. Decoding is never negative."""

from abc import ABC, abstractmethod
from collections.abc import Mapping
from dataclasses import dataclass, fields
from typing import Any

import numpy as np

from bvbedit.brdf.geometry import Floats
from bvbedit.errors import BvbError
from bvbedit.spline.arguments import is_real_within, shown

# A wild control point decodes to a huge reflectance, not to infinity, which would spread over a whole picture.
LARGEST = 1e290
# exp(-x) is above zero.
LARGEST_EXPONENT = 700.0


class Encoding(ABC):
    """A monotone map y = encode(f) of reflectance f >= 0 in 1/sr, with encode(0) = 0."""

    name: str

    @abstractmethod
    def encode(self, f: Floats) -> Floats:
        """Return y for reflectance ``f`` (any shape); negative reflectance counts as zero."""

    @abstractmethod
    def decode(self, y: Floats) -> Floats:
        """Return f >= 0 for encoded ``y`` (any shape); negative ``y`` counts as zero."""

    @abstractmethod
    def slope(self, y: Floats) -> Floats:
        """Return df/dy >= 0 at encoded ``y`` (any shape); negative ``y`` counts as zero."""

    homogeneous: bool = True
    """Whether ``scaled`` multiplies y, so that it may be done to control points."""

    @abstractmethod
    def scaled(self, y: Floats, factor: Floats) -> Floats:
        """Return what encodes ``factor`` >= 0 times the reflectance of ``y``; of negative ``y`` only the sign counts.

        Smooth in y, negative where y is; ``factor`` is broadcast.
        """

    def to_dict(self) -> dict[str, Any]:
        """Return the name and the parameters, as JSON can hold them."""
        return {"name": self.name, **vars(self)}


@dataclass(frozen=True)
class Linear(Encoding):
    """y = f."""

    name = "linear"

    def encode(self, f: Floats) -> Floats:
        return np.maximum(f, 0.0)

    def decode(self, y: Floats) -> Floats:
        return np.maximum(y, 0.0)

    def slope(self, y: Floats) -> Floats:
        return np.ones_like(y)

    def scaled(self, y: Floats, factor: Floats) -> Floats:
        return np.asarray(y * factor)


@dataclass(frozen=True)
class Root(Encoding):
    """y = f^(1/k); k = 3 is also the exponent of the error metric that Fores et al. (2012) found best."""

    k: float = 3.0
    name = "root"

    def __post_init__(self) -> None:
        object.__setattr__(self, "k", _checked(self.name, "k", self.k, 1.0, 16.0))

    def encode(self, f: Floats) -> Floats:
        f = np.clip(f, 0.0, LARGEST)
        return np.cbrt(f) if self.k == 3 else f ** (1 / self.k)

    def decode(self, y: Floats) -> Floats:
        y = np.clip(y, 0.0, LARGEST ** (1 / self.k))
        return y * y * y if self.k == 3 else y**self.k

    def slope(self, y: Floats) -> Floats:
        y = np.clip(y, 0.0, LARGEST ** (1 / self.k))
        return 3.0 * y * y if self.k == 3 else self.k * y ** (self.k - 1)

    def scaled(self, y: Floats, factor: Floats) -> Floats:
        return np.asarray(y * (np.cbrt(factor) if self.k == 3 else factor ** (1 / self.k)))


@dataclass(frozen=True)
class Log(Encoding):
    """y = log(1 + f/eps), eps in 1/sr: the same for all materials, or their nets could not be mixed exactly."""

    eps: float = 1e-3
    name = "log"

    def __post_init__(self) -> None:
        object.__setattr__(self, "eps", _checked(self.name, "eps", self.eps, 1e-12, 1e6))

    def encode(self, f: Floats) -> Floats:
        return np.log1p(np.clip(f, 0.0, LARGEST) / self.eps)

    def decode(self, y: Floats) -> Floats:
        return self.eps * np.expm1(np.clip(y, 0.0, np.log1p(LARGEST / self.eps)))

    def slope(self, y: Floats) -> Floats:
        return self.eps * np.exp(np.clip(y, 0.0, np.log1p(LARGEST / self.eps)))

    homogeneous = False

    def scaled(self, y: Floats, factor: Floats) -> Floats:
        # log(1 + g (e^y - 1)) = y + log(g + (1 - g) e^-y); an odd function, for below zero.
        size = np.abs(y)
        decayed = np.exp(-np.minimum(size, LARGEST_EXPONENT))
        shifted = size + np.log(factor + (1.0 - factor) * decayed)
        return np.asarray(np.sign(y) * np.where(np.asarray(factor) > 0, shifted, 0.0))


def _checked(encoding: str, name: str, value: float, lowest: float, highest: float) -> float:
    if not is_real_within(value, lowest, highest):
        raise BvbError(
            f"{encoding} encoding: {name} is {shown(value)}. It must be a number in {lowest:g} ... {highest:g}."
        )
    return float(value)


ENCODINGS: dict[str, type[Encoding]] = {e.name: e for e in (Linear, Root, Log)}


def encoding_named(name: str) -> Encoding:
    """Return the encoding called ``name`` with its usual parameter. Raises BvbError that lists the names."""
    return encoding_from_dict({"name": name})


def check_encoding(value: object) -> None:
    """Raise BvbError where ``value`` is no Encoding."""
    if not isinstance(value, Encoding):
        raise BvbError(f"{shown(value)} is no encoding. Give one like Root().")


def encoding_from_dict(description: Mapping[str, Any]) -> Encoding:
    """Return the encoding that ``to_dict`` described. Raises BvbError for an unknown name or a bad parameter."""
    if not isinstance(description, Mapping):
        raise BvbError(f"{shown(description)} describes no encoding. Give its name and parameters, as to_dict does.")
    parameters = dict(description)
    name = parameters.pop("name", None)
    if not isinstance(name, str) or name not in ENCODINGS:
        raise BvbError(f"Unknown encoding {shown(name)}. Choose one of {', '.join(ENCODINGS)}.")
    try:
        return ENCODINGS[name](**parameters)
    except TypeError:
        known = ", ".join(f.name for f in fields(ENCODINGS[name])) or "none"  # type: ignore[arg-type]
        raise BvbError(f"Encoding {name} has no parameters {shown(list(parameters))}. It has {known}.") from None
