"""Clearances, forces and errors over a whole box and all tilts, by bounds over cells of poses.

A cell is a range along each edge of the box, of azimuths and of tilts. For any direction n the
distance of two legs is at least the minimum of n · (X − Y) / |n| over the ends X and Y of the two;
with the direction of the closest points in the middle of a cell, turned to first order, the error
of this bound falls with the square of the cell.

Forces follow from J⁻¹. Seen from the platform, the rows of J change as the directions of the legs
do, by E, and J⁻¹ becomes J⁻¹ (1 + E J⁻¹)⁻¹. With A an upper bound of |E J⁻¹|, entry by entry, the
last factor is within A (1 − A)⁻¹ of the identity.
"""

from __future__ import annotations

import itertools
import math
from typing import Any, NamedTuple

import numpy as np

from explorer.find import machine_values as m
from explorer.find.machine_values import BoxPoses, MachineValues
from explorer.find.over_tilts import tilt_vectors
from explorer.find.terms import Terms
from explorer.legs.clearance import PAIRS
from explorer.mechanism.design import JOINTS, LENGTH_ROWS
from explorer.numerics.arrays import FloatArray, dot, lengths_of
from explorer.numerics.cells import CellValues, largest_values

# Cells of poses that a proof may take, and of them at once.
MOST_CELLS = 40_000
# Signs of errors, up to a common one.
SIGNS = np.array([*itertools.product((1.0, -1.0), repeat=5)])
# The joints' points by the actuators: b1, b2, b2, b3, b3, b4.
POINTS = [0, 1, 1, 2, 2, 3]


class Amounts(NamedTuple):
    """The names and values of demands over poses, shape (..., k); see `demand_names`."""

    names: list[str]
    values: FloatArray


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


def prove_demands(x: FloatArray, terms: Terms) -> CellValues:
    """Return by how much each of `demand_names` is missed at most over all poses.

    Places are three in the box, an azimuth and a tilt.
    """
    over = _OverPoses(x, terms)
    names = demand_names(terms)
    if not names:
        return CellValues(np.zeros(0), np.zeros((0, 5)), np.zeros(0))
    lows = np.array([-1.0, -1.0, -1.0, -math.pi, 0.0])
    highs = np.array([1.0, 1.0, 1.0, math.pi, terms.tilt])
    arm = float(lengths_of(over.arms).max())
    scales = np.array([*0.5 * terms.edges, math.sin(terms.tilt) * arm, arm])

    def measure(lows: FloatArray, highs: FloatArray) -> CellValues:
        middle = 0.5 * (lows + highs)
        values, bounds = over.at(poses_of(middle), 0.5 * (highs - lows), highs[:, 4])
        places = np.broadcast_to(middle[:, None], (*values.shape, 5))
        return CellValues(values, places, bounds)

    return largest_values(measure, lows, highs, most=MOST_CELLS, scales=scales, resolves=False)


def poses_of(places: FloatArray) -> BoxPoses:
    """Return the poses at places (..., 5)."""
    return BoxPoses(places[..., :3], tilt_vectors(places[..., 3:]))


