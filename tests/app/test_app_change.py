"""What was before the last change of the design: a ghost and differences, until the next press."""

from __future__ import annotations

import re
from typing import Any

import msgspec
import numpy as np
import pytest
import viser
from desk import Desk
from services import StubJobs, services_for

from explorer.app.features.history.feature import OVER, ChangeScene, DesignChange
from explorer.app.features.workspace.feeds import VOLUME_FEED
from explorer.app.scene.placing import Placed
from explorer.app.session.session import REDO, UNDO
from explorer.app.state.actions import Action, Set, open_design
from explorer.app.state.frame import Frame
from explorer.app.state.geometry import set_variable
from explorer.app.state.moves import set_position
from explorer.app.widgets.buttons import Buttons
from explorer.measures.snapshot import evaluate
from explorer.mechanism.design_file import PRESETS
from explorer.workspace.slices.volume import workspace_volume

OPTIMAL = PRESETS["paper-optimal"]
WIDER = OPTIMAL.with_variable("a3x", 20.0)


class Watcher:
    """The parts of the feature on one session, followed after each action."""

    def __init__(self, server: viser.ViserServer, buttons: Buttons, desk: Desk) -> None:
        self.desk = desk
        jobs = StubJobs(at_once=True)
        services = services_for(server, desk.session, jobs, buttons=buttons)
        self._volumes = services.get(VOLUME_FEED)
        self.change = services.get(DesignChange)
        self.card = self.change.card
        self.scene = ChangeScene(services)
        self.follow()

    def follow(self) -> Frame:
        frame = Frame(self.desk.state)
        self._volumes.follow(frame)
        self.change.follow(frame)
        return frame

    def do(self, action: Action) -> Frame:
        self.desk.session.do(action)
        return self.follow()


@pytest.fixture
def watcher(server: viser.ViserServer, buttons: Buttons, desk: Desk) -> Watcher:
    return Watcher(server, buttons, desk)


def test_change_shows_the_differences_of_volume_reach_and_clearance(watcher: Watcher) -> None:
    card = watcher.card(watcher.do(set_variable("a3x", 20.0)))
    cells = re.sub(r"<[^>]+>", " ", card)
    before, after = (
        workspace_volume(design, OPTIMAL.home_pose.rotation).volume for design in (OPTIMAL, WIDER)
    )
    for value in (before, after):
        assert f"{value:,.0f}" in cells
    numbers = [float(text.replace("−", "-")) for text in re.findall(r"[+−]([\d.]+)", cells)]
    assert numbers[0] == pytest.approx(abs(after - before), rel=5e-3)
    assert numbers[1] == pytest.approx(WIDER.reach - OPTIMAL.reach, rel=5e-3)
    assert cells.count("same") == 1, "the clearance in the pose does not depend on a3x"


def test_page_that_never_showed_the_design_before_measures_it_too(
    server: viser.ViserServer, buttons: Buttons, desk: Desk
) -> None:
    desk.session.do(set_variable("a3x", 20.0))
    watcher = Watcher(server, buttons, desk)
    card = watcher.card(watcher.follow())
    assert f"{workspace_volume(OPTIMAL, OPTIMAL.home_pose.rotation).volume:,.0f}" in card
    assert "…" not in card


def test_ghost_is_the_mechanism_before_the_change_to_true_size(watcher: Watcher) -> None:
    frame = watcher.do(set_variable("a3x", 20.0))
    placed = Placed(frame)
    updates: dict[str, Any] = {name: value for _, name, value in watcher.scene.updates(placed)}
    points = evaluate(OPTIMAL, watcher.desk.state.pose).points
    ends = updates["points"].reshape(-1, 3) / placed.scale
    for point in (points.a3, points.b1, points.b2, points.b3, points.b4):
        assert np.abs(ends - point).max(axis=1).min() < 1e-5
    assert updates["visible"]


def test_change_is_over_with_the_next_step_with_a_press_and_with_undo(
    watcher: Watcher, buttons: Buttons
) -> None:
    change, desk = watcher.change, watcher.desk
    for value, end in (
        (4.0, lambda: desk.session.do(set_position(0, 11.0))),
        (4.25, lambda: desk.press(buttons, OVER)),
        (4.5, lambda: desk.session.do(UNDO)),
        (4.75, lambda: [desk.session.do(move) for move in (UNDO, REDO)]),
    ):
        watcher.do(set_position(0, 10.0 + 0.1 * value))
        watcher.do(set_variable("a3y", value))
        assert change.before is not None
        assert change.before.state.pose.position[0] == 10.0 + 0.1 * value
        end()
        watcher.follow()
        assert change.before is None


def test_opened_design_is_no_change_and_new_limits_are_one(watcher: Watcher) -> None:
    watcher.do(open_design(PRESETS["paper-initial"]))
    assert watcher.change.before is None
    assert watcher.card(watcher.follow()) == ""
    design = watcher.desk.state.design
    watcher.do(Set("design.limits", msgspec.structs.replace(design.limits, box=None)))
    assert watcher.change.before is not None
    assert watcher.change.before.state.design == design


def test_ghost_is_drawn_only_where_one_picture_shows_both_sizes(watcher: Watcher) -> None:
    def has_ghost(action: Action) -> bool:
        placed = Placed(watcher.do(action))
        return bool(
            next(value for _, name, value in watcher.scene.updates(placed) if name == "visible")
        )

    for unit, is_drawn in ((23.0, True), (2.3e5, False), (23.0, False), (10.0, True)):
        assert has_ghost(Set("design.unit_mm", unit, "1 unit (mm)")) == is_drawn
    assert not has_ghost(set_variable("a3x", 1000.0))
    assert not has_ghost(set_variable("a3x", 20.0))
