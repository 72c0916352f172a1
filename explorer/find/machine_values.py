"""Values of machines in poses, for arrays of machines and of poses at once.

A machine is a row of `VARIABLES` numbers, with lengths over the diagonal of the required box; a
pose is a place in the box with a tilt. All formulas are analytic in the variables, so that complex
numbers pass through them: with an imaginary step far below rounding the imaginary part of a result
over that step is its derivative, to the last digits (W. Squire and G. Trapp, "Using complex
variables to estimate derivatives of real functions", 1998). Affine forms pass through them as well,
and bound the results over cells of poses.
"""

from __future__ import annotations

from collections.abc import Callable
from functools import cached_property
from typing import Any

import numpy as np

from explorer.legs.clearance import PAIRS
from explorer.mechanism.margins import margins_of
from explorer.motion.inverse_jacobian import held_by_legs
from explorer.numerics import vectors
from explorer.numerics.affine import Affine, largest_norm
from explorer.numerics.arrays import FloatArray
from explorer.numerics.vectors import cross3, dot3

Vec = tuple[Any, Any, Any]
"""The x, y and z of vectors, arrays or numbers."""

VARIABLES = 18
"""Number of variables: those of a design; the tool at home, which is the centre of the box; angles
of the box and of home in radians; the tool in the platform; factors on all tilts and on the box."""

A3X, A3Y, B1X, B1Y, B2, B3, HX, HY, HZ = range(9)
BOX_YAW, YAW, PITCH, ROLL, TX, TY, TZ, TILT, SIZE = range(9, VARIABLES)

SWINGING = (0, 3, 0, 1, 2, 3)
"""The legs, from 0, whose swings are bounded at a1, a3, b1, b2, b3 and b4."""

POINTS = (0, 1, 1, 2, 2, 3)
"""The points b1 to b4, from 0, that the six actuators move."""


HOME = np.zeros((1, 5))
"""The pose at home.

Poses over a required box are rows of five numbers: places in the box, from −1 to 1 along each of
its edges, and the azimuth of the axis and the angle of a tilt, in radians."""


dot: Callable[[Vec, Vec], Any] = dot3
cross: Callable[[Vec, Vec], Vec] = cross3
minus: Callable[[Vec, Vec], Vec] = vectors.minus


def plus(a: Vec, b: Vec) -> Vec:
    """Return a + b."""
    return a[0] + b[0], a[1] + b[1], a[2] + b[2]


def times(s: Any, a: Vec) -> Vec:
    """Return s a."""
    return s * a[0], s * a[1], s * a[2]


def norm(a: Vec) -> Any:
    """Return |a|, analytic where it is not zero."""
    square = dot(a, a)
    return square.root() if isinstance(square, Affine) else np.sqrt(square)


def longest(a: Vec) -> Any:
    """Return |a|, or the upper bound of it over cells."""
    return largest_norm(*a) if isinstance(a[0], Affine) else norm(a)


def most(value: Any) -> Any:
    """Return a value, or the upper bound of it over cells."""
    return value.upper if isinstance(value, Affine) else value


def size(value: Any) -> Any:
    """Return |value|, analytic where it is not zero, or the upper bound of it over cells."""
    if isinstance(value, Affine):
        return np.maximum(value.upper, -value.lower)
    sign: FloatArray = np.where(np.real(value) < 0.0, -1.0, 1.0)
    return sign * value


def rows_of(vector: Vec) -> FloatArray:
    """Return a vector of arrays (...) as rows, shape (..., 3)."""
    return np.stack(np.broadcast_arrays(*vector), axis=-1)


