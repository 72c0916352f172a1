"""`explorer screenshot`: a picture of a pose, drawn by a headless browser."""

from __future__ import annotations

import contextlib
import io
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Literal

from explorer.cli.options import DesignOptions, JsonOptions, PoseOptions
from explorer.cli.values import pixels
from explorer.errors import InputError


@dataclass(frozen=True, kw_only=True)
class Screenshot(JsonOptions, PoseOptions, DesignOptions):
    """Draw a pose into a PNG file.

    Writes the path of the file to standard output. Needs the extra "screenshot" and a
    Chromium, which EXPLORER_CHROMIUM may name.
    """

    view: Literal["isometric", "front", "side", "top"] = "isometric"
    """Direction of the view."""

    out: Path = Path("shot.png")
    """File to write, .png; an existing one is replaced."""

    size: Annotated[tuple[int, int], pixels("--size", 64, 8192)] = (1280, 800)
    """Size of the picture in pixels."""

    panels: bool = False
    """Include the panels of the page in the picture."""

    handle: bool = False
    """Include the handle by which the page moves the platform."""

    def run(self) -> None:
        """Draw the picture and write its path."""
        from explorer.files.writing import check_writable

        if self.out.suffix.lower() != ".png":
            raise InputError(f"--out must end in .png; got {str(self.out)!r}")
        check_writable(self.out)
        design = self.read_design()
        pose = self.pose(design)
        from explorer.app.screenshot import take

        # Standard output belongs to the answer; viser reports there when a server stops.
        with contextlib.redirect_stdout(io.StringIO()):
            take(
                design,
                pose,
                view=self.view,
                out=self.out,
                size=self.size,
                panels=self.panels,
                handle=self.handle,
            )
        self.write(lambda: {"file": self.out, "size": self.size}, lambda: [str(self.out)])
