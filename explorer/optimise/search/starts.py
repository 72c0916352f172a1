"""The beginnings of searches: designs out of a low-discrepancy sequence, positions on a grid."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from explorer.errors import DesignError, InputError
from explorer.measures.size import longest_leg
from explorer.mechanism.design import Design
from explorer.mechanism.margins import margins
from explorer.numerics.arrays import FloatArray
from explorer.optimise.problem import DISTANCES, Problem, distance_of

# Number of first positions on each axis at which clearance is demanded; more follow where needed.
IN_SPACE, IN_SURFACE = 7, 21
# Margins with a smaller slope along z than this take a given value at no height.
STEEP = 1e-3
# Designs tried for each start, before the bounds are taken to allow no more.
TRIES = 64
MOST_STARTS = 10_000


def check_starts(starts: int) -> None:
    """Refuse a number of starts that no search has.

    Raises:
        InputError: it is less than one, or more than `MOST_STARTS`.
    """
    if not 1 <= starts <= MOST_STARTS:
        raise InputError(f"the number of starts must lie within 1 to {MOST_STARTS}; got {starts}")


def more_starts(problem: Problem, count: int, seed: int) -> Iterator[tuple[float, ...]]:
    """Yield values of the variables, spread evenly within their bounds (Sobol, scrambled).

    Designs nearer to a degenerate one than is allowed are left out.
    """
    if count <= 0:
        return
    from scipy.stats import qmc

    lows = np.array([variable.low for variable in problem.variables])
    highs = np.array([variable.high for variable in problem.variables])
    sequence = qmc.Sobol(len(lows), rng=seed)
    yielded = 0
    for _ in range(TRIES * count):
        values = tuple((lows + (highs - lows) * sequence.random(1)[0]).tolist())
        try:
            design = problem.design_at(values)
        except DesignError:
            continue
        if all(abs(distance_of(design, name)) >= problem.demands.least for name in DISTANCES):
            yield values
            yielded += 1
            if yielded == count:
                return


def first_positions(problem: Problem, design: Design) -> FloatArray:
    """Return the positions at which clearance is demanded at first, shape (k, 3).

    They fill the box, or without one the cube of the design's reach. They lie closer in the
    surface on which a margin is the least one at which clearance is demanded: with a level platform
    the legs of a column of positions come nearest at its foot.
    """
    if problem.demands.clearance is None:
        return np.zeros((0, 3))
    reach = longest_leg(design)
    lows, highs = design.limits.box or ((-reach,) * 3, (reach,) * 3)

    def grid(*counts: int) -> FloatArray:
        shares = np.indices(counts).reshape(len(counts), -1).T / (np.array(counts) - 1.0)
        start, end = np.array(lows)[: len(counts)], np.array(highs)[: len(counts)]
        return start + (end - start) * shares

    rotation, least = design.home_pose.rotation, problem.demands.clearance_margin
    columns = grid(IN_SURFACE, IN_SURFACE)
    foot = np.column_stack([columns, np.zeros(len(columns))])
    # Margins are linear in z: δ = δ at the foot + rise · z.
    at_foot = margins(foot, rotation)
    rise = margins(np.array([0.0, 0.0, 1.0]), rotation)
    groups = [grid(IN_SPACE, IN_SPACE, IN_SPACE)]
    for index in np.flatnonzero(np.abs(rise) > STEEP):
        for side in (-1.0, 1.0):
            height = (side * least - at_foot[:, index]) / rise[index]
            groups.append(np.column_stack([columns, height]))
    positions = np.vstack(groups)
    within = (positions >= np.array(lows)).all(axis=1) & (positions <= np.array(highs)).all(axis=1)
    clear = (np.abs(margins(positions, rotation)) >= least * (1.0 - 1e-9)).all(axis=1)
    return positions[within & clear]
