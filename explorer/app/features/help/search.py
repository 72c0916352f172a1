"""The search: commands, all that stands on the page, and the manual with its terms."""

from __future__ import annotations

from collections.abc import Iterator
from html import escape
from itertools import islice

import viser

from explorer.app.features.feature import Services
from explorer.app.features.help.manual import ManualReader, list_entries
from explorer.app.state.frame import Frame
from explorer.app.widgets.buttons import MANUAL, press_button
from explorer.page.browser.viser_gaps import run_script_in
from explorer.page.look import call_script
from explorer.page.widgets.assigning import Updates
from explorer.page.widgets.palette import Command
from explorer.page.widgets.search import Entry, Kind, find, page_texts

TITLE, ASK, RUN = "Search", "search.ask", "search.run"
# Largest number of results that are shown.
MOST = 40
WORDS = "Search commands, all texts of the page, and the manual"
MARKUP = (
    f'<input type="search" class="ex-search" placeholder="{WORDS}" aria-label="{TITLE}">'
    '<div class="ex-results" data-closes role="toolbar" aria-label="Results"></div>'
)
# What a press on a result of each kind does.
PRESSES: dict[Kind, str] = {"command": RUN, "text": "search.leave", "manual": MANUAL}


class SearchDialog:
    """The field of the search, and what it has found."""

    def __init__(self, services: Services) -> None:
        self._services = services
        services.get(ManualReader)
        services.gui.add_html(MARKUP)
        services.buttons.on(ASK, self._answer)
        services.buttons.on(RUN, self._run)
        services.buttons.on(PRESSES["text"], lambda _, __: None)

    def updates(self, _: Frame) -> Updates:
        """Yield no updates: each browser has a search of its own."""
        yield from ()

    @property
    def commands(self) -> Iterator[Command]:
        """The commands that stay, and those that come and go."""
        yield from self._services.commands.all
        for feature in self._services.features:
            if feature.passing is not None:
                yield from feature.passing(self._services)

    @property
    def entries(self) -> Iterator[Entry]:
        """All that a search may find now."""
        for each in self.commands:
            yield Entry("command", each.label, each.does, each.label, each.is_ready)
        for feature in self._services.features:
            for words, meaning in feature.verdicts.items():
                yield Entry("text", words, meaning, feature.tabs[0].title)
        declared = {words for feature in self._services.features for words in feature.verdicts}
        for each in page_texts(self._services.gui):
            if each.value != TITLE and each.label not in declared:
                yield each
        for label, does, target in list_entries():
            yield Entry("manual", label, does, target)

    def _answer(self, text: str, client: viser.ClientHandle) -> None:
        found = "".join(map(_result, islice(find(text, self.entries), MOST)))
        nothing = f'<div class="ex-dim">Nothing has the words “{escape(text)}”.</div>'
        run_script_in(client, call_script("search", text, found or nothing * bool(text.strip())))

    def _run(self, label: str, client: viser.ClientHandle) -> None:
        for command in self.commands:
            if command.label == label and command.is_ready():
                command.run(client)
                return


def _result(entry: Entry) -> str:
    """Return what was found as a button in HTML."""
    tab = entry.value if entry.kind == "text" else ""
    where = f'<span class="ex-dim ex-small">in {escape(tab)}</span>' if tab else ""
    does = f'<span class="ex-dim ex-small">{escape(entry.does)}</span>' if entry.does else ""
    return press_button(
        # A tab that is opened closes the search, too.
        "" if tab else PRESSES[entry.kind],
        "\n".join(entry.folders) if tab else entry.value,
        f"<span>{escape(entry.label)}</span>{where}{does}",
        class_name="ex-row",
        opens=tab,
        is_disabled=not entry.is_ready(),
    )
