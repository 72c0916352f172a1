"""Text files of other editors open; a fault is told with its file, line and field."""

from __future__ import annotations

import copy
import json
import random
import re
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any, cast

import pytest
from fuzz import FULL, MACHINE
from refusals import refusal

from explorer import PRESETS, decode_design, encode_design, load_design
from explorer.files.json_text import LONGEST_LINE
from explorer.optimise.defaults import paper_problem
from explorer.optimise.outcome import (
    Outcome,
    Settings,
    decode_record,
    encode_record,
    load_record,
    record_of,
)
from explorer.optimise.solver import optimise_design
from explorer.sweep.study import STUDIES, decode_study, encode_study, load_study

DESIGN = PRESETS["paper-initial"]
STUDY = STUDIES["trade-off"]
FIELDS: dict[str, Any] = {**FULL, **MACHINE}
STUDY_FIELDS: dict[str, Any] = {
    "schema": 1,
    "name": "Größen",
    "design": FIELDS,
    "variables": {"a3x": [9, 10], "a3y": [4, 5], "reach": [30, 40]},
    "sampling": {"method": "grid", "count": {"a3x": 2, "a3y": 3, "reach": 2}},
    "measures": ["volume"],
    "objectives": [{"measure": "volume", "sense": "max"}, {"measure": "a3x", "sense": "min"}],
}
ENCODINGS = {
    "utf-8": b"",
    "utf-8-sig": b"",
    "utf-16-le": b"\xff\xfe",
    "utf-16-be": b"\xfe\xff",
    "utf-32-le": b"\xff\xfe\0\0",
}
MARK = "?!"
Steps = tuple[str | int, ...]
Decode = Callable[[bytes, str], object]


@pytest.fixture(scope="module")
def outcome() -> Outcome:
    return optimise_design(paper_problem(), iterations=2)


@pytest.mark.parametrize("encoding", ENCODINGS)
@pytest.mark.parametrize("marked", [True, False])
def test_file_in_any_unicode_encoding_opens(
    encoding: str, marked: bool, tmp_path: Path, outcome: Outcome
) -> None:
    def write(name: str, data: bytes) -> Path:
        path = tmp_path / name
        text = data.decode().replace("\n", "\r\n")
        path.write_bytes(ENCODINGS[encoding] * marked + text.encode(encoding))
        return path

    design = decode_design(json.dumps(FIELDS).encode(), "it")
    for each in (DESIGN, design):
        assert load_design(str(write("design.json", encode_design(each)))) == each
    assert load_study(write("study.json", encode_study(STUDY))) == STUDY
    record = record_of(outcome, Settings())
    assert load_record(write("a.record.json", encode_record(record))) == record


@pytest.mark.parametrize("decode", [decode_design, decode_study, decode_record])
@pytest.mark.parametrize(
    ("data", "words"),
    [
        ('{\n "schema": 1,\n "name": "Größe"}'.encode("latin-1"), "line 3: .* save .* UTF-8"),
        (b"\xff\xfe{\0\n\0\x00\xd8}\0", "line 2: .* save .* UTF-8"),
        (b"\xff\xfe{", "line 1: .* save .* UTF-8"),
        (b"\x89PNG\r\n\x1a\n\0\0", "line 1: .* save .* UTF-8"),
        (b"", "empty"),
        (b"\xef\xbb\xbf\r\n", "empty"),
    ],
)
def test_bytes_that_are_no_text_are_refused_in_a_sentence(
    decode: Decode, data: bytes, words: str
) -> None:
    assert re.match(f"it: .*{words}", refusal(decode, data, "it"))


def lay_out(fields: Any, rng: random.Random) -> str:
    """Return fields as a person or a program may have laid them out."""
    text = json.dumps(fields, indent=rng.choice([0, 2, "\t"]), ensure_ascii=rng.random() < 0.5)
    if rng.random() < 0.5:
        # Lists of numbers on one line, some fields too.
        text = re.sub(r",\n\s*(?=[-0-9n])", ", ", text)
    return "\n" * rng.randrange(3) + text.replace("\n", rng.choice(["\n", "\r\n", "\n\n"]))


def line_of(text: str, mark: str) -> int:
    assert text.count(mark) == 1
    return text[: text.index(mark)].count("\n") + 1


