"""The report of a study: its table read, all figures drawn into files, and a page that holds everything."""

import json
import os
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from html import escape
from pathlib import Path
from typing import Any

from bvbedit.errors import BvbError
from bvbedit.io.files import make_folder, reading, replacing
from bvbedit.study.classes import HOW, class_of, groups, highlights
from bvbedit.study.figures import figures
from bvbedit.study.frontier import HOW_KNEE
from bvbedit.study.frontier_plots import class_clouds
from bvbedit.study.page import folded, page, table_html
from bvbedit.study.plots import Missing, Numbers, Plot
from bvbedit.study.style import Drawing, drawn
from bvbedit.study.table import RESULTS, Table, columns, read_study
from bvbedit.study.trades import halving_numbers

HALVING_WORDS = (
    "How many times more half of the error costs, along the frontier of each class, by interpolation of logarithms: on "
    "the mean of the whole frontier, which is that of the power law through its two ends; and from its largest error, "
    "from its knee, and down to its least error. Nothing is said where the frontier ends before."
)


@dataclass(frozen=True)
class Report:
    """What was written."""

    page: Path
    figures: tuple[Path, ...]
    missing: tuple[Missing, ...]
    table: Table


def write_report(
    folder: str | os.PathLike[str],
    out: str | os.PathLike[str] | None = None,
    *,
    progress: Callable[[float], None] | None = None,
) -> Report:
    """Write the report of the study in ``folder``: a page to ``out``, and each figure as PNG and SVG to its figures/.

    ``out`` is report.html in the folder by default. The same study gives the same bytes. ``progress`` is called with
    the share done. Raises BvbError for a folder without results, a table or a file beside it that is damaged, a study
    without cells, and where nothing can be written.
    """
    folder = Path(folder)
    target = folder / "report.html" if out is None else Path(out)
    table = read_study(folder)
    if not table.rows:
        raise BvbError(f"{folder / RESULTS} has no cells. Run the study first.")
    plan, versions = _text_of(folder / "plan.toml"), _versions(folder / "versions.json")
    make_folder(folder / "figures")
    drawings, missing, files = [], [], []
    found = figures(table)
    for n, plot in enumerate(found):
        if isinstance(plot, Missing):
            missing.append(plot)
            continue
        drawing = drawn(plot.name, plot.title, plot.draw)
        drawings.append((plot, drawing))
        for suffix, data in ((".svg", drawing.svg.encode()), (".png", drawing.png)):
            files.append(folder / "figures" / f"{plot.name}{suffix}")
            with replacing(files[-1]) as stream:
                stream.write(data)
        if progress is not None:
            progress((n + 1) / len(found))
    text = _page(folder, table, drawings, missing, plan, versions)
    with replacing(target) as stream:
        stream.write(text.encode())
    return Report(target, tuple(files), tuple(missing), table)


def _page(
    folder: Path,
    table: Table,
    drawings: list[tuple[Plot, Drawing]],
    missing: list[Missing],
    plan: str | None,
    versions: Mapping[str, Any] | None,
) -> str:
    name = folder.resolve().name
    facts = [
        f"{len(table.materials)} materials by {len(table.configurations)} configurations: {len(table.done):,} cells "
        f"were measured, {len(table.failed)} failed. Scenes: {', '.join(table.scenes) or 'none'}.",
        "Errors are log-cosine RMS: the root mean square of the difference of log(1 + f cos θ_i cos θ_o), over two "
        "sets of pairs of directions (grid: even steps; nodes: as MERL's, mostly near the mirror direction), of which "
        "the larger counts; E_max and E_avg: the largest and the mean length of the RGB difference in 1/sr (Lee & Park "
        "2008, equation 7); and PAE and MAE: the largest and the mean difference of tone-mapped pictures, as shares of "
        "white.",
        "The paper is J.-H. Lee, H. Park, “B-spline Volume BRDF Representation and Application in Physically-based "
        "Rendering”, Transactions of the Society of CAD/CAM Engineers 13(6), 2008.",
        HOW_KNEE,
    ]
    widths = highlights(table)
    rows = [
        (material, label if material not in widths else class_of(widths[material]), widths.get(material))
        for label, names in groups(table).items()
        for material in names
    ]
    told = table_html(Numbers(("material", "class", "half-width of the highlight, degrees"), tuple(rows)))
    counts = ", ".join(f"{len(names)} {label}" for label, names in groups(table).items())
    tables = {
        "Classes of materials": (f"{counts}. {HOW}", folded("The materials", told)),
        "What a factor of two in error costs": (HALVING_WORDS, table_html(halving_numbers(class_clouds(table)))),
    }
    failed = tuple((row.material, row.configuration, row.reason) for row in table.failed)
    failures = table_html(Numbers(("material", "configuration", "reason"), failed)) if failed else "<p>None.</p>"
    meanings = tuple((c.name, c.unit or "–", c.meaning) for c in columns(table.scenes))
    sections = {
        f"Failed cells ({len(failed)})": failures,
        "Plan": "<p>There is no plan.toml.</p>" if plan is None else folded("plan.toml", f"<pre>{escape(plan)}</pre>"),
        "Versions": "<p>There is no versions.json.</p>"
        if versions is None
        else table_html(Numbers(("what", "version"), tuple(_flat(versions)))),
        "Columns of results.csv": folded("The columns", table_html(Numbers(("column", "unit", "meaning"), meanings))),
    }
    return page(f"Study “{name}”", facts, drawings, missing, tables, sections)


def _flat(versions: Mapping[str, Any], prefix: str = "") -> list[tuple[str, str]]:
    lines: list[tuple[str, str]] = []
    for name, value in versions.items():
        if isinstance(value, Mapping):
            lines += _flat(value, f"{prefix}{name}: ")
        else:
            lines.append((f"{prefix}{name}", value if isinstance(value, str) else json.dumps(value)))
    return lines


def _text_of(path: Path) -> str | None:
    if not path.exists():
        return None
    with reading(path) as stream:
        try:
            return stream.read().decode()
        except UnicodeDecodeError:
            raise BvbError(f"{path} is not UTF-8. Run the study again, or remove it.") from None


def _versions(path: Path) -> Mapping[str, Any] | None:
    text = _text_of(path)
    if text is None:
        return None
    try:
        found = json.loads(text)
    except (ValueError, RecursionError):
        found = None
    if not isinstance(found, dict):
        raise BvbError(f"{path} is no JSON object. Run the study again, or remove it.")
    return found
