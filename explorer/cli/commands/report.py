"""`explorer report`: a report of a design as HTML or PDF."""

from __future__ import annotations

import time
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import tyro

from explorer.cli.options import DesignOptions, JsonOptions, PoseOptions
from explorer.cli.output import write_json, write_lines
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

    record: Annotated[
        Path | None, tyro.conf.arg(metavar="FILE", help_behavior_hint="(optional)")
    ] = None
    """Record of the search that found the design, written by `explorer optimise`."""

    def run(self) -> None:
        """Write the report and its path.

        Raises:
            InputError: a design, pose, record or file that cannot be used.
            MissingExtraError: PDF without the extra "screenshot" or a Chromium.
        """
        from explorer.files.writing import check_writable, write_whole

        start = time.monotonic()
        file_format = format_of(self.out)
        check_writable(self.out)
        design = self.load()
        pose = self.pose(design)
        record = None
        if self.record is not None:
            from explorer.optimise.record import load_record

            record = load_record(self.record)
        from explorer.app.features.sharing.reporting import make_report

        data = make_report(design, pose, record=record, file_format=file_format)
        write_whole(self.out, data)
        if self.json:
            write_json(
                {
                    "out": str(self.out),
                    "format": file_format,
                    "bytes": len(data),
                    "seconds": time.monotonic() - start,
                }
            )
        else:
            write_lines(str(self.out))


def format_of(path: Path) -> ReportFormat:
    """Return the format that the suffix of a file names.

    Raises:
        InputError: the suffix is not .html, .htm or .pdf.
    """
    match path.suffix.lower():
        case ".html" | ".htm":
            return "html"
        case ".pdf":
            return "pdf"
        case _:
            raise InputError(f"--out must end in .html or .pdf; got {str(path)!r}")
