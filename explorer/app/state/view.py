"""The settings of what is shown of the mechanism, and how."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Literal

from explorer.app.state.parts import LENGTHS
from explorer.errors import InputError
from explorer.measures.box import PositionSet
from explorer.mechanism.configuration import Point
from explorer.mechanism.design import Design
from explorer.mechanism.pose import Triple
from explorer.numerics.checks import STIFFEST, numbers, positive
from explorer.numerics.number_text import UNITS, Unit, format_apart, format_number

ALUMINIUM = 2700.0
"""Density of aluminium, in kg/m³."""


@dataclass(frozen=True)
class WorkspaceView:
    """How the constant-orientation workspace is shown.

    Attributes:
        region: Whether the solid is all that is within the limits, its accessible part alone, or
            the part that holds the load.
        start: Whether the accessible part starts at the home position, or at the present one.
        planes: Whether the planes of singular positions, up to three, are drawn.
        orientation: Whether the orientation is that of the present pose, or of the home pose.
        cut: The axis along which it is cut open, or None.
        level: The coordinate at which it is cut, in design units; None for the middle of its
            extent, which also counts where this is beyond it.
        flipped: Whether the cut keeps the side that faces the isometric camera.
        tolerance: Largest distance of a facet from the true surface, in design units; None
            for a share of the reach.
    """

    solid: bool = False
    region: Literal["limits", "accessible", "held"] = "limits"
    start: Literal["home", "pose"] = "home"
    hull: bool = False
    planes: bool = False
    orientation: Literal["pose", "home"] = "pose"
    colour: Literal[
        "plain", "margin", "condition", "share", "force", "bending", "error", "deflection"
    ] = "plain"
    cut: Literal["x", "y", "z"] | None = None
    level: float | None = field(default=None, metadata=LENGTHS)
    flipped: bool = False
    tolerance: float | None = field(default=None, metadata=LENGTHS)


@dataclass(frozen=True)
class PrototypeView:
    """How the prototype is shown.

    Attributes:
        exploded: How far the exploded view moves the parts apart, 0 to 1.
        density: Density of all parts, in kg/m³.

    Raises:
        InputError: A share beyond 0 to 1, or a density that is not positive.
    """

    exploded: float = 0.0
    density: float = ALUMINIUM

    def __post_init__(self) -> None:
        if not 0.0 <= self.exploded <= 1.0:
            low, high, got = format_apart((0.0, 1.0, self.exploded), 4, format_number)
            raise InputError(f"the exploded view takes {low} to {high}; got {got}")
        positive("the density, in kg/m³,", self.density)


Weighed = Literal["none", "payload", "payload and legs"]


@dataclass(frozen=True)
class ForcesView:
    """The load besides the payload, and how forces are shown.

    Attributes:
        force: Force at the tool, along the axes of the base, in N.
        moment: Moment on the platform, along the axes of the base, in N m.
        scale: Force whose arrow is as long as the reach, in N.

    Raises:
        InputError: A number that is not finite or exceeds 1e6, or a scale that is not positive.
    """

    shown: bool = False
    force: Triple = (0.0, 0.0, 0.0)
    moment: Triple = (0.0, 0.0, 0.0)
    weighed: Weighed = "payload"
    scale: float = 20.0

    def __post_init__(self) -> None:
        numbers("the force, in N,", self.force, 3)
        numbers("the moment, in N m,", self.moment, 3)
        positive("the force whose arrow is as long as the reach, in N,", self.scale, STIFFEST)


@dataclass(frozen=True)
class PrecisionView:
    """How errors and the deflection are shown, and what is wanted of the tolerances.

    Attributes:
        ellipsoid: Whether the ellipsoid of the tool's RMS error is drawn.
        deflected: Whether the mechanism is drawn as the load deflects it.
        times: Magnification of the drawn deflection; None for one that suits it.
        over: Positions of the budget: the present one, the box of the design, or the workspace.
        wanted: Largest displacement of the tool that the tolerances may cause, in mm; None for a
            ranking of the tolerances as they are.
        wanted_turn: Largest turn of the tool likewise, in degrees; None for any.

    Raises:
        InputError: A magnification or a wanted precision that is not positive.
    """

    ellipsoid: bool = False
    deflected: bool = False
    times: float | None = None
    budget: bool = False
    over: PositionSet = "pose"
    wanted: float | None = None
    wanted_turn: float | None = None
    keep_actuators: bool = False

    def __post_init__(self) -> None:
        for name, value in (
            ("magnification", self.times),
            ("wanted displacement", self.wanted),
            ("wanted turn", self.wanted_turn),
        ):
            if value is not None:
                positive(f"the {name}", value, STIFFEST)


LengthName = Literal["mm", "design units"]
Coordinates = Literal["position", "lengths", "folds"]
DrawnAs = Literal["schematic", "prototype", "6-4 twin"]
Ghost = Literal["none", "δ1 = 0", "δ2 = 0", "δ3 = 0", "nearest"]
Gain = Literal["none", "speed", "force"]


@dataclass(frozen=True)
class SingularView:
    """How singularities are shown.

    Attributes:
        ghost: Which of the nearest singular poses is drawn.
        strata: Whether the diagram of the strata is drawn.
        ellipsoid: Which ellipsoid is drawn at the point, that of speeds or that of forces.
    """

    ghost: Ghost = "none"
    strata: bool = True
    ellipsoid: Gain = "none"
    ball: bool = False


@dataclass(frozen=True)
class View:
    """The settings of what is shown, and how.

    Attributes:
        lengths: The unit in which lengths are shown and typed; the state has design units.
        at: The point whose position is shown and set, and about which the platform turns.
        coordinates: The coordinates by which the pose is shown and set: the position of that point
            with three angles, the six lengths, or the six folds.
        drawn_as: What is drawn: the schematic mechanism, the parts of its prototype in place of
            legs and bodies, or its 6-4 twin, with six legs in place of the four.
        flags, bodies, legs, labels, grid, handle: Whether each is drawn.
        tetrahedra: Whether each of the three is drawn, and the gap that is left to its incidence.
        leaves: Whether the two inner leaves are drawn, with the folds beside them.
        swept: Whether the tetrahedra are drawn that the legs swept in the last move.
        ghosts: Whether the seven other assembly modes are drawn.
        tilts: Whether the greatest tilts at nodes over the workspace are drawn.
        warn_below: The length below which margins are warned of, in design units; distances
            are warned of below a share of it, see `explorer.measures.verdict`. None for a share of
            the reach.

    Raises:
        InputError: The warning length is not positive.
    """

    lengths: LengthName = "mm"
    at: Point = "b4"
    coordinates: Coordinates = "position"
    drawn_as: DrawnAs = "schematic"
    flags: bool = True
    bodies: bool = True
    legs: bool = True
    labels: bool = True
    grid: bool = True
    handle: bool = True
    tetrahedra: tuple[bool, bool, bool] = (True, True, True)
    leaves: bool = False
    clearance: bool = False
    machine: bool = True
    swept: bool = False
    ghosts: bool = False
    tilts: bool = False
    warn_below: float | None = field(default=None, metadata=LENGTHS)
    prototype: PrototypeView = field(default_factory=PrototypeView)
    workspace: WorkspaceView = field(default_factory=WorkspaceView, metadata=LENGTHS)
    singular: SingularView = field(default_factory=SingularView)
    forces: ForcesView = field(default_factory=ForcesView)
    precision: PrecisionView = field(default_factory=PrecisionView)

    def unit_for(self, design: Design) -> Unit:
        """Return the unit in which lengths of a design are shown."""
        return design.millimetres if self.lengths == "mm" else UNITS

    @property
    def is_twin(self) -> bool:
        """Whether the 6-4 twin is drawn, whose legs have neither clearances nor a prototype."""
        return self.drawn_as == "6-4 twin"

    def __post_init__(self) -> None:
        if self.warn_below is not None:
            positive("the warning length", self.warn_below)
