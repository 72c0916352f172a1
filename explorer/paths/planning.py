"""Paths between two poses of one mode that keep all limits, margins and clearances.

A load can be demanded too: the path then holds it within the limits of actuators, struts and guide,
see `explorer.paths.loads`.

Two kinds of ends that no path joins are refused before any search: those of different modes, and
those between which two legs would have to pass each other on the guide. Other ends are joined by
the straight line in the folds, which meets no singularity and keeps the margins of its ends. Only
where that line is not proven valid, mostly for another limit, does `explorer.paths.search` look for
a way round. In both cases a proof of the limits covers every move as a whole.
"""

from __future__ import annotations

import math
import time
from dataclasses import dataclass
from typing import Literal

import numpy as np
from numpy.typing import ArrayLike

from explorer.errors import InputError, NoAnswerError
from explorer.measures.snapshot import Snapshot, evaluate
from explorer.mechanism.configuration import one_tool
from explorer.mechanism.design import JOINTS, Design
from explorer.mechanism.folds import FOLD_LINES, from_folds, to_folds, write_poses
from explorer.mechanism.margins import INCIDENCES, mode_name
from explorer.mechanism.pose import Pose, Triple
from explorer.motion.weights import MovingBodies
from explorer.numerics.arrays import triple
from explorer.numerics.number_text import format_apart
from explorer.paths import search
from explorer.paths.loads import ROUNDING, DemandedLoad
from explorer.singularity.strata import incidences
from explorer.statics.reactions import PART_NAMES
from explorer.workspace.limits.quantities import valid_rows
from explorer.workspace.limits.valid_moves import DEFAULT_TOLERANCE, valid_move_rows
from explorer.workspace.limits.valid_poses import Rules, violations

DEFAULT_SECONDS = 2.0
# Preferred margin and clearance, as shares of those of the ends. The line in the folds keeps all of
# the margin, the moves along it nearly all. The clearance is at most a share of the reach.
SHARE_OF_MARGIN, SHARE_OF_CLEARANCE, PREFERRED_CLEARANCE = 0.9, 0.5, 0.02
# Share of the time for a search with the preferred margin and clearance.
SHARE_FOR_PREFERRED = 0.5
D1, D3 = JOINTS.index("d1"), JOINTS.index("d3")

Reason = Literal["other mode", "other order", "out of time"]


class NoPathError(NoAnswerError):
    """There is no path, as "other mode" and "other order" prove, or the search found none."""

    def __init__(self, reason: Reason, message: str) -> None:
        super().__init__(message)
        self.reason: Reason = reason


@dataclass(frozen=True)
class PlannedPath:
    """A path of straight moves, all of which keep limits, margins and clearances.

    Attributes:
        poses: Corners, from the start to the goal.
        unsmoothed: Corners before smoothing.
        length: Sum over the moves of the root-mean-square displacement of b1 to b4, in design
            units.
        margin: Proven lower bound of |δ1|, |δ2| and |δ3| along the path, in design units, to the
            tolerance of moves.
        clearance: Proven lower bound of the clearance of any two legs along the path, in design
            units.
        seconds: Time for search and smoothing.
        checked: Number of lines checked in the search.
        tool: Point that moves straight in the platform frame, in design units; None for b4.
    """

    poses: tuple[Pose, ...]
    unsmoothed: tuple[Pose, ...]
    length: float
    margin: float
    clearance: float
    seconds: float
    checked: int
    tool: Triple | None = None


