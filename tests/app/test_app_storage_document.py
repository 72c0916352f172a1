"""The file of a session: what is kept comes back to the last bit, and nothing else is taken."""

from __future__ import annotations

import json
import zlib
from collections.abc import Iterator
from dataclasses import fields, replace
from pathlib import Path
from typing import Any, cast

import msgspec
import pytest
from hypothesis import example, given, strategies as st
from keepsakes import OPTIMAL, Doing, doings, done, iterates_of, rich_state

from explorer.app.features.optimise.actions import Accept, Advance, Revert, StartRun
from explorer.app.state.actions import SetPose, SetPosition
from explorer.app.state.compared import Compared
from explorer.app.state.state import Run, State, opened
from explorer.app.state.studies import Studies
from explorer.app.storage import document as module
from explorer.app.storage.document import (
    MOST_BYTES,
    MOST_STEPS,
    SCHEMA,
    Document,
    Kept,
    SchemaError,
    decode_document,
    decode_header,
    encode_document,
    shortened,
)
from explorer.app.storage.saved import restored, saved
from explorer.errors import StorageError
from explorer.mechanism.design_file import MIGRATIONS
from explorer.mechanism.pose import Pose

OLDEST = Path(__file__).parents[1] / "data" / "session-1.json"
"""A rich state as the first schema wrote it, with the steps of a short history."""

RICH = rich_state()
WHOLE = encode_document(Document(RICH, (Kept("Open", opened(OPTIMAL)), Kept("All", RICH)), 1, 7), 3)


def left_of(state: State) -> State:
    """Return what is left of a state, but for a run that goes on: all that is a document."""
    paths, found = state.paths, state.optimisation
    journey = None if paths.journey is None else replace(paths.journey, is_playing=False)
    paths = replace(paths, request=0, is_planning=False, problem=None, journey=journey)
    run = None if found.run is None else _left_run(found.run)
    found = replace(found, refusal=None, run=run)
    return replace(state, taken=None, gesture=None, paths=paths, optimisation=found)


def _left_run(run: Run) -> Run:
    best = run.best
    shown = tuple(each for each in run.iterates if best is not None and each.run == best.run)
    return replace(run, own=left_of(run.own), iterates=shown, comparison=None)


def signed(body: bytes, schema: int = SCHEMA, generation: int = 3) -> bytes:
    """Return a file with this second line and a checksum that is right."""
    checksum = zlib.crc32(body, zlib.crc32(b"%d %d " % (schema, generation)))
    head = {"schema": schema, "generation": generation, "checksum": checksum}
    return json.dumps(head).encode() + b"\n" + body


def body_of(data: bytes) -> Any:
    return msgspec.json.decode(data.partition(b"\n")[2])


def test_each_field_of_a_state_is_kept_or_left_out_on_purpose() -> None:
    kept = {"design", "base", "pose", "yaw_pitch_roll", "joints", "mode", "hold", "unclosed"}
    kept |= {"view", "jog", "paths", "optimisation", "compared", "studies"}
    assert {each.name for each in fields(State)} == kept | {"gesture", "taken"}


def test_nothing_of_the_rich_state_is_as_it_is_at_first() -> None:
    plain, rich = saved(opened(OPTIMAL)), saved(RICH)
    same = [name for name in plain.__struct_fields__ if getattr(plain, name) == getattr(rich, name)]
    assert not same


@given(doings())
def test_what_is_kept_of_a_state_comes_back_to_the_last_bit(what: list[Doing]) -> None:
    states = done(what)
    steps = tuple(Kept(f"Step {number} «é»", state) for number, state in enumerate(states))
    document = Document(states[-1], steps, len(steps) - 1, 5)
    read = decode_document(encode_document(document, 3), "file")
    assert [step.words for step in read.steps] == [step.words for step in steps]
    assert (read.at, read.first) == (document.at, document.first)
    for state, found in zip(states, [*(step.state for step in read.steps)], strict=True):
        if not state.optimisation.is_on:
            # As text, in which no bit of a number and no sign of a zero is lost.
            assert repr(found) == repr(left_of(state))
            assert found == left_of(state)
        assert not found.optimisation.is_on
        assert saved(found) == saved(state)
    assert read.present == read.steps[-1].state


