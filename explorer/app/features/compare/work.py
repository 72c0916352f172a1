"""The compared designs: a part of the state, the worker's measurements and drawings, and feeds.

Each column has a feed of its own, so that a slider requests the live design alone. Nothing is
requested while there is nothing to compare.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache, partial
from typing import TypeAlias

import numpy as np

from explorer.app.features.workspace.work import LIVE_TOLERANCE
from explorer.app.scene.placing import outline
from explorer.app.scene.surfaces import Shell
from explorer.app.session.feed import Feed, FeedOf
from explorer.app.state.frame import Frame
from explorer.app.state.geometry import without_name
from explorer.app.state.parts import FeaturePart
from explorer.app.state.state import State
from explorer.errors import ExplorerError
from explorer.measures.catalogue import MeasureValues, measure_design, measures_in
from explorer.measures.measure import Case
from explorer.measures.snapshot import evaluate
from explorer.mechanism.configuration import Point, offset_of
from explorer.mechanism.design import Design
from explorer.mechanism.rgb import Rgb
from explorer.numerics.arrays import FloatArray
from explorer.six_legged.case import TableCase
from explorer.six_legged.files import made_equal
from explorer.six_legged.table import SixLegged
from explorer.workspace.solids.solids import whole_solid

SLOTS = ("A", "B", "C")
"""Names of the places for pinned designs."""

Pinned: TypeAlias = tuple[Design | None, Design | None, Design | None]
Tables: TypeAlias = tuple[SixLegged | None, SixLegged | None, SixLegged | None]
Comparable: TypeAlias = Design | SixLegged


@dataclass(frozen=True)
class CompareView:
    """How designs are compared.

    Attributes:
        overlay: Whether their workspaces are drawn over one another.
        outlines: Whether the pinned ones are drawn as lines.
        equal: Whether tables have the strokes and cones of the live design.
    """

    overlay: bool = False
    outlines: bool = False
    equal: bool = False


@dataclass(frozen=True)
class Compared(FeaturePart, name="compared"):
    """The designs and tables on six legs that the live design is compared with, and how.

    Copies are pinned in the order of `SLOTS`: a place has a design, a table or neither.
    """

    pinned: Pinned = (None, None, None)
    look: CompareView = CompareView()
    tables: Tables = (None, None, None)

    @property
    def places(self) -> tuple[Comparable | None, ...]:
        """What is pinned in each place, a design or a table."""
        return tuple(a or b for a, b in zip(self.pinned, self.tables, strict=True))

    @property
    def is_empty(self) -> bool:
        """Whether nothing is pinned."""
        return not any(self.places)

    def slot_of(self, design: Comparable) -> int | None:
        """Return the index of the place of a design under any name; None if it is not pinned."""
        plain = without_name(design)
        slots = (i for i, each in enumerate(self.places) if each and without_name(each) == plain)
        return next(slots, None)


LIVE, NAMES = 0, ("live", *SLOTS)
"""The column of the live design, and the short names of all columns."""

# Number of cases that are kept: of the compared designs, and of the last changes.
CACHED = 8
NO_COLOUR: Rgb = (0, 0, 0)


@dataclass(frozen=True)
class ComparedRequest:
    """Request to measure a design or a table, and to draw its workspace; lengths in its units.

    Only that of a design is drawn. The chord tolerance of its mesh is a share of the reach if None.
    """

    design: Comparable
    drawn: bool = False
    tolerance: float | None = None


@dataclass(frozen=True, eq=False)
class ComparedDrawing:
    """A design measured and drawn; lengths in design units, the outline of shape (n, 2, 3).

    The measurements are None if they could not be computed, the shell if no workspace was
    requested or it is empty. The problem says why something is missing.
    """

    request: ComparedRequest
    measurements: MeasureValues | None
    shell: Shell | None
    outline: FloatArray
    problem: str | None = None

    def offset(self, at: Point) -> FloatArray:
        """Return the vector from b4 to a point in the orientation of home, shape (3,)."""
        design = self.request.design
        if isinstance(design, SixLegged):
            return np.zeros(3)
        return offset_of(design, design.home_pose.rotation, at)


def draw_compared(request: ComparedRequest) -> ComparedDrawing:
    """Return the measurements of a design, and its workspace if requested."""
    design = request.design
    measurements: MeasureValues | None = None
    shell: Shell | None = None
    problem: str | None = None
    try:
        if isinstance(design, SixLegged):
            measurements = _kept_table(design).measurements
        else:
            case, tolerance = _kept_case(design), request.tolerance
            measurements = measure_design(case, measures_in("compare"))
            if request.drawn:
                solid = whole_solid(case.workspace, tolerance or LIVE_TOLERANCE * design.reach)
                if not solid.is_empty:
                    shell = Shell(NO_COLOUR, solid.vertices, solid.faces)
    except ExplorerError as error:
        problem = str(error)
    lines = (
        _table_lines(design)
        if isinstance(design, SixLegged)
        else outline(evaluate(design, design.home_pose))
    )
    return ComparedDrawing(request, measurements, shell, lines, problem)


def _table_lines(table: SixLegged) -> FloatArray:
    """Return the legs of a table at home, and rings about base and platform, shape (n, 2, 3)."""
    ends = table.home_poses.ends
    rings = np.stack([ends, np.roll(ends, -1, axis=0)], axis=2)
    return np.concatenate([ends, *np.moveaxis(rings, 1, 0)])


_kept_case = lru_cache(maxsize=CACHED)(Case)
"""The case of a design, with all that has been computed of it."""
_kept_table = lru_cache(maxsize=CACHED)(TableCase)
_equal_table = lru_cache(maxsize=CACHED)(made_equal)


CompareFeed: TypeAlias = Feed[ComparedRequest, ComparedDrawing]


def _compared_request(column: int, frame: Frame) -> ComparedRequest | None:
    state, compared = frame.state, Compared.of(frame.state)
    design = design_in(column, state)
    if compared.is_empty or design is None:
        return None
    if not compared.look.overlay:
        return ComparedRequest(without_name(design))
    tolerance = state.view.workspace.tolerance
    if tolerance is not None:
        # The tolerance in millimetres is that of the live design.
        tolerance /= unit_ratio(design, state.design)
    return ComparedRequest(without_name(design), drawn=True, tolerance=tolerance)


FEEDS = tuple(
    FeedOf(draw_compared, partial(_compared_request, column), key=("compared", column))
    for column in range(len(NAMES))
)
"""The feeds by column: the live design, then the pinned ones."""


def design_in(column: int, state: State) -> Comparable | None:
    """Return the design or table of a column as it is measured; None if nothing is there."""
    compared = Compared.of(state)
    design = (state.design, *compared.places)[column]
    is_equal = compared.look.equal and isinstance(design, SixLegged)
    return _equal_table(design, state.design) if is_equal else design


def drawing_in(column: int, feed: CompareFeed) -> ComparedDrawing | None:
    """Return the drawing of a column; of a pinned one only if the design is the same."""
    drawing, request = feed.drawing, feed.request
    if drawing is None or request is None:
        return None
    return drawing if column == LIVE or drawing.request.design == request.design else None


def unit_ratio(design: Comparable, live: Design) -> float:
    """Return one unit of a design in units of the live design."""
    return design.unit_mm / live.unit_mm
