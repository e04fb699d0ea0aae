"""What a scene requires: the error of pictures over bytes, for models fitted to the metric and for the scene.

    python -m tests.benchmarks.scenes FILE ... [--scene NAME ...]

Pictures of 192 x 192 pixels, 16 samples, the same random numbers as of the measurement; PAE and MAE of the 8-bit
pictures, in steps of 1/255. A measurement that is not mirror symmetric differs from any folded model by its noise: that
is the floor, what the measurement averaged over mirror pairs differs by.
"""

import argparse
from pathlib import Path

import numpy as np
from rich.console import Console
from rich.table import Table

import bvbedit
from bvbedit.brdf.base import Brdf
from bvbedit.render.image_metrics import compare_pictures
from bvbedit.render.prepared import PreparedScene

SCENES = ("sphere", str(Path(__file__).parents[2] / "samples/scenes/backlit.toml"))
KIBIBYTES = (3, 6, 12, 24, 48, 96)
WANTED = 2.0


class Mirrored(Brdf):
    """The mean of a BRDF over pairs mirrored at the plane of wo's azimuth."""

    def __init__(self, brdf):
        self.brdf = brdf

    def _evaluate(self, wi, wo):
        a = np.arctan2(wo[:, 1], wo[:, 0])
        c, s = np.cos(2 * a), np.sin(2 * a)
        other = np.stack([c * wi[:, 0] + s * wi[:, 1], s * wi[:, 0] - c * wi[:, 1], wi[:, 2]], axis=1)
        first, trusted = self.brdf.evaluate_unit(wi, wo)
        return (first + self.brdf.evaluate_unit(other, wo)[0]) / 2, trusted


def bytes_for(sizes, errors, wanted):
    """Bytes at which the error falls to what is wanted, between two sizes on straight lines of logarithms."""
    below = [i for i, e in enumerate(errors) if e <= wanted]
    if not below:
        return None
    i = below[0]
    if i == 0:
        return sizes[0]
    x, y = np.log(errors[i - 1 : i + 1]), np.log(sizes[i - 1 : i + 1])
    return float(np.exp(np.interp(-np.log(wanted), -x, y)))


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("files", nargs="+", type=Path)
    parser.add_argument("--scene", nargs="+", default=SCENES)
    arguments = parser.parse_args()
    console = Console()
    for scene in arguments.scene:
        table = Table(title=f"{Path(scene).stem}: PAE, and MAE, in 1/255, at most so many KiB")
        for column in ("material", "fitted to", *map(str, KIBIBYTES), f"bytes for PAE {WANTED:g}", "floor"):
            table.add_column(column)
        for file in arguments.files:
            measured = bvbedit.load(file)
            prepared = PreparedScene(measured, scene, width=192, height=192, spp=16, seed=1)
            reference = prepared.shade(measured)

            def off(model, prepared=prepared, reference=reference):
                found = compare_pictures(prepared.shade(model), reference)
                return 255 * found.pae, 255 * found.mae

            floor = off(Mirrored(measured))
            for weighted in (False, True):
                errors, sizes, cells = [], [], []
                for kibibytes in KIBIBYTES:
                    model = bvbedit.fit(measured, max_bytes=kibibytes << 10, scene=scene if weighted else None)
                    pae, mae = off(model)
                    errors.append(max(pae, 0.5))
                    sizes.append(kibibytes << 10)
                    cells.append(f"{pae:.0f} {mae:.3f}")
                needed = bytes_for(sizes, errors, WANTED)
                table.add_row(
                    file.stem,
                    "scene" if weighted else "metric",
                    *cells,
                    "-" if needed is None else f"{needed:,.0f}",
                    f"{floor[0]:.0f} {floor[1]:.3f}",
                )
        console.print(table)


if __name__ == "__main__":
    main()
