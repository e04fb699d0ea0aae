"""Commands that make measurements out of nothing: a simulated goniophotometer looks at an analytic material."""

from pathlib import Path
from typing import Annotated, Literal

from cyclopts import App, Parameter

from bvbedit.cli.models import Json
from bvbedit.cli.output import progress, report
from bvbedit.errors import BvbError

GENERATED = (
    "Generated: matte, glossy and mirror-like, each another; `bvbedit sample make --all FOLDER` writes the first 100"
)

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

    listed = {name: material.description for name, material in MATERIALS.items()}
    report({**listed, "db-000 ... db-999": GENERATED}, as_json)


@sample_app.command
def make(
    name: str | None = None,
    target: Path | None = None,
    /,
    *,
    all_: Annotated[Path | None, Parameter(name="--all")] = None,
    count: int | None = None,
    jobs: int | None = None,
    grid: Literal["merl", "paper"] | None = None,
    noise: float | None = None,
    seed: int = 0,
    as_json: Json = False,
) -> None:
    """Measure a sample material with the simulated goniophotometer, or with --all those of the generated database.

    Parameters
    ----------
    name
        A material that `bvbedit sample list` names.
    target
        The file to write: .binary (MERL's format) or .npz (table).
    grid
        merl (90 x 90 x 180 half/difference angles) or paper (91 x 91 x 361 angles in and out; .npz only). Follows
        from the target's suffix if not given; with --all it is merl.
    all_
        Write the generated database to this folder, 35 MB for each file, in place of one material. Each is measured
        with its own noise. Files that are there and whole stay.
    count
        With --all: how many materials; 100 if not given.
    jobs
        With --all: how many at once; 1 if not given. The files do not depend on it.
    noise
        Relative standard deviation of the readings, like 0.05; 0, an ideal instrument, if not given.
    seed
        Chooses the noise; with --all, the materials.
    as_json
        Print one JSON object.
    """
    if all_ is not None:
        if name is not None or noise is not None:
            raise BvbError("--all takes no material and no noise: each has its own. Leave them out.")
        _make_all(all_, 100 if count is None else count, seed, grid or "merl", 1 if jobs is None else jobs, as_json)
        return
    if name is None or target is None:
        raise BvbError("Nothing to make. Name a material and a file, or --all and a folder.")
    if count is not None or jobs is not None:
        raise BvbError("--count and --jobs go with --all. Leave them out, or name a folder with --all.")
    noise = 0.0 if noise is None else noise
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


def _make_all(folder: Path, count: int, seed: int, grid: Literal["merl", "paper"], jobs: int, as_json: bool) -> None:
    from bvbedit.brdf.database import database
    from bvbedit.io.database import write_database

    materials = list(database(count, seed).values())
    with progress(f"Measuring {count} materials") as watch:
        written = write_database(materials, folder, grid=grid, jobs=jobs, progress=watch)
    kept = sum(w.status == "kept" for w in written)
    told = {
        "folder": str(folder),
        "grid": grid,
        "seed": seed,
        "count": count,
        "made": count - kept,
        "kept": kept,
        "bytes": sum(w.bytes for w in written),
    }
    report({**told, "materials": [w.to_dict() for w in written]} if as_json else told, as_json)
