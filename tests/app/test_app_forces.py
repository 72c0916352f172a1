"""Forces and precision on the page: figures, tables, arrows, the ellipsoid and the budget."""

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
from desk import Desk, by_name, markup_of
from services import StubJobs, services_for

from explorer import Actuators, Guide, Payload, Struts, Tolerances, Tool
from explorer.app.features.feature import Services
from explorer.app.features.loads.feature import ForcesPanel, load_figure
from explorer.app.features.loads.load import (
    FITTING,
    WEIGHTS_FEED,
    Loads,
    budget_of,
    budget_table,
    fitting_scale,
    nearest_feed,
    set_force,
)
from explorer.app.features.loads.precision import (
    BUDGET_FEED,
    PrecisionPanel,
    budget_request,
)
from explorer.app.features.loads.precision_scene import (
    DeflectedScene,
    ErrorEllipsoidScene,
    magnification,
)
from explorer.app.features.loads.scene import ForcesScene, LoadHandle, load_tip, tool_point
from explorer.app.scene.placing import SCENE_REACH, Placed
from explorer.app.scene.shapes import GHOST, linear_colour
from explorer.app.state.actions import Set
from explorer.app.state.frame import Frame
from explorer.app.state.state import State, open_state
from explorer.app.state.view import ForcesView, PrecisionView
from explorer.app.widgets.blocks import render, share_colour
from explorer.app.widgets.buttons import Buttons
from explorer.errors import InputError
from explorer.export.tables import TOLERANCE_COLUMNS
from explorer.measures.blocks.block import Share
from explorer.measures.blocks.precision import tolerance_budget
from explorer.mechanism.design import Design
from explorer.mechanism.design_file import PRESETS, typical_machine
from explorer.mechanism.pose import Pose, Triple
from explorer.motion.weights import ROD
from explorer.singularity.colours import SINGULAR
from explorer.statics.accuracy import SOURCES, stated_tolerances
from explorer.statics.budget import with_tolerances
from explorer.statics.reactions import PART_NAMES, limited_parts

OPTIMAL = PRESETS["paper-optimal"]
LIMITED = msgspec.structs.replace(
    OPTIMAL,
    tool=Tool((1.5, -1.0, 3.0)),
    payload=Payload(0.5, (1.5, -1.0, 1.5)),
    actuators=Actuators(push_n=(60, 60, 60, 60, 60, 60)),
    struts=Struts(moment_nm=3.0),
    guide=Guide(force_n=50.0),
)


def loaded_state(
    design: Design = LIMITED, force: Triple = (0.0, 0.0, -10.0), **forces: Any
) -> State:
    """Return a design at home under a force, with forces shown."""
    state = open_state(design)
    view = ForcesView(shown=True, force=force, **forces)
    return Set("view", replace(state.view, forces=view)).apply(state)


def move_to(state: State, *position: float) -> State:
    """Return a state with b4 at a position."""
    x, y, z = position
    return replace(state, pose=Pose((x, y, z), state.pose.quaternion))


def loaded_pose(state: State) -> Any:
    """Return the pose of a state under its load."""
    return services_for().get(Loads).of(Frame(state))


@pytest.mark.parametrize(
    ("force", "z", "look"),
    [((0.0, 0.0, -10.0), 9.0, "within"), ((0.0, 0.0, -90.0), 9.0, "beyond"),
     ((0.0, 0.0, -10.0), 0.0, "beyond")],
)  # fmt: skip
def test_bar_names_the_largest_share_and_its_part(force: Triple, z: float, look: str) -> None:
    state = move_to(loaded_state(force=force), 10.0, 5.0, z)
    bar, found = services_for().get(load_figure)(Frame(state)), loaded_pose(state)
    assert Share(found.share).text() in bar
    assert PART_NAMES[found.worst] in bar
    assert f"ex-{look}" in bar
    assert services_for().get(load_figure)(Frame(loaded_state(OPTIMAL))) == ""


