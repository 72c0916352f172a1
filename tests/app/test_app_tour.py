"""The tour advances by what the user does; preferences, the theme, and facts of a browser."""

from __future__ import annotations

import json
from dataclasses import dataclass
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import msgspec
import numpy as np
import pytest
import viser
from desk import Desk
from services import services_for

from explorer.app.browser.browser_facts import BrowserFacts, decode_facts
from explorer.app.features.help.tour import STEPS, start_tour
from explorer.app.features.help.tour_panel import PRESS, TourGuide
from explorer.app.features.optimise.actions import Accept, EndRun, StartRun
from explorer.app.layout import is_narrow
from explorer.app.state.action import Action
from explorer.app.state.actions import Set
from explorer.app.state.frame import Frame
from explorer.app.state.optimisation import SearchResult
from explorer.app.state.state import State, opened
from explorer.app.storage.preferences import NAME, PreferenceFile, Preferences
from explorer.app.widgets.buttons import Buttons
from explorer.app.widgets.theme import BRAND, BRAND_ON_DARK, Theme
from explorer.errors import StorageError
from explorer.mechanism.design_file import PRESETS
from explorer.mechanism.machine import Tool
from explorer.optimise.outcome import Iterate

OPENED = opened(PRESETS["paper-optimal"])
TOOL = Tool(position=(1.0, 0.0, 3.0))
AT_TOOL = Set("view.at", "tool").apply(
    opened(msgspec.structs.replace(PRESETS["paper-optimal"], tool=TOOL))
)


@pytest.mark.parametrize("start", [*map(opened, PRESETS.values()), AT_TOOL])
def test_step_of_the_tour_is_done_by_what_it_shows_and_not_before(start: State) -> None:
    state = start
    tour = start_tour(Frame(state))
    assert tour.step_by(-1, Frame(state)).at == 0
    for index, step in enumerate(STEPS):
        assert tour.at == index
        assert not tour.after_frame(Frame(state)).is_done
        state = tour.step.show(Frame(state)).apply(state)
        tour = tour.after_frame(Frame(state))
        assert tour.is_done
        # It comes close to a singularity without reaching it.
        assert np.abs(Frame(state).snapshot.margins).min() > 0.0
        # Once done it stays so, whatever is done next.
        assert tour.after_frame(Frame(start)).is_done
        if step.after is not None:
            state = step.after.apply(state)
        assert tour.is_last == (index == len(STEPS) - 1)
        tour = tour.step_by(1, Frame(state))
    assert tour.at == len(STEPS) - 1
    assert state.optimisation.is_on


def test_last_step_of_the_tour_is_done_only_by_a_search_that_is_new() -> None:
    running = StartRun().apply(OPENED)
    tour = start_tour(Frame(running)).step_by(4, Frame(running))
    assert not tour.after_frame(Frame(running)).is_done


def end_search(state: State) -> State:
    """Return a state after its search has ended with a result, without a process."""
    run = state.optimisation.run
    assert run is not None
    design = run.problem.start.with_variables([20.0, 7.0, 4.0, -4.0, 2.6, 4.9])
    best = Iterate(0, 0, "solving", design, design.variables, 0.1, 7000.0, "", 0.0)
    return EndRun(run.number, SearchResult("converged", "converged", best), (best,)).apply(state)


@dataclass(frozen=True)
class Become(Action):
    """Take another state, as a runner would lead to."""

    state: State

    def apply(self, state: State) -> State:
        """Return the other state."""
        del state
        return self.state


class Tourist:
    """A browser with a tour at its last step, and the guide of the tour."""

    def __init__(self, server: viser.ViserServer, desk: Desk) -> None:
        self._client: Any = SimpleNamespace(client_id=3, gui=server.gui)
        self._buttons = Buttons(server)
        self.guide = TourGuide(services_for(server, desk.session, buttons=self._buttons))
        self.guide.begin(self._client)
        for _ in STEPS[1:]:
            self.press("Next")

    def press(self, name: str) -> None:
        """Press a button of the card."""
        self._buttons.press(PRESS, name, self._client)


@pytest.mark.parametrize("ends_first", [True, False])
@pytest.mark.parametrize("press", ["Next", "Skip"])
def test_end_of_the_tour_reverts_what_its_search_has_left(
    server: viser.ViserServer, desk: Desk, press: str, ends_first: bool
) -> None:
    tourist = Tourist(server, desk)
    before = desk.state
    desk.session.do(StartRun())
    assert desk.state.optimisation.is_on
    if ends_first:
        desk.session.do(Become(end_search(desk.state)))
        assert desk.state.design != before.design
    tourist.press(press)
    if not ends_first:
        # The runner tells the end of a search that was cancelled.
        run = desk.state.optimisation.run
        assert run is not None
        assert run.phase == "cancelling"
        desk.session.do(Become(end_search(desk.state)))
        tourist.guide.follow(Frame(desk.state))
    after = desk.state
    assert after.optimisation.run is None
    assert (after.design, after.pose, after.joints) == (before.design, before.pose, before.joints)


