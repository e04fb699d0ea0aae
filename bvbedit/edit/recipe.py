"""Recipes: what is done to a material, in a TOML file that people write and histories are written as.

source = "gold.bvb"            # a model or a measurement, beside the recipe

[fit]                          # how a measurement becomes a model
max_bytes = 16384

[[steps]]
op = "tint"
label = "warm"                 # so that --set warm.rgb=1,0.7,0.5 reaches it
rgb = [1.0, 0.8, 0.6]
theta_h = [0, 20]

[[outputs]]
file = "warm.bvb"              # or .binary, .npz; {name} stands for the source's name
"""

import os
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any, Literal

from bvbedit.brdf.base import Brdf
from bvbedit.brdf.goniophotometer import measure
from bvbedit.brdf.materials import is_material, material_named
from bvbedit.brdf.spline_brdf import SplineBrdf
from bvbedit.edit.combining import Blend
from bvbedit.edit.document import Document, digest
from bvbedit.edit.fitting import FitOptions
from bvbedit.edit.operation import Edit, value_of
from bvbedit.edit.operations import any_edit
from bvbedit.edit.paths import seen_from
from bvbedit.errors import BvbError
from bvbedit.io import load
from bvbedit.io.settings import line_of, read_settings

AnyEdit = any_edit()

WHAT = "recipe"
SUFFIXES = (".bvb", ".binary", ".npz")


@dataclass(frozen=True)
class Source:
    """Where a recipe begins: a file with a model or a measurement, or a sample material, which is measured.

    ``digest`` is what the model's net must have, as a history knows it. A sample is measured on MERL's grid, with
    ``noise`` as a share of its values.
    """

    file: Path | None = None
    digest: str | None = None
    sample: str | None = None
    noise: float = 0.0
    seed: int = 0

    def __post_init__(self) -> None:
        if (self.file is None) == (self.sample is None):
            raise BvbError("A source is a file or a sample. Give one of the two.")
        if self.sample is not None:
            material_named(self.sample)
        if not 0 <= self.noise <= 1:
            raise BvbError(f"noise is {self.noise}. Give a share of the values in 0 ... 1.")

    @property
    def name(self) -> str:
        """What outputs are called after."""
        return self.file.stem if self.file is not None else str(self.sample)

    def __str__(self) -> str:
        return str(self.file or self.sample)

    def told(self) -> dict[str, Any]:
        """Return it as a document knows it, but for the digest."""
        if self.file is not None:
            return {"file": str(self.file)}
        noisy = {"noise": self.noise, "seed": self.seed} if self.noise else {}
        return {"sample": self.sample, **noisy}

    def read(self) -> Brdf:
        """Return the model or the measurement. Raises BvbError where the file cannot be read."""
        if self.file is not None:
            return load(self.file)
        return measure(material_named(str(self.sample)).brdf, "merl", self.noise, self.seed)


@dataclass(frozen=True)
class Output:
    """A file that a recipe makes: a model, or by resampling a MERL table (.binary) or a table on its chart (.npz)."""

    file: str
    precision: Literal["float16", "float32", "float64", "quantised"] | None = None
    pdf: bool = False

    def __post_init__(self) -> None:
        if Path(self.file).suffix.lower() not in SUFFIXES:
            raise BvbError(f"file is {self.file!r}. Name one that ends in {', '.join(SUFFIXES)}.")
        if (self.precision is not None or self.pdf) and Path(self.file).suffix.lower() != ".bvb":
            raise BvbError("precision and pdf are for .bvb files. Leave them out.")

    def path(self, folder: Path, name: str) -> Path:
        """Return where the file is made, for a source of this name."""
        return folder / self.file.replace("{name}", name)


@dataclass(frozen=True)
class _Written:
    """What stands in the file."""

    steps: tuple[AnyEdit, ...]  # type: ignore[valid-type]
    source: Source | None = None
    fit: FitOptions = field(default_factory=FitOptions)
    outputs: tuple[Output, ...] = ()
    names: dict[str, int] = field(default_factory=dict)


