"""Designs and their files: every input is usable or refused with one line."""

from __future__ import annotations

import json
import math
from collections.abc import Callable
from pathlib import Path
from typing import Any, cast

import msgspec
import numpy as np
import pytest
from hypothesis import given, strategies as st
from strategies import designs

from explorer import (
    JOINTS,
    PRESETS,
    VARIABLES,
    Design,
    DesignError,
    Limits,
    Pose,
    decode_design,
    encode_design,
    evaluate,
    home_pose,
    load_design,
    margins,
)
from explorer.mechanism.design import LENGTHS
from explorer.mechanism.design_file import LARGEST_FILE
from explorer.numerics.checks import LARGEST_NUMBER

NUMBERS: dict[str, Any] = {"a3": (8.0, 5.0), "b1": (3.0, -2.5), "b2": 2.0, "b3": 5.0}
SMALLEST: dict[str, Any] = {"a3": [8, 5], "b1": [3, -2.5], "b2": 2, "b3": 5}
FULL: dict[str, Any] = {
    "schema": 1,
    "name": "full",
    "unit_mm": 2.5,
    "node_step": 0.5,
    **SMALLEST,
    "limits": {
        "l1": [1, 20],
        "d2": [0, None],
        "d4": [0.5, 18],
        "l4": [0, None],
        "guide": [-3, 12],
        "gap": 0.25,
        "box": [[0, -12, 0], [20, 22, 18]],
        "margin": None,
        "leg_radii": [0.1, 0.2, 0.3, 0.4],
    },
    "home": {"position": [5, 3, 5], "quaternion": [0.8, 0.1, 0.2, -0.5]},
}


def changed(**fields: Any) -> dict[str, Any]:
    return {**SMALLEST, **fields}


def decoded(value: Any) -> Design:
    return decode_design(json.dumps(value).encode(), "some.json")


def message_of(action: Callable[[], object]) -> str:
    """Return the message with which the action is refused, known to be one line."""
    with pytest.raises(DesignError) as caught:
        action()
    text = str(caught.value)
    assert len(text.splitlines()) == 1
    assert text.strip() == text
    return text


