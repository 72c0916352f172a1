"""Search for a path in the fold coordinates of a mode under given rules, by OMPL.

A mode is a box of fold coordinates without a singularity inside, so the search has to avoid the
other limits alone. RRT-Connect (Kuffner and LaValle 2000) grows a tree of straight lines from both
ends. A proof covers every line as a whole (see `explorer.paths.proofs`), so no step is too coarse.
"""

from __future__ import annotations

import functools
import importlib
import itertools
import math
from collections.abc import Callable
from typing import Any

import numpy as np

from explorer.errors import MissingExtraError
from explorer.mechanism.design import Design
from explorer.mechanism.folds import write_poses
from explorer.numerics.arrays import FloatArray
from explorer.paths.proofs import Proofs
from explorer.workspace.limits.valid_poses import valid_rows

# The longest line of a tree, as a share of the extent of the space.
LONGEST_LINE = 0.25


@functools.cache
def load_ompl() -> tuple[Any, Any]:
    """Return OMPL's modules of spaces and of planners, which have no types.

    It is quiet, and its random numbers are the same in every process.

    Raises:
        MissingExtraError: OMPL is not installed.
    """
    names = ("ompl.util", "ompl.base", "ompl.geometric")
    try:
        util, base, geometric = map(importlib.import_module, names)
    except ImportError:
        raise MissingExtraError(
            "a path that is not straight in the folds needs OMPL: pip install "
            "'flagged-explorer[planning]'"
        ) from None
    util.setLogLevel(util.LOG_NONE)
    util.RNG.setSeed(1)
    return base, geometric


class TreeSearch:
    """One search over the fold coordinates of one mode.

    Args:
        proofs: Proofs that lines are valid.

    Attributes:
        checked: Number of lines checked so far.
    """

    def __init__(self, proofs: Proofs) -> None:
        self.checked = 0
        self._proofs = proofs
        # OMPL measures distances in all coordinates alike, hence r over the reach.
        self._units = np.array([proofs.design.reach, 1.0, 1.0, 1.0, 1.0, 1.0])

    def find_path(self, first: FloatArray, last: FloatArray, seconds: float) -> FloatArray | None:
        """Return the corners of a path in folds, (n, 6), or None if the time was too short.

        The first and the last corner, shape (6,), are in the same mode, and the moves between
        corners straight.

        Raises:
            MissingExtraError: OMPL is not installed.
        """
        base, geometric = load_ompl()
        space, bounds = base.RealVectorStateSpace(6), base.RealVectorBounds(6)
        lows, highs = _box(self._proofs.design, first, last)
        for axis, edges in enumerate(zip(lows / self._units, highs / self._units, strict=True)):
            bounds.setLow(axis, edges[0])
            bounds.setHigh(axis, edges[1])
        space.setBounds(bounds)
        setup = geometric.SimpleSetup(space)
        information = setup.getSpaceInformation()
        setup.setStateValidityChecker(self._state_is_valid)
        validator = _validator(base, information, self._line_is_valid)
        information.setMotionValidator(validator)
        setup.setStartAndGoalStates(
            *(_state(space, folds / self._units) for folds in (first, last))
        )
        planner = geometric.RRTConnect(information)
        planner.setRange(LONGEST_LINE * space.getMaximumExtent())
        setup.setPlanner(planner)
        setup.solve(seconds)
        if not setup.haveExactSolutionPath():
            return None
        folds = [self._folds(state) for state in setup.getSolutionPath().getStates()]
        corners = [first[None]]
        for ends in itertools.pairwise(folds):
            line = self._proofs.prove_line(*ends)
            if line is None:
                # It was proven from its other end, and has too many steps from this one.
                line = self._proofs.prove_line(*reversed(ends))
                if line is None:
                    return None
                line = line[::-1]
            corners.append(line[1:])
        return np.concatenate(corners)

    def _folds(self, state: Any) -> FloatArray:
        return np.array([state[i] for i in range(6)]) * self._units

    def _state_is_valid(self, state: Any) -> bool:
        p, r, valid = np.empty((1, 3)), np.empty((1, 3, 3)), np.empty(1, dtype=np.bool_)
        write_poses(1, self._folds(state)[None], p, r)
        valid_rows(1, self._proofs.rules.row, self._proofs.rules.demands, p, r, valid)
        return bool(valid[0])

    def _line_is_valid(self, start: Any, end: Any) -> bool:
        self.checked += 1
        return self._proofs.prove_line(self._folds(start), self._folds(end)) is not None


def _validator(base: Any, information: Any, is_valid: Callable[[Any, Any], bool]) -> Any:
    """Return OMPL's check of motions; its class is made here since OMPL is imported late."""

    def check(_: Any, start: Any, end: Any) -> bool:
        return is_valid(start, end)

    validator_class = type("LineValidator", (base.MotionValidator,), {"checkMotion": check})
    return validator_class(information)


def _box(design: Design, first: FloatArray, last: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Return lows and highs of a box of fold coordinates that holds the poses of the mode."""
    # A mode has one sign for each fold, and leg 4 and the box bound the distance of b4 from a1.
    farthest = design.reach + design.length_range("l4")[1]
    if design.limits.box is not None:
        farthest = min(farthest, math.hypot(*np.abs(design.limits.box).max(axis=0)))
    lows = np.array([0.0, 0.0, 0.0, *np.minimum(np.sign(first[3:]) * math.pi, 0.0)])
    highs = np.array([farthest, math.pi, math.pi, *(lows[3:] + math.pi)])
    # The ends may be beyond the limits by rounding.
    return np.minimum(lows, np.minimum(first, last)), np.maximum(highs, np.maximum(first, last))


def _state(space: Any, folds: FloatArray) -> Any:
    state = space.allocState()
    for axis, value in enumerate(folds.tolist()):
        state[axis] = value
    return state
