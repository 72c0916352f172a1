"""States of every kind to save: after random actions, and one that no value is new in."""

from __future__ import annotations

import contextlib
from collections.abc import Callable
from dataclasses import dataclass, fields, is_dataclass, replace
from typing import Any, TypeVar, cast, get_args, get_type_hints

import msgspec
from hypothesis import strategies as st

from explorer.app.features.calibration.feature import Calibrated
from explorer.app.features.compare.feature import pin, unpin
from explorer.app.features.compare.work import CompareView
from explorer.app.features.optimise.actions import (
    accept,
    add_iterates,
    cancel_run,
    compare,
    end_run,
    start_run,
)
from explorer.app.features.optimise.state import (
    Optimisation,
    OptimisationRequest,
    SearchResult,
    SearchRun,
)
from explorer.app.features.paths.actions import go, play, set_path_time
from explorer.app.features.paths.state import Stop
from explorer.app.features.paths.stops import add_present
from explorer.app.features.requirement.state import EXAMPLE, Required
from explorer.app.features.studies.state import Brush, Studies, brush_axes
from explorer.app.session.history import UserAction
from explorer.app.state.actions import Action, Set, open_design
from explorer.app.state.geometry import set_variable
from explorer.app.state.moves import (
    go_home,
    set_angle,
    set_fold,
    set_joint,
    set_mode,
    set_position,
    use_nearest,
)
from explorer.app.state.parts import value_at, with_value
from explorer.app.state.state import State, open_state
from explorer.app.state.view import PrecisionView, PrototypeView, SingularView, View, WorkspaceView
from explorer.errors import ExplorerError
from explorer.measures.catalogue import measure_design, measures_in
from explorer.measures.measure import Case
from explorer.mechanism.design import VARIABLES, Limits
from explorer.mechanism.design_file import PRESETS
from explorer.mechanism.pose import Pose
from explorer.mechanism.tilt_torsion import TiltTorsion
from explorer.optimise.outcome import Iterate, IterateRecord, Record, Run, Settings
from explorer.optimise.problem import YAW
from explorer.six_legged.files import TABLES

OPTIMAL = PRESETS["paper-optimal"]
MEASURED = measure_design(Case(OPTIMAL), measures_in("optimise"))

Make = Callable[[State, int, float], Action]
Sample = tuple[Make, int, float]


@dataclass(frozen=True)
class Change(Action):
    """Replace values of a part of the state, named by a dotted path; "" is the state itself."""

    part: str
    values: dict[str, Any]

    def apply(self, state: State) -> State:
        if not self.part:
            return replace(state, **self.values)
        changed = replace(value_at(state, self.part), **self.values)
        return with_value(state, self.part, changed)


def _length(share: float) -> float:
    return 45.0 * share - 10.0


def _view(_: State, i: int, share: float) -> Action:
    return Change(
        "view",
        {
            "workspace": WorkspaceView(
                solid=i > 2,
                region=("limits", "accessible", "held")[i % 3],
                colour=("share", "force", "plain")[i % 3],
                cut=("x", "y", None)[i % 3],
                level=share,
            ),
            "prototype": PrototypeView(exploded=share),
            "drawn_as": ("schematic", "prototype", "6-4 twin")[i % 3],
            "singular": SingularView(ghost="δ2 = 0", strata=i > 2),
            "precision": PrecisionView(
                ellipsoid=i > 2,
                deflected=i > 1,
                times=None if i == 0 else 10.0,
                over=("pose", "box", "workspace")[i % 3],
                wanted=None if i == 0 else 0.1 + share,
            ),
            "tetrahedra": (i > 1, i > 2, i > 3),
            "warn_below": None if i == 0 else 1.0 + share,
            "ghosts": i % 2 == 0,
        },
    )


def _limited(state: State, i: int, share: float) -> Action:
    state.check_free()
    return Change("", {"design": msgspec.structs.replace(state.design, limits=_limits(i, share))})


def _limits(i: int, share: float) -> Limits:
    return Limits(
        d2=(share, None),
        guide=None if i % 2 else (-share, 20.0),
        box=((0.0, -12.0, -0.0), (20.0, 22.0, 18.0 + share)),
        margin=(None, 0.0, share)[i % 3],
        leg_radii=(share, 0.1, 0.2, 0.3),
    )


