"""Clearances, forces and errors over a whole box and all tilts, by bounds over cells of poses.

A cell is a range along each edge of the box, of azimuths and of tilts. For any direction n the
distance of two legs is at least the minimum of n · (X − Y) / |n| over the ends X and Y of the two;
with the direction of the closest points in the middle of a cell, turned to first order, the error
of this bound falls with the square of the cell.

Forces, errors and the transmission index follow from the closed form of J⁻¹, into which affine
forms of the position and of the platform's axes are put.
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np

from explorer.find import machine_values as m
from explorer.find.machine_values import BoxPoses, MachineValues
from explorer.find.over_tilts import tilt_vectors
from explorer.find.terms import Terms
from explorer.legs.clearance import PAIRS
from explorer.mechanism.design import GUIDE_ROWS, JOINTS
from explorer.numerics.affine import Affine, largest_norm
from explorer.numerics.arrays import FloatArray, dot, lengths_of
from explorer.numerics.cells import CellValues, largest_values

# Cells of poses that a proof may take, and of them at once.
MOST_CELLS = 40_000
# Random poses about each of the worst, and their distances over the whole ranges.
NEAR, NARROWER = 100, (0.1, 0.03, 0.01, 0.003, 0.001)
# Signs of errors, up to a common one.
SIGNS = np.array([*itertools.product((1.0, -1.0), repeat=5)])
# The joints' points by the actuators: b1, b2, b2, b3, b3, b4.
POINTS = [0, 1, 1, 2, 2, 3]


def demand_names(terms: Terms) -> list[str]:
    """Return the names of the demands that are bounded here, in their order."""
    names = [f"clearance of legs {i} and {j}" for i, j in PAIRS] if terms.distance > 0.0 else []
    if math.isfinite(terms.push) and (terms.force or terms.weight.any()):
        names += [f"force {joint}" for joint in JOINTS]
    if math.isfinite(terms.speed) and (terms.velocity or terms.turning):
        names += [f"speed {joint}" for joint in JOINTS]
    if terms.transmission:
        names.append("transmission index")
    if math.isfinite(terms.error):
        names.append("error")
    if math.isfinite(terms.deflection):
        names.append("deflection")
    return names


def missed_amounts(x: FloatArray, terms: Terms, poses: BoxPoses) -> FloatArray:
    """Return by how much one machine misses the demands in poses, shape (k, demands).

    Clearances are in lengths, all others over their limits; positive where a demand is missed.
    """
    return _OverPoses(x, terms).at(poses)[0]


def prove_demands(x: FloatArray, terms: Terms, cells: int | None = None) -> CellValues:
    """Return by how much each of `demand_names` is missed at most over all poses.

    Places are three in the box, an azimuth and a tilt. At most some number of cells is looked at
    for the clearances, and for all else.
    """
    clear = replace(terms, push=math.inf, speed=math.inf, transmission=0.0)
    clear = replace(clear, error=math.inf, deflection=math.inf)
    parts = [_prove(x, each, cells or MOST_CELLS) for each in (clear, replace(terms, distance=0.0))]
    return CellValues(*map(np.concatenate, zip(*parts, strict=True)))


def _prove(x: FloatArray, terms: Terms, cells: int) -> CellValues:
    over = _OverPoses(x, terms)
    if not over.kinds:
        return CellValues(np.zeros(0), np.zeros((0, 5)), np.zeros(0))
    lows, highs = ends_of(terms)
    arm = float(np.abs(x[m.B1X : m.HX]).max())
    scales = np.array([*0.5 * terms.edges, math.sin(terms.tilt) * arm, arm])

    def measure(lows: FloatArray, highs: FloatArray) -> CellValues:
        middle = 0.5 * (lows + highs)
        values, bounds = over.at(poses_of(middle), 0.5 * (highs - lows), highs[:, 4])
        places = np.broadcast_to(middle[:, None], (*values.shape, 5))
        return CellValues(values, places, bounds)

    return largest_values(measure, lows, highs, most=cells, scales=scales, resolves=False)


def ends_of(terms: Terms) -> tuple[FloatArray, FloatArray]:
    """Return the lows and highs of the five coordinates of poses."""
    lows = np.array([-1.0, -1.0, -1.0, -math.pi, 0.0])
    return lows, np.array([1.0, 1.0, 1.0, math.pi, terms.tilt])


def sample_demands(x: FloatArray, terms: Terms, count: int) -> CellValues:
    """Return by how much demands are missed at most in random poses, and near the worst of them.

    The bounds are the values. Half of the poses are on faces of the box, at the largest tilt.
    """
    random, over = np.random.default_rng(0), _OverPoses(x, terms)
    lows, highs = ends_of(terms)
    places = random.uniform(lows, highs, (count, 5))
    places[::2, :3] = np.clip(2.0 * places[::2, :3], -1.0, 1.0)
    places[::2, 4] = terms.tilt
    names = demand_names(terms)
    found = CellValues(
        np.full(len(names), -np.inf), np.zeros((len(names), 5)), np.zeros(len(names))
    )
    for width in (0.0, *NARROWER):
        if width:
            centres = np.repeat(found.places, NEAR, axis=0)
            places = centres + width * (highs - lows) * random.normal(size=centres.shape)
            places = np.clip(places, lows, highs)
        values = np.nan_to_num(over.at(poses_of(places))[0], nan=np.inf)
        rows = values.argmax(axis=0)
        best, more = values.max(axis=0), places[rows]
        is_more = best > found.values
        kept = np.where(is_more, best, found.values)
        found = CellValues(kept, np.where(is_more[:, None], more, found.places), kept)
    return found


def poses_of(places: FloatArray) -> BoxPoses:
    """Return the poses at places (..., 5)."""
    return BoxPoses(places[..., :3], tilt_vectors(places[..., 3:]))


class _OverPoses:
    """The demands of one machine in poses, and bounds of them over cells about the poses."""

    def __init__(self, x: FloatArray, terms: Terms) -> None:
        self.x, self.terms = x, terms
        self.kinds = {name.split()[0] for name in demand_names(terms)}

    def at(
        self, poses: BoxPoses, half: FloatArray | None = None, tilts: FloatArray | None = None
    ) -> tuple[FloatArray, FloatArray]:
        """Return the amounts missed in poses, and upper bounds over cells about them, (k, n) each.

        Cells are given by half their edges (k, 5) and their largest tilts (k,).
        """
        if not self.kinds:
            none = np.zeros((len(poses.places), 0))
            return none, none
        at = self.terms.values(self.x, poses)
        values = self._amounts(at, np.asarray, m.norm)
        if half is None or tilts is None:
            bounds = values
        else:
            cells = MachineOverCells(at, half, tilts)
            bounds = self._amounts(cells, upper_bound, lambda a: largest_norm(*a))
            for index in range(len(PAIRS) if "clearance" in self.kinds else 0):
                bounds[index] = self.terms.distance - cells.least_distance(at, *PAIRS[index])
        shape = (len(poses.places),)
        rows = ([np.broadcast_to(row, shape) for row in each] for each in (values, bounds))
        first, second = (np.stack(each, axis=-1) for each in rows)
        return first, second

    def _amounts(
        self, at: MachineValues, most: Callable[[Any], Any], length: Callable[[m.Vec], Any]
    ) -> list[Any]:
        """Return the amounts in the order of `demand_names`.

        `most` gives a value or its upper bound, `length` that of a vector.
        """
        terms, found = self.terms, list[Any]()
        if "clearance" in self.kinds:
            # Over cells the clearances are bounded in another way.
            found += (
                [terms.distance - each for each in at.distances]
                if most is np.asarray
                else [0.0] * 6
            )
        weight: m.Vec = tuple(terms.weight.tolist())
        needs = self.kinds & {"force", "deflection"}
        held = at.weight_forces(weight, tuple(terms.centre.tolist())) if needs else []
        speeds = [length(each) for each in at.velocities] if needs else []
        if "force" in self.kinds:
            for own, speed in zip(held, speeds, strict=True):
                push = (most(own) + terms.force * speed) / terms.push
                found.append(
                    np.maximum(push, (most(-own) + terms.force * speed) / terms.pull) - 1.0
                )
        if "speed" in self.kinds:
            x_axis: m.Vec = (1.0, 0.0, 0.0)
            for joint, point in enumerate(POINTS):
                arm = m.minus(at.ends[point], at.tool)
                along = (
                    x_axis
                    if joint in GUIDE_ROWS
                    else m.times(1.0 / at.lengths[point], at.legs[point])
                )
                lever = length(m.cross(arm, along))
                found.append((terms.velocity + terms.turning * lever) / terms.speed - 1.0)
        if "transmission" in self.kinds:
            fastest = [length(each) for each in at.own_velocities]
            found.append(terms.transmission - 1.0 / np.max(fastest, axis=0))
        if "error" in self.kinds:
            # The errors of all actuators have one size, so that signs alone tell the sums apart.
            sums = [self._signed_sum(at, signs) for signs in SIGNS.tolist()]
            worst = np.max([length(each) for each in sums], axis=0)
            found.append(terms.actuator_error * worst / terms.error - 1.0)
        if "deflection" in self.kinds:
            sizes = [np.maximum(most(own), most(-own)) for own in held]
            bends = [
                speed * (size + terms.force * speed)
                for speed, size in zip(speeds, sizes, strict=True)
            ]
            found.append(terms.flexibility * np.sum(bends, axis=0) / terms.deflection - 1.0)
        return found

    def _signed_sum(self, at: MachineValues, signs: list[float]) -> m.Vec:
        total, *others = at.velocities
        for sign, velocity in zip(signs, others, strict=True):
            total = m.plus(total, m.times(sign, velocity))
        return total


def upper_bound(value: Any) -> FloatArray:
    """Return the upper bound of an affine form, or a number."""
    return value.upper if isinstance(value, Affine) else value


class MachineOverCells(MachineValues):
    """The values of one machine over cells about poses, as affine forms in five coordinates.

    Args:
        at: The machine in the middles of the cells.
        half: Half the edges of the cells, shape (k, 5): three in the box, azimuth and tilt.
        tilts: Largest tilts of the cells, shape (k,).
    """

    def __init__(self, at: MachineValues, half: FloatArray, tilts: FloatArray) -> None:
        self.x = [float(np.squeeze(each)) for each in at.x]  # type: ignore[assignment]
        k, x = len(half), self.x
        a, b = half[:, 4], half[:, 3]
        size = 2.0 * np.sin(0.5 * tilts)
        bends = 0.5 * (a**2 + 2.0 * (1.0 + size) * a * b + (size + size**2) * b**2)
        tilt = lengths_of(at.poses.tilts)
        turn = np.zeros((k, 3))
        turn[:, :2] = at.poses.tilts / np.where(tilt > 0.0, tilt, 1.0)[:, None]
        turn[tilt == 0.0, 0] = 1.0
        # The platform's turn by the azimuth is about ẑ less the tilted ẑ.
        z, up = np.array([0.0, 0.0, 1.0]), tilt[:, None]
        around = z - np.cos(up) * z - np.sin(up) * np.cross(turn, z)

        def axis(column: m.Vec) -> m.Vec:
            v = _rows(column, k)
            slopes = np.zeros((k, 3, 5))
            slopes[:, :, 3], slopes[:, :, 4] = (
                b[:, None] * np.cross(around, v),
                a[:, None] * np.cross(turn, v),
            )
            x, y, z = (Affine(v[:, i], slopes[:, i], bends) for i in range(3))
            return x, y, z

        self.u, self.v, self.w = map(axis, (at.u, at.v, at.w))
        along = 0.5 * x[m.SIZE] * at.edges * half[:, :3]
        c, s = math.cos(x[m.BOX_YAW]), math.sin(x[m.BOX_YAW])
        steps = np.zeros((k, 3, 5))
        steps[:, 0, 0], steps[:, 0, 1] = c * along[:, 0], -s * along[:, 1]
        steps[:, 1, 0], steps[:, 1, 1] = s * along[:, 0], c * along[:, 1]
        steps[:, 2, 2] = along[:, 2]
        tool = _rows(at.tool, k)
        x_, y_, z_ = (Affine(tool[:, i], steps[:, i], np.zeros(k)) for i in range(3))
        self.tool = x_, y_, z_
        self.p = m.minus(self.tool, self.of_platform((x[m.TX], x[m.TY], x[m.TZ])))

    def _base(self, leg: int) -> m.Vec:
        """Return the base end of a leg, 0 to 3."""
        if leg in (0, 3):
            return (self.x[m.A3X], self.x[m.A3Y], 0.0) if leg else (0.0, 0.0, 0.0)
        return self.ends[leg][0], 0.0, 0.0

    def least_distance(self, at: MachineValues, first: int, second: int) -> FloatArray:
        """Return lower bounds of the distance of two legs, 1 to 4, shape (k,)."""
        i, j = first - 1, second - 1
        k = len(at.poses.places)
        ends = [(self._base(leg), self.ends[leg]) for leg in (i, j)]
        (a, p), (b, q) = ([_centres(each, k) for each in pair] for pair in ends)
        (da, dp), (db, dq) = ([_slopes(each, k) for each in pair] for pair in ends)
        u, v = p - a, q - b
        s, t = m.closest_shares(u.T, v.T, (a - b).T)
        n = a + s[:, None] * u - b - t[:, None] * v
        n = n / np.maximum(lengths_of(n), 1e-300)[:, None]
        turn = _normal_rates(n, u, dp - da, v, dq - db, s, t)
        x, y, z = (Affine(n[:, axis], turn[:, axis], np.zeros(k)) for axis in range(3))
        apart = [
            np.broadcast_to(m.dot((x, y, z), m.minus(end, other)).lower, (k,))
            for end in ends[0]
            for other in ends[1]
        ]
        least = np.min(apart, axis=0)
        return np.where(least > 0.0, least / largest_norm(x, y, z), 0.0)


def _centres(vector: m.Vec, count: int) -> FloatArray:
    return _rows(tuple(getattr(each, "centre", each) for each in vector), count)  # type: ignore[arg-type]


def _slopes(vector: m.Vec, count: int) -> FloatArray:
    none = np.zeros((count, 5))
    return np.stack([getattr(each, "slopes", none) for each in vector], axis=1)


def _normal_rates(
    n: FloatArray,
    u: FloatArray,
    du: FloatArray,
    v: FloatArray,
    dv: FloatArray,
    s: FloatArray,
    t: FloatArray,
) -> FloatArray:
    """Return the derivatives (k, 3, 5) of a direction that stays across two segments.

    A segment counts if its closest point, at s or t, lies in its interior.
    """
    f, g = -np.einsum("ki,kic->kc", n, du), -np.einsum("ki,kic->kc", n, dv)
    inner_u, inner_v = ((each > 0.0) & (each < 1.0) for each in (s, t))
    uu, vv, uv = dot(u, u), dot(v, v), dot(u, v)
    determinant = uu * vv - uv * uv
    both = inner_u & inner_v & (determinant > 1e-9 * uu * vv)
    safe = np.where(both, determinant, 1.0)[:, None]
    a = np.where(both[:, None], (f * vv[:, None] - g * uv[:, None]) / safe, 0.0)
    b = np.where(both[:, None], (g * uu[:, None] - f * uv[:, None]) / safe, 0.0)
    a = np.where((inner_u & ~inner_v)[:, None], f / uu[:, None], a)
    b = np.where((inner_v & ~inner_u)[:, None], g / vv[:, None], b)
    return u[:, :, None] * a[:, None] + v[:, :, None] * b[:, None]


def _rows(vector: m.Vec, count: int) -> FloatArray:
    """Return a vector of arrays as rows, shape (count, 3)."""
    return np.stack([_row(each, count) for each in vector], axis=-1)


def _row(value: Any, count: int) -> FloatArray:
    return np.broadcast_to(np.asarray(value, dtype=np.float64), (count,))
