"""`explorer serve`, `report` and `screenshot`: the page, a report, and a picture of a pose."""

from __future__ import annotations

import contextlib
import io
import os
import time
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Literal

import tyro

from explorer.cli import values
from explorer.cli.options import JsonOptions, PoseOptions, load
from explorer.cli.output import attributes
from explorer.errors import InputError
from explorer.files.writing import check_writable, write_whole
from explorer.find.requirement import load_requirement
from explorer.optimise.outcome import load_record

FORMATS: dict[str, Literal["html", "pdf"]] = {".html": "html", ".htm": "html", ".pdf": "pdf"}


@dataclass(frozen=True, kw_only=True)
class ServeCommand:
    """Serve the explorer's page and open it in the browser (the default)."""

    design: Annotated[str | None, tyro.conf.arg(metavar=values.DESIGN_NAME)] = None
    """A preset, a design file (JSON), or the name of a design saved on the page; by default the
    last session."""

    host: str = "127.0.0.1"
    """Address to listen on; the default is for this machine alone."""

    port: Annotated[int, values.whole_number(0, 65535)] = 8080
    """Port to listen on; 0 takes any free port, a port in use is an error."""

    token: str | None = None
    """Access token of 16 to 128 letters, digits, - and _; by default that of the environment
    variable EXPLORER_TOKEN, else a random one if other machines can connect."""

    allow_host: Annotated[tuple[str, ...], values.hint("none", "NAME …")] = ()
    """Names of hosts by which a proxy passes requests on, such as lab.example.org; a token is
    then needed."""

    study: Annotated[tuple[Path, ...], values.hint("optional", "FOLDER …")] = ()
    """Results of explorer sweep to list on the page, beside the studies run there."""

    open: bool = True
    """Open the browser."""

    def run(self) -> None:
        """Serve the page until interrupted."""
        design = None if self.design is None else load(self.design)
        from explorer.app.features.studies.folders import check_given
        from explorer.app.server import serve

        check_given(self.study)

        # Other users of this machine see arguments, but not the environment.
        token = os.environ.get("EXPLORER_TOKEN") if self.token is None else self.token
        serve(
            design,
            host=self.host,
            port=self.port,
            token=token,
            allow_hosts=self.allow_host,
            open_browser=self.open,
            studies=self.study,
        )


@dataclass(frozen=True, kw_only=True)
class ReportCommand(JsonOptions, PoseOptions):
    """Write a report of a design: drawings, slices, tables, and how to reproduce it.

    The figures are those of the other commands, in the home pose unless a pose is given. HTML
    is one file that needs no other file and no network; PDF is the same page and needs the extra
    "screenshot" and a Chromium, which EXPLORER_CHROMIUM may name.
    """

    out: Path = Path("report.html")
    """File to write, .html or .pdf; an existing one is replaced."""

    record: Annotated[Path | None, values.FILE] = None
    """Record of the search that found the design, written by `explorer optimise`."""

    requirement: Annotated[Path | None, values.FILE] = None
    """Requirement file (JSON) that the design is checked against."""

    def run(self) -> None:
        """Write the report and its path."""
        start = time.monotonic()
        file_format = FORMATS.get(self.out.suffix.lower())
        if file_format is None:
            raise InputError(f"--out must end in .html or .pdf; got {str(self.out)!r}")
        check_writable(self.out)
        design = self.read_design()
        pose = self.pose(design)
        record = None if self.record is None else load_record(self.record)
        from explorer.app.features.sharing.reporting import make_report

        needed = None if self.requirement is None else load_requirement(self.requirement)
        data = make_report(design, pose, record, file_format, requirement=needed)
        write_whole(self.out, data)
        facts = {"format": file_format, "bytes": len(data), "seconds": time.monotonic() - start}
        self.write(lambda: {"out": self.out, **facts}, [str(self.out)])


@dataclass(frozen=True, kw_only=True)
class ScreenshotCommand(JsonOptions, PoseOptions):
    """Draw a pose into a PNG file.

    Writes the path of the file to standard output. Needs the extra "screenshot" and a
    Chromium, which EXPLORER_CHROMIUM may name.
    """

    view: Literal["isometric", "front", "side", "top"] = "isometric"
    """Direction of the view."""

    out: Path = Path("shot.png")
    """File to write, .png; an existing one is replaced."""

    size: Annotated[values.Pixels, values.hint("default: 1280x800")] = (1280, 800)
    """Size of the picture in pixels."""

    panels: bool = False
    """Include the panels of the page in the picture."""

    handle: bool = False
    """Include the handle by which the page moves the platform."""

    def run(self) -> None:
        """Draw the picture and write its path."""
        if self.out.suffix.lower() != ".png":
            raise InputError(f"--out must end in .png; got {str(self.out)!r}")
        check_writable(self.out)
        design = self.read_design()
        pose = self.pose(design)
        from explorer.app.screenshot import take

        # Standard output belongs to the answer; viser reports there when a server stops.
        with contextlib.redirect_stdout(io.StringIO()):
            take(design, pose, **attributes(self, "view out size panels handle"))
        self.write(lambda: {"file": self.out, "size": self.size}, [str(self.out)])
