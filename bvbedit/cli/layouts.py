"""How the pictures of several materials are put together: in one scene, in a row, as differences, as swatches."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import asdict, dataclass
from pathlib import Path
from time import perf_counter
from typing import Any

import numpy as np
from numpy.typing import NDArray

from bvbedit.brdf.analytic.densities import Mixture
from bvbedit.brdf.base import Brdf
from bvbedit.brdf.density import Density
from bvbedit.cli.output import progress
from bvbedit.io.exr import write_exr
from bvbedit.io.png import write_png
from bvbedit.render import render_passes
from bvbedit.render.image_metrics import compare_pictures
from bvbedit.render.integrator import Estimate
from bvbedit.render.scene_file import scene_of
from bvbedit.render.sheet import amplified_difference, sheet
from bvbedit.render.tonemap import tone_map

# Seconds between two states of a picture that are written while it is rendered.
PATIENCE = 5.0
# Swatches in one row, and by what differences are multiplied to be seen.
SWATCHES, AMPLIFICATION = 5, 8.0


@dataclass(frozen=True)
class Shot:
    """Materials with the names of their files, the scene, and how it is rendered."""

    models: Sequence[Brdf]
    names: Sequence[str]
    scene: str
    options: Mapping[str, Any]
    exposure: float


class _Rendering:
    """The pictures of a shot, one by one; after Ctrl-C those that were not begun are left out."""

    def __init__(self, shot: Shot) -> None:
        self._shot = shot
        self.stopped = False
        self.last: list[Estimate] = []

    def picture(
        self,
        models: Sequence[Brdf],
        label: str,
        density: Density | None = None,
        seen: Callable[[Any], None] | None = None,
    ) -> NDArray[np.float32] | None:
        """Return a picture of ``models`` in the scene; None where Ctrl-C came before its first pass was over.

        ``seen`` is given what there is of it every PATIENCE seconds.
        """
        if self.stopped:
            return None
        estimate, written = None, perf_counter()
        try:
            with progress(label) as watch:
                for estimate in render_passes(
                    list(models), self._shot.scene, density=density, progress=watch, **self._shot.options
                ):
                    if seen is not None and perf_counter() - written > PATIENCE:
                        seen(estimate.picture)
                        written = perf_counter()
        except KeyboardInterrupt:
            self.stopped = True
        if estimate is None:
            return None
        self.last.append(estimate)
        return estimate.picture

    def each(self, density: Density | None = None) -> list[NDArray[np.float32]]:
        """Return a picture of each model that was begun. Raises KeyboardInterrupt where there is none."""
        total = len(self._shot.models)
        pictures = [
            self.picture([model], f"Rendering {name} ({n} of {total})", density)
            for n, (model, name) in enumerate(zip(self._shot.models, self._shot.names, strict=True), 1)
        ]
        done = [p for p in pictures if p is not None]
        if not done:
            raise KeyboardInterrupt
        return done

    def told(self, picture: NDArray[Any]) -> dict[str, Any]:
        """Return what the command tells of the written ``picture``."""
        noise = max(e.relative_noise for e in self.last)
        told = {
            "width": picture.shape[1],
            "height": picture.shape[0],
            "spp": min(e.samples for e in self.last),
            "noise": noise if np.isfinite(noise) else None,
        }
        return {**told, "stopped": True} if self.stopped else told


def _write(picture: NDArray[np.float32], target: Path, exposure: float) -> None:
    if target.suffix.lower() == ".exr":
        write_exr(target, picture)
    else:
        write_png(target, tone_map(picture, exposure))


def in_one_picture(shot: Shot, target: Path) -> dict[str, Any]:
    """Render all models in one scene, if it shows so many, else in a row."""
    if len(shot.models) > 1 and scene_of(shot.scene).models() < 2:
        return in_a_row(shot, target)
    rendering = _Rendering(shot)
    picture = rendering.picture(
        shot.models, f"Rendering {', '.join(shot.names)}", seen=lambda p: _write(p, target, shot.exposure)
    )
    if picture is None:
        raise KeyboardInterrupt
    _write(picture, target, shot.exposure)
    return rendering.told(picture)


def in_a_row(shot: Shot, target: Path) -> dict[str, Any]:
    """Render each model in a picture of its own, side by side."""
    rendering = _Rendering(shot)
    row = np.concatenate(rendering.each(), axis=1)
    _write(row, target, shot.exposure)
    return rendering.told(row)


def as_differences(shot: Shot, target: Path) -> dict[str, Any]:
    """Render the first model beside the others, over what they differ by, all with the same directions of light."""
    rendering = _Rendering(shot)
    # Each finds its own highlights, and all are asked along the same directions.
    pictures = rendering.each(Mixture([model.density for model in shot.models]))
    eight = [tone_map(p, shot.exposure) for p in pictures]
    empty = np.full_like(eight[0], 255)
    errors = [compare_pictures(p, pictures[0], shot.exposure) for p in pictures[1:]]
    below = [
        (f"MAE {e.mae:.4f}, PAE {e.pae:.3f}; x {AMPLIFICATION:g}", amplified_difference(p, eight[0], AMPLIFICATION))
        for p, e in zip(eight[1:], errors, strict=True)
    ]
    entries = [*zip(shot.names, eight, strict=False), ("", empty), *below]
    picture = sheet(entries, columns=len(eight))
    write_png(target, picture)
    return {
        **rendering.told(picture),
        "differences": [
            {"file": name, **{k: v for k, v in asdict(e).items() if v is not None}}
            for name, e in zip(shot.names[1:], errors, strict=False)
        ],
    }


def as_swatches(shot: Shot, target: Path) -> dict[str, Any]:
    """Render each model in a small picture with its name under it."""
    rendering = _Rendering(shot)
    pictures = rendering.each()
    entries = [(name, tone_map(p, shot.exposure)) for name, p in zip(shot.names, pictures, strict=False)]
    picture = sheet(entries, columns=SWATCHES)
    write_png(target, picture)
    return rendering.told(picture)


LAYOUTS: Mapping[str, Callable[[Shot, Path], dict[str, Any]]] = {
    "picture": in_one_picture,
    "row": in_a_row,
    "difference": as_differences,
    "swatches": as_swatches,
}
