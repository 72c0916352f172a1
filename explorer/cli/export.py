"""`explorer export`: the workspace as a mesh file."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Literal

import tyro

from explorer.cli.options import DesignOptions, JsonOptions, OrientationOptions
from explorer.cli.output import write_json, write_lines
from explorer.cli.values import positive
from explorer.errors import InputError


@dataclass(frozen=True, kw_only=True)
class Export(JsonOptions, OrientationOptions, DesignOptions):
    """Write the workspace, or its convex hull, as a mesh for other programs.

    Coordinates are those of the base frame in millimetres; GLB is in metres, as it must be.
    """

    what: Annotated[Literal["workspace", "hull"], tyro.conf.Positional]
    """What to write."""

    out: Path
    """The file to write; an existing one is replaced."""

    format: Annotated[
        str | None,
        tyro.conf.arg(
            metavar="3mf|stl|glb|obj|ply",
            help_behavior_hint="(default: the suffix of the file)",
        ),
    ] = None
    """The format: 3mf holds unit, names and colours, ply and obj double precision."""

    tolerance: Annotated[
        float | None,
        positive("--tolerance"),
        tyro.conf.arg(help_behavior_hint="(default: a 500th of the reach)"),
    ] = None
    """Largest distance of the mesh from the true surface, in design units."""

    def run(self) -> None:
        """Write the file, and what is in it.

        Raises:
            InputError: a design, orientation, format or file that cannot be used.
            NoAnswerError: the workspace is empty.
        """
        from explorer.export.files import check_writable
        from explorer.export.mesh import check_format, write_mesh

        file_format = self.format or self.out.suffix.lower().removeprefix(".")
        if not file_format:
            raise InputError(
                f"--out {str(self.out)!r} has no suffix to tell the format: give --format"
            )
        check_format(file_format)
        check_writable(self.out)
        design = self.load()
        rotation = self.oriented(design).rotation
        from explorer.solids import convex_hull, workspace_solid

        solid = workspace_solid(design, rotation, self.tolerance)
        if self.what == "hull":
            solid = convex_hull(solid)
        write_mesh(solid, self.out, file_format, design, f"{self.what} of {design.name}")
        if self.json:
            write_json(
                {
                    "file": str(self.out),
                    "format": file_format,
                    "volume": solid.volume,
                    "triangles": len(solid.faces),
                }
            )
        else:
            write_lines(str(self.out))