def test_weights_are_those_that_are_chosen() -> None:
    jobs = StubJobs()
    services = services_for(jobs=jobs)
    loads = services.get(Loads)
    none, payload = (
        loads.of(Frame(loaded_state(force=(0.0, 0.0, 0.0), weighed=each))).reactions.actuators
        for each in ("none", "payload")
    )
    assert np.abs(none).max() == 0.0
    assert np.abs(payload).max() > 1.0
    frame = Frame(loaded_state(force=(0.0, 0.0, 0.0), weighed="payload and legs"))
    services.get(WEIGHTS_FEED).follow(frame)
    # Until the parts have masses, the payload alone counts.
    assert loads.of(frame).own is None
    jobs.work()
    own = loads.of(frame).own
    assert own is not None
    assert min(own.arrays[1][:, ROD]) > 0.0
    assert np.abs(loads.of(frame).reactions.actuators - payload).max() > 1e-3


def test_nearest_position_that_holds_the_load_is_searched_and_gone_to(
    server: viser.ViserServer, buttons: Buttons, desk: Desk
) -> None:
    jobs = StubJobs()
    services = services_for(server, desk.session, jobs, buttons=buttons)
    panel, feed = ForcesPanel(services), services.get(nearest_feed)
    show_in(desk, loaded_state())
    feed.follow(Frame(desk.state))
    assert feed.request is None
    show_in(desk, loaded_state(force=(0.0, 0.0, -25.0)))
    frame = Frame(desk.state)
    feed.follow(frame)
    assert "searching" in markup_of(panel, frame.state)
    jobs.work()
    drawing = feed.drawing
    assert drawing is not None
    assert drawing.pose is not None
    assert "mm from here" in markup_of(panel, frame.state)
    desk.press(buttons, "forces.go")
    assert desk.state.pose == drawing.pose
    assert services.get(Loads).of(Frame(desk.state)).share <= 1.0
    feed.follow(Frame(desk.state))
    assert feed.request is None


def test_press_turns_the_force_into_its_worst_direction(services: Services, desk: Desk) -> None:
    ForcesPanel(services)
    show_in(desk, loaded_state())
    before = loaded_pose(desk.state)
    desk.press(services.buttons, "forces.worst")
    after = desk.state
    assert math.hypot(*after.view.forces.force) == pytest.approx(10.0, rel=1e-3)
    assert loaded_pose(after).share > before.share


def test_load_is_an_arrow_from_the_tool_by_its_scale(services: Services) -> None:
    state = loaded_state(force=(3.0, 0.0, -4.0), scale=10.0)
    placed = Placed(Frame(state))
    vector = load_tip(placed) - tool_point(placed)
    np.testing.assert_allclose(vector, placed.reach * np.array([0.3, 0.0, -0.4]))
    nodes = by_name(services.get(ForcesScene).updates(placed))
    assert nodes["/forces/label/load"]["text"] == "5 N"
    assert nodes["/forces/label/l4"]["visible"]
    np.testing.assert_allclose(services.get(ForcesScene).corners(placed)[0], load_tip(placed))


def test_forces_are_drawn_in_the_colour_of_their_share(services: Services) -> None:
    state = move_to(loaded_state(force=(0.0, 0.0, -60.0)), 10.0, 5.0, 3.0)
    shares, scene = loaded_pose(state).shares, services.get(ForcesScene)
    nodes = by_name(scene.updates(Placed(Frame(state))))
    # viser's client takes the colours of copies for linear ones.
    expected = [list(linear_colour(share_colour(shares[index]))) for index in (0, 2, 4, 5)]
    assert nodes["/forces/sleeves"]["batched_colors"].tolist() == expected
    assert nodes["/forces/bending/2"]["color"] == SINGULAR
    without = by_name(scene.updates(Placed(Frame(loaded_state(OPTIMAL)))))
    assert without["/forces/sleeves"]["batched_colors"].tolist() == [list(linear_colour(GHOST))] * 4


