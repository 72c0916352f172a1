"""A design that is compared: its figures, its workspace and its outline, for the worker to find."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property, lru_cache
from typing import TypeAlias

import numpy as np

from explorer.app.scene.bands import Shell
from explorer.errors import ExplorerError
from explorer.measures.case import MESH_TOLERANCE, Case
from explorer.measures.catalogue import measures_in
from explorer.measures.measurements import Measurements, measure_design
from explorer.measures.snapshot import evaluate
from explorer.mechanism.design import Design
from explorer.mechanism.home import home_pose
from explorer.numerics.arrays import FloatArray
from explorer.singularity.colours import Rgb
from explorer.workspace.solids.solid import Solid
from explorer.workspace.solids.solids import workspace_solid

Rows: TypeAlias = tuple[tuple[float, ...], ...]

# Designs whose figures and solids are kept: those compared, and what the last steps had.
KEPT = 8
NO_COLOUR: Rgb = (0, 0, 0)


@dataclass(frozen=True)
class ComparedRequest:
    """What to find of a design; lengths in design units.

    Attributes:
        design: The manipulator.
        drawn: Whether the workspace is drawn.
        rotation: Of the workspace that is drawn, rows of the matrix; None for that of home.
        tolerance: Of its mesh; None for a share of the reach.
    """

    design: Design
    drawn: bool = False
    rotation: Rows | None = None
    tolerance: float | None = None


@dataclass(frozen=True)
class ComparedDrawing:
    """What was found of a design.

    Attributes:
        request: What was asked for.
        figures: None if there is a problem.
        shell: The surface of its workspace, if that was asked for and is not empty.
        outline: Lines along base, legs and platform in the home pose, shape (n, 2, 3).
        problem: Why something is missing, for people; None if nothing is.
    """

    request: ComparedRequest
    figures: Measurements | None
    shell: Shell | None
    outline: FloatArray
    problem: str | None = None

    @cached_property
    def extent(self) -> FloatArray | None:
        """Lows and highs of the workspace that is drawn, shape (2, 3); None without one."""
        if self.shell is None:
            return None
        return np.array([self.shell.vertices.min(axis=0), self.shell.vertices.max(axis=0)])


def compared_drawing(request: ComparedRequest) -> ComparedDrawing:
    """Return the figures of a design, and its workspace if that is asked for."""
    design = request.design
    figures: Measurements | None = None
    shell: Shell | None = None
    problem: str | None = None
    try:
        figures = _figures(design)
        if request.drawn:
            solid = _solid(design, request.rotation, request.tolerance)
            if not solid.is_empty:
                shell = Shell(NO_COLOUR, solid.vertices, solid.faces)
    except ExplorerError as error:
        problem = str(error)
    return ComparedDrawing(request, figures, shell, outline_of(design), problem)


def outline_of(design: Design) -> FloatArray:
    """Return lines along base, legs and platform in the home pose, shape (n, 2, 3)."""
    snapshot = evaluate(design, home_pose(design))
    points = snapshot.points
    d1, d3 = float(snapshot.joints[1]), float(snapshot.joints[3])
    first, second = np.array([d1, 0.0, 0.0]), np.array([d3, 0.0, 0.0])
    # The guide as far as it is used.
    low, high = np.array([[min(0.0, d1, d3), 0.0, 0.0], [max(0.0, d1, d3), 0.0, 0.0]])
    base = ((low, high), (points.a1, points.a3), (high, points.a3))
    legs = (
        (points.a1, points.b1),
        (first, points.b2),
        (second, points.b3),
        (points.a3, points.b4),
    )
    corners = (points.b1, points.b2, points.b3, points.b4)
    platform = tuple((a, b) for index, a in enumerate(corners) for b in corners[index + 1 :])
    return np.array([*base, *legs, *platform])


@lru_cache(maxsize=KEPT)
def _figures(design: Design) -> Measurements:
    case = Case(design, mesh=_solid(design, None, None))
    return measure_design(case, measures_in("compare"))


@lru_cache(maxsize=KEPT)
def _solid(design: Design, rotation: Rows | None, tolerance: float | None) -> Solid:
    r = home_pose(design).rotation if rotation is None else np.array(rotation)
    return workspace_solid(design, r, tolerance or MESH_TOLERANCE * design.reach)
