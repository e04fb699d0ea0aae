"""The plan of a study, in a TOML file that people write: which configurations, judged how.

stride = 5                     # of the paper's grid: 1 is all of its nodes, and takes seconds for each cell

[pictures]
scenes = ["sphere"]            # a name, or a file beside the plan
side = 96                      # pixels
spp = 16

[[series]]                     # configurations that differ by size or bytes
name = "paper"
chart = "in-out"
encoding = "linear"
knots = "piegl-tiller"
precision = "float32"
size = [[8, 8, 32], [16, 16, 64]]   # several values: one configuration for each, with every other

[analytic]
models = ["ggx", "ggx 2"]
"""

import os
from collections.abc import Iterator
from dataclasses import asdict, dataclass, field, fields, replace
from itertools import product
from pathlib import Path
from typing import Any

from bvbedit.brdf.metrics import STRIDES
from bvbedit.edit.fitting import FitOptions
from bvbedit.errors import BvbError
from bvbedit.io.settings import read_settings

WHAT = "plan"
Three = tuple[int, int, int]
SHIPPED_SCENES = ("sphere", "studio", "furnace")
KIB = 1024


@dataclass(frozen=True)
class Pictures:
    """Scenes in which a model is compared with its measurement, with the same random numbers."""

    scenes: tuple[str, ...] = ("sphere",)
    side: int = 96
    spp: int = 16

    def __post_init__(self) -> None:
        if not 8 <= self.side <= 2048 or not 1 <= self.spp <= 4096:
            raise BvbError(
                f"Pictures of side {self.side} and {self.spp} spp. Give a side of 8 ... 2048, spp 1 ... 4096."
            )
        if len({Path(scene).stem for scene in self.scenes}) < len(self.scenes):
            raise BvbError("Two scenes have one name. Give each a name of its own.")


@dataclass(frozen=True)
class Series:
    """Configurations of B-spline models: each option of ``bvbedit.fit`` is one value, or several to go through."""

    name: str
    chart: str | tuple[str, ...] = "auto"
    encoding: str | tuple[str, ...] = "auto"
    knots: str | tuple[str, ...] = "dominant"
    precision: str | tuple[str, ...] = "auto"
    metric: str | tuple[str, ...] = "log_cosine_rms"
    size: Three | tuple[Three, ...] | None = None
    degrees: Three | tuple[Three, ...] = (3, 3, 3)
    max_bytes: int | tuple[int, ...] | None = None
    max_payload: int | tuple[int, ...] | None = None
    tolerance: float | tuple[float, ...] | None = None
    thorough: bool = False

    def __post_init__(self) -> None:
        if not self.name.strip():
            raise BvbError("A series has no name. Give one.")
        for _ in self.configurations():
            pass  # what one of them cannot be is told when the plan is read

    def configurations(self) -> Iterator["Configuration"]:
        """Yield the configurations, the last option that has several values changing fastest."""
        several = {f.name: _values(f.name, getattr(self, f.name)) for f in fields(self) if f.name != "name"}
        varying = [name for name, values in several.items() if len(values) > 1]
        for chosen in product(*several.values()):
            options = dict(zip(several, chosen, strict=True))
            words = [_word(name, options[name]) for name in ("size", "max_bytes", "max_payload", "tolerance", *varying)]
            told = dict.fromkeys(word for word in words if word)
            try:
                fit = FitOptions(**options)
            except BvbError as error:
                raise BvbError(f"series {self.name}: {error}") from None
            yield Configuration(" ".join([self.name, *told]), self.name, fit)


@dataclass(frozen=True)
class Configuration:
    """A way to make a model of a material."""

    name: str
    series: str
    fit: FitOptions | None = None
    """Of a B-spline model."""
    analytic: str | None = None
    """The analytic model in its place."""

    def to_dict(self) -> dict[str, Any]:
        """Return it as JSON can hold it."""
        how = {"analytic": self.analytic} if self.fit is None else {"fit": self.fit.to_dict()}
        return {"name": self.name, "series": self.series, **how}


@dataclass(frozen=True)
class Analytic:
    """Analytic models that are fitted to the same measurements."""

    models: tuple[str, ...] = ()

    def __post_init__(self) -> None:
        if not self.models:
            return
        from bvbedit.brdf.analytic_fit import MODELS

        for name in self.models:
            if name not in MODELS:
                raise BvbError(f"{name!r} is no analytic model. Choose some of {', '.join(MODELS)}.")


