"""The table of the assembly modes, and the ghost of the one that a pointer rests on."""

from __future__ import annotations

import re
from types import SimpleNamespace
from typing import Any

import numpy as np
from desk import CLIENT, Desk, by_name, number
from hypothesis import given
from strategies import Case, all_cases

from explorer.app.features.feature import Services
from explorer.app.features.mechanism.marks import Ghosts, ghost_points
from explorer.app.features.mechanism.modes import (
    MODES,
    HoveredMode,
    ModesPanel,
    ghost_modes,
    modes_table,
)
from explorer.app.scene.placing import Placed
from explorer.app.state.actions import Set, SetJoint, SetMode
from explorer.app.state.frame import Frame
from explorer.app.state.state import opened
from explorer.mechanism.design_file import PRESETS
from explorer.mechanism.kinematics import attachment_points
from explorer.mechanism.pose import Pose

OPTIMAL = PRESETS["paper-optimal"]


def rows_of_modes(frame: Frame) -> list[list[str]]:
    """Return the cells of each row of the table."""
    buttons = re.findall(r"<button[^>]*modes\.go.*?</button>", modes_table(frame, ""))
    cells = [re.findall(r"<(?:b|span)(?: [^>]*)?>([^<]*)", button) for button in buttons]
    return [[cell for cell in row if cell] for row in cells]


def test_table_has_the_eight_modes_with_b4_and_the_limits_that_each_breaks() -> None:
    frame = Frame(opened(OPTIMAL))
    rows = rows_of_modes(frame)
    assert [row[0] for row in rows] == [str(mode) for mode in range(8)]
    for mode, row in enumerate(rows):
        assert f"{row[0]}:  {row[1]}" == MODES[mode]
        there = Frame(SetMode(mode).apply(frame.state))
        np.testing.assert_allclose(
            [number(cell) for cell in row[2:5]], there.state.pose.position, atol=0.06
        )
        # All numbers of the table have the same decimals.
        assert {len(cell.partition(".")[2]) for cell in row[2:5]} == {1}
        broken = there.snapshot.violations
        assert (row[5] == "within") == (not broken)
        if broken:
            assert row[5].split(" +")[0] in broken[0].limit
            assert str(broken[0]) in modes_table(frame, "").replace("&#x27;", "'")
            assert row[5].endswith(f" +{len(broken) - 1}") == (len(broken) > 1)


@given(all_cases())
def test_table_of_any_pose_has_eight_rows_or_says_that_they_do_not_close(case: Case) -> None:
    frame = Frame(opened(case.design, Pose.of(case.position, case.rotation)))
    rows = rows_of_modes(frame)
    assert len(rows) == 8
    for row in rows:
        if frame.snapshot.modes.feasible:
            assert len(row) == 6
            assert all(np.isfinite(number(cell)) for cell in row[2:5])
        else:
            assert row[2:] == ["does not close"]


def test_table_says_that_lengths_do_not_close_and_whose_modes_it_shows() -> None:
    state = SetJoint(0, 40.0).apply(opened(OPTIMAL))
    assert "close in no mode" in modes_table(Frame(state), "")
    assert "close in no mode" not in modes_table(Frame(opened(OPTIMAL)), "")


def test_press_on_a_row_goes_to_its_mode_and_one_in_the_head_switches_the_ghosts(
    services: Services, desk: Desk
) -> None:
    ModesPanel(services)
    desk.press(services.buttons, "modes.go", "6")
    assert desk.state.mode == 6
    desk.press(services.buttons, "modes.go", "8")
    assert desk.state.mode == 6
    for on in (True, False):
        desk.press(services.buttons, "modes.ghosts")
        assert desk.state.view.ghosts is on
    labels = [command.label for command in services.buttons.commands]
    assert "Pose › Assembly mode › 3: − + +" in labels
    assert len(labels) == len(MODES) + 1


def test_pointer_on_a_row_shows_one_ghost_with_its_number_and_leaves_no_step(
    services: Services, desk: Desk
) -> None:
    ghosts = Ghosts(services)
    before, steps = desk.state, desk.session.history

    def drawn() -> dict[str, dict[str, Any]]:
        return by_name(ghosts.updates(Placed(Frame(desk.state))))

    def visible() -> list[str]:
        return [name for name, values in drawn().items() if values.get("visible")]

    assert visible() == []
    desk.press(services.buttons, "modes.hover", "6")
    assert sorted(visible()) == ["/ghosts/legs", "/ghosts/name/0", "/ghosts/platform/0"]
    scene = drawn()
    assert scene["/ghosts/name/0"]["text"] == MODES[6]
    there = SetMode(6).apply(before).pose
    points = attachment_points(OPTIMAL, there.position, there.rotation)
    placed = Placed(Frame(desk.state))
    expected = placed.scale * np.array([points.b1, points.b2, points.b3, points.b4])
    np.testing.assert_allclose(ghost_points(placed, [6])[0], expected, atol=1e-9)
    # The present mode has no ghost, and none is left once the pointer has gone.
    for value in (str(before.mode), ""):
        desk.press(services.buttons, "modes.hover", value)
        assert visible() == []
    assert desk.state == before
    assert desk.session.history == steps


def test_all_ghosts_stay_all_while_a_pointer_rests_on_one() -> None:
    frame = Frame(Set("view.ghosts", value=True).apply(opened(OPTIMAL)))
    others = [mode for mode in range(8) if mode != frame.state.mode]
    assert ghost_modes(frame, None) == ghost_modes(frame, 3) == others


def test_pointer_is_on_a_mode_or_on_none_and_leaves_with_its_browser(
    services: Services, desk: Desk
) -> None:
    hovered = services.get(HoveredMode)
    for text, row in (("9", None), ("-1", None), ("x", None), ("2", 2)):
        desk.press(services.buttons, "modes.hover", text)
        assert hovered.row == row
    for client_id, expected in ((CLIENT.client_id + 1, 2), (CLIENT.client_id, None)):
        client: Any = SimpleNamespace(client_id=client_id)
        for forget in list(getattr(services.server, "_client_disconnect_cb")):  # noqa: B009
            forget(client)
        assert hovered.row == expected
