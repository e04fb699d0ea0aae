"""Commands that make measurements out of nothing: a simulated goniophotometer looks at an analytic material."""

from pathlib import Path
from typing import Literal

from cyclopts import App

from bvbedit.cli.models import Json
from bvbedit.cli.output import progress, report
from bvbedit.errors import BvbError

sample_app = App(name="sample", help="List and make sample measurements.")


@sample_app.command(name="list")
def list_samples(*, as_json: Json = False) -> None:
    """List the sample materials.

    Parameters
    ----------
    as_json
        Print one JSON object: name to description.
    """
    from bvbedit.brdf.materials import MATERIALS

    report({name: material.description for name, material in MATERIALS.items()}, as_json)


@sample_app.command
def make(
    name: str,
    target: Path,
    /,
    *,
    grid: Literal["merl", "paper"] | None = None,
    noise: float = 0.0,
    seed: int = 0,
    as_json: Json = False,
) -> None:
    """Measure a sample material with the simulated goniophotometer.

    Parameters
    ----------
    name
        A material that `bvbedit sample list` names.
    target
        The file to write: .binary (MERL's format) or .npz (table).
    grid
        merl (90 x 90 x 180 half/difference angles) or paper (91 x 91 x 361 angles in and out; .npz only). Follows
        from the target's suffix if not given.
    noise
        Relative standard deviation of the readings, like 0.05; 0 is an ideal instrument.
    seed
        Chooses the noise.
    as_json
        Print one JSON object.
    """
    from bvbedit import api
    from bvbedit.brdf.goniophotometer import measure
    from bvbedit.brdf.materials import material_named
    from bvbedit.io import check_target

    material = material_named(name)
    check_target(target, (".binary", ".npz"))
    is_table = target.suffix.lower() == ".npz"
    if grid == "paper" and not is_table:
        raise BvbError(f"{target}: MERL's format has no room for the paper grid. Name a file that ends in .npz.")
    with progress(f"Measuring {name}"):
        table = measure(material.brdf, grid or ("paper" if is_table else "merl"), noise=noise, seed=seed)
    api.save(table, target)
    report(
        {
            "file": str(target),
            "file_bytes": target.stat().st_size,
            "material": name,
            "description": material.description,
            "chart": table.chart.name,
            "size": list(table.valid.shape),
            "valid": float(table.valid.mean()),
            "noise": noise,
            "seed": seed,
        },
        as_json,
    )
