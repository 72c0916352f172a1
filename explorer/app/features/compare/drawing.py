"""The worker's task for comparing: measure a design, and draw its workspace and outline."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property, lru_cache

import numpy as np

from explorer.app.features.workspace.regions import Rows
from explorer.app.scene.bands import Shell
from explorer.app.scene.outline import outline
from explorer.errors import ExplorerError
from explorer.measures.case import Case
from explorer.measures.catalogue import measures_in
from explorer.measures.measurements import Measurements, measure_design
from explorer.measures.snapshot import evaluate
from explorer.mechanism.design import Design
from explorer.mechanism.tool_point import Point, offset_of
from explorer.numerics.arrays import FloatArray
from explorer.singularity.colours import Rgb
from explorer.workspace.solids.solid import Solid
from explorer.workspace.solids.solids import workspace_solid

# Number of cached measurements and solids: of the compared designs, and of the last changes.
CACHED = 8
# Chord tolerance of a mesh without one of its own, as a share of the reach.
MESH_TOLERANCE = 0.004
NO_COLOUR: Rgb = (0, 0, 0)


@dataclass(frozen=True)
class ComparedRequest:
    """Request to measure and draw a design; lengths in design units.

    Attributes:
        design: The manipulator.
        drawn: Whether the workspace is drawn.
        rotation: Rotation of the drawn workspace, rows of the matrix; None for the home pose.
        tolerance: Chord tolerance of its mesh; None for a share of the reach.
    """

    design: Design
    drawn: bool = False
    rotation: Rows | None = None
    tolerance: float | None = None


@dataclass(frozen=True)
class ComparedDrawing:
    """A design measured and drawn; lengths in design units.

    Attributes:
        request: The request.
        measurements: Values of the measures; None if they could not be computed.
        shell: Surface of the workspace; None if it was not requested or is empty.
        outline: Lines along base, legs and platform in the home pose, shape (n, 2, 3).
        problem: Why something is missing; None if nothing is.
    """

    request: ComparedRequest
    measurements: Measurements | None
    shell: Shell | None
    outline: FloatArray
    problem: str | None = None

    def offset(self, at: Point) -> FloatArray:
        """Return the vector from b4 to a point in the orientation of the drawing, shape (3,)."""
        design, rows = self.request.design, self.request.rotation
        rotation = design.home_pose.rotation if rows is None else np.array(rows)
        return offset_of(design, rotation, at)

    @cached_property
    def extent(self) -> FloatArray | None:
        """The lows and highs of the drawn workspace, shape (2, 3); None without one."""
        if self.shell is None:
            return None
        return np.array([self.shell.vertices.min(axis=0), self.shell.vertices.max(axis=0)])


def compared_drawing(request: ComparedRequest) -> ComparedDrawing:
    """Return the measurements of a design, and its workspace if requested."""
    design = request.design
    measurements: Measurements | None = None
    shell: Shell | None = None
    problem: str | None = None
    try:
        measurements = _measure(design)
        if request.drawn:
            solid = _solid(design, request.rotation, request.tolerance)
            if not solid.is_empty:
                shell = Shell(NO_COLOUR, solid.vertices, solid.faces)
    except ExplorerError as error:
        problem = str(error)
    return ComparedDrawing(
        request, measurements, shell, outline(evaluate(design, design.home_pose)), problem
    )


@lru_cache(maxsize=CACHED)
def _measure(design: Design) -> Measurements:
    return measure_design(Case(design), measures_in("compare"))


@lru_cache(maxsize=CACHED)
def _solid(design: Design, rotation: Rows | None, tolerance: float | None) -> Solid:
    r = design.home_pose.rotation if rotation is None else np.array(rotation)
    return workspace_solid(design, r, tolerance or MESH_TOLERANCE * design.reach)
