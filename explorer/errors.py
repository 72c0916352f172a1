"""The exceptions that the explorer raises on purpose.

Every message is one line for a person: what was given, what is allowed, and what would
work. The command line prints it as it is and leaves with `exit_status`.
"""

from __future__ import annotations

from typing import ClassVar


class ExplorerError(Exception):
    """Root of every error that the explorer raises on purpose."""

    exit_status: ClassVar[int] = 2


class InputError(ExplorerError, ValueError):
    """A value that cannot be used: wrong shape, not finite, out of its range."""


class DesignError(InputError):
    """A design, or a design file, that describes no usable manipulator.

    Attributes:
        field: The field of a design file whose name the message begins with, such as
            `limits.gap`; empty where it begins with none.
    """

    def __init__(self, message: str, field: str = "") -> None:
        super().__init__(message)
        self.field = field

    def said_of(self, subject: str) -> str:
        """Return the message with another subject in the place of the field's name."""
        return f"{subject}{str(self).removeprefix(self.field)}"


class StorageError(InputError):
    """A file or folder that cannot be read or written, such as one on a full disk."""


class NoAnswerError(ExplorerError):
    """A well-posed question that has no answer, such as lengths that cannot close."""

    exit_status: ClassVar[int] = 1


class MissingExtraError(ExplorerError):
    """An optional dependency that is not installed; the message says how to get it."""


class ServerError(ExplorerError):
    """The local server could not start, for instance because the port is taken."""
