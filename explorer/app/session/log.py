"""The log of unexpected errors, a file in the user's data folder; without one, standard error."""

from __future__ import annotations

import contextlib
import logging
from logging.handlers import RotatingFileHandler
from pathlib import Path

from explorer.errors import StorageError
from explorer.files.writing import make_folder

NAME = "explorer.log"
# Size in bytes at which a new file is begun, and number of older ones that are kept.
LARGEST_LOG, OLDER_LOGS = 1_000_000, 2
# Largest number of characters of each argument's text.
MOST_TEXT = 2_000


def start_log(folder: Path) -> None:
    """Write all that is logged in this process into a file of a folder."""
    # Where the folder cannot be made, the first error to log is reported on standard error.
    with contextlib.suppress(StorageError):
        make_folder(folder)
    log = RotatingFileHandler(
        folder / NAME, maxBytes=LARGEST_LOG, backupCount=OLDER_LOGS, encoding="utf-8", delay=True
    )
    log.setFormatter(logging.Formatter("%(asctime)s %(name)s %(message)s"))
    logging.getLogger().addHandler(log)


def log_error(message: str, details: str, arguments: tuple[object, ...] = ()) -> str:
    """Log an unexpected error; return the message for people, with the place of the log.

    Args:
        message: The error in one line.
        details: Its traceback and what led to it.
        arguments: Arguments of the task in which it happened.
    """
    texts = [repr(each)[:MOST_TEXT] for each in arguments]
    logging.getLogger(__name__).error("%s", "\n".join((message, details, *texts)))
    logs = (log for log in logging.getLogger().handlers if isinstance(log, RotatingFileHandler))
    place = next((log.baseFilename for log in logs), None)
    return message if place is None else f"{message.removesuffix('.')}; the log is {place}"
