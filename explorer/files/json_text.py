"""Strict reading of JSON files: a fault is one line with the file, the line and the field.

A text is UTF-8, UTF-16 or UTF-32, with or without a byte order mark, as editors and shells write
it. Unknown and repeated fields are errors.
"""

from __future__ import annotations

import contextlib
import difflib
import json
import math
import re
from collections import Counter
from collections.abc import Generator, Iterator, Mapping
from types import EllipsisType
from typing import Any, Literal, NamedTuple, TypeVar, get_args, get_origin, get_type_hints

import msgspec

from explorer.errors import DesignError, InputError

T = TypeVar("T")

# Longest error message in characters.
LONGEST_LINE = 300
# Longest part of a file in a message, in characters.
_LONGEST_QUOTE = 60
# Bytes of a file that are searched for the names of fields.
_LONGEST_START = 1 << 17
# Fields that are nested deeper than any of ours are not looked for.
_DEEPEST = 16

# A text without its end is one token, so that texts of any kind take linear time.
_TOKEN = re.compile(r'"(?:[^"\\]+|\\.)*+"?|[{}\[\],:]|[^\s{}\[\],:"]+', re.DOTALL)

_Step = str | int | EllipsisType
_Path = tuple[_Step, ...]

# Types of JSON as msgspec calls them and in words, and by the first letter of a value.
_TYPES = {
    "float": "a number",
    "int": "a whole number",
    "str": "a text",
    "bool": "true or false",
    "array": "a list",
    "object": "fields in braces",
    "null": "null",
}
_TYPE_OF_LETTER = {'"': "str", "[": "array", "{": "object", "n": "null", "t": "bool", "f": "bool"}
# What msgspec says of a number with a power of ten beyond those of floats.
_TOO_LARGE = "Number out of range"


class _Place(NamedTuple):
    """A value in a text: the offset of it or of its field's name; it, or its opening bracket."""

    start: int
    mark: str


def decode_strictly(data: bytes, kind: type[T], source: str) -> T:
    """Return the value of a type, whose structs forbid unknown fields, that a JSON text holds.

    The text is in any encoding that `decode_text` knows; errors name its source.

    Raises:
        InputError: The text is not JSON or not of that type, or it gives a field twice.
    """
    with located_errors(data, kind, source) as text:
        value = msgspec.json.decode(text, type=kind)
        check_unique_fields(text)
        return value


def decode_text(data: bytes, other: str = "") -> str:
    """Return the text of a file in UTF-8, UTF-16 or UTF-32, without its byte order mark.

    Another encoding, if one is named, is that of bytes which are no UTF-8.

    Raises:
        InputError: The bytes are none of these, or there are none.
    """
    # JSON and tables begin with ASCII, in which the place of zeros shows the encoding.
    encoding = json.detect_encoding(data)
    try:
        text = data.decode(encoding)
    except UnicodeDecodeError as error:
        if other and encoding.startswith("utf-8"):
            return data.decode(other, "replace")
        line = _line_of(data[: error.start].decode(encoding, "ignore"))
        raise InputError(
            f"line {line}: the bytes are no text in {encoding.upper()}; save the file as UTF-8"
        ) from None
    if not text.strip():
        raise InputError("the file is empty or truncated")
    return text


def field_names(data: bytes) -> set[str | int | EllipsisType]:
    """Return the names of the outermost fields at the start of a text; none if it is no JSON."""
    start = data[:_LONGEST_START].decode(json.detect_encoding(data), "ignore")
    return {path[0] for path, _ in _places(start) if len(path) == 1}


def check_unique_fields(text: str) -> None:
    """Check that a text gives no field twice, since readers differ in which value they take.

    The text has been decoded once, so that its depth is known to be small.

    Raises:
        InputError: A field is given twice.
    """
    try:
        # As an integer, a number of thousands of digits would be refused.
        json.loads(text, object_pairs_hook=_unique_fields, parse_int=float)
    except InputError as error:
        seen: set[_Path] = set()
        for path, place in _places(text):
            if path in seen:
                raise InputError(f"line {_line_of(text[: place.start])}: {error}") from None
            seen.add(path)
        raise


