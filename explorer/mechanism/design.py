"""A design of the flagged 4-4 manipulator and its limits (design variables X of the paper).

The six design variables place the attachment points: a3 in the base, b1, b2 and b3 in
the platform; a1 and b4 are the two origins.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from functools import lru_cache
from typing import Any, Literal, cast, get_args

import msgspec
from msgspec.structs import force_setattr as _set

from explorer.errors import DesignError
from explorer.mechanism.home import best_home
from explorer.mechanism.machine import (
    Actuators,
    Guide,
    Payload,
    Struts,
    Tolerances,
    Tool,
    check_near,
    unit_gravity,
)
from explorer.mechanism.margins import margins, mode_of, signs_of
from explorer.mechanism.points import Variables, platform_points
from explorer.mechanism.pose import Pose, Triple
from explorer.numerics import checks
from explorer.numerics.arrays import FloatArray
from explorer.numerics.number_text import Unit, format_apart

JOINTS = ("l1", "d1", "d2", "d3", "d4", "l4")
"""The joint variables, in the order of every array axis of six."""

LENGTHS = ("l1", "d2", "d4", "l4")
"""The joints that are lengths of actuators, hence not negative, in the order of the legs."""

LENGTH_ROWS = [JOINTS.index(name) for name in LENGTHS]
"""The places of the `LENGTHS` among the `JOINTS`."""

GUIDE_ROWS = [1, 3]
"""The places of d1 and d3 among the `JOINTS`, whose forces bend the struts."""

STRUT_ROWS = [2, 4]
"""The places of d2 and d4 among the `JOINTS`, the lengths of the struts of legs 2 and 3."""

VARIABLES = ("a3x", "a3y", "b1x", "b1y", "b2", "b3")
"""The design variables X in the paper's order."""

Pair = tuple[float, float]
Range = tuple[float, float | None]

CarriageOrder = Literal["home", "any"]
"""The allowed order of the carriages on the guide: that of the home pose, or any."""

TOLERANCE = 1e-11
"""Tolerance of every limit, so that rounding violates none: a share of the reach for lengths,
radians for angles."""

# Share of the design's size up to which a3y, b1y and b3 - b2 are rounding noise.
DEGENERATE_RATIO = 1e-12

DOWN: Triple = (0.0, 0.0, -1.0)
"""The default direction of gravity."""