class MachineValues:
    """The values of machines x (..., n) in k poses over a box, arrays (..., k), computed when used.

    The edges of the box (3,) are over its diagonal, as all lengths are.
    """

    def __init__(self, machines: Any, edges: FloatArray, poses: FloatArray) -> None:
        self.machines, self.edges, self.poses = machines, edges, poses
        x: Any = [column[..., None] for column in np.moveaxis(machines, -1, 0)]
        self.x = x
        along = (0.5 * edges * poses[:, :3]).T
        c, s = np.cos(x[BOX_YAW]), np.sin(x[BOX_YAW])
        offset: Vec = along[0] * c - along[1] * s, along[0] * s + along[1] * c, along[2]
        self.tool = plus((x[HX], x[HY], x[HZ]), times(x[SIZE], offset))
        azimuth, tilt = poses[:, 3], x[TILT] * poses[:, 4]
        self._axis: Vec = np.cos(azimuth), np.sin(azimuth), 0.0
        self._cos, self._sin = np.cos(tilt), np.sin(tilt)
        self.home_axes = _axes(x)
        self.u, self.v, self.w = map(self._tilted, self.home_axes)
        self.p = minus(self.tool, self.of_platform((x[TX], x[TY], x[TZ])))

    def _tilted(self, a: Vec) -> Vec:
        n = self._axis
        part = (1.0 - self._cos) * (n[0] * a[0] + n[1] * a[1])
        around = n[1] * a[2], -n[0] * a[2], n[0] * a[1] - n[1] * a[0]
        turned = plus(times(self._cos, a), times(self._sin, around))
        return turned[0] + part * n[0], turned[1] + part * n[1], turned[2]

    def of_platform(self, a: Vec) -> Vec:
        """Return a vector of the platform along the axes of the base."""
        return plus(plus(times(a[0], self.u), times(a[1], self.v)), times(a[2], self.w))

    @cached_property
    def arm1(self) -> Vec:
        """The point b1 from b4."""
        return plus(times(self.x[B1X], self.u), times(self.x[B1Y], self.v))

    @cached_property
    def ends(self) -> tuple[Vec, Vec, Vec, Vec]:
        """Platform ends of the four legs."""
        p, u = self.p, self.u
        b2, b3 = (plus(p, times(self.x[b], u)) for b in (B2, B3))
        return plus(p, self.arm1), b2, b3, p

    @cached_property
    def bases(self) -> list[Vec]:
        """Base ends of the four legs."""
        _, b2, b3, _ = self.ends
        a3 = self.x[A3X], self.x[A3Y], 0.0
        return [(0.0, 0.0, 0.0), (b2[0], 0.0, 0.0), (b3[0], 0.0, 0.0), a3]

    @cached_property
    def legs(self) -> list[Vec]:
        """The four legs from base to platform."""
        b1, b2, b3, p = self.ends
        still = 0.0 * p[0]
        leg4 = p[0] - self.x[A3X], p[1] - self.x[A3Y], p[2]
        return [b1, (still, b2[1], b2[2]), (still, b3[1], b3[2]), leg4]

    @cached_property
    def lengths(self) -> list[Any]:
        """The lengths of the four legs."""
        return [norm(leg) for leg in self.legs]

    @cached_property
    def margins(self) -> Vec:
        """The margins δ1, δ2 and δ3."""
        return margins_of(self.p, self.u, self.w)

    @property
    def order(self) -> Any:
        """The distance d3 − d1 of the carriages with its sign."""
        return (self.x[B3] - self.x[B2]) * self.u[0]

    @cached_property
    def home(self) -> MachineValues:
        """The machines at home."""
        return MachineValues(self.machines, self.edges, HOME)

    @cached_property
    def sides(self) -> list[Any]:
        """The signs of δ1, δ2, δ3 and of d3 − d1 at home."""
        signed: list[Any] = [*self.home.margins, self.home.order]
        return [np.sign(each.real) for each in signed]

    @cached_property
    def along_home(self) -> list[Any]:
        """The parts of the legs along those at home, seen from the joints a1, a3, b1 to b4."""
        home = self.home
        units = [
            times(1.0 / length, leg) for leg, length in zip(home.legs, home.lengths, strict=True)
        ]
        found = [dot(self.legs[i], units[i]) for i in (0, 3)]
        axes = [*zip((self.u, self.v, self.w), self.home_axes, strict=True)]
        for leg, unit in zip(self.legs, units, strict=True):
            x, y, z = (dot(axis, leg) * dot(at_home, unit) for axis, at_home in axes)
            found.append(x + y + z)
        return found

    @cached_property
    def swings(self) -> list[Any]:
        """The cosines of the legs' angles from home in the joints a1, a3, b1 to b4."""
        lengths = [self.lengths[i] for i in SWINGING]
        return [part / length for part, length in zip(self.along_home, lengths, strict=True)]

    @cached_property
    def distances(self) -> Any:
        """The distances of the axes of the six pairs of legs, in the order of `PAIRS`."""
        return self._closest[0]

    @property
    def uncrossed_distances(self) -> FloatArray:
        """The distances of the pairs, negative where two legs have crossed.

        They have if they pass each other on the other side than at home.
        """
        (distances, sides), (_, at_home) = self._closest, self.home._closest
        return np.where(sides * at_home < 0.0, -distances, distances)

    @cached_property
    def _closest(self) -> tuple[FloatArray, FloatArray]:
        """The distances of all pairs, and on which side the first leg passes, (6, ..., k) each."""
        ends = np.empty((2, 4, 3, *self.p[0].shape), dtype=self.p[0].dtype)
        for leg, pair in enumerate(zip(self.bases, self.legs, strict=True)):
            for axis in range(3):
                ends[0, leg, axis], ends[1, leg, axis] = pair[0][axis], pair[1][axis]
        (a, u), (b, v) = (np.moveaxis(ends[:, rows], 2, 1) for rows in PAIR_ROWS)
        return _distance(a, u, b, v)

    def forces(self, force: Vec, moment: Vec) -> list[Any]:
        """Return the actuators' forces that hold a wrench about b4, in the order of the joints."""
        x, ends, (l1, d2, d4, l4) = self.x, self.ends, self.lengths
        f1, held2, held3, f4 = held_by_legs(x, self.u, self.arm1, ends, self.margins, force, moment)
        _, b2, b3, _ = ends
        strut2, strut3 = ((b[1] * q[1] + b[2] * q[2]) for b, q in ((b2, held2), (b3, held3)))
        return [f1 * l1, held2[0], strut2 / d2, held3[0], strut3 / d4, f4 * l4]

    @cached_property
    def velocities(self) -> list[Vec]:
        """The velocity of the tool for a unit rate of each actuator."""
        arm = minus(self.tool, self.p)
        return _columns([self.forces(unit, cross(arm, unit)) for unit in UNITS])

    @cached_property
    def turnings(self) -> list[Vec]:
        """The angular velocity of the platform for a unit rate of each actuator."""
        none: Vec = (0.0 * self.p[0], 0.0, 0.0)
        return _columns([self.forces(none, unit) for unit in UNITS])

    @cached_property
    def tool_speeds(self) -> list[Any]:
        """Speed of the tool for a unit rate of each actuator, its force for 1 N at the tool."""
        return [longest(velocity) for velocity in self.velocities]

    @cached_property
    def transmissions(self) -> list[Any]:
        """The output transmission indices of the six actuators, or lower bounds over cells."""
        moves = zip(self.velocities, self.turnings, POINTS, strict=True)
        own = (
            plus(velocity, cross(turning, minus(self.ends[point], self.tool)))
            for velocity, turning, point in moves
        )
        return [1.0 / longest(each) for each in own]