def _request(_: State, i: int, share: float) -> Action:
    return Change(
        "optimisation.request",
        {
            "volume": None if i == 0 else 1.0 + 1e4 * share,
            "clearance": share,
            "free": (VARIABLES[i], YAW),
            "starts": i + 1,
        },
    )


def _end(state: State, count: int) -> Action:
    run = Optimisation.of(state).run
    new = iterates_of(state, count)
    shown = (() if run is None else run.iterates) + new
    best = shown[-1] if shown else None
    record = None if run is None or best is None else _record(run, shown, best)
    verdict = SearchResult("stalled", "no step made it better", best, 2, 1, 0.1, record)
    return end_run(Optimisation.of(state).count, verdict, new)


def _record(run: SearchRun, iterates: tuple[Iterate, ...], best: Iterate) -> Record:
    return Record(
        problem=run.problem,
        settings=Settings(starts=run.starts),
        design=best.design,
        chosen=0,
        runs=(
            Run(
                start=run.problem.start_values,
                status="stalled",
                best=best.number,
                iterations=9,
                evaluations=99,
                attempts=1,
                holding="clearance",
                message="no step made it better",
            ),
        ),
        history=msgspec.convert(iterates, tuple[IterateRecord, ...], from_attributes=True),
        seconds=1 / 3,
        versions={"python": "3.12"},
    )


MAKERS: tuple[Make, ...] = (
    lambda state, i, share: set_joint(i, _length(share)),
    lambda state, i, share: set_position(i % 3, _length(share)),
    lambda state, i, share: set_angle(i % 3, 360.0 * share - 180.0),
    lambda state, i, share: set_fold(i, 180.0 * share if i < 3 else 360.0 * share - 180.0),
    lambda state, i, share: set_mode(i),
    lambda state, i, share: set_variable(VARIABLES[i], _length(share)),
    lambda state, i, share: Change("", {"hold": "pose" if share < 0.5 else "legs"}),
    lambda state, i, share: use_nearest(),
    lambda state, i, share: go_home(),
    lambda state, i, share: open_design(list(PRESETS.values())[i % 2]),
    _limited,
    _view,
    lambda state, i, share: go(),
    lambda state, i, share: set_path_time(8.0 * share),
    lambda state, i, share: play(i > 2),
    lambda state, i, share: Change("paths", {"stops": (Stop((None, i, state.pose)[i % 3]),)}),
    lambda state, i, share: Change(
        "paths", {"stops": (Stop(), Stop((7 - i, state.pose)[i % 2], share))[: 1 + i % 2]}
    ),
    lambda state, i, share: add_present(state),
    lambda state, i, share: Change(
        "paths",
        {
            "kind": "straight" if i > 2 else "planned",
            "seconds": 1e-3 + share,
            "holds_load": share > 0.5,
            "law": ("watchable", "shortest", "duration")[i % 3],
            "duration": 1e-3 + share,
        },
    ),
    _request,
    lambda state, i, share: start_run(),
    lambda state, i, share: add_iterates(Optimisation.of(state).count, iterates_of(state, i)),
    lambda state, i, share: cancel_run(),
    lambda state, i, share: _end(state, i),
    lambda state, i, share: compare(Optimisation.of(state).count, (MEASURED, MEASURED)),
    lambda state, i, share: accept(),
    lambda state, i, share: pin(state.design),
    lambda state, i, share: pin(tuple(TABLES.values())[i % len(TABLES)]),
    lambda state, i, share: unpin(i % 3),
    lambda state, i, share: Change("compared.look", {"overlay": share < 0.5}),
    lambda state, i, share: brush_axes((Brush("volume", ((share, 10.0),)),)),
)


def samples(most: int = 30) -> st.SearchStrategy[list[Sample]]:
    """Draw actions, each with an index and a share."""
    one = st.tuples(st.sampled_from(MAKERS), st.integers(0, 5), st.floats(0, 1))
    return st.lists(one, max_size=most)


