"""The file of a session: states come back to the last bit, and damaged files are refused."""

from __future__ import annotations

import json
import math
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
from explorer.app.state.compared import Compared
from explorer.app.state.state import Run, State, joints_of, opened
from explorer.app.state.studies import Brush, Studies, StudyPlan
from explorer.app.state.values import with_value
from explorer.app.state.view import ForcesView, OrientationView, PrecisionView
from explorer.app.storage.packing import present_view
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
from explorer.mechanism.design_file import MIGRATIONS
from explorer.mechanism.pose import Pose

DATA = Path(__file__).parents[1] / "data"
RICH, OPENED = rich_state(), opened(OPTIMAL)
WHOLE = encode_session(History((Step(7, "Open", opened(OPTIMAL)), Step(8, "All", RICH)), 1), 3)


def saved(state: State) -> State:
    """Return what a file holds of a state: all but what goes on or is computed again."""
    if state.optimisation.is_on:
        run = state.optimisation.run
        assert run is not None
        state = replace(run.own, optimisation=replace(state.optimisation, run=None))
    paths, found = state.paths, state.optimisation
    journey = None if paths.journey is None else replace(paths.journey, is_playing=False)
    paths = replace(paths, request=0, planning=None, problem=None, journey=journey)
    run = None if found.run is None else _saved_run(found.run)
    found = replace(found, run=run)
    return replace(state, taken=None, gesture=None, paths=paths, optimisation=found)


def _saved_run(run: Run) -> Run:
    best = run.best
    shown = tuple(each for each in run.iterates if best is not None and each.run == best.run)
    return replace(run, own=saved(run.own), iterates=shown, comparison=None)


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


def body_of(data: bytes) -> Any:
    return msgspec.json.decode(data.partition(b"\n")[2])


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
        assert repr(found.state) == repr(saved(step.state))
        assert found.state == saved(step.state)


def test_iterates_with_infinite_loads_are_read_back() -> None:
    run = RICH.optimisation.run
    assert run is not None
    infinite = tuple(replace(each, objective=None) for each in run.iterates)
    run = replace(run, iterates=infinite)
    state = replace(RICH, optimisation=replace(RICH.optimisation, run=run))
    found = decode_session(encode_session(history_of([state]), 1), "file").step.state
    assert found == saved(state)
    read = found.optimisation.run
    assert read is not None
    assert {each.value for each in read.iterates} == {math.inf}


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


def test_history_of_drags_adds_a_pose_with_its_angles_and_joints_per_step() -> None:
    data = encode_session(history_of(moves(RICH, MOST_STEPS - 1)), 1)
    assert len(data) < len(WHOLE) + MOST_STEPS * 700


def test_steps_share_the_parts_that_did_not_change() -> None:
    read = decode_session(encode_session(history_of(moves(RICH, 20)), 1), "file")
    for part in ("design", "view", "optimisation", "studies", "compared"):
        assert len({id(getattr(step.state, part)) for step in read.steps}) == 1, part
    (pinned,) = filter(None, read.step.state.compared.pinned)
    assert pinned is not read.step.state.design


def test_infinite_number_is_refused_when_the_session_is_written() -> None:
    state = replace(opened(OPTIMAL), yaw_pitch_roll=(float("inf"), 0.0, 0.0))
    with pytest.raises(StorageError, match="no file can"):
        encode_session(start_history(state), 1)


@given(st.integers(0, len(WHOLE) - 1), st.integers(1, 255))
def test_file_with_a_changed_byte_is_refused(place: int, change: int) -> None:
    damaged = bytearray(WHOLE)
    damaged[place] ^= change
    with pytest.raises(StorageError):
        decode_session(bytes(damaged), "file")


@given(st.integers(0, len(WHOLE) - 1))
@example(0)
@example(len(WHOLE) - 1)
def test_file_that_is_cut_short_is_refused(length: int) -> None:
    with pytest.raises(StorageError):
        decode_session(WHOLE[:length], "file")


@given(st.binary(max_size=300), st.sampled_from([1, 2, 3]))
@example(b"", SCHEMA)
@example(b"\n", SCHEMA)
@example(b"[" * 100_000, SCHEMA)
@example(b"{}", SCHEMA)
@example(b'{"words":[],"at":0,"first":0,"objects":[],"states":[]}', SCHEMA)
@example(b'{"words":["a"],"at":0,"first":0,"objects":[{"a":{"#":0}}],"states":[0]}', SCHEMA)
@example(b'{"words":["a"],"at":0,"first":0,"objects":[{"a":{"b":0}}],"states":[0]}', SCHEMA)
@example(b'{"words":[],"at":0,"first":0,"columns":{}}', 2)
def test_any_bytes_are_refused_in_one_line(data: bytes, schema: int) -> None:
    for each in (data, signed(data, schema)):
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


WHOLE_FILES = {3: WHOLE, 2: (DATA / "session-2.json").read_bytes()}
BODIES = {schema: body_of(data) for schema, data in WHOLE_FILES.items()}
PLACES = [(schema, path) for schema, body in BODIES.items() for path in places(body) if path]


