"""Lengths, margins, swings and the order of the carriages over a whole box and all tilts, proven.

At one orientation closed forms tell the worst position of the box: a longest length is convex in
the position, so that its maximum is at a corner, and so is how far a leg is within a cone of less
than a right angle; the margins are linear; a leg is shortest at one nearest place.

Over a cell of azimuths and tilts a vector R v of the platform is within e |v| of a convex
combination of its values at the four corners, with e of the order of the square of the cell. A
slack that is concave in such vectors is at least the least one of the corners, less e times its
rate. That of a shortest length is not: for it the part of the leg along one direction stands for
the length, since that is linear and no greater.
"""

from __future__ import annotations

import itertools
import math

import numpy as np

from explorer.find import machine_values as m
from explorer.find.demands import limits_of
from explorer.find.terms import Terms
from explorer.numerics.arrays import FloatArray, dot, lengths_of
from explorer.numerics.cells import CellValues, corners_of_cells, largest_values

CORNERS = np.array([*itertools.product((-1.0, 1.0), repeat=3)])
"""The corners of the box as places, shape (8, 3)."""

# Cells of azimuths and tilts that a proof may take.
MOST_CELLS = 12_000


def poses_over(places: FloatArray, tilts: FloatArray) -> FloatArray:
    """Return all poses of places (p, 3) at azimuths and tilts (k, 2), shape (k p, 5)."""
    count = len(places)
    return np.column_stack([np.tile(places, (len(tilts), 1)), np.repeat(tilts, count, axis=0)])


def prove_limits(x: FloatArray, terms: Terms, ranges: FloatArray) -> CellValues:
    """Return by how much each limit is missed at most over all poses, over the box's diagonal.

    Longest and shortest lengths of the four legs come first, then the `limits_of` the requirement;
    places are poses. The ranges are the shortest and the longest length of each leg, shape (4, 2).
    """
    limits, rates = limits_of(terms), _rates(x, terms)

    def over_corners(tilts: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Return the amounts missed at tilts (n, 2) in the corners, (n, 8, limits), and legs."""
        at = terms.values(x, poses_over(CORNERS, tilts))
        lengths = np.stack(at.lengths, axis=1)
        shortest = ranges[:, 0] - lengths_of(_nearest(x, terms, tilts)[1])
        rows = [lengths - ranges[:, 1], np.repeat(shortest, 8, axis=0)]
        found = np.concatenate([*rows, *(each.missed_rows(at) for each in limits)], axis=1)
        return found.reshape(len(tilts), 8, -1), _legs(at).reshape(len(tilts), 8, 4, 3)

    def measure(lows: FloatArray, highs: FloatArray) -> CellValues:
        n, corners = len(lows), corners_of_cells(lows, highs)
        azimuths, tilts = (highs - lows).T
        # Second derivatives of R v by the tilt are at most |v|, by the azimuth |v| times this.
        turning = np.sin(highs[:, 1]) + 2.0 * (1.0 - np.cos(highs[:, 1]))
        error = 0.125 * (tilts**2 + azimuths**2 * turning)
        found, legs = over_corners(corners.reshape(-1, 2))
        missed = found.max(axis=1).reshape(n, 4, -1)
        worst, most = missed.argmax(axis=1), missed.max(axis=1)
        # The direction of the shortest leg in the middle of the cell.
        normal = _nearest(x, terms, corners.mean(axis=1))[1]
        normal = normal / np.maximum(lengths_of(normal), 1e-300)[..., None]
        parts = dot(legs.reshape(n, 32, 4, 3), normal[:, None]).min(axis=1)
        bounds = most.copy()
        bounds[:, 4:8] = ranges[:, 0] - np.maximum(parts, 0.0)
        bounds += error[:, None] * rates
        return CellValues(most, corners[np.arange(n)[:, None], worst], bounds)

    ends = np.array([-math.pi, 0.0]), np.array([math.pi, terms.tilt])
    found = largest_values(measure, *ends, most=MOST_CELLS)
    every = np.arange(len(found.values))
    places = CORNERS[over_corners(found.places)[0][every, :, every].argmax(axis=1)]
    places[4:8] = _nearest(x, terms, found.places[4:8])[0][every[:4], every[:4]]
    return found._replace(places=np.column_stack([places, found.places]))


def nearest_poses(x: FloatArray, terms: Terms, tilts: FloatArray) -> FloatArray:
    """Return the poses with the shortest lengths of a machine at azimuths and tilts (n, 2)."""
    places = _nearest(x, terms, tilts)[0].reshape(-1, 3)
    return np.column_stack([places, np.repeat(tilts, 4, axis=0)])


def _rates(x: FloatArray, terms: Terms) -> FloatArray:
    """Return how fast each limit is missed by the errors e of interpolated vectors."""
    tool = x[m.TX : m.TILT]
    b = np.zeros((4, 3))
    b[0, :2], b[1, 0], b[2, 0] = x[m.B1X : m.B2], x[m.B2], x[m.B3]
    arms, half = lengths_of(b - tool), 0.5 * x[m.SIZE] * terms.edges
    farthest = float(lengths_of(np.abs(x[m.HX : m.BOX_YAW]) + math.hypot(*half)))
    rates = [*arms, *arms, farthest, farthest + math.hypot(tool[1], tool[2])]
    rates += [float(lengths_of(tool)), abs(float(x[m.B3] - x[m.B2]))]
    if terms.swing < math.pi:
        cosine, base = math.cos(terms.swing), farthest + math.hypot(*x[:2])
        swings = [(1.0 + cosine) * arms[0], (1.0 + cosine) * arms[3]]
        # For legs 2 and 3 a product of two turning vectors is interpolated.
        swings += [base + cosine * arms[0], *(farthest + (4.0 + cosine) * arms[1:3])]
        swings += [base + cosine * arms[3]]
        home = np.ravel(terms.values(x, m.HOME).lengths)
        rates += [*np.array(swings) / home[list(m.SWINGING)]]
    return np.array(rates)


def _nearest(x: FloatArray, terms: Terms, tilts: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Return the places at which each leg is shortest at tilts (n, 2), and the legs, (n, 4, 3).

    Each edge of the box moves a leg along a line. These lines are at right angles to each other, or
    parallel for legs 2 and 3, so that the nearest place is found along one after another.
    """
    poses = poses_over(np.eye(4, 3, -1), tilts)
    moved = _legs(terms.values(x, poses)).reshape(len(tilts), 4, 4, 3)
    legs, places = moved[:, 0].copy(), np.zeros((len(tilts), 4, 3))
    for axis in range(3):
        edge = moved[:, 1 + axis] - moved[:, 0]
        share = -dot(legs, edge) / np.maximum(dot(edge, edge), 1e-300)
        places[..., axis] = np.clip(share, -1.0, 1.0)
        legs += places[..., axis, None] * edge
    return places, legs


def _legs(at: m.MachineValues) -> FloatArray:
    """Return the four legs of one machine in k poses, shape (k, 4, 3)."""
    return np.stack([m.rows_of(leg) for leg in at.legs], axis=1)
