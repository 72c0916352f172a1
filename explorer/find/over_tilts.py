"""Lengths, margins, swings and the order of the carriages over a whole box and all tilts, proven.

At one orientation closed forms tell the worst position of the box: a longest length is convex in
the position, so that its maximum is at a corner, and so is how far a leg is within a cone of less
than a right angle; a shortest length is the distance of the box from a point or a line; the margins
are linear.

Over a cell of azimuths and tilts a vector R v of the platform is within e |v| of a convex
combination of its values at the four corners, with e of the order of the square of the cell. A
slack that is concave in such vectors is at least the least one of the corners, less e times its
rate. That of a shortest length is not: for it the half-space behind a plane that touches the box
stands for the box, since the distance from that is linear and no greater.
"""

from __future__ import annotations

import itertools
import math

import numpy as np

from explorer.find import machine_values as m
from explorer.find.machine_values import HOME, BoxPoses
from explorer.find.terms import Terms
from explorer.mechanism.design import LENGTHS
from explorer.numerics.arrays import FloatArray, lengths_of
from explorer.numerics.cells import CellValues, corners_of_cells, largest_values

CORNERS = np.array([*itertools.product((-1.0, 1.0), repeat=3)])
"""The corners of the box as places, shape (8, 3)."""

SWINGS = ("a1", "a3", "b1", "b2", "b3", "b4")
"""The joints whose swing is bounded, in the order of `MachineValues.swings`."""

# Cells of azimuths and tilts that a proof may take.
MOST_CELLS = 12_000


def sides_of(x: FloatArray, terms: Terms) -> FloatArray:
    """Return the signs of δ1, δ2, δ3 and of d3 − d1 at home, shape (4,)."""
    at = terms.values(x, HOME)
    return np.sign([float(np.squeeze(each)) for each in (*at.margins, at.order)])


def limit_names(terms: Terms) -> list[str]:
    """Return the names of the limits that are proven here, in their order."""
    names = [*(f"longest {name}" for name in LENGTHS), *(f"shortest {name}" for name in LENGTHS)]
    names += [*(f"margin δ{i}" for i in (1, 2, 3)), "carriage order"]
    return names + [f"swing {joint}" for joint in SWINGS if terms.swing < math.pi]


def prove_limits(x: FloatArray, terms: Terms, ranges: FloatArray) -> CellValues:
    """Return by how much each limit is missed at most over all poses, over the box's diagonal.

    The order is that of `limit_names`; a place is an azimuth and a tilt, at which `worst_place`
    returns the worst position. Swings count by the distance of a leg's end from its cone.

    Args:
        x: The machine.
        terms: The requirement.
        ranges: Shortest and longest length of each leg, shape (4, 2).
    """
    over = _OverTilts(x, terms, ranges)

    def measure(lows: FloatArray, highs: FloatArray) -> CellValues:
        places = corners_of_cells(lows, highs)
        azimuths, tilts = (highs - lows).T
        # Second derivatives of R v by the tilt are at most |v|, by the azimuth |v| times this.
        turning = np.sin(highs[:, 1]) + 2.0 * (1.0 - np.cos(highs[:, 1]))
        error = 0.125 * (tilts**2 + azimuths**2 * turning)
        slacks = over.slacks(places.reshape(-1, 2)).min(axis=-1).reshape(len(lows), 4, -1)
        worst, least = slacks.argmin(axis=1), slacks.min(axis=1)
        bounds = least.copy()
        bounds[:, 4:8] = over.bound_shortest(places)
        bounds -= error[:, None] * over.rates
        return CellValues(-least, places[np.arange(len(lows))[:, None], worst], -bounds)

    ends = np.array([-math.pi, 0.0]), np.array([math.pi, terms.tilt])
    return largest_values(measure, *ends, most=MOST_CELLS)


def worst_place(
    x: FloatArray, terms: Terms, ranges: FloatArray, index: int, place: FloatArray
) -> BoxPoses:
    """Return the pose at an azimuth and a tilt that misses a limit most, of one row."""
    over = _OverTilts(x, terms, ranges)
    corner = int(over.slacks(place[None])[0, index].argmin())
    nearest = over.nearest_places(place[None])[0]
    places = nearest[index - 4] if 4 <= index < 8 else CORNERS[corner]
    return BoxPoses(places[None], tilt_vectors(place[None]))


def tilt_vectors(places: FloatArray) -> FloatArray:
    """Return the vectors of turns of azimuths and tilts (..., 2)."""
    azimuth, tilt = places[..., 0], places[..., 1]
    return np.stack([tilt * np.cos(azimuth), tilt * np.sin(azimuth)], axis=-1)


