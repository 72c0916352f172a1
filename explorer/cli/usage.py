"""The error for invalid arguments, in a module of its own because it needs no import of tyro."""

from __future__ import annotations

from explorer.errors import ExplorerError


class UsageError(ExplorerError):
    """Invalid arguments.

    The class is no ValueError, so that tyro does not replace its message.

    Args:
        reason: Reason, in one line.
        program: Program or command that the arguments are for.
    """

    def __init__(self, reason: str, program: str = "explorer") -> None:
        super().__init__(reason)
        self.program = program
