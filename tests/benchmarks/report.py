"""The report of a design, from the command to the file; beside the commands that it replaces."""

from __future__ import annotations

import statistics
import tempfile
from collections.abc import Iterator
from pathlib import Path

import msgspec

from benchmarks.processes import EXPLORER, run_to_end
from benchmarks.samples import DESIGN
from benchmarks.table import Row, seconds
from benchmarks.timing import best_of, elapsed
from explorer.app.features.sharing.reporting import make_report
from explorer.mechanism.design_file import encode_design
from explorer.workspace.accessible.radii import with_radius

RUNS = 3
# What tells the same figures, one by one, and one picture.
SINGLE = (
    ("workspace", "--hull"),
    ("singularity",),
    ("interference",),
    ("export", "mechanism", "--out", "parts.zip"),
    ("screenshot", "--out", "picture.png"),
)


def run() -> Iterator[Row]:
    """Yield the rows."""
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
                elapsed(lambda a=argv: _command(folder, *a)) for _ in range(RUNS)
            )
            legs = ", legs of radius 0.2" if options else ""
            size = out.stat().st_size / 1000.0
            yield Row(
                f"explorer report as {out.suffix[1:]}{legs}, median of {RUNS}",
                f"{seconds(took)}, {size:.0f} kB",
                "10 s",
                f"{len(SINGLE)} commands that tell the same, and one picture: {seconds(single)}",
            )
    yield Row(
        "the report as HTML within a running process",
        seconds(best_of(RUNS, lambda: make_report(DESIGN))),
    )


def _command(folder: Path, *words: str) -> None:
    argv = [str(folder / word) if word.endswith((".zip", ".png")) else word for word in words]
    run_to_end(*EXPLORER, *argv)
