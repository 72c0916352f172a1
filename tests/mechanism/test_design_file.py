"""Design files: each is opened as it was written, or refused with one line."""

from __future__ import annotations

import json
import math
from pathlib import Path
from typing import Any

import pytest
from drawn_designs import complete_designs
from fuzz import FULL, PLAIN, attempt, fuzzed
from hypothesis import given
from refusals import refusal

from explorer.errors import DesignError
from explorer.files.json_text import LONGEST_LINE
from explorer.mechanism.design import Design, Limits, Swing
from explorer.mechanism.design_file import (
    LARGEST_FILE,
    PRESETS,
    SCHEMA,
    decode_design,
    encode_design,
    load_design,
)
from explorer.mechanism.pose import Pose
from explorer.workspace.slices.volume import workspace_volume

PLAIN_TEXT = json.dumps(PLAIN).encode()
HOME = {"position": [1, 2, 3], "quaternion": [1, 0, 0, 0]}


def decode(fields: dict[str, Any]) -> Design:
    return decode_design(json.dumps(fields).encode(), "some.json")


def message_of(data: bytes | dict[str, Any], source: str = "some.json") -> str:
    """Return the message with which the contents of a file are refused."""
    text = data if isinstance(data, bytes) else json.dumps(data).encode()
    message = refusal(decode_design, text, source, kind=DesignError)
    assert source != "some.json" or message.startswith("some.json: ")
    assert len(message) <= LONGEST_LINE + 1
    return message


@pytest.mark.parametrize(
    ("fields", "words"),
    [
        ({"a3": [8, 0]}, "a3y = 0"),
        ({"b3": 2}, "b3 - b2 = 0"),
        ({"a3": [8, 1e-13]}, "degenerate"),
        ({"a3": [0, 1e-8], "b1": [0, 1e-8], "b2": 0, "b3": 1e-8}, "at least 1e-07 in size"),
        ({"a3": [0, 1.1e6]}, "a3 must not exceed 1e+06 in size; got 1100000"),
        *(({"a3": value}, "a3") for value in ([8], [8, 5, 0], 8)),
        *(({"b2": value}, "b2") for value in ("2", True, None, [2])),
        ({"a4": 1}, "a4 is unknown"),
        ({"limits": {"l2": [0, 1]}}, "l2 in limits is unknown"),
        ({"a\nb\r\u2028c": 1}, "is unknown"),
        ({"\x1b[31m\u202e\n\x7f": 1}, "is unknown"),
        *(({"schema": x}, "schema") for x in (0, -1, 0.5, "1", None, True, [1], {"schema": 1})),
        ({"name": 1}, "name"),
        *(
            ({"name": name}, "name must be one printable line")
            for name in (
                *("a\nb", "\0", "\x7f", "\x1b[31m", "\u202ex", "\u2028", "x" * 101),
                *("", "   ", "\u2003", ".", "..", " . "),
            )
        ),
        ({"unit_mm": 0}, "unit_mm must be positive"),
        ({"unit_mm": None}, "unit_mm"),
        ({"unit_mm": 1e7}, "unit_mm must not exceed 1e+06"),
        ({"unit_mm": 1e-8}, "unit_mm must be at least 1e-07"),
        ({"node_step": 0}, "node_step must be positive"),
        ({"required_box": [[0, 0, 0], [1, 1, -1]]}, "required_box z: the low end 0 exceeds"),
        ({"limits": None}, "limits"),
        ({"home": {"position": [1, 2, 3]}}, "quaternion"),
        ({"home": HOME | {"quaternion": [0, 0, 0, 0]}}, "quaternion must not be all zeros"),
        ({"home": HOME | {"quaternion": [1, 0, 0]}}, "quaternion"),
        ({"home": HOME | {"position": [1e300, 2, 3]}}, "position must not exceed"),
    ],
)
def test_file_with_unusable_field_is_refused_by_its_name(
    fields: dict[str, Any], words: str
) -> None:
    assert words in message_of(PLAIN | fields)