class _OverPoses:
    """The demands of one machine in poses, and bounds of them over cells about the poses."""

    def __init__(self, x: FloatArray, terms: Terms) -> None:
        self.x, self.terms = x, terms
        b = np.zeros((4, 3))
        b[0, :2], b[1, 0], b[2, 0] = x[m.B1X : m.B2], x[m.B2], x[m.B3]
        # From the tool in the platform: the ends of the legs, and the payload's centre.
        self.arms = b - x[m.TX : m.TILT]
        self.centre = terms.centre - x[m.TX : m.TILT]
        self.needs_rates = any(
            not name.startswith("clearance") for name in demand_names(terms)
        )

    def at(
        self, poses: BoxPoses, half: FloatArray | None = None, tilts: FloatArray | None = None
    ) -> tuple[FloatArray, FloatArray]:
        """Return the amounts missed in poses, and upper bounds over cells about them, (k, n) each.

        Cells are given by half their edges (k, 5) and their largest tilts (k,).
        """
        terms, k = self.terms, len(poses.places)
        at = terms.values(self.x, poses)
        rotation = np.stack([_rows(each, k) for each in (at.u, at.v, at.w)], axis=-1)
        cells = None if half is None or tilts is None else _Cells(self, rotation, poses, half, tilts)
        values: list[Any] = []
        bounds: list[Any] = []
        if terms.distance > 0.0:
            least = cells.least_distances(at) if cells else np.stack(at.distances, axis=-1)
            values += [terms.distance - each for each in at.distances]
            bounds += [terms.distance - each for each in least.T]
        if self.needs_rates:
            for value, bound in self._of_rates(at, rotation, cells):
                values.append(value)
                bounds.append(bound)
        return np.stack(values, axis=-1), np.stack(bounds, axis=-1)

    def _of_rates(
        self, at: MachineValues, rotation: FloatArray, cells: _Cells | None
    ) -> list[tuple[FloatArray, FloatArray]]:
        """Return values and bounds of what follows from J⁻¹, each of shape (k,)."""
        terms, k = self.terms, len(rotation)
        velocity = np.stack([_rows(each, k) for each, _ in at.rates], axis=1)
        turning = np.stack([_rows(each, k) for _, each in at.rates], axis=1)

        def speeds(arms: FloatArray) -> FloatArray:
            """Return the speeds of points (p, 3) for unit rates, shape (k, 6, p)."""
            arm = arms @ np.swapaxes(rotation, 1, 2)
            return lengths_of(velocity[:, :, None] + np.cross(turning[:, :, None], arm[:, None]))

        of_points, tool = speeds(self.arms), lengths_of(velocity)
        centre = self.centre @ np.swapaxes(rotation, 1, 2)
        own = velocity + np.cross(turning, centre[:, None])
        held = -own @ terms.weight
        spread, widened = (0.0 * tool,) * 2
        factor = np.zeros((k, 6, 6))
        if cells is not None:
            factor = cells.change_of_inverse(at, of_points)
            spread = cells.angle[:, None] * float(np.linalg.norm(terms.weight)) * lengths_of(own)
            widened = spread + _times(np.abs(held) + spread, factor)
        fastest = tool + _times(tool, factor)
        found: list[tuple[FloatArray, FloatArray]] = []
        names = {name.split()[0] for name in demand_names(terms)}
        if "force" in names:
            found += self._forces(held, widened, tool, fastest)
        if "speed" in names:
            found += self._speeds(at, rotation, cells)
        if "transmission" in names:
            index = range(6), POINTS
            slowest = of_points[:, *index]
            bound = slowest + np.stack(
                [_times(of_points[:, :, point], factor)[:, i] for i, point in enumerate(POINTS)], -1
            )
            found.append(tuple(terms.transmission - 1.0 / each.max(axis=1) for each in (slowest, bound)))
        if "error" in names:
            sums = np.concatenate([np.ones((32, 1)), SIGNS], axis=1) @ velocity
            worst = lengths_of(sums).max(axis=1)
            more = worst + (fastest - tool).sum(axis=1)
            found.append(tuple(terms.actuator_error * each / terms.error - 1.0 for each in (worst, more)))
        if "deflection" in names:
            soft = np.swapaxes(velocity, 1, 2) @ velocity
            bend = lengths_of((np.swapaxes(velocity, 1, 2) @ held[..., None])[..., 0])
            bend = bend + terms.force * np.linalg.eigvalsh(soft)[:, -1]
            most, all_most = np.abs(held) + terms.force * tool, np.abs(held) + widened + terms.force * fastest
            more = bend + (fastest * all_most - tool * most).sum(axis=1)
            found.append(tuple(terms.flexibility * each / terms.deflection - 1.0 for each in (bend, more)))
        return found

    def _forces(
        self, held: FloatArray, widened: FloatArray, tool: FloatArray, fastest: FloatArray
    ) -> list[tuple[FloatArray, FloatArray]]:
        push, pull, force = self.terms.push, self.terms.pull, self.terms.force
        value = np.maximum((held + force * tool) / push, (force * tool - held) / pull) - 1.0
        up, down = held + widened + force * fastest, widened + force * fastest - held
        bound = np.maximum(up / push, down / pull) - 1.0
        return [*zip(value.T, bound.T, strict=True)]

    def _speeds(
        self, at: MachineValues, rotation: FloatArray, cells: _Cells | None
    ) -> list[tuple[FloatArray, FloatArray]]:
        terms, k = self.terms, len(rotation)
        arms = self.arms @ np.swapaxes(rotation, 1, 2)
        found: list[tuple[FloatArray, FloatArray]] = []
        for joint, point in enumerate(POINTS):
            if joint in LENGTH_ROWS:
                along = _rows(at.legs[point], k) / _row(at.lengths[point], k)[:, None]
            else:
                along = np.broadcast_to([1.0, 0.0, 0.0], (k, 3))
            arm = float(lengths_of(self.arms[point]))
            lever = lengths_of(np.cross(arms[:, point], along))
            more = lever if cells is None else np.minimum(arm, lever + arm * cells.turns(at)[:, joint])
            found.append(
                tuple((terms.velocity + terms.turning * each) / terms.speed - 1.0 for each in (lever, more))
            )
        return found


