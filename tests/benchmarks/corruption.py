"""2,000 damaged files of each format: python -m tests.benchmarks.corruption [COUNT [SEED]]."""

import json
import subprocess
import sys
from time import perf_counter

from rich.console import Console
from rich.table import Table

from tests.io import files

LIMIT_MB = 1024


def main() -> None:
    given = [int(a) for a in sys.argv[1:]]
    count, seed = (given + [2000, 1][len(given) :])[:2]
    table = Table("format", "files", "refused", "harmless", "defects", "peak MB", "s per file")
    bad = False
    for suffix, make in ((".bvb", files.bvb), (".binary", files.merl), (".bsdf", files.bsdf)):
        start = perf_counter()
        command = [sys.executable, "-m", "tests.io.corruption", suffix, str(count), str(seed)]
        told = json.loads(subprocess.run(command, input=make(), capture_output=True, check=True).stdout)
        seconds = perf_counter() - start
        outcomes = told["outcomes"]
        refused, harmless = outcomes.pop("refused", 0), outcomes.pop("harmless", 0)
        bad |= bool(outcomes) or told["peak_mb"] > LIMIT_MB
        numbers = (count, refused, harmless, outcomes or 0, f"{told['peak_mb']:.0f}", f"{seconds / count:.4f}")
        table.add_row(suffix, *map(str, numbers))
    Console().print(table)
    sys.exit(bad)


if __name__ == "__main__":
    main()
