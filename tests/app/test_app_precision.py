"""Precision on the page: the figures, the ellipsoid, the deflected shape and the budget."""

from __future__ import annotations

import csv
import io
import math
import re
from collections.abc import Generator
from dataclasses import replace
from typing import Any

import msgspec
import numpy as np
import pytest
import viser
from desk import Desk, by_name
from services import StubWorker, services_for

from explorer import Actuators, Payload, Struts, Tolerances, Tool, actuator_forces, inverse
from explorer.app.features.feature import Services
from explorer.app.features.precision.actions import SetTolerances
from explorer.app.features.precision.budget import (
    SET,
    BudgetFeed,
    BudgetPart,
    budget_request,
    budget_rows,
)
from explorer.app.features.precision.panel import TYPICAL, PrecisionPanel
from explorer.app.features.precision.pose import PosePrecision
from explorer.app.features.precision.scene import DeflectedScene, ErrorEllipsoidScene, drawn_times
from explorer.app.features.precision.tasks import budget_of, budget_table
from explorer.app.scene.placing import Placed
from explorer.app.state.actions import Set
from explorer.app.state.frame import Frame
from explorer.app.state.state import State, opened
from explorer.app.state.view import ForcesView, PrecisionView
from explorer.app.widgets.buttons import Buttons
from explorer.errors import InputError, NoAnswerError
from explorer.export.tolerance_table import COLUMNS
from explorer.mechanism.design import Design
from explorer.mechanism.design_file import PRESETS
from explorer.mechanism.pose import Pose
from explorer.mechanism.typical import typical_machine
from explorer.statics.budget.costs import stated_tolerances
from explorer.statics.compliance import stiffness_of
from explorer.statics.error_sources import SOURCES

OPTIMAL = PRESETS["paper-optimal"]
TYPICAL_DESIGN = msgspec.structs.replace(
    typical_machine(OPTIMAL)[0], tool=Tool((1.0, -0.5, 2.0)), payload=Payload(0.5, (1.0, 0.0, 1.0))
)
SINGULAR = Pose((3.0, 4.0, 5.0), (1.0, 0.0, 0.0, 0.0))


def state_with(design: Design = TYPICAL_DESIGN, **precision: Any) -> State:
    """Return a design at home under a force, with what is drawn of its precision."""
    state = opened(design)
    forces = ForcesView(force=(3.0, -4.0, -10.0), moment=(0.05, 0.0, -0.02))
    view = replace(state.view, forces=forces, precision=PrecisionView(**precision))
    return Set("view", view).apply(state)


def markup(panel: Any, state: State) -> str:
    """Return the markup of a panel."""
    return " ".join(str(v) for _, name, v in panel.updates(Frame(state)) if name == "content")


def words(html: str) -> str:
    return re.sub("<[^>]+>", " ", html)


@pytest.fixture
def worker() -> Generator[StubWorker]:
    worker = StubWorker(at_once=True)
    yield worker
    worker.stop()


def show_in(desk: Desk, state: State) -> None:
    """Have a desk show the design and the view of a state."""
    desk.session.do(Set("design", state.design))
    desk.session.do(Set("view", state.view))


def test_panel_has_the_numbers_of_the_pose(services: Services) -> None:
    state = state_with()
    precision = services.get(PosePrecision).of(Frame(state))
    worst, rms = precision.worst(), precision.rms()
    text = words(markup(PrecisionPanel(services), state))
    for value in (10.0 * worst.displacement, 10.0 * rms.displacement):
        assert f"{float(value):.3g} mm" in text
    assert f"{math.degrees(float(worst.turn)):.3g}°" in text
    moved = 10.0 * float(np.linalg.norm(precision.deflection[:3]))
    assert f"{moved:.3g} mm" in text
    softest = 10.0 * float(precision.principal.displacement[0])
    assert f"{softest:.3g} mm/N" in text
    percents = [int(each) for each in re.findall(r"(?:guide|struts|actuators) (\d+)&nbsp;%", text)]
    assert len(percents) == 3
    assert sum(percents) == pytest.approx(100, abs=1)