def test_scene_without_forces_draws_nothing(services: Services) -> None:
    scene, handle = services.get(ForcesScene), services.get(LoadHandle)
    hidden = Placed(Frame(open_state(LIMITED)))
    nodes = by_name(scene.updates(hidden)) | by_name(handle.updates(hidden))
    assert not any(values["visible"] for values in nodes.values() if "visible" in values)
    assert not len(scene.corners(hidden))
    # In a singular pose there is the load, and nothing that holds it.
    singular = Placed(Frame(move_to(loaded_state(), 10.0, 5.0, 0.0)))
    nodes = by_name(scene.updates(singular))
    assert nodes["/forces/arrows/shafts"]["visible"]
    assert not nodes["/forces/sleeves"]["visible"]
    assert np.isfinite(nodes["/forces/arrows/shafts"]["batched_positions"]).all()


def test_pull_at_the_handle_sets_the_force_and_leaves_the_handle(services: Services) -> None:
    state = loaded_state()
    handle = services.get(LoadHandle)
    for node, name, value in handle.updates(Placed(Frame(state))):
        setattr(node, name, value)
    np.testing.assert_allclose(handle.force(state), state.view.forces.force, atol=1e-12)
    rng = np.random.default_rng(1)
    for _ in range(5):
        handle.handle.position = tuple(rng.normal(size=3).tolist())
        force = handle.force(state)
        state = set_force(force, keeps_scale=True).apply(state)
        updates = list(handle.updates(Placed(Frame(state))))
        assert "position" not in {name for _, name, _ in updates}
        tip = load_tip(Placed(Frame(state)))
        # Forces have few decimals, and the handle stays under the pointer.
        np.testing.assert_allclose(tip, handle.handle.position, atol=1e-3 * SCENE_REACH)


def test_typed_force_has_an_arrow_that_can_be_seen() -> None:
    assert fitting_scale(0.0, 20.0) == fitting_scale(5e-324, 20.0) == 20.0
    for force in np.geomspace(1e-6, 1e6, 40):
        scale = fitting_scale(float(force), 20.0)
        assert 0.1 <= force / scale <= 1.0
        assert scale == 20.0 or FITTING / 2 < force / scale < FITTING * 2


@pytest.mark.parametrize("unit_mm", [1.0, 10.0, 1000.0])
def test_moment_is_in_newton_metres_whatever_the_unit(unit_mm: float) -> None:
    design = msgspec.structs.replace(OPTIMAL, unit_mm=unit_mm)
    load = loaded_state(design, moment=(0.0, 2.0, 0.0)).load
    assert tuple(load[:5]) == (0.0, 0.0, -10.0, 0.0, 2e3 / unit_mm)


@pytest.mark.parametrize("force", [(math.nan, 0.0, 0.0), (math.inf, 0.0, 0.0), (0.0, 1e41, 0.0)])
def test_force_that_is_not_finite_is_refused(force: tuple[float, float, float]) -> None:
    with pytest.raises(InputError, match=r"^the force, in N, must [^\n]*$"):
        set_force(force).apply(loaded_state())


def test_share_has_words_and_a_look() -> None:
    shares = [None, 0.004, 0.5, 0.9996, 1.0, 1.0000001, 1.004, 1.234, 1e5, math.inf]
    texts = [Share(share).text().replace("\N{NO-BREAK SPACE}", " ") for share in shares]
    # What exceeds the limit never reads as the limit.
    assert texts[:6] == ["no limit", "0 %", "50 %", "100.0 %", "100.0 %", "above 100.0 %"]
    assert texts[6:] == ["100.4 %", "123 %", "∞", "∞"]
    looks = [Share(share).look for share in (0.5, 0.9, 1.0, 1.001)]
    assert looks == ["within", "close", "close", "beyond"]


# Precision


TYPICAL_DESIGN = msgspec.structs.replace(
    typical_machine(OPTIMAL)[0], tool=Tool((1.0, -0.5, 2.0)), payload=Payload(0.5, (1.0, 0.0, 1.0))
)
SINGULAR_POSE = Pose((3.0, 4.0, 5.0), (1.0, 0.0, 0.0, 0.0))