def plan_path(
    design: Design,
    start: Pose,
    goal: Pose,
    *,
    seconds: float = DEFAULT_SECONDS,
    seed: int = 0,
    tool: Triple | None = None,
    load: ArrayLike | None = None,
    weights: MovingBodies | None = None,
) -> PlannedPath:
    """Return a path from a pose to another that keeps limits, margins and clearances.

    The margins keep the sign triple of the start, whatever the mode of the home pose, and the
    carriages keep their order at the start. Four paths are tried in turn: the straight line in the
    folds that also keeps nine tenths of the ends' margin and half of their clearance (at most 2 %
    of the reach), the line that does not, a search for a path that does, and one for any.

    Args:
        design: The manipulator.
        start: Pose at the start.
        goal: Pose at the end.
        seconds: Time for the search; smoothing takes some tenths of a second more.
        seed: Seed of the random shortcuts in smoothing. What a search finds also depends on the
            time that it has, and on earlier searches of the process.
        tool: Point that each move moves straight in the platform frame, in design units; None for
            b4. If the platform turns, b4 goes along a curve.
        load: (F; M) at the tool point of the design, shape (6,), in N and N × unit, that every
            pose has to hold within the limits of actuators, struts and guide, besides the weights
            and the payload's force of any direction. Samples of every move hold it, and poses
            between them to two hundredths of the limits; see `explorer.paths.loads`. None to demand
            no load.
        weights: All masses for the load, the payload's included; None for the payload alone.

    Raises:
        InputError: The start or the goal is singular, outside the limits or does not hold the load;
            `seconds` is not a positive number, or the tool or the load is not three or six finite
            numbers.
        NoPathError: There is no path, or the search ended without one.
        MissingExtraError: The straight line in the folds is not valid, and OMPL is not installed.
    """
    if not (math.isfinite(seconds) and seconds > 0.0):
        raise InputError(f"planning needs a time above zero, in seconds; got {seconds:g}")
    tool = None if tool is None else triple(one_tool(tool))
    demanded_load = None if load is None else DemandedLoad.of(design, load, weights)
    ends = evaluate(design, start), evaluate(design, goal)
    _check_ends(*ends, demanded_load)
    # Compiling takes seconds, once on a machine; they do not count as search.
    for kernel in (search.divide_line, valid_move_rows, valid_rows, write_poses):
        kernel.compile()
    order = int(np.sign(ends[0].joints[D3] - ends[0].joints[D1]))
    rules = Rules.of(design, ends[0].signs, order)
    margin = min(float(np.abs(end.margins).min()) for end in ends)
    # The signs of margins have to be certain, also of ends with small ones.
    tolerance = min(DEFAULT_TOLERANCE * design.reach, margin)
    least = min(float(end.clearances.clearance.min()) for end in ends)
    clearance = min(PREFERRED_CLEARANCE * design.reach, SHARE_OF_CLEARANCE * least)
    room = SHARE_OF_MARGIN * margin, clearance
    preferred, demanded = (rules.tighten(*room), *room), (rules, 0.0, 0.0)
    first, last = to_folds(*search.positions_and_rotations((start, goal)))
    began, checked = time.perf_counter(), 0
    for (own_rules, margin, clearance), share in (
        (preferred, 0.0),
        (demanded, 0.0),
        (preferred, SHARE_FOR_PREFERRED),
        (demanded, 1.0),
    ):
        proofs = search.Proofs(design, own_rules, tool, demanded_load, tolerance)
        if share:
            left = began + share * seconds - time.perf_counter()
            corners, lines = search.search_tree(proofs, first, last, max(left, 0.0))
        else:
            corners, lines = proofs.prove_line(first, last), 1
        checked += lines
        if corners is None:
            continue
        # The corners at the ends differ from these by rounding.
        between = zip(*from_folds(corners[1:-1]), strict=True)
        unsmoothed = (start, *(Pose.of(p, r) for p, r in between), goal)
        poses = search.smooth(proofs, unsmoothed, seed) if share else unsmoothed
        return PlannedPath(
            poses=poses,
            unsmoothed=unsmoothed,
            length=float(search.lengths_of_moves(design, poses).sum()),
            margin=max(design.limits.margin or 0.0, margin),
            clearance=clearance,
            seconds=time.perf_counter() - began,
            checked=checked,
            tool=tool,
        )
    raise NoPathError(
        "out of time",
        f"no path {'' if load is None else 'that holds the load '}was found within "
        f"{seconds:g} s ({checked} lines tried); there may be one: allow more time, or go by a "
        "pose in between",
    )


def _check_ends(start: Snapshot, goal: Snapshot, load: DemandedLoad | None) -> None:
    named = {"start": start, "goal": goal}
    for name, end in named.items():
        vanishing = incidences(end.stratum)
        if vanishing:
            words = " and ".join(INCIDENCES[index - 1] for index in vanishing)
            raise InputError(f"the {name} is singular ({words}); a path cannot start or end there")
    _check_same_mode(start, goal)
    for name, end in named.items():
        # `_check_same_order` compares the order of the carriages at both ends.
        broken = [str(violation) for violation in violations(end, start.signs, order=0)[0]]
        if broken:
            raise InputError(f"the {name} is outside the limits: {'; '.join(broken)}")
        if load is not None:
            used = load.utilisations(end.pose.position, end.pose.rotation)
            part, most = int(used.argmax()), float(used.max())
            if most > 1.0 + ROUNDING:
                number, _ = format_apart((100.0 * most, 100.0), 4)
                raise InputError(
                    f"the {name} does not hold the load: {PART_NAMES[part]} at {number} % of its "
                    "limit"
                )
    _check_same_order(start, goal)


def _check_same_mode(start: Snapshot, goal: Snapshot) -> None:
    if start.mode == goal.mode:
        return
    flat = [
        f"fold φ{index + 1} at the {FOLD_LINES[index]} is flat or undefined ({INCIDENCES[index]})"
        for index in range(3)
        if start.signs[index] != goal.signs[index]
    ]
    raise NoPathError(
        "other mode",
        f"the start is in mode {start.mode} ({mode_name(start.mode)}), the goal in mode "
        f"{goal.mode} ({mode_name(goal.mode)}): every path between them passes a pose where "
        f"{' and one where '.join(flat)}",
    )


def _check_same_order(start: Snapshot, goal: Snapshot) -> None:
    """Refuse poses between which the base ends of two legs would meet on the guide.

    Legs 1, 2 and 3 start from the guide at 0, d1 and d3. Two legs touch where two of these
    are equal, so their order is the same all along a path without collisions.
    """
    names = np.array(["a1", "d1", "d3"])
    first, last = (
        names[np.argsort([0.0, q[D1], q[D3]], kind="stable")].tolist()
        for q in (start.joints, goal.joints)
    )
    if first != last:
        raise NoPathError(
            "other order",
            f"on the guide the start has the order {', '.join(first)}, the goal "
            f"{', '.join(last)}: between them two legs would collide on the guide",
        )
