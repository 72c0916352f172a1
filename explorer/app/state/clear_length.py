"""The nearest length that closes and stays clear of singularities.

Lengths that just close lie on the singular set, since there a tetrahedron is flat. So the length
taken lies a little inside the interval of those that close: the first from its end at which the
verdict on the pose is clear, or where there is none, the one that is farthest from singular.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from explorer.app.state.parts import with_value
from explorer.app.state.state import State
from explorer.measures.snapshot import evaluate
from explorer.measures.verdict import Verdict, verdict
from explorer.mechanism.design import JOINTS
from explorer.mechanism.feasible_intervals import feasible_intervals
from explorer.mechanism.kinematics import forward
from explorer.mechanism.pose import Pose

# Number of lengths tried within an interval, and of halvings that refine the first clear one.
TRIALS, HALVINGS = 24, 14


def clear_length(state: State) -> tuple[float, str] | None:
    """Return the nearest clear length of the joint that does not close, and why it is taken.

    It is None if no length closes, or if every one that was tried is singular.
    """
    unclosed = state.unclosed
    if unclosed is None or unclosed.nearest is None:
        return None
    joint, end, unit = unclosed.joint, unclosed.nearest, state.unit
    intervals = feasible_intervals(state.design, np.array(state.joints))[joint]
    low, high = min(intervals, key=lambda ends: min(abs(ends[0] - end), abs(ends[1] - end)))
    far = high if abs(end - low) < abs(high - end) else low

    def length(share: float) -> float:
        return end + share * (far - end)

    def level(share: float) -> float:
        found = _verdict(state, joint, length(share))
        return 0.0 if found is None else min(found.levels)

    best, is_clear = _first_clear(level)
    value = length(best)
    there = _verdict(state, joint, value)
    if there is None or there.kind == "singular":
        return None
    taken, singular = unit.text(value), unit.text(end)
    instead = f"{JOINTS[joint]} = {taken} instead of {unit.text(unclosed.asked, 6)}. "
    why = f"{instead}The nearest value that closes, {singular}, is singular; "
    short = f"{unit.text(abs(value - end), 3)} short of it: {there.reason(unit)}."
    if is_clear:
        return value, f"{why}this is the nearest that stays clear, {short}"
    return value, f"{why}none stays clear, and this is the farthest from singular, {short}"


def _first_clear(level: Callable[[float], float]) -> tuple[float, bool]:
    """Return the least share from 0 to 1 with a level of one, and whether there is any.

    If there is none, the share with the highest level is returned; 0 if all levels are zero.
    """
    best, before, best_level = 0.0, 0.0, 0.0
    for trial in range(1, TRIALS):
        share = trial / TRIALS
        here = level(share)
        if here >= 1.0:
            for _ in range(HALVINGS):
                middle = 0.5 * (before + share)
                before, share = (before, middle) if level(middle) >= 1.0 else (middle, share)
            return share, True
        if here > best_level:
            best, best_level = share, here
        before = share
    return best, False


def _verdict(state: State, joint: int, value: float) -> Verdict | None:
    """Return the verdict on the pose; None where the joints do not close."""
    solution = forward(state.design, with_value(state.joints, str(joint), value))
    if not solution.feasible:
        return None
    pose = Pose.of(solution.position[state.mode], solution.rotation[state.mode])
    return verdict(evaluate(state.design, pose), state.warn_below)