@dataclass(frozen=True)
class Recipe:
    """A source, the steps, and the outputs."""

    steps: tuple[Edit, ...]
    source: Source | None = None
    fit: FitOptions = field(default_factory=FitOptions)
    outputs: tuple[Output, ...] = ()
    origin: Path | None = None
    """The file that it was read from, for messages."""

    def apply(
        self,
        model: SplineBrdf,
        source: Source,
        *,
        fitted: bool = False,
        progress: Callable[[float], object] | None = None,
    ) -> Document:
        """Return the document of a model, which came from a source, perhaps ``fitted`` as is asked, after all steps.

        Raises BvbError, with the number of the step and its line in the recipe, where one cannot be made, and where the
        recipe names a digest that is not the model's.
        """
        if self.source is not None and self.source.digest not in (None, digest(model)):
            raise BvbError(
                f"{source} is not the model that the recipe began with: it has changed since. Remove digest from the "
                "recipe to use it all the same."
            )
        told = source.told()
        document = Document.of_fit(model, self.fit, **told) if fitted else Document.of(model, **told)
        for n, edit in enumerate(self.steps):
            try:
                document = document.do(edit)
            except BvbError as error:
                raise BvbError(f"{self._place(n)}{error}") from None
            if progress is not None:
                progress((n + 1) / len(self.steps))
        return document

    def check_partners(self) -> None:
        """Raise BvbError, with number and line of the step, where a partner is missing or is no model."""
        for n, edit in enumerate(self.steps):
            if isinstance(edit, Blend):
                try:
                    edit.with_partner()
                except BvbError as error:
                    raise BvbError(f"{self._place(n)}{error}") from None

    def _place(self, n: int) -> str:
        step = f"step {n + 1} ({self.steps[n].op}): "
        return (
            step if self.origin is None else f"{self.origin}, line {line_of(self.origin, ('steps', n), WHAT)}: {step}"
        )


def read_recipe(path: str | os.PathLike[str], settings: Sequence[str] = ()) -> Recipe:
    """Return the recipe in a TOML file, its paths as seen from the folder of the file.

    ``settings`` are texts like ``warm.factor=2`` or ``3.factor=2``: parameters of steps by their label or number, from
    1. Raises BvbError, with line and key, for what is no recipe, and for settings that meet no step.
    """

    def change(data: dict[str, Any]) -> None:
        # A source may be written as its file or sample alone.
        alone = data.get("source")
        if isinstance(alone, str):
            data["source"] = {"sample" if is_material(alone) else "file": alone}
        for setting in settings:
            _set(data, setting)

    read = read_settings(path, _Written, what=WHAT, change=change)
    folder = Path(path).parent
    source = read.source
    if source is not None and source.file is not None:
        source = replace(source, file=folder / source.file)
    steps = tuple(seen_from(folder, edit) for edit in read.steps)
    return Recipe(steps, source, read.fit, read.outputs, Path(path))


def _set(data: dict[str, Any], setting: str) -> None:
    name, equals, text = setting.partition("=")
    step, dot, key = name.rpartition(".")
    if not (equals and dot and step and key):
        raise BvbError(f"--set {setting!r} sets nothing. Write it like warm.factor=2 or 3.factor=2.")
    steps = data.get("steps")
    steps = [s for s in steps if isinstance(s, dict)] if isinstance(steps, list) else []
    labels = [s.get("label") for s in steps]
    if step in labels:
        n = labels.index(step)
    elif step.isdecimal() and 1 <= int(step) <= len(steps):
        n = int(step) - 1
    else:
        known = ", ".join(str(label) for label in labels if label) or "none"
        raise BvbError(f"--set {setting!r}: no step is called {step!r}. Labels: {known}; numbers: 1 to {len(steps)}.")
    steps[n][key] = value_of(text)


def to_toml(recipe: Mapping[str, Any], outputs: Sequence[str] = (), precision: str | None = None) -> str:
    """Return the recipe of a document as TOML, which ``read_recipe`` reads, with the files it is to make, and how."""
    import tomlkit

    source = dict(recipe["source"])
    # A history keeps with its source how that was fitted; a recipe has a table for it.
    fit = source.pop("fit", None)
    data = {**recipe, "source": source, **({"fit": fit} if fit else {})}
    if outputs:
        how = {} if precision is None else {"precision": precision}
        data["outputs"] = [{"file": file, **how} for file in outputs]
    return str(tomlkit.dumps(data))
