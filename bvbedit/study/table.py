"""The table of a study: one row per cell, which is one material by one configuration; and its file, results.csv."""

import csv
import io
import os
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import asdict, dataclass, replace
from typing import Any

from bvbedit.errors import BvbError
from bvbedit.io.files import as_path, reading
from bvbedit.study.columns import Column, columns_of, count, number, text

RESULTS = "results.csv"
AXES = r"\d{1,6}x\d{1,6}x\d{1,6}"


@dataclass(frozen=True)
class Picture:
    """What a scene shows of a cell's model, beside the picture of the measurement with the same random numbers."""

    scene: str
    mae: float | None = number(
        "share of white", "mean error of the tone-mapped picture, over pixels and channels", high=1.0
    )
    pae: float | None = number(
        "share of white", "largest error of the tone-mapped picture, over pixels and channels", high=1.0
    )
    psnr: float | None = number("dB", "peak signal to noise ratio of the tone-mapped picture", infinite=True)
    seconds: float | None = number("s", "time to render the picture", is_time=True)


@dataclass(frozen=True, kw_only=True)
class Row:
    """One cell: a material, a configuration, and what was measured; None where it does not apply or is unknown."""

    material: str = text("name of the material", required=True)
    configuration: str = text("name of the configuration", required=True)
    series: str = text("configurations of one series differ by size or bytes only", required=True)
    kind: str = text("spline, or analytic model", required=True, choices=("spline", "analytic"))
    chart: str | None = text("chart of the model as it was made")
    encoding: str | None = text("encoding of the model as it was made")
    knots: str | None = text("placement of the knots")
    precision: str | None = text("how control points are stored")
    degrees: str | None = text("degrees along the axes", form=AXES)
    size: str | None = text("control points along the axes", form=AXES)
    status: str = text("done, or failed", required=True, choices=("done", "failed"))
    reason: str | None = text("why it failed, in one line")
    numbers: int | None = count("", "stored numbers: 3 per control point and interior knots; or parameters")
    file_bytes: int | None = count("bytes", "of the .bvb file; 4 per parameter of an analytic model", low=1.0)
    payload_bytes: int | None = count(
        "bytes", "of net and interior knots; 4 per parameter of an analytic model", low=1.0
    )
    condition: float | None = number("", "condition of the fit, estimated", infinite=True)
    grid_log_cosine_rms: float | None = number("", "root mean square of the difference of log(1 + f c c), over grid")
    grid_fores: float | None = number("", "cube root metric (Fores et al. 2012), over grid")
    grid_relative_l1: float | None = number("", "sum of errors by sum of values, over grid", infinite=True)
    nodes_log_cosine_rms: float | None = number("", "root mean square of the difference of log(1 + f c c), over nodes")
    nodes_fores: float | None = number("", "cube root metric (Fores et al. 2012), over nodes")
    nodes_relative_l1: float | None = number("", "sum of errors by sum of values, over nodes", infinite=True)
    e_max: float | None = number("1/sr", "largest length of the RGB error (Lee & Park 2008, equation 7)")
    e_avg: float | None = number("1/sr", "mean length of the RGB error")
    e_max_45: float | None = number("1/sr", "largest length of the RGB error at theta_i = 45 degrees")
    e_avg_45: float | None = number("1/sr", "mean length of the RGB error at theta_i = 45 degrees")
    r_max: float | None = number("1/sr", "largest length of the material's own RGB vector over the same nodes")
    r_avg: float | None = number("1/sr", "mean length of the material's own RGB vector over the same nodes")
    highlight: float | None = number("degrees", "half-width of the material's highlight; 90 where it has none")
    albedo_error: float | None = number("", "largest difference of directional albedo over elevations and channels")
    fit_seconds: float | None = number("s", "time to fit", is_time=True)
    evaluations_per_second: float | None = number(
        "1/s", "evaluations of the model for pairs of directions", is_time=True
    )
    pictures: tuple[Picture, ...] = ()
    """One for each scene of which anything is known."""

    @property
    def done(self) -> bool:
        """Whether there is something measured."""
        return self.status == "done"

    @property
    def axes(self) -> tuple[int, int, int] | None:
        """Control points along each axis."""
        if self.size is None:
            return None
        a, b, c = (int(n) for n in self.size.split("x"))
        return a, b, c

    def picture(self, scene: str) -> Picture | None:
        """Return what ``scene`` shows of it, if it is known."""
        return next((p for p in self.pictures if p.scene == scene), None)

    def to_dict(self) -> dict[str, Any]:
        """Return the values by the names of their columns, those of the scenes last."""
        told = asdict(replace(self, pictures=()))
        del told["pictures"]
        return told | {f"{p.scene}_{c.name}": getattr(p, c.name) for p in self.pictures for c in PICTURE_COLUMNS}

    @staticmethod
    def of(values: Mapping[str, Any], scenes: Sequence[str] = ()) -> "Row":
        """Return the row of ``values`` by the names of their columns; what is missing is unknown.

        Raises BvbError for an unknown column, and a value that its column does not allow.
        """
        known = {column.name for column in columns(scenes)}
        for name in values:
            if name not in known:
                raise BvbError(f"A study's table has no column {name!r}. Leave it out.")
        return _row({c.name: _checked(c, values.get(c.name)) for c in columns(scenes)}, scenes)


