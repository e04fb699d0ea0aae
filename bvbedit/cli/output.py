"""What commands print: a short table for people or one JSON object, and progress on standard error."""

import json
import math
import sys
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from typing import Any


def report(result: Mapping[str, Any], as_json: bool) -> None:
    """Print ``result`` on standard output: one JSON object, or a table of its entries, nested ones flattened."""
    if as_json:
        print(json.dumps(_plain(result), allow_nan=False))
        return
    rows = list(_flatten(result))
    width = max(len(name) for name, _ in rows)
    for name, value in rows:
        print(f"{name:<{width}}  {value}")


def _flatten(result: Mapping[str, Any], prefix: str = "") -> Iterator[tuple[str, str]]:
    for name, value in result.items():
        label = f"{prefix}{name.replace('_', ' ')}"
        if isinstance(value, Mapping):
            yield from _flatten(value, f"{label}: ")
        elif isinstance(value, list | tuple) and any(isinstance(v, Mapping) for v in value):
            for v in value:
                yield label, ", ".join(f"{k} {text}" for k, text in _flatten(v))
        elif isinstance(value, list | tuple):
            separator = "; " if any(isinstance(v, str) for v in value) else " x " if "size" in name else ", "
            yield label, separator.join(_text(v) for v in value) or "none"
        else:
            yield label, _text(value)


def _text(value: Any) -> str:
    if value is None:
        return "-"
    if isinstance(value, bool):
        return "yes" if value else "no"
    if isinstance(value, int):
        return f"{value:,}"
    if isinstance(value, float):
        return f"{value:.4g}"
    return str(value)


def _plain(value: Any) -> Any:
    """Turn mappings, sequences, numpy's scalars and paths into what JSON knows; infinity and nan become null."""
    if isinstance(value, Mapping):
        return {str(k): _plain(v) for k, v in value.items()}
    if hasattr(value, "tolist"):
        value = value.tolist()
    if isinstance(value, list | tuple):
        return [_plain(v) for v in value]
    if isinstance(value, float):
        return value if math.isfinite(value) else None
    return value if value is None or isinstance(value, str | int) else str(value)


@contextmanager
def progress(label: str) -> Iterator[Callable[[float], None] | None]:
    """Yield a function that takes the share done and draws a bar on standard error, or None where nobody watches."""
    if not sys.stderr.isatty():
        yield None
        return
    from rich.console import Console
    from rich.progress import BarColumn, Progress, TextColumn, TimeRemainingColumn

    columns = (
        TextColumn("{task.description}"),
        BarColumn(),
        TextColumn("{task.percentage:>3.0f} %"),
        TimeRemainingColumn(),
    )
    with Progress(*columns, console=Console(stderr=True), transient=True) as bar:
        task = bar.add_task(label, total=1.0)
        yield lambda share: bar.update(task, completed=share)
