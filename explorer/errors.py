"""The exceptions that the explorer raises on purpose.

Every message is one line for the user: the value, the limit and what would work. The command
line prints it unchanged and exits with `exit_status`.
"""

from __future__ import annotations

from typing import ClassVar


class ExplorerError(Exception):
    """Base class of every error that the explorer raises on purpose."""

    exit_status: ClassVar[int] = 2


class InputError(ExplorerError, ValueError):
    """A value of the wrong shape or type, not finite, or out of its range."""


class DesignError(InputError):
    """A design, or a design file, that describes no usable manipulator.

    Attributes:
        field: Name of the design file's field that is at fault, such as `limits.gap`, with which
            the message begins if it can; empty if there is none.
    """

    def __init__(self, message: str, field: str = "") -> None:
        super().__init__(message)
        self.field = field

    def message_about(self, subject: str) -> str:
        """Return the message with `subject` in place of the field's name."""
        return f"{subject}{str(self).removeprefix(self.field)}"


class StorageError(InputError):
    """A file or folder that cannot be read or written, for example on a full disk."""


class NoAnswerError(ExplorerError):
    """A well-posed question that has no answer, for example joints that do not close."""

    exit_status: ClassVar[int] = 1


class MissingExtraError(ExplorerError):
    """An optional dependency that is not installed; the message says how to install it."""


class ServerError(ExplorerError):
    """A local server that cannot start, for example because its port is in use."""