@pytest.mark.parametrize(
    ("limits", "words"),
    [
        ({"l1": [5, 1]}, "limits.l1"),
        ({"l1": [5.00000001, 5]}, "limits.l1: the minimum 5.00000001 exceeds the maximum 5"),
        ({"l1": 5.0}, "limits.l1"),
        ({"d2": [-1, 1]}, "limits.d2 minimum"),
        ({"d2": [1, 2, 3]}, "limits.d2"),
        ({"l4": [None, 1]}, "limits.l4"),
        *(({"guide": guide}, "limits.guide") for guide in ([5, 1], [1, 2, 3], 5.0)),
        *(({"gap": gap}, "limits.gap") for gap in (-1, None, "wide", 1e41)),
        ({"box": [[0, 9, 0], [1, 1, 1]]}, "limits.box y"),
        ({"guide": [1.00000001, 1]}, "limits.guide: the low end 1.00000001 exceeds the high"),
        ({"box": [0, 0, 0, 1, 1, 1]}, "limits.box"),
        *(({"box": [low, [1, 1]]}, "limits.box") for low in ([0, 0], [0, 0, 0])),
        ({"margin": -1}, "limits.margin"),
        *(({"leg_radii": radii}, "limits.leg_radii") for radii in ([1, 1, 1], [1, 1, 1, -1], 0.5)),
    ],
)  # fmt: skip
def test_unusable_limit_is_refused_in_a_file_and_in_python(
    limits: dict[str, Any], words: str
) -> None:
    assert words in message_of(PLAIN | {"limits": limits})
    assert refusal(lambda: Limits(**limits), kind=DesignError).startswith(words)


@pytest.mark.parametrize(
    "data",
    [
        *(b"", b" \n\t ", b"[]", b"null", b"3", b'"paper-initial"', b"a3 = [8, 5]"),
        *(json.dumps(PLAIN | {"b2": odd}).encode() for odd in (math.nan, math.inf)),
        *(PLAIN_TEXT.replace(b"8", digits) for digits in (b"1e999", b"9" * 400, b"9" * 9000)),
        json.dumps(PLAIN | {"name": "ÿ"}, ensure_ascii=False).encode("latin-1"),
        b'{"name": "\\ud800"}',
        *(PLAIN_TEXT + more for more in (b"x", PLAIN_TEXT, b"\0")),
        *(b"[" * 100_000, b'{"limits":' * 50_000, b'{"a":' * 50_000 + b"1" + b"}" * 50_000),
        PLAIN_TEXT[:-1] + b', "limits": {"box": ' + b"[" * 90_000,
        b" " * (LARGEST_FILE + 1),
    ],
    ids=lambda data: repr(data[:12]),
)
def test_bytes_that_hold_no_design_are_refused(data: bytes, tmp_path: Path) -> None:
    message_of(data)
    path = tmp_path / "file.json"
    path.write_bytes(data)
    assert str(path)[:100] in refusal(load_design, str(path), kind=DesignError)


def test_truncated_file_is_refused_at_every_length() -> None:
    data = json.dumps(FULL).encode()
    decode_design(data, "whole")
    for length in range(len(data)):
        message_of(data[:length], "a\nb\rc\u2028d\x1b" + "file" * 20)


@pytest.mark.parametrize("field", PLAIN)
def test_file_without_a_variable_is_refused_by_its_name(field: str) -> None:
    assert field in message_of({key: value for key, value in PLAIN.items() if key != field})


@pytest.mark.parametrize("name", ["", ".", "no\nsuch", "nul\0l", "x" * 5000, "~", "nowhere.json"])
def test_file_name_that_cannot_be_opened_is_refused(name: str) -> None:
    with pytest.raises(DesignError) as caught:
        load_design(name)
    (line,) = str(caught.value).splitlines()
    assert name != "nowhere.json" or all(preset in line for preset in PRESETS)