def state_with(design: Design = TYPICAL_DESIGN, **precision: Any) -> State:
    """Return a design at home under a force, with what is drawn of its precision."""
    state = open_state(design)
    forces = ForcesView(force=(3.0, -4.0, -10.0), moment=(0.05, 0.0, -0.02))
    view = replace(state.view, forces=forces, precision=PrecisionView(**precision))
    return Set("view", view).apply(state)


def words(html: str) -> str:
    return re.sub("<[^>]+>", " ", html)


@pytest.fixture
def jobs() -> Generator[StubJobs]:
    jobs = StubJobs(at_once=True)
    yield jobs
    jobs.stop()


def show_in(desk: Desk, state: State) -> None:
    """Have a desk show the design and the view of a state."""
    desk.session.do(Set("design", state.design))
    desk.session.do(Set("view", state.view))


def test_panel_has_the_numbers_of_the_pose(services: Services) -> None:
    state = state_with()
    precision = services.get(Loads).precision(Frame(state))
    worst, rms = precision.worst(), precision.rms()
    text = words(markup_of(PrecisionPanel(services), state))
    for value in (10.0 * worst.displacement, 10.0 * rms.displacement):
        assert f"{float(value):.2f} mm" in text
    assert f"{math.degrees(float(worst.turn)):.3g}°" in text
    moved = 10.0 * float(np.linalg.norm(precision.deflection[:3]))
    assert f"{moved:.3g} mm" in text
    softest = 10.0 * float(precision.principal.displacement[0])
    assert f"{softest:.3g} mm/N" in text
    percents = [int(each) for each in re.findall(r"(?:guide|struts|actuators) (\d+)&nbsp;%", text)]
    assert len(percents) == 3
    assert sum(percents) == pytest.approx(100, abs=1)


def test_design_without_load_and_limits_is_told_what_to_enter(
    services: Services, desk: Desk
) -> None:
    panel = ForcesPanel(services)
    assert "No load acts" in markup_of(panel, desk.state)
    desk.press(services.buttons, "forces.typical")
    assert limited_parts(desk.state.design).all()
    assert "Assume" not in markup_of(panel, desk.state)
    assert services.get(load_figure)(Frame(desk.state)) == ""
    desk.session.do(set_force((0.0, 0.0, -10.0)))
    assert "Holds the load" in markup_of(panel, desk.state)


def test_ideal_design_is_offered_typical_values(services: Services, desk: Desk) -> None:
    panel = PrecisionPanel(services)
    assert "states no errors" in markup_of(panel, desk.state)
    desk.press(services.buttons, "precision.typical")
    assert desk.state.design == typical_machine(OPTIMAL)[0]
    assert "Assume" not in markup_of(panel, desk.state)
    # What the design states stays.
    actuators = Actuators(error_mm=(0.0, 0.0, 0.01, 0.0, 0.0, 0.0))
    tolerances = Tolerances(b4=(0.0, 0.0, 0.2))
    stated = msgspec.structs.replace(
        OPTIMAL, actuators=actuators, struts=Struts(outer_mm=20.0), tolerances=tolerances
    )
    stiff = msgspec.structs.replace(actuators, stiffness_n_mm=(1000.0,) * 6)
    assert typical_machine(stated)[0] == msgspec.structs.replace(stated, actuators=stiff)


def test_scene_of_a_singular_pose_is_empty(services: Services) -> None:
    state = replace(state_with(ellipsoid=True, deflected=True), pose=SINGULAR_POSE)
    text = words(markup_of(PrecisionPanel(services), state))
    assert "nan" not in text
    assert text.count("singular") == 2
    assert "mm/N" not in text
    for scene in (DeflectedScene(services), ErrorEllipsoidScene(services)):
        drawn = by_name(scene.updates(Placed(Frame(state))))
        assert not any(each["visible"] for each in drawn.values())


