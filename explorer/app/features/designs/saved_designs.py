"""The user's saved designs, read and changed on a thread of their own.

A slow or full disk thus does not hold up the mechanism. Other explorers may change the same
folder, so it is read again after each request.
"""

from __future__ import annotations

import itertools
import time
from collections.abc import Callable, Sequence
from typing import NamedTuple

from explorer.app.features.feature import Services
from explorer.app.session.latest import LatestWins
from explorer.app.session.session import Who
from explorer.app.state.actions import MarkSaved, Open
from explorer.app.storage.library import Entry, copy_name
from explorer.app.widgets.palette import Command
from explorer.errors import ExplorerError, InputError
from explorer.mechanism.design import Design
from explorer.mechanism.design_file import PRESETS, decode_design, encode_design

# Most saved designs that the palette offers, the last saved first; the panel lists all.
MOST_COMMANDS = 200


def send_design(services: Services, who: Who) -> None:
    """Send the live design to one browser, as a design file."""
    design = services.session.latest_state().design
    services.downloads.send(who, f"{design.name}.json", encode_design(design))


class _Request(NamedTuple):
    work: Callable[[], object]
    who: Who


class SavedDesigns:
    """Carries out the page's requests to the library, one after the other.

    Attributes:
        entries: The saved designs, the last saved first.
        commands: Those that open them.
        last_deleted: Name of the design that can be brought back; None if there is none.
    """

    def __init__(self, services: Services) -> None:
        if services.user_data is None:
            raise RuntimeError("a page that keeps nothing has no library")
        self._library = services.user_data.library
        self._session = services.session
        self._complain = services.complain
        self.entries: tuple[Entry, ...] = ()
        self.commands: tuple[Command, ...] = ()
        self.last_deleted: str | None = None
        self._requests: LatestWins[_Request] = LatestWins(self._do_all, "designs")
        services.at_end(self.stop)
        self.refresh()

    def find(self, name: str) -> Design | None:
        """Return the saved design with a name; None if there is none that can be used."""
        return next((each.design for each in self.entries if each.name == name), None)

    def refresh(self) -> None:
        """Request to read the folder again."""
        self._post(lambda: None, None)

    def save(self, design: Design, who: Who = None) -> None:
        """Save a design under its name; `restore` brings another one of that name back."""

        def work() -> None:
            if design.name in PRESETS:
                raise InputError(
                    f"{design.name!r} is a preset and stays as it is; give yours another name"
                )
            self._session.do(MarkSaved(self._library.save(design.name, design)))

        self._post(work, who)

    def save_copy(self, design: Design, who: Who = None) -> None:
        """Save the live design under a new name, which it takes itself."""
        self._post(lambda: self._session.do(MarkSaved(self._copy(design))), who)

    def rename(self, old: str, new: str, who: Who = None) -> None:
        """Give a saved design another name."""

        def work() -> None:
            if old not in {entry.name for entry in self._library.list()}:
                raise InputError("the design is not saved yet; save it before you rename it")
            self._session.do(MarkSaved(self._library.rename(old, new)))

        self._post(work, who)

    def open(self, name: str, who: Who = None) -> None:
        """Open a saved design."""
        self._post(lambda: self._session.do(Open(self._library.open(name))), who)

    def copy(self, design: Design, who: Who = None) -> None:
        """Save a copy of a design under a new name; the live one stays as it is."""
        self._post(lambda: self._copy(design), who)

    def delete(self, name: str, who: Who = None) -> None:
        """Delete a saved design; `restore` brings it back."""
        self._post(lambda: self._library.delete(name), who)

    def restore(self, who: Who = None) -> None:
        """Restore the design that was deleted or replaced last."""
        self._post(self._library.restore, who)

    def take(self, data: bytes, name: str, who: Who = None) -> None:
        """Open an uploaded design file."""
        self._post(lambda: self._session.do(Open(decode_design(data, name))), who)

    def wait_until_idle(self, timeout: float = 10.0) -> bool:
        """Wait until all requests are done; return whether they are."""
        return self._requests.wait_until_idle(timeout)

    def stop(self) -> None:
        """End the thread."""
        self._requests.stop()

    def _copy(self, design: Design) -> Design:
        taken = {entry.name for entry in self._library.list()} | set(PRESETS)
        return self._library.save(copy_name(design.name, taken), design)

    def _post(self, work: Callable[[], object], who: Who) -> None:
        self._requests.post(object(), time.monotonic(), _Request(work, who))

    def _do_all(self, requests: Sequence[_Request]) -> None:
        for request in requests:
            try:
                request.work()
            except ExplorerError as error:
                self._complain(str(error), request.who)
        self.entries = self._library.list()
        usable = (entry for entry in self.entries if entry.design is not None)
        self.commands = tuple(map(self._command, itertools.islice(usable, MOST_COMMANDS)))
        self.last_deleted = self._library.last_deleted
        self._session.redraw()

    def _command(self, entry: Entry) -> Command:
        return Command(
            f"Designs › Open {entry.name}",
            "Open this saved design.",
            lambda client: self.open(entry.name, client.client_id),
        )