@dataclass(frozen=True)
class Plan:
    """What is made of each material, and how it is judged."""

    series: tuple[Series, ...] = ()
    analytic: Analytic = field(default_factory=Analytic)
    pictures: Pictures = field(default_factory=Pictures)
    stride: int = 5
    """Of the paper's grid, on which its errors are taken."""

    def __post_init__(self) -> None:
        if self.stride not in STRIDES:
            raise BvbError(f"stride is {self.stride}. Choose one of {', '.join(map(str, STRIDES))}.")
        names = [c.name for c in self.configurations]
        twice = next((name for name in names if names.count(name) > 1), None)
        if twice is not None:
            raise BvbError(f"Two configurations are called {twice!r}. Give their series other names.")
        if not names:
            raise BvbError("The plan has no configurations. Add [[series]] or [analytic].")

    @property
    def configurations(self) -> list[Configuration]:
        """All configurations, in their order."""
        splines = [c for series in self.series for c in series.configurations()]
        return splines + [Configuration(name, "analytic", analytic=name) for name in self.analytic.models]

    def to_dict(self) -> dict[str, Any]:
        """Return all that results depend on, as JSON can hold it."""
        return {
            "stride": self.stride,
            "pictures": asdict(self.pictures),
            "configurations": [c.to_dict() for c in self.configurations],
        }


def read_plan(path: str | os.PathLike[str]) -> Plan:
    """Return the plan in a TOML file, its scenes as seen from its folder. Raises BvbError, with the line, for none."""
    plan = read_settings(path, Plan, what=WHAT)
    folder = Path(path).parent
    scenes = tuple(s if s in SHIPPED_SCENES else str(folder / s) for s in plan.pictures.scenes)
    return replace(plan, pictures=replace(plan.pictures, scenes=scenes))


def default_plan() -> Plan:
    """Return 40 configurations: the paper's over n and with its cure, both charts over bytes, what degrees and
    precision cost, and the analytic models."""
    n = tuple((k, k, 4 * k) for k in (6, 8, 10, 12, 14, 16, 18, 20))
    kib = tuple(k * KIB for k in (2, 4, 8, 16, 32, 64))
    paper: dict[str, Any] = {"chart": "in-out", "encoding": "linear", "precision": "float32"}
    return Plan(
        series=(
            Series("paper", knots="piegl-tiller", size=n, **paper),
            Series("paper dominant", knots="dominant", metric="e_rms", size=(*n[:4], n[5], n[7]), **paper),
            Series("half-diff root", chart="half-diff", encoding="root", max_bytes=kib),
            Series("in-out root", chart="in-out", encoding="root", max_bytes=kib[1:5:2]),
            Series("auto", max_bytes=kib[1:5:2]),
            Series(
                "degree",
                chart="half-diff",
                encoding="root",
                size=(20, 16, 8),
                degrees=((1, 1, 1), (2, 2, 2), (4, 4, 4)),
            ),
            Series(
                "precision", chart="half-diff", encoding="root", size=(20, 16, 8), precision=("float16", "quantised")
            ),
            Series("faithful", chart="half-diff", encoding="log", tolerance=0.01),
        ),
        analytic=Analytic(
            tuple(
                f"{name}{lobes}"
                for lobes in ("", " 2")
                for name in ("blinn-phong", "ward", "lafortune", "cook-torrance", "ggx")
            )
        ),
    )


def _values(name: str, value: Any) -> tuple[Any, ...]:
    """Return the values of an option: a triple is one, unless it is one of triples."""
    if not isinstance(value, tuple):
        return (value,)
    if name in ("size", "degrees"):
        return value if isinstance(value[0], tuple) else (value,)
    return value


def _word(name: str, value: Any) -> str:
    """Return what a configuration's name tells of an option."""
    if value is None:
        return ""
    if isinstance(value, tuple):
        return ("" if name == "size" else f"{name} ") + "x".join(map(str, value))
    return {
        "max_bytes": f"{value} bytes",
        "max_payload": f"{value} bytes of net",
        "tolerance": f"tolerance {value}",
    }.get(name, str(value))
