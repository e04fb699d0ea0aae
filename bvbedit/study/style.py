"""How plots look, and their SVG and PNG: the same bytes for the same data, and readable in print and by all eyes.

matplotlib's figures without pyplot, which keeps figures alive and asks for a screen.
"""

import io
import re
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

# Okabe & Ito (2008), Color Universal Design, in an order in which neighbours differ in brightness too. Their yellow is
# left out: nobody sees thin lines of it on white.
PALETTE = ("#0072b2", "#e69f00", "#009e73", "#d55e00", "#56b4e9", "#cc79a7", "#000000")
# Colours repeat after seven, markers after eight: together after 56.
MARKERS = ("o", "s", "^", "v", "D", "P", "X", "<")
GREY = "#767676"
# Inches: the two columns of a page.
WIDTH = 7.1
DPI = 200
SETTINGS: dict[str, Any] = {
    "font.family": ["DejaVu Sans"],
    "font.size": 8.0,
    "axes.titlesize": 8.5,
    "axes.labelsize": 8.0,
    "axes.linewidth": 0.6,
    "axes.axisbelow": True,
    "axes.grid": True,
    "grid.color": "#e3e3e3",
    "grid.linewidth": 0.5,
    "xtick.labelsize": 7.0,
    "ytick.labelsize": 7.0,
    "xtick.major.width": 0.6,
    "ytick.major.width": 0.6,
    "xtick.minor.width": 0.4,
    "ytick.minor.width": 0.4,
    "xtick.minor.size": 1.5,
    "ytick.minor.size": 1.5,
    "legend.fontsize": 7.0,
    "legend.frameon": False,
    "lines.linewidth": 1.2,
    "lines.markersize": 4.0,
    "svg.fonttype": "path",
    "figure.constrained_layout.h_pad": 0.04,
    "figure.constrained_layout.w_pad": 0.04,
}


@dataclass(frozen=True)
class Drawing:
    """A plot as files hold it."""

    svg: str
    """A whole SVG file."""
    png: bytes

    @property
    def inline(self) -> str:
        """The SVG element alone, for a page that holds others: its width follows the page."""
        body = self.svg[self.svg.index("<svg") :]
        head, rest = body.split(">", 1)
        width = re.search(r' width="([\d.]+)pt"', head)
        head = re.sub(r' (width|height)="[^"]*"', "", head)
        return f'{head} style="width:100%;max-width:{float(width[1]) * 4 / 3 if width else 700:.0f}px">{rest}'.strip()


def drawn(name: str, title: str, draw: Callable[[], "Figure"]) -> Drawing:
    """Return what ``draw`` draws, whatever the user's settings of matplotlib are.

    ``name`` sets the names inside the SVG apart from those of other figures; ``title`` is for who does not see it.
    """
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.backends.backend_svg import FigureCanvasSVG

    with _settings(name):
        figure = draw()
        png, svg = io.BytesIO(), io.StringIO()
        nothing = {"Date": None, "Creator": None, "Format": None, "Type": None}
        FigureCanvasSVG(figure).print_figure(svg, format="svg", metadata=nothing)
        # What was laid out stays: doing it again would take half of the time.
        figure.set_layout_engine("none")
        FigureCanvasAgg(figure).print_figure(png, format="png", dpi=DPI, metadata={"Software": None})
    return Drawing(_told_apart(svg.getvalue(), name, title), png.getvalue())


@contextmanager
def _settings(salt: str) -> Iterator[None]:
    import matplotlib

    with matplotlib.rc_context():
        # A user's backend is not ours to change, and choosing one loads pyplot.
        kept: dict[Any, Any] = {k: v for k, v in matplotlib.rcParamsDefault.items() if not k.startswith("backend")}
        matplotlib.rcParams.update(kept | SETTINGS | {"svg.hashsalt": salt})
        yield


