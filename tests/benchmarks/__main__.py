"""Run the benchmarks: `python tests/benchmarks [--list] [--short] [NAME ...]`."""

from __future__ import annotations

import argparse
import importlib
import os
import platform
import re
import sys
import time
from collections.abc import Mapping
from datetime import date
from importlib.metadata import version
from pathlib import Path
from typing import Any

# Run as a folder, so the package and the project are made importable by their names.
TESTS = Path(__file__).resolve().parents[1]
sys.path[:1] = [str(folder) for folder in (TESTS, TESTS / "support", TESTS.parent)]

BENCHMARKS: Mapping[str, str] = {
    "forward": "the forward kinematics and the folds: a batch on one core, and one call",
    "controller": "the kernel in C, beside Newton on the six lengths of a hexapod",
    "workspace": "exact volume, solid, and the region that holds a load",
    "six_legged": "all numbers of a table on six legs, and its volume beside random positions",
    "slider": "from the arrival of a slider's event to the last message of the scene",
    "interference": "overlap of tetrahedra, clearances of the legs, moves, accessible workspace",
    "nearest": "nearest singular pose of all three incidences",
    "statics": "forces, bending, motions, errors and compliance in many poses",
    "optimise": "optimal designs: iterations, precision, time, random starts",
    "find": "machines that keep a need: the first, the smallest, beside differential evolution",
    "studies": "many designs: a second, on two workers; memory of a million",
    "planning": "lines in the folds and paths between random poses of one mode",
    "orientation": "shares of orientations, greatest tilts at a position and over many",
    "page": "a frame, and from the address to a page that has drawn all, over viser's",
    "first_minute": "the first searches on a machine that has never run the explorer",
    "commands": "wall time of a command, and of the report as HTML and as PDF",
}
"""Each benchmark, which is a module here, and what it measures, in the order of the table."""


def main() -> None:
    """Run what was asked for and print the table."""
    from benchmarks.table import Row, as_text

    parser = argparse.ArgumentParser(
        prog="python tests/benchmarks",
        description="Measure the explorer and print one table. No time is asserted.",
    )
    parser.add_argument("name", nargs="*", help="run only these, see --list (default: all)")
    parser.add_argument(
        "--short", action="store_true", help="see whether they run: few repeats of small tasks"
    )
    parser.add_argument("--list", action="store_true", help="list the names and leave")
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
        # Only now is what it needs imported.
        benchmark: Any = importlib.import_module(f"benchmarks.{name}")
        if options.short:
            # The sizes and repeats of a short round, by the names of the module's constants.
            for constant, value in benchmark.SHORT.items():
                setattr(benchmark, constant, value)
        rows += benchmark.run()
        sys.stderr.write(f"{name}: {time.monotonic() - start:.0f} s\n")
    print(f"{describe()}\n\n{as_text(rows)}")


def describe() -> str:
    """Return one line: processor, cores, versions and the day."""
    packages = ", ".join(f"{name} {version(name)}" for name in ("numpy", "numba", "viser"))
    return (
        f"{_processor()}, {os.cpu_count()} cores; {platform.system()}; "
        f"Python {platform.python_version()}, {packages}; {date.today().isoformat()}"
    )


def _processor() -> str:
    listing = Path("/proc/cpuinfo")
    if listing.exists():
        found = re.search(r"^model name\s*:\s*(.+)$", listing.read_text("utf-8"), re.MULTILINE)
        if found:
            return found[1].strip()
    return platform.processor() or platform.machine()


if __name__ == "__main__":
    main()