PAIR_ROWS = np.array(PAIRS).T - 1
"""The first and the second legs of the pairs, from 0."""

UNITS: list[Vec] = [(1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0)]


def _columns(forces: list[list[Any]]) -> list[Vec]:
    """Return the motions of unit rates from the forces that hold three unit loads."""
    x, y, z = forces
    return [(-a, -b, -c) for a, b, c in zip(x, y, z, strict=True)]


def _axes(x: list[Any]) -> tuple[Vec, Vec, Vec]:
    """Return the platform's axes at home, the columns of its rotation."""
    (cy, sy), (cp, sp), (cr, sr) = (
        (np.cos(x[angle]), np.sin(x[angle])) for angle in (YAW, PITCH, ROLL)
    )
    u = cy * cp, sy * cp, -sp
    v = cy * sp * sr - sy * cr, sy * sp * sr + cy * cr, cp * sr
    return u, v, cross(u, v)


def _distance(a: Any, u: Any, b: Any, v: Any) -> tuple[FloatArray, FloatArray]:
    """Return the distance of segments (3, ...) from a by u and from b by v, and the first's side.

    The side is 1 or −1 if the closest points lie within both, and else 0. Where they lie changes
    the distance to second order alone, so that it may be found from the real parts.
    """
    r = a - b
    s, t = closest_shares(u.real, v.real, r.real)
    inner = (s > 0.0) & (s < 1.0) & (t > 0.0) & (t < 1.0)
    side = np.where(inner, np.sign(dot(r.real, cross(u.real, v.real))), 0.0)
    return norm(r + s * u - t * v), side


def closest_shares(u: Any, v: Any, r: Any) -> tuple[FloatArray, FloatArray]:
    """Return the shares s and t, 0 to 1, at which |r + s u − t v| is least."""
    uu, vv, uv, ur, vr = dot(u, u), dot(v, v), dot(u, v), dot(u, r), dot(v, r)
    across = np.maximum(uu * vv - uv * uv, 1e-14 * uu * vv)
    s = np.clip((uv * vr - ur * vv) / across, 0.0, 1.0)
    t = np.clip((uv * s + vr) / vv, 0.0, 1.0)
    # With t at an end of its leg, the nearest point of the other leg is another.
    s = np.clip((uv * t - ur) / uu, 0.0, 1.0)
    return s, np.clip((uv * s + vr) / vv, 0.0, 1.0)