def values(fields: Any, path: Steps = ()) -> Iterator[tuple[Steps, Any]]:
    """Yield the path and the value of everything in a document."""
    yield path, fields
    if isinstance(fields, dict):
        steps: list[Any] = list(cast("dict[str, Any]", fields))
    else:
        steps = list(range(len(cast("list[Any]", fields)))) if isinstance(fields, list) else []
    for step in steps:
        yield from values(fields[step], (*path, step))


def path_text(path: Steps) -> str:
    return "".join(f"[{step}]" if isinstance(step, int) else f".{step}" for step in path)[1:]


def with_value(fields: Any, path: Steps, value: Any, name: str | None = None) -> Any:
    """Return a document with another value at a path, under another name if one is given."""
    copied = copy.deepcopy(fields)
    holder = copied
    for step in path[:-1]:
        holder = holder[step]
    if name is None:
        holder[path[-1]] = value
        return copied
    renamed = {name if key == path[-1] else key: each for key, each in holder.items()}
    holder.clear()
    holder.update(renamed)
    return copied


DOCUMENTS: list[tuple[Decode, dict[str, Any]]] = [
    (decode_design, FIELDS),
    (decode_design, FULL),
    (decode_study, STUDY_FIELDS),
]


@pytest.mark.parametrize(("decode", "fields"), DOCUMENTS)
@pytest.mark.parametrize("seed", range(2))
def test_value_of_wrong_type_is_named_with_its_line_and_path(
    decode: Decode, fields: dict[str, Any], seed: int
) -> None:
    rng = random.Random(seed)
    decode(lay_out(fields, rng).encode(), "mine.json")
    for path, value in values(fields):
        if path in ((), ("schema",), ("design",)):
            continue
        mark = 4_444_444.5 if isinstance(value, str) else MARK
        text = lay_out(with_value(fields, path, mark), rng)
        message = refusal(decode, text.encode(), "mine.json")
        line = line_of(text, str(mark))
        start = f"mine.json: line {line}: {path_text(path)}: expected "
        assert message.startswith(start) or "Invalid enum value" in message, message
        assert "$" not in message
        assert "`" not in message


@pytest.mark.parametrize(("decode", "fields"), DOCUMENTS)
def test_number_beyond_all_numbers_is_named_with_its_line_and_path(
    decode: Decode, fields: dict[str, Any]
) -> None:
    rng = random.Random(0)
    for path, value in values(fields):
        if not isinstance(value, int | float) or path == ("schema",):
            continue
        number = rng.choice(["1e400", "-1e400", "123.4E+999"])
        text = lay_out(with_value(fields, path, MARK), rng)
        line, text = line_of(text, MARK), text.replace(f'"{MARK}"', number)
        message = refusal(decode, text.encode(), "mine.json")
        start = f"mine.json: line {line}: {path_text(path)}: "
        assert message == f"{start}expected a finite number, got {number}", message


def test_first_of_several_large_numbers_is_the_one_that_is_named() -> None:
    text = '{"b2": 1,\n"b3": 1e401,\n"unit_mm": 1e402}'
    message = refusal(decode_design, text.encode(), "mine.json")
    assert message == "mine.json: line 2: b3: expected a finite number, got 1e401"


@pytest.mark.parametrize(("decode", "fields"), DOCUMENTS)
@pytest.mark.parametrize("seed", range(2))
def test_misspelt_field_is_named_with_its_line_and_the_nearest_name(
    decode: Decode, fields: dict[str, Any], seed: int
) -> None:
    rng = random.Random(seed)
    for path, value in values(fields):
        *outer, last = path or (0,)
        if (
            not isinstance(last, str)
            or last == "schema"
            or outer[-1:] in (["variables"], ["count"])
        ):
            continue
        name = last.replace("_", "") + rng.choice("_9q")
        if rng.random() < 0.3:
            name = name.upper()
        text = lay_out(with_value(fields, path, value, name), rng)
        message = refusal(decode, text.encode("utf-16"), "mine.json")
        line = line_of(text, f'"{name}":')
        place = f" in {path_text(tuple(outer))}" if outer else ""
        start = f"mine.json: line {line}: {name}{place} is unknown"
        assert message.startswith(start)
        # Short names are similar to several.
        assert len(last) < 3 or message == f"{start}, did you mean {last}?"


