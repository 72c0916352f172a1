"""The session is kept while it goes on, and the next explorer goes on with it."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

from explorer.app.session.faults import FAULTS_FOLDER, Faults
from explorer.app.session.history import History, Step
from explorer.app.state.state import State
from explorer.app.storage.autosave import Autosave
from explorer.app.storage.autosaver import Autosaver, Store
from explorer.app.storage.document import Document, Kept, first_of
from explorer.app.storage.folder import data_folder
from explorer.app.storage.library import Library

# Steps that are kept, the nearest to the present one.
MOST_KEPT = 50


@dataclass(frozen=True)
class Keep:
    """What an explorer has of the user's data folder.

    Attributes:
        library: The named designs.
        store: Where the session is kept.
        left: The session to go on with; None to begin a new one.
        messages: For people, about files that could not be used.
        faults: Where requests are kept that failed unexpectedly; None to keep none.
    """

    library: Library
    store: Store
    left: Document | None = None
    messages: tuple[str, ...] = ()
    faults: Faults | None = None


def take_up(*, resume: bool) -> Keep:
    """Return what the user's data folder holds.

    Args:
        resume: Whether to go on with the session that was left last.
    """
    store, faults = Autosave(), Faults(data_folder() / FAULTS_FOLDER)
    if not resume:
        return Keep(Library(), store, faults=faults)
    found = store.adopt()
    return Keep(Library(), store, found.document, found.messages, faults)


def document_of(history: History) -> Document:
    """Return what is kept of a history: the step at hand and those around it."""
    steps = history.steps
    start = first_of(len(steps), history.at, MOST_KEPT)
    window = steps[start : start + MOST_KEPT]
    return Document(
        present=history.step.state,
        steps=tuple(Kept(step.words, step.state) for step in window),
        at=history.at - start,
        first=window[0].number,
    )


def history_of(document: Document) -> History | None:
    """Return the history that was kept; None if there are no steps in it."""
    if not document.steps:
        return None
    steps = tuple(
        Step(document.first + index, kept.words, kept.state)
        for index, kept in enumerate(document.steps)
    )
    return History(steps, document.at)


class Keeper:
    """Follows the session and has it saved.

    Args:
        store: Where to.
        tell: Called with one line for people when saving begins to fail or works again.
    """

    def __init__(self, store: Store, tell: Callable[[str], None]) -> None:
        self._saver = Autosaver(store, tell)
        self._last: History | None = None

    def follow(self, state: State, history: History) -> None:
        """Have a history saved that has changed.

        A search for a better design is no step before it ends: until then the file holds
        what was before it.
        """
        if history is not self._last and not state.optimisation.is_on:
            self._last = history
            self._saver.post(document_of(history))

    def flush(self) -> bool:
        """Save what waits now; say whether all is saved."""
        return self._saver.flush()

    def stop(self) -> None:
        """Save what waits, and let go of the file."""
        self._saver.stop()
