"""`explorer screenshot`: a picture of a pose, drawn by a headless browser."""

from __future__ import annotations

import contextlib
import io
import tempfile
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Literal

from explorer.cli.options import DesignOptions, JsonOptions, PoseOptions
from explorer.cli.output import write_json, write_lines
from explorer.cli.values import pixels
from explorer.errors import InputError


@dataclass(frozen=True, kw_only=True)
class Screenshot(JsonOptions, PoseOptions, DesignOptions):
    """Draw a pose into a PNG file.

    Writes the path of the file to standard output. Needs the extra "screenshot" and a
    Chromium, which EXPLORER_CHROMIUM may name.
    """

    view: Literal["isometric", "front", "side", "top"] = "isometric"
    """From where to look."""

    out: Path = Path("shot.png")
    """The file to write; an existing one is replaced."""

    size: Annotated[tuple[int, int], pixels("--size", 64, 8192)] = (1280, 800)
    """Size of the picture in pixels."""

    panels: bool = False
    """Whether the panels of the page are in the picture, or the scene alone."""

    def run(self) -> None:
        """Draw the picture and write its path.

        Raises:
            InputError: a design, pose or file that cannot be used.
            MissingExtraError: what draws the picture is not installed.
        """
        check_writable(self.out)
        design = self.load()
        pose = self.pose(design)
        from explorer.app.screenshot import take

        # Standard output belongs to the answer; viser reports there when a server stops.
        with contextlib.redirect_stdout(io.StringIO()):
            take(design, pose, view=self.view, out=self.out, size=self.size, panels=self.panels)
        if self.json:
            write_json({"file": str(self.out), "size": list(self.size)})
        else:
            write_lines(str(self.out))


def check_writable(path: Path) -> None:
    """Find out before the work whether the picture can be written.

    Raises:
        InputError: another suffix than .png, no such folder, or one that takes no file.
    """
    if path.suffix.lower() != ".png":
        raise InputError(f"--out must end in .png; got {str(path)!r}")
    if path.is_dir():
        raise InputError(f"--out must be a file; {str(path)!r} is a folder")
    folder = path.parent
    if not folder.is_dir():
        raise InputError(f"--out: there is no folder {str(folder)!r}; make it first")
    try:
        # Permission bits tell less than trying: superusers and read-only disks.
        with path.open("r+b") if path.exists() else tempfile.TemporaryFile(dir=folder):
            pass
    except OSError as error:
        raise InputError(f"--out: cannot write {str(path)!r}: {error.strerror}") from None