@pytest.mark.parametrize("schema", WHOLE_FILES)
def test_unknown_field_is_refused_wherever_it_is(schema: int) -> None:
    for path in places(BODIES[schema]):
        body = body_of(WHOLE_FILES[schema])
        place = at_place(body, path)
        # The names of libraries in a record are free.
        if isinstance(place, dict) and path[-1:] != ("versions",):
            place["surprise"] = {"values": [1], "rows": [0, 0, 0]}
            with pytest.raises(StorageError, match=r"surprise|no reference"):
                decode_session(signed(msgspec.json.encode(body), schema), "file")


ODD: list[Any] = json.loads(
    """[null, true, -1, 0, 8, 2.5, -1e300, 1e400, 100000000000000000000000000000,
        "", "odd", [], [1], {}, {"x": 1}, {"#": 0}, {"#": 7}, [[], [], []]]"""
)


@given(st.sampled_from(PLACES), st.sampled_from(ODD))
def test_value_of_another_kind_is_refused_or_read_as_any_other(
    place: tuple[int, tuple[Any, ...]], odd: object
) -> None:
    schema, path = place
    body = body_of(WHOLE_FILES[schema])
    *above, last = path
    at_place(body, tuple(above))[last] = odd
    problem = ""
    try:
        read = decode_session(signed(json.dumps(body).encode(), schema), "file")
        # Of a run only the iterates of one start are written.
        once = decode_session(encode_session(read, 1), "file")
        assert decode_session(encode_session(once, 1), "file") == once
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
    body = body_of(WHOLE)
    next(each for each in body["objects"] if "objective" in each)["objective"] = "a\u202e" * 50_000
    with pytest.raises(StorageError, match="file cannot be used") as refusal:
        decode_session(signed(json.dumps(body).encode()), "file")
    assert str(refusal.value).isprintable()
    assert len(str(refusal.value)) < 400


@pytest.mark.parametrize("words", [[], ["Open"], ["Open"] * 3])
def test_words_for_more_or_fewer_steps_are_refused(words: list[str]) -> None:
    body = body_of(WHOLE)
    body["words"] = words
    with pytest.raises(StorageError, match="file cannot be used"):
        decode_session(signed(msgspec.json.encode(body)), "file")


def without_diagram(state: State) -> State:
    """Return the state, and that before its run, without the diagram of the strata."""
    path = "view.singular.strata"
    before_run = () if state.optimisation.run is None else (f"optimisation.run.own.{path}",)
    for each in (path, *before_run):
        state = with_value(state, each, value=False)
    return state


@pytest.mark.parametrize("schema", [1, 2])
def test_file_of_an_earlier_schema_opens_to_the_state_it_was_written_from(schema: int) -> None:
    data = (DATA / f"session-{schema}.json").read_bytes()
    assert decode_header(data, "file").schema == schema
    read = decode_session(data, "file")
    assert (read.at, [step.number for step in read.steps]) == (1, [7, 8])
    assert [step.words for step in read.steps] == ["Open", "All"]
    first, state = (step.state for step in read.steps)
    if schema == 2:
        expected = with_value(saved(RICH), "set_tilt_torsion", None)
        expected = with_value(expected, "set_tool_angles", None)
        for view in ("view", "optimisation.run.own.view"):
            # Fields that came later are as in a new state.
            expected = with_value(expected, f"{view}.workspace.flipped", False)
            expected = with_value(expected, f"{view}.orientation", OrientationView())
            expected = with_value(expected, f"{view}.forces", ForcesView())
            expected = with_value(expected, f"{view}.precision", PrecisionView())
            expected = with_value(expected, f"{view}.at", "b4")
            expected = with_value(expected, f"{view}.machine", True)
            # Twin and prototype were both switched on.
            expected = with_value(expected, f"{view}.drawn_as", "6-4 twin")
        expected = with_value(expected, "paths.holds_load", False)
        for request in ("optimisation.request", "optimisation.run.own.optimisation.request"):
            expected = with_value(expected, f"{request}.held", False)
            expected = with_value(expected, f"{request}.error", 0.0)
            expected = with_value(expected, f"{request}.deflection", 0.0)
            expected = with_value(expected, f"{request}.tilt", 0.0)
        # There were no kinds of paths, and titles named the signs of modes.
        paths = state.paths
        assert paths.journey is not None
        assert (paths.kind, paths.journey.title) == (
            "straight",
            "Mode 3 (− + +) to mode 5 (+ − +)",
        )
        journey = replace(paths.journey, title="Mode 3 to mode 5")
        present = replace(state, paths=replace(paths, kind="planned", journey=journey))
        # The diagram of the strata was closed at first.
        assert (first.view.singular.strata, state.view.singular.strata) == (False, True)
        assert without_diagram(first) == without_diagram(opened(OPTIMAL))
        assert without_diagram(present) == without_diagram(expected)
        return
    assert state.optimisation.run is not None
    assert state.design.name == "é «one»-optimised"
    assert (state.compared, state.studies) == (Compared(), Studies())
    assert state.unclosed is not None
    assert state.unclosed.asked == 99.1
    # It was written when a cut that nobody had moved stood at 0.
    assert first.view.workspace.level == 0.0
    again = decode_session(encode_session(read, 3), "file")
    assert repr(again) == repr(read)


