"""Strict reading of design files: schemas, repeated fields, names, and fuzzing."""

from __future__ import annotations

import json
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest
from fuzz import attempt, fuzzed

from explorer.errors import DesignError, InputError
from explorer.files.json_text import LONGEST_LINE
from explorer.mechanism import design_file
from explorer.mechanism.design_file import SCHEMA, decode_design, encode_design
from explorer.workspace.slices.volume import workspace_nodes, workspace_volume

PLAIN: dict[str, Any] = {"a3": [8, 5], "b1": [3, -2.5], "b2": 2, "b3": 5}

Migration = Callable[[dict[str, Any]], dict[str, Any]]


def refusal(data: bytes | dict[str, Any], source: str = "some.json") -> str:
    """Return the line with which a file is refused."""
    with pytest.raises(DesignError) as caught:
        decode_design(data if isinstance(data, bytes) else json.dumps(data).encode(), source)
    text = str(caught.value)
    assert len(text.splitlines()) == 1
    assert text.isprintable()
    assert len(text) <= LONGEST_LINE + 1
    return text


@pytest.fixture
def older_schemas(monkeypatch: pytest.MonkeyPatch) -> None:
    """Two schemas before the present one: b2 and b3 were called "b", then "bs"."""

    def from_the_first(fields: dict[str, Any]) -> dict[str, Any]:
        return {("bs" if name == "b" else name): value for name, value in fields.items()}

    def from_the_second(fields: dict[str, Any]) -> dict[str, Any]:
        b2, b3 = fields.pop("bs")
        return fields | {"b2": b2, "b3": b3}

    migrations: dict[int, Migration] = {SCHEMA - 2: from_the_first, SCHEMA - 1: from_the_second}
    monkeypatch.setattr(design_file, "MIGRATIONS", migrations)


@pytest.mark.usefixtures("older_schemas")
def test_files_of_older_schemas_open_as_the_present_one_does() -> None:
    now = decode_design(json.dumps(PLAIN | {"name": "mine"}).encode(), "now")
    older: dict[str, Any] = {"name": "mine", "a3": [8, 5], "b1": [3, -2.5]}
    first = older | {"schema": SCHEMA - 2, "b": [2, 5]}
    second = older | {"schema": SCHEMA - 1, "bs": [2, 5]}
    for fields in (first, second):
        found = decode_design(json.dumps(fields).encode(), "older")
        assert found == now
        # What is written is of the present schema.
        assert json.loads(encode_design(found))["schema"] == SCHEMA


@pytest.mark.usefixtures("older_schemas")
def test_files_of_older_schemas_are_read_as_strictly() -> None:
    older = {"schema": SCHEMA - 1, "a3": [8, 5], "b1": [3, -2.5], "bs": [2, 5]}
    assert "unknown field `c`" in refusal(older | {"c": 1})
    assert "b2" in refusal(older | {"bs": ["2", 5]})
    assert "degenerate" in refusal(older | {"bs": [2, 2]})
    assert "limits.gap" in refusal(older | {"limits": {"gap": -1}})
    twice = json.dumps(older)[:-1].encode() + b', "b1": [1, 1]}'
    assert "'b1' is given twice" in refusal(twice)
    # The names of one schema are unknown in another.
    assert "unknown field `bs`" in refusal(older | {"schema": SCHEMA})


@pytest.mark.parametrize("schema", [SCHEMA + 1, 10**6, 2**63])
def test_file_of_newer_schema_is_refused_and_says_so(schema: int) -> None:
    # Whatever else it holds.
    text = refusal(PLAIN | {"schema": schema, "hologram": {"x": [1]}})
    assert "newer explorer" in text
    assert f"up to {SCHEMA}" in text


@pytest.mark.parametrize("schema", [0, -1, 0.5, "1", None, True, [1], {"schema": 1}])
def test_file_of_impossible_schema_is_refused(schema: Any) -> None:
    assert "schema" in refusal(PLAIN | {"schema": schema})


def test_file_without_schema_is_of_the_first() -> None:
    assert decode_design(json.dumps(PLAIN).encode(), "x").schema == 1


@pytest.mark.parametrize(
    ("more", "name"),
    [
        (b'"b2": 3', "b2"),
        (b'"name": "x", "name": "x"', "name"),
        (b'"limits": {"gap": 1, "gap": 1}', "gap"),
        (b'"limits": {"swing": {"a1": 9, "b1": 1, "a1": 9}}', "a1"),
        (b'"home": {"position": [1, 2, 3], "quaternion": [1, 0, 0, 1], "position": [1, 2, 3]}',
         "position"),
        (b'"sche\\u006da": 1, "schema": 1', "schema"),
    ],
)  # fmt: skip
def test_field_given_twice_is_refused_at_every_level(more: bytes, name: str) -> None:
    text = refusal(json.dumps(PLAIN)[:-1].encode() + b", " + more + b"}")
    assert f"{name!r} is given twice" in text


@pytest.mark.parametrize("name", ["../../x", "/etc/passwd", "a/b", "C:\\x", "CON", ".", "", "ä 漢"])
def test_name_like_a_path_is_kept_as_text(
    name: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    design = decode_design(json.dumps(PLAIN | {"name": name}).encode(), name)
    assert design.name == name
    assert decode_design(encode_design(design), "again") == design
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize("name", ["a\nb", "\0", "\x7f", "\x1b[31m", "\u202ex", "\u2028", "x" * 101])
def test_name_that_is_no_printable_line_is_refused(name: str) -> None:
    assert "name must be one printable line" in refusal(PLAIN | {"name": name})


def test_message_that_quotes_a_file_is_short_and_printable() -> None:
    assert "unknown field" in refusal(PLAIN | {"x" * 100_000: 1})
    assert "unknown field" in refusal(PLAIN | {"\x1b[31m\u202e\n\x7f": 1})
    assert "unknown field" in refusal(PLAIN | {"x": 1}, "\x1b\n" + "file" * 50)


@pytest.mark.parametrize("w", [1e-308, 1e-200, 1e-17])
def test_home_with_lines_parallel_but_for_rounding_has_no_workspace(w: float) -> None:
    home = {"position": [5, 3, 5], "quaternion": [w, 1, w, -w]}
    design = decode_design(json.dumps(PLAIN | {"home": home}).encode(), "x")
    found = workspace_volume(design)
    assert found.volume == 0.0
    assert "margin δ2" in found.empty_because


@pytest.mark.parametrize("step", [5e-324, 1e-300, 1e-200])
def test_node_step_too_small_to_count_is_refused_on_one_line(step: float) -> None:
    limits = {"box": [[-1e39, -1e39, 0], [1e39, 1e39, 1e39]], "margin": None}
    design = decode_design(json.dumps(PLAIN | {"node_step": step, "limits": limits}).encode(), "x")
    with pytest.raises(InputError, match=r"^a node step of [^\n]*$"):
        workspace_nodes(design)


def test_fuzzed_files_are_opened_or_refused_with_one_line() -> None:
    opened = [attempt(fuzzed(number)) is not None for number in range(700)]
    assert 50 < sum(opened) < 600


def test_many_more_fuzzed_files_are_read_or_refused_with_one_line() -> None:
    read = 0
    for number in range(700, 4000):
        data = fuzzed(number)
        try:
            design = decode_design(data, "fuzz")
        except DesignError as error:
            text = str(error)
            assert text.isprintable()
            assert 0 < len(text) <= LONGEST_LINE + 1
            continue
        read += 1
        assert decode_design(encode_design(design), "again") == design
    assert 300 < read < 3000
