"""Every limit has one tolerance, for every part of the explorer.

Limits are set to the values of a random pose, so that only rounding decides, and to a little less.
The optimiser ends on limits too; the designs of its outcomes are checked as read from their files.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from typing import Any

import msgspec
import numpy as np
import pytest
from limited_designs import limited, ordinary_case
from long_cases import long_after
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
    make_problem,
    margins,
    optimise_design,
    poses_are_valid,
    workspace_volume,
)
from explorer.errors import DesignError
from explorer.mechanism.configuration import Configuration
from explorer.mechanism.design import LENGTHS, Swing
from explorer.numerics.arrays import FloatArray
from explorer.workspace.limits.constraints import Never, angle_between, slacks
from explorer.workspace.limits.table import CARRIAGE_ORDER
from explorer.workspace.orientations.share import orientations_within
from explorer.workspace.slices.volume import node_count_of
from explorer.workspace.solids.solids import workspace_solid
from explorer.workspace.workspace import Workspace

pytestmark = pytest.mark.usefixtures("warm_kernels")

OPTIMAL = PRESETS["paper-optimal"]
# A share of the reach: far more than rounding, far less than a manufacturing tolerance.
LITTLE = 1e-7


def free_case(seed: int) -> tuple[Design, Pose]:
    """Return a design, and a pose on a node of a grid of step 1 that satisfies its limits."""
    rng = np.random.default_rng(seed)
    x = (rng.uniform(2.0, 9.0, 6) * rng.choice([-1.0, 1.0], 6)).tolist()
    lengths: dict[str, Any] = dict.fromkeys(LENGTHS, (0.0, 60.0))
    design = Design(
        a3=(x[0], x[1]),
        b1=(x[2], x[3]),
        b2=x[4],
        b3=x[5] + math.copysign(1.0, x[5] - x[4]),
        limits=Limits(**lengths),
    )
    home = Pose.of(rng.uniform(-6.0, 6.0, 3), Rotation.random(random_state=rng).as_matrix())
    design = msgspec.structs.replace(design, home=home)
    signs, u = np.sign(margins(home.position, home.rotation)), home.rotation[0, 0]
    while True:
        position = rng.integers(-6, 7, 3).astype(float)
        rotation = Rotation.random(random_state=rng).as_matrix()
        regular = (margins(position, rotation) * signs).min() > 0.3 and rotation[0, 0] * u > 0.02
        if regular and poses_are_valid(design, position, rotation):
            return design, Pose.of(position, rotation)


def touching(design: Design, pose: Pose, little: float) -> Iterator[tuple[str, Design]]:
    """Yield designs with one limit that a pose just touches, or violates by a little."""
    joints = inverse(design, pose.position, pose.rotation).tolist()
    q = dict(zip(("l1", "d1", "d2", "d3", "d4", "l4"), joints, strict=True))
    for name in LENGTHS:
        at = q[name]
        yield f"{name} maximum", limited(design, **{name: (0.0, at - little)})
        yield f"{name} minimum", limited(design, **{name: (at + little, 60.0)})
        if not little:
            yield f"{name} range of no width", limited(design, **{name: (at, at)})
    low, high = sorted((q["d1"], q["d3"]))
    gap = abs(q["d1"] - q["d3"])
    yield "gap", limited(design, gap=gap + little)
    yield "guide minimum", limited(design, guide=(low + little, high + 9.0))
    yield "guide maximum", limited(design, guide=(low - 9.0, high - little))
    if not little:
        yield "guide as wide as the gap", limited(design, guide=(low, high), gap=gap)
    place = np.array(pose.position)
    for axis in range(3):
        off = np.eye(3)[axis] * (9.0 + little)
        yield f"box {axis} minimum", boxed(design, place - 9.0 + off, place + 9.0)
        yield f"box {axis} maximum", boxed(design, place - 9.0, place + 9.0 - off)
        flat = np.eye(3)[axis] * 9.0
        if not little:
            yield f"box {axis} of no width", boxed(design, place - 9.0 + flat, place + 9.0 - flat)
    if not little:
        yield "box of a point", boxed(design, place, place)
    least = float(np.abs(margins(pose.position, pose.rotation)).min())
    yield "margin", limited(design, margin=least + little)
    home = design.home_pose
    at_home, here = (Configuration.at(design, each).legs for each in (home, pose))
    for leg in range(4):
        names = [f"b{leg + 1}", *({0: ["a1"], 3: ["a3"]}.get(leg, []))]
        for name in names:
            axis = at_home[leg] / np.linalg.norm(at_home[leg])
            if name[0] == "b":
                axis = pose.rotation @ home.rotation.T @ axis
            angle = float(angle_between(here[leg], axis))
            degrees = math.degrees(angle - little / design.reach)
            yield f"swing {name}", limited(design, swing=Swing(**{name: degrees}))


def boxed(design: Design, lows: FloatArray, highs: FloatArray) -> Design:
    return limited(design, box=(tuple(lows.tolist()), tuple(highs.tolist())))


def answers_of(design: Design, pose: Pose) -> dict[str, bool]:
    """Return by part of the explorer whether a pose on a node of step 1 satisfies the limits."""
    place, turn = np.array(pose.position), pose.rotation
    left = slacks(Workspace(design, turn).limits, place)
    around = design if design.limits.box else boxed(design, place - 1.0, place + 1.0)
    return {
        "limits of a pose": not evaluate(design, pose).violations,
        "validity": bool(poses_are_valid(design, place, turn)),
        "orientations": bool(orientations_within(design, place, turn[None])[0]),
        "constraints": bool((left >= -0.1 * LITTLE).all()),
        "nodes": has_node(around, place, turn),
    }


def has_node(design: Design, place: FloatArray, rotation: FloatArray) -> bool:
    """Return whether a position is one of the paper's nodes, the only one in a small box."""
    lows, highs = (np.array(end) for end in design.limits.box or pytest.fail("no box"))
    only = boxed(design, np.maximum(lows, place - 0.25), np.minimum(highs, place + 0.25))
    if (np.array(only.limits.box)[0] > np.array(only.limits.box)[1]).any():
        return False
    return node_count_of(Workspace(only, rotation), 1.0).count == 1


