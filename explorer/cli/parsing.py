"""Parsing of arguments: tyro reads the options, and this module writes the error messages.

tyro frames its messages in boxes of several lines; here a message becomes one line that ends
with the command for help. Misspelt options and commands are caught before tyro, with a
suggestion.
"""

from __future__ import annotations

import contextlib
import dataclasses
import difflib
import importlib
import io
import re
from collections.abc import Iterable, Sequence
from typing import Any, ClassVar, Protocol

import tyro

from explorer.cli.streams import write
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


_COLOUR = re.compile(r"\x1b\[[0-9;]*m")
_FRAME = "│╭╮╰╯─ "
_HELP = ("-h", "--help")


class Command(Protocol):
    """The interface of a command's dataclass."""

    __dataclass_fields__: ClassVar[dict[str, dataclasses.Field[Any]]]

    def run(self) -> None:
        """Run the command and write its answer to standard output."""
        ...


def load_command(name: str, known: Iterable[str]) -> type[Command]:
    """Import a command's module and return its dataclass."""
    if name not in known:
        hint = suggestion(name, known) or f"there are {', '.join(known)}"
        raise UsageError(f"no command {name!r} ({hint}); see explorer --help")
    module = importlib.import_module(f"explorer.cli.commands.{name}")
    return getattr(module, name.capitalize())


def parse(name: str, command: type[Command], argv: Sequence[str]) -> Command | None:
    """Return the command with its options set; None if the arguments ask for help."""
    program = f"explorer {name}"
    page, errors = io.StringIO(), io.StringIO()
    try:
        if not any(argument in _HELP for argument in argv):
            _check_options(command, argv)
        with contextlib.redirect_stdout(page), contextlib.redirect_stderr(errors):
            parsed, unread = tyro.cli(command, prog=program, args=argv, return_unknown_args=True)
        if not unread:
            return parsed
        reason = f"cannot make sense of {unread[0]!r}"
    except SystemExit as end:
        if not end.code:
            write("".join(f"{line.rstrip()}\n" for line in page.getvalue().splitlines()))
            return None
        reason = condense(errors.getvalue())
    except UsageError as error:
        reason = str(error)
    raise UsageError(f"{reason}; see {program} --help", program)


def condense(message: str) -> str:
    """Return the first sentence of tyro's framed message, as one line without the frame."""
    lines = [_COLOUR.sub("", line).strip() for line in message.strip().splitlines()]
    has_title = bool(lines) and lines[0].startswith("╭")
    sections: list[list[str]] = [[]]
    for line in lines:
        is_rule = line.startswith("╭") or not line.strip(_FRAME + "-")
        if not is_rule:
            sections[-1].append(line.strip(_FRAME))
        elif sections[-1]:
            sections.append([])
    sections = [section for section in sections if section]
    # Without line-drawing characters the title is a section of its own, over a rule.
    body = sections[min(len(sections) - 1, 0 if has_title else 1)] if sections else []
    text = " ".join(body)
    if text.startswith("Missing from"):
        options = [words.split()[0] for words in body if words.startswith("--")]
        return f"missing {', '.join(options)}" if options else "an option is missing"
    without_value = re.match(r"Missing value for argument '(--[a-z0-9-]+)'", text)
    if without_value:
        return f"{without_value[1]} needs a value"
    if not text:
        return "the arguments cannot be read"
    return text[0].lower() + text[1:].rstrip(".")


def suggestion(word: str, known: Iterable[str]) -> str | None:
    """Return "did you mean …?" with the most similar known word; None if none is similar."""
    close = difflib.get_close_matches(word, list(known), n=1)
    return f"did you mean {close[0]}?" if close else None


def _check_options(command: type[Command], argv: Sequence[str]) -> None:
    """Refuse options that the command lacks, and options given twice."""
    known = {"--help": "help"}
    for field in dataclasses.fields(command):
        # A field whose name Python reserves, such as from, ends in an underscore.
        option = field.name.rstrip("_").replace("_", "-")
        known[f"--{option}"] = field.name
        if isinstance(field.default, bool):
            known[f"--no-{option}"] = field.name
    given: dict[str, str] = {}
    for argument in argv:
        option = argument.partition("=")[0].replace("_", "-")
        if not option.startswith("--"):
            continue
        if option not in known:
            hint = suggestion(option, known)
            raise UsageError(f"no option {option}" + (f" ({hint})" if hint else ""))
        field = known[option]
        if given.get(field, option) != option:
            raise UsageError(f"{given[field]} and {option} contradict each other")
        if field in given:
            raise UsageError(f"{option} is given twice; give it once, with all its values")
        given[field] = option
