"""The error for arguments that cannot be read, apart so that it costs no import of tyro."""

from __future__ import annotations

from explorer.errors import ExplorerError


class UsageError(ExplorerError):
    """Arguments that cannot be read.

    No ValueError, so that tyro lets it pass with its own words.

    Args:
        reason: What is wrong, in one line.
        program: The program or command whose arguments they are.
    """

    def __init__(self, reason: str, program: str = "explorer") -> None:
        super().__init__(reason)
        self.program = program
