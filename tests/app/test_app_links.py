"""Links: a state is the same after one, and what is no whole link is refused in words."""

from __future__ import annotations

import string
from dataclasses import replace
from pathlib import Path
from typing import get_args

import msgspec
import numpy as np
import pytest
from hypothesis import given
from sample_states import Sample, rich_state, samples, states_of

from explorer.app.features.paths.state import Paths, Stop
from explorer.app.features.sharing.links import (
    LONGEST,
    Link,
    decode_link,
    encode_link,
    open_link,
)
from explorer.app.state.actions import Set
from explorer.app.state.state import State, open_state
from explorer.app.state.view import LengthName, View
from explorer.errors import InputError
from explorer.files.fragments import SCHEMA, encode_fragment
from explorer.mechanism.design_file import PRESETS
from explorer.mechanism.machine import Actuators, Tolerances
from explorer.mechanism.pose import Pose

DATA = Path(__file__).parent.parent / "data"
OPTIMAL = open_state(PRESETS["paper-optimal"])


@given(samples(12))
def test_link_holds_design_requirement_pose_and_view_of_any_state(actions: list[Sample]) -> None:
    for state in states_of(actions):
        fragment = encode_link(state)
        assert len(fragment) <= LONGEST
        assert decode_link(fragment) == Link.of(state)


def test_link_of_a_state_without_any_default_holds_all_of_it() -> None:
    rich = rich_state()
    opened = open_link(decode_link(encode_link(rich))).apply(OPTIMAL)
    assert (opened.design, opened.pose, opened.view) == (rich.design, rich.pose, rich.view)
    assert opened.parts["required"] == rich.parts["required"]
    # Nothing else comes with it.
    assert opened.parts["studies"] == OPTIMAL.parts["studies"]


def test_link_of_the_first_schema_is_read() -> None:
    fragment = (DATA / "link.txt").read_text()
    assert fragment.startswith("1.")
    found, own = decode_link(fragment), Link.of(rich_state())
    # That pose lies on a path, whose law may place it anew in the last digits.
    assert found.pose.position == pytest.approx(own.pose.position, abs=1e-3)
    assert msgspec.structs.replace(found, pose=own.pose) == own


def test_name_of_a_preset_is_a_link_to_it() -> None:
    for design in PRESETS.values():
        assert open_link(decode_link(design.name)).apply(OPTIMAL) == open_state(design)


@pytest.mark.parametrize("linked", get_args(LengthName))
@pytest.mark.parametrize("shown", get_args(LengthName))
def test_path_stays_in_place_where_page_or_link_is_in_millimetres(
    shown: LengthName, linked: LengthName
) -> None:
    stops = Stop(OPTIMAL.pose), Stop(Pose((1.0, 2.0, 3.0), (1.0, 0.0, 0.0, 0.0)))
    state = Set("paths.stops", stops).apply(Set("view.lengths", shown).apply(OPTIMAL))
    design = msgspec.structs.replace(OPTIMAL.design, unit_mm=25.4)
    link = Link.of(open_state(design, view=View(lengths=linked)))
    opened = open_link(link).apply(state)
    assert opened.view == link.view
    scale = 1.0 if shown == linked == "design units" else state.design.unit_mm / design.unit_mm
    for before, after in zip(Paths.of(state).stops, Paths.of(opened).stops, strict=True):
        assert isinstance(before.at, Pose)
        assert isinstance(after.at, Pose)
        expected = scale * np.array(before.at.position)
        np.testing.assert_allclose(after.at.position, expected, rtol=1e-12)


@pytest.mark.parametrize("state", [OPTIMAL, rich_state()])
def test_link_with_any_letters_changed_is_refused(state: State) -> None:
    fragment, random = encode_link(state), np.random.default_rng(0)
    letters = [*string.ascii_letters, *string.digits, *"-_.~ é"]
    damaged = {fragment[:end] for end in range(len(fragment))}
    for at in range(len(fragment)):
        rest = fragment[at + 1 :]
        other = str(random.choice(letters))
        damaged |= {f"{fragment[:at]}{each}{rest}" for each in ("", other, 2 * fragment[at])}
        damaged.add(f"{fragment[:at]}{fragment[at:][:2][::-1]}{rest[1:]}")
    for each in damaged - {fragment}:
        with pytest.raises(InputError, match="the link is damaged"):
            decode_link(each)


def test_link_that_this_version_cannot_use_says_why() -> None:
    later = encode_fragment({}, SCHEMA + 1)
    with pytest.raises(InputError, match=r"has schema 2, .* reads schemas up to 1"):
        decode_link(later)
    design = {"a3": [0, 0], "b1": [0, 1], "b2": 0, "b3": 1}
    pose = {"position": [0, 0, 1], "quaternion": [1, 0, 0, 0]}
    with pytest.raises(InputError, match="degenerate design"):
        decode_link(encode_fragment({"design": design, "pose": pose}))
    with pytest.raises(InputError, match="the field `pose` is missing"):
        decode_link(encode_fragment({"design": design | {"a3": [1, 1]}}))


def test_link_is_refused_where_it_would_be_too_long() -> None:
    random = np.random.default_rng(0)
    stated = [tuple(random.random(3 if k not in (3, 8) else 2).tolist()) for k in range(9)]
    actuators = {name: tuple(random.random(6).tolist()) for name in Actuators.__struct_fields__}
    tolerances, rich = Tolerances(*stated), rich_state()
    # All digits of the tolerances, and of all else on the page.
    state = replace(rich, design=msgspec.structs.replace(rich.design, tolerances=tolerances))
    assert decode_link(encode_link(state)) == Link.of(state)
    long = msgspec.structs.replace(state.design, actuators=Actuators(**actuators))
    with pytest.raises(InputError, match=r"may have 1,900: .* download the design"):
        encode_link(replace(state, design=long))
