"""The prototype on the page: its parts at their places, made once for a design; what they are."""

from __future__ import annotations

from collections.abc import Generator
from dataclasses import replace
from typing import Any

import msgspec
import numpy as np
import pytest
from desk import Desk, by_name, thick, viewed
from part_gaps import least_gap, vertices_at
from services import StubJobs, services_for

from explorer.app.features.feature import Services
from explorer.app.features.mechanism.bodies import Bodies, Flags, Legs
from explorer.app.features.mechanism.marks import DragHandle
from explorer.app.features.prototype.building import (
    BUILD_FEED,
    FITTING,
    MEND,
    STROKES,
    VERDICTS,
    BuildVerdict,
    strokes_table,
)
from explorer.app.features.prototype.feature import (
    PrototypePanel,
    PrototypeScene,
    places_of,
    trouble_of,
)
from explorer.app.features.prototype.work import (
    PARTS_FEED,
    Parts,
    PartsFeed,
    parts_drawing,
    parts_to_draw,
    stock_of,
)
from explorer.app.features.sharing.feature import ExportDialog
from explorer.app.scene.placing import Placed
from explorer.app.state.actions import Set, open_design
from explorer.app.state.frame import Frame
from explorer.app.state.geometry import set_variable
from explorer.app.state.moves import set_pose, set_position
from explorer.app.state.state import State, open_state
from explorer.app.state.view import PrototypeView
from explorer.app.widgets.markup import status
from explorer.errors import InputError
from explorer.mechanism.design_file import PRESETS
from explorer.mechanism.machine import Payload
from explorer.mechanism.pose import Pose
from explorer.mechanism.rgb import OUTLINE
from explorer.motion.chains import LEGS, ON_GUIDE, Places
from explorer.page.widgets.assigning import Assigner
from explorer.prototype.assembly import bill_of_materials, make_prototype
from explorer.prototype.fitting import broken_joint_limits, buildability

OPTIMAL = PRESETS["paper-optimal"]
PARTS = 18


@pytest.fixture
def jobs() -> Generator[StubJobs]:
    jobs = StubJobs(at_once=True)
    yield jobs
    jobs.stop()


@pytest.fixture
def feed(services: Services) -> PartsFeed:
    return services.get(PARTS_FEED)


@pytest.fixture(scope="module")
def parts() -> Parts:
    parts = parts_drawing(OPTIMAL)
    assert isinstance(parts, Parts)
    return parts


def with_prototype(state: State | None = None, **changes: Any) -> State:
    """Return the state with the prototype drawn."""
    begin = open_state(OPTIMAL) if state is None else state
    return viewed(begin, drawn_as="prototype", prototype=PrototypeView(**changes))


def states(count: int, **changes: Any) -> list[State]:
    """Return the prototype in poses about home."""
    rng = np.random.default_rng(11)
    return [
        set_pose(
            Pose.of_yaw_pitch_roll(
                [10, 5, 9] + rng.uniform(-3, 3, 3), [-73, 0, 0] + rng.uniform(-15, 15, 3)
            )
        ).apply(with_prototype(**changes))
        for _ in range(count)
    ]


def placed_with_parts(services: Services, state: State) -> Placed:
    """Return the state as the page places it once its parts are made."""
    feed = services.get(PARTS_FEED)
    feed.follow(Frame(state))
    return Placed(Frame(state), floor=parts.floor if (parts := parts_to_draw(feed)) else None)


def in_scene(nodes: dict[str, dict[str, Any]], path: str) -> np.ndarray[Any, Any]:
    """Return the vertices of a node as a browser places them, with those it hangs on."""
    points = np.asarray(nodes[path]["vertices"], dtype=np.float64)
    while path in nodes:
        node = nodes[path]
        if "wxyz" in node:
            points = points @ Pose((0.0, 0.0, 0.0), node["wxyz"]).rotation.T
        points = points + node["position"]
        path = path.rpartition("/")[0]
    return points


# The scene


