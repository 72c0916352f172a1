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
from functools import cached_property

import numpy as np

from explorer.find import machine_values as m
from explorer.find.demands import Demand
from explorer.find.machine_values import MachineValues
from explorer.find.terms import Terms
from explorer.legs.clearance import PAIRS
from explorer.numerics.affine import Affine, largest_norm
from explorer.numerics.arrays import FloatArray, dot, lengths_of
from explorer.numerics.cells import CellValues, largest_values

# Cells of poses that a proof may take.
MOST_CELLS = 40_000
# Random poses about each of the worst, and their distances over the whole ranges.
NEAR, NARROWER = 100, (0.1, 0.03, 0.01, 0.003, 0.001)


def prove_demand(
    demand: Demand, x: FloatArray, terms: Terms, most: int | None = None
) -> CellValues:
    """Return by how much each value of a demand misses its limit at most over all poses.

    At most some number of cells is looked at.
    """
    lows, highs = ends_of(terms)

    def measure(lows: FloatArray, highs: FloatArray) -> CellValues:
        middle = 0.5 * (lows + highs)
        at = terms.values(x, middle)
        cells = MachineOverCells(at, 0.5 * (highs - lows), highs[:, 4])
        values, bounds = demand.missed_rows(at), demand.missed_rows(cells)
        return CellValues(values, np.broadcast_to(middle[:, None], (*values.shape, 5)), bounds)

    most = most or MOST_CELLS
    return largest_values(measure, lows, highs, most=most, along_one=True, resolves=False)


def ends_of(terms: Terms) -> tuple[FloatArray, FloatArray]:
    """Return the lows and highs of the five coordinates of poses."""
    lows = np.array([-1.0, -1.0, -1.0, -math.pi, 0.0])
    return lows, np.array([1.0, 1.0, 1.0, math.pi, terms.tilt])


def look_at(demand: Demand, at: MachineValues) -> CellValues:
    """Return by how much a demand is missed at most in some poses; the bounds are the values."""
    missed = demand.missed_rows(at)
    worst = missed.max(axis=0)
    return CellValues(worst, at.poses[missed.argmax(axis=0)], worst.copy())


def sample_demand(
    demand: Demand, x: FloatArray, terms: Terms, count: int, known: FloatArray
) -> CellValues:
    """Return by how much a demand is missed at most in known and random poses, and near the worst.

    The bounds are the values. Half of the random poses are on faces of the box, at the largest
    tilt.
    """
    random, (lows, highs) = np.random.default_rng(0), ends_of(terms)
    poses = random.uniform(lows, highs, (count, 5))
    poses[::2, :3] = np.clip(2.0 * poses[::2, :3], -1.0, 1.0)
    poses[::2, 4] = terms.tilt
    found = look_at(demand, terms.values(x, np.concatenate([known, poses])))
    for width in NARROWER:
        centres = np.repeat(found.places, NEAR, axis=0)
        near = centres + width * (highs - lows) * random.normal(size=centres.shape)
        near = np.clip(near, lows, highs)
        found = found.merged(look_at(demand, terms.values(x, near)))
    return found


