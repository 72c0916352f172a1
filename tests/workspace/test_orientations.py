"""Sets of orientations, and orientation capabilities against single poses."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest
from limited_designs import limited
from scipy.spatial.transform import Rotation

from explorer import PRESETS, InputError, Pose, evaluate
from explorer.mechanism.design import Swing
from explorer.mechanism.pose import checked_rotation, yaw_pitch_roll_from_rotation
from explorer.numerics.arrays import FloatArray
from explorer.workspace.limits.constraints import constraints
from explorer.workspace.limits.region import region_of
from explorer.workspace.orientations.sets import cone_of_directions, yaw_pitch_roll_range
from explorer.workspace.orientations.share import orientation_capability, orientations_within
from explorer.workspace.slices.volume import volume_within

OPTIMAL = PRESETS["paper-optimal"]
HOME = OPTIMAL.home_pose
EVERY_LIMIT: dict[str, Any] = {
    "gap": 0.5,
    "guide": (-5.0, 20.0),
    "margin": 0.3,
    "l4": (4.0, 19.0),
    "swing": Swing(a1=70.0, a3=50.0, b1=80.0, b2=100.0, b3=95.0, b4=60.0),
}


def test_yaw_pitch_roll_range_is_a_grid_with_its_ends() -> None:
    found = yaw_pitch_roll_range([-80.0, 0.0, -5.0], [-60.0, 10.0, -5.0], [3, 2, 1])
    angles = yaw_pitch_roll_from_rotation(found)
    expected = [(yaw, pitch, -5.0) for yaw in (-80.0, -70.0, -60.0) for pitch in (0.0, 10.0)]
    np.testing.assert_allclose(angles, expected, atol=1e-9)
    middle = yaw_pitch_roll_range([-80.0, 0.0, 0.0], [-60.0, 10.0, 0.0], [1, 1, 1])
    np.testing.assert_allclose(yaw_pitch_roll_from_rotation(middle), [(-70, 5, 0)], atol=1e-9)


@pytest.mark.parametrize("half_angle", [0.0, 60.0, 180.0])
def test_cone_of_directions_is_even_and_has_no_torsion(half_angle: float) -> None:
    count = 2000
    found = cone_of_directions(HOME.rotation, half_angle, count)
    checked_rotation(found)
    np.testing.assert_allclose(found[0], HOME.rotation, atol=1e-12)
    turn = Rotation.from_matrix(HOME.rotation.T @ found).as_rotvec()
    np.testing.assert_allclose(turn[:, 2], 0.0, atol=1e-9)
    tilts = np.linalg.norm(turn, axis=1)
    assert float(tilts.max()) == pytest.approx(math.radians(half_angle), abs=1e-9)
    if half_angle:
        # Areas of caps grow with 1 - cos.
        share = (1.0 - np.cos(tilts)) / (1.0 - math.cos(math.radians(half_angle)))
        np.testing.assert_allclose(share, np.arange(count) / (count - 1.0), atol=1e-9)
        towards = np.exp(1j * np.arctan2(turn[:, 1], turn[:, 0]))
        assert abs(complex(towards.mean())) < 2e-3


def within_one_by_one(position: FloatArray, rotations: FloatArray, **limits: Any) -> list[bool]:
    design = limited(OPTIMAL, **limits)
    return [not evaluate(design, Pose.of(position, r)).violations for r in rotations]


@pytest.mark.parametrize("seed", range(2))
def test_orientation_capability_agrees_with_single_poses(seed: int) -> None:
    rng = np.random.default_rng(seed)
    position = np.array(HOME.position) + rng.normal(scale=2.0, size=3)
    turns = Rotation.from_rotvec(rng.normal(scale=0.5, size=(80, 3))).as_matrix()
    rotations = turns @ HOME.rotation
    for limits in ({}, EVERY_LIMIT, {"margin": None, "box": None}):
        expected = within_one_by_one(position, rotations, **limits)
        design = limited(OPTIMAL, **limits)
        np.testing.assert_array_equal(orientations_within(design, position, rotations), expected)
        share = orientation_capability(design, position, rotations)
        assert share == pytest.approx(np.mean(expected), abs=1e-12)
    assert 0 < sum(within_one_by_one(position, rotations, **EVERY_LIMIT)) < len(rotations)


def test_swing_of_a_leg_is_its_angle_to_the_direction_at_home() -> None:
    design = limited(OPTIMAL, swing=Swing(a1=20.0))
    home = evaluate(OPTIMAL, HOME)
    turned = Pose.of([14.0, 5.0, 9.0], HOME.rotation)
    one, other = home.points.b1, evaluate(OPTIMAL, turned).points.b1
    cosine = float(one @ other) / float(np.linalg.norm(one) * np.linalg.norm(other))
    angle = math.degrees(math.acos(cosine))
    assert evaluate(design, HOME).violations == ()
    for bound in (angle - 0.01, angle + 0.01):
        found = evaluate(limited(OPTIMAL, swing=Swing(a1=bound)), turned).violations
        if bound > angle:
            assert found == ()
            continue
        (violation,) = found
        assert violation.limit == "swing a1"
        assert violation.value == pytest.approx(angle, rel=1e-9)
        assert violation.bound == pytest.approx(bound, rel=1e-12)
        assert violation.above
        assert "°" in str(violation)


@pytest.mark.parametrize("joint", ["b1", "b2", "b3", "b4"])
def test_swing_of_a_ball_joint_turns_with_the_platform(joint: str) -> None:
    design = limited(OPTIMAL, box=None, swing=Swing(**{joint: 1.0}), margin=None)
    turn = Rotation.from_rotvec([math.radians(25.0), 0.0, 0.0]).as_matrix()
    # About the guide the whole mechanism turns, but for l4, which starts off the guide.
    pose = Pose.of(turn @ HOME.position, turn @ HOME.rotation)
    broken = {each.limit for each in evaluate(design, pose).violations}
    assert (f"swing {joint}" in broken) == (joint == "b4")


def test_orientations_without_a_margin_keep_no_mode() -> None:
    level = np.eye(3)[None]
    anywhere = limited(OPTIMAL, margin=None)
    assert orientations_within(anywhere, HOME.position, level).all()
    # Turned upside down δ1 changes its sign.
    over = np.diag([1.0, -1.0, -1.0]) @ HOME.rotation
    assert not orientations_within(OPTIMAL, HOME.position, over[None]).any()


def test_orientations_with_reversed_ranges_or_unusable_counts_are_refused() -> None:
    with pytest.raises(InputError, match="yaw: the low end 5° exceeds the high end -5°"):
        yaw_pitch_roll_range([5.0, 0.0, 0.0], [-5.0, 0.0, 0.0], [2, 1, 1])
    for counts in ([0, 1, 1], [1, 1], [1000, 1000, 1000]):
        with pytest.raises(InputError):
            yaw_pitch_roll_range([0.0] * 3, [1.0] * 3, counts)
    for half_angle in (-1.0, 181.0, math.nan):
        with pytest.raises(InputError, match="half-angle"):
            cone_of_directions(HOME.rotation, half_angle, 5)
    for count in (0, -1, 10**9):
        with pytest.raises(InputError, match="number of orientations"):
            orientation_capability(OPTIMAL, HOME.position, count)
    with pytest.raises(InputError, match="shape"):
        orientations_within(OPTIMAL, HOME.position, np.eye(3))
    with pytest.raises(InputError, match="one position"):
        orientations_within(OPTIMAL, [HOME.position], np.eye(3)[None])


def test_volume_of_too_many_surfaces_is_refused() -> None:
    rotations = cone_of_directions(HOME.rotation, 10.0, 33)
    limits = [limit for rotation in rotations for limit in constraints(OPTIMAL, rotation)]
    with pytest.raises(InputError, match="a volume takes at most 32 surfaces; the region has"):
        volume_within(region_of(limits))