@contextlib.contextmanager
def located_errors(
    data: bytes, kind: Any, source: str, error: type[InputError] = InputError
) -> Generator[str]:
    """Yield the text in some bytes, and raise every error of reading it with its place.

    The message is one printable line of limited length, which begins with the source; it names
    fields as the type of the value in the text has them.

    Raises:
        InputError: The text cannot be read; the error is of type `error`.
    """
    text = ""
    try:
        text = decode_text(data)
        yield text
    except RecursionError:
        raise error(one_line(f"{source}: the lists or fields are nested too deeply")) from None
    except msgspec.ValidationError as fault:
        raise error(one_line(f"{source}: {_words_of_refusal(fault, text, kind)}")) from None
    except msgspec.DecodeError as fault:
        raise error(one_line(f"{source}: {_words_of_syntax(fault, text)}")) from None
    except InputError as fault:
        field = _path_of(fault.field) if isinstance(fault, DesignError) else ()
        words = _at_line(str(fault), field, _first_places(text), text)
        raise error(one_line(f"{source}: {words}")) from None


def one_line(message: str) -> str:
    """Return a message as one printable line of limited length."""
    words = " ".join(message.split())
    line = "".join(letter if letter.isprintable() else "\ufffd" for letter in words[:LONGEST_LINE])
    return line if len(words) <= LONGEST_LINE else f"{line}…"


def _unique_fields(fields: list[tuple[str, object]]) -> dict[str, object]:
    unique = dict(fields)
    if len(unique) < len(fields):
        twice, _ = Counter(name for name, _ in fields).most_common(1)[0]
        raise InputError(f"the field {twice!r} is given twice; leave one of them out")
    return unique


def _line_of(text_before: str) -> int:
    return text_before.count("\n") + 1