def test_forms_that_were_switched_apart_are_one_choice_now() -> None:
    read = decode_session((DATA / "session-3.json").read_bytes(), "file")
    forms = [step.state.view.drawn_as for step in read.steps]
    assert forms == ["schematic", *["6-4 twin"] * (len(forms) - 1)]
    for twin, shown, form in (
        (False, False, "schematic"),
        (False, True, "prototype"),
        (True, True, "6-4 twin"),
    ):
        former = {"twin": twin, "prototype": {"shown": shown, "exploded": 0.5}}
        assert present_view(former) == {"drawn_as": form, "prototype": {"exploded": 0.5}}


def test_former_words_for_workspaces_and_their_measure_are_read_as_the_present_ones() -> None:
    plan = StudyPlan(
        measures=("volume", "accessible_volume"), objectives=(("accessible_volume", "max"),)
    )
    axis = "accessible_volume"
    studies = Studies("reachable", (Brush(axis, ((0.0, 1.0),)),), axis, axis, axis, plan=plan)
    for over, former in (("inclusive", "reachable"), ("total", "dexterous")):
        state = with_value(opened(OPTIMAL), "studies", studies)
        state = with_value(state, "view.workspace.region", "accessible")
        state = with_value(state, "view.orientation.over", over)
        # A name that a user gave stays.
        state = with_value(state, "design", msgspec.structs.replace(OPTIMAL, name="reachable"))
        body = encode_session(start_history(state), 1).partition(b"\n")[2]
        for present, word in (
            (b'"accessible"', b'"reachable"'),
            (b'"accessible_volume"', b'"reachable_volume"'),
            (f'"over":"{over}"'.encode(), f'"over":"{former}"'.encode()),
        ):
            assert present in body
            body = body.replace(present, word)
        assert decode_session(signed(body), "file").step.state == state


def test_paths_between_modes_or_stored_poses_have_the_same_ends_now() -> None:
    read = decode_session((DATA / "session-3.json").read_bytes(), "file")
    # Stored poses count for more than modes; modes that nobody had chosen are chosen by none.
    home, beyond = RICH.paths.start, RICH.paths.goal
    ends = [(None, None), (home, beyond), (3, 5), (None, 6)]
    assert [(step.state.paths.start, step.state.paths.goal) for step in read.steps] == ends
    assert RICH.paths.journey is not None
    for step in read.steps[1:]:
        journey = step.state.paths.journey
        assert journey is not None
        assert (journey.kind, journey.poses) == ("straight", RICH.paths.journey.poses)
    again = decode_session(encode_session(read, 3), "file")
    assert repr(again) == repr(read)


@pytest.mark.parametrize("ghost", ["nearest", "none", "δ1 = 0", "δ2 = 0", "δ3 = 0"])
def test_ghost_of_the_first_schema_is_renamed_from_kappa_to_delta(ghost: str) -> None:
    body = body_of(WHOLE_FILES[2])
    views = body["columns"]["view"]["values"]
    views += [run["own"]["view"] for run in body["columns"]["run"]["values"] if run]
    for view in views:
        view["singular"]["ghost"] = ghost.replace("δ", "κ")
    body["columns"]["view"]["values"] = views[: len(views) - 1]
    state = decode_session(signed(msgspec.json.encode(body), schema=1), "file").step.state
    assert state.view.singular.ghost == ghost
    assert state.optimisation.run is not None
    assert state.optimisation.run.own.view.singular.ghost == ghost


def test_file_of_a_newer_schema_is_told_from_a_damaged_one() -> None:
    head = b'{"schema": %d, "generation": 5, "what": "nobody knows"}\n' % (SCHEMA + 1)
    assert decode_header(head, "file").generation == 5
    for rest in (b"", b"anything", b"\xff"):
        with pytest.raises(SchemaError, match="newer"):
            decode_session(head + rest, "file")


@pytest.mark.parametrize("schema", WHOLE_FILES)
def test_designs_of_an_older_schema_are_migrated_wherever_they_are(
    monkeypatch: pytest.MonkeyPatch, schema: int
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

    whole = WHOLE_FILES[schema]
    old = signed(msgspec.json.encode(older(body_of(whole))), schema)
    with pytest.raises(StorageError):
        decode_session(old, "file")
    monkeypatch.setitem(MIGRATIONS, 0, newer)
    # The designs in the file of the present schema have the fields that the second one added.
    monkeypatch.setitem(MIGRATIONS, 1, dict)
    assert decode_session(old, "file") == decode_session(whole, "file")
