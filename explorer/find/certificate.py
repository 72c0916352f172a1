"""The certificate of a machine: each demand proven over the whole box and all tilts, or missed.

Where a demand is missed, the poses that miss it are told, so that a search can look there too.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from explorer.find import machine_values as m
from explorer.find.candidates import standard_poses
from explorer.find.demands import demands_of, limits_of
from explorer.find.over_poses import look_at, prove_demand, sample_demand
from explorer.find.over_tilts import prove_limits
from explorer.find.terms import Terms
from explorer.mechanism.design import LENGTHS
from explorer.numerics.arrays import BoolArray, FloatArray
from explorer.numerics.cells import CellValues

# Share by which the limits of lengths exceed the lengths that were found.
PADDING = 1e-5
# Miss below which a search takes a demand as kept, over the diagonal or over its limit.
TOLERANCE = 1e-9
# Amount to spare below which a pose joins the search.
NEARLY = 0.03
# Random poses in which demands are computed that are not proven.
SAMPLES = 20_000
# Random poses among which the worst values are sought that are told.
CLOSELY = 5000
# Rounds in which the ranges of the lengths grow until nothing exceeds them.
ROUNDS = 6

LENGTH = "length"
"""Name of the demand on lengths to stay within limits of their own."""


@dataclass(frozen=True)
class Certificate:
    """What holds for one machine over the whole box and all tilts.

    The values are the longest and the shortest lengths of the legs, those of the `limits_of` a
    requirement, and those of its `demands_of`.

    Attributes:
        names: Names of their demands.
        items: What each of them is of.
        ranges: Limits of the lengths of the legs, which no pose exceeds if they are proven, (4, 2).
        missed: Amounts by which each misses its limit in the worst pose that was found.
        poses: These poses, shape (n, 5).
        proven: Whether each is proven to keep its limit, boolean.
    """

    names: tuple[str, ...]
    items: tuple[str, ...]
    ranges: FloatArray
    missed: FloatArray
    poses: FloatArray
    proven: BoolArray

    @property
    def is_kept(self) -> bool:
        """Whether no pose was found that misses a demand."""
        return bool(self.missed.max() <= TOLERANCE)

    @property
    def worst_poses(self) -> FloatArray:
        """The poses that miss a demand, or nearly do."""
        return self.poses[self.missed > -NEARLY]

    def rows(self, name: str) -> list[int]:
        """Return the rows of the values of a demand."""
        return [row for row, each in enumerate(self.names) if each == name]


def lengths_over(x: FloatArray, terms: Terms, poses: FloatArray) -> FloatArray:
    """Return the shortest and the longest length of each leg in poses, shape (4, 2)."""
    lengths = np.stack(np.broadcast_arrays(*terms.values(x, poses).lengths))
    return np.stack([lengths.min(axis=1), lengths.max(axis=1)], axis=1)


def used_ranges(x: FloatArray, terms: Terms, poses: FloatArray) -> FloatArray:
    """Return the ranges of the lengths over all poses, a little wider, shape (4, 2).

    They grow from those in some poses by the worst poses that a proof finds.
    """
    padding = np.array([1.0 - PADDING, 1.0 + PADDING])
    found = lengths_over(x, terms, poses)
    for _ in range(ROUNDS):
        limits = prove_limits(x, terms, found * padding)
        over = limits.values[:8] > 0.0
        if not over.any():
            break
        poses = np.concatenate([poses, limits.places[:8][over]])
        found = lengths_over(x, terms, poses)
    return found * padding


def certify(
    x: FloatArray,
    terms: Terms,
    *,
    ranges: FloatArray | None = None,
    cells: int | None = None,
    poses: FloatArray | None = None,
    is_quick: bool = False,
) -> Certificate:
    """Return the certificate of a machine with limits of its lengths, or with those that it uses.

    Without limits given, the lengths have to keep the ratio and the longest leg. At most `cells`
    cells of poses are looked at for each demand; without a number their worst values are sought
    closely too. A quick certificate looks at no cells if a limit is missed. Demands are also looked
    at in some poses.
    """
    poses = standard_poses(terms.tilt) if poses is None else poses
    limits, demands = limits_of(terms), demands_of(terms)
    with np.errstate(all="ignore"):
        own = used_ranges(x, terms, poses) if ranges is None else ranges
        found = prove_limits(x, terms, own)
        if ranges is None:
            # The lengths that are used must be those of legs that can be bought.
            ratio = own[:, 1] / own[:, 0] / terms.ratio - 1.0
            over = np.concatenate([np.maximum(ratio, own[:, 1] / terms.longest - 1.0), ratio])
            found.values[:8] = np.maximum(found.values[:8], over)
            found.bounds[:8] = np.maximum(found.bounds[:8], over)
        # The lengths, and each of the limits.
        ends = np.cumsum([8, *(len(each.items) for each in limits)])[:-1]
        columns = [np.split(each, ends) for each in found]
        parts = [CellValues(*part) for part in zip(*columns, strict=True)]
        skips = is_quick and found.values.max() > TOLERANCE
        at = terms.values(x, poses)
        for demand in demands:
            part = look_at(demand, at)
            if skips:
                part.bounds[:] = math.inf
            else:
                part = part.merged(prove_demand(demand, x, terms, cells))
                if part.values.max() <= TOLERANCE < part.bounds.max():
                    part = part.merged(sample_demand(demand, x, terms, SAMPLES, poses))
            parts.append(part)
        if cells is None:
            known = np.concatenate([part.places for part in parts])
            for index, demand in enumerate((*limits, *demands), 1):
                closer = sample_demand(demand, x, terms, CLOSELY, known)
                parts[index] = parts[index].merged(closer)
        found = CellValues(*map(np.concatenate, zip(*parts, strict=True)))
    lengths = [(LENGTH, f"{end} {leg}") for end in ("longest", "shortest") for leg in LENGTHS]
    every = [(each.name, item) for each in (*limits, *demands) for item in each.items]
    names, items = zip(*lengths, *every, strict=True)
    return Certificate(names, items, own, found.values, found.places, found.bounds <= TOLERANCE)


def is_regular(x: FloatArray) -> bool:
    """Return whether a machine is finite and not degenerate."""
    sizes = np.abs([x[m.A3Y], x[m.B1Y], x[m.B3] - x[m.B2]])
    return bool(np.isfinite(x).all() and sizes.min() > 1e-6)
