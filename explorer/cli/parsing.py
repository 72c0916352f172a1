"""Parsing of arguments: tyro reads the options, and this module writes the error messages.

tyro's messages have several lines; here a message becomes one line that ends with the command for
help. Misspelt options and commands, with a suggestion, and bad values are caught before tyro.
"""

from __future__ import annotations

import contextlib
import dataclasses
import difflib
import importlib
import io
import re
from collections.abc import Iterable, Sequence
from itertools import takewhile
from typing import Any, get_type_hints

import tyro
from tyro.constructors import PrimitiveConstructorSpec

from explorer.cli.streams import write
from explorer.cli.values import UsageError

_HELP = ("-h", "--help")
# Modules of the commands that have none of their own name.
_MODULES = {
    **dict.fromkeys(("inverse", "forward", "singularity"), "kinematics"),
    **dict.fromkeys(("forces", "accuracy", "budget"), "statics"),
    **dict.fromkeys(("path", "drives"), "paths"),
    **dict.fromkeys(("check", "find"), "requirement"),
    "orientation": "workspace",
    **dict.fromkeys(("serve", "report", "screenshot"), "page"),
}


def load_command(name: str, known: Iterable[str]) -> type[Any]:
    """Import a command's module and return its dataclass."""
    if name not in known:
        hint = suggestion(name, known) or f"there are {', '.join(known)}"
        raise UsageError(f"no command {name!r} ({hint}); see explorer --help")
    module = importlib.import_module(f"explorer.cli.commands.{_MODULES.get(name, name)}")
    return getattr(module, f"{name.capitalize()}Command")


def parse(name: str, command: type[Any], argv: Sequence[str]) -> Any:
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
    """Return the body of tyro's message, which rules part from title and advice, as one line."""
    sections = re.split(r"^ *-{3,} *$", message, flags=re.MULTILINE)
    body = [line.strip() for line in sections[min(len(sections) - 1, 1)].splitlines()]
    text = " ".join(filter(None, body))
    if text.startswith("Missing from"):
        options = [words.split()[0] for words in body if words.startswith("--") or words.isupper()]
        return f"missing {', '.join(options)}" if options else "an option is missing"
    without_value = re.match(r"Missing value for argument '(--[a-z0-9-]+)'", text)
    if without_value:
        return f"{without_value[1]} needs a value"
    return text[0].lower() + text[1:].rstrip(".") if text else "the arguments cannot be read"


def suggestion(word: str, known: Iterable[str]) -> str | None:
    """Return "did you mean …?" with the most similar known word; None if none is similar."""
    close = difflib.get_close_matches(word, list(known), n=1)
    return f"did you mean {close[0]}?" if close else None


def _check_options(command: type[Any], argv: Sequence[str]) -> None:
    """Refuse options that the command lacks, options given twice, and values of the wrong kind."""
    hints = get_type_hints(command, include_extras=True)
    known = {"--help": "help"}
    for field in dataclasses.fields(command):
        # A field whose name Python reserves, such as from, ends in an underscore.
        option = field.name.rstrip("_").replace("_", "-")
        known[f"--{option}"] = field.name
        if isinstance(field.default, bool):
            known[f"--no-{option}"] = field.name
    for part in (part for argument in argv for part in argument.partition("=")):
        if key := getattr(command, "moved", {}).get(part.replace("_", "-")):
            need = f"state {key} in a requirement file, and run explorer find NEED.json"
            raise UsageError(f"{part} asks for machines for a box of positions: {need}")
    given: dict[str, str] = {}
    words: dict[str, list[str]] = {}
    for index, argument in enumerate(argv):
        option, equals, value = argument.partition("=")
        option = option.replace("_", "-")
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
        after = takewhile(lambda word: not word.startswith("--"), argv[index + 1 :])
        words[field] = [value] if equals else [*after]
    for field, option in given.items():
        if blank := [word for word in words[field] if not word.strip()]:
            raise UsageError(f"{option} needs a value; got {blank[0]!r}")
        _check_value(option, hints.get(field), words[field])


def _check_value(option: str, hint: Any, words: list[str]) -> None:
    """Refuse words that are no value of an option; tyro says which value is missing."""
    for marker in getattr(hint, "__metadata__", ()):
        if isinstance(marker, PrimitiveConstructorSpec) and (words or marker.nargs == "*"):
            try:
                marker.instance_from_str(words if marker.nargs == "*" else words[:1])
            except UsageError as error:
                raise UsageError(f"{option}{error}") from None