def test_ideal_design_is_offered_typical_values(services: Services, desk: Desk) -> None:
    panel = PrecisionPanel(services)
    text = markup(panel, desk.state)
    assert "states no errors" in text
    assert "Rigid" in text
    assert "0.05 mm" in text
    desk.press(services.buttons, TYPICAL)
    assert desk.state.design == typical_machine(OPTIMAL)[0]
    assert "Assume" not in markup(panel, desk.state)
    # What the design states stays.
    actuators = Actuators(error_mm=(0.0, 0.0, 0.01, 0.0, 0.0, 0.0))
    tolerances = Tolerances(b4=(0.0, 0.0, 0.2))
    stated = msgspec.structs.replace(
        OPTIMAL, actuators=actuators, struts=Struts(outer_mm=20.0), tolerances=tolerances
    )
    stiff = msgspec.structs.replace(actuators, stiffness_n_mm=(1000.0,) * 6)
    assert typical_machine(stated) == (
        msgspec.structs.replace(stated, actuators=stiff),
        ("stiffness of the actuators 1000 N/mm",),
    )


def test_source_that_only_turns_the_tool_is_listed(services: Services) -> None:
    errors = Actuators(error_mm=(0.1, 0.0, 0.0, 0.0, 0.0, 0.0))
    state = state_with(msgspec.structs.replace(OPTIMAL, actuators=errors))
    text = words(markup(PrecisionPanel(services), state))
    assert re.search(r"By source\s+l1\s+0(\.0+)? mm", text)
    rows = "".join(budget_rows(budget_of(budget_request(state))))
    assert "states no tolerances" not in rows
    assert set(re.findall(r"--share:([\d.]+)%", rows)) == {"0.00"}
    # Without tolerances sources are ranked by unit errors.
    rows = "".join(budget_rows(budget_of(budget_request(state_with(OPTIMAL, budget=True)))))
    assert "states no tolerances" in rows
    bars = [float(each) for each in re.findall(r"--share:([\d.]+)%", rows)]
    assert bars == sorted(bars, reverse=True)
    assert bars[0] == 100.0


@pytest.mark.parametrize("case", ["huge deflection", "singular pose"])
def test_scene_of_a_huge_deflection_or_a_singular_pose_is_empty(
    services: Services, case: str
) -> None:
    state = state_with(ellipsoid=True, deflected=True)
    scenes: list[Any] = [DeflectedScene(services)]
    if case == "singular pose":
        state = replace(state, pose=SINGULAR)
        scenes.append(ErrorEllipsoidScene(services))
    else:
        struts = Struts(outer_mm=1e-40, inner_mm=0.0)
        state = state_with(msgspec.structs.replace(OPTIMAL, struts=struts), deflected=True)
    text = words(markup(PrecisionPanel(services), state))
    assert "nan" not in text
    assert text.count("singular") == (2 if case == "singular pose" else 0)
    assert ("mm/N" in text) == (case == "huge deflection")
    for scene in scenes:
        drawn = by_name(scene.updates(Placed(Frame(state))))
        assert not any(each["visible"] for each in drawn.values())


def test_ellipsoid_is_that_of_the_covariance(services: Services) -> None:
    placed = Placed(Frame(state_with(ellipsoid=True)))
    precision = services.get(PosePrecision).of(placed.frame)
    drawn = by_name(ErrorEllipsoidScene(services).updates(placed))
    body, label = drawn["/precision/ellipsoid/body"], drawn["/precision/ellipsoid/label"]["text"]
    times = float(re.search(r"× ([\d.,]+)$", label)[1].replace(",", ""))  # type: ignore[index]
    moved = precision.by_source[:3] * precision.bounds
    # Errors that are uniform within ± e have the standard deviation e / √3.
    sizes = np.sqrt(np.linalg.eigvalsh(moved @ moved.T / 3.0))[::-1]
    np.testing.assert_allclose(np.array(body["scale"]) / (times * placed.scale), sizes, rtol=1e-9)
    # The RMS displacement is that of its three semi-axes.
    assert np.linalg.norm(sizes) == pytest.approx(float(precision.rms().displacement))
    np.testing.assert_allclose(
        body["position"], placed.on_platform(placed.frame.state.design.tool.position)
    )


