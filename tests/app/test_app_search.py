"""The search of the page: all that stands there is found, and what is meant comes first."""

from __future__ import annotations

import re
from collections.abc import Iterator
from html import unescape
from typing import Any

import pytest
import viser
from desk import ScriptedBrowser
from page_props import TAG

from explorer.app.features.designs.feature import SavedDesigns
from explorer.app.features.help.search import ASK, RUN, TITLE, SearchDialog
from explorer.app.server import Running
from explorer.page.widgets.search import MOST_MISTYPED, Entry, find, lines_of, normalise


@pytest.fixture(scope="module")
def entries(running: Running) -> list[Entry]:
    assert running.page.session.wait_until_idle()
    return list(running.page.services.get(SearchDialog).entries)


def texts_on(running: Running) -> Iterator[str]:
    """Yield every text that stands on the page, its markup cut at each tag."""
    gui: Any = running.viser.gui
    containers: list[Any] = list(gui._container_handle_from_uuid.values())
    for container in containers:
        if not getattr(container, "visible", True) or getattr(container, "_label", "") == TITLE:
            continue
        handles: list[Any] = list(container._children.values())
        for handle in handles:
            if not handle.visible:
                continue
            if isinstance(handle, viser.GuiHtmlHandle):
                yield from map(unescape, TAG.split(handle.content))
            else:
                yield str(getattr(handle, "label", None) or "")


def test_search_of_every_text_on_the_page_finds_it(running: Running, entries: list[Entry]) -> None:
    texts = {normalise(text): text for text in texts_on(running) if text.strip()}
    assert len(texts) > 500
    # A text is found if all its words are; each is searched as it stands on the page.
    labels = [normalise(each.label) for each in entries]
    missing = [text for words, text in texts.items() if not any(words in each for each in labels)]
    assert missing == []
    for text in sorted(texts)[::40]:
        assert any(text in normalise(each.label) for each in find(text, entries)), text


def test_every_verdict_is_declared_with_its_meaning_and_found(
    running: Running, entries: list[Entry]
) -> None:
    features = running.page.services.features
    verdicts = {words: (each, why) for each in features for words, why in each.verdicts.items()}
    assert {"Strokes too short", "Not buildable", "Singular", "Converged"} <= {*verdicts}
    for words, (feature, meaning) in verdicts.items():
        # Commands and controls may have the same words.
        found = {(each.label, each.value): each.does for each in find(words, entries)[:4]}
        assert found[words, feature.tabs[0].title] == meaning
        # A sentence without a formula.
        assert meaning.endswith(".")
        assert not re.search(r"[=σ×]|\|", meaning)


@pytest.mark.parametrize(
    ("query", "label"),
    [
        ("strokes too short", "Strokes too short"),
        ("undo", "Edit › Undo"),
        ("optimise", "Optimise › Optimise"),
        ("home pose", "Pose › Home pose"),
        ("save", "Designs › Design › Save"),
        ("free ball", "Singularity › Singularity-free ball"),
        ("delta2", "δ2 (glossary)"),
        ("via point", "Via point (glossary)"),
        ("pick and place", "Via point (glossary)"),
        ("warn below", "Warn below (mm)"),
        ("singularty", "Singularity"),
    ],
)
def test_search_lists_what_is_meant_first(entries: list[Entry], query: str, label: str) -> None:
    assert find(query, entries)[0].label == label


def test_search_lists_no_term_before_a_command_of_its_words(entries: list[Entry]) -> None:
    for command in (each for each in entries if each.kind == "command"):
        name = command.label.rpartition(" › ")[2]
        found = find(name, entries)
        kinds = [each.kind for each in found if normalise(name) == normalise(each.label)]
        assert command in found
        before = found[: found.index(command)]
        assert "manual" not in [each.kind for each in before], (name, kinds)


def test_search_takes_a_few_mistyped_words_for_known_ones_and_no_more(entries: list[Entry]) -> None:
    meant = find(MOST_MISTYPED * "singularity ", entries)
    assert meant == find(MOST_MISTYPED * "singularty ", entries) != []
    assert find((MOST_MISTYPED + 1) * "singularty ", entries) == []


def test_search_of_nothing_and_of_no_words_finds_nothing(entries: list[Entry]) -> None:
    assert find("", entries) == find("  ", entries) == find("xqzwv", entries) == []


def test_text_in_folders_tells_them_from_the_outer_one_to_the_inner(entries: list[Entry]) -> None:
    folders = {each.label: each.folders for each in entries if each.kind == "text"}
    assert folders["Warn below (mm)"] == ("More",)
    assert folders["yaw of home"] == ("Problem", "Free variables")


def test_lines_of_markup_have_the_hint_and_the_tab_of_what_they_stand_in() -> None:
    markup = '<div title="why">a <b>b</b><br>c<p data-opens="Tab">d</div><span>e</p></span>&lt;f'
    assert [tuple(each) for each in lines_of(markup)] == [
        ("a b", "why", ""),
        ("c", "why", ""),
        ("d", "why", "Tab"),
        ("e", "", ""),
        ("<f", "", ""),
    ]


def test_search_answers_the_browser_that_asks_and_runs_what_is_ready(running: Running) -> None:
    browser: Any = ScriptedBrowser()
    press = running.page.buttons.press
    for words in ("grid", "no such thing", "</script>"):
        press(ASK, words, browser)
    found, nothing, cut = browser.scripts
    assert "Overlays › Grid" in found
    assert "Nothing has the words" in nothing
    assert "&lt;/script&gt;" in cut
    session = running.page.session
    before = session.state.view.grid
    press(RUN, "Overlays › Grid", browser)
    # It cannot be run now, or is not there.
    press(RUN, "Optimise › Cancel", browser)
    press(RUN, "none", browser)
    assert session.wait_until_idle()
    assert session.state.view.grid is not before
    assert running.page.services.get(SavedDesigns).wait_until_idle()
