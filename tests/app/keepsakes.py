"""States of every kind to keep in files: what people do at random, and a run of the optimiser."""

from __future__ import annotations

import contextlib
from collections.abc import Callable
from dataclasses import replace

import msgspec
from hypothesis import strategies as st

from explorer.app.features.compare.actions import Pin, SetLook, Unpin
from explorer.app.features.optimise.actions import (
    Accept,
    Advance,
    CancelRun,
    Compare,
    EndRun,
    SetWish,
    StartRun,
)
from explorer.app.features.paths.actions import (
    ChooseModes,
    Plan,
    Play,
    SetPathTime,
    SetPlanSeconds,
    StoreEnd,
    WatchModes,
)
from explorer.app.features.singularity.actions import Jog, SetSingularView
from explorer.app.features.studies.actions import BrushAxis, OpenStudy
from explorer.app.session.gestures import ByHand
from explorer.app.state.action import Action
from explorer.app.state.actions import (
    GoHome,
    Open,
    SetAngle,
    SetHold,
    SetJoint,
    SetLimits,
    SetMode,
    SetPosition,
    SetUnit,
    SetVariable,
    SetView,
    UseNearest,
)
from explorer.app.state.compared import Look
from explorer.app.state.optimisation import PLACE, Comparison, SearchResult
from explorer.app.state.state import State, opened
from explorer.app.state.view import SingularView
from explorer.errors import ExplorerError
from explorer.measures.case import Case
from explorer.measures.catalogue import measures_in
from explorer.measures.measurements import measure_design
from explorer.mechanism.design import VARIABLES, Limits
from explorer.mechanism.design_file import PRESETS
from explorer.optimise.outcome import Iterate
from explorer.optimise.problem import YAW

OPTIMAL = PRESETS["paper-optimal"]
MEASURED = measure_design(Case(OPTIMAL), measures_in("optimise"))

Make = Callable[[State, int, float], Action]


def _length(share: float) -> float:
    return 45.0 * share - 10.0


def _view(state: State, i: int, share: float) -> Action:
    view = state.view
    workspace = replace(view.workspace, solid=i > 2, cut=("x", "y", None)[i % 3], level=share)
    prototype = replace(view.prototype, shown=i > 1, exploded=share)
    tetrahedra = (i > 1, i > 2, i > 3)
    warn = None if i == 0 else 1.0 + share
    return SetView(
        replace(
            view,
            workspace=workspace,
            prototype=prototype,
            tetrahedra=tetrahedra,
            warn_below=warn,
            ghosts=i % 2 == 0,
        )
    )


def _limits(i: int, share: float) -> Limits:
    return Limits(
        d2=(share, None),
        guide=None if i % 2 else (-share, 20.0),
        box=((0.0, -12.0, -0.0), (20.0, 22.0, 18.0 + share)),
        margin=(None, 0.0, share)[i % 3],
        leg_radii=(share, 0.1, 0.2, 0.3),
    )


def _wish(state: State, i: int, share: float) -> Action:
    wish = state.optimisation.wish
    return SetWish(
        replace(
            wish,
            volume=None if i == 0 else 1.0 + 1e4 * share,
            clearance=share,
            free=(VARIABLES[i], YAW, PLACE),
            starts=i + 1,
            box=None if i < 3 else ((0.0, 0.0, 0.0), (share + 1.0, 2.0, 1 / 3)),
        )
    )


MAKERS: tuple[Make, ...] = (
    lambda state, i, share: SetJoint(i, _length(share)),
    lambda state, i, share: SetPosition(i % 3, _length(share)),
    lambda state, i, share: SetAngle(i % 3, 360.0 * share - 180.0),
    lambda state, i, share: SetMode(i),
    lambda state, i, share: SetVariable(VARIABLES[i], _length(share)),
    lambda state, i, share: SetHold("pose" if share < 0.5 else "legs"),
    lambda state, i, share: UseNearest(),
    lambda state, i, share: GoHome(),
    lambda state, i, share: Open(list(PRESETS.values())[i % 2]),
    lambda state, i, share: SetUnit(1.0 + share),
    lambda state, i, share: SetLimits(_limits(i, share)),
    _view,
    lambda state, i, share: SetSingularView(SingularView(ghost="δ2 = 0", strata=i > 2)),
    lambda state, i, share: Jog(i, _length(share)),
    lambda state, i, share: ChooseModes(i, 7 - i),
    lambda state, i, share: WatchModes(),
    lambda state, i, share: SetPathTime(8.0 * share),
    lambda state, i, share: Play(on=i > 2),
    lambda state, i, share: StoreEnd("start" if i > 2 else "goal"),
    lambda state, i, share: SetPlanSeconds(1e-3 + share),
    lambda state, i, share: Plan(),
    _wish,
    lambda state, i, share: StartRun(),
    lambda state, i, share: Advance(state.optimisation.count, iterates_of(state, i)),
    lambda state, i, share: CancelRun(),
    lambda state, i, share: _end(state, i),
    lambda state, i, share: Compare(state.optimisation.count, Comparison(MEASURED, MEASURED)),
    lambda state, i, share: Accept(),
    lambda state, i, share: Pin(state.design),
    lambda state, i, share: Unpin(i % 3),
    lambda state, i, share: SetLook(Look(millimetres=i > 2, overlay=share < 0.5)),
)

