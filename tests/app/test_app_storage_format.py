"""The file of a session: states come back to the last bit, and damaged files are refused."""

from __future__ import annotations

import copy
import json
import zlib
from collections.abc import Callable, Iterator
from dataclasses import fields, is_dataclass, replace
from pathlib import Path
from typing import Any, cast

import msgspec
import pytest
from desk import thick
from hypothesis import example, given, strategies as st
from sample_states import OPTIMAL, Sample, iterates_of, rich_state, samples, states_of

from explorer.app.features.optimise.actions import Advance, StartRun
from explorer.app.session.history import History, Step, start_history
from explorer.app.state.actions import SetPosition
from explorer.app.state.state import Run, State, joints_of, opened
from explorer.app.storage.session_format import (
    MOST_BYTES,
    MOST_STEPS,
    SCHEMA,
    SchemaError,
    decode_header,
    decode_session,
    encode_session,
    shorten,
)
from explorer.errors import StorageError
from explorer.mechanism.pose import Pose

DATA = Path(__file__).parents[1] / "data"
RICH, OPENED = rich_state(), opened(OPTIMAL)
WHOLE = encode_session(History((Step(7, "Open", opened(OPTIMAL)), Step(8, "All", RICH)), 1), 3)


def saved_part_of(state: State) -> State:
    """Return what a file holds of a state: all but what goes on or is computed again."""
    if state.optimisation.is_on:
        run = state.optimisation.run
        assert run is not None
        state = replace(run.own, optimisation=replace(state.optimisation, run=None))
    paths, found = state.paths, state.optimisation
    journey = None if paths.journey is None else replace(paths.journey, is_playing=False)
    paths = replace(paths, request=0, planning=None, problem=None, journey=journey)
    run = None if found.run is None else saved_run_of(found.run)
    found = replace(found, run=run)
    return replace(state, taken=None, gesture=None, paths=paths, optimisation=found)


def saved_run_of(run: Run) -> Run:
    best = run.best
    shown = tuple(each for each in run.iterates if best is not None and each.run == best.run)
    return replace(run, own=saved_part_of(run.own), iterates=shown, comparison=None)


def history_of(states: list[State], words: str = "Step {} «é»") -> History:
    steps = (Step(number, words.format(number), state) for number, state in enumerate(states))
    return History(tuple(steps), len(states) - 1)


def moves(state: State, count: int) -> list[State]:
    """Return a state and those after moves along x."""
    states = [state]
    for number in range(count):
        states.append(SetPosition(0, 5.0 + 0.01 * number).apply(states[-1]))
    return states


def signed(body: bytes, schema: int = SCHEMA, generation: int = 3) -> bytes:
    """Return a file with this second line and a valid checksum."""
    checksum = zlib.crc32(body, zlib.crc32(b"%d %d " % (schema, generation)))
    head = {"schema": schema, "generation": generation, "checksum": checksum}
    return json.dumps(head).encode() + b"\n" + body


def leaves(value: Any, path: str = "") -> dict[str, Any]:
    """Return the values within the parts of a state, by their paths."""
    if not is_dataclass(value):
        return {path: value}
    found: dict[str, Any] = {}
    for field in fields(value):
        found |= leaves(getattr(value, field.name), f"{path}.{field.name}")
    return found


def test_rich_state_differs_from_a_new_one_in_every_saved_value() -> None:
    new, rich = leaves(opened(OPTIMAL)), leaves(RICH)
    transient = {"taken", "gesture", "paths.request", "paths.planning", "paths.problem"}
    same = {path[1:] for path, value in new.items() if rich.get(path, ...) == value}
    assert same == transient


@given(samples())
def test_session_after_any_actions_is_read_back_to_the_last_bit(actions: list[Sample]) -> None:
    history = history_of(states_of(actions))
    read = decode_session(encode_session(history, 3), "file")
    assert [(step.number, step.words) for step in read.steps] == [
        (step.number, step.words) for step in history.steps
    ]
    assert read.at == history.at
    for step, found in zip(history.steps, read.steps, strict=True):
        # As text, in which no bit of a number and no sign of a zero is lost.
        assert repr(found.state) == repr(saved_part_of(step.state))
        assert found.state == saved_part_of(step.state)


