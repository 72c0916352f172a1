"""The machine around the mechanism: tool, payload, actuators, struts, guide and tolerances.

None of it changes the kinematics. Points are in design units like those of the design; the data
of bought components keep the units of their data sheets, which the names of the fields state.
Every default means an ideal part: no mass, no limit, no error and no deflection.
"""

from __future__ import annotations

import math

import msgspec
import numpy as np
from msgspec.structs import force_setattr as _set

from explorer.errors import DesignError
from explorer.mechanism.pose import Quadruple, Triple
from explorer.numerics.arrays import FloatArray
from explorer.numerics.checks import MOST, STIFFEST, not_negative, numbers, positive, two
from explorer.numerics.number_text import format_apart

Pair = tuple[float, float]
Six = tuple[float, float, float, float, float, float]
NO_LOAD: Six = (0.0, 0.0, 0.0, 0.0, 0.0, 0.0)

STANDARD_GRAVITY = 9.80665
"""Standard acceleration of gravity, in m/s²."""

# Share by which rounding may raise a moment of inertia above the sum of the others.
ROUNDING = 1e-9

LARGEST_DISTANCE = 100.0
"""Largest distance of the tool and of the payload's centre from b4, as a multiple of the reach."""

DIMENSIONS = (
    *(f"a1{axis}" for axis in "xyz"),
    *(f"a3{axis}" for axis in "xyz"),
    *(f"guide {axis}" for axis in "xyz"),
    *("guide tilt y", "guide tilt z"),
    *(f"b{point}{axis}" for point in (1, 2, 3, 4) for axis in "xyz"),
    *("strut 2 tilt", "strut 3 tilt"),
)
"""The 25 geometric dimensions: points of the base, offset and tilt of the guide, points of the
platform, and tilts of struts 2 and 3 along the guide, in the order of every array axis of 25."""

A1, A3, GUIDE, TILT, PLATFORM, STRUTS = map(slice, (0, 3, 6, 9, 11, 23), (3, 6, 9, 11, 23, 25))
"""The places among the `DIMENSIONS` of a1, a3, offset and tilt of the guide, b1 to b4, and tilts of
the struts."""