# Contents of files, and words of the message with which each is refused.
BAD_FIELDS: dict[str, tuple[dict[str, Any], str]] = {
    "a3y zero": (changed(a3=[8, 0]), "a3y = 0"),
    "b1y zero": (changed(b1=[3, 0]), "b1y = 0"),
    "b2 is b3": (changed(b3=2), "b3 - b2 = 0"),
    "a3y all but zero": (changed(a3=[8, 1e-13]), "degenerate"),
    "all zero": (changed(a3=[0, 0], b1=[0, 0], b2=0, b3=0), "largest design variable"),
    "too small": (changed(a3=[0, 1e-31], b1=[0, 1e-31], b2=0, b3=1e-31), "largest design"),
    "too large": (changed(a3=[0, 1e31]), "largest design variable"),
    "one number": (changed(a3=[8]), "a3"),
    "three numbers": (changed(a3=[8, 5, 0]), "a3"),
    "no list": (changed(a3=8), "a3"),
    "text for a number": (changed(b2="2"), "b2"),
    "true for a number": (changed(b2=True), "b2"),
    "null for a number": (changed(b2=None), "b2"),
    "list for a number": (changed(b2=[2]), "b2"),
    "unknown field": (changed(a4=1), "unknown field `a4`"),
    "unknown field of limits": (changed(limits={"l2": [0, 1]}), "unknown field `l2`"),
    "unknown field of home": (
        changed(home={"position": [1, 2, 3], "quaternion": [1, 0, 0, 0], "yaw": 0}),
        "unknown field `yaw`",
    ),
    "unknown field with a line break": (changed(**{"a\nb\r\u2028c": 1}), "unknown field"),
    "missing field": ({"a3": [8, 5], "b1": [3, 1], "b2": 1}, "b3"),
    "schema of the future": (changed(schema=2), "schema"),
    "schema as text": (changed(schema="1"), "schema"),
    "schema null": (changed(schema=None), "schema"),
    "name a number": (changed(name=1), "name"),
    "unit zero": (changed(unit_mm=0), "unit_mm must be positive"),
    "unit negative": (changed(unit_mm=-1), "unit_mm must be positive"),
    "unit null": (changed(unit_mm=None), "unit_mm"),
    "step zero": (changed(node_step=0), "node_step must be positive"),
    "limits null": (changed(limits=None), "limits"),
    "limits a list": (changed(limits=[]), "limits"),
    "length reversed": (changed(limits={"l1": [5, 1]}), "limits.l1"),
    "length negative": (changed(limits={"d2": [-1, 1]}), "limits.d2 minimum"),
    "length of one": (changed(limits={"d4": [1]}), "limits.d4"),
    "length minimum null": (changed(limits={"l4": [None, 1]}), "limits.l4"),
    "guide reversed": (changed(limits={"guide": [5, 1]}), "limits.guide"),
    "guide of three": (changed(limits={"guide": [1, 2, 3]}), "limits.guide"),
    "gap negative": (changed(limits={"gap": -1}), "limits.gap"),
    "gap null": (changed(limits={"gap": None}), "limits.gap"),
    "box reversed": (changed(limits={"box": [[0, 9, 0], [1, 1, 1]]}), "limits.box y"),
    "box flat list": (changed(limits={"box": [0, 0, 0, 1, 1, 1]}), "limits.box"),
    "box of two": (changed(limits={"box": [[0, 0], [1, 1]]}), "limits.box"),
    "margin negative": (changed(limits={"margin": -1}), "limits.margin"),
    "radii of three": (changed(limits={"leg_radii": [1, 1, 1]}), "limits.leg_radii"),
    "radius negative": (changed(limits={"leg_radii": [1, 1, 1, -1]}), "limits.leg_radii"),
    "limit beyond all": (changed(limits={"gap": 1e41}), "limits.gap"),
    "home without rotation": (changed(home={"position": [1, 2, 3]}), "quaternion"),
    "home of zeros": (
        changed(home={"position": [1, 2, 3], "quaternion": [0, 0, 0, 0]}),
        "quaternion must not be all zeros",
    ),
    "home of three": (changed(home={"position": [1, 2, 3], "quaternion": [1, 0, 0]}), "quat"),
    "home beyond all": (
        changed(home={"position": [1e300, 2, 3], "quaternion": [1, 0, 0, 0]}),
        "position must not exceed",
    ),
}

BAD_BYTES: dict[str, bytes] = {
    "empty": b"",
    "blank": b" \n\t ",
    "no object": b"[]",
    "null": b"null",
    "number": b"3",
    "text": b'"paper-initial"',
    "not JSON": b"a3 = [8, 5]",
    "not a number": json.dumps(changed(b2=math.nan)).encode(),
    "infinite": json.dumps(changed(b2=math.inf)).encode(),
    "overflowing": json.dumps(SMALLEST).replace("8", "1e999").encode(),
    "integer of 400 digits": json.dumps(SMALLEST).replace("8", "9" * 400).encode(),
    "integer of 9000 digits": json.dumps(SMALLEST).replace("8", "9" * 9000).encode(),
    "latin-1": json.dumps(changed(name="ÿ"), ensure_ascii=False).encode("latin-1"),
    "utf-16": json.dumps(SMALLEST).encode("utf-16"),
    "byte order mark": b"\xef\xbb\xbf" + json.dumps(SMALLEST).encode(),
    "lone surrogate": b'{"name": "\\ud800"}',
    "trailing text": json.dumps(SMALLEST).encode() + b"x",
    "two objects": json.dumps(SMALLEST).encode() * 2,
    "trailing zero byte": json.dumps(SMALLEST).encode() + b"\0",
    "deep lists": b"[" * 100_000,
    "deep objects": b'{"limits":' * 50_000,
    "deep in a limit": json.dumps(SMALLEST)[:-1].encode() + b', "limits": {"box": ' + b"[" * 90_000,
    "deep in an unknown field": b'{"a":' * 50_000 + b"1" + b"}" * 50_000,
    "too long": b" " * (LARGEST_FILE + 1),
}


@pytest.mark.parametrize("kind", list(BAD_FIELDS))
def test_a_file_with_bad_fields_is_refused_on_one_line_that_names_the_field(kind: str) -> None:
    value, words = BAD_FIELDS[kind]
    text = message_of(lambda: decoded(value))
    assert text.startswith("some.json: ")
    assert words in text