def _told_apart(svg: str, name: str, title: str) -> str:
    """Return ``svg`` whose names begin with ``name``, for two figures of a page may not share any, and with a title."""
    from html import escape

    svg = re.sub(r' id="([^"]+)"', rf' id="{name}-\1"', svg)
    svg = re.sub(r'((?:xlink:)?href)="#([^"]+)"', rf'\1="#{name}-\2"', svg)
    svg = re.sub(r"url\(#([^)]+)\)", rf"url(#{name}-\1)", svg)
    # A hundredth of a point is not seen, and more digits are a third of the bytes.
    svg = re.sub(r"(?<![\w.#])(-?[1-9]\d*\.\d{3,})(?![\w.])", lambda m: f"{float(m[1]):.2f}", svg)
    end = svg.index(">", svg.index("<svg")) + 1
    lines = re.sub(r"[ \t]+\n", "\n", svg[end:])
    return f'{svg[: end - 1]} role="img">\n <title>{escape(title)}</title>{lines}'


def panels(
    count: int, columns: int, height: float, *, width: float = WIDTH, share: bool = True
) -> tuple["Figure", list["Axes"]]:
    """Return a figure of ``count`` panels, ``columns`` beside one another, each of ``height`` inches."""
    from matplotlib.figure import Figure

    columns = min(count, columns)
    rows = -(-count // columns)
    figure = Figure(figsize=(width, rows * height), layout="constrained")
    grid = figure.subplots(rows, columns, sharex=share, sharey=share, squeeze=False)
    axes = list(grid.ravel())
    for spare in axes[count:]:
        spare.remove()
    if share:
        # The last row may be short: what stands above a gap needs numbers of its own.
        for lone in axes[max(0, count - columns) : count]:
            lone.xaxis.set_tick_params(which="both", labelbottom=True)
    return figure, axes[:count]


def legend(figure: "Figure", handles: Sequence[Any], columns: int = 5) -> None:
    """Put a legend below all panels of ``figure``."""
    if handles:
        figure.legend(handles=list(handles), loc="outside lower center", ncols=min(columns, len(handles)))


def looks(names: Sequence[str]) -> dict[str, tuple[str, str]]:
    """Return a colour and a marker for each of ``names``: no two the same below 56."""
    return {name: (PALETTE[i % len(PALETTE)], MARKERS[i % len(MARKERS)]) for i, name in enumerate(names)}


def pretty(text: str) -> str:
    """Return ``text`` with subscripts where it has E_max and its like, and with no other mathematics in it."""
    text = text.replace("$", r"\$")
    return re.sub(r"\b([ER])_(max|avg)\b", r"$\1_\\mathrm{\2}$", text)


def log_axis(axis: Any, low: float, high: float, *, minor: bool = True) -> None:
    """Make ``axis`` logarithmic, its numbers plain: powers of ten, and 2 and 5 where less than two decades are shown.

    ``low`` and ``high`` are the ends of the data. ``minor`` ticks take most of the time of small panels.
    """
    from matplotlib.ticker import FuncFormatter, LogLocator, MaxNLocator, NullFormatter, NullLocator

    name = "x" if axis.axis_name == "x" else "y"
    getattr(axis.axes, f"set_{name}scale")("log")
    if high / low < 3:
        # Logarithmic steps are even enough here for round numbers that are.
        axis.set_major_locator(MaxNLocator(nbins=5, steps=[1, 2, 2.5, 5, 10]))
        axis.set_minor_locator(NullLocator())
        axis.set_major_formatter(FuncFormatter(lambda value, _: plain(value)))
        return
    narrow = high / low < 100
    axis.set_major_locator(LogLocator(subs=(1.0, 2.0, 5.0) if narrow else (1.0,), numticks=9))
    axis.set_major_formatter(FuncFormatter(lambda value, _: plain(value)))
    axis.set_minor_formatter(NullFormatter())
    if not minor:
        axis.set_minor_locator(NullLocator())


def plain(value: float) -> str:
    """Return ``value`` as a label: plain from 0.001 to 9,999, as a power of ten beyond."""
    if value == 0 or 0.9e-3 <= abs(value) < 1e4:
        return f"{value:,.0f}" if abs(value) >= 1000 else f"{value:.3g}"
    mantissa, exponent = f"{value:.0e}".split("e")
    power = f"10^{{{int(exponent)}}}"
    return f"${power}$" if mantissa == "1" else rf"${mantissa}\!\cdot\!{power}$"