def test_file_read_has_every_field_or_its_default() -> None:
    numbers: dict[str, Any] = {"a3": (8.0, 5.0), "b1": (3.0, -2.5), "b2": 2.0, "b3": 5.0}
    assert decode(PLAIN) == Design(**numbers)
    limits = Limits(
        l1=(1.0, 20.0),
        d4=(0.5, 18.0),
        guide=(-3.0, 12.0),
        gap=0.25,
        box=((0.0, -12.0, 0.0), (20.0, 22.0, 18.0)),
        margin=0.1,
        leg_radii=(0.1, 0.2, 0.3, 0.4),
        swing=Swing(a1=40.0, b2=90.0),
    )
    home = Pose((5.0, 3.0, 5.0), (0.8, 0.1, 0.2, -0.5))
    extra: dict[str, Any] = {"name": "Großer Entwurf", "unit_mm": 2.5, "node_step": 0.5}
    assert decode(FULL) == Design(**numbers, **extra, limits=limits, home=home)


@given(complete_designs())
def test_design_written_and_read_keeps_every_bit(
    tmp_path_factory: pytest.TempPathFactory, design: Design
) -> None:
    data = encode_design(design)
    path = tmp_path_factory.mktemp("designs") / "one.json"
    path.write_bytes(data)
    again = load_design(str(path))
    assert again == decode_design(data, "bytes") == design
    assert encode_design(again) == data


@pytest.mark.parametrize("schema", [0, SCHEMA + 1, 10**6])
def test_file_of_another_schema_is_refused_in_one_sentence_whatever_it_holds(schema: int) -> None:
    text = message_of(PLAIN | {"schema": schema, "hologram": {"x": [1]}})
    assert f"has schema {schema}, of another version of the explorer" in text
    assert text.endswith("this one reads schemas 1 and 2")


def test_file_of_the_first_schema_or_without_one_opens_as_the_present_one_does() -> None:
    design = decode(PLAIN | {"schema": SCHEMA})
    assert decode(PLAIN) == decode(PLAIN | {"schema": 1}) == design
    assert json.loads(encode_design(design))["schema"] == SCHEMA
    assert decode(PLAIN | {"tool": {"position": [1, 2, 3]}}).tool.position == (1.0, 2.0, 3.0)


@pytest.mark.parametrize(
    ("more", "name"),
    [
        (b'"b2": 3', "b2"),
        (b'"name": "x", "name": "x"', "name"),
        (b'"limits": {"gap": 1, "gap": 1}', "gap"),
        (b'"limits": {"swing": {"a1": 9, "b1": 1, "a1": 9}}', "a1"),
        (b'"home": {"position": [1, 2, 3], "quaternion": [1, 0, 0, 1], "position": [1, 2, 3]}',
         "position"),
        (b'"sche\\u006da": 2, "schema": 2', "schema"),
    ],
)  # fmt: skip
def test_field_given_twice_is_refused_at_every_level(more: bytes, name: str) -> None:
    assert f"{name!r} is given twice" in message_of(PLAIN_TEXT[:-1] + b", " + more + b"}")


def test_home_with_lines_parallel_but_for_rounding_has_no_workspace() -> None:
    home = {"position": [5, 3, 5], "quaternion": [1e-17, 1, 1e-17, -1e-17]}
    result = workspace_volume(decode(PLAIN | {"home": home}))
    assert result.volume == 0.0
    assert "margin δ2" in result.empty_because


@pytest.mark.parametrize(
    ("first", "count"),
    [(0, 150), pytest.param(150, 3850, marks=[pytest.mark.long, pytest.mark.timeout(1800)])],
)
def test_fuzzed_files_are_opened_or_refused_with_one_line(first: int, count: int) -> None:
    usable = [attempt(fuzzed(number)) is not None for number in range(first, first + count)]
    assert 0.07 * count < sum(usable) < 0.9 * count