@pytest.mark.parametrize("kind", list(BAD_BYTES))
def test_bytes_that_hold_no_design_are_refused_on_one_line(kind: str) -> None:
    text = message_of(lambda: decode_design(BAD_BYTES[kind], "some.json"))
    assert text.startswith("some.json: ")


def test_every_truncation_of_a_file_is_refused() -> None:
    data = json.dumps(FULL).encode()
    decode_design(data, "whole")
    for length in range(len(data)):
        message_of(lambda length=length: decode_design(data[:length], "cut"))


@pytest.mark.parametrize("field", ["a3", "b1", "b2", "b3"])
def test_every_variable_is_required(field: str) -> None:
    value = {key: entry for key, entry in SMALLEST.items() if key != field}
    assert field in message_of(lambda: decoded(value))


def test_a_message_stays_on_one_line_whatever_the_file_is_called() -> None:
    message_of(lambda: decode_design(b"{", "a\nb\rc\u2028d"))


def test_a_missing_file_is_refused_with_the_presets(tmp_path: Path) -> None:
    text = message_of(lambda: load_design(str(tmp_path / "nowhere.json")))
    assert all(name in text for name in PRESETS)


@pytest.mark.parametrize("name", ["", ".", "no\nsuch", "nul\0l", "x" * 5000, "~"])
def test_file_names_that_cannot_be_opened_are_refused(name: str) -> None:
    message_of(lambda: load_design(name))


def test_a_directory_is_refused(tmp_path: Path) -> None:
    assert "cannot read" in message_of(lambda: load_design(str(tmp_path)))


def test_a_file_without_end_is_refused(tmp_path: Path) -> None:
    path = tmp_path / "long.json"
    path.write_bytes(b" " * (10 * LARGEST_FILE))
    assert "no design file" in message_of(lambda: load_design(str(path)))


def test_a_file_that_is_not_utf8_is_refused(tmp_path: Path) -> None:
    path = tmp_path / "latin.json"
    path.write_bytes(BAD_BYTES["latin-1"])
    assert str(path) in message_of(lambda: load_design(str(path)))


HUGE = 10**5000

BAD_ARGUMENTS: dict[str, dict[str, Any]] = {
    "not a number": {"b2": math.nan},
    "infinite": {"a3": (math.inf, 1.0)},
    "negative infinite": {"b1": (1.0, -math.inf)},
    "huge integer": {"b2": HUGE},
    "huge integer in a pair": {"a3": (HUGE, 1.0)},
    "huge integer for a pair": {"a3": HUGE},
    "text": {"b2": "2.0"},
    "text with line breaks": {"b2": "2\n3"},
    "digits for a pair": {"a3": "12"},
    "bytes for a pair": {"a3": b"12"},
    "set for a pair": {"a3": {1.0, 2.0}},
    "mapping for a pair": {"a3": {1.0: 2.0, 3.0: 4.0}},
    "none": {"b3": None},
    "bool": {"b3": True},
    "complex": {"b3": 1j},
    "object": {"b3": object()},
    "matrix for a pair": {"a3": np.zeros((3, 3))},
    "matrix of pairs": {"a3": np.zeros((2, 2))},
    "vector for a number": {"b2": np.zeros(2)},
    "empty pair": {"a3": ()},
    "name": {"name": 5},
    "schema": {"schema": 2},
    "limits": {"limits": None},
    "limits of a dict": {"limits": {"gap": 1}},
    "home": {"home": "home"},
}


@pytest.mark.parametrize("kind", list(BAD_ARGUMENTS))
def test_bad_arguments_are_refused_on_one_short_line(kind: str) -> None:
    text = message_of(lambda: Design(**{**NUMBERS, **BAD_ARGUMENTS[kind]}))
    assert len(text) < 300


