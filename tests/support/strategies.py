"""Random designs and poses: ordinary ones, and those in which rounding errors are large.

The sizes of designs are from 1e-4 to 1e5; some are degenerate but for a share of 1e-6. Rotations
are uniform, near the identity (where the lines are parallel) and quarter turns. Poses are
general, singular in each way, and nearly singular in each way.
"""

from __future__ import annotations

import itertools
import math
from dataclasses import dataclass

import numpy as np
from hypothesis import strategies as st

from explorer import Design, Pose, rotation_from_quaternion
from explorer.mechanism.configuration import Configuration
from explorer.numerics.arrays import FloatArray

EPSILON = 2.0**-52

SIZES = (10.0, 1e-4, 1e5)
"""Sizes of designs: ordinary, small and large."""

NEARNESS = (1.0, 1e-3, 1e-6)
"""Smallest a3y, b1y and b3 - b2 as shares of the size; a design with a zero is degenerate."""

WAYS = tuple(way for count in (1, 2, 3) for way in itertools.combinations((1, 2, 3), count))
"""The ways of being singular: which of δ1, δ2, δ3 vanish."""


@dataclass(frozen=True)
class Case:
    """A design in a pose."""

    design: Design
    position: FloatArray
    rotation: FloatArray

    @property
    def at(self) -> Configuration:
        """The design in the pose."""
        return Configuration(self.design, self.position, self.rotation)

    @property
    def size(self) -> float:
        """The largest length of the computation, to which rounding errors are relative."""
        return max(*map(abs, self.design.variables), float(np.abs(self.position).max()))

    @property
    def pose(self) -> Pose:
        """The pose, with its rotation as a quaternion."""
        return Pose.of(self.position, self.rotation)

    @property
    def joints(self) -> FloatArray:
        """The joints, shape (6,)."""
        return self.at.joints

    @property
    def margins(self) -> FloatArray:
        """The margins (δ1, δ2, δ3), shape (3,)."""
        return self.at.margins

    @property
    def regularity(self) -> float:
        """The smallest |δi| as a share of the size; 0 for a singular pose."""
        return float(np.abs(self.margins).min()) / self.size

    def scaled(self, factor: float) -> Case:
        """Return the case in a unit that is smaller by a factor."""
        variables = [factor * value for value in self.design.variables]
        return Case(self.design.with_variables(variables), factor * self.position, self.rotation)


def span_amplification(case: Case) -> float:
    """Return the factor by which a short b2b3 magnifies rounding, at least one."""
    return case.size / abs(case.design.b3 - case.design.b2)


def amplification(case: Case) -> float:
    """Return the factor by which a nearly degenerate design magnifies rounding, at least one."""
    shortest = min(abs(case.design.a3[1]), abs(case.design.b1[1]))
    return span_amplification(case) * case.size / shortest


def isolation(case: Case) -> float:
    """Return a measure of the distance from poses that are singular in two ways at once.

    It is the second smallest of the margins over the size and the sine between the two lines,
    with which δ2 vanishes too.
    """
    sine = math.hypot(case.rotation[1, 0], case.rotation[2, 0])
    return float(np.sort([*(np.abs(case.margins) / case.size).tolist(), sine])[1])


def _away_from_zero(least: float = 0.1) -> st.SearchStrategy[float]:
    return st.floats(least, 1.0) | st.floats(-1.0, -least)


@st.composite
def designs(
    draw: st.DrawFn, sizes: tuple[float, ...] = SIZES, nearness: tuple[float, ...] = NEARNESS
) -> Design:
    """Draw a design of one of the sizes, each denominator scaled by a share."""
    size = draw(st.sampled_from(sizes))
    a3y, b1y, span = (draw(_away_from_zero()) * draw(st.sampled_from(nearness)) for _ in range(3))
    a3x, b1x, b2 = (draw(st.floats(-1.0, 1.0)) for _ in range(3))
    # One variable has the size, so that a design of small others has no other size.
    anchor = math.copysign(1.0, a3x)
    return Design(
        a3=(anchor * size, a3y * size),
        b1=(b1x * size, b1y * size),
        b2=b2 * size,
        b3=(b2 + span) * size,
    )


def ordinary_designs() -> st.SearchStrategy[Design]:
    """Draw designs of ordinary size, none of them nearly degenerate."""
    return designs(sizes=(10.0,), nearness=(1.0,))


@st.composite
def uniform_rotations(draw: st.DrawFn) -> FloatArray:
    """Draw a rotation from a quaternion in the shell of a cube."""
    quaternion = [draw(st.floats(-1.0, 1.0)) for _ in range(4)]
    quaternion[draw(st.integers(0, 3))] = draw(_away_from_zero(0.2))
    return rotation_from_quaternion(quaternion)