@pytest.mark.parametrize("state", states(3))
def test_parts_are_drawn_where_the_library_places_them(
    state: State, services: Services, parts: Parts
) -> None:
    placed = placed_with_parts(services, state)
    nodes = by_name(PrototypeScene(services).updates(placed))
    assert len(nodes) == PARTS
    whole = vertices_at(parts.prototype, state.pose.position, state.pose.rotation)
    for part, (_, faces), corners in zip(parts.prototype.parts, parts.meshes, whole, strict=True):
        path = next(path for path in nodes if path.endswith(f"/{part.name}"))
        seen = in_scene(nodes, path)[faces]
        assert np.allclose(seen, placed.scale * corners[part.faces], atol=1e-5)
        assert nodes[path]["visible"]


def test_meshes_are_assigned_only_when_the_design_has_changed(
    services: Services,
) -> None:
    scene, assigner = PrototypeScene(services), Assigner(services.server)

    def meshes_assigned(state: State) -> int:
        updates = scene.updates(placed_with_parts(services, state))
        return len(assigner.assign(u for u in updates if u[1] in ("vertices", "faces")))

    assert meshes_assigned(with_prototype()) == 2 * PARTS
    for state in (*states(3), with_prototype(exploded=0.5), with_prototype(density=7850.0)):
        assert meshes_assigned(state) == 0
    changed = set_variable("b2", 2.7).apply(with_prototype())
    assert meshes_assigned(changed) > 0
    assert meshes_assigned(set_position(0, 11.0).apply(changed)) == 0


def test_parts_replace_bodies_and_legs_and_follow_their_switches(
    services: Services,
) -> None:
    drawn = (Bodies(services), Legs(services), PrototypeScene(services))

    def visible(state: State) -> dict[str, bool]:
        placed = placed_with_parts(services, state)
        nodes = by_name(update for part in drawn for update in part.updates(placed))
        return {path: node["visible"] for path, node in nodes.items() if "visible" in node}

    # The second design is too tight for parts.
    for state, has_parts in ((with_prototype(), True), (thick(with_prototype(), 0.4), False)):
        for path, is_shown in visible(state).items():
            assert is_shown == (path.startswith("/prototype") == has_parts), path
    for switch, kinds in (
        ("legs", {"cross", "carriage", "cylinder", "rod"}),
        ("bodies", {"base", "platform", "ball"}),
    ):
        hidden = {
            path.rpartition("/")[2].partition(" ")[0]
            for path, is_shown in visible(viewed(with_prototype(), **{switch: False})).items()
            if path.startswith("/prototype") and not is_shown
        }
        assert hidden == kinds


def test_flags_and_handle_are_drawn_only_with_assembled_parts(services: Services) -> None:
    drawn = (Flags(services), DragHandle(services))
    # One too tight for parts is drawn as the schematic mechanism.
    tight = thick(with_prototype(exploded=0.5), 0.4)
    for state, is_seen in (
        (with_prototype(), True),
        (with_prototype(exploded=0.5), False),
        (tight, True),
    ):
        placed = placed_with_parts(services, viewed(state, handle=True, flags=True))
        nodes = by_name(update for part in drawn for update in part.updates(placed))
        assert {node["visible"] for node in nodes.values() if "visible" in node} == {is_seen}
        assert all(bool(len(part.corners(placed))) == is_seen for part in drawn)


def test_parts_of_legs_that_collide_are_coloured(services: Services) -> None:
    # The parts are still those of thinner legs, as while new ones are being made.
    placed_with_parts(services, with_prototype())
    placed = Placed(Frame(thick(with_prototype(), 0.3, 0.5, 0.5, 0.3)))
    nodes = by_name(PrototypeScene(services).updates(placed))
    red = {path for path, node in nodes.items() if node.get("color") == OUTLINE}
    assert red == {f"/prototype/{kind} {leg}" for kind in ("cylinder", "rod") for leg in (2, 3)}


@pytest.mark.parametrize("state", states(2, exploded=1.0))
def test_exploded_parts_of_a_leg_are_free_of_each_other_and_within_the_corners(
    state: State, services: Services, parts: Parts
) -> None:
    frame = Frame(state)
    places = places_of(Placed(frame), parts)
    apart = {
        part.name: replace(part, body="base", vertices=part.vertices @ turn.T + origin)
        for part, origin, turn in zip(
            parts.prototype.parts, places.origin, places.rotation, strict=True
        )
    }
    rest = Places(np.zeros((1, 3)), np.eye(3)[None])
    corners = PrototypeScene(services).corners(placed_with_parts(services, state))
    for part in apart.values():
        seen = Placed(frame).scale * part.vertices
        assert (seen >= corners.min(axis=0) - 1e-4).all()
        assert (seen <= corners.max(axis=0) + 1e-4).all()
    least = 0.02 * OPTIMAL.reach
    for leg in LEGS:
        joint = "carriage" if leg in ON_GUIDE else "cross"
        names = [f"{kind} {leg}" for kind in (joint, "cylinder", "rod", "ball")]
        chain = [apart[name] for name in ("base", *names, "platform")]
        gap, *which = least_gap(chain, rest, least)
        assert gap == least, which