@dataclass(frozen=True)
class Table:
    """All rows of a study, and its scenes; materials, configurations and series in the order of their first row."""

    rows: tuple[Row, ...]
    scenes: tuple[str, ...] = ()

    @property
    def materials(self) -> tuple[str, ...]:
        """The names of the materials."""
        return tuple(dict.fromkeys(row.material for row in self.rows))

    @property
    def configurations(self) -> tuple[str, ...]:
        """The names of the configurations."""
        return tuple(dict.fromkeys(row.configuration for row in self.rows))

    @property
    def done(self) -> tuple[Row, ...]:
        """The rows with something measured."""
        return tuple(row for row in self.rows if row.done)

    @property
    def failed(self) -> tuple[Row, ...]:
        """The rows with a reason in place of figures."""
        return tuple(row for row in self.rows if not row.done)


ROW_COLUMNS = columns_of(Row)
PICTURE_COLUMNS = columns_of(Picture)
# The columns that differ from run to run; each scene has one more, see times().
TIMES = tuple(column.name for column in ROW_COLUMNS if column.is_time)


def columns(scenes: Iterable[str] = ()) -> tuple[Column, ...]:
    """Return all columns in the order of the file: those of a cell, its pictures' errors, and times last."""
    seen = [replace(c, name=f"{s}_{c.name}", meaning=f"{s}: {c.meaning}") for s in scenes for c in PICTURE_COLUMNS]
    every = [*ROW_COLUMNS, *seen]
    return (*(c for c in every if not c.is_time), *(c for c in every if c.is_time))


def times(scenes: Iterable[str] = ()) -> tuple[str, ...]:
    """Return the names of the columns that differ from run to run."""
    return tuple(column.name for column in columns(scenes) if column.is_time)


def to_csv(rows: Iterable[Row], scenes: Sequence[str] | None = None) -> str:
    """Return ``rows`` as the text of results.csv: the same rows give the same bytes.

    ``scenes`` are by default those of the rows, in the order in which they first appear. Raises BvbError for a value
    that its column does not allow.
    """
    rows = list(rows)
    if scenes is None:
        scenes = list(dict.fromkeys(picture.scene for row in rows for picture in row.pictures))
    made = columns(scenes)
    stream = io.StringIO()
    writer = csv.writer(stream, lineterminator="\n")
    writer.writerow([column.name for column in made])
    for row in rows:
        values = row.to_dict()
        writer.writerow([_written(column, values.get(column.name)) for column in made])
    return stream.getvalue()


