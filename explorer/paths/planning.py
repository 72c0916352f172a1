"""Paths between two poses of one mode that keep all limits, margins and clearances.

What cannot be joined is told before any search: poses of different modes, and poses between
which two legs would have to pass each other on the guide. The others are joined by a straight
move or by `explorer.paths.tree_search`; either way every move is proved valid as a whole.
"""

from __future__ import annotations

import dataclasses
import math
import time
from dataclasses import dataclass
from typing import Literal

import numpy as np

from explorer.errors import InputError, NoAnswerError
from explorer.legs.clearance import PAIRS
from explorer.measures.snapshot import Snapshot, evaluate
from explorer.mechanism.design import Design
from explorer.mechanism.margins import INCIDENCES, mode_name
from explorer.mechanism.pose import Pose
from explorer.paths.smoothing import Smoother
from explorer.paths.tree_search import TreeSearch, compile_checks, search_is_possible
from explorer.singularity.bruhat import incidences
from explorer.workspace.limits.broken import violations
from explorer.workspace.limits.valid_poses import Rules

DEFAULT_SECONDS = 2.0
# Of the reach, and of what the ends keep: the margins and clearances that paths had better keep.
COMFORT, SHARE_OF_ENDS = 0.02, 0.5
# Of the time: for a path that keeps them.
SHARE_FOR_COMFORT = 0.5

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
        margin: What no |κ| is less than along it, but for the tolerance of moves.
        clearance: What no two legs are nearer than along it.
        seconds: What finding and smoothing took.
        checked: How many moves were checked to find it.
    """

    poses: tuple[Pose, ...]
    found: tuple[Pose, ...]
    length: float
    margin: float
    clearance: float
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

    The margins keep the sign triple of the start, whatever mode the home has, and the carriages
    keep the order that they have there. Where it can, the path also stays off singularities and
    collisions, by a share of what both ends keep.

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
    began = time.perf_counter()
    planner = _Planner(design, start, goal, seed)
    exact = Rules.of(design, ends[0].signs, _order(ends[0]))
    margin, clearance = _comfort(*ends)
    comfortable = exact.tighten(margin, clearance)
    path = planner.straight(comfortable, margin, clearance)
    if path is None and search_is_possible():
        # The first time on a machine takes seconds, which are not the path's.
        compile_checks()
        began = time.perf_counter()
        path = planner.searched(comfortable, margin, clearance, SHARE_FOR_COMFORT * seconds)
    path = path or planner.straight(exact, 0.0, 0.0)
    if path is None:
        left = seconds - (time.perf_counter() - began)
        path = planner.searched(exact, 0.0, 0.0, max(left, 0.0))
    if path is None:
        raise NoPathError(
            "out of time",
            f"no path was found within {seconds:g} s ({planner.checked} moves tried); there may "
            "be one: allow more time, or go by a pose in between",
        )
    return dataclasses.replace(path, seconds=time.perf_counter() - began, checked=planner.checked)


class _Planner:
    """Looks for paths between two poses under one set of rules after another.

    Attributes:
        checked: How many moves have been checked to find one.
    """

    def __init__(self, design: Design, start: Pose, goal: Pose, seed: int) -> None:
        self.checked = 0
        self._design = design
        self._ends = start, goal
        self._seed = seed

    def straight(self, rules: Rules, margin: float, clearance: float) -> PlannedPath | None:
        """Return the straight move if it is valid."""
        self.checked += 1
        smoother = Smoother(self._design, rules, self._seed)
        if not smoother.is_valid(*self._ends):
            return None
        return self._path(smoother, self._ends, self._ends, margin, clearance)

    def searched(
        self, rules: Rules, margin: float, clearance: float, seconds: float
    ) -> PlannedPath | None:
        """Return a path that OMPL finds, smoothed, or None if there was too little time."""
        search = TreeSearch(self._design, rules)
        found = search.path(*self._ends, seconds)
        self.checked += search.checked
        if found is None:
            return None
        smoother = Smoother(self._design, rules, self._seed)
        return self._path(smoother, found, smoother.smoothed(found), margin, clearance)

    def _path(
        self,
        smoother: Smoother,
        found: tuple[Pose, ...],
        poses: tuple[Pose, ...],
        margin: float,
        clearance: float,
    ) -> PlannedPath:
        return PlannedPath(
            poses=poses,
            found=found,
            length=float(smoother.lengths(poses).sum()),
            margin=max(smoother.design.limits.margin or 0.0, margin),
            clearance=clearance,
            seconds=0.0,
            checked=0,
        )


def _comfort(start: Snapshot, goal: Snapshot) -> tuple[float, float]:
    """Return the margin and the clearance that a path had better keep, as both ends do."""
    most = COMFORT * start.design.reach
    margin = min(float(np.abs(each.margins).min()) for each in (start, goal))
    clearance = min(float(each.clearances.clearance.min()) for each in (start, goal))
    return min(most, SHARE_OF_ENDS * margin), min(most, SHARE_OF_ENDS * clearance)


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
    # Of the carriages' order the two ends tell together, see `_check_same_order`.
    position = np.array(snapshot.pose.position)
    broken = [
        str(each)
        for each in violations(
            snapshot.design,
            position,
            snapshot.rotation,
            snapshot.joints,
            snapshot.margins,
            signs,
            order=0,
        )
    ]
    clearances = snapshot.clearances.clearance.tolist()
    for (first, second), value in zip(PAIRS, clearances, strict=True):
        if not value > 0.0:
            shown = f"{value:.4g}".replace("-", "−")
            broken.append(f"legs {first} and {second} collide (clearance {shown})")
    if broken:
        raise EndError("outside limits", f"the {name} is outside the limits: {'; '.join(broken)}")


def _order(snapshot: Snapshot) -> int:
    """Return the sign of d3 − d1."""
    return int(np.sign(snapshot.joints[3] - snapshot.joints[1]))


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