# The feed


def test_parts_are_made_again_when_the_design_changes_and_not_else(
    feed: PartsFeed, jobs: StubJobs
) -> None:
    orders = jobs.orders
    feed.follow(Frame(open_state(OPTIMAL)))
    assert orders == []
    for state in (
        with_prototype(),
        *states(3),
        with_prototype(exploded=0.3),
        with_prototype(density=1.0),
    ):
        feed.follow(Frame(state))
    assert [order.task for order in orders] == [parts_drawing]
    for state in (set_variable("a3x", 19.0).apply(with_prototype()), thick(with_prototype(), 0.2)):
        count = len(orders)
        feed.follow(Frame(state))
        assert len(orders) == count + 1
        drawn, expected = parts_to_draw(feed), make_prototype(state.design)
        assert drawn is not None
        assert np.array_equal(drawn.prototype.parts[0].vertices, expected.parts[0].vertices)
    feed.follow(Frame(viewed(with_prototype(), drawn_as="6-4 twin")))
    assert parts_to_draw(feed) is None


def test_design_too_tight_is_refused_in_the_words_of_the_library(feed: PartsFeed) -> None:
    state = thick(with_prototype(), 0.4)
    with pytest.raises(InputError) as refusal:
        make_prototype(state.design)
    frame = Frame(state)
    assert "Making the parts" in trouble_of(frame, feed)
    feed.follow(frame)
    assert parts_to_draw(feed) is None
    trouble = trouble_of(frame, feed)
    assert str(refusal.value)[1:] in trouble
    assert "carriages 2 and 3" in trouble
    feed.follow(Frame(with_prototype()))
    assert parts_to_draw(feed) is not None
    assert trouble_of(Frame(with_prototype()), feed) == ""


def test_drawing_of_a_design_of_another_size_is_not_shown() -> None:
    services = services_for()
    feed, jobs = services.get(BUILD_FEED), services.jobs
    assert isinstance(jobs, StubJobs)
    larger = msgspec.structs.replace(
        OPTIMAL.with_variables([1e4 * each for each in OPTIMAL.variables]).with_limits(box=None),
        unit_mm=1e-3,
        home=None,
    )
    similar = OPTIMAL.with_variable("a3x", 20.0)
    for first, then, stays in ((OPTIMAL, similar, True), (similar, larger, False)):
        feed.follow(Frame(open_state(first)))
        jobs.work()
        assert feed.drawing is not None
        feed.follow(Frame(open_state(then)))
        assert (feed.drawing is not None) == stays
        jobs.work()
        assert feed.is_current


# Whether the machine can be built