class Tool(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """The frame of the tool in the platform frame.

    Attributes:
        position: Tool point, in design units.
        quaternion: Orientation (w, x, y, z) from the tool frame to the platform frame,
            normalised.

    Raises:
        DesignError: A value is not finite, or the quaternion is zero.
    """

    position: Triple = (0.0, 0.0, 0.0)
    quaternion: Quadruple = (1.0, 0.0, 0.0, 0.0)

    def __post_init__(self) -> None:
        _set(self, "position", tuple(numbers("tool.position", self.position, 3)))
        name = "tool.quaternion"
        _set(self, "quaternion", _unit(name, numbers(name, self.quaternion, 4)))


class Payload(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """The load that the platform carries: a mass, and a force of any direction at the tool point.

    Attributes:
        mass_kg: Mass, in kilograms.
        centre: Centre of mass in the platform frame, in design units.
        force_n: Largest force of the process, which acts at the tool point in any direction, in
            newtons.
        inertia_kg_mm2: Moments of inertia about the centre along the platform's axes, which are
            taken as principal axes, in kg mm²; zeros for a point mass.

    Raises:
        DesignError: The mass, the force or a moment is negative, a value is not finite, or no body
            has the inertia, see `inertia_problem`.
    """

    mass_kg: float = 0.0
    centre: Triple = (0.0, 0.0, 0.0)
    force_n: float = 0.0
    inertia_kg_mm2: Triple = (0.0, 0.0, 0.0)

    def __post_init__(self) -> None:
        _set(self, "mass_kg", not_negative("payload.mass_kg", self.mass_kg))
        _set(self, "centre", tuple(numbers("payload.centre", self.centre, 3)))
        _set(self, "force_n", not_negative("payload.force_n", self.force_n))
        name = "payload.inertia_kg_mm2"
        moments = numbers(name, self.inertia_kg_mm2, 3, STIFFEST)
        _set(self, "inertia_kg_mm2", tuple(not_negative(name, each, STIFFEST) for each in moments))
        if problem := inertia_problem(self.mass_kg, self.inertia_kg_mm2):
            raise DesignError(f"{name} {problem}", name)

    def with_mass(self, mass_kg: float) -> Payload:
        """Return the payload with another mass; one without a mass has no inertia."""
        moments = self.inertia_kg_mm2 if mass_kg else (0.0, 0.0, 0.0)
        return msgspec.structs.replace(self, mass_kg=mass_kg, inertia_kg_mm2=moments)

    @property
    def weight_n(self) -> float:
        """Weight of the mass, in newtons."""
        return self.mass_kg * STANDARD_GRAVITY


def inertia_problem(mass_kg: float, moments: Triple) -> str:
    """Return why no body of a mass has principal moments of inertia; "" if one has."""
    largest, others = max(moments), sum(sorted(moments)[:2])
    if largest > others * (1.0 + ROUNDING):
        least, got = format_apart((others, largest))
        return f"has a moment above the sum of the other two, {least}, as no body has; got {got}"
    if largest and not mass_kg:
        return "must be zero without a mass; state payload.mass_kg too"
    return ""


def or_infinite(six: Six | None) -> FloatArray:
    """Return six limits or stiffnesses as an array (6,); infinite if there are none."""
    return np.array(six or (math.inf,) * 6)


class Actuators(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """Data of the six actuators, each six numbers in the order of `JOINTS`.

    Attributes:
        push_n: Largest force that increases the joint's value, if only for a moment, in newtons;
            None for no limit.
        pull_n: Largest force that decreases it, in newtons; None for the same as `push_n`.
        continuous_n: Largest root-mean-square force over a motion, in newtons; None for no limit.
        speed_mm_s: Largest speed, in millimetres per second; None for no limit.
        acceleration_mm_s2: Largest acceleration, in millimetres per s²; None for no limit.
        error_mm: Largest positioning error to either side, in millimetres.
        stiffness_n_mm: Stiffness, in newtons per millimetre; None for rigid actuators.

    Raises:
        DesignError: A limit or a stiffness is not positive, an error is negative, or there are
            not six numbers.
    """

    push_n: Six | None = None
    pull_n: Six | None = None
    error_mm: Six = (0.0, 0.0, 0.0, 0.0, 0.0, 0.0)
    stiffness_n_mm: Six | None = None
    continuous_n: Six | None = None
    speed_mm_s: Six | None = None
    acceleration_mm_s2: Six | None = None

    def __post_init__(self) -> None:
        for name in self.__struct_fields__:
            values = getattr(self, name)
            if values is not None and name != "error_mm":
                field = f"actuators.{name}"
                most = STIFFEST if name == "stiffness_n_mm" else MOST
                given = numbers(field, values, 6, most)
                _set(self, name, tuple(positive(field, value, most) for value in given))
        errors = numbers("actuators.error_mm", self.error_mm, 6)
        _set(self, "error_mm", tuple(not_negative("actuators.error_mm", each) for each in errors))

    @property
    def limits(self) -> tuple[FloatArray, FloatArray]:
        """Largest push and largest pull, each of shape (6,), in newtons; infinite for no limit."""
        return or_infinite(self.push_n), or_infinite(self.pull_n or self.push_n)


class Struts(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """The struts of legs 2 and 3, tubes that are cantilevers on their carriages.

    Attributes:
        outer_mm: Outer diameter of the tube, in millimetres; None for a rigid strut.
        inner_mm: Inner diameter, in millimetres; 0 for a bar.
        modulus_gpa: Young's modulus, in gigapascals.
        stress_mpa: Largest bending stress, in megapascals; None for no limit.
        moment_nm: Largest bending moment, in newton metres, in place of that of tube and stress;
            None to use those.

    Raises:
        DesignError: A value is not positive, or the inner diameter is not below the outer one.
    """

    outer_mm: float | None = None
    inner_mm: float = 0.0
    modulus_gpa: float = 70.0
    stress_mpa: float | None = None
    moment_nm: float | None = None

    def __post_init__(self) -> None:
        for name in ("outer_mm", "modulus_gpa", "stress_mpa", "moment_nm"):
            value = getattr(self, name)
            if value is not None or name == "modulus_gpa":
                _set(self, name, positive(f"struts.{name}", value))
        _set(self, "inner_mm", not_negative("struts.inner_mm", self.inner_mm))
        if self.outer_mm is not None and self.inner_mm >= self.outer_mm:
            inner, outer = format_apart((self.inner_mm, self.outer_mm))
            raise DesignError(
                f"struts.inner_mm must be below the outer diameter {outer}; got {inner}",
                "struts.inner_mm",
            )

    @property
    def largest_moment(self) -> float:
        """Largest bending moment, in newton metres; infinite for no limit."""
        if self.moment_nm is not None:
            return self.moment_nm
        if self.outer_mm is None or self.stress_mpa is None:
            return math.inf
        # Newton millimetres, since a megapascal is a newton per square millimetre.
        return self.stress_mpa * self._area_moment / (0.5 * self.outer_mm) * 1e-3

    @property
    def bending_stiffness(self) -> float:
        """Bending stiffness EI, in newton square millimetres; infinite for a rigid strut."""
        return math.inf if self.outer_mm is None else 1e3 * self.modulus_gpa * self._area_moment

    @property
    def _area_moment(self) -> float:
        """Second moment of area of the tube, in millimetres to the fourth power."""
        return math.pi / 64.0 * ((self.outer_mm or 0.0) ** 4 - self.inner_mm**4)


class Guide(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """Limits of the guide at each of its two carriages; None for no limit.

    Attributes:
        force_n: Largest force across the guide, in newtons.
        moment_nm: Largest moment, in newton metres.

    Raises:
        DesignError: A limit is not positive.
    """

    force_n: float | None = None
    moment_nm: float | None = None

    def __post_init__(self) -> None:
        for name in self.__struct_fields__:
            value = getattr(self, name)
            if value is not None:
                _set(self, name, positive(f"guide.{name}", value))


class Tolerances(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """Largest deviations of the 25 geometric dimensions to either side.

    Attributes:
        a1, a3: Of these points along the axes of the base, in millimetres.
        guide: Of the guide's offset along the axes of the base, in millimetres.
        guide_tilt_deg: Of the guide's turn about y and z through a1, in degrees.
        b1, b2, b3, b4: Of these points along the axes of the platform, in millimetres.
        square_deg: Of the tilts of struts 2 and 3 along the guide, to which they are square, in
            degrees.

    Raises:
        DesignError: A tolerance is negative or not finite.
    """

    a1: Triple = (0.0, 0.0, 0.0)
    a3: Triple = (0.0, 0.0, 0.0)
    guide: Triple = (0.0, 0.0, 0.0)
    guide_tilt_deg: Pair = (0.0, 0.0)
    b1: Triple = (0.0, 0.0, 0.0)
    b2: Triple = (0.0, 0.0, 0.0)
    b3: Triple = (0.0, 0.0, 0.0)
    b4: Triple = (0.0, 0.0, 0.0)
    square_deg: Pair = (0.0, 0.0)

    def __post_init__(self) -> None:
        for name in self.__struct_fields__:
            field, values = f"tolerances.{name}", getattr(self, name)
            given = two(field, values) if name.endswith("_deg") else numbers(field, values, 3)
            _set(self, name, tuple(not_negative(field, value) for value in given))

    @property
    def stated(self) -> tuple[float, ...]:
        """The tolerances in the order of `DIMENSIONS`, in millimetres and degrees."""
        return tuple(value for name in self.__struct_fields__ for value in getattr(self, name))


def unit_gravity(value: object) -> Triple:
    """Return a direction of gravity in the base frame as a unit vector; it must not be zero."""
    x, y, z = _unit("gravity", numbers("gravity", value, 3))
    return x, y, z


def check_near(name: str, point: Triple, reach: float) -> None:
    """Check that a point of the platform lies within `LARGEST_DISTANCE` of b4."""
    distance, most = math.hypot(*point), LARGEST_DISTANCE * reach
    if distance > most:
        end, got = format_apart((most, distance))
        raise DesignError(
            f"{name} must lie within {LARGEST_DISTANCE:g} reaches ({end}) of b4; "
            f"got a distance of {got}",
            name,
        )


def _unit(name: str, values: list[float]) -> tuple[float, ...]:
    """Return a vector of unit length; one that has it already stays the same to the last bit."""
    norm = math.hypot(*values)
    if norm == 0.0:
        raise DesignError(f"{name} must not be all zeros", name)
    return tuple(values if abs(norm - 1.0) <= 4e-16 else (value / norm for value in values))
