"""The tour leads a user on by what is done, and is remembered with the theme, as told."""

from __future__ import annotations

import json
import threading
from dataclasses import dataclass
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
import viser
from desk import Desk
from services import services_for

from explorer.app.browser.browser_facts import BrowserFacts, decode_facts
from explorer.app.features.feature import Services
from explorer.app.features.help.tour import STEPS, Tour, start_tour
from explorer.app.features.help.tour_panel import TourGuide, card_words
from explorer.app.features.optimise.actions import Accept, EndRun, StartRun
from explorer.app.layout import is_narrow
from explorer.app.state.action import Action
from explorer.app.state.frame import Frame
from explorer.app.state.optimisation import SearchResult
from explorer.app.state.state import State, opened
from explorer.app.storage.preferences import NAME, PreferenceFile, Preferences
from explorer.app.widgets.buttons import Buttons
from explorer.app.widgets.theme import BRAND, BRAND_ON_DARK, Theme
from explorer.errors import StorageError
from explorer.mechanism.design_file import PRESETS
from explorer.optimise.outcome import Iterate

OPENED = opened(PRESETS["paper-optimal"])


def after(tour: Tour, state: State) -> State:
    """Return the state once the tour has shown its step."""
    return tour.step.show(Frame(state)).apply(state)


@pytest.mark.parametrize("preset", PRESETS)
def test_every_step_is_done_by_what_it_shows_and_not_before(preset: str) -> None:
    state = opened(PRESETS[preset])
    tour = start_tour(Frame(state))
    for index, step in enumerate(STEPS):
        assert tour.at == index
        assert not tour.after_frame(Frame(state)).is_done
        state = after(tour, state)
        tour = tour.after_frame(Frame(state))
        assert tour.is_done
        # Once done it stays so, whatever is done next.
        assert tour.after_frame(Frame(opened(PRESETS[preset]))).is_done
        if step.after is not None:
            state = step.after.apply(state)
        assert tour.is_last == (index == len(STEPS) - 1)
        tour = tour.step_by(1, Frame(state))
    assert state.optimisation.is_on


def test_there_are_five_steps_each_in_few_words() -> None:
    assert len(STEPS) == 5
    for step in STEPS:
        assert step.title
        assert not step.title.endswith(".")
        assert step.text.endswith(".")
        assert len(step.text) <= 220


def test_the_tour_comes_close_to_a_singularity_without_reaching_it() -> None:
    tour = start_tour(Frame(OPENED)).step_by(1, Frame(OPENED))
    found = Frame(after(tour, OPENED))
    least = float(np.abs(found.snapshot.margins).min())
    assert 0.0 < least < found.state.warn_below
    assert found.state.unclosed is None
    assert found.state.mode == OPENED.mode


def test_the_tour_stops_at_both_ends() -> None:
    tour = start_tour(Frame(OPENED))
    assert tour.step_by(-1, Frame(OPENED)).at == 0
    assert tour.step_by(9, Frame(OPENED)).at == len(STEPS) - 1


def test_a_search_for_the_best_design_ends_the_tour_only_if_it_is_new() -> None:
    running = StartRun().apply(OPENED)
    tour = start_tour(Frame(running)).step_by(4, Frame(running))
    assert not tour.after_frame(Frame(running)).is_done


def ended(state: State) -> State:
    """Return a state after its search has ended with a result, without a process."""
    run = state.optimisation.run
    assert run is not None
    design = run.problem.start.with_variables([20.0, 7.0, 4.0, -4.0, 2.6, 4.9])
    best = Iterate(0, 0, "solving", design, design.variables, 0.1, 7000.0, "", 0.0)
    return EndRun(run.number, SearchResult("converged", "converged", best), (best,)).apply(state)


