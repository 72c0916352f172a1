"""Sets of orientations, and capabilities against single poses and an independent count."""

from __future__ import annotations

import math
from typing import Any

import msgspec
import numpy as np
import pytest
from limited_designs import limited
from long_cases import long_after
from reference import read_reference
from scipy.spatial.transform import Rotation

from explorer import PRESETS, Design, InputError, Limits, Pose, evaluate, margins
from explorer.mechanism.design import LENGTHS, Swing, Triple
from explorer.mechanism.pose import rotation_array, yaw_pitch_roll_from_rotation
from explorer.workspace.limits.region import region_of
from explorer.workspace.limits.valid_poses import Violation
from explorer.workspace.orientations.share import (
    cone_of_directions,
    orientation_capability,
    orientation_share,
    orientations_within,
    yaw_pitch_roll_range,
)
from explorer.workspace.slices.volume import region_volume
from explorer.workspace.workspace import Workspace

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
    rotation_array(found)
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


@pytest.mark.parametrize("tool", [(0.0, 0.0, 0.0), (3.0, -2.0, 1.0)])
@pytest.mark.parametrize("seed", range(2))
def test_orientation_capability_at_a_tool_agrees_with_single_poses(seed: int, tool: Triple) -> None:
    rng = np.random.default_rng(seed)
    position = np.array(HOME.position) + HOME.rotation @ tool + rng.normal(scale=2.0, size=3)
    turns = Rotation.from_rotvec(rng.normal(scale=0.5, size=(80, 3))).as_matrix()
    rotations = turns @ HOME.rotation
    for limits in ({}, EVERY_LIMIT, {"margin": None, "box": None}):
        design = limited(OPTIMAL, **limits)
        poses = [Pose.of(position - r @ tool, r) for r in rotations]
        expected = [not evaluate(design, pose).violations for pose in poses]
        found = orientations_within(design, position, rotations, tool)
        np.testing.assert_array_equal(found, expected)
        share = orientation_capability(design, position, rotations, tool)
        assert share == pytest.approx(np.mean(expected), abs=1e-12)
        assert limits is not EVERY_LIMIT or 0 < sum(expected) < len(rotations)


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
        assert isinstance(violation, Violation)
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
    limits = [limit for rotation in rotations for limit in Workspace(OPTIMAL, rotation).limits]
    with pytest.raises(InputError, match="a volume takes at most 32 surfaces; the region has"):
        region_volume(region_of(limits))


pytestmark = pytest.mark.usefixtures("warm_kernels")

CASES: list[dict[str, Any]] = read_reference("orientation")["cases"]
# Standard error of the reference's count.
REFERENCE_ERROR = 7e-4


def case_design(case: dict[str, Any]) -> Design:
    """Return the design of a case, with a home of the signs and the order that it demands."""
    lengths: dict[str, Any] = {
        name: (low, high)
        for name, low, high in zip(LENGTHS, case["least"], case["most"], strict=True)
    }
    x = case["design"]
    free = Design(a3=tuple(x["a3"]), b1=tuple(x["b1"]), b2=x["b2"], b3=x["b3"])
    rotations = np.asarray(Rotation.random(1000, rng=np.random.default_rng(0)).as_matrix())
    signs = np.sign(margins(case["position"], rotations)) == case["signs"]
    order = np.sign((free.b3 - free.b2) * rotations[:, 0, 0]) == case["order"]
    home = Pose.of(case["position"], rotations[signs.all(axis=1) & order][0])
    return msgspec.structs.replace(free, limits=Limits(**lengths), home=home)


@pytest.mark.parametrize("index", long_after(4, range(len(CASES))))
def test_share_is_that_of_an_independent_count(index: int) -> None:
    case = CASES[index]
    design, position = case_design(case), case["position"]
    for name, limits in (
        ("share_with_signs_and_order", {}),
        ("share_with_signs", {"carriage_order": "any"}),
        ("share_of_lengths", {"carriage_order": "any", "margin": None}),
    ):
        found = orientation_share(limited(design, **limits), position)
        error = math.hypot(found.standard_error, REFERENCE_ERROR)
        assert found.share == pytest.approx(case[name], abs=4.5 * error), name
        assert found.share == pytest.approx(case[name], abs=0.004), name
        assert found.standard_error < 1.5e-3
        assert found.orientations == 100_000


def test_standard_error_is_the_spread_over_seeds() -> None:
    design = limited(OPTIMAL, l1=(5.0, 15.0), swing=Swing(b1=70.0))
    p = OPTIMAL.home_pose.position
    found = [orientation_share(design, p, 2000, seed) for seed in range(60)]
    spread = float(np.std([each.share for each in found]))
    told = math.sqrt(float(np.mean([each.standard_error**2 for each in found])))
    assert told == pytest.approx(spread, rel=0.35)
    mean = float(np.mean([each.share for each in found]))
    assert mean == pytest.approx(orientation_share(design, p, 200_000).share, abs=2e-3)
    # As many independent orientations have a larger one.
    assert told < 0.8 * math.sqrt(mean * (1.0 - mean) / 2000)


def test_share_is_the_same_for_a_seed_and_none_outside_the_box() -> None:
    p = OPTIMAL.home_pose.position
    assert orientation_share(OPTIMAL, p, 500, 7) == orientation_share(OPTIMAL, p, 500, 7)
    outside = orientation_share(OPTIMAL, [30.0, 5.0, 9.0], 100)
    assert (outside.share, outside.standard_error) == (0.0, 0.0)


def test_unusable_positions_numbers_and_seeds_are_refused() -> None:
    p = OPTIMAL.home_pose.position
    refused: list[tuple[str, dict[str, Any]]] = [
        *(("number of orientations", {"n": n}) for n in (1, -5, 10**9)),
        ("number of orientations must be a whole number", {"n": 2.5}),
        ("seed", {"seed": -1}),
        ("seed must be a whole number", {"seed": 0.5}),
    ]
    for message, given in refused:
        with pytest.raises(InputError, match=message):
            orientation_share(OPTIMAL, p, **given)
    with pytest.raises(InputError, match="whole number"):
        orientation_capability(OPTIMAL, p, math.nan)
    with pytest.raises(InputError, match="one position"):
        orientation_share(OPTIMAL, [p])
    with pytest.raises(InputError, match="position"):
        orientation_share(OPTIMAL, [math.nan, 0.0, 0.0])
