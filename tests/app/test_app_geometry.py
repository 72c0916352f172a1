"""What stays with a preset, another unit or another design: the machine, and what was asked."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import fields, is_dataclass, replace
from typing import Any, cast

import msgspec
import pytest
from desk import Desk
from machines import FULL, PRECISE, same_for_all
from sample_states import iterates_of, rich_state, varied

from explorer import Actuators, Design, Limits, Pose, Tolerances
from explorer.app.features.feature import Services
from explorer.app.features.mechanism.feature import DesignPanel
from explorer.app.features.optimise.actions import end_run, revert, start_run, take_paper_problem
from explorer.app.features.optimise.state import Optimisation, OptimisationRequest, SearchResult
from explorer.app.features.optimise.work import PAPER_REQUEST
from explorer.app.features.paths.state import Paths, Stop
from explorer.app.session.history import start_history
from explorer.app.state.actions import Set, open_design, reset_design
from explorer.app.state.frame import Frame
from explorer.app.state.geometry import (
    clear_machine,
    open_geometry,
    preset_of,
    set_unit,
    set_variable,
)
from explorer.app.state.parts import value_at, with_value
from explorer.app.state.state import State, open_state
from explorer.app.state.view import View
from explorer.errors import InputError
from explorer.mechanism.design_file import PRESETS

OPTIMAL, INITIAL = PRESETS["paper-optimal"], PRESETS["paper-initial"]

LENGTHS = (
    *(f"design.tool.position.{axis}" for axis in range(3)),
    *(f"design.payload.centre.{axis}" for axis in range(3)),
    *(f"design.limits.leg_radii.{leg}" for leg in range(4)),
    *("view.warn_below", "view.workspace.level", "view.workspace.tolerance"),
    *(f"paths.stops.{index}.at.position.{axis}" for index in range(2) for axis in range(3)),
    *(f"optimisation.request.{name}" for name in ("reach", "clearance")),
)
"""The lengths that stay, by their paths."""

IN_OTHER_UNITS = """
paths: seconds, duration, slower, request
optimisation.request: starts
view.prototype: exploded, density
view.forces: force, moment, scale
view.precision: times, wanted, wanted_turn
"""
"""Numbers of the same parts that are no lengths in design units."""

# In the names of the fields of a design: a machine in which no field is that of an ideal one.
MACHINE = ("tool", "payload", "gravity", "actuators", "struts", "guide", "tolerances")
GEOMETRY = ("name", "unit_mm", "node_step", "a3", "b1", "b2", "b3", "home")


def machine_of(design: Design) -> tuple[object, ...]:
    return tuple(getattr(design, name) for name in MACHINE)


def geometry_of(design: Design) -> tuple[object, ...]:
    limits = msgspec.structs.replace(design.limits, leg_radii=Limits().leg_radii)
    return (*(getattr(design, name) for name in GEOMETRY), limits)


@pytest.fixture
def asked() -> State:
    """A state with a machine and with demands; all lengths have few digits in millimetres."""
    design = msgspec.structs.replace(
        FULL.with_limits(leg_radii=(0.8, 0.7, 0.6, 0.5)),
        gravity=(0.0, -1.0, 0.0),
        actuators=Actuators(error_mm=PRECISE.actuators.error_mm, speed_mm_s=same_for_all(50.0)),
        required_box=((5.0, 2.0, 7.0), (15.0, 8.0, 11.0)),
        tolerances=Tolerances(a1=(0.1, 0.2, 0.3)),
    )
    start, goal = (Pose((9.0, y, 9.0), OPTIMAL.home_pose.quaternion) for y in (5.0, 6.5))
    request = OptimisationRequest(volume=900.0, reach=19.0, clearance=0.3)
    state = with_value(
        open_state(design),
        "paths",
        Paths((Stop(start), Stop(goal)), kind="planned", holds_load=True),
    )
    state = with_value(state, "optimisation.request", request)
    for path, value in (
        ("view.warn_below", 1.7),
        ("view.workspace.level", 8.5),
        ("view.workspace.tolerance", 0.07),
        ("view.forces.force", (1.0, 2.0, 3.0)),
    ):
        state = with_value(state, path, value)
    return state


def with_unit(state: State, unit_mm: float) -> State:
    return set_unit(state, unit_mm).apply(state)


def with_geometry(state: State, design: Design) -> State:
    return open_geometry(design, state).apply(state)


def millimetres(state: State) -> dict[str, float]:
    """Return the lengths that stay in millimetres, and the volume in mm³, by path."""
    unit = state.design.unit_mm
    lengths = {path: unit * value_at(state, path) for path in LENGTHS}
    volume = Optimisation.of(state).request.volume
    return lengths if volume is None else {**lengths, "volume": unit**3 * volume}


def test_presets_and_unit_of_the_page_keep_payload_actuators_and_demands(
    asked: State, desk: Desk, services: Services
) -> None:
    panel = DesignPanel(services)
    named: dict[str, Any] = {}
    for handle, name, value in panel.updates(Frame(desk.state)):
        setattr(handle, name, value)
        named[getattr(handle, "label", "")] = handle
    asked = with_value(asked, "optimisation.request.reach", 25.0)
    desk.session.do(open_design(asked.design))
    desk.session.do(Set("optimisation", Optimisation.of(asked)))
    desk.session.do(Set("view", asked.view))
    for label, value in (("Preset", "paper-initial"), ("1 unit (mm)", 40.0)):
        desk.use(named[label], value)
        state = desk.state
        assert state.design.payload.mass_kg == FULL.payload.mass_kg
        assert machine_of(state.design)[2:] == machine_of(asked.design)[2:]
        assert state.design.unit_mm * (Optimisation.of(state).request.reach or 0.0) == 250.0
    assert state.design.unit_mm == 40.0
    assert state.design.variables == INITIAL.variables


def test_preset_changes_the_geometry_alone(asked: State) -> None:
    after = with_geometry(asked, INITIAL)
    assert geometry_of(after.design) == geometry_of(INITIAL)
    assert machine_of(after.design) == machine_of(asked.design)
    assert after.design.limits.leg_radii == asked.design.limits.leg_radii
    assert (after.pose, after.base) == (INITIAL.home_pose, after.design)
    assert after.view == asked.view
    assert Paths.of(after) == Paths.of(asked)
    assert Optimisation.of(after).request == Optimisation.of(asked).request
    assert preset_of(after.design) == "paper-initial"
    assert preset_of(set_variable("b2", 2.5).apply(after).design) is None
    assert preset_of(after.design.with_limits(gap=0.5)) is None
    assert clear_machine().apply(after).design == INITIAL


@pytest.mark.parametrize(("unit", "is_preset"), [(40.0, False), (2.5, False), (40.0, True)])
def test_millimetres_that_were_asked_for_stay_in_another_unit(
    asked: State, unit: float, is_preset: bool
) -> None:
    preset = msgspec.structs.replace(INITIAL, unit_mm=unit)
    after = with_geometry(asked, preset) if is_preset else with_unit(asked, unit)
    assert after.design.unit_mm == unit
    assert millimetres(after) == pytest.approx(millimetres(asked), rel=1e-14)
    for name in ("actuators", "struts", "guide", "tolerances", "gravity"):
        assert getattr(after.design, name) == getattr(asked.design, name)
    assert after.design.payload.mass_kg == asked.design.payload.mass_kg
    request, before = Optimisation.of(after).request, Optimisation.of(asked).request
    assert request.free == before.free
    assert after.view.forces == asked.view.forces
    # What is shown as 190 mm is 190 again, and not 189.99999999999997.
    assert after.unit.convert(request.reach or 0.0) == 190.0
    # A preset has no required box; that of the same design is where it was.
    if is_preset:
        assert after.design.required_box is None
    else:
        assert after.design.required_box is not None
        assert after.unit.convert(after.design.required_box[1][0]) == 150.0
        assert after.design.variables == asked.design.variables
        assert after.design.limits.box == asked.design.limits.box
        assert (after.pose, after.joints, after.base) == (asked.pose, asked.joints, asked.base)
        assert with_unit(after, asked.design.unit_mm) == asked


def test_design_units_that_were_asked_for_stay_where_the_page_shows_them(asked: State) -> None:
    shown = Set("view.lengths", "design units").apply(asked)
    after = with_unit(shown, 40.0)
    assert after == replace(shown, design=msgspec.structs.replace(shown.design, unit_mm=40.0))


def test_file_brings_its_machine_and_what_was_asked_stays_in_its_millimetres(asked: State) -> None:
    design = msgspec.structs.replace(PRECISE, unit_mm=40.0)
    after = open_design(design).apply(asked)
    assert after.design == design
    kept = [path for path in LENGTHS if not path.startswith("design")]
    before = millimetres(asked)
    assert [millimetres(after)[path] for path in kept] == pytest.approx([before[p] for p in kept])
    assert reset_design().apply(with_unit(after, 10.0)).design == design


def test_undo_of_another_unit_keeps_what_is_shown(asked: State) -> None:
    history = start_history(asked)
    present = with_unit(asked, 40.0)
    assert history.restore(present).step.state == asked


def test_paper_problem_keeps_the_machine_but_for_the_radii(asked: State) -> None:
    after = take_paper_problem().apply(asked)
    assert machine_of(after.design) == machine_of(asked.design)
    assert geometry_of(after.design)[1:7] == geometry_of(INITIAL)[1:7]
    assert after.design.limits == OPTIMAL.limits
    assert Optimisation.of(after).request == PAPER_REQUEST


def test_tool_too_far_for_a_small_preset_is_refused(asked: State) -> None:
    far = with_value(asked, "design.tool.position.2", 1900.0)
    with pytest.raises(InputError, match="must lie within 100 reaches"):
        with_geometry(far, INITIAL)


def numbers_of(part: Any, path: str) -> Iterator[tuple[str, bool]]:
    """Yield the path of each number in a part, and whether its field declares a length."""
    for field in fields(part):
        value, name = getattr(part, field.name), f"{path}.{field.name}"
        if is_dataclass(value):
            assert "power" in field.metadata or not any(d for _, d in numbers_of(value, name))
            yield from numbers_of(value, name)
        elif _is_number(value):
            yield name, "power" in field.metadata


def _is_number(value: Any) -> bool:
    if isinstance(value, tuple):
        return any(map(_is_number, cast("tuple[object, ...]", value)))
    return isinstance(value, float | int | Pose) and not isinstance(value, bool)


def test_every_number_of_view_paths_and_request_is_a_declared_length_or_none() -> None:
    paths = Paths((Stop(OPTIMAL.home_pose), Stop(OPTIMAL.home_pose)))
    request = replace(varied(OptimisationRequest()), free=())
    lines = [line.split(": ") for line in IN_OTHER_UNITS.strip().splitlines()]
    others = {f"{part}.{name}" for part, names in lines for name in names.split(", ")}
    found = dict(
        number
        for part, path in (
            (varied(View()), "view"),
            (paths, "paths"),
            (request, "optimisation.request"),
        )
        for number in numbers_of(part, path)
    )
    assert {path for path, is_length in found.items() if not is_length} == others


def test_state_with_everything_in_it_takes_another_unit_and_a_preset() -> None:
    state = with_geometry(with_unit(rich_state(), 3.0), INITIAL)
    assert clear_machine().apply(state).design == INITIAL


def test_result_that_is_given_up_after_another_unit_leaves_what_was_shown(asked: State) -> None:
    state = start_run().apply(asked)
    iterates = iterates_of(state, 2)
    end = end_run(1, SearchResult("converged", "It ended.", iterates[-1]), iterates)
    other = with_unit(end.apply(state), 40.0)
    back = revert().apply(other)
    assert (back.design, back.pose, Paths.of(back)) == (asked.design, asked.pose, Paths.of(asked))
    found, expected = millimetres(back), millimetres(asked)
    assert found == pytest.approx(expected, rel=1e-14)
