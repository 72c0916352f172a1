"""Wall time of commands beside bare Python, and of the report beside the commands it replaces."""

from __future__ import annotations

import statistics
import sys
import tempfile
from collections.abc import Iterator
from pathlib import Path

import msgspec

from benchmarks.samples import DESIGN
from benchmarks.table import Row, seconds
from benchmarks.timing import EXPLORER, best_of, elapsed, run_to_end
from explorer.app.features.sharing.reporting import make_report
from explorer.mechanism.design_file import encode_design
from explorer.workspace.accessible.radii import with_radius

RUNS, REPORTS = 9, 3
SHORT = {"RUNS": 1, "REPORTS": 1}
POSE = ("--position", "10", "5", "9", "--yaw-pitch-roll", "-73", "0", "0")
# What tells the same figures, one by one, and one picture.
SINGLE = (
    ("workspace", "--hull"),
    ("singularity",),
    ("interference",),
    ("export", "mechanism", "--out", "parts.zip"),
    ("screenshot", "--out", "picture.png"),
)


def run() -> Iterator[Row]:
    """Yield rows of a command, of the import and of reports."""
    command = _median(*EXPLORER, "inverse", "--json", *POSE)
    imported = _median(sys.executable, "-c", "import explorer")
    numpy = _median(sys.executable, "-c", "import numpy")
    bare = _median(sys.executable, "-c", "pass")
    yield Row(
        f"explorer inverse --json, median of {RUNS}",
        seconds(command),
        beside=f"python -c 'import numpy': {seconds(numpy)}",
    )
    yield Row(
        f"python -c 'import explorer', median of {RUNS}",
        seconds(imported),
        beside=f"python -c pass: {seconds(bare)}",
    )
    yield from _reports()


def _median(*command: str) -> float:
    run_to_end(*command)
    return statistics.median(elapsed(lambda: run_to_end(*command)) for _ in range(RUNS))


def _reports() -> Iterator[Row]:
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        thick = folder / "thick.json"
        design = msgspec.structs.replace(with_radius(DESIGN, 0.2), name="thick")
        thick.write_bytes(encode_design(design))
        single = sum(elapsed(lambda words=words: _command(folder, *words)) for words in SINGLE)
        for what, options in (
            ("report.html", ()),
            ("report.pdf", ()),
            ("thick.pdf", ("--design", str(thick))),
        ):
            out = folder / what
            argv = ("report", "--out", str(out), *options)
            _command(folder, *argv)
            took = statistics.median(
                elapsed(lambda a=argv: _command(folder, *a)) for _ in range(REPORTS)
            )
            legs = ", legs of radius 0.2" if options else ""
            size = out.stat().st_size / 1000.0
            yield Row(
                f"explorer report as {out.suffix[1:]}{legs}, median of {REPORTS}",
                f"{seconds(took)}, {size:.0f} kB",
                "10 s",
                f"{len(SINGLE)} commands that tell the same, and one picture: {seconds(single)}",
            )
    yield Row(
        "the report as HTML within a running process",
        seconds(best_of(REPORTS, lambda: make_report(DESIGN))),
    )


def _command(folder: Path, *words: str) -> None:
    argv = [str(folder / word) if word.endswith((".zip", ".png")) else word for word in words]
    run_to_end(*EXPLORER, *argv)