@pytest.mark.parametrize("ends_first", [True, False])
@pytest.mark.parametrize("press", ["Next", "Skip"])
def test_what_the_search_of_a_tour_left_is_put_back_when_the_tour_is_over(
    server: viser.ViserServer, desk: Desk, press: str, ends_first: bool
) -> None:
    guide, client = guide_at_last_step(server, desk)
    before = desk.state
    desk.session.do(StartRun())
    assert phase_of(desk.state) == "running"
    if ends_first:
        desk.session.do(_Becomes(ended(desk.state)))
        assert desk.state.design != before.design
    guide._press(press, client)
    if not ends_first:
        # The runner tells the end of a search that was cancelled.
        assert phase_of(desk.state) == "cancelling"
        desk.session.do(_Becomes(ended(desk.state)))
        guide.follow(Frame(desk.state))
    after = desk.state
    assert after.optimisation.run is None
    assert (after.design, after.pose, after.joints) == (before.design, before.pose, before.joints)


@pytest.mark.parametrize("press", ["Next", "Skip"])
def test_what_was_accepted_or_found_before_the_tour_stays_when_it_is_over(
    server: viser.ViserServer, desk: Desk, press: str
) -> None:
    desk.session.do(StartRun())
    desk.session.do(_Becomes(ended(desk.state)))
    earlier = desk.state
    guide, client = guide_at_last_step(server, desk)
    guide._press(press, client)
    assert desk.state == earlier
    guide, client = guide_at_last_step(server, desk)
    desk.session.do(StartRun())
    desk.session.do(_Becomes(ended(desk.state)))
    desk.session.do(Accept())
    accepted = desk.state
    guide._press(press, client)
    guide.follow(Frame(desk.state))
    assert desk.state == accepted


@dataclass(frozen=True)
class _Becomes(Action):
    """Take another state, as a runner would lead to."""

    state: State

    def apply(self, state: State) -> State:
        """Return the other state."""
        del state
        return self.state


def guide_at_last_step(server: viser.ViserServer, desk: Desk) -> tuple[Any, Any]:
    """Return the guide of a tour at its last step, and the browser that has it."""
    client: Any = SimpleNamespace(client_id=3, gui=server.gui)
    guide: Any = TourGuide(services_for(server, desk.session, buttons=Buttons(server)))
    guide.begin(client)
    frame = Frame(desk.state)

    def to_last(tour: Tour) -> Tour:
        return tour.step_by(len(STEPS), frame)

    guide._cards[3].change(to_last)
    assert guide._cards[3].tour.is_last
    return guide, client


def phase_of(state: State) -> str | None:
    run = state.optimisation.run
    return None if run is None else run.phase


def test_the_card_offers_what_can_be_pressed() -> None:
    first = card_words(start_tour(Frame(OPENED)))
    assert "step 1 of 5" in first
    assert 'data-value="Back"' not in first
    assert 'data-value="Show me"' in first
    assert ">Next<" in first
    assert "Done" not in first
    last = card_words(Tour(4, Frame(OPENED), 0, is_done=True))
    assert 'data-value="Back"' in last
    assert 'data-value="Show me"' not in last
    assert ">Finish<" in last
    assert "Done" in last
    assert all(">Skip the tour<" in card for card in (first, last))


def test_nothing_is_remembered_at_first(tmp_path: Path) -> None:
    assert PreferenceFile(tmp_path).chosen == Preferences(dark=None, tour_seen=False)
    # To look at them makes no file.
    assert list(tmp_path.iterdir()) == []


def test_what_is_chosen_is_remembered_each_by_itself(tmp_path: Path) -> None:
    folder = tmp_path / "new" / "folder"
    PreferenceFile(folder).choose(tour_seen=True)
    PreferenceFile(folder).choose(dark=True)
    assert PreferenceFile(folder).chosen == Preferences(dark=True, tour_seen=True)
    PreferenceFile(folder).choose(dark=False)
    assert PreferenceFile(folder).chosen == Preferences(dark=False, tour_seen=True)


def test_two_explorers_do_not_forget_for_each_other(tmp_path: Path) -> None:
    one, other = PreferenceFile(tmp_path), PreferenceFile(tmp_path)
    one.choose(dark=True)
    other.choose(tour_seen=True)
    assert PreferenceFile(tmp_path).chosen == Preferences(dark=True, tour_seen=True)


