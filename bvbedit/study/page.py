"""The page of a report: HTML that holds all it shows, so that it can be sent, archived and read without a network."""

from collections.abc import Mapping, Sequence
from html import escape

from bvbedit.study.plots import Cell, Missing, Numbers, Plot
from bvbedit.study.style import Drawing

CSS = """
body { font: 16px/1.5 "DejaVu Sans", Verdana, sans-serif; color: #111; background: #fff; max-width: 62rem;
       margin: 2rem auto; padding: 0 1rem; }
h1 { font-size: 1.6rem; } h2 { font-size: 1.25rem; margin-top: 2.5rem; border-bottom: 1px solid #bbb; }
nav ul { columns: 2; column-gap: 2rem; font-size: .85rem; padding: 0; list-style: none; } a { color: #0072b2; }
figure { margin: 2rem 0; break-inside: avoid; } figure svg { display: block; height: auto; margin: 0 auto; }
figcaption { font-size: .9rem; margin-top: .5rem; } figcaption b { display: block; }
details { margin: .5rem 0; font-size: .8rem; } summary { cursor: pointer; color: #0072b2; }
.wide { overflow-x: auto; }
table { border-collapse: collapse; font-size: .78rem; line-height: 1.35; }
th, td { padding: .15rem .6rem; border-bottom: 1px solid #ddd; text-align: right; vertical-align: top; }
th { border-bottom: 1px solid #111; vertical-align: bottom; } .text { text-align: left; }
figure td { white-space: nowrap; }
pre { font-size: .8rem; background: #f5f5f5; padding: .8rem; overflow-x: auto; }
@media print { body { max-width: none; margin: 0; font-size: 10pt; } nav { display: none; } }
"""


def number_text(value: Cell) -> str:
    """Return ``value`` as a cell of a table has it: from 1000 up whole with commas, below with four digits."""
    if value is None:
        return "–"
    if isinstance(value, str):
        return value
    if isinstance(value, int):
        return f"{value:,}"
    if 1000 <= abs(value) < 1e9:
        return f"{value:,.0f}".replace("-", "−")
    return f"{value:.4g}".replace("-", "−")


def table_html(numbers: Numbers) -> str:
    """Return ``numbers`` as an HTML table; columns of texts are aligned to the left."""
    texts = [
        any(isinstance(row[i], str) for row in numbers.rows) or not numbers.rows for i in range(len(numbers.header))
    ]
    kinds = [' class="text"' if text else "" for text in texts]
    head = "".join(f"<th{k}>{escape(name)}</th>" for k, name in zip(kinds, numbers.header, strict=True))
    body = "\n".join(
        "<tr>" + "".join(f"<td{k}>{escape(number_text(v))}</td>" for k, v in zip(kinds, row, strict=True)) + "</tr>"
        for row in numbers.rows
    )
    return f'<div class="wide"><table><thead><tr>{head}</tr></thead><tbody>\n{body}\n</tbody></table></div>'


def folded(summary: str, inner: str) -> str:
    """Return ``inner`` HTML behind a line to click on."""
    return f"<details><summary>{escape(summary)}</summary>\n{inner}\n</details>"


def figure_html(number: int, plot: Plot, drawing: Drawing) -> str:
    """Return a figure with its caption and the numbers behind it."""
    numbers = plot.numbers
    summary = f"The numbers behind it ({len(numbers.rows)} rows; figures/{plot.name}.svg, .png)"
    return (
        f'<figure id="{escape(plot.name)}">\n{drawing.inline}\n'
        f"<figcaption><b>Figure {number}. {escape(plot.title)}.</b> {escape(plot.words)}</figcaption>\n"
        f"{folded(summary, table_html(numbers))}\n</figure>"
    )


def page(
    title: str,
    facts: Sequence[str],
    drawings: Sequence[tuple[Plot, Drawing]],
    missing: Sequence[Missing],
    tables: Mapping[str, tuple[str, str]],
    sections: Mapping[str, str],
) -> str:
    """Return the page.

    ``facts``: sentences at the top. ``tables``: by heading, words and HTML that come before the figures. ``sections``:
    by heading, HTML that comes after them.
    """
    headings = [*tables, "Figures", *sections]
    marks = {heading: f"part-{i}" for i, heading in enumerate(headings)}
    links = [f'<li><a href="#{marks[h]}">{escape(h)}</a></li>' for h in headings]
    links[len(tables) + 1 : len(tables) + 1] = [
        f'<li><a href="#{escape(plot.name)}">{escape(plot.title)}</a></li>' for plot, _ in drawings
    ]

    def head(heading: str) -> str:
        return f'<h2 id="{marks[heading]}">{escape(heading)}</h2>'

    parts = [
        f"<h1>{escape(title)}</h1>",
        *(f"<p>{escape(fact)}</p>" for fact in facts),
        f"<nav><ul>{''.join(links)}</ul></nav>",
        *(f"{head(h)}\n<p>{escape(words)}</p>\n{inner}" for h, (words, inner) in tables.items()),
        head("Figures"),
        *(figure_html(i, plot, drawing) for i, (plot, drawing) in enumerate(drawings, 1)),
    ]
    if missing:
        lines = "".join(f"<li>{escape(m.title)}: {escape(m.why)}.</li>" for m in missing)
        parts.append(f"<p>Not drawn:</p><ul>{lines}</ul>")
    parts += [f"{head(h)}\n{inner}" for h, inner in sections.items()]
    return (
        '<!DOCTYPE html>\n<html lang="en">\n<head>\n<meta charset="utf-8">\n'
        '<meta name="viewport" content="width=device-width, initial-scale=1">\n'
        f"<title>{escape(title)}</title>\n<style>{CSS}</style>\n</head>\n<body>\n"
        + "\n".join(parts)
        + "\n</body>\n</html>\n"
    )