class Swing(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """Swing limits of the universal and ball joints; None for no limit.

    Attributes:
        a1, a3: Half-angle, in degrees, of a cone that is fixed in the base.
        b1, b2, b3, b4: Half-angle, in degrees, of a cone that is fixed in the platform.

    The axis of each cone is the leg's direction in the home pose.

    Raises:
        DesignError: A half-angle is not above 0 or exceeds 180.
    """

    a1: float | None = None
    a3: float | None = None
    b1: float | None = None
    b2: float | None = None
    b3: float | None = None
    b4: float | None = None

    def __post_init__(self) -> None:
        for name in self.__struct_fields__:
            angle = getattr(self, name)
            if angle is not None:
                checked = checks.positive(f"limits.swing.{name}", angle)
                if checked > 180.0:
                    most, got = format_apart((180.0, checked))
                    raise DesignError(
                        f"limits.swing.{name} is a half-angle of at most {most}°; got {got}",
                        f"limits.swing.{name}",
                    )
                _set(self, name, checked)


class Limits(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """Limits of the actuators, the guide, the joints and the workspace, in design units.

    Attributes:
        l1, d2, d4, l4: (minimum, maximum) length; a maximum of None is the reach |a3|.
        guide: (lowest, highest) carriage position; None for no limit.
        gap: Smallest distance |d1 - d3| between the carriages.
        carriage_order: "home" demands that d3 - d1 has the sign of the design's home pose,
            since at d1 = d3 legs 2 and 3 share a point; "any" demands nothing.
        box: (lows, highs) of b4 in the base frame; None for no limit.
        margin: Smallest |δ| of the three margins, with the sign triple of the home pose; 0
            demands only the sign triple, None nothing.
        leg_radii: Radii of the four legs, which are capsules, in the order of the legs.
        swing: Half-angles of the cones that contain the legs at their joints, in degrees.

    Raises:
        DesignError: A value is not finite, a length is negative, a range is reversed, or the
            carriage order is neither "home" nor "any".
    """

    l1: Range = (0.0, None)
    d2: Range = (0.0, None)
    d4: Range = (0.0, None)
    l4: Range = (0.0, None)
    guide: Pair | None = None
    gap: float = 0.0
    carriage_order: CarriageOrder = "home"
    box: tuple[Triple, Triple] | None = None
    margin: float | None = 0.0
    leg_radii: tuple[float, float, float, float] = (0.0, 0.0, 0.0, 0.0)
    swing: Swing = Swing()

    def __post_init__(self) -> None:
        for name in LENGTHS:
            low, high = checks.two(f"limits.{name}", getattr(self, name))
            low = checks.not_negative(f"limits.{name} minimum", low)
            if high is not None:
                high = checks.number(f"limits.{name} maximum", high)
                if high < low:
                    least, most = format_apart((low, high))
                    raise DesignError(
                        f"limits.{name}: the minimum {least} exceeds the maximum {most}",
                        f"limits.{name}",
                    )
            _set(self, name, (low, high))
        if self.guide is not None:
            low, high = checks.ordered_pair("limits.guide", *checks.two("limits.guide", self.guide))
            _set(self, "guide", (low, high))
        _set(self, "gap", checks.not_negative("limits.gap", self.gap))
        order = checks.one_of("limits.carriage_order", self.carriage_order, get_args(CarriageOrder))
        _set(self, "carriage_order", order)
        if self.box is not None:
            _set(self, "box", checks.box("limits.box", self.box))
        if self.margin is not None:
            _set(self, "margin", checks.not_negative("limits.margin", self.margin))
        checks.instance("limits.swing", self.swing, Swing)
        radii = checks.numbers("limits.leg_radii", self.leg_radii, 4)
        _set(self, "leg_radii", tuple(checks.not_negative("limits.leg_radii", r) for r in radii))


class Design(msgspec.Struct, frozen=True, forbid_unknown_fields=True, kw_only=True):
    """A flagged 4-4 manipulator that is not degenerate.

    Attributes:
        schema: Version of the file format.
        name: Name of the design, one printable line without surrounding space.
        unit_mm: Millimetres in one design unit.
        node_step: Grid step of the paper's node counting, in design units; None is reach / 15.
        a3: (x, y) of a3 in the base frame, in design units.
        b1: (x, y) of b1 in the platform frame, in design units.
        b2, b3: x of b2 and b3 in the platform frame, in design units.
        limits: Limits of the mechanism.
        home: Home pose, whose orientation and sign triple are those of the workspace; None
            for the one that `explorer.mechanism.home` chooses; see `home_pose`.
        tool: Frame of the tool on the platform.
        payload: Mass that the platform carries.
        gravity: Direction of gravity in the base frame, normalised.
        actuators: Limits, errors and stiffness of the six actuators.
        struts: Tubes of legs 2 and 3.
        guide: Limits of the guide.
        tolerances: Tolerances of the geometric dimensions.
        required_box: (lows, highs) of the box of positions of the tool that was required of the
            design, before it is turned; None for none. It is no limit.
        required_yaw: Angle about z, in degrees, by which that box is turned about its centre.

    Raises:
        DesignError: A value is not finite or beyond the bounds of `explorer.numerics.checks`, the
            design is degenerate (a3y = 0, b1y = 0 or b2 = b3), or the tool or the payload lies more
            than a hundred reaches from b4.
    """

    schema: Literal[2] = 2
    name: str = "untitled"
    unit_mm: float = 10.0
    node_step: float | None = None
    a3: Pair
    b1: Pair
    b2: float
    b3: float
    limits: Limits = Limits()
    home: Pose | None = None
    tool: Tool = Tool()
    payload: Payload = Payload()
    gravity: Triple = DOWN
    actuators: Actuators = Actuators()
    struts: Struts = Struts()
    guide: Guide = Guide()
    tolerances: Tolerances = Tolerances()
    required_box: tuple[Triple, Triple] | None = None
    required_yaw: float = 0.0

    def __post_init__(self) -> None:
        if self.schema != 2:
            raise DesignError(f"schema must be 2; got {self.schema!r}")
        _set(self, "schema", 2)
        _set(self, "name", checks.title("name", self.name))
        checks.instance("home", self.home, Pose, type(None))
        for kind in (Limits, Tool, Payload, Actuators, Struts, Guide, Tolerances):
            name = kind.__name__.lower()
            checks.instance(name, getattr(self, name), kind)
        _set(self, "a3", tuple(checks.numbers("a3", self.a3, 2)))
        _set(self, "b1", tuple(checks.numbers("b1", self.b1, 2)))
        _set(self, "b2", checks.number("b2", self.b2))
        _set(self, "b3", checks.number("b3", self.b3))
        _set(self, "unit_mm", checks.positive("unit_mm", self.unit_mm))
        if self.node_step is not None:
            _set(self, "node_step", checks.positive("node_step", self.node_step))
        if self.required_box is not None:
            _set(self, "required_box", checks.box("required_box", self.required_box))
        _set(self, "required_yaw", checks.number("required_yaw", self.required_yaw))
        size = checks.number(
            "the largest design variable", max(map(abs, self.variables)), checks.LEAST
        )
        for name, value, zero in (
            ("a3y", self.a3[1], "a1, a2 and a3 lie on one line"),
            ("b1y", self.b1[1], "b1, b2 and b3 lie on one line"),
            ("b3 - b2", self.b3 - self.b2, "b2 and b3 are one point"),
        ):
            if abs(value) <= DEGENERATE_RATIO * size:
                raise DesignError(
                    f"degenerate design: {name} = {value:g}, so {zero} and every pose is "
                    f"singular; it must exceed {DEGENERATE_RATIO:g} of the largest "
                    f"variable ({size:g}) in magnitude",
                    name[:2],
                )
        # Searches make thousands of designs that differ in their variables only.
        if self.gravity is not DOWN:
            gravity = unit_gravity(self.gravity)
            _set(self, "gravity", DOWN if gravity == DOWN else gravity)
        for name, point in (
            ("tool.position", self.tool.position),
            ("payload.centre", self.payload.centre),
        ):
            if any(point):
                check_near(name, point, self.reach)

    @property
    def variables(self) -> Variables:
        """The design variables X = (a3x, a3y, b1x, b1y, b2, b3), in design units."""
        return (*self.a3, *self.b1, self.b2, self.b3)

    @property
    def reach(self) -> float:
        """The reach |a3|, the normalising length, in design units."""
        return math.hypot(*self.a3)

    @property
    def millimetres(self) -> Unit:
        """The millimetre as the unit in which lengths of this design are written."""
        return Unit("mm", self.unit_mm)

    @property
    def tolerance(self) -> float:
        """The tolerance of limits of lengths, in design units."""
        return TOLERANCE * self.reach

    @property
    def a2x(self) -> float:
        """The x of a2, drawn at the end of the guide, in design units; no joint depends on it."""
        ends = self.limits.guide or (0.0, self.reach)
        return ends[1] or ends[0] or self.reach

    @property
    def platform_points(self) -> FloatArray:
        """The points b1, b2, b3 and b4 in the platform frame, shape (4, 3), in design units."""
        return platform_points(self.variables)

    def length_range(self, name: str) -> tuple[float, float]:
        """Return (minimum, maximum) of l1, d2, d4 or l4; a maximum of None becomes the reach."""
        low, high = cast("Range", getattr(self.limits, name))
        return low, self.reach if high is None else high

    @property
    def home_pose(self) -> Pose:
        """The home pose, of the file or chosen: the orientation and the mode of the workspace."""
        if self.home is not None:
            return self.home
        guide = self.limits.guide or (-math.inf, math.inf)
        ranges = (self.length_range(name) if name in LENGTHS else guide for name in JOINTS)
        return best_home(self.variables, tuple(ranges), self.limits.box)

    @property
    def home_signs(self) -> tuple[int, int, int]:
        """The sign triple of the home pose, in its own orientation."""
        return _signs_at(self.home_pose)

    @property
    def demanded_order(self) -> int:
        """The sign of d3 − d1 that the limits demand, which is that of the home pose.

        The sign is 0, for either order, if the limits allow any order or if the carriages
        coincide in the home pose to the tolerance.
        """
        if self.limits.carriage_order == "any":
            return 0
        difference = (self.b3 - self.b2) * float(self.home_pose.rotation[0, 0])
        if abs(difference) <= self.tolerance:
            return 0
        return 1 if difference > 0.0 else -1

    def with_limits(self, **changes: Any) -> Design:
        """Return this design with other values of some fields of its limits.

        Raises:
            DesignError: A value is not usable, see `Limits`.
        """
        limits = msgspec.structs.replace(self.limits, **changes)
        return msgspec.structs.replace(self, limits=limits)

    def with_variables(self, values: Sequence[float]) -> Design:
        """Return this design with other values of X.

        Raises:
            DesignError: The values are not six finite numbers or make a degenerate design.
        """
        a3x, a3y, b1x, b1y, b2, b3 = checks.numbers("design variables", values, 6)
        return msgspec.structs.replace(self, a3=(a3x, a3y), b1=(b1x, b1y), b2=b2, b3=b3)

    def with_variable(self, name: str, value: float) -> Design:
        """Return this design with another value of one variable, named as in `VARIABLES`.

        Raises:
            DesignError: There is no such variable, or the value makes a degenerate design.
        """
        if name not in VARIABLES:
            raise DesignError(f"no design variable {name!r}; there are {', '.join(VARIABLES)}")
        values = list(self.variables)
        values[VARIABLES.index(name)] = value
        return self.with_variables(values)


@lru_cache(64)
def _signs_at(pose: Pose) -> tuple[int, int, int]:
    return signs_of(int(mode_of(margins(pose.position, pose.rotation))))