BAD_LIMITS: dict[str, dict[str, Any]] = {
    "no pair": {"l1": 5.0},
    "digits": {"l1": "05"},
    "three": {"d2": (1.0, 2.0, 3.0)},
    "reversed": {"d4": (2.0, 1.0)},
    "negative": {"l4": (-1.0, 1.0)},
    "not a number": {"l1": (0.0, math.nan)},
    "guide": {"guide": 5.0},
    "guide infinite": {"guide": (0.0, math.inf)},
    "gap": {"gap": "wide"},
    "box": {"box": ((0.0, 0.0, 0.0),)},
    "box uneven": {"box": ((0.0, 0.0, 0.0), (1.0, 1.0))},
    "box not a number": {"box": ((0.0, 0.0, 0.0), (1.0, 1.0, math.nan))},
    "margin": {"margin": math.inf},
    "radii": {"leg_radii": 0.5},
}


@pytest.mark.parametrize("kind", list(BAD_LIMITS))
def test_bad_limits_are_refused_on_one_line(kind: str) -> None:
    assert message_of(lambda: Limits(**BAD_LIMITS[kind])).startswith("limits.")


@pytest.mark.parametrize("index", range(6))
@pytest.mark.parametrize("value", [math.nan, math.inf, 1e41, None, "x"])
def test_variable_changed_to_unusable_value_is_refused(index: int, value: Any) -> None:
    design = PRESETS["paper-optimal"]
    message_of(lambda: design.with_variable(VARIABLES[index], value))
    values: list[Any] = list(design.variables)
    values[index] = value
    message_of(lambda: design.with_variables(values))


def test_variables_changed_check_their_number_and_name() -> None:
    design = PRESETS["paper-optimal"]
    message_of(lambda: design.with_variables([1.0, 2.0]))
    message_of(lambda: design.with_variable("a9", 1.0))
    assert design.with_variable("b2", 1.25).b2 == 1.25
    values = (1.0, 2.0, 3.0, 4.0, 5.0, 6.0)
    assert design.with_variables(values).variables == values
    assert design.with_variables(values).limits == design.limits


def test_design_of_lists_and_arrays_equals_that_of_tuples() -> None:
    one = Design(**NUMBERS)
    arrays: dict[str, Any] = {
        "a3": np.array(NUMBERS["a3"]),
        "b1": list(NUMBERS["b1"]),
        "b2": np.float64(2.0),
        "b3": 5,
    }
    assert Design(**arrays) == one
    assert hash(Design(**arrays)) == hash(one)


finite = st.floats(-1e3, 1e3)
lengths = st.floats(0.0, 1e3)
ordered_pairs = st.tuples(finite, finite).map(lambda pair: (min(pair), max(pair)))


def ranges() -> st.SearchStrategy[tuple[float, float | None]]:
    bounded = st.tuples(lengths, lengths).map(lambda pair: (min(pair), max(pair)))
    return bounded | lengths.map(lambda low: (low, None))


def limits() -> st.SearchStrategy[Limits]:
    boxes = st.tuples(ordered_pairs, ordered_pairs, ordered_pairs).map(
        lambda sides: (
            (sides[0][0], sides[1][0], sides[2][0]),
            (sides[0][1], sides[1][1], sides[2][1]),
        )
    )
    return st.builds(
        Limits,
        l1=ranges(),
        d2=ranges(),
        d4=ranges(),
        l4=ranges(),
        guide=st.none() | ordered_pairs,
        gap=lengths,
        box=st.none() | boxes,
        margin=st.none() | lengths,
        leg_radii=st.tuples(lengths, lengths, lengths, lengths),
    )


poses = st.builds(
    Pose,
    st.tuples(finite, finite, finite),
    st.tuples(finite, finite, finite, finite).filter(lambda q: max(map(abs, q)) > 1e-6),
)


@st.composite
def complete_designs(draw: st.DrawFn) -> Design:
    """Draw a design with every field set or left to its default."""
    return msgspec.structs.replace(
        draw(designs()),
        name=draw(st.text(max_size=100).filter(str.isprintable)),
        unit_mm=draw(st.floats(1e-3, 1e3)),
        node_step=draw(st.none() | st.floats(1e-3, 1e3)),
        limits=draw(limits()),
        home=draw(st.none() | poses),
    )


@given(complete_designs())
def test_design_file_round_trip_keeps_every_bit(design: Design) -> None:
    data = encode_design(design)
    again = decode_design(data, "round trip")
    assert again == design
    assert encode_design(again) == data