def states_of(actions: list[Sample]) -> list[State]:
    """Return the states from the paper's optimum on, one after each action that is possible."""
    states = [open_state(OPTIMAL)]
    for number, (make, index, share) in enumerate(actions):
        with contextlib.suppress(ExplorerError):
            action = make(states[-1], index, share)
            act = UserAction(action, make, float(number))
            states.append(act.apply(states[-1]))
    return states


def iterates_of(state: State, count: int) -> tuple[Iterate, ...]:
    """Return iterates of the run of a state, in two starts; none without a run."""
    run = Optimisation.of(state).run
    if run is None:
        return ()
    problem, iterates = run.problem, list[Iterate]()
    for number in range(len(run.iterates), len(run.iterates) + count):
        values = tuple(value * (1.0 + 1e-3 * number) for value in problem.start_values)
        iterates.append(
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
    return tuple(iterates)


def rich_state() -> State:
    """Return a state in which every saved value differs from that of a new state."""
    limits = _limits(2, 1 / 3)
    home = open_state(OPTIMAL).pose
    beyond = Pose((11.1, *home.position[1:]), home.quaternion)
    state = open_state(msgspec.structs.replace(OPTIMAL, name="é «one»", limits=limits, home=home))
    request = vars(varied(OptimisationRequest())) | {
        "volume": 1e4 / 3,
        "free": (VARIABLES[4], YAW),
    }
    actions: list[Action | Callable[[State], Action]] = [
        Change("optimisation.request", request),
        set_variable("b2", 2.7),
        Change("", {"view": varied(View()), "hold": "legs"}),
        set_position(0, 11.1),
        Change("paths", {"stops": (Stop(home, 1 / 3), Stop(beyond)), "seconds": 1 / 3}),
        start_run(),
        lambda state: _end(state, 6),
        accept(),
        Change("paths", {"stops": (Stop(3), Stop(5, 1 / 7))}),
        go(),
        set_path_time(10 / 3),
        Change("paths", {"stops": (Stop(home), Stop(beyond)), "kind": "planned", "chosen": 1}),
        Change("paths", {"law": "duration", "duration": 0.5, "slower": 10.0, "holds_load": True}),
        pin(OPTIMAL),
        pin(TABLES["octahedral"]),
        Change("compared", {"look": varied(CompareView())}),
        Set("studies", varied(Studies())),
        Set("calibrated", Calibrated("l1;é\n1", "x,y,z\n", 1 / 3, 1 / 7)),
        Set("required", Required(msgspec.structs.replace(EXAMPLE, tilt_deg=1 / 3), True)),
        Change("", {"set_tilt_torsion": TiltTorsion(1 / 3, 20.0, -50.0)}),
        Change("", {"set_tool_angles": (1 / 3, 90.0, -50.0)}),
        brush_axes((Brush("volume", ((1 / 3, 10.0),)),)),
        set_fold(4, 100 / 3),
        set_joint(0, 99.1),
    ]
    for action in actions:
        step = action if isinstance(action, Action) else action(state)
        state = step.apply(state)
    return state


Part = TypeVar("Part")


def varied(part: Part) -> Part:
    """Return a part of the state in which every value is another one, by its type."""
    types = get_type_hints(type(part))
    names = (field.name for field in fields(cast("Any", part)))
    values = {name: _varied(getattr(part, name), types[name]) for name in names}
    return replace(cast("Any", part), **values)


def _varied(value: Any, kind: Any) -> Any:
    if is_dataclass(value):
        return varied(value)
    if isinstance(value, bool):
        return not value
    if isinstance(value, int | float):
        return value + (1 if isinstance(value, int) else 1 / 3)
    if isinstance(value, tuple):
        entries = cast("tuple[Any, ...]", value)
        if all(isinstance(each, float) for each in entries):
            return tuple(each + 1 / 3 for each in entries)
        return tuple(not each if each is True else each for each in reversed(entries))
    kinds = get_args(kind) if type(None) in get_args(kind) else (kind,)
    samples = {str: "another", int: 7, float: 1 / 3}
    choices = [each for one in kinds for each in (get_args(one) or (samples.get(one),))]
    return next(each for each in choices if each not in (None, value))