@pytest.mark.parametrize("seed", range(3))
def test_pose_on_a_limit_satisfies_it_and_one_a_little_beyond_violates_it(seed: int) -> None:
    design, pose = free_case(seed)
    for beyond in (0.0, LITTLE):
        for name, touched in touching(design, pose, beyond * design.reach):
            assert set(answers_of(touched, pose).values()) == {beyond == 0.0}, name


@pytest.mark.parametrize("gap", long_after(2, [0.3, 2.0, 1.0, 3.0, 4.0]))
def test_optimum_on_the_gap_has_a_workspace(gap: float) -> None:
    outcome = optimise_design(make_problem(limited(OPTIMAL, gap=gap), "largest-volume"))
    assert outcome.converged
    design = decode_design(encode_design(outcome.design), "the outcome")
    apart = abs((design.b3 - design.b2) * float(design.home_pose.rotation[0, 0]))
    assert apart == pytest.approx(gap, abs=1e-9)
    found = workspace_volume(design)
    assert found.volume > 0.0, found.empty_because
    assert found.volume == pytest.approx(outcome.best.volume, rel=1e-9)


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
        never = [each.name for each in Workspace(only, rotation).limits if isinstance(each, Never)]
        assert never == names


def test_workspace_with_the_carriages_in_the_other_order_is_empty() -> None:
    design = limited(OPTIMAL, margin=None)
    found = workspace_volume(design, MIRRORED)
    assert (found.volume, found.empty_because) == (0.0, (CARRIAGE_ORDER,))
    assert node_count_of(Workspace(design, MIRRORED)).count == 0
    assert workspace_solid(design, MIRRORED).empty_because == (CARRIAGE_ORDER,)
    plain = limited(design, carriage_order="any")
    assert workspace_volume(plain, MIRRORED).volume > 1000.0
    assert node_count_of(Workspace(plain, MIRRORED)).count > 100


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
