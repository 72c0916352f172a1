"""The nearest length that is used: never a singular one, and by how much it stops short."""

from __future__ import annotations

import re

import numpy as np
import pytest
from desk import number
from hypothesis import given, settings, strategies as st
from strategies import designs

from explorer.app.state.actions import SetJoint, UseNearest
from explorer.app.state.frame import Frame
from explorer.app.state.state import State, opened
from explorer.mechanism.design import JOINTS, LENGTHS, Design
from explorer.mechanism.design_file import PRESETS
from explorer.mechanism.kinematics import forward
from explorer.mechanism.pose import Pose


def stuck_states(design: Design, seed: int) -> list[State]:
    """Return the states in which a joint was set beyond an interval in which it closes."""
    rng = np.random.default_rng(seed)
    place = rng.uniform(-0.6, 0.6, 3) * design.reach
    pose = Pose.of_yaw_pitch_roll(place.tolist(), rng.uniform(-80.0, 80.0, 3).tolist())
    state, found = opened(design, pose), list[State]()
    for joint, name in enumerate(JOINTS):
        for low, high in Frame(state).snapshot.intervals[joint]:
            for value in (low - 0.1 * design.reach, high + 0.1 * design.reach):
                if value < 0.0 and name in LENGTHS:
                    continue
                after = SetJoint(joint, value).apply(state)
                if after.unclosed is not None:
                    found.append(after)
    return found


def check_nearest_length(stuck: State) -> None:
    after = UseNearest().apply(stuck)
    frame = Frame(after)
    assert after.unclosed is None
    assert forward(after.design, after.joints).feasible
    if after.pose == stuck.pose:
        # No length is regular: the mechanism stays as it was.
        return
    assert frame.verdict.kind != "singular"
    assert len(frame.snapshot.bordering_modes) == 1
    assert frame.snapshot.mode == stuck.mode
    assert after.remark is not None
    assert after.taken is not None
    said = re.search(r"([\d.,−]+(?: × 10[⁻⁰¹²³⁴-⁹]+)?) short of it: (.*)\.$", after.remark)
    assert said is not None
    unclosed = stuck.unclosed
    assert unclosed is not None
    assert unclosed.nearest is not None
    short = abs(after.joints[unclosed.joint] - unclosed.nearest)
    assert number(said[1]) == pytest.approx(short, rel=6e-3)
    assert said[2] == frame.verdict.reason(after.design.unit_mm)
    assert ("nearest that stays clear," in after.remark) == (frame.verdict.kind == "clear")


@pytest.mark.parametrize("design", PRESETS.values(), ids=lambda design: design.name)
def test_nearest_length_from_a_random_pose_is_never_singular(design: Design) -> None:
    states = stuck_states(design, seed=2)[::3]
    assert len(states) > 2
    for stuck in states:
        check_nearest_length(stuck)


@settings(max_examples=settings().max_examples // 5)
@given(designs(sizes=(10.0, 1e-6, 1e6)), st.integers(0, 2**32 - 1))
def test_nearest_length_of_nearly_degenerate_designs_is_never_singular(
    design: Design, seed: int
) -> None:
    for stuck in stuck_states(design, seed)[:1]:
        check_nearest_length(stuck)
