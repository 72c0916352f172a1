"""A panel shows the blocks of its answer; a drawing holds its workspace."""

from __future__ import annotations

import re
from collections.abc import Callable, Iterable
from dataclasses import replace
from typing import Any

import msgspec
import pytest
from desk import markup_of, thick
from machines import FULL, OPTIMAL, PRECISE
from services import services_for
from workspace_feeds import draw

from explorer.app.features.feature import Services
from explorer.app.features.legs.feature import ClearancePanel
from explorer.app.features.loads.feature import ForcesPanel
from explorer.app.features.loads.load import Loads, is_bare
from explorer.app.features.loads.precision import LOAD, PrecisionPanel
from explorer.app.features.singularity.feature import SingularityPanel
from explorer.app.features.singularity.work import go_to_stratum
from explorer.app.features.workspace import words
from explorer.app.features.workspace.feeds import (
    VOLUME_FEED,
    WORKSPACE_FEED,
    workspace_pose,
    workspace_request,
)
from explorer.app.session.history import UserAction
from explorer.app.state.actions import Set
from explorer.app.state.frame import Frame
from explorer.app.state.moves import set_angle, set_position
from explorer.app.state.state import State, open_state
from explorer.app.widgets.blocks import content_of
from explorer.measures.blocks import clearances, forces, precision, singularity
from explorer.measures.blocks.block import Block, Facts
from explorer.mechanism.design_file import typical_machine
from explorer.numerics.number_text import format_number
from explorer.workspace.accessible.workspace import accessible_workspace
from explorer.workspace.carried_region import carried_region
from explorer.workspace.slices.volume import node_count_of, workspace_volume
from explorer.workspace.workspace import Workspace

pytestmark = pytest.mark.usefixtures("warm_kernels")

Answer = Callable[[Services, Frame], Iterable[Block]]


def answer_on_forces(services: Services, frame: Frame) -> Iterable[Block]:
    loaded = services.get(Loads).of(frame)
    if not is_bare(loaded):
        yield forces.verdict(loaded)
        yield from forces.reaction_tables(loaded)
    yield forces.largest_loads(loaded)


def answer_on_precision(services: Services, frame: Frame) -> Iterable[Block]:
    found = services.get(Loads).precision(frame)
    return *precision.tool_errors(found), *precision.deflections(found, LOAD)


def answer_on_singularity(_: Services, frame: Frame) -> Iterable[Block]:
    snapshot, state = frame.snapshot, frame.state
    yield from singularity.freedoms(snapshot, state.unit)
    yield singularity.conditioning(snapshot, state.unit)
    yield singularity.gains(frame.performance, state.point)
    yield Facts("", (singularity.free_ball(snapshot, frame.free_ball, state.point, state.unit),))


def answer_on_clearances(_: Services, frame: Frame) -> Iterable[Block]:
    yield from clearances.pose_clearances(frame.snapshot, frame.state.unit)
    if frame.last_move is not None:
        yield from clearances.move_clearances(frame.last_move, frame.state.design, frame.state.unit)


ANSWERS: tuple[tuple[Callable[[Services], Any], Answer], ...] = (
    (ForcesPanel, answer_on_forces),
    (PrecisionPanel, answer_on_precision),
    (SingularityPanel, answer_on_singularity),
    (ClearancePanel, answer_on_clearances),
)


def machine_states() -> list[State]:
    """Return machines that hold their load and do not, with and without legs that collide."""
    begin = Set("view.forces.force", (1.0, -2.0, -10.0)).apply(open_state(typical_machine(FULL)[0]))
    begin = Set("view.swept", True).apply(begin)
    moved = UserAction(set_position(0, 12.0), "drag", 100.0).apply(begin)
    turned = set_angle(1, 20.0).apply(thick(moved, 0.4, 0.3, 0.2, 0.5))
    heavy = Set("view.forces.force", (0.0, 0.0, -500.0)).apply(turned)
    return [
        begin,
        moved,
        Set("view.at", "tool").apply(turned),
        Set("view.lengths", "design units").apply(heavy),
        open_state(OPTIMAL),
        open_state(PRECISE),
        *(go_to_stratum(w).apply(heavy) for w in ((3, 4, 2, 1), (2, 1, 4, 3))),
    ]


def plain(html: str) -> str:
    """Return the words of markup without those of its buttons."""
    texts = re.sub("<[^>]*>", " ", re.sub("<button.*?</button>", "", html))
    return " ".join(texts.split())


@pytest.mark.parametrize(("panel", "answer"), ANSWERS)
def test_panel_shows_the_blocks_of_its_answer(
    services: Services, panel: Callable[[Services], Any], answer: Answer
) -> None:
    made, count = panel(services), 0
    for state in machine_states():
        frame = Frame(state)
        shown = plain(markup_of(made, state))
        for block in answer(services, frame):
            assert plain(content_of(block, {})) in shown
            count += 1
    assert count > 12


LIMITED = msgspec.structs.replace(FULL, payload=msgspec.structs.replace(FULL.payload, mass_kg=0.5))


def shown_workspace(state: State, **changes: Any) -> State:
    workspace = replace(state.view.workspace, solid=True, **changes)
    return Set("view", replace(state.view, workspace=workspace)).apply(state)


WORKSPACES = [
    shown_workspace(set_angle(1, 15.0).apply(thick(open_state(LIMITED), 0.2)), **changes)
    for changes in (
        {"region": "limits", "orientation": "pose"},
        {"region": "limits", "orientation": "home"},
        {"region": "accessible", "orientation": "home"},
        {"region": "held", "orientation": "home"},
    )
]


@pytest.mark.parametrize("state", WORKSPACES)
def test_drawing_holds_its_workspace_and_the_panel_tells_its_numbers(state: State) -> None:
    services, frame = services_for(), Frame(state)
    drawing = draw(services, WORKSPACE_FEED, state)
    measured = draw(services, VOLUME_FEED, state)
    request, design = workspace_request(frame), state.design
    assert request is not None
    rotation = workspace_pose(frame).rotation
    volume = workspace_volume(design, rotation).volume
    assert drawing.volume == measured.measured.volume == volume
    assert drawing.nodes is not None
    assert drawing.nodes.count == node_count_of(Workspace(design, rotation)).count
    feed, cubic = services.get(WORKSPACE_FEED), state.unit_of(3)
    told = plain(words.drawing_words(frame, feed) + words.workspace_details(frame, feed))
    expected = volume
    if request.region == "accessible":
        accessible = accessible_workspace(design, rotation, tolerance=request.tolerance)
        expected = accessible.accessible_volume
        assert drawing.part is not None
        assert drawing.part.node_count == accessible.accessible_node_count
        assert drawing.part.pairs == accessible.pairs
        assert f"{accessible.accessible_node_count} of {drawing.nodes.count}" in told
        for block in clearances.workspace_clearances(accessible.pairs, design, state.unit):
            assert plain(content_of(block, {})) in told
    elif request.region == "held":
        expected = carried_region(Workspace(request.design, rotation), request.load).held_volume
    if request.region != "limits":
        assert drawing.part is not None
        assert drawing.part.volume == pytest.approx(expected, rel=5e-3)
        share = format_number(100.0 * drawing.part.volume / volume, 4)
        assert f"{cubic.text(drawing.part.volume, 6)}" in told
        assert f"{share} %" in told
    assert drawing.mesh_volume == pytest.approx(expected, rel=2e-2)
    headline = plain(words.volume_headline(frame, services.get(VOLUME_FEED)))
    assert cubic.text(volume) in headline
    turned = "present" if state.view.workspace.orientation == "pose" else "home"
    assert f"in the {turned} orientation" in headline