@pytest.mark.parametrize("unit", [OPTIMAL.unit_mm, 3.0])
def test_verdict_is_the_same_everywhere_and_its_presses_mend_what_it_names(
    desk: Desk, services: Services, unit: float
) -> None:
    panels = PrototypePanel(services), ExportDialog(services)
    feed, verdict = services.get(BUILD_FEED), services.get(BuildVerdict)

    def show(state: State) -> str:
        feed.follow(Frame(state))
        words = verdict.html()
        for panel in panels:
            assert any(words in str(value) for *_, value in panel.updates(Frame(state)))
        return words

    desk.session.do(Set("view.lengths", "mm"))
    carrying = msgspec.structs.replace(OPTIMAL, payload=Payload(1.0, (1.0, 2.0, 3.0)))
    desk.session.do(open_design(msgspec.structs.replace(carrying, unit_mm=unit)))
    if unit != OPTIMAL.unit_mm:
        assert "Carriages 2 and 3 at home are 2.01 mm apart and need 2.6 mm." in show(desk.state)
        assert ">Set the unit to 3.89 mm<" in show(desk.state)
        assert "Buildable" in verdict.in_bar(Frame(desk.state))
        desk.press(services.buttons, MEND, FITTING)
        # The payload stays where it is on the platform, 3 mm, 6 mm and 9 mm from b4.
        x, y, z = (float(f"{3.0 * each / 3.89:.15g}") for each in (1.0, 2.0, 3.0))
        payload = Payload(1.0, (x, y, z))
        assert desk.state.design == msgspec.structs.replace(OPTIMAL, unit_mm=3.89, payload=payload)
        # What was found for the design before the press does nothing to this one.
        desk.press(services.buttons, MEND, FITTING)
        assert desk.state.design.unit_mm == 3.89
    assert "Strokes too short" in show(desk.state)
    assert "strokes too short" in verdict.in_bar(Frame(desk.state))
    assert strokes_table(buildability(desk.state.design)).count("ex-beyond") == len(LEGS)
    desk.press(services.buttons, MEND, STROKES)
    assert status("Buildable", "within", VERDICTS["Buildable"]) in show(desk.state)
    assert verdict.in_bar(Frame(desk.state)) == ""
    assert "ex-beyond" not in strokes_table(buildability(desk.state.design))
    assert desk.state.design.home_pose == OPTIMAL.home_pose


def test_parts_that_no_unit_mends_have_no_press_but_advice(services: Services) -> None:
    feed = services.get(BUILD_FEED)
    feed.follow(Frame(thick(open_state(OPTIMAL), 0.4)))
    words = services.get(BuildVerdict).html()
    assert "It fits with legs of radius at most 3.24 mm." in words
    assert "<button" not in words


def test_pose_beyond_the_joint_limits_of_the_parts_is_reported(feed: PartsFeed) -> None:
    state = set_position(2, 17.0).apply(with_prototype())
    feed.follow(Frame(state))
    parts = parts_to_draw(feed)
    assert parts is not None
    hindrances = broken_joint_limits(
        parts.prototype.sizes, state.pose.position, state.pose.rotation
    )
    assert hindrances
    trouble = trouble_of(Frame(state), feed)
    assert "do not take this pose" in trouble
    assert all(each[1:] in trouble for each in hindrances)


# The list of parts


def test_masses_and_counts_are_those_of_the_library(parts: Parts) -> None:
    lines = parts.lines
    assert [line.name for line in lines if line.count > 1] == [
        "carriage 2, 3",
        "cross 1, 4",
        "ball 1, 2, 3, 4",
    ]
    for density in (PrototypeView().density, 7850.0):
        bill = bill_of_materials(parts.prototype, density)
        assert sum(line.count for line in lines) == len(bill.items) == PARTS
        assert sum(line.mass(density) for line in lines) == pytest.approx(1e3 * bill.mass, rel=1e-9)
        for line in lines:
            mass = pytest.approx(1e-3 * line.mass(density) / line.count)
            same = [i for i in bill.items if i.name.partition(" ")[0] == line.kind]
            assert sum(item.mass == mass for item in same) >= line.count
    # Legs of other parts have lines of their own.
    mixed = parts_drawing(thick(with_prototype(), 0.2, 0.25, 0.2, 0.15).design)
    assert isinstance(mixed, Parts)
    names = [line.name for line in mixed.lines]
    assert {"carriage 2", "carriage 3", "cross 1", "cross 4", "ball 1, 3"} <= set(names)


def test_stock_holds_the_part(parts: Parts) -> None:
    unit = OPTIMAL.unit_mm
    for part in parts.prototype.parts:
        stock = stock_of(part, unit)
        size = np.ptp(part.vertices, axis=0) * unit
        if len(stock) == 3:
            assert [*stock] == pytest.approx(size.tolist())
            continue
        diameter, length = stock
        axis = 0 if part.kind == "carriage" else 2
        assert length == pytest.approx(size[axis])
        across = np.delete(size, axis)
        assert across.max() * (1.0 - 1e-9) <= diameter <= np.hypot(*across)


@pytest.mark.parametrize(
    ("name", "value"),
    [("exploded", -0.1), ("exploded", np.nan), ("density", 0.0), ("density", np.inf)],
)
def test_share_or_density_out_of_range_is_refused(name: str, value: float) -> None:
    with pytest.raises(InputError, match="exploded view" if name == "exploded" else "density"):
        PrototypeView(**{name: value})
