"""The command line: `explorer COMMAND [options]`.

A command is a frozen dataclass with a `run` method; its fields are its options. Only the
module of the chosen command is imported, so that no command waits for the imports of another.

The exit status is 0 (done), 1 (the question has no answer, or a part of the answer could not be
written) or 2 (bad input). An error is one line on standard error, never a traceback. With `--json`
standard output has one object, or with status 2 nothing.
"""

from __future__ import annotations

import json
import os
import sys
from collections.abc import Mapping, Sequence

from explorer.cli import streams
from explorer.errors import ExplorerError, NoAnswerError

COMMANDS: Mapping[str, str] = {
    "serve": "Serve the explorer's page and open it in the browser (the default).",
    "inverse": "Compute the joints of a pose, or of a table of poses.",
    "forward": "Compute the eight assembly modes of the joints, or of a table of joints.",
    "singularity": "Measure how near a pose is to a singularity, and to which.",
    "forces": "Compute the forces of actuators and struts under a load, and their limits.",
    "accuracy": "Compute the errors and the deflection of the tool in a pose.",
    "budget": "Rank what tolerances cost in precision; find those of a wanted precision.",
    "interference": "Measure the clearances of the legs, in a pose or over a move.",
    "path": "Plan a path between two poses within limits, margins and clearances.",
    "drives": "Compute speeds, forces and powers of the actuators along a path; one motor for all.",
    "workspace": "Measure the workspace: exact volume and gradient, the paper's nodes, a mesh.",
    "orientation": "Measure the orientations of a position: share of all, greatest tilts, torsion.",
    "reproduce": "Measure the claims of the paper again, and judge each.",
    "check": "Check a design against a requirement: each demand, its worst value and pose.",
    "find": "Find designs that keep a requirement, each of another kind, the preferred one first.",
    "optimise": "Optimise a design by SQP: match a volume, shorten the legs, or raise the volume.",
    "sweep": "Measure the designs of a study, on every core or a cluster; list the Pareto front.",
    "calibrate": "Identify the machine that was built, or choose the poses in which to measure it.",
    "export": "Write workspace, parts, models, pages, a figure or code for controllers as files.",
    "report": "Write a report of a design: drawings, slices, tables, and how to reproduce it.",
    "screenshot": "Draw a pose into a PNG file.",
}
"""The summary of each command by its name."""

INTERNAL_ERROR = 70
INTERRUPTED = 130
BROKEN_PIPE = 141


def main() -> None:
    """Run the command that the process was started with, and exit."""
    status = run(sys.argv[1:])
    if status:
        sys.exit(status)


def run(argv: Sequence[str]) -> int:
    """Run a command line, given after the program's name, and return its exit status."""
    try:
        streams.prepare()
        _dispatch(list(argv))
    except ExplorerError as error:
        # Of a `UsageError`, whose module needs tyro.
        program = getattr(error, "program", "explorer")
        streams.write_error(f"{program}: {error}")
        return error.exit_status
    except KeyboardInterrupt:
        return INTERRUPTED
    except BrokenPipeError:
        return BROKEN_PIPE
    except Exception as error:  # noqa: BLE001 - the last resort: users get no traceback
        if os.environ.get("EXPLORER_DEBUG"):
            import traceback

            traceback.print_exc()
        streams.write_error(
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
    if command is None:
        return
    try:
        command.run()
    except ExplorerError as error:
        is_asked = getattr(command, "json", False) and not streams.answered.get()
        if is_asked and error.exit_status == NoAnswerError.exit_status:
            streams.write(json.dumps({"message": str(error)}) + "\n")
        raise


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