@pytest.mark.parametrize(
    "text",
    [
        b"",
        b"{",
        b"null",
        b"[1]",
        b'{"dark": 7}',
        b"\xff\xfe",
        b'{"dark":' + b"[" * 9000,
        b" " * 20_000 + b"{}",
    ],
)
def test_a_broken_file_counts_as_nothing_chosen_and_is_replaced(
    tmp_path: Path, text: bytes
) -> None:
    (tmp_path / NAME).write_bytes(text)
    file = PreferenceFile(tmp_path)
    assert file.chosen == Preferences()
    file.choose(dark=True)
    assert json.loads((tmp_path / NAME).read_bytes()) == {"dark": True, "tour_seen": False}


def test_what_a_later_explorer_remembers_is_no_trouble(tmp_path: Path) -> None:
    (tmp_path / NAME).write_bytes(b'{"dark": true, "language": "fr"}')
    assert PreferenceFile(tmp_path).chosen == Preferences(dark=True)


def test_a_folder_that_takes_no_file_is_told_in_a_line(tmp_path: Path) -> None:
    (tmp_path / "taken").write_bytes(b"")
    file = PreferenceFile(tmp_path / "taken")
    with pytest.raises(StorageError) as caught:
        file.choose(dark=True)
    assert "\n" not in str(caught.value)
    assert file.chosen.dark is True


@pytest.mark.parametrize(
    "told",
    [
        "",
        "null",
        "{}",
        '{"width": -1, "height": 5, "dark": false}',
        '{"width": 1e9, "height": 5, "dark": false}',
        '{"width": "1", "height": 5, "dark": false}',
        '{"width": 1, "height": 5, "dark": 1}',
        '{"width": 1, "height": 5, "dark": true, "more": 1}',
        "[" * 100_000,
    ],
)
def test_what_no_browser_says_is_not_believed(told: str) -> None:
    assert decode_facts(told) is None


def test_what_a_browser_says_is_read() -> None:
    told = '{"width": 1024, "height": 768.5, "dark": true}'
    assert decode_facts(told) == BrowserFacts(1024, 768.5, True)


@pytest.mark.parametrize(
    ("width", "height", "narrow"),
    [
        (1280, 720, False),
        (1920, 1080, False),
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


class Gui:
    """What a theme needs of viser's."""

    def __init__(self) -> None:
        self.themes: list[dict[str, Any]] = []

    def configure_theme(self, **theme: Any) -> None:
        """Keep what it is told."""
        self.themes.append(theme)


def test_a_theme_is_told_once_for_each_change() -> None:
    gui, changes = Gui(), list[bool]()
    untyped: Any = gui
    theme = Theme(untyped, dark=False, changed=lambda: changes.append(theme.is_dark))
    for dark in (False, True, True, False):
        theme.choose(dark=dark)
    assert changes == [True, False]
    assert [t["dark_mode"] for t in gui.themes] == [False, True, False]
    assert [t["brand_color"] for t in gui.themes] == [BRAND, BRAND_ON_DARK, BRAND]
    # No tunnel to anywhere is offered in either.
    assert not any(t["show_share_button"] for t in gui.themes)


def test_the_theme_is_no_step_of_the_history(desk: Desk) -> None:
    untyped: Any = Gui()
    theme = Theme(untyped, dark=False, changed=desk.session.redraw)
    theme.choose(dark=True)
    assert desk.session.wait_until_idle()
    assert len(desk.session.history.steps) == 1


def test_tour_used_on_many_threads_leaves_one_card_or_none(
    server: viser.ViserServer, services: Services
) -> None:
    class Browser:
        client_id = 3
        gui = server.gui

    client: Any = Browser()
    gui: Any = server.gui
    guide = TourGuide(services)
    before = set(gui._panel_handle_from_uuid)
    failed: list[BaseException] = []

    def use(seed: int) -> None:
        rng = np.random.default_rng(seed)
        try:
            for _ in range(30):
                act = rng.integers(3)
                if act == 0:
                    guide.begin(client)
                elif act == 1:
                    guide.end(client)
                else:
                    guide.follow(Frame(opened(PRESETS["paper-initial"])))
        except RuntimeError as error:
            failed.append(error)

    hands = [threading.Thread(target=use, args=(seed,)) for seed in range(4)]
    for hand in hands:
        hand.start()
    for hand in hands:
        hand.join()
    assert failed == []
    guide.begin(client)
    assert len(set(gui._panel_handle_from_uuid) - before) == 1
    guide.end(client)
    assert set(gui._panel_handle_from_uuid) == before
