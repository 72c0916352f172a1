"""The actions that move the platform: to a pose, by one length or fold, or to another mode.

Where a length does not close, the nearest one that does lies on the singular set, since there a
tetrahedron is flat. So the length taken lies a little inside the interval of those that close: the
first from its end at which the verdict on the pose is clear, or where there is none, the one that
is farthest from singular.

The page shows and sets folds in degrees, with the signs of the mode. A fold of 0 or 180° is a wall
between two assembly modes. There it has the sign of the present one: 180° in a mode with a positive
margin is −180° in its neighbour with a negative one.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import replace

import numpy as np

from explorer.app.state import state as states
from explorer.app.state.actions import Words, action
from explorer.app.state.parts import with_value
from explorer.app.state.state import Folds, GivenFolds, State, joints_of, open_state
from explorer.errors import InputError
from explorer.measures.snapshot import evaluate
from explorer.measures.verdict import Verdict, verdict
from explorer.mechanism.design import JOINTS
from explorer.mechanism.feasible_intervals import feasible_intervals, nearest_feasible
from explorer.mechanism.folds import FOLDS, assembly_modes, pose_of_folds, to_folds
from explorer.mechanism.kinematics import ForwardKinematics, discriminants, forward
from explorer.mechanism.margins import MODE_BITS, mode_name, signs_of
from explorer.mechanism.pose import Pose, Triple
from explorer.numerics.number_text import format_apart, format_number

# Degrees, beside which an angle may be a rounding error.
FULL_TURN = 360.0
HALF_TURN = 180.0
# Degrees from 0 or 180 up to which a fold is flat but for rounding.
FLAT = 1e-9
# Index of φ1.
FIRST_FOLD = FOLDS.index("φ1")


@action("Home pose")
def go_home(state: State) -> State:
    """Move to the home pose."""
    return move_to(state, open_state(state.design).pose)


def value_words(names: Sequence[str], first_angle: int = 0) -> Words:
    """Return the words of an action that sets a named value by its index.

    Those before the index of the first angle are lengths; angles are in degrees.
    """

    def words(after: State, index: int, value: float) -> str:
        if index < first_angle:
            return f"{names[index]} = {after.unit.text(value, 6, size=after.design.reach)}"
        return f"{names[index]} = {format_number(value, 6, size=FULL_TURN)}°"

    return words


@action(value_words(JOINTS, first_angle=6))
def set_joint(state: State, joint: int, value: float) -> State:
    """Set one joint, by its index in `JOINTS`; where the lengths cannot close, keep the pose."""
    joints = with_value(state.joints, str(joint), value)
    solution = forward(state.design, joints)
    if solution.feasible:
        return assemble(replace(state, joints=joints), solution, state.mode)
    values = np.array(joints)
    intervals = feasible_intervals(state.design, values)[joint]
    unclosed = states.Unclosed(
        joint=joint,
        asked=value,
        nearest=nearest_feasible(state.design, values, joint, intervals),
        failing=tuple(np.flatnonzero(discriminants(state.design, values) < 0.0).tolist()),
    )
    return replace(state, joints=joints, unclosed=unclosed)


@action("Nearest usable length")
def use_nearest(state: State) -> State:
    """Set the nearest length that closes and stays clear, in place of one that does not close.

    The next state has a remark on why this length was taken.
    """
    unclosed, nearest = state.unclosed, clear_length(state)
    if unclosed is None or nearest is None:
        return state if unclosed is None else move_to(state, state.pose)
    value, words = nearest
    after = set_joint(unclosed.joint, value).apply(state)
    return replace(after, taken=(after.joints, words))


def _position_words(after: State, axis: int, value: float) -> str:
    name = "xyz"[axis] if after.view.at == "b4" else f"{'xyz'[axis]} of {after.point}"
    return f"{name} = {after.unit.text(value, 6, size=after.design.reach)}"


@action(_position_words)
def set_position(state: State, axis: int, value: float) -> State:
    """Set one coordinate of b4 or of the tool point, 0 to 2."""
    # The other coordinates are kept to the last bit.
    own = value - float(state.offset(state.pose.rotation)[axis])
    position = with_value(state.pose.position, str(axis), own)
    return move_to(state, Pose(position, state.pose.quaternion), state.yaw_pitch_roll)


@action(value_words(("yaw", "pitch", "roll")))
def set_angle(state: State, axis: int, value: float) -> State:
    """Set yaw, pitch or roll, 0 to 2, in degrees; the point that the position is of stays."""
    angles = with_value(state.yaw_pitch_roll, str(axis), value)
    orientation = Pose.of_yaw_pitch_roll(state.pose.position, angles)
    return move_to(state, state.pose_at(state.position, orientation), angles)


def _pose_words(after: State, _: Pose) -> str:
    unit, size = after.unit, after.design.reach
    place = (unit.number(x, size=size) for x in after.position)
    return f"Move {after.point} to {', '.join(place)} {unit.name}"


@action(_pose_words)
def set_pose(state: State, pose: Pose) -> State:
    """Set the whole pose, for instance by the drag handle."""
    return move_to(state, pose)


@action("Start where nothing is in the way")
def start_there(state: State, pose: Pose) -> State:
    """Move to a pose, and let the accessible workspace start there."""
    return move_to(with_value(state, "view.workspace.start", "pose"), pose)


@action(value_words(FOLDS, first_angle=1))
def set_fold(state: State, index: int, value: float) -> State:
    """Set one coordinate of the folds, by its index in `FOLDS`; the other five stay.

    r is in design units, the others are in degrees. A fold that is set flat stays in its mode.

    Raises:
        InputError: The coordinate is beyond its range.
    """
    least = -HALF_TURN if index >= FIRST_FOLD else 0.0
    if index > 0 and not least <= value <= HALF_TURN:
        low, high, given = format_apart((least, HALF_TURN, value), 6, format_number)
        raise InputError(f"{FOLDS[index]} must be {low}° to {high}°; got {given}°")
    folds = with_value(folds_of(state), str(index), value)
    pose, mode = pose_of_folds(folds), state.mode
    if index >= FIRST_FOLD and abs(value) not in {0.0, HALF_TURN}:
        bit = int(MODE_BITS[index - FIRST_FOLD])
        mode = mode | bit if value > 0.0 else mode & ~bit
    return replace(move_to(state, pose), mode=mode, set_folds=GivenFolds(folds, pose))


def folds_of(state: State) -> Folds:
    """Return r in design units and β, ε, φ1, φ2, φ3 in degrees, as the user set them if known.

    Where an angle or r vanishes, the pose does not determine all six.
    """
    given = state.set_folds
    if given is not None and given.pose == state.pose:
        r, beta, epsilon, phi1, phi2, phi3 = given.folds
    else:
        r, *angles = to_folds(state.pose.position, state.pose.rotation).tolist()
        beta, epsilon, phi1, phi2, phi3 = map(math.degrees, angles)
    first, second, third = signs_of(state.mode)
    phi1, phi2, phi3 = (_with_sign(phi1, first), _with_sign(phi2, second), _with_sign(phi3, third))
    return r, beta, epsilon, phi1, phi2, phi3


def _with_sign(fold: float, sign: int) -> float:
    """Return a fold in degrees; a flat one has the sign of its margin."""
    wall = HALF_TURN if abs(fold) > 0.5 * HALF_TURN else 0.0
    if fold * sign > 0.0 or abs(abs(fold) - wall) > FLAT:
        return fold
    # Zero is not negative.
    return sign * wall + 0.0


def _mode_words(_: State, mode: int) -> str:
    return f"Assembly mode {mode} ({mode_name(mode)})"


@action(_mode_words, is_jump=True)
def set_mode(state: State, mode: int) -> State:
    """Jump to another assembly mode of the same joints."""
    positions, rotations = assembly_modes(state.pose.position, state.pose.rotation)
    return replace(move_to(state, Pose.of(positions[mode], rotations[mode])), mode=mode)


def move_to(state: State, pose: Pose, yaw_pitch_roll: Triple | None = None) -> State:
    """Return the state in another pose, with the joints and the mode of that pose."""
    return replace(
        state,
        pose=pose,
        yaw_pitch_roll=pose.yaw_pitch_roll if yaw_pitch_roll is None else yaw_pitch_roll,
        joints=joints_of(state.design, pose),
        mode=states.mode_at(pose, state.mode),
        unclosed=None,
    )


def assemble(state: State, solution: ForwardKinematics, mode: int) -> State:
    """Return the state in one of the eight poses that its joints have."""
    pose = Pose.of(solution.position[mode], solution.rotation[mode])
    return replace(state, pose=pose, yaw_pitch_roll=pose.yaw_pitch_roll, mode=mode, unclosed=None)


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