@pytest.mark.parametrize("decode", [decode_design, decode_study, decode_record])
def test_field_without_a_similar_name_is_reported_with_all_names(decode: Decode) -> None:
    message = refusal(decode, b'{\n\n"xyzzy": 1}', "it")
    assert message.startswith("it: line 3: xyzzy is unknown; there are schema, ")


@pytest.mark.parametrize("seed", range(15))
def test_text_that_is_no_json_is_reported_with_line_and_text(seed: int) -> None:
    rng = random.Random(seed)
    text = lay_out(FIELDS, rng)
    tokens = [match.start() for match in re.finditer(r'"[^"]*"|[\w.-]+|[^\s"]', text)]
    at = rng.choice(tokens)
    broken = f"{text[:at]}{MARK}{text[at:]}"
    message = refusal(decode_design, broken.encode(), "mine.json")
    line = line_of(broken, MARK)
    column = at - (broken.rfind("\n", 0, at) + 1) + 1
    assert message.startswith(f"mine.json: line {line}, column {column}: ")
    assert MARK in message


@pytest.mark.parametrize(
    ("field", "words"),
    [
        ('"unit_mm": 0', "unit_mm must be positive; got 0"),
        ('"limits": {"swing": {"b3": 1},\n"l1": [3, 2]}', "limits.l1: the minimum 3 exceeds"),
        ('"b3": 1', "degenerate design: b3 - b2 = 0"),
        ('"tolerances": {"a3": [0, 0, 0], "a1": [0, 0, 0]},\n"a3": [9, 0]', "degenerate design"),
        ('"home": {"position": [1, 1, 1],\n"quaternion": [0, 0, 0, 0]}', "quaternion must not"),
        ('"unit_mm": 4,\n"unit_mm": 5', "the field 'unit_mm' is given twice"),
    ],
)
def test_unusable_value_is_reported_with_its_line(field: str, words: str) -> None:
    rest = {"schema": 2, "a3": [9, 4], "b1": [4, -1], "b2": 1, "b3": 3}
    own = {name for name in rest if re.search(rf'(^|\n)"{name}"', field)}
    others = json.dumps({name: value for name, value in rest.items() if name not in own})
    text = f"{others[:-1]},\n\n{field}}}"
    message = refusal(decode_design, text.encode(), "mine.json")
    assert message.startswith(f"mine.json: line {3 + field.count(chr(10))}: {words}")


def test_unusable_range_of_a_study_is_reported_with_its_line() -> None:
    for path, value in (
        (("variables", "a3y"), [7, 6]),
        (("sampling", "count", "a3y"), 0),
        (("design", "limits", "gap"), -1),
        (("design", "unit_mm"), 0),
        (("nodes",), 0),
    ):
        fields = copy.deepcopy(STUDY_FIELDS)
        fields["nodes"] = 10
        text = json.dumps(with_value(fields, path, value), indent=1)
        broken = json.dumps(with_value(fields, path, MARK), indent=1)
        message = refusal(decode_study, text.encode(), "mine.json")
        # The field and its value may be on two lines.
        assert message.startswith(f"mine.json: line {line_of(broken, MARK)}: "), message


@pytest.mark.parametrize(
    "text",
    [
        '{"a3": NaN, "b3": ' + "[" * 90_000,
        '{"schema": 2, "limits": {"box": ' + "[" * 90_000,
        '{"schema": 2, "a3": [1, 2], "name": ' + '"x' * 200_000,
        '{"schema": 2, "' + "x" * 400_000 + '": 1}',
        '{"schema": 2, "a3": 1, "name": "' + '\\"' * 400_000,
        '{"schema": 2, "a3": 1, "name": [' + '"", ' * 200_000,
        '{"design": "' + "gap " * 200_000 + '", "variables": {"a3x": [1, 2]}, '
        '"sampling": {"count": 1}}',
        json.dumps({"variables": {f"a{k}": [1, 2] for k in range(10_000)} | {"b": [1]}}),
    ],
    ids=["number", "deep", "quotes", "name", "escapes", "list", "words", "variables"],
)
def test_file_that_is_deep_or_long_is_refused_in_a_line(text: str) -> None:
    for decode in (decode_design, decode_study):
        assert len(refusal(decode, text.encode(), "it")) <= LONGEST_LINE + 1