@pytest.mark.parametrize("press", ["Next", "Skip"])
def test_end_of_the_tour_keeps_what_was_accepted_or_found_before_it(
    server: viser.ViserServer, desk: Desk, press: str
) -> None:
    desk.session.do(StartRun())
    desk.session.do(Become(end_search(desk.state)))
    tourist = Tourist(server, desk)
    earlier = desk.state
    tourist.press(press)
    assert desk.state == earlier
    tourist = Tourist(server, desk)
    desk.session.do(StartRun())
    desk.session.do(Become(end_search(desk.state)))
    desk.session.do(Accept())
    accepted = desk.state
    tourist.press(press)
    tourist.guide.follow(Frame(desk.state))
    assert desk.state == accepted


def test_preferences_are_remembered_each_by_itself_and_of_two_explorers(tmp_path: Path) -> None:
    assert PreferenceFile(tmp_path).chosen == Preferences(dark=None, tour_seen=False)
    # Reading them makes no file.
    assert list(tmp_path.iterdir()) == []
    folder = tmp_path / "new" / "folder"
    one, other = PreferenceFile(folder), PreferenceFile(folder)
    one.choose(tour_seen=True)
    other.choose(dark=True)
    assert PreferenceFile(folder).chosen == Preferences(dark=True, tour_seen=True)
    # A later explorer may remember more.
    (tmp_path / NAME).write_bytes(b'{"dark": true, "language": "fr"}')
    assert PreferenceFile(tmp_path).chosen == Preferences(dark=True)


@pytest.mark.parametrize(
    "text",
    [
        b"{",
        b"null",
        b'{"dark": 7}',
        b"\xff\xfe",
        b'{"dark":' + b"[" * 9000,
        b" " * 20_000 + b"{}",
    ],
)
def test_preferences_in_a_broken_file_count_as_none_and_are_replaced(
    tmp_path: Path, text: bytes
) -> None:
    (tmp_path / NAME).write_bytes(text)
    file = PreferenceFile(tmp_path)
    assert file.chosen == Preferences()
    file.choose(dark=True)
    assert json.loads((tmp_path / NAME).read_bytes()) == {"dark": True, "tour_seen": False}


def test_preferences_in_a_folder_that_takes_no_file_are_refused_in_a_line(tmp_path: Path) -> None:
    (tmp_path / "taken").write_bytes(b"")
    file = PreferenceFile(tmp_path / "taken")
    with pytest.raises(StorageError) as refusal:
        file.choose(dark=True)
    assert "\n" not in str(refusal.value)
    assert file.chosen.dark is True


@pytest.mark.parametrize(
    "text",
    [
        "",
        "{}",
        '{"width": -1, "height": 5, "dark": false}',
        '{"width": "1", "height": 5, "dark": false}',
        '{"width": 1, "height": 5, "dark": 1}',
        '{"width": 1, "height": 5, "dark": true, "more": 1}',
        "[" * 100_000,
    ],
)
def test_facts_that_no_browser_sends_are_ignored(text: str) -> None:
    assert decode_facts(text) is None


def test_facts_of_a_browser_are_read() -> None:
    text = '{"width": 1024, "height": 768.5, "dark": true}'
    assert decode_facts(text) == BrowserFacts(1024, 768.5, True)


@pytest.mark.parametrize(
    ("width", "height", "narrow"),
    [
        (1280, 720, False),
        (1024, 768, True),
        (768, 1024, True),
        (1099, 700, True),
        (1100, 700, False),
        # Two panels one over the other would be too low to be of use.
        (860, 480, False),
    ],
)
def test_panels_are_stacked_where_the_window_is_narrow_and_high(
    width: int, height: int, narrow: bool
) -> None:
    assert is_narrow(BrowserFacts(width, height, False)) is narrow


def test_theme_is_set_once_for_each_change_and_is_no_step_of_the_history(desk: Desk) -> None:
    themes: list[dict[str, Any]] = []

    def keep(**theme: Any) -> None:
        themes.append(theme)

    gui: Any = SimpleNamespace(configure_theme=keep)
    theme = Theme(gui, dark=False, changed=desk.session.redraw)
    for dark in (False, True, True, False):
        theme.choose(dark=dark)
    assert [t["dark_mode"] for t in themes] == [False, True, False]
    assert [t["brand_color"] for t in themes] == [BRAND, BRAND_ON_DARK, BRAND]
    # No tunnel to anywhere is offered in either.
    assert not any(t["show_share_button"] for t in themes)
    assert desk.session.wait_until_idle()
    assert len(desk.session.history.steps) == 1