@given(complete_designs())
def test_design_loaded_from_disk_equals_the_saved_one(
    tmp_path_factory: pytest.TempPathFactory, design: Design
) -> None:
    path = tmp_path_factory.mktemp("designs") / "one.json"
    path.write_bytes(encode_design(design))
    assert load_design(str(path)) == design


def test_design_file_with_variables_only_has_defaults() -> None:
    design = decoded(SMALLEST)
    assert design == Design(**NUMBERS)
    assert design.name == "untitled"
    assert design.unit_mm == 10.0
    assert design.node_step is None
    assert design.home is None
    assert design.limits == Limits()
    assert design.schema == 1


def test_limits_left_out_are_the_reach_and_the_signs_of_home() -> None:
    design = decoded(SMALLEST)
    reach = math.hypot(8.0, 5.0)
    assert design.reach == reach
    for name in LENGTHS:
        assert design.length_range(name) == (0.0, reach)
    found = design.limits
    assert (found.guide, found.gap, found.box, found.margin) == (None, 0.0, None, 0.0)
    assert found.leg_radii == (0.0, 0.0, 0.0, 0.0)


def test_a_full_file_is_read_field_by_field() -> None:
    design = decoded(FULL)
    assert (design.name, design.unit_mm, design.node_step) == ("full", 2.5, 0.5)
    assert design.variables == (8.0, 5.0, 3.0, -2.5, 2.0, 5.0)
    assert design.limits.l1 == (1.0, 20.0)
    assert design.length_range("d2") == (0.0, design.reach)
    assert design.limits.d4 == (0.5, 18.0)
    assert design.limits.guide == (-3.0, 12.0)
    assert design.limits.gap == 0.25
    assert design.limits.box == ((0.0, -12.0, 0.0), (20.0, 22.0, 18.0))
    assert design.limits.margin is None
    assert design.limits.leg_radii == (0.1, 0.2, 0.3, 0.4)
    assert design.home is not None
    assert design.home.position == (5.0, 3.0, 5.0)
    assert abs(float(np.linalg.norm(design.home.quaternion)) - 1.0) < 1e-15


def test_a2_is_drawn_at_the_end_of_the_guide_and_never_on_a1() -> None:
    base = Design(**NUMBERS)
    assert base.a2x == base.reach
    for guide, end in (((-3.0, 12.0), 12.0), ((-3.0, 0.0), -3.0), ((0.0, 0.0), base.reach)):
        limited = msgspec.structs.replace(base, limits=Limits(guide=guide))
        assert limited.a2x == end


def test_joints_and_variables_are_named_in_the_order_of_the_arrays() -> None:
    assert JOINTS == ("l1", "d1", "d2", "d3", "d4", "l4")
    assert LENGTHS == ("l1", "d2", "d4", "l4")
    assert VARIABLES == ("a3x", "a3y", "b1x", "b1y", "b2", "b3")


TABLE_1: dict[str, tuple[tuple[float, ...], float | None, tuple[tuple[float, ...], ...]]] = {
    "paper-initial": (
        (10.0, 4.0, 4.0, -1.0, 3.0, 1.5),
        None,
        ((0.0, -math.hypot(10, 4), 0.0), (math.hypot(10, 4),) * 3),
    ),
    "paper-optimal": (
        (19.1829, 7.0062, 4.2892, -3.8858, 2.6067, 4.9094),
        2.0,
        ((0.0, -12.0, 0.0), (20.0, 22.0, 18.0)),
    ),
}


@pytest.mark.parametrize("name", list(TABLE_1))
def test_presets_are_the_rows_of_table_1(name: str) -> None:
    variables, step, box = TABLE_1[name]
    design = PRESETS[name]
    assert design.name == name
    assert design.variables == variables
    assert design.node_step == step
    assert design.limits.box == box
    assert all(design.length_range(leg) == (0.0, design.reach) for leg in LENGTHS)
    assert design.limits.guide is None
    assert design.unit_mm == 10.0
    assert load_design(name) is design