def _words_of_syntax(fault: msgspec.DecodeError, text: str) -> str:
    """Return where a text is no JSON, the reason, and what stands there."""
    words = re.fullmatch(r"(.*) \(byte ([0-9]+)\)", str(fault))
    reason, start = "the text is truncated", len(text.rstrip())
    if words is not None:
        reason, start = words[1], len(text.encode()[: int(words[2])].decode(errors="ignore"))
    begin = text.rfind("\n", 0, start) + 1
    line, column = text[begin:].partition("\n")[0], start - begin
    quote = line[max(0, column - _LONGEST_QUOTE // 2) :][:_LONGEST_QUOTE].strip()
    return f"line {_line_of(text[:start])}, column {column + 1}: {reason}: {quote}"


def _first_places(text: str) -> dict[_Path, _Place]:
    """Return the first place of each value in a text, by its path."""
    places: dict[_Path, _Place] = {}
    for path, place in _places(text):
        places.setdefault(path, place)
    return places


def _words_of_refusal(fault: msgspec.ValidationError, text: str, kind: Any) -> str:
    """Return the line and the field of a value that its type refuses, and what is wrong."""
    words, places = str(fault), _first_places(text)
    at = re.search(r" - at (?:`key` in )?`\$([^`]*)`$", words)
    path = () if at is None else _path_of(at[1])
    words = words if at is None else words[: at.start()]
    unknown = re.fullmatch(r"Object contains unknown field `(.*)`", words, re.DOTALL)
    missing = re.fullmatch(r"Object missing required field `(.*)`", words)
    if isinstance(fault.__cause__, InputError):
        path = _path_in_words(fault.__cause__, places, path)
    elif unknown is not None:
        name, known = unknown[1][:_LONGEST_QUOTE], _allowed_at(kind, path)
        close = difflib.get_close_matches(name.lower(), known, n=1)
        hint = f", did you mean {close[0]}?" if close else f"; there are {', '.join(known)}"
        words = f"{name}{_path_text(path, ' in ')} is unknown{hint}"
        path = (*path, unknown[1])
    elif missing is not None:
        words = f"the field `{missing[1]}`{_path_text(path, ' of ')} is missing"
    else:
        path = _matching(places, path, words)
        if words == _TOO_LARGE and path in places:
            words = f"expected a finite number, got {places[path].mark[:_LONGEST_QUOTE]}"
        allowed = _allowed_at(kind, path) if words.startswith("Invalid enum value") else []
        words = re.sub(r"`([a-z]+(?: \| [a-z]+)*)`", _types_in_words, words)
        words = words.replace("Expected", "expected")
        words = f"{_path_text(path)}: {words}" if path else words
        words += f"; there are {', '.join(allowed)}" if allowed else ""
    return _at_line(words, path, places, text)


def _at_line(words: str, path: _Path, places: Mapping[_Path, _Place], text: str) -> str:
    """Return a message after the line of a field, if the text has the field."""
    is_known = path and path in places
    return f"line {_line_of(text[: places[path].start])}: {words}" if is_known else words


def _types_in_words(match: re.Match[str]) -> str:
    return " or ".join(_TYPES.get(each, each) for each in match[1].split(" | "))


def _path_of(written: str) -> _Path:
    """Return the path in a message such as ".box[0]" or "limits.box"; [...] is any field."""
    steps = re.findall(r"([^.\[\]]+)|\[([0-9]+|\.\.\.)\]", written)
    return tuple(name or (... if index == "..." else int(index)) for name, index in steps)


def _path_in_words(error: InputError, places: Mapping[_Path, _Place], outer: _Path) -> _Path:
    """Return the path of the field that a message names first, within an outer one."""
    named = error.field if isinstance(error, DesignError) and error.field else str(error)
    inner = [each for each in places if each[: len(outer)] == outer]
    for word in re.findall(r"[a-z]\w*(?:\.\w+)*", named[:LONGEST_LINE]):
        steps = tuple(word.split("."))
        like = [each for each in inner if each[-len(steps) :] == steps]
        if like:
            return min(like, key=len)
    return outer


def _path_text(path: _Path, before: str = "") -> str:
    """Return a path as its user writes it, such as limits.box[0][2]; `before` goes before one."""
    steps = (f".{step}" if isinstance(step, str) else f"[{step}]" for step in path)
    return before * bool(path) + "".join(steps).removeprefix(".")


def _places(text: str) -> Iterator[tuple[_Path, _Place]]:
    """Yield the path of each value and its place, in their order, up to the first fault."""
    keys: list[str | int] = []
    before, start = "", 0
    for token in _TOKEN.finditer(text):
        mark = token[0]
        if mark == ",":
            if keys and isinstance(keys[-1], int):
                keys[-1] += 1
        elif mark in ("]", "}"):
            if keys:
                keys.pop()
        elif mark != ":":
            if before in ("{", ",") and keys and isinstance(keys[-1], str):
                try:
                    keys[-1], start = str(json.loads(mark)), token.start()
                except ValueError:
                    return
            else:
                if len(keys) <= _DEEPEST:
                    yield tuple(keys), _Place(start if before == ":" else token.start(), mark)
                if mark in ("{", "["):
                    keys.append("" if mark == "{" else 0)
        before = mark


def _matching(places: Mapping[_Path, _Place], path: _Path, words: str) -> _Path:
    """Return the path of the value that msgspec refuses, which leaves names of some fields out."""
    if ... not in path:
        return path
    lengths = Counter(each[:-1] for each in places if each)
    for each, place in places.items():
        is_like = len(each) == len(path) and all(
            b is ... or a == b for a, b in zip(each, path, strict=True)
        )
        if is_like and _is_refused(place, lengths[each], words):
            return each
    return path[: path.index(...)]


def _is_refused(place: _Place, length: int, words: str) -> bool:
    """Return whether msgspec's words fit a value: its type, its size, or the length of a list."""
    if words == _TOO_LARGE:
        return _TYPE_OF_LETTER.get(place.mark[0]) is None and math.isinf(float(place.mark))
    got = re.search(r"got `([a-z]+)`$", words)
    if got is not None:
        own = _TYPE_OF_LETTER.get(place.mark[0], "number")
        return own == {"int": "number", "float": "number"}.get(got[1], got[1])
    right = re.search(r"of length ([0-9]+)$", words)
    return right is None or int(right[1]) != length


def _allowed_at(kind: Any, path: _Path) -> list[str]:
    """Return the fields or the words that the type of a value at a path allows."""
    parts = list(_alternatives(kind))
    for step in path:
        if isinstance(step, str):
            hints = (
                get_type_hints(each, include_extras=True) for each in parts if _is_struct(each)
            )
            inner = [hint[step] for hint in hints if step in hint]
            parts = [part for each in inner for part in _alternatives(each)]
    allowed: list[str] = []
    for part in parts:
        if _is_struct(part):
            allowed += part.__struct_encode_fields__
        elif get_origin(part) is Literal:
            allowed += map(str, get_args(part))
    return allowed


def _alternatives(kind: Any) -> Iterator[Any]:
    """Yield a type, and those of which it is a union or a container."""
    yield kind
    if get_origin(kind) is not Literal:
        for part in get_args(kind):
            yield from _alternatives(part)


def _is_struct(kind: Any) -> bool:
    return isinstance(kind, type) and issubclass(kind, msgspec.Struct)
