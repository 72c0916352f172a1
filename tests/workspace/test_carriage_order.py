"""The order of the carriages is that of the home pose, for every part of the explorer.

The answers of all parts for single poses are compared with each other.
"""

from __future__ import annotations

from typing import Any

import msgspec
import numpy as np
import pytest
from limited_designs import limited, ordinary_case
from scipy.spatial.transform import Rotation

from explorer import (
    PRESETS,
    Design,
    Limits,
    Pose,
    decode_design,
    encode_design,
    evaluate,
    inverse,
    poses_are_valid,
    workspace_volume,
)
from explorer.errors import DesignError
from explorer.mechanism.design import LENGTHS
from explorer.workspace.limits.constraints import Never, constraints
from explorer.workspace.limits.table import CARRIAGE_ORDER
from explorer.workspace.orientations.share import orientations_within
from explorer.workspace.slices.volume import workspace_nodes
from explorer.workspace.solids.solids import workspace_solid

pytestmark = pytest.mark.usefixtures("warm_kernels")

OPTIMAL = PRESETS["paper-optimal"]
# Half a turn of the platform about the base's z-axis reverses the order of the carriages.
MIRRORED = np.diag([-1.0, -1.0, 1.0]) @ OPTIMAL.home_pose.rotation


@pytest.mark.parametrize("seed", range(3))
def test_order_with_d3_less_d1_of_the_other_sign_than_at_home_is_a_violation(seed: int) -> None:
    design, _ = ordinary_case(seed)
    home = design.home_pose
    rotations = Rotation.random(20, random_state=np.random.default_rng(seed)).as_matrix()
    joints = inverse(design, home.position, rotations)
    at_home = evaluate(design, home).joints
    other = (joints[:, 3] - joints[:, 1]) * (at_home[3] - at_home[1]) < 0.0
    assert 0 < other.sum() < len(other)
    only = limited(design, **dict.fromkeys(LENGTHS, (0.0, 1e3)), guide=None, box=None, margin=None)
    plain = limited(only, carriage_order="any")
    within = orientations_within(only, home.position, rotations)
    np.testing.assert_array_equal(within, ~other)
    assert orientations_within(plain, home.position, rotations).all()
    clear = poses_are_valid(plain, home.position, rotations)
    np.testing.assert_array_equal(poses_are_valid(only, home.position, rotations), clear & ~other)
    for rotation, broken in zip(rotations, other.tolist(), strict=True):
        pose = Pose.of(home.position, rotation)
        names = [each.limit for each in evaluate(only, pose).violations]
        assert names == ([CARRIAGE_ORDER] if broken else [])
        assert not evaluate(plain, pose).violations
        never = [each.name for each in constraints(only, rotation) if isinstance(each, Never)]
        assert never == names


def test_workspace_with_the_carriages_in_the_other_order_is_empty() -> None:
    design = limited(OPTIMAL, margin=None)
    found = workspace_volume(design, MIRRORED)
    assert (found.volume, found.empty_because) == (0.0, (CARRIAGE_ORDER,))
    assert workspace_nodes(design, MIRRORED).count == 0
    assert workspace_solid(design, MIRRORED).empty_because == (CARRIAGE_ORDER,)
    plain = limited(design, carriage_order="any")
    assert workspace_volume(plain, MIRRORED).volume > 1000.0
    assert workspace_nodes(plain, MIRRORED).count > 100


def yawed(yaw: float) -> Pose:
    return Pose.of_yaw_pitch_roll(OPTIMAL.home_pose.position, (yaw, 0.0, 0.0))


def with_home_at(yaw: float) -> Design:
    return limited(msgspec.structs.replace(OPTIMAL, home=yawed(yaw)), margin=None)


def test_home_with_coincident_carriages_demands_no_order() -> None:
    design = with_home_at(-90.0)
    assert design.demanded_order == 0
    for yaw in (-60.0, -90.0, -120.0):
        assert not evaluate(design, yawed(yaw)).violations
    assert with_home_at(-89.0).demanded_order == 1
    assert with_home_at(-91.0).demanded_order == -1


@pytest.mark.parametrize(("beyond", "kept"), [(0.0, True), (1e-12, True), (1e-7, False)])
def test_carriages_that_coincide_satisfy_their_order_to_the_tolerance(
    beyond: float, kept: bool
) -> None:
    design = with_home_at(-73.1)
    pose = yawed(-90.0 - float(np.degrees(beyond)))
    assert (not evaluate(design, pose).violations) == kept
    assert orientations_within(design, pose.position, pose.rotation[None]).all() == kept
    assert (workspace_volume(design, pose.rotation).volume > 0.0) == kept


def test_design_file_without_the_order_demands_that_of_home() -> None:
    fields: dict[str, Any] = msgspec.json.decode(encode_design(OPTIMAL))
    assert fields["limits"].pop("carriage_order") == "home"
    assert decode_design(msgspec.json.encode(fields), "older") == OPTIMAL
    fields["limits"]["carriage_order"] = "any"
    plain = decode_design(msgspec.json.encode(fields), "plain")
    assert plain == limited(OPTIMAL, carriage_order="any")
    assert decode_design(encode_design(plain), "again") == plain
    for wrong in ("other", None, True, 1):
        fields["limits"]["carriage_order"] = wrong
        with pytest.raises(DesignError, match="carriage_order"):
            decode_design(msgspec.json.encode(fields), "wrong")
    for word in ("other", None, ["home"]):
        untyped: Any = word
        with pytest.raises(DesignError, match='carriage_order must be "home" or "any"'):
            Limits(carriage_order=untyped)
