"""What an explorer uses of the user's data folder."""

from __future__ import annotations

from dataclasses import dataclass

from explorer.app.session.faults import FAULTS_FOLDER, Faults
from explorer.app.session.history import History
from explorer.app.storage.autosaver import Store
from explorer.app.storage.folder import data_folder
from explorer.app.storage.library import Library
from explorer.app.storage.session_file import SessionFile


@dataclass(frozen=True)
class UserData:
    """What an explorer uses of the user's data folder.

    Attributes:
        library: The named designs.
        store: Where the session is saved.
        history: History of the session to go on with; None to begin a new one.
        messages: Messages for people about files that could not be used.
        faults: Where requests are saved that failed unexpectedly; None to save none.
    """

    library: Library
    store: Store
    history: History | None = None
    messages: tuple[str, ...] = ()
    faults: Faults | None = None


def open_user_data(*, resume: bool) -> UserData:
    """Return what the user's data folder holds.

    Args:
        resume: Whether to go on with the newest session.
    """
    store, faults = SessionFile(), Faults(data_folder() / FAULTS_FOLDER)
    if not resume:
        return UserData(Library(), store, faults=faults)
    resumed = store.resume()
    return UserData(Library(), store, resumed.history, resumed.messages, faults)