@pytest.mark.parametrize("times", [None, 20.0])
def test_deflected_shape_is_the_linear_motion_magnified(
    services: Services, times: float | None
) -> None:
    state = state_with(deflected=True, times=times)
    placed = Placed(Frame(state))
    precision = services.get(PosePrecision).of(placed.frame)
    drawn = by_name(DeflectedScene(services).updates(placed))
    magnified = drawn_times(placed, precision)
    assert times in (None, magnified)
    # One that leaves the scene is limited.
    wide = Placed(Frame(state_with(deflected=True, times=1e30)))
    balls = by_name(DeflectedScene(services).updates(wide))["/precision/balls"]
    assert np.abs(balls["batched_positions"]).max() < 200.0
    v, w = precision.deflection[:3], precision.deflection[3:]
    tool = placed.on_platform(state.design.tool.position)
    names = list(placed.platform_points)
    tips = np.array([*(placed.points[name] for name in names), tool])
    moved = tips + magnified * (placed.scale * v + np.cross(w, tips - tool))
    balls = drawn["/precision/balls"]["batched_positions"]
    np.testing.assert_allclose(balls, moved, atol=1e-5)
    # The last piece of each strut ends at its displaced point, and its foot stays on the guide.
    legs = drawn["/precision/legs"]
    starts, pieces = legs["batched_positions"], len(legs["batched_positions"])
    per_strut = (pieces - 2) // 2
    for index, name in enumerate(("b2", "b3")):
        foot = starts[2 + index * per_strut]
        assert np.abs(foot[1:]).max() < 1e-6
        slid = magnified * placed.scale * precision.carriages[index]
        assert foot[0] == pytest.approx(placed.points[name][0] + slid, abs=1e-5)
        # What the carriage and the bending do adds up to the motion of the tip.
        given = state.design, state.pose.position, state.pose.rotation
        row, length = 1 + 2 * index, inverse(*given)[2 + 2 * index]
        force = actuator_forces(*given, precision.wrench, state.design.tool.position)[row]
        bending = -force * length**3 / (3.0 * stiffness_of(state.design)[1][index])
        tip = (moved[names.index(name)] - placed.points[name])[0] / magnified
        total = placed.scale * (precision.carriages[index] + bending)
        assert tip == pytest.approx(total, rel=1e-9)


@pytest.mark.parametrize(
    "values", [{"times": 0.0}, {"wanted": -1.0}, {"wanted": 1e-300}, {"wanted_turn": math.inf}]
)
def test_precision_of_the_view_that_is_not_positive_is_refused(values: dict[str, Any]) -> None:
    with pytest.raises(InputError, match="must be positive"):
        PrecisionView(**values)


@pytest.mark.parametrize("over", ["pose", "workspace"])
def test_budget_keeps_what_is_wanted_and_is_set_in_one_step(
    services: Services, desk: Desk, over: Any
) -> None:
    show_in(desk, state_with(budget=True, over=over, wanted=0.5))
    part = BudgetPart(services)
    before = desk.state.design
    services.get(BudgetFeed).follow(Frame(desk.state))
    text = markup(part, desk.state)
    drawing = budget_of(budget_request(desk.state))
    assert drawing.found is not None
    assert drawing.costs.worst_displacement <= 0.5
    assert len(re.findall("<tr", text)) == len(SOURCES)
    desk.press(services.buttons, SET)
    design = desk.state.design
    assert design != before
    # Tolerances that may be any stay.
    endless = list(stated_tolerances(design))
    endless[0], endless[6] = math.inf, math.inf
    assert SetTolerances(tuple(endless)).apply(desk.state).design == design
    known = np.isfinite(drawing.costs.tolerances)
    np.testing.assert_array_equal(stated_tolerances(design)[known], drawing.costs.tolerances[known])
    # The costs of what is set are those that were told.
    again = budget_of(budget_request(Set("view.precision.wanted", None).apply(desk.state)))
    assert known.all()
    assert again.costs.worst_displacement == pytest.approx(drawing.costs.worst_displacement)


def test_budget_that_cannot_be_kept_is_reported_in_one_line(
    server: viser.ViserServer, desk: Desk
) -> None:
    show_in(desk, state_with(budget=True, wanted=0.01, keep_actuators=True))
    worker, buttons = StubWorker(), Buttons(server)
    services = services_for(server, desk.session, worker, buttons=buttons)
    part, before = BudgetPart(services), desk.state
    services.get(BudgetFeed).follow(Frame(before))
    with pytest.raises(NoAnswerError) as error:
        worker.work()
    worker.orders[-1].failed(str(error.value))
    text = words(markup(part, before))
    assert "There is no budget" in text
    assert "actuators" in text
    desk.press(buttons, SET)
    assert desk.state == before


def test_table_has_every_source_with_its_part() -> None:
    rows = list(csv.reader(io.StringIO(budget_table(budget_request(state_with())).decode())))
    assert rows[0] == list(COLUMNS)
    assert sorted(row[1] for row in rows[1:]) == sorted(SOURCES)
    by_name = {row[1]: row for row in rows[1:]}
    assert by_name["b2y"][0] == "platform"
    assert by_name["guide tilt y"][2:4] == ["degree", "0.1"]
    assert sum(float(row[8]) for row in rows[1:]) == pytest.approx(1.0)
