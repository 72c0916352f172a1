"""Run the benchmarks: `python tests/benchmarks [--list] [--markdown] [NAME ...]`."""

from __future__ import annotations

import argparse
import sys
import time
from pathlib import Path

# Run as a folder, so the package and the project are made importable by their names.
TESTS = Path(__file__).resolve().parents[1]
sys.path[:1] = [str(folder) for folder in (TESTS, TESTS / "support", TESTS.parent)]


def main() -> None:
    """Run what was asked for and print the table."""
    from benchmarks.catalogue import BENCHMARKS, measure
    from benchmarks.machine import describe
    from benchmarks.table import Row, as_markdown, as_text

    parser = argparse.ArgumentParser(
        prog="python tests/benchmarks",
        description="Measure the explorer and print one table. No time is asserted.",
    )
    parser.add_argument("name", nargs="*", help="run only these, see --list (default: all)")
    parser.add_argument("--list", action="store_true", help="list the names and leave")
    parser.add_argument("--markdown", action="store_true", help="print the table as Markdown")
    options = parser.parse_args()
    names: list[str] = options.name or list(BENCHMARKS)
    unknown = [name for name in names if name not in BENCHMARKS]
    if unknown:
        parser.error(f"no benchmark {', '.join(unknown)}; there are {', '.join(BENCHMARKS)}")
    if options.list:
        width = max(map(len, BENCHMARKS))
        print("\n".join(f"{name:{width}}  {what}" for name, what in BENCHMARKS.items()))
        return
    rows: list[Row] = []
    for name in names:
        start = time.monotonic()
        rows += measure(name)
        sys.stderr.write(f"{name}: {time.monotonic() - start:.0f} s\n")
    render = as_markdown if options.markdown else as_text
    print(f"{describe()}\n\n{render(rows)}")


if __name__ == "__main__":
    main()
