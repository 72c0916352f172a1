"""Machines that a search starts from: of many random ones, those that nearly keep a requirement.

Each is looked at in the corners of the box, first without a tilt, and the few that are left at the
largest tilts.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence

import numpy as np

from explorer.find import machine_values as m
from explorer.find.demands import clearances_of, limits_of, sizes_of
from explorer.find.machine_values import HOME, MachineValues
from explorer.find.over_tilts import CORNERS, poses_over
from explorer.find.terms import Terms, part_slacks
from explorer.numerics.arrays import FloatArray, IntArray

# Ranges of the variables, over the diagonal of the box or in radians.
LOWS = np.array(
    [-2.5, -2.5, *[-1.2] * 4, -2.0, -2.0, 0.1, *[-math.pi] * 2, -1.0, -1.0, *[-0.8] * 3]
)
HIGHS = np.array([2.5, 2.5, *[1.2] * 4, 2.0, 2.0, 2.5, *[math.pi] * 2, 1.0, 1.0, *[0.8] * 3])
# Machines of a block, and its parts, whose arrays are small enough to be had at once.
BLOCK, PARTS = 8192, 4
# Azimuths of the tilts at which the corners are looked at.
AZIMUTHS = 8
# Candidates that miss a demand by more than this are dropped after each look.
DROPPED = 0.6
# What counts as a whole miss: in the cosine of a swing, and of margins and the outer size over the
# longest leg.
CONE, MARGIN, SIZE = 0.6, 0.1, 0.5


def standard_poses(tilt: float) -> FloatArray:
    """Return home, the corners of the box, and the corners at the largest tilt."""
    angles = 2.0 * math.pi * np.arange(AZIMUTHS) / AZIMUTHS
    tilts = [(0.0, 0.0), *((angle, tilt) for angle in angles if tilt > 0.0)]
    return np.concatenate([HOME, poses_over(CORNERS, np.array(tilts))])


def misses(terms: Terms, at: MachineValues) -> tuple[FloatArray, FloatArray]:
    """Return what machines (n, variables) miss over poses, and their longest legs, (n,) each.

    What is missed is the largest share by which a demand is exceeded, negative if all are kept.
    """
    lengths = np.stack(at.lengths, axis=-1)
    longest, shortest = lengths.max(axis=1), lengths.min(axis=1)
    large = longest.max(axis=1)
    found = [(longest / shortest).max(axis=1) / terms.ratio - 1.0, large / terms.longest - 1.0]
    if terms.distance > 0.0:
        at.distances = at.uncrossed_distances
    shares = {"swing": CONE, "clearance": terms.distance, "outer size": SIZE * large}
    for demand in (*limits_of(terms), *sizes_of(terms), *clearances_of(terms)):
        share = shares.get(demand.name, MARGIN * large)
        found.append(np.max([each.max(axis=1) for each in demand.missed(at)], axis=0) / share)
    if terms.parts is not None:
        tight = [np.asarray(each).min(axis=-1) for each in part_slacks(terms.parts, at.home)]
        found.append(-np.min(np.broadcast_arrays(*tight), axis=0) / (0.2 * large))
        found.append(((longest + terms.parts.dead) / (2.0 * shortest)).max(axis=1) - 1.0)
    return np.max(found, axis=0), large


def best_first(missed: FloatArray, large: FloatArray) -> IntArray:
    """Return the order of machines by their longest legs and by what they miss, the best first."""
    return np.argsort(np.log(large) + 4.0 * np.maximum(missed, 0.0))


def candidates(terms: Terms, seed: int) -> Iterator[tuple[FloatArray, FloatArray, FloatArray]]:
    """Yield machines of one block after another that nearly keep the limits, with `misses`."""
    count = m.TILT if "tool" in terms.requirement.free else m.TX
    random = np.random.default_rng(seed)
    poses = standard_poses(terms.tilt)
    looks = [poses[:3], poses[:9], poses]
    while True:
        shares = random.random((BLOCK, count))
        x = np.ones((BLOCK, m.VARIABLES))
        x[:, m.TX : m.TILT] = 0.0
        x[:, :count] = LOWS[:count] + (HIGHS - LOWS)[:count] * shares
        sizes = terms.spread ** random.random((BLOCK, 1))
        x[:, : m.BOX_YAW] *= sizes
        x[:, m.TX : m.TILT] *= sizes
        is_level = np.arange(BLOCK) % 2 == 0
        if "orientation" not in terms.requirement.free:
            is_level[:] = True
        x[is_level, m.PITCH : m.TX] = 0.0
        found = [_look(part, terms, looks) for part in np.split(x, PARTS)]
        x, missed, large = map(np.concatenate, zip(*found, strict=True))
        yield x, missed, large


def _look(
    x: FloatArray, terms: Terms, looks: Sequence[FloatArray]
) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Return the machines that are not dropped after any look at poses, with `misses`."""
    missed, large = np.zeros((2, len(x)))
    for look in looks:
        with np.errstate(divide="ignore", invalid="ignore"):
            missed, large = misses(terms, terms.values(x, look))
        kept = missed < DROPPED
        x, missed, large = x[kept], missed[kept], large[kept]
    return x, missed, large