@st.composite
def small_rotations(draw: st.DrawFn) -> FloatArray:
    """Draw a rotation by an angle of 1e-12 to 0.1, or by none."""
    axis = [draw(st.floats(-1.0, 1.0)) for _ in range(3)]
    angle = draw(st.sampled_from((0.0, *(10.0**-k for k in range(1, 13)))))
    return rotation_from_quaternion([1.0, *(0.5 * angle * a for a in axis)])


QUARTER_TURNS = np.array(
    [
        matrix
        for order in itertools.permutations(range(3))
        for signs in itertools.product((1.0, -1.0), repeat=3)
        if np.linalg.det(matrix := np.diag(signs) @ np.eye(3)[list(order)] + 0.0) > 0.0
    ]
)
"""The 24 rotations of a cube, whose entries are exact."""


def rotations() -> st.SearchStrategy[FloatArray]:
    """Draw a rotation of any kind."""
    quarter_turns = st.sampled_from(range(24)).map(lambda index: QUARTER_TURNS[index].copy())
    return uniform_rotations() | small_rotations() | quarter_turns


@st.composite
def positions(draw: st.DrawFn) -> FloatArray:
    """Draw a position within three units on each axis."""
    return np.array([draw(st.floats(-3.0, 3.0)) for _ in range(3)])


@st.composite
def singular_positions(draw: st.DrawFn, rotation: FloatArray, way: tuple[int, ...]) -> FloatArray:
    """Draw a position in which the margins of the way vanish, to rounding."""
    u, v, n = rotation[:, 0], rotation[:, 1], rotation[:, 2]
    x, y = (draw(_away_from_zero()) * 3.0 for _ in range(2))
    position: dict[tuple[int, ...], FloatArray] = {
        (1,): x * u + y * v,
        (2,): np.array([x, y * u[1], y * u[2]]),
        (3,): np.array([x, y, 0.0]),
        (1, 2): x * u,
        (1, 3): x * np.array([-n[1], n[0], 0.0]),
        (2, 3): np.array([x, 0.0, 0.0]),
        (1, 2, 3): np.zeros(3),
    }
    return position[way]


@st.composite
def cases(draw: st.DrawFn, among: st.SearchStrategy[Design] | None = None) -> Case:
    """Draw a design in a pose in general position, of uniform rotation."""
    design = draw(designs() if among is None else among)
    size = max(map(abs, design.variables))
    return Case(design, draw(positions()) * size, draw(uniform_rotations()))


def ordinary_cases() -> st.SearchStrategy[Case]:
    """Draw a design of ordinary size in a pose in general position."""
    return cases(ordinary_designs())


@st.composite
def singular_cases(
    draw: st.DrawFn,
    way: tuple[int, ...] | None = None,
    among: st.SearchStrategy[Design] | None = None,
) -> Case:
    """Draw a design in a pose that is singular, in the given way or in any."""
    design = draw(designs() if among is None else among)
    size = max(map(abs, design.variables))
    rotation = draw(rotations())
    chosen = draw(st.sampled_from(WAYS)) if way is None else way
    return Case(design, draw(singular_positions(rotation, chosen)) * size, rotation)


@st.composite
def near_singular_cases(draw: st.DrawFn) -> Case:
    """Draw a singular pose pushed off by 1e-16 to 1e-1 of the size."""
    case = draw(singular_cases())
    size = max(map(abs, case.design.variables))
    push = draw(st.sampled_from(tuple(10.0**-k for k in range(1, 17))))
    return Case(case.design, case.position + push * size * draw(positions()), case.rotation)


@st.composite
def collapsed_cases(draw: st.DrawFn) -> Case:
    """Draw a pose in which one of l1, d2, d4, l4 is zero, to rounding."""
    design = draw(designs())
    size = max(map(abs, design.variables))
    rotation = draw(rotations())
    on_guide = np.array([draw(st.floats(-3.0, 3.0)) * size, 0.0, 0.0])
    b1 = np.array([*design.b1, 0.0])
    position = (
        -rotation @ b1,
        on_guide - design.b2 * rotation[:, 0],
        on_guide - design.b3 * rotation[:, 0],
        np.array([*design.a3, 0.0]),
    )[draw(st.integers(0, 3))]
    return Case(design, position, rotation)


def all_cases() -> st.SearchStrategy[Case]:
    """Draw a case of any kind."""
    return cases() | singular_cases() | near_singular_cases() | collapsed_cases()