class _OverTilts:
    """The slacks of the limits of one machine at orientations, over the whole box."""

    def __init__(self, x: FloatArray, terms: Terms, ranges: FloatArray) -> None:
        self.x, self.terms, self.ranges = x, terms, ranges
        self.home, self.sides = terms.values(x, HOME), sides_of(x, terms)
        tool = x[m.TX : m.TILT]
        b = np.zeros((4, 3))
        b[0, :2], b[1, 0], b[2, 0] = x[m.B1X : m.B2], x[m.B2], x[m.B3]
        self.arms = b - tool
        arms, half = lengths_of(self.arms), 0.5 * x[m.SIZE] * terms.edges
        farthest = float(lengths_of(np.abs(x[m.HX : m.BOX_YAW]) + math.hypot(*half)))
        span = abs(float(x[m.B3] - x[m.B2]))
        rates = [*arms, *arms, farthest, farthest + math.hypot(tool[1], tool[2])]
        rates += [float(lengths_of(tool)), span]
        if terms.swing < math.pi:
            cosine, base = math.cos(terms.swing), farthest + math.hypot(*x[:2])
            rates += [(1.0 + cosine) * arms[0], (1.0 + cosine) * arms[3]]
            # For legs 2 and 3 a product of two turning vectors is interpolated.
            rates += [base + cosine * arms[0], *(farthest + (4.0 + cosine) * arms[1:3])]
            rates += [base + cosine * arms[3]]
        self.rates: FloatArray = np.array(rates)

    def slacks(self, tilts: FloatArray) -> FloatArray:
        """Return the slacks at azimuths and tilts (n, 2) in the corners, shape (n, limits, 8).

        Those of shortest lengths are the same in all corners.
        """
        n = len(tilts)
        vectors = np.repeat(tilt_vectors(tilts), 8, axis=0)
        at = self.terms.values(self.x, BoxPoses(np.tile(CORNERS, (n, 1)), vectors))
        rows = [high - length for length, high in zip(at.lengths, self.ranges[:, 1], strict=True)]
        rows += [*np.repeat(self._shortest(tilts).T, 8, axis=1)]
        signed = zip(self.sides, (*at.margins, at.order), strict=True)
        rows += [side * value for side, value in signed]
        for index in (8, 9, 10):
            rows[index] = rows[index] - self.terms.margin
        if self.terms.swing < math.pi:
            legs = [at.lengths[i] for i in (0, 3, 0, 1, 2, 3)]
            cosine = math.cos(self.terms.swing)
            swings = zip(at.swings(self.home), legs, strict=True)
            rows += [(value - cosine) * length for value, length in swings]
        table = np.stack([np.broadcast_to(row, (8 * n,)) for row in rows], axis=-1)
        return np.swapaxes(table.reshape(n, 8, -1), 1, 2)

    def _apexes(self, tilts: FloatArray) -> FloatArray:
        """Return the points from which lengths to the tool are those of the legs, (..., 4, 3).

        They are relative to the centre of the box, in the frame of the box, or for legs 2 and 3 of
        the base.
        """
        flat = tilts.reshape(-1, 2)
        rotation = self.terms.tool_at(
            self.x, BoxPoses(np.zeros((len(flat), 3)), tilt_vectors(flat))
        )[1]
        base = np.zeros((4, 3))
        base[3, :2] = self.x[:2]
        found = base - np.einsum("nij,lj->nli", rotation, self.arms) - self.x[m.HX : m.BOX_YAW]
        c, s = math.cos(self.x[m.BOX_YAW]), math.sin(self.x[m.BOX_YAW])
        turned = found[:, [0, 3]]
        found[:, 0::3] = np.stack(
            [
                c * turned[..., 0] + s * turned[..., 1],
                c * turned[..., 1] - s * turned[..., 0],
                turned[..., 2],
            ],
            axis=-1,
        )
        found[:, 1:3, 0] = 0.0
        return found.reshape(*tilts.shape[:-1], 4, 3)

    @property
    def _halves(self) -> FloatArray:
        """Half the edges of the box, and of its shadow along the guide, shape (4, 3)."""
        half = 0.5 * self.x[m.SIZE] * self.terms.edges
        c, s = abs(math.cos(self.x[m.BOX_YAW])), abs(math.sin(self.x[m.BOX_YAW]))
        shadow = np.array([0.0, s * half[0] + c * half[1], half[2]])
        return np.array([half, shadow, shadow, half])

    def _shortest(self, tilts: FloatArray) -> FloatArray:
        apexes, half = self._apexes(tilts), self._halves
        return lengths_of(apexes - np.clip(apexes, -half, half)) - self.ranges[:, 0]

    def bound_shortest(self, places: FloatArray) -> FloatArray:
        """Return lower bounds of the slacks of shortest lengths over cells, shape (n, 4).

        The cells are given by their corners, (n, 4, 2).
        """
        apexes, half = self._apexes(places), self._halves
        middle = apexes.mean(axis=1)
        outwards = middle - np.clip(middle, -half, half)
        normal = outwards / np.maximum(lengths_of(outwards), 1e-300)[..., None]
        farthest = (np.abs(normal) * half).sum(axis=-1)
        nearest = (apexes * normal[:, None]).sum(axis=-1).min(axis=1) - farthest
        return np.maximum(nearest, 0.0) - self.ranges[:, 0]

    def nearest_places(self, tilts: FloatArray) -> FloatArray:
        """Return the places of the box nearest to the legs' base ends, shape (n, 4, 3)."""
        apexes, half = self._apexes(tilts), 0.5 * self.x[m.SIZE] * self.terms.edges
        c, s = math.cos(self.x[m.BOX_YAW]), math.sin(self.x[m.BOX_YAW])
        # The line of the guide lies along x of the base: the nearest corner of the box in y.
        toward = np.sign(apexes[:, 1:3, 1])
        shadow = self._halves[1]
        y, z = np.clip(apexes[:, 1:3, 1], -shadow[1], shadow[1]), apexes[:, 1:3, 2]
        share = np.where(np.abs(y) < shadow[1], y / shadow[1], toward)
        ends = [
            share * np.sign(s or 1.0),
            share * np.sign(c or 1.0),
            np.clip(z / half[2], -1.0, 1.0),
        ]
        apexes[:, 1:3] = np.stack(ends, axis=-1) * half
        return np.clip(apexes / half, -1.0, 1.0)