class _Cells:
    """Cells about poses of one machine: how far its points move and turn within them."""

    def __init__(
        self,
        over: _OverPoses,
        rotation: FloatArray,
        poses: BoxPoses,
        half: FloatArray,
        tilts: FloatArray,
    ) -> None:
        x, edges = over.x, over.terms.edges
        self.over, k = over, len(rotation)
        size = 2.0 * np.sin(0.5 * tilts)
        a, b = half[:, 4], half[:, 3]
        self.angle: FloatArray = a + size * b
        along = 0.5 * x[m.SIZE] * edges * half[:, :3]
        c, s = math.cos(x[m.BOX_YAW]), math.sin(x[m.BOX_YAW])
        axes = np.array([[c, s, 0.0], [-s, c, 0.0], [0.0, 0.0, 1.0]])
        tilt = lengths_of(poses.tilts)
        turn = poses.tilts / np.where(tilt > 0.0, tilt, 1.0)[:, None]
        by_tilt = np.concatenate([turn, np.zeros((k, 1))], axis=1)
        by_tilt[tilt == 0.0, 0] = 1.0
        # The platform's turn by the azimuth is about ẑ less the tilted ẑ.
        z, up = np.array([0.0, 0.0, 1.0]), tilt[:, None]
        tilted = np.cos(up) * z + np.sin(up) * np.cross(by_tilt, z)
        arms = over.arms @ np.swapaxes(rotation, 1, 2)
        columns = [np.broadcast_to(along[:, i, None, None] * axes[i], arms.shape) for i in range(3)]
        columns.append(b[:, None, None] * np.cross((z - tilted)[:, None], arms))
        columns.append(a[:, None, None] * np.cross(by_tilt[:, None], arms))
        # Derivatives of the platform ends by the coordinates over half the cell, (k, 4, 3, 5).
        self.steps = np.stack(columns, axis=-1)
        bends = 0.5 * (a**2 + 2.0 * (1.0 + size) * a * b + (size + size**2) * b**2)
        self.errors = bends[:, None] * lengths_of(over.arms)
        self.ways = lengths_of(along)[:, None] + self.angle[:, None] * lengths_of(over.arms)

    def turns(self, at: MachineValues) -> FloatArray:
        """Return by how much the directions of the joints turn in the platform, shape (k, 6)."""
        found = np.repeat(self.angle[:, None], 6, axis=1)
        lengths = np.stack([_row(each, len(found)) for each in at.lengths], axis=-1)
        least = lengths - self.ways
        tilt = np.where(least > 0.0, self.ways / np.where(least > 0.0, least, 1.0), np.inf)
        found[:, LENGTH_ROWS] += tilt
        return found

    def change_of_inverse(self, at: MachineValues, of_points: FloatArray) -> FloatArray:
        """Return upper bounds of the change of the last factor of J⁻¹, infinite without, (k, 6, 6)."""
        with np.errstate(invalid="ignore"):
            asked = self.turns(at)[:, :, None] * np.swapaxes(of_points[:, :, POINTS], 1, 2)
        small = np.isfinite(asked).all(axis=(1, 2)) & (asked < 1e3).all(axis=(1, 2))
        asked = np.where(small[:, None, None], asked, 0.0)
        one = np.eye(6)
        inverse = np.linalg.inv(one - asked + 1e-300)
        # A matrix of no negative entries has such an inverse if its powers vanish.
        small &= (inverse >= 0.0).all(axis=(1, 2))
        return np.where(small[:, None, None], inverse - one, np.inf)

    def least_distances(self, at: MachineValues) -> FloatArray:
        """Return lower bounds of the distances of the pairs of legs, shape (k, 6)."""
        k = len(self.steps)
        ends = np.stack([_rows(each, k) for each in at.ends], axis=1)
        base = ends - np.stack([_rows(each, k) for each in at.legs], axis=1)
        moves = np.zeros_like(self.steps)
        moves[:, 1:3, 0] = self.steps[:, 1:3, 0]
        return np.stack([self._least(base, moves, ends, i - 1, j - 1) for i, j in PAIRS], axis=-1)

    def _least(
        self, base: FloatArray, moves: FloatArray, ends: FloatArray, i: int, j: int
    ) -> FloatArray:
        u, v = ends[:, i] - base[:, i], ends[:, j] - base[:, j]
        du, dv = self.steps[:, i] - moves[:, i], self.steps[:, j] - moves[:, j]
        s, t = m.closest_shares(u.T, v.T, (base[:, i] - base[:, j]).T)
        n = base[:, i] + s[:, None] * u - base[:, j] - t[:, None] * v
        distance = lengths_of(n)
        n = n / np.maximum(distance, 1e-300)[:, None]
        turn = _normal_rates(n, u, du, v, dv, s, t)
        fastest, least = np.zeros(len(n)), np.full(len(n), np.inf)
        for p, dp in ((base[:, i], moves[:, i]), (ends[:, i], self.steps[:, i])):
            for q, dq in ((base[:, j], moves[:, j]), (ends[:, j], self.steps[:, j])):
                w, dw = p - q, dp - dq
                fastest = np.maximum(fastest, lengths_of(np.abs(dw).sum(axis=2)))
                linear = np.einsum("kic,ki->kc", turn, w) + np.einsum("kic,ki->kc", dw, n)
                square = np.einsum("kic,kid->kcd", turn, dw)
                both = 0.5 * np.abs(square + np.swapaxes(square, 1, 2))
                own = np.einsum("kcc->kc", square)
                lower = dot(n, w) - np.abs(linear).sum(axis=1)
                lower -= both.sum(axis=(1, 2)) - np.einsum("kcc->k", both)
                least = np.minimum(least, lower + np.minimum(own, 0.0).sum(axis=1))
        tilting = np.abs(np.einsum("kic,ki->kc", turn, n)).sum(axis=1)
        length = np.sqrt(
            1.0 + 2.0 * tilting + np.abs(np.einsum("kic,kid->kcd", turn, turn)).sum(axis=(1, 2))
        )
        bound = np.maximum(distance - fastest, np.where(least > 0.0, least / length, 0.0))
        return np.maximum(bound - self.errors[:, i] - self.errors[:, j], 0.0)


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
    inner_u, inner_v = ((0.0 < each) & (each < 1.0) for each in (s, t))
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


def _times(values: FloatArray, factor: FloatArray) -> FloatArray:
    """Return Σ_i values_i factor_ij, shape (k, 6), where infinity times zero is zero."""
    with np.errstate(invalid="ignore"):
        return np.nan_to_num((values[:, :, None] * factor).sum(axis=1), nan=np.inf, posinf=np.inf)
