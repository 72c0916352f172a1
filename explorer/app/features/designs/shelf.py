"""The user's named designs as the page has them: read and changed on a thread of their own.

Disks may be slow and full; neither holds up the mechanism. Other explorers may change the
same folder, so it is looked at again now and then.
"""

from __future__ import annotations

import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass

from explorer.app.session.jobs import LatestWins
from explorer.app.session.session import Session, Who
from explorer.app.state.actions import MarkSaved, Open
from explorer.app.storage.library import Deleted, Entry, Library, copy_name
from explorer.errors import ExplorerError, InputError
from explorer.mechanism.design import Design
from explorer.mechanism.design_file import PRESETS, decode_design

# Seconds between two looks at the folder.
LOOK_SECONDS = 1.0


@dataclass(frozen=True)
class _Order:
    work: Callable[[], object]
    who: Who


class Shelf:
    """Does what the page asks of the library, one after the other.

    Args:
        library: Of the user.
        session: Whose design is saved, and which is redrawn.
        complain: Called with a message for people and the client it is for.
    """

    def __init__(
        self, library: Library, session: Session, complain: Callable[[str, Who], None]
    ) -> None:
        self._library = library
        self._session = session
        self._complain = complain
        self._looked = 0.0
        self._stamp: int | None = None
        self.entries: tuple[Entry, ...] = ()
        self.deleted: tuple[Deleted, ...] = ()
        self._orders: LatestWins[_Order] = LatestWins(self._do_all, "designs")
        self.look()

    def look(self) -> None:
        """Read the folder again if it has changed; this returns at once."""
        now = time.monotonic()
        if now - self._looked < LOOK_SECONDS:
            return
        self._looked = now
        stamp = self._changed()
        if stamp != self._stamp:
            self._stamp = stamp
            self.refresh()

    def refresh(self) -> None:
        """Read the folder again."""
        self._order("look", lambda: None, None)

    def save(self, design: Design, who: Who = None) -> None:
        """Save a design under its name; what had that name and differs goes to the trash."""

        def work() -> None:
            if design.name in PRESETS:
                raise InputError(
                    f"{design.name!r} is a preset and stays as it is; give yours another name"
                )
            self._saved(self._library.save(design.name, design, replace=True))

        self._order(object(), work, who)

    def save_copy(self, design: Design, who: Who = None) -> None:
        """Save a design under a new name, which it has from then on."""
        self._order(object(), lambda: self._saved(self._copy(design)), who)

    def rename(self, old: str, new: str, who: Who = None) -> None:
        """Give a saved design another name."""

        def work() -> None:
            if old not in {entry.name for entry in self._library.list()}:
                raise InputError("the design is not saved yet, so no file has its name: Save it")
            self._saved(self._library.rename(old, new))

        self._order(object(), work, who)

    def open(self, name: str, who: Who = None) -> None:
        """Open a saved design."""
        self._order(object(), lambda: self._session.do(Open(self._library.open(name))), who)

    def copy(self, design: Design, who: Who = None) -> None:
        """Save a copy of a design under a new name; the live one stays as it is."""
        self._order(object(), lambda: self._copy(design), who)

    def duplicate(self, name: str, who: Who = None) -> None:
        """Save a saved design again under a new name."""
        self._order(object(), lambda: self._library.duplicate(name), who)

    def delete(self, name: str, who: Who = None) -> None:
        """Move a saved design to the trash."""
        self._order(object(), lambda: self._library.delete(name), who)

    def restore(self, who: Who = None) -> None:
        """Bring back what was deleted last."""

        def work() -> None:
            deleted = self._library.deleted()
            if not deleted:
                raise InputError("nothing has been deleted")
            taken = {entry.name for entry in self._library.list()}
            name = deleted[0].name
            self._library.restore(
                deleted[0].file, copy_name(name, taken) if name in taken else None
            )

        self._order(object(), work, who)

    def take(self, data: bytes, name: str, who: Who = None) -> None:
        """Open what was uploaded."""
        self._order(object(), lambda: self._session.do(Open(decode_design(data, name))), who)

    def wait_until_idle(self, timeout: float = 10.0) -> bool:
        """Wait until all is done; say whether it is."""
        return self._orders.wait_until_idle(timeout)

    def stop(self) -> None:
        """End the thread."""
        self._orders.stop()

    def _copy(self, design: Design) -> Design:
        taken = {entry.name for entry in self._library.list()} | set(PRESETS)
        return self._library.save(copy_name(design.name, taken), design)

    def _saved(self, design: Design) -> None:
        self._session.do(MarkSaved(design))

    def _order(self, key: object, work: Callable[[], object], who: Who) -> None:
        self._orders.post(key, time.monotonic(), _Order(work, who))

    def _do_all(self, orders: Sequence[_Order]) -> None:
        for order in orders:
            try:
                order.work()
            except ExplorerError as error:
                self._complain(str(error), order.who)
        self._stamp = self._changed()
        self.entries = self._library.list()
        self.deleted = self._library.deleted()
        self._session.redraw()

    def _changed(self) -> int | None:
        """Return what differs once a file was added, replaced or taken away."""
        try:
            return self._library.folder.stat().st_mtime_ns
        except OSError:
            return None
