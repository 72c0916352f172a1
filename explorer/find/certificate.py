"""The certificate of a machine: each demand proven over the whole box and all tilts, or missed.

Where a demand is missed, the poses that miss it are told, so that a search can look there too.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from explorer.find import machine_values as m
from explorer.find.candidates import standard_poses
from explorer.find.machine_values import BoxPoses
from explorer.find.over_poses import missed_amounts, poses_of, prove_demands, sample_demands
from explorer.find.over_tilts import limit_names, prove_limits, worst_place
from explorer.find.terms import Terms
from explorer.numerics.arrays import BoolArray, FloatArray
from explorer.numerics.cells import CellValues

# Share by which the limits of lengths exceed the lengths that were found.
PADDING = 1e-5
# Amount up to which a demand is kept, over the diagonal or over its limit.
TOLERANCE = 1e-9
# What is left where a demand is nearly missed.
NEARLY = 0.03
# Random poses in which demands are computed that are not proven.
SAMPLES = 20_000
# Rounds in which the ranges of the lengths grow until nothing exceeds them.
ROUNDS = 6


@dataclass(frozen=True)
class Certificate:
    """What holds for one machine over the whole box and all tilts.

    Attributes:
        ranges: Limits of the lengths of the legs, which no pose exceeds if they are proven, (4, 2).
        limits: Proven limits: whether each of `limit_names` is proven, boolean.
        missed_limits: Amounts by which each is missed at most, as far as it was found.
        limit_poses: Poses with the worst values, a row for each limit.
        demands: Whether each of `demand_names` is proven, boolean.
        missed_demands: Amounts by which each is missed, in the worst pose that was found.
        demand_poses: These poses.
    """

    ranges: FloatArray
    limits: BoolArray
    missed_limits: FloatArray
    limit_poses: BoxPoses
    demands: BoolArray
    missed_demands: FloatArray
    demand_poses: BoxPoses

    @property
    def missed(self) -> float:
        """The largest amount by which a demand is missed where it was looked at."""
        every = [*self.missed_limits.tolist(), *self.missed_demands.tolist()]
        return max(every)

    @property
    def is_kept(self) -> bool:
        """Whether no pose was found that misses a demand."""
        return self.missed <= TOLERANCE

    @property
    def is_proven(self) -> bool:
        """Whether all demands are proven."""
        return bool(self.limits.all() and self.demands.all())

    @property
    def worst_poses(self) -> BoxPoses:
        """The poses that miss a demand, or nearly do."""
        limits = self.limit_poses.at(self.missed_limits > -NEARLY)
        return limits.plus(self.demand_poses.at(self.missed_demands > -NEARLY))


def lengths_over(x: FloatArray, terms: Terms, poses: BoxPoses) -> FloatArray:
    """Return the shortest and the longest length of each leg in poses, shape (4, 2)."""
    lengths = np.stack(np.broadcast_arrays(*terms.values(x, poses).lengths))
    return np.stack([lengths.min(axis=1), lengths.max(axis=1)], axis=1)


def used_ranges(x: FloatArray, terms: Terms, poses: BoxPoses) -> FloatArray:
    """Return the ranges of the lengths over all poses, a little wider, shape (4, 2).

    They grow from those in some poses by the worst poses that a proof finds.
    """
    found = lengths_over(x, terms, poses)
    for _ in range(ROUNDS):
        padded = found * [1.0 - PADDING, 1.0 + PADDING]
        limits = prove_limits(x, terms, padded)
        over = np.flatnonzero(limits.values[:8] > 0.0)
        if not len(over):
            return padded
        for index in over.tolist():
            worst = worst_place(x, terms, padded, index, limits.places[index])
            more = lengths_over(x, terms, worst)
            found = np.column_stack(
                [np.minimum(found[:, 0], more[:, 0]), np.maximum(found[:, 1], more[:, 1])]
            )
    return found * [1.0 - PADDING, 1.0 + PADDING]


def certify(
    x: FloatArray,
    terms: Terms,
    *,
    ranges: FloatArray | None = None,
    cells: int | None = None,
    poses: BoxPoses | None = None,
    is_quick: bool = False,
) -> Certificate:
    """Return the certificate of a machine with limits of its lengths, or with those that it uses.

    Without limits given, the lengths have to keep the ratio and the longest leg. At most `cells`
    cells of poses are looked at; a quick certificate looks at none if a limit is missed. Demands
    are also looked at in some poses.
    """
    poses = standard_poses(terms.tilt) if poses is None else poses
    names, count = limit_names(terms), 8
    with np.errstate(all="ignore"):
        own = used_ranges(x, terms, poses) if ranges is None else ranges
        limits = prove_limits(x, terms, own)
        proven = limits.bounds <= TOLERANCE
        missed = limits.values.copy()
        # The lengths that are used must be those of legs that can be bought.
        if ranges is None:
            over = np.maximum(own[:, 1] / own[:, 0] / terms.ratio, own[:, 1] / terms.longest) - 1.0
            missed[:4] = np.maximum(missed[:4], over)
            missed[4:8] = np.maximum(missed[4:8], own[:, 1] / own[:, 0] / terms.ratio - 1.0)
            proven[:count] &= missed[:count] <= TOLERANCE
        worst = [worst_place(x, terms, own, i, limits.places[i]) for i in range(len(names))]
        places = BoxPoses(*map(np.concatenate, zip(*worst, strict=True)))
        sampled = missed_amounts(x, terms, poses)
        if missed.max() > TOLERANCE and is_quick:
            k = sampled.shape[1]
            found = CellValues(np.full(k, -np.inf), np.zeros((k, 5)), np.full(k, np.inf))
        else:
            found = prove_demands(x, terms, cells)
            if (found.bounds > TOLERANCE).any() and (found.values <= TOLERANCE).all():
                more = sample_demands(x, terms, SAMPLES)
                is_more = more.values > found.values
                found = CellValues(
                    np.where(is_more, more.values, found.values),
                    np.where(is_more[:, None], more.places, found.places),
                    np.maximum(found.bounds, more.values),
                )
    values, at = found.values, poses_of(found.places)
    if len(values):
        rows = sampled.argmax(axis=0)
        is_worse = sampled.max(axis=0) > values
        values = np.where(is_worse, sampled.max(axis=0), values)
        at = BoxPoses(
            np.where(is_worse[:, None], poses.places[rows], at.places),
            np.where(is_worse[:, None], poses.tilts[rows], at.tilts),
        )
    return Certificate(
        ranges=own,
        limits=proven,
        missed_limits=np.where(np.isnan(missed), math.inf, missed),
        limit_poses=places,
        demands=np.maximum(found.bounds, values) <= TOLERANCE,
        missed_demands=np.where(np.isnan(values), math.inf, values),
        demand_poses=at,
    )


def is_regular(x: FloatArray) -> bool:
    """Whether a machine is finite and not degenerate."""
    sizes = np.abs([x[m.A3Y], x[m.B1Y], x[m.B3] - x[m.B2]])
    return bool(np.isfinite(x).all() and sizes.min() > 1e-6)
