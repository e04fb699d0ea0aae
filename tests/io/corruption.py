"""Damaged copies of a file, by a seed: what transmission, disks and malice do to bytes, headers above all."""

import struct
import sys
import tempfile
from collections import Counter
from collections.abc import Callable, Iterator
from pathlib import Path

import numpy as np

import bvbedit
from bvbedit import BvbError
from tests.brdf.samples import random_pairs
from tests.memory import peak_mb

# What a careless reader allocates, loops over or indexes with.
EXTREMES = (0, 1, 2**7, 2**8 - 1, 2**15, 2**16 - 1, 2**31 - 1, 2**31, 2**32 - 1, 2**62, 2**63 - 1, 2**63, 2**64 - 1)
# Where a format keeps its claims: at the start, and, in a zip archive, at the end.
HEAD = 600

Edit = tuple[int, bytes]


def corruptions(content: bytes, count: int, seed: int) -> Iterator[bytes | Edit]:
    """Yield ``count`` damaged versions of ``content``: either all their bytes, or (place, bytes to overwrite there).

    An edit in place lets a caller damage a large file without writing it anew.
    """
    rng = np.random.default_rng(seed)
    n = len(content)

    def place(length: int = 1) -> int:
        kind = rng.integers(3)
        low, high = ((0, min(HEAD, n)), (max(0, n - HEAD), n), (0, n))[kind]
        return int(rng.integers(low, max(low + 1, high - length)))

    def flip() -> Edit:
        at = place()
        return at, bytes([content[at] ^ (1 << int(rng.integers(8)))])

    def overwrite() -> Edit:
        at, length = place(64), int(rng.integers(1, 64))
        return at, rng.bytes(min(length, n - at))

    def zero() -> Edit:
        at, length = place(256), int(rng.integers(1, 256))
        return at, bytes(min(length, n - at))

    def extreme() -> Edit:
        at, width = place(8), int(rng.choice([1, 2, 4, 8]))
        value = int(rng.choice(np.array(EXTREMES, dtype=np.uint64))) % 2 ** (8 * width)
        return at, struct.pack("<Q", value)[:width][: n - at]

    def not_finite() -> Edit:
        at = place(8)
        value = rng.choice([np.nan, np.inf, -np.inf, 1e308, -1e308, 5e-324])
        return at, struct.pack(
            "<d" if rng.integers(2) else "<f", value if abs(value) < 1e30 else np.copysign(np.inf, value)
        )

    def truncated() -> bytes:
        return content[: int(rng.integers(0, n)) if rng.integers(2) else max(0, n - int(rng.integers(1, 100)))]

    def inserted() -> bytes:
        at = place()
        return content[:at] + rng.bytes(int(rng.integers(1, 40))) + content[at:]

    def removed() -> bytes:
        at = place()
        return content[:at] + content[at + int(rng.integers(1, 40)) :]

    def doubled() -> bytes:
        return content + content[place() :]

    in_place: list[Callable[[], Edit]] = [flip, overwrite, zero, extreme, not_finite]
    anew: list[Callable[[], bytes]] = [truncated, inserted, removed, doubled]
    for _ in range(count):
        # Twice as often in place: files of the right length get further into a reader.
        kinds: list[Callable[[], bytes | Edit]] = in_place if rng.integers(3) else anew  # type: ignore[assignment]
        yield kinds[int(rng.integers(len(kinds)))]()


def survey(content: bytes, suffix: str, count: int, seed: int) -> Counter[str]:
    """Return how many of ``count`` damaged versions of a file were refused, harmless, or neither (which is a defect).

    Refused: one line of BvbError that names the file. Harmless: a BRDF whose values are finite and not negative.
    """
    outcomes: Counter[str] = Counter()
    wi, wo = random_pairs(np.random.default_rng(1), 200)
    with tempfile.TemporaryDirectory() as folder:
        whole, part = Path(folder) / f"whole{suffix}", Path(folder) / f"part{suffix}"
        whole.write_bytes(content)
        for damaged in corruptions(content, count, seed):
            if isinstance(damaged, bytes):
                part.write_bytes(damaged)
                outcomes[outcome(part, wi, wo)] += 1
                continue
            at, new = damaged
            with whole.open("r+b") as stream:
                stream.seek(at)
                stream.write(new)
            outcomes[outcome(whole, wi, wo)] += 1
            with whole.open("r+b") as stream:
                stream.seek(at)
                stream.write(content[at : at + len(new)])
                stream.truncate(len(content))
    return outcomes


def outcome(path: Path, wi: np.ndarray, wo: np.ndarray) -> str:
    """Return what loading and evaluating the file does: refused, harmless, or a description of the defect."""
    try:
        with np.errstate(all="ignore"):
            f = bvbedit.load(path).evaluate(wi, wo)
    except BvbError as error:
        text = str(error)
        return "refused" if "\n" not in text and str(path) in text else f"refused badly: {text!r}"
    except Exception as error:
        return f"{type(error).__name__}: {error}"
    return "harmless" if np.isfinite(f).all() and (f >= 0).all() else "values that are negative or not finite"


def main() -> None:
    """Survey the file SUFFIX COUNT SEED on standard input; print the outcomes and this process' peak memory in MB."""
    import json

    suffix, count, seed = sys.argv[1], int(sys.argv[2]), int(sys.argv[3])
    outcomes = survey(sys.stdin.buffer.read(), suffix, count, seed)
    print(json.dumps({"outcomes": outcomes, "peak_mb": peak_mb()}))


if __name__ == "__main__":
    main()
