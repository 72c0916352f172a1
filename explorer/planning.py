"""Paths between two poses of one mode that keep all limits, margins and clearances.

OMPL's RRT-Connect grows a tree of straight moves from either end over SE(3); each of its moves
is proved valid as a whole (see `explorer.move_validity`), so that no step can be too
coarse. What cannot be joined is told before: poses of different modes, and poses
between which two legs would have to pass each other on the guide.
"""

from __future__ import annotations

import importlib
import math
import time
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, Literal

import numpy as np

from explorer.arrays import BoolArray, FloatArray
from explorer.bruhat import incidences
from explorer.clearance import PAIRS
from explorer.design import Design
from explorer.errors import InputError, MissingExtraError, NoAnswerError
from explorer.limits import violations
from explorer.move_validity import DEFAULT_TOLERANCE, valid_move_rows
from explorer.pose import Pose
from explorer.singularity import INCIDENCES, mode_name
from explorer.smoothing import Smoother
from explorer.snapshot import Snapshot, evaluate
from explorer.validity import Rules, valid_rows

DEFAULT_SECONDS = 2.0
# Of the whole extent: the longest move of a tree.
LONGEST_MOVE = 0.25

Reason = Literal["other mode", "other order", "out of time"]
EndReason = Literal["outside limits", "singular"]


class EndError(InputError):
    """A start or goal that no path can have.

    Attributes:
        reason: Why not; the message says which end, and by which limits or incidences.
    """

    def __init__(self, reason: EndReason, message: str) -> None:
        super().__init__(message)
        self.reason: EndReason = reason


class NoPathError(NoAnswerError):
    """There is no path, or none was found in time.

    Attributes:
        reason: "other mode" and "other order" are proofs that there is none.
    """

    def __init__(self, reason: Reason, message: str) -> None:
        super().__init__(message)
        self.reason: Reason = reason


@dataclass(frozen=True)
class PlannedPath:
    """A path of straight moves, each of which keeps everything.

    Attributes:
        poses: Its corners, from the start to the goal.
        found: Those of the path as it was found, before smoothing.
        length: The root-mean-square way of b1 to b4 along it, in design units.
        seconds: What finding and smoothing took.
        checked: How many moves were checked to find it.
    """

    poses: tuple[Pose, ...]
    found: tuple[Pose, ...]
    length: float
    seconds: float
    checked: int


def plan_path(
    design: Design,
    start: Pose,
    goal: Pose,
    *,
    seconds: float = DEFAULT_SECONDS,
    seed: int = 0,
) -> PlannedPath:
    """Return a path from a pose to another that keeps limits, margins and clearances.

    The margins keep the sign triple of the start, whatever mode the home has, and at least the
    margin of the limits.

    Args:
        design: The manipulator.
        start: Where the path starts.
        goal: Where it ends.
        seconds: For finding it; smoothing takes some tenths more.
        seed: Of the shortcuts that smooth it.

    Raises:
        EndError: a start or goal that is singular or outside the limits; it says which.
        InputError: no time at all.
        NoPathError: there is no path, or none was found in time.
        MissingExtraError: OMPL is not installed, and the straight move is not valid.
    """
    if not (math.isfinite(seconds) and seconds > 0.0):
        raise InputError(f"planning needs a time above zero, in seconds; got {seconds:g}")
    ends = evaluate(design, start), evaluate(design, goal)
    for name, snapshot in zip(("start", "goal"), ends, strict=True):
        _check_not_singular(name, snapshot)
    _check_same_mode(*ends)
    for name, snapshot in zip(("start", "goal"), ends, strict=True):
        _check_within(name, snapshot, ends[0].signs)
    _check_same_order(*ends)
    rules = Rules.of(design, ends[0].signs)
    began = time.perf_counter()
    smoother = Smoother(design, rules, seed)
    if smoother.is_valid(start, goal):
        length = float(smoother.lengths([start, goal])[0])
        both = (start, goal)
        return PlannedPath(both, both, length, time.perf_counter() - began, checked=1)
    ompl = _Ompl.loaded()
    # The first time on a machine takes seconds, which are not the path's.
    valid_move_rows.compile()
    valid_rows.compile()
    began = time.perf_counter()
    search = _Search(ompl, design, rules)
    found = search.path(start, goal, seconds)
    if found is None:
        raise NoPathError(
            "out of time",
            f"no path was found within {seconds:g} s ({search.checked} moves tried); there may "
            "be one: allow more time, or go by a pose in between",
        )
    poses = smoother.smoothed(found)
    return PlannedPath(
        poses=poses,
        found=found,
        length=float(smoother.lengths(poses).sum()),
        seconds=time.perf_counter() - began,
        checked=search.checked,
    )


def _check_not_singular(name: str, snapshot: Snapshot) -> None:
    found = incidences(snapshot.stratum)
    if found:
        words = " and ".join(INCIDENCES[index - 1] for index in found)
        raise EndError(
            "singular",
            f"the {name} is singular ({words}); a path may neither start nor end so",
        )


def _check_same_mode(start: Snapshot, goal: Snapshot) -> None:
    if start.mode == goal.mode:
        return
    signs = zip(start.signs, goal.signs, strict=True)
    differ = [f"κ{index}" for index, (a, b) in enumerate(signs, 1) if a != b]
    raise NoPathError(
        "other mode",
        f"the start is in mode {start.mode} ({mode_name(start.mode)}), the goal in mode "
        f"{goal.mode} ({mode_name(goal.mode)}): any path between them is singular where "
        f"{' and where '.join(differ)} vanishes",
    )