def test_ellipsoid_is_that_of_the_covariance(services: Services) -> None:
    placed = Placed(Frame(state_with(ellipsoid=True)))
    precision = services.get(Loads).precision(placed.frame)
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
    precision = services.get(Loads).precision(placed.frame)
    drawn = by_name(DeflectedScene(services).updates(placed))
    magnified = magnification(placed, precision)
    assert times in (None, magnified)
    # One that leaves the scene is limited.
    wide = Placed(Frame(state_with(deflected=True, times=1e12)))
    balls = by_name(DeflectedScene(services).updates(wide))["/precision/balls"]
    assert np.abs(balls["batched_positions"]).max() < 200.0
    v, w = precision.deflection[:3], precision.deflection[3:]
    tool = placed.on_platform(state.design.tool.position)
    names = list(placed.platform_points)
    tips = np.array([*(placed.points[name] for name in names), tool])
    moved = tips + magnified * (placed.scale * v + np.cross(w, tips - tool))
    balls = drawn["/precision/balls"]["batched_positions"]
    np.testing.assert_allclose(balls, moved, atol=1e-5)


@pytest.mark.parametrize(
    "values", [{"times": 0.0}, {"wanted": -1.0}, {"wanted": 1e-8}, {"wanted_turn": math.inf}]
)
def test_precision_of_the_view_that_is_not_positive_is_refused(values: dict[str, Any]) -> None:
    with pytest.raises(InputError, match="must be"):
        PrecisionView(**values)


@pytest.mark.parametrize("over", ["pose", "workspace"])
def test_budget_keeps_what_is_wanted_and_is_set_in_one_step(
    services: Services, desk: Desk, over: Any
) -> None:
    show_in(desk, state_with(budget=True, over=over, wanted=0.5))
    part = PrecisionPanel(services)
    before = desk.state.design
    services.get(BUDGET_FEED).follow(Frame(desk.state))
    text = markup_of(part, desk.state)
    drawing = budget_of(budget_request(desk.state))
    assert drawing.found is not None
    assert drawing.costs.worst_displacement <= 0.5
    assert len(re.findall('class="ex-meter"', text.rpartition("By source")[2])) == len(SOURCES)
    desk.press(services.buttons, "precision.set")
    design = desk.state.design
    assert design != before
    # Tolerances that may be any stay.
    endless = list(stated_tolerances(design))
    endless[0], endless[6] = math.inf, math.inf
    assert with_tolerances(design, np.array(endless)) == design
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
    jobs, buttons = StubJobs(), Buttons(server)
    services = services_for(server, desk.session, jobs, buttons=buttons)
    part, before = PrecisionPanel(services), desk.state
    services.get(BUDGET_FEED).follow(Frame(before))
    jobs.work()
    text = words(markup_of(part, before))
    assert "There is no budget" in text
    assert "actuators" in text
    desk.press(buttons, "precision.set")
    assert desk.state == before


def test_table_has_every_source_with_its_part() -> None:
    rows = list(csv.reader(io.StringIO(budget_table(budget_request(state_with())).decode())))
    assert rows[0] == list(TOLERANCE_COLUMNS)
    assert sorted(row[1] for row in rows[1:]) == sorted(SOURCES)
    by_source = {row[1]: row for row in rows[1:]}
    assert by_source["b2y"][0] == "platform"
    assert by_source["guide tilt y"][2:4] == ["degree", "0.1"]
    assert sum(float(row[8]) for row in rows[1:]) == pytest.approx(1.0)


def test_source_that_only_turns_the_tool_is_listed(services: Services) -> None:
    errors = Actuators(error_mm=(0.1, 0.0, 0.0, 0.0, 0.0, 0.0))
    state = state_with(msgspec.structs.replace(OPTIMAL, actuators=errors))
    text = words(markup_of(PrecisionPanel(services), state))
    assert re.search(r"By source\s+l1\s+0(\.0+)? mm", text)
    drawing = budget_of(budget_request(state))
    rows = render(tolerance_budget(drawing.costs, drawing.found))
    assert set(re.findall(r"--share:([\d.]+)%", rows)) == {"0.00"}