def read_table(path: str | os.PathLike[str]) -> Table:
    """Return the table in the file ``path``; its columns may stand in any order.

    Raises BvbError, with line and column, for a missing, unknown or doubled column, a value that its column does not
    allow, a line that is too short or too long, a failed cell without a reason, and a cell that is there twice.
    """
    with reading(path) as stream:
        data = stream.read()
    try:
        lines = io.StringIO(data.decode("utf-8-sig"), newline="")
    except UnicodeDecodeError as error:
        line = data.count(b"\n", 0, error.start) + 1
        raise BvbError(f"{path}, line {line}: not UTF-8. Write the table again.") from None
    reader = csv.reader(lines, strict=True)
    try:
        header = next(reader, None)
        if not header:
            raise BvbError(f"{path} is empty. Run the study again.")
        scenes = _scenes(path, header)
        by_name = {column.name: column for column in columns(scenes)}
        made = [by_name[name] for name in header]
        rows: list[Row] = []
        seen: dict[tuple[str, str], int] = {}
        for values in reader:
            rows.append(_read(f"{path}, line {reader.line_num}", values, made, scenes))
            cell = rows[-1].material, rows[-1].configuration
            if cell in seen:
                raise BvbError(
                    f"{path}, line {reader.line_num}, column 'configuration': {cell[1]!r} of {cell[0]!r} stands in "
                    f"line {seen[cell]} too. Remove one of them."
                )
            seen[cell] = reader.line_num
    except csv.Error as error:
        raise BvbError(f"{path}, line {reader.line_num}: {error}. Write the table again.") from None
    return Table(tuple(rows), scenes)


def read_study(folder: str | os.PathLike[str]) -> Table:
    """Return the table of the study in ``folder``. Raises BvbError where there is none, and as read_table does."""
    path = as_path(folder) / RESULTS
    if not path.exists():
        raise BvbError(f"{folder} holds no study: there is no {path}. Run bvbedit study first, with --out {folder}.")
    return read_table(path)


def _scenes(path: str | os.PathLike[str], header: Sequence[str]) -> tuple[str, ...]:
    """Return the scenes that the names of the columns tell of."""
    fixed = {column.name for column in ROW_COLUMNS}
    suffixes = [f"_{column.name}" for column in PICTURE_COLUMNS]
    scenes: dict[str, None] = {}
    for name in header:
        if header.count(name) > 1:
            raise BvbError(f"{path}, line 1: column {name!r} is there twice. Remove one of them.")
        if name in fixed:
            continue
        suffix = next((s for s in suffixes if name.endswith(s) and name != s), None)
        if suffix is None:
            raise BvbError(f"{path}, line 1: column {name[:60]!r} is unknown. Remove it.")
        scenes[name.removesuffix(suffix)] = None
    for column in columns(scenes):
        if column.name not in header:
            raise BvbError(f"{path}, line 1: column {column.name!r} is missing. Run the study again.")
    return tuple(scenes)


def _read(where: str, values: Sequence[str], made: Sequence[Column], scenes: Sequence[str]) -> Row:
    if len(values) != len(made):
        place = made[min(len(values), len(made) - 1)].name
        raise BvbError(f"{where}, column {place!r}: {len(values)} values for {len(made)} columns. Mend the line.")
    read = {}
    for column, value in zip(made, values, strict=True):
        try:
            read[column.name] = column.read(value)
        except ValueError as error:
            raise BvbError(f"{where}, column {column.name!r}: {error}. Mend the value.") from None
    row = _row(read, scenes)
    if not row.done and row.reason is None:
        raise BvbError(f"{where}, column 'reason': is empty. Say why the cell failed.")
    return row


def _row(values: Mapping[str, Any], scenes: Sequence[str]) -> Row:
    seen = {s: {c.name: values[f"{s}_{c.name}"] for c in PICTURE_COLUMNS} for s in scenes}
    pictures = tuple(Picture(s, **found) for s, found in seen.items() if any(v is not None for v in found.values()))
    return Row(**{c.name: values[c.name] for c in ROW_COLUMNS}, pictures=pictures)


def _checked(column: Column, value: Any) -> Any:
    try:
        return column.checked(value)
    except (ValueError, TypeError, OverflowError) as error:
        raise BvbError(f"Column {column.name!r}: {error}. Give what the column is for.") from None


def _written(column: Column, value: Any) -> str:
    try:
        return column.written(value)
    except (ValueError, TypeError, OverflowError) as error:
        raise BvbError(f"Column {column.name!r}: {error}. Give what the column is for.") from None