def _check_within(name: str, snapshot: Snapshot, signs: tuple[int, int, int]) -> None:
    position = np.array(snapshot.pose.position)
    broken = [
        str(each)
        for each in violations(
            snapshot.design, position, snapshot.rotation, snapshot.joints, snapshot.margins, signs
        )
    ]
    clearances = snapshot.clearances.clearance.tolist()
    for (first, second), value in zip(PAIRS, clearances, strict=True):
        if not value > 0.0:
            shown = f"{value:.4g}".replace("-", "−")
            broken.append(f"legs {first} and {second} collide (clearance {shown})")
    if broken:
        raise EndError("outside limits", f"the {name} is outside the limits: {'; '.join(broken)}")


def _check_same_order(start: Snapshot, goal: Snapshot) -> None:
    """Refuse poses between which the feet of two legs would have to meet on the guide.

    Legs 1, 2 and 3 all start from the guide, at 0, d1 and d3: where two of these are equal,
    two legs touch. So their order is the same all along a path without collisions.
    """
    orders = [
        sorted((("a1", 0.0), ("d1", float(q[1])), ("d3", float(q[3]))), key=lambda foot: foot[1])
        for q in (start.joints, goal.joints)
    ]
    first, last = ([name for name, _ in order] for order in orders)
    if first != last:
        raise NoPathError(
            "other order",
            f"on the guide the start has the order {', '.join(first)}, the goal "
            f"{', '.join(last)}: in between two legs would collide where they start",
        )


@dataclass(frozen=True)
class _Ompl:
    """The modules of OMPL, which has no types."""

    base: Any
    geometric: Any

    @staticmethod
    def loaded() -> _Ompl:
        try:
            util: Any = importlib.import_module("ompl.util")
            modules = _Ompl(
                importlib.import_module("ompl.base"), importlib.import_module("ompl.geometric")
            )
        except ImportError:
            raise MissingExtraError(
                "planning a path needs OMPL: pip install 'flagged-explorer[planning]'"
            ) from None
        util.setLogLevel(util.LOG_NONE)
        return modules


class _Search:
    """One search of OMPL over SE(3).

    Attributes:
        checked: How many moves have been checked.
    """

    def __init__(self, ompl: _Ompl, design: Design, rules: Rules) -> None:
        self.checked = 0
        self._ompl = ompl
        self._design = design
        self._rules = rules
        self._tolerance = DEFAULT_TOLERANCE * design.reach
        self._places: FloatArray = np.empty((2, 1, 3))
        self._turns: FloatArray = np.empty((2, 1, 3, 3))
        self._valid: BoolArray = np.empty(1, dtype=np.bool_)

    def path(self, start: Pose, goal: Pose, seconds: float) -> tuple[Pose, ...] | None:
        """Return the corners of a path, or None if there was too little time."""
        base, geometric = self._ompl.base, self._ompl.geometric
        space = base.SE3StateSpace()
        bounds = base.RealVectorBounds(3)
        lows, highs = _box(self._design, start, goal)
        for axis in range(3):
            bounds.setLow(axis, lows[axis])
            bounds.setHigh(axis, highs[axis])
        space.setBounds(bounds)
        # Half the angle times the reach: a turn counts as what it does to b4 seen from a1.
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
        # The ends as they were given, to the last bit.
        return (start, *(_pose(state) for state in list(states)[1:-1]), goal)

    def _read(self, which: int, state: Any) -> None:
        place, turn, q = self._places[which, 0], self._turns[which, 0], state.rotation()
        place[0], place[1], place[2] = state.getX(), state.getY(), state.getZ()
        w, x, y, z = q.w, q.x, q.y, q.z
        turn[0] = 1.0 - 2.0 * (y * y + z * z), 2.0 * (x * y - w * z), 2.0 * (x * z + w * y)
        turn[1] = 2.0 * (x * y + w * z), 1.0 - 2.0 * (x * x + z * z), 2.0 * (y * z - w * x)
        turn[2] = 2.0 * (x * z - w * y), 2.0 * (y * z + w * x), 1.0 - 2.0 * (x * x + y * y)

    def _state_is_valid(self, state: Any) -> bool:
        self._read(0, state)
        rules = self._rules
        valid_rows(1, rules.row, rules.cones, self._places[0], self._turns[0], self._valid)
        return bool(self._valid[0])

    def _move_is_valid(self, start: Any, end: Any) -> bool:
        self.checked += 1
        self._read(0, start)
        self._read(1, end)
        rules = self._rules
        valid_move_rows(
            1,
            rules.row,
            rules.cones,
            self._places[0],
            self._turns[0],
            self._places[1],
            self._turns[1],
            self._tolerance,
            self._valid,
        )
        return bool(self._valid[0])


def _validator(base: Any, information: Any, is_valid: Callable[[Any, Any], bool]) -> Any:
    """Return OMPL's check of moves; a class made here, as its base is imported late."""

    def check(_: Any, start: Any, end: Any) -> bool:
        return is_valid(start, end)

    kind = type("MoveValidator", (base.MotionValidator,), {"checkMotion": check})
    return kind(information)


def _box(design: Design, start: Pose, goal: Pose) -> tuple[list[float], list[float]]:
    """Return lows and highs of the positions that can be within the limits."""
    centre, radius = np.array([*design.a3, 0.0]), design.length_range("l4")[1]
    lows, highs = centre - radius, centre + radius
    if design.limits.box is not None:
        lows = np.maximum(lows, design.limits.box[0])
        highs = np.minimum(highs, design.limits.box[1])
    # Both ends are within the limits, to rounding.
    ends = np.array([start.position, goal.position])
    spare = 1e-9 * design.reach
    lows = np.minimum(lows, ends.min(axis=0)) - spare
    highs = np.maximum(highs, ends.max(axis=0)) + spare
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