def test_run_under_way_is_saved_as_the_state_before_it() -> None:
    own = SetPosition(0, 11.0).apply(opened(OPTIMAL))
    running = StartRun().apply(own)
    running = Advance(1, iterates_of(running, 6)).apply(running)
    found = decode_session(encode_session(history_of([running]), 1), "file").step.state
    assert found == replace(own, optimisation=replace(own.optimisation, count=1))


@given(st.integers(1, 120), st.integers(0, 120), st.integers(1, 60))
def test_shortened_history_has_the_steps_nearest_to_the_present_one(
    count: int, at: int, most: int
) -> None:
    at = min(at, count - 1)
    whole = replace(history_of([opened(OPTIMAL)] * count), at=at)
    short = shorten(whole, most)
    numbers = [step.number for step in short.steps]
    assert numbers == list(range(numbers[0], numbers[0] + min(count, most)))
    assert short.step is whole.step
    # Half of them on either side, unless there are fewer.
    assert abs(short.at - most // 2) <= 1 or numbers[0] == 0 or numbers[-1] == count - 1


@pytest.mark.parametrize(
    ("words", "least", "most"),
    [("Step {}", MOST_STEPS, MOST_STEPS), ("x" * 20_000, 2, 20), ("x" * 2 * MOST_BYTES, 1, 1)],
    ids=["long", "large", "huge"],
)
def test_long_and_large_histories_lose_steps_far_from_the_present_one(
    words: str, least: int, most: int
) -> None:
    history = history_of(moves(opened(OPTIMAL), 3 * MOST_STEPS), words)
    data = encode_session(history, 1)
    read = decode_session(data, "file")
    assert least <= len(read.steps) <= most
    assert len(data) <= MOST_BYTES + 200 or len(read.steps) == 1
    assert read.step.state == history.step.state
    assert read.step.number == history.step.number


def test_history_of_drags_is_small_and_its_steps_share_what_did_not_change() -> None:
    data = encode_session(history_of(moves(RICH, MOST_STEPS - 1)), 1)
    # A pose with its angles and joints for each step.
    assert len(data) < len(WHOLE) + MOST_STEPS * 700
    read = decode_session(data, "file")
    assert read.steps[0].state == saved_part_of(RICH)
    for part in ("design", "view", "optimisation", "studies", "compared"):
        assert len({id(getattr(step.state, part)) for step in read.steps}) == 1, part
    (pinned,) = filter(None, read.step.state.compared.pinned)
    assert pinned is not read.step.state.design


def test_infinite_number_is_refused_when_the_session_is_written() -> None:
    state = replace(opened(OPTIMAL), yaw_pitch_roll=(float("inf"), 0.0, 0.0))
    with pytest.raises(StorageError, match="no file can"):
        encode_session(start_history(state), 1)


@given(st.integers(0, len(WHOLE) - 1), st.integers(1, 255))
@example(len(WHOLE) - 1, 1)
def test_file_with_a_changed_byte_or_cut_short_is_refused(place: int, change: int) -> None:
    damaged = bytearray(WHOLE)
    damaged[place] ^= change
    for data in (bytes(damaged), WHOLE[:place]):
        with pytest.raises(StorageError):
            decode_session(data, "file")


@given(st.binary(max_size=300))
@example(b"\n")
@example(b"[" * 100_000)
@example(b'{"words":[],"at":0,"first":0,"objects":[],"states":[]}')
@example(b'{"words":["a"],"at":0,"first":0,"objects":[{"a":{"#":0}}],"states":[0]}')
@example(b'{"words":["a"],"at":0,"first":0,"objects":[{"a":{"b":0}}],"states":[0]}')
def test_any_bytes_are_refused_in_one_line(data: bytes) -> None:
    for each in (data, signed(data)):
        with pytest.raises(StorageError) as refusal:
            decode_session(each, "file")
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


def at_place(value: Any, path: tuple[Any, ...]) -> Any:
    for key in path:
        value = value[key]
    return value


BODY: Any = msgspec.json.decode(WHOLE.partition(b"\n")[2])
PLACES = [path for path in places(BODY) if path]


@given(st.sampled_from([(), *PLACES]).filter(lambda path: isinstance(at_place(BODY, path), dict)))
def test_unknown_field_is_refused_wherever_it_is(path: tuple[Any, ...]) -> None:
    body = copy.deepcopy(BODY)
    # The names of libraries in a record are free.
    if path[-1:] != ("versions",):
        at_place(body, path)["surprise"] = {"values": [1], "rows": [0, 0, 0]}
        with pytest.raises(StorageError, match=r"surprise|no reference"):
            decode_session(signed(msgspec.json.encode(body)), "file")


ODD: list[Any] = json.loads(
    """[null, true, -1, 0, 8, 2.5, -1e300, 1e400, 100000000000000000000000000000,
        "", "odd", [], [1], {}, {"x": 1}, {"#": 0}, {"#": 7}, [[], [], []]]"""
)


@given(st.sampled_from(PLACES), st.sampled_from(ODD))
@example(("words",), ["Open"])
@example(("words",), ["Open"] * 3)
def test_value_of_another_kind_is_refused_or_read_as_any_other(
    path: tuple[Any, ...], odd: object
) -> None:
    body = copy.deepcopy(BODY)
    at_place(body, path[:-1])[path[-1]] = odd
    problem = ""
    try:
        read = decode_session(signed(json.dumps(body).encode()), "file")
        # Of a run only the iterates of one start are written.
        once = decode_session(encode_session(read, 1), "file")
        assert decode_session(encode_session(once, 1), "file") == once
        assert path != ("words",)
    except StorageError as error:
        problem = str(error)
    assert "\n" not in problem


Change = Callable[[State], State]
FAR = Pose((1e39, 5.0, 9.0), OPENED.pose.quaternion)
NONSENSE: dict[str, Change] = {
    "a huge length": lambda state: replace(state, joints=(*state.joints[:5], 1e300)),
    "a negative length": lambda state: replace(state, joints=(-5.0, *state.joints[1:])),
    "joints of another pose": lambda state: replace(state, joints=(*state.joints[::-1],)),
    "a pose far away": lambda state: replace(
        state, pose=FAR, joints=joints_of(state.design, FAR)
    ),
    "a pose with other joints": lambda state: replace(
        state, pose=Pose((5.0, 5.0, 5.0), state.pose.quaternion)
    ),
    "a huge radius": lambda state: thick(state, 1e30),
    "another design": lambda state: replace(
        state, design=msgspec.structs.replace(state.design, b1=(1.0, 1.0))
    ),
}  # fmt: skip


@pytest.mark.parametrize("nonsense", NONSENSE)
@pytest.mark.parametrize("place", ["shown", "undone", "before a run"])
def test_state_that_no_page_shows_is_refused_wherever_it_is(nonsense: str, place: str) -> None:
    bad = NONSENSE[nonsense](OPENED)
    if place == "before a run":
        run = RICH.optimisation.run
        assert run is not None
        optimisation = replace(RICH.optimisation, run=replace(run, own=bad))
        bad = replace(RICH, optimisation=optimisation)
    states = [bad, OPENED] if place == "undone" else [OPENED, bad]
    with pytest.raises(StorageError, match="file cannot be used") as refusal:
        decode_session(encode_session(history_of(states), 1), "file")
    assert str(refusal.value).isprintable()


def test_long_nonsense_is_refused_in_a_short_line() -> None:
    body = copy.deepcopy(BODY)
    next(each for each in body["objects"] if "objective" in each)["objective"] = "a\u202e" * 50_000
    with pytest.raises(StorageError, match="file cannot be used") as refusal:
        decode_session(signed(json.dumps(body).encode()), "file")
    assert str(refusal.value).isprintable()
    assert len(str(refusal.value)) < 400


@pytest.mark.parametrize("schema", [1, 2, 3])
def test_file_of_an_earlier_schema_opens_and_is_the_same_once_it_is_written_again(
    schema: int,
) -> None:
    data = (DATA / f"session-{schema}.json").read_bytes()
    assert decode_header(data, "file").schema == schema
    read = decode_session(data, "file")
    assert len({step.number for step in read.steps}) == len(read.steps) > 1
    assert read.step.state.design.name.startswith("é «one»")
    assert repr(decode_session(encode_session(read, 3), "file")) == repr(read)


def test_file_of_a_newer_schema_is_told_from_a_damaged_one() -> None:
    head = b'{"schema": %d, "generation": 5, "what": "nobody knows"}\n' % (SCHEMA + 1)
    assert decode_header(head, "file").generation == 5
    for rest in (b"", b"anything", b"\xff"):
        with pytest.raises(SchemaError, match="newer"):
            decode_session(head + rest, "file")
