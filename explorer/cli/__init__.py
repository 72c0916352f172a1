"""The command line: `explorer COMMAND [options]`, one small module for each command.

A command is a frozen dataclass with a `run` method; its fields are its options. The table
below is all that is known of them until one is chosen, so that no command pays for what
another one imports.

The exit status is 0 (done), 1 (the question has no answer) or 2 (bad input). Whatever
goes wrong is one line on standard error, never a traceback.
"""

from __future__ import annotations

import os
import sys
from collections.abc import Mapping, Sequence

from explorer.cli import streams
from explorer.cli.usage import UsageError
from explorer.errors import ExplorerError

COMMANDS: Mapping[str, str] = {
    "serve": "Serve the explorer's page and open it in the browser (the default).",
    "inverse": "Find the joints of a pose.",
    "forward": "Find the eight assembly modes of the joints.",
    "singularity": "Tell how near a pose is to a singularity, and to which.",
    "interference": "Tell how far the legs keep from each other, in a pose or over a move.",
    "path": "Plan a path between two poses that keeps limits, margins and clearances.",
    "workspace": "Measure the workspace: exact volume and gradient, the paper's nodes, a mesh.",
    "optimise": "Look for the best design by SQP: a volume to match, the smallest reach or others.",
    "sweep": "Measure many designs as a study says, on every core or a cluster; tell the front.",
    "export": "Write the workspace as a mesh, the mechanism as parts or simulation, or the scene.",
    "report": "Write a report of a design: drawings, slices, tables, and how to make it again.",
    "screenshot": "Draw a pose into a PNG file.",
}
"""Each command's name, which is that of its module, and what it does."""

INTERNAL_ERROR = 70
INTERRUPTED = 130
BROKEN_PIPE = 141


def main() -> None:
    """Run the command that the process was started with, and exit."""
    status = run(sys.argv[1:])
    if status:
        sys.exit(status)


def run(argv: Sequence[str]) -> int:
    """Run a command line and return its exit status.

    Args:
        argv: The arguments after the name of the program.
    """
    try:
        streams.prepare()
        _dispatch(list(argv))
    except ExplorerError as error:
        program = error.program if isinstance(error, UsageError) else "explorer"
        streams.complain(f"{program}: {error}")
        return error.exit_status
    except KeyboardInterrupt:
        return INTERRUPTED
    except BrokenPipeError:
        return BROKEN_PIPE
    except Exception as error:  # noqa: BLE001 - the last resort: people get no traceback
        if os.environ.get("EXPLORER_DEBUG"):
            import traceback

            traceback.print_exc()
        streams.complain(
            f"explorer: unexpected {type(error).__name__}: {error}; please report this "
            "(EXPLORER_DEBUG=1 shows where it happened)"
        )
        return INTERNAL_ERROR
    return 0


def _dispatch(argv: list[str]) -> None:
    if argv and argv[0] in ("-h", "--help"):
        streams.write(_overview())
        return
    if argv and argv[0] == "--version":
        from explorer import __version__

        streams.write(f"explorer {__version__}\n")
        return
    if not argv or argv[0].startswith("-"):
        argv = ["serve", *argv]

    from explorer.cli.parsing import load_command, parse

    command = parse(argv[0], load_command(argv[0], COMMANDS), argv[1:])
    if command is not None:
        command.run()


def _overview() -> str:
    width = max(map(len, COMMANDS))
    listing = "\n".join(f"  {name:{width}}  {summary}" for name, summary in COMMANDS.items())
    return (
        "usage: explorer [COMMAND] [options]\n\n"
        "Design explorer of the flagged 4-4 parallel manipulator.\n\n"
        f"commands:\n{listing}\n\n"
        "options:\n"
        "  -h, --help  Show this help, or that of a command after its name.\n"
        "  --version   Show the version.\n\n"
        "Example: explorer inverse --position 10 5 9 --yaw-pitch-roll -73 0 0 --json\n"
    )