class MachineOverCells(MachineValues):
    """The values of one machine over cells about poses, as affine forms in five coordinates.

    Args:
        at: The machine in the middles of the cells.
        half: Half the edges of the cells, shape (k, 5): three in the box, azimuth and tilt.
        tilts: Largest tilts of the cells, shape (k,).
    """

    def __init__(self, at: MachineValues, half: FloatArray, tilts: FloatArray) -> None:
        self.x = [float(np.squeeze(each)) for each in at.x]
        self.middle, self.poses = at, at.poses
        self.home, self.home_axes = at.home, at.home_axes
        k, x = len(half), self.x
        a, b = half[:, 4], half[:, 3]
        size = 2.0 * np.sin(0.5 * tilts)
        bends = 0.5 * (a**2 + 2.0 * (1.0 + size) * a * b + (size + size**2) * b**2)
        azimuth, tilt = at.poses[:, 3], at.poses[:, 4]
        turn = np.column_stack([np.cos(azimuth), np.sin(azimuth), np.zeros(k)])
        # The platform's turn by the azimuth is about ẑ less the tilted ẑ.
        z, up = np.array([0.0, 0.0, 1.0]), tilt[:, None]
        around = z - np.cos(up) * z - np.sin(up) * np.cross(turn, z)

        def vector(middle: m.Vec, slopes: FloatArray, rest: FloatArray) -> m.Vec:
            x, y, z = (Affine(each, slopes[:, i], rest) for i, each in enumerate(middle))
            return x, y, z

        def axis(middle: m.Vec) -> m.Vec:
            v, slopes = m.rows_of(middle), np.zeros((k, 3, 5))
            slopes[:, :, 3] = b[:, None] * np.cross(around, v)
            slopes[:, :, 4] = a[:, None] * np.cross(turn, v)
            return vector(middle, slopes, bends)

        self.u, self.v, self.w = map(axis, (at.u, at.v, at.w))
        along = 0.5 * x[m.SIZE] * at.edges * half[:, :3]
        c, s = math.cos(x[m.BOX_YAW]), math.sin(x[m.BOX_YAW])
        steps = np.zeros((k, 3, 5))
        steps[:, 0, 0], steps[:, 0, 1] = c * along[:, 0], -s * along[:, 1]
        steps[:, 1, 0], steps[:, 1, 1] = s * along[:, 0], c * along[:, 1]
        steps[:, 2, 2] = along[:, 2]
        self.tool = vector(at.tool, steps, np.zeros(k))
        self.p = m.minus(self.tool, self.of_platform((x[m.TX], x[m.TY], x[m.TZ])))

    @cached_property
    def distances(self) -> list[FloatArray]:
        """Lower bounds of the distances of the pairs of legs, shape (k,) each."""
        return [self._least_distance(i - 1, j - 1) for i, j in PAIRS]

    def _least_distance(self, i: int, j: int) -> FloatArray:
        k = len(self.poses)
        ends = [(self.bases[leg], self.ends[leg]) for leg in (i, j)]
        ((a, da), (p, dp)), ((b, db), (q, dq)) = (
            [_linear(each, k) for each in pair] for pair in ends
        )
        u, v = p - a, q - b
        s, t = m.closest_shares(u.T, v.T, (a - b).T)
        n = a + s[:, None] * u - b - t[:, None] * v
        n = n / np.maximum(lengths_of(n), 1e-300)[:, None]
        turn = _normal_rates(n, u, dp - da, v, dq - db, s, t)
        x, y, z = (Affine(n[:, axis], turn[:, axis], np.zeros(k)) for axis in range(3))
        pairs = itertools.product(*ends)
        apart = [m.dot((x, y, z), m.minus(end, other)).lower for end, other in pairs]
        least = np.min(apart, axis=0)
        return np.where(least > 0.0, least / largest_norm(x, y, z), 0.0)


def _linear(vector: m.Vec, count: int) -> tuple[FloatArray, FloatArray]:
    """Return the centre (count, 3) and the slopes (count, 3, 5) of a vector."""
    none = np.zeros(5)
    centre = [np.broadcast_to(getattr(each, "centre", each), count) for each in vector]
    slopes = [np.broadcast_to(getattr(each, "slopes", none), (count, 5)) for each in vector]
    return np.stack(centre, axis=1), np.stack(slopes, axis=1)


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
    inner_u, inner_v = ((each > 0.0) & (each < 1.0) for each in (s, t))
    uu, vv, uv = dot(u, u), dot(v, v), np.where(inner_u & inner_v, dot(u, v), 0.0)
    determinant = uu * vv - uv * uv
    is_steady = determinant > 1e-9 * uu * vv
    safe = np.where(is_steady, determinant, 1.0)
    f, g = (
        np.where(inner & is_steady, -np.einsum("ki,kic->ck", n, each) / safe, 0.0).T
        for inner, each in ((inner_u, du), (inner_v, dv))
    )
    uu, vv, uv = uu[:, None], vv[:, None], uv[:, None]
    a, b = f * vv - g * uv, g * uu - f * uv
    return u[:, :, None] * a[:, None] + v[:, :, None] * b[:, None]
