"""Search for a path of straight moves over SE(3) under given rules, by OMPL.

RRT-Connect (Kuffner and LaValle 2000) grows a tree of moves from both ends. A proof covers
every move as a whole (see `explorer.workspace.limits.valid_moves`), so no step is too coarse.
"""

from __future__ import annotations

import functools
import importlib
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np

from explorer.errors import MissingExtraError
from explorer.mechanism.design import Design
from explorer.mechanism.pose import Pose, Triple
from explorer.numerics.arrays import BoolArray, FloatArray
from explorer.paths.loads import DemandedLoad
from explorer.workspace.limits.valid_moves import DEFAULT_TOLERANCE, valid_move_rows
from explorer.workspace.limits.valid_poses import Rules, valid_rows

# The longest move of a tree, as a share of the extent of the space.
LONGEST_MOVE = 0.25


def search_is_possible() -> bool:
    """Return whether OMPL can be imported."""
    try:
        _Ompl.load()
    except MissingExtraError:
        return False
    return True


def compile_checks() -> None:
    """Compile the checks of poses and moves; this takes seconds, once on a machine."""
    valid_move_rows.compile()
    valid_rows.compile()


@dataclass(frozen=True)
class _Ompl:
    """The modules of OMPL, which has no types."""

    base: Any
    geometric: Any

    @staticmethod
    def load() -> _Ompl:
        """Import the modules.

        Raises:
            MissingExtraError: OMPL is not installed.
        """
        try:
            util: Any = importlib.import_module("ompl.util")
            modules = _Ompl(
                importlib.import_module("ompl.base"), importlib.import_module("ompl.geometric")
            )
        except ImportError:
            raise MissingExtraError(
                "a path of more than one straight move needs OMPL: pip install "
                "'flagged-explorer[planning]'"
            ) from None
        _prepare(util)
        return modules


@functools.cache
def _prepare(util: Any) -> None:
    """Make OMPL quiet, and its random numbers the same in every process."""
    util.setLogLevel(util.LOG_NONE)
    util.RNG.setSeed(1)


class TreeSearch:
    """One search over SE(3).

    Args:
        design: The manipulator.
        rules: Rules that every pose of the path keeps.
        tool: Point that moves straight in the platform frame, in design units; None for b4.
        load: Load that every pose of the path holds, for a path of the same tool; None for none.

    Attributes:
        checked: Number of moves checked so far.
    """

    def __init__(
        self,
        design: Design,
        rules: Rules,
        tool: Triple | None = None,
        load: DemandedLoad | None = None,
    ) -> None:
        self.checked = 0
        self._design = design
        self._rules = rules
        self._load = load
        self._tool = np.array(tool or (0.0, 0.0, 0.0))
        self._tolerance = DEFAULT_TOLERANCE * design.reach
        self._positions: FloatArray = np.empty((2, 1, 3))
        self._rotations: FloatArray = np.empty((2, 1, 3, 3))
        self._valid: BoolArray = np.empty(1, dtype=np.bool_)

    def path(self, start: Pose, goal: Pose, seconds: float) -> tuple[Pose, ...] | None:
        """Return the corners of a path between two valid poses, or None if the time was too short.

        Raises:
            MissingExtraError: OMPL is not installed.
        """
        ompl = _Ompl.load()
        base, geometric = ompl.base, ompl.geometric
        space = base.SE3StateSpace()
        bounds = base.RealVectorBounds(3)
        lows, highs = _box(self._design, start, goal)
        for axis in range(3):
            bounds.setLow(axis, lows[axis])
            bounds.setHigh(axis, highs[axis])
        space.setBounds(bounds)
        # OMPL weighs half the angle: with the reach that is a length, as for positions.
        space.setSubspaceWeight(1, self._design.reach)
        setup = geometric.SimpleSetup(space)
        information = setup.getSpaceInformation()
        setup.setStateValidityChecker(self._state_is_valid)
        validator = _validator(base, information, self._move_is_valid)
        information.setMotionValidator(validator)
        setup.setStartAndGoalStates(_state(space, start), _state(space, goal))
        planner = geometric.RRTConnect(information)
        planner.setRange(LONGEST_MOVE * space.getMaximumExtent())
        setup.setPlanner(planner)
        setup.solve(seconds)
        if not setup.haveExactSolutionPath():
            return None
        states = setup.getSolutionPath().getStates()
        # The given ends replace those of OMPL, which differ by rounding.
        return (start, *(_pose(state) for state in list(states)[1:-1]), goal)

    def _read(self, index: int, state: Any) -> None:
        """Read a state of OMPL into the arrays of the first or the second pose."""
        p, r, q = self._positions[index, 0], self._rotations[index, 0], state.rotation()
        p[0], p[1], p[2] = state.getX(), state.getY(), state.getZ()
        w, x, y, z = q.w, q.x, q.y, q.z
        r[0] = 1.0 - 2.0 * (y * y + z * z), 2.0 * (x * y - w * z), 2.0 * (x * z + w * y)
        r[1] = 2.0 * (x * y + w * z), 1.0 - 2.0 * (x * x + z * z), 2.0 * (y * z - w * x)
        r[2] = 2.0 * (x * z - w * y), 2.0 * (y * z + w * x), 1.0 - 2.0 * (x * x + y * y)

    def _state_is_valid(self, state: Any) -> bool:
        self._read(0, state)
        rules = self._rules
        valid_rows(1, rules.row, rules.cones, self._positions[0], self._rotations[0], self._valid)
        return bool(self._valid[0])

    def _move_is_valid(self, start: Any, end: Any) -> bool:
        self.checked += 1
        self._read(0, start)
        self._read(1, end)
        (p, q), (r, s), rules = self._positions, self._rotations, self._rules
        given = (p, r, q, s, self._tool)
        valid_move_rows(1, rules.row, rules.cones, *given, self._tolerance, self._valid)
        if not self._valid[0] or self._load is None:
            return bool(self._valid[0])
        return bool(self._load.holds_along(p, r, q, s)[0])


def _validator(base: Any, information: Any, is_valid: Callable[[Any, Any], bool]) -> Any:
    """Return OMPL's check of moves; its class is made here since OMPL is imported late."""

    def check(_: Any, start: Any, end: Any) -> bool:
        return is_valid(start, end)

    validator_class = type("MoveValidator", (base.MotionValidator,), {"checkMotion": check})
    return validator_class(information)


def _box(design: Design, start: Pose, goal: Pose) -> tuple[list[float], list[float]]:
    """Return lows and highs of a box that holds all positions within the limits."""
    centre, radius = np.array([*design.a3, 0.0]), design.length_range("l4")[1]
    lows, highs = centre - radius, centre + radius
    if design.limits.box is not None:
        lows = np.maximum(lows, design.limits.box[0])
        highs = np.minimum(highs, design.limits.box[1])
    # The ends may be beyond the limits by rounding.
    ends = np.array([start.position, goal.position])
    tolerance = 1e-9 * design.reach
    lows = np.minimum(lows, ends.min(axis=0)) - tolerance
    highs = np.maximum(highs, ends.max(axis=0)) + tolerance
    return lows.tolist(), highs.tolist()


def _state(space: Any, pose: Pose) -> Any:
    state = space.allocState()
    state.setXYZ(*pose.position)
    q = state.rotation()
    q.w, q.x, q.y, q.z = pose.quaternion
    return state


def _pose(state: Any) -> Pose:
    q = state.rotation()
    return Pose((state.getX(), state.getY(), state.getZ()), (q.w, q.x, q.y, q.z))
