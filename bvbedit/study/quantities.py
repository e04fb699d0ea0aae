"""What is drawn and compared: a quantity of a cell with its label, unit and the column or columns it is taken from."""

from collections.abc import Callable
from dataclasses import dataclass

from bvbedit.study.table import Row

# Errors below these are drawn as these, for logarithms have no zero: half a step of 8 bits, and what nobody sees.
SMALLEST_PICTURE_ERROR = 0.5 / 255
SMALLEST_ERROR = 1e-6


@dataclass(frozen=True)
class Quantity:
    """Something that a cell has one value of."""

    name: str
    """For names of files and keys."""
    label: str
    unit: str
    value: Callable[[Row], float | None]
    """The value in a cell; None where it is unknown, or the cell failed."""
    floor: float = 0.0
    """Smaller values are drawn as this."""

    def floored(self, row: Row) -> float | None:
        """Return the value as it is drawn on a logarithmic axis."""
        value = self.value(row)
        return None if value is None else max(value, self.floor)

    @property
    def axis(self) -> str:
        """The label of an axis."""
        return f"{self.label} ({self.unit})" if self.unit else self.label


def column(name: str, label: str, unit: str = "", floor: float = 0.0) -> Quantity:
    """Return the quantity that a column of a cell itself holds."""
    return Quantity(name, label, unit, lambda row: _finite(getattr(row, name)) if row.done else None, floor)


def picture(scene: str, name: str, label: str, unit: str = "", floor: float = 0.0) -> Quantity:
    """Return the quantity that a column of a scene holds: mae, pae, psnr or seconds."""

    def value(row: Row) -> float | None:
        seen = row.picture(scene) if row.done else None
        return None if seen is None else _finite(getattr(seen, name))

    return Quantity(f"{scene}_{name}", label, unit, value, floor)


def mae(scene: str) -> Quantity:
    """Return the mean error of a scene's picture."""
    return picture(scene, "mae", f"MAE, {scene}", "share of white", SMALLEST_PICTURE_ERROR / 100)


def pae(scene: str) -> Quantity:
    """Return the largest error of a scene's picture."""
    return picture(scene, "pae", f"PAE, {scene}", "share of white", SMALLEST_PICTURE_ERROR)


def render_seconds(scene: str) -> Quantity:
    """Return how long a scene's picture takes."""
    return picture(scene, "seconds", f"render time, {scene}", "s")


def _finite(value: float | None) -> float | None:
    return value if value is not None and abs(value) < float("inf") else None


def _error(row: Row) -> float | None:
    errors = (row.grid_log_cosine_rms, row.nodes_log_cosine_rms)
    if not row.done or errors[0] is None or errors[1] is None:
        return None
    return max(errors[0], errors[1])


def _nanoseconds(row: Row) -> float | None:
    return 1e9 / row.evaluations_per_second if row.done and row.evaluations_per_second else None


ERROR = Quantity("error", "log-cosine RMS, larger of grid and nodes", "", _error, SMALLEST_ERROR)
BYTES = column("file_bytes", "file", "bytes")
PAYLOAD = column("payload_bytes", "net and knots", "bytes")
EVALUATION = Quantity("evaluation", "evaluation", "ns", _nanoseconds)
E_MAX = column("e_max", "E_max", "1/sr")
E_AVG = column("e_avg", "E_avg", "1/sr")
E_MAX_45 = column("e_max_45", "E_max at 45°", "1/sr")
E_AVG_45 = column("e_avg_45", "E_avg at 45°", "1/sr")
R_MAX = column("r_max", "R_max", "1/sr")
R_AVG = column("r_avg", "R_avg", "1/sr")