@pytest.mark.parametrize("name", list(PRESETS))
def test_the_home_of_a_preset_has_the_yaw_of_table_1_and_is_within_all_limits(name: str) -> None:
    design = PRESETS[name]
    assert design.home is not None
    assert home_pose(design) == design.home
    seen = evaluate(design, design.home)
    assert seen.violations == ()
    assert seen.proximity > 0.05
    yaw = math.radians(-73.1)
    expected = [[math.cos(yaw), -math.sin(yaw), 0], [math.sin(yaw), math.cos(yaw), 0], [0, 0, 1]]
    np.testing.assert_allclose(seen.rotation, expected, atol=1e-6)


@pytest.mark.parametrize("name", list(PRESETS))
def test_presets_come_back_from_their_files(name: str) -> None:
    assert decode_design(encode_design(PRESETS[name]), name) == PRESETS[name]


@given(designs())
def test_the_home_of_a_design_without_one_is_regular(design: Design) -> None:
    assert design.home is None
    pose = home_pose(design)
    assert np.abs(margins(pose.position, pose.rotation)).min() > 1e-3 * design.reach
    seen = evaluate(design, pose)
    assert seen.stratum == (4, 3, 2, 1)
    assert not any(v.limit.startswith("margin") for v in seen.violations)


@given(designs(), limits())
def test_home_of_any_limits_is_finite(design: Design, within: Limits) -> None:
    pose = home_pose(msgspec.structs.replace(design, limits=within))
    assert np.isfinite(pose.position).all()
    assert max(map(abs, pose.position)) <= LARGEST_NUMBER


json_values = st.recursive(
    st.none()
    | st.booleans()
    | st.integers(-(2**70), 2**70)
    | st.floats()
    | st.text(max_size=5)
    | st.sampled_from([0, 1, 2, -1, 1e300, 5e-324, HUGE // 10**4700]),
    lambda inner: (
        st.lists(inner, max_size=4)
        | st.dictionaries(st.sampled_from([*FULL, *FULL["limits"], "x"]), inner, max_size=4)
    ),
    max_leaves=12,
)


def usable_or_refused(data: bytes) -> Design | None:
    """Return the design in the bytes, or None once it is refused as it should be."""
    try:
        design = decode_design(data, "fuzz")
    except DesignError as error:
        text = str(error)
    else:
        assert decode_design(encode_design(design), "again") == design
        return design
    assert len(text.splitlines()) == 1
    return None


@given(json_values)
def test_json_of_any_kind_is_a_usable_design_or_refused(value: Any) -> None:
    usable_or_refused(json.dumps(value).encode())


def places(value: Any, path: tuple[Any, ...] = ()) -> list[tuple[Any, ...]]:
    """Return the paths to every value inside a JSON value."""
    if isinstance(value, dict):
        entries: list[tuple[Any, Any]] = list(cast("dict[Any, Any]", value).items())
    elif isinstance(value, list):
        entries = list(enumerate(cast("list[Any]", value)))
    else:
        entries = []
    return [
        place for key, inner in entries for place in ((*path, key), *places(inner, (*path, key)))
    ]


@st.composite
def mutated(draw: st.DrawFn) -> Any:
    """Draw a valid file of which one value, anywhere, is replaced."""
    value: Any = json.loads(json.dumps(FULL))
    *path, last = draw(st.sampled_from(places(FULL)))
    room = value
    for key in path:
        room = room[key]
    room[last] = draw(json_values | st.floats(-30.0, 30.0))
    return value


@given(mutated())
def test_a_mutated_file_is_a_usable_design_or_refused(value: Any) -> None:
    design = usable_or_refused(json.dumps(value).encode())
    if design is not None:
        seen = evaluate(design, home_pose(design))
        assert np.isfinite(seen.joints).all()
        assert math.isfinite(seen.determinant)
        assert 0.0 <= seen.inverse_condition <= 1.0


def test_mutations_make_both_usable_and_refused_files() -> None:
    outcomes: set[bool] = set()

    @given(mutated())
    def law(value: Any) -> None:
        outcomes.add(usable_or_refused(json.dumps(value).encode()) is None)

    law()
    assert outcomes == {True, False}


@given(st.binary(max_size=40), st.integers(0, 10_000))
def test_a_file_with_foreign_bytes_is_a_usable_design_or_refused(noise: bytes, at: int) -> None:
    data = json.dumps(FULL).encode()
    at %= len(data)
    usable_or_refused(data[:at] + noise + data[at + len(noise) :])
    usable_or_refused(noise)