Doing = tuple[Make, int, float]


def doings(most: int = 30) -> st.SearchStrategy[list[Doing]]:
    """Draw what people do: actions with an index and a share."""
    one = st.tuples(st.sampled_from(MAKERS), st.integers(0, 5), st.floats(0, 1))
    return st.lists(one, max_size=most)


def done(what: list[Doing]) -> list[State]:
    """Return the states that lead from the paper's optimum by these actions, the first included."""
    states = [opened(OPTIMAL)]
    for number, (make, index, share) in enumerate(what):
        with contextlib.suppress(ExplorerError):
            act = ByHand(make(states[-1], index, share), make, float(number))
            states.append(act.apply(states[-1]))
    return states


def iterates_of(state: State, count: int) -> tuple[Iterate, ...]:
    """Return iterates of the run of a state, in two starts; none without a run."""
    run = state.optimisation.run
    if run is None:
        return ()
    problem, found = run.problem, list[Iterate]()
    for number in range(len(run.iterates), len(run.iterates) + count):
        values = tuple(value * (1.0 + 1e-3 * number) for value in problem.start_values)
        found.append(
            Iterate(
                number=number,
                run=number // 4,
                phase="solving",
                design=problem.design_at(values),
                values=values,
                objective=1.0 / (1.0 + number % 5),
                volume=8000.0 / 3.0 + number,
                worst="clearance of legs 2 and 3" if number % 2 else "",
                spare=-0.25 if number % 3 == 1 else 1.0 / 3.0,
            )
        )
    return tuple(found)


def _end(state: State, count: int) -> Action:
    run = state.optimisation.run
    shown = (() if run is None else run.iterates) + iterates_of(state, count)
    best = shown[-1] if shown else None
    verdict = SearchResult("stalled", "no step made it better", best, 2, 1, count, 0.1)
    return EndRun(state.optimisation.count, verdict, iterates_of(state, count))


def rich_state() -> State:
    """Return a state in which nothing that can be kept is as it is at first."""
    limits = _limits(2, 1 / 3)
    home = opened(OPTIMAL).pose
    designed = msgspec.structs.replace(OPTIMAL, name="é «one»", limits=limits, home=home)
    what: list[Doing] = [
        (_wish, 4, 1 / 3),
        (lambda state, i, share: SetVariable("b2", share), 0, 2.7),
        (MAKERS[MAKERS.index(_view)], 5, 1 / 3),
        (lambda state, i, share: SetHold("legs"), 0, 0.0),
        (lambda state, i, share: StoreEnd("start"), 0, 0.0),
        (lambda state, i, share: SetPosition(0, share), 0, 11.1),
        (lambda state, i, share: StoreEnd("goal"), 0, 0.0),
        (lambda state, i, share: SetPlanSeconds(share), 0, 1 / 3),
        (lambda state, i, share: ChooseModes(3, 5), 0, 0.0),
        (lambda state, i, share: StartRun(), 0, 0.0),
        (lambda state, i, share: _end(state, i), 6, 0.0),
        (lambda state, i, share: Jog(i, share), 2, 1 / 3),
        (lambda state, i, share: WatchModes(), 0, 0.0),
        (lambda state, i, share: SetPathTime(share), 0, 10 / 3),
        (lambda state, i, share: Pin(OPTIMAL), 0, 0.0),
        (lambda state, i, share: SetLook(Look(shows="bars")), 0, 0.0),
        (lambda state, i, share: OpenStudy("trade-off"), 0, 0.0),
        (lambda state, i, share: BrushAxis("volume", ((share, 10.0),)), 0, 1 / 3),
        (lambda state, i, share: SetJoint(0, share), 0, 99.1),
    ]
    state = opened(designed)
    for make, index, share in what:
        state = make(state, index, share).apply(state)
    return state
