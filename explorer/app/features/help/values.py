"""The values of the state that courses name, each with how it is set for a user."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any

import msgspec
import numpy as np

from explorer.app.features.optimise.actions import start_run, take_paper_problem
from explorer.app.features.optimise.state import Optimisation
from explorer.app.features.paths.actions import go
from explorer.app.features.paths.state import Stop, journey_of
from explorer.app.features.singularity.work import go_to_singularity
from explorer.app.state.frame import Frame
from explorer.app.state.geometry import set_variable
from explorer.app.state.moves import (
    FIRST_FOLD,
    HALF_TURN,
    folds_of,
    go_home,
    set_fold,
    set_mode,
    set_position,
)
from explorer.app.state.parts import value_at, with_value
from explorer.app.state.state import State
from explorer.measures.verdict import TITLES
from explorer.mechanism.machine import Payload
from explorer.mechanism.margins import TETRAHEDRA
from explorer.statics.loaded import LoadedPose

# What "Show me" does: the stride of the platform in reaches, the height over the base plane in
# warning lengths, the factor on a variable, and that on the margin to be the smallest.
STRIDE, NEAR, GROWTH, FLATTER = 0.1, 0.5, 1.1, 0.5
FLAT = tuple(map(" ".join, TETRAHEDRA))


@dataclass(frozen=True)
class Named:
    """A value of the state.

    Attributes:
        read: Function of the present frame and of that in which a step began that returns it, in
            % of the reach if it is a length, or the word of a choice; None where it has none.
        set: Function from a state to one with another value; None if it cannot be set.
        options: The words of a choice; () for a number.
    """

    read: Callable[[Frame, Frame], float | str | None]
    set: Callable[[State, Any], State] | None = None
    options: tuple[str, ...] = ()
    is_length: bool = False


def _choice(path: str, values: Mapping[str, object]) -> Named:
    """Return a choice that is a value of the state, given its path and the values of its words."""

    def word(now: Frame, _: Frame) -> str | None:
        present = value_at(now.state, path)
        return next((each for each, value in values.items() if value == present), None)

    return Named(word, lambda state, word: with_value(state, path, values[word]), tuple(values))


def _event(
    has_come: Callable[[State, State], bool], word: str, make: Callable[[State], State]
) -> Named:
    """Return a choice with one word, for what has come since the state in which a step began."""
    return Named(
        lambda now, start: word if has_come(now.state, start.state) else None,
        lambda state, _: make(state),
        (word,),
    )


def _sizes(frame: Frame) -> list[float]:
    """Return |δ1|, |δ2| and |δ3|, in % of the reach."""
    return (100.0 / frame.state.design.reach * np.abs(frame.snapshot.margins)).tolist()


def _flattest(frame: Frame) -> int:
    return int(np.argmin(_sizes(frame)))


def _margin(which: Callable[[Frame], int]) -> Named:
    """Return the margin with the index that a function of the frame returns."""
    return Named(
        lambda now, _: _sizes(now)[which(now)],
        lambda state, size: _flatten(state, which(Frame(state)), size),
        is_length=True,
    )


def _flatten(state: State, index: int, size: float) -> State:
    """Return a state with |δ| of an index of a size in %, or the largest, by its fold alone."""
    r, beta, epsilon, *folds = folds_of(state)
    sines = math.sin(math.radians(beta)), math.sin(math.radians(epsilon))
    largest = 100.0 / state.design.reach * r * (sines[1], sines[0] * sines[1], sines[0])[index]
    angle = math.degrees(math.asin(size / largest)) if size < largest else 0.5 * HALF_TURN
    if abs(folds[index]) > 0.5 * HALF_TURN:
        angle = HALF_TURN - angle
    return set_fold(FIRST_FOLD + index, math.copysign(angle, folds[index])).apply(state)


def _make_flattest(state: State, name: str) -> State:
    sizes, index = _sizes(Frame(state)), FLAT.index(name)
    return _flatten(state, index, FLATTER * min(sizes[:index] + sizes[index + 1 :]))


def _to_verdict(state: State, title: str) -> State:
    if title == TITLES["clear"]:
        home = go_home().apply(state)
        is_clear = Frame(home).verdict.kind == "clear"
        return home if is_clear else with_value(home, "view.warn_below", None)
    if title == TITLES["singular"]:
        is_there = Frame(state).snapshot.is_singular
        return state if is_there else go_to_singularity(None).apply(state)
    # Lower b4 towards the base plane: δ3 is its height.
    height = math.copysign(NEAR * state.warn_below, state.pose.position[2])
    return set_position(2, height + float(state.offset(state.pose.rotation)[2])).apply(state)


def _amplification(now: Frame, _: Frame) -> float:
    """Return one over the smallest singular value of J with lengths over the reach."""
    # Rounding leaves some of it in a singular pose.
    least = 0.0 if now.snapshot.is_singular else float(now.snapshot.smallest_singular_value)
    return 1.0 / least if least > 0.0 else math.inf


def _load(now: Frame, _: Frame) -> str:
    """Tell whether the force and the moment of the tab Loads are held, weights aside."""
    design = msgspec.structs.replace(now.state.design, payload=Payload())
    moves = LoadedPose(design, now.state.pose, now.state.load).moves_platform
    return "not held" if moves else "held"


def _set_load(state: State, word: str) -> State:
    """Return a state with 1 N m about the line of a free turn, or with no load at all."""
    turns = Frame(state).snapshot.freedoms.turns if word == "not held" else ()
    moment = tuple(turns[0].direction.round(3).tolist()) if turns else (0.0, 0.0, 0.0)
    state = with_value(state, "view.forces.force", (0.0, 0.0, 0.0))
    return with_value(state, "view.forces.moment", moment)


def _sign_changes(now: Frame, _: Frame) -> float | None:
    """Return how often a margin changes its sign on the path; None without a path."""
    journey = journey_of(now.state)
    if journey is None or journey.margins.lies_in:
        return None
    return float(sum(each.changes_sign for each in journey.margins.crossings))


def _cross(state: State, count: float) -> State:
    """Return a state that plays a straight path to a mode in which so many signs differ.

    It begins at home if the pose is singular, where some of the modes coincide.
    """
    state = go_home().apply(state) if Frame(state).snapshot.is_singular else state
    goal = state.mode ^ (0, 4, 5, 7)[int(count)]
    state = with_value(state, "paths.stops", (Stop(), Stop(goal)))
    return go().apply(with_value(state, "paths.kind", "straight"))


VALUES: dict[str, Named] = {
    "platform": _event(
        lambda now, start: now.pose != start.pose,
        "moved",
        lambda state: set_position(1, state.position[1] + STRIDE * state.design.reach).apply(state),
    ),
    "design": _event(
        lambda now, start: now.design.variables != start.design.variables,
        "changed",
        lambda state: set_variable("a3x", GROWTH * state.design.variables[0]).apply(state),
    ),
    "search": _event(
        lambda now, start: (
            Optimisation.of(now).count > Optimisation.of(start).count
            and not Optimisation.of(now).is_on
        ),
        "ended",
        start_run().apply,
    ),
    "problem": _event(lambda _, __: False, "that of the paper", take_paper_problem().apply),
    "solid": _choice("view.workspace.solid", {"on": True, "off": False}),
    "tetrahedra": _choice("view.tetrahedra", {"on": (True,) * 3, "off": (False,) * 3}),
    "ghosts": _choice("view.ghosts", {"on": True, "off": False}),
    "sliders": _choice("view.coordinates", {"Pose": "position", "Leg lengths": "lengths"}),
    "weights": _choice("view.forces.weighed", {"none": "none", "payload": "payload"}),
    "δ1": _margin(lambda _: 0),
    "δ2": _margin(lambda _: 1),
    "δ3": _margin(lambda _: 2),
    "smallest margin": _margin(_flattest),
    "flattest tetrahedron": Named(lambda now, _: FLAT[_flattest(now)], _make_flattest, FLAT),
    "verdict": Named(lambda now, _: now.verdict.title, _to_verdict, (*TITLES.values(),)),
    "amplification": Named(_amplification),
    "load": Named(_load, _set_load, ("held", "not held")),
    "mode": Named(
        lambda now, _: None if now.snapshot.is_singular else str(now.state.mode),
        lambda state, mode: set_mode(int(mode)).apply(state),
        tuple("01234567"),
    ),
    "sign changes on the path": Named(_sign_changes, _cross),
}
"""What courses name; margins are magnitudes."""
