"""`explorer report`: a report of a design as HTML or PDF."""

from __future__ import annotations

import time
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

from explorer.cli.options import DesignOptions, JsonOptions, PoseOptions
from explorer.cli.values import FILE
from explorer.errors import InputError

if TYPE_CHECKING:
    from explorer.app.features.sharing.reporting import ReportFormat


@dataclass(frozen=True, kw_only=True)
class Report(JsonOptions, PoseOptions, DesignOptions):
    """Write a report of a design: drawings, slices, tables, and how to reproduce it.

    The figures are those of the other commands, in the home pose unless a pose is given. HTML
    is one file that needs no other file and no network; PDF is the same page and needs the extra
    "screenshot" and a Chromium, which EXPLORER_CHROMIUM may name.
    """

    out: Path = Path("report.html")
    """File to write, .html or .pdf; an existing one is replaced."""

    record: Annotated[Path | None, FILE] = None
    """Record of the search that found the design, written by `explorer optimise`."""

    def run(self) -> None:
        """Write the report and its path."""
        from explorer.files.writing import check_writable, write_whole

        start = time.monotonic()
        file_format = format_of(self.out)
        check_writable(self.out)
        design = self.read_design()
        pose = self.pose(design)
        record = None
        if self.record is not None:
            from explorer.optimise.record import load_record

            record = load_record(self.record)
        from explorer.app.features.sharing.reporting import make_report

        data = make_report(design, pose, record=record, file_format=file_format)
        write_whole(self.out, data)
        facts = {"format": file_format, "bytes": len(data), "seconds": time.monotonic() - start}
        self.write(lambda: {"out": self.out, **facts}, lambda: [str(self.out)])


def format_of(path: Path) -> ReportFormat:
    """Return the format that the suffix of a file names."""
    formats: dict[str, ReportFormat] = {".html": "html", ".htm": "html", ".pdf": "pdf"}
    if path.suffix.lower() not in formats:
        raise InputError(f"--out must end in .html or .pdf; got {str(path)!r}")
    return formats[path.suffix.lower()]