@pytest.mark.parametrize("count", [0, 1, 6])
def test_a_run_that_goes_on_is_kept_as_if_it_had_been_cancelled(count: int) -> None:
    own = SetPosition(0, 11.0).apply(opened(OPTIMAL))
    running = StartRun().apply(own)
    running = Advance(1, iterates_of(running, count)).apply(running)
    assert running.optimisation.is_on
    found = restored(saved(running))
    run = found.optimisation.run
    assert run is not None
    assert run.phase == "ended"
    assert run.verdict is not None
    assert run.verdict.status == "cancelled"
    if count == 0:
        assert (found.design, found.pose) == (own.design, own.pose)
        return
    assert run.best in running.optimisation.run.iterates if running.optimisation.run else False
    assert run.best is not None
    assert found.design.variables == run.best.design.variables
    back = Revert().apply(found)
    assert (back.design, back.base, back.pose) == (own.design, own.base, own.pose)
    accepted = Accept().apply(found)
    again = restored(saved(accepted)).optimisation.run
    assert again is not None
    assert again.accepted


def test_numbers_go_on_from_where_they_were() -> None:
    assert restored(saved(RICH)).optimisation.count == RICH.optimisation.count == 1


@given(st.integers(0, 120), st.integers(0, 120), st.integers(0, 60))
def test_the_steps_nearest_to_the_present_one_are_kept(count: int, at: int, most: int) -> None:
    state = opened(OPTIMAL)
    steps = tuple(Kept(f"{number}", state) for number in range(count))
    at = min(at, max(count - 1, 0))
    short = shortened(Document(state, steps, at, first=100), most)
    assert len(short.steps) == min(count, most)
    numbers = [int(step.words) for step in short.steps]
    assert numbers == list(range(count))[short.first - 100 :][: len(numbers)] or not numbers
    if numbers:
        assert numbers[short.at] == at
        nearest = sorted(range(count), key=lambda number: abs(number - at))
        # Half of them on either side, but where there are not so many.
        assert {*nearest[: len(numbers) // 2]} <= {*numbers} or at in (numbers[0], numbers[-1])


def test_long_and_large_histories_are_cut_and_the_present_is_kept() -> None:
    states = [opened(OPTIMAL)]
    for number in range(3 * MOST_STEPS):
        states.append(SetPosition(0, 5.0 + 0.01 * number).apply(states[-1]))
    steps = tuple(Kept(f"Step {number}", state) for number, state in enumerate(states))
    long = Document(states[-1], steps, len(steps) - 1)
    read = decode_document(encode_document(long, 1), "file")
    assert [step.words for step in read.steps] == [step.words for step in steps[-MOST_STEPS:]]
    large = replace(long, steps=tuple(replace(step, words=step.words * 2000) for step in steps))
    data = encode_document(large, 1)
    assert len(data) <= MOST_BYTES + 200
    read = decode_document(data, "file")
    assert 1 <= len(read.steps) < MOST_STEPS
    assert read.steps[read.at].state == read.present == left_of(states[-1])
    huge = replace(large, steps=(Kept("x" * 2 * MOST_BYTES, states[-1]),), at=0)
    assert decode_document(encode_document(huge, 1), "file") == Document(left_of(states[-1]))


def test_a_history_of_drags_is_a_small_file() -> None:
    states = [RICH]
    for number in range(MOST_STEPS - 1):
        states.append(SetPosition(0, 5.0 + 0.01 * number).apply(states[-1]))
    steps = tuple(Kept(f"Step {number}", state) for number, state in enumerate(states))
    data = encode_document(Document(states[-1], steps, 49), 1)
    assert len(decode_document(data, "file").steps) == MOST_STEPS
    # Each step adds a pose, its angles and joints; what all share is there once.
    assert len(data) < len(WHOLE) + MOST_STEPS * 500


def test_what_no_file_can_hold_is_refused_before_it_is_written() -> None:
    state = replace(opened(OPTIMAL), yaw_pitch_roll=(float("inf"), 0.0, 0.0))
    with pytest.raises(StorageError, match="no file can"):
        encode_document(Document(state), 1)


@given(st.integers(0, len(WHOLE) - 1), st.integers(1, 255))
def test_any_byte_that_is_changed_is_noticed(place: int, change: int) -> None:
    damaged = bytearray(WHOLE)
    damaged[place] ^= change
    with pytest.raises(StorageError):
        decode_document(bytes(damaged), "file")


@given(st.integers(0, len(WHOLE) - 1))
@example(0)
@example(len(WHOLE) - 1)
def test_any_part_that_is_missing_is_noticed(length: int) -> None:
    with pytest.raises(StorageError):
        decode_document(WHOLE[:length], "file")


@given(st.binary(max_size=300))
@example(b"")
@example(b"\n")
@example(b"[" * 100_000)
@example(signed(b"[" * 100_000))
@example(signed(b"{}"))
@example(signed(b'{"words":[],"at":0,"first":0,"columns":{}}'))
def test_no_bytes_make_more_than_one_line_of_refusal(data: bytes) -> None:
    for each in (data, signed(data)):
        with pytest.raises(StorageError) as refusal:
            decode_document(each, "file")
        assert "\n" not in str(refusal.value)


def places(value: Any, path: tuple[Any, ...] = ()) -> Iterator[tuple[Any, ...]]:
    """Yield the paths to all values within one, as keys and indices."""
    yield path
    inner: Any = ()
    if isinstance(value, dict):
        inner = cast("dict[str, Any]", value).items()
    elif isinstance(value, list):
        inner = enumerate(cast("list[Any]", value))
    for key, each in inner:
        yield from places(each, (*path, key))


BODY = body_of(WHOLE)
PLACES = list(places(BODY))


def at_place(value: Any, path: tuple[Any, ...]) -> Any:
    for key in path:
        value = value[key]
    return value


OBJECTS = [path for path in PLACES if isinstance(at_place(BODY, path), dict)]


@pytest.mark.parametrize("number", range(len(OBJECTS)))
def test_a_field_that_nothing_has_is_refused_wherever_it_is(number: int) -> None:
    body = body_of(WHOLE)
    at_place(body, OBJECTS[number])["surprise"] = {"values": [1], "rows": [0, 0, 0]}
    with pytest.raises(StorageError, match="surprise"):
        decode_document(signed(msgspec.json.encode(body)), "file")


ODD: list[Any] = json.loads(
    """[null, true, -1, 0, 8, 2.5, -1e300, 1e400, 100000000000000000000000000000,
        "", "odd", [], [1], {}, {"x": 1}, [[], [], []]]"""
)


@given(st.sampled_from(PLACES[1:]), st.sampled_from(ODD))
def test_a_value_of_another_kind_is_refused_or_as_good_as_any(
    path: tuple[Any, ...], odd: object
) -> None:
    body = body_of(WHOLE)
    *above, last = path
    at_place(body, tuple(above))[last] = odd
    try:
        read = decode_document(signed(json.dumps(body).encode()), "file")
    except StorageError as error:
        is_well = "\n" not in str(error)
    else:
        # Of a run only what is shown is written.
        once = decode_document(encode_document(read, 1), "file")
        is_well = decode_document(encode_document(once, 1), "file") == once
    assert is_well


def test_the_oldest_file_opens() -> None:
    data = OLDEST.read_bytes()
    assert decode_header(data, "file").schema == 1
    read = decode_document(data, "file")
    # What it has no word of is as it is at first.
    rich = replace(left_of(RICH), compared=Compared(), studies=Studies())
    # It was written when a cut that nobody had moved stood at 0.
    first = opened(OPTIMAL)
    view = replace(first.view, workspace=replace(first.view.workspace, level=0.0))
    first = replace(first, view=view)
    assert read == Document(rich, (Kept("Open", first), Kept("All", rich)), 1, 7)


def test_a_file_of_a_newer_schema_is_told_from_a_damaged_one() -> None:
    head = b'{"schema": 3, "generation": 5, "what": "nobody knows"}\n'
    assert decode_header(head, "file").generation == 5
    for rest in (b"", b"anything", b"\xff"):
        with pytest.raises(SchemaError, match="newer"):
            decode_document(head + rest, "file")


def test_sessions_of_the_first_schema_name_ghosts_by_kappa() -> None:
    body = body_of(WHOLE)
    ghosts = {"nearest", "none", "δ1 = 0", "δ2 = 0", "δ3 = 0"}
    for ghost in sorted(ghosts):
        for view in body["columns"]["view"]["values"]:
            view["singular"]["ghost"] = ghost.replace("δ", "κ")
        read = decode_document(signed(msgspec.json.encode(body), schema=1), "file")
        assert read.present.view.singular.ghost == ghost


def test_files_of_older_schemas_are_migrated_step_by_step(monkeypatch: pytest.MonkeyPatch) -> None:
    """As if `placed` had become `pose`, and then `x`, `y`, `z` its position."""

    def renamed(session: dict[str, Any]) -> dict[str, Any]:
        session = {**session}
        session["pose"] = session.pop("placed")
        return session

    def gathered(session: dict[str, Any]) -> dict[str, Any]:
        x, y, z, quaternion = session["pose"]
        return {**session, "pose": {"position": [x, y, z], "quaternion": quaternion}}

    def aged(pose: dict[str, Any]) -> list[Any]:
        return [*pose["position"], pose["quaternion"]]

    body = body_of(WHOLE)
    column = body["columns"].pop("pose")
    column["values"] = [aged(pose) for pose in column["values"]]
    body["columns"]["placed"] = column
    for run in body["columns"]["run"]["values"]:
        if run is not None:
            run["own"]["placed"] = aged(run["own"].pop("pose"))
    old = signed(msgspec.json.encode(body))
    with pytest.raises(StorageError, match="placed"):
        decode_document(old, "file")
    monkeypatch.setattr(module, "SCHEMA", SCHEMA + 2)
    monkeypatch.setattr(module, "MIGRATIONS", {SCHEMA: renamed, SCHEMA + 1: gathered})
    assert decode_document(old, "file").present == left_of(RICH)
    # Shared values are shared again, so that a long history stays small in memory.
    read = decode_document(old, "file")
    assert read.steps[1].state.design is read.present.design


def test_designs_of_older_schemas_are_brought_up_to_date_within(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """As if a schema before the first had had b2 and b3 in one field."""

    def older(value: Any) -> Any:
        if isinstance(value, list):
            return [older(each) for each in cast("list[Any]", value)]
        if not isinstance(value, dict):
            return value
        given = {name: older(each) for name, each in cast("dict[str, Any]", value).items()}
        if "unit_mm" in given:
            given |= {"schema": 0, "b": [given.pop("b2"), given.pop("b3")]}
        return given

    def newer(design: dict[str, Any]) -> dict[str, Any]:
        b2, b3 = design["b"]
        return {name: value for name, value in design.items() if name != "b"} | {
            "b2": b2,
            "b3": b3,
        }

    old = signed(msgspec.json.encode(older(BODY)))
    with pytest.raises(StorageError):
        decode_document(old, "file")
    monkeypatch.setitem(MIGRATIONS, 0, newer)
    assert decode_document(old, "file") == decode_document(WHOLE, "file")


def test_what_states_share_they_share_again() -> None:
    state = opened(OPTIMAL)
    steps = tuple(
        Kept("Move", SetPose(Pose((1.0 + i, 5.0, 9.0), (0.8, 0.0, 0.0, -0.6))).apply(state))
        for i in range(20)
    )
    read = decode_document(encode_document(Document(state, steps, 3), 1), "file")
    assert len({id(step.state.design) for step in read.steps}) == 1
    assert len({id(step.state.view) for step in read.steps}) == 1
