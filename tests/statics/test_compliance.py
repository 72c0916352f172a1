"""Compliance: the reference, a frame of beams, symmetry, principal directions, shares."""

from __future__ import annotations

import itertools
from typing import Any

import msgspec
import numpy as np
import pytest
from numpy.testing import assert_allclose
from Pynite import FEModel3D  # pyright: ignore[reportMissingTypeStubs]
from refusals import refusal
from statics_cases import CASES, random_poses

from explorer import PRESETS, Actuators, Design, Struts, compliance, deflection, inverse
from explorer.mechanism.configuration import Configuration
from explorer.numerics.arrays import FloatArray
from explorer.statics.compliance import (
    compliance_shares,
    largest_deflection,
    principal_compliances,
    stiffness_of,
)

OPTIMAL = PRESETS["paper-optimal"]
STIFFNESS = np.array([900.0, 1100.0, 700.0, 1300.0, 800.0, 1000.0])
BENDING = np.array([4e4, 6e4])
TOOL = (0.5, -0.3, 1.5)


def test_compliance_of_reference_is_that_of_the_reference() -> None:
    for case in CASES:
        found = compliance(*case.pose, case.actuator_stiffness, case.bending_stiffness, case.tool)
        assert_allclose(found, case.compliance, atol=1e-9 * np.abs(case.compliance).max())


def test_compliance_is_symmetric_and_positive() -> None:
    positions, rotations = random_poses(OPTIMAL, 300)
    found = compliance(OPTIMAL, positions, rotations, STIFFNESS, BENDING, TOOL)
    assert (found == np.swapaxes(found, -1, -2)).all()
    assert (np.linalg.eigvalsh(found)[:, 0] > 0.0).all()
    stiffer = compliance(OPTIMAL, positions, rotations, 2.0 * STIFFNESS, 2.0 * BENDING, TOOL)
    assert_allclose(stiffer, 0.5 * found, rtol=1e-12)


def test_largest_deflection_is_caused_by_its_force_and_by_no_larger_one() -> None:
    rng = np.random.default_rng(4)
    positions, rotations = random_poses(OPTIMAL, 60)
    found = compliance(OPTIMAL, positions, rotations, STIFFNESS, BENDING, TOOL)
    loads = rng.normal(size=(60, 6)) * 10.0 ** rng.uniform(-3.0, 2.0, (60, 1))
    forces = 10.0 ** rng.uniform(-3.0, 3.0, 60)
    _, axes = np.linalg.eigh(found[:, :3, :3])
    # Displacements across the softest direction are the hard case: the force has two worst ones.
    stiff = np.linalg.solve(found[:20, :3, :3], axes[:20, :, :1] + axes[:20, :, 1:2])[..., 0]
    loads[:20], loads[10:20, :3] = 0.0, stiff[10:]
    largest, worst = largest_deflection(found, loads, forces)
    assert_allclose(np.linalg.norm(worst, axis=1), forces, rtol=1e-12)
    directions = rng.normal(size=(3000, 1, 3))
    others = forces[:, None] * directions / np.linalg.norm(directions, axis=-1, keepdims=True)
    still = deflection(found, loads)[:, :3]
    moves = np.einsum("nij,knj->kni", found[:, :3, :3], np.concatenate([worst[None], others]))
    caused, *sampled = np.linalg.norm(still + moves, axis=-1)
    assert_allclose(caused, largest, rtol=1e-9)
    assert (np.array(sampled) <= largest * (1.0 + 1e-12)).all()


def test_largest_deflection_without_force_or_load_is_that_of_the_other() -> None:
    positions, rotations = random_poses(OPTIMAL, 30)
    found = compliance(OPTIMAL, positions, rotations, STIFFNESS, BENDING, TOOL)
    load = [3.0, -2.0, 4.0, 5.0, -6.0, 2.0]
    still = np.linalg.norm(deflection(found, load)[:, :3], axis=1)
    assert_allclose(largest_deflection(found, load, 0.0)[0], still, rtol=1e-12)
    softest = principal_compliances(found).displacement[:, 0]
    assert_allclose(largest_deflection(found, np.zeros(6), 7.0)[0], 7.0 * softest, rtol=1e-12)
    assert not largest_deflection(np.zeros((6, 6)), load, 7.0)[0].any()
    assert np.isinf(largest_deflection(np.full((6, 6), np.inf), load, 7.0)[0])
    for force in (-1.0, np.nan, np.inf):
        assert "the force of any direction must" in refusal(largest_deflection, found, load, force)


def test_principal_compliances_are_the_extremes_of_directions() -> None:
    positions, rotations = random_poses(OPTIMAL, 20)
    found = compliance(OPTIMAL, positions, rotations, STIFFNESS, BENDING, TOOL)
    principal = principal_compliances(found)
    assert (np.diff(principal.displacement, axis=-1) <= 0.0).all()
    assert (np.diff(principal.turn, axis=-1) <= 0.0).all()
    for block, values, rows in (
        (found[:, :3, :3], principal.displacement, principal.force_directions),
        (found[:, 3:, 3:], principal.turn, principal.moment_directions),
    ):
        assert_allclose(
            rows @ np.swapaxes(rows, -1, -2), np.broadcast_to(np.eye(3), (20, 3, 3)), atol=1e-12
        )
        along = np.einsum("nij,njk->nik", rows, block)
        assert_allclose(along, values[..., None] * rows, atol=1e-9 * np.abs(block).max())


def test_compliance_shares_add_up_and_follow_what_is_soft() -> None:
    positions, rotations = random_poses(OPTIMAL, 50)
    load = [3.0, -2.0, 4.0, 5.0, -6.0, 2.0]
    given = Configuration(OPTIMAL, positions, rotations, TOOL), load
    shares = compliance_shares(*given, STIFFNESS, BENDING)
    assert_allclose(np.sum(shares, axis=0), 1.0, rtol=1e-12)
    rigid = compliance_shares(*given, STIFFNESS)
    assert not rigid.struts.any()
    only_struts = compliance_shares(*given, np.full(6, np.inf), BENDING)
    assert_allclose(only_struts.struts, 1.0, rtol=1e-12)
    # The work of the load is twice the energy that the parts store.
    found = compliance(OPTIMAL, positions, rotations, STIFFNESS, BENDING, TOOL)
    no_struts = compliance(OPTIMAL, positions, rotations, STIFFNESS, None, TOOL)
    work, without = (deflection(each, load) @ np.array(load) for each in (found, no_struts))
    assert_allclose(shares.struts, 1.0 - without / work, atol=1e-9)
    assert np.isnan(compliance_shares(*given, np.full(6, np.inf)).guide).all()


def test_stiffness_of_a_design_is_in_its_units() -> None:
    stiffness, bending = stiffness_of(OPTIMAL)
    assert np.isinf(stiffness).all()
    assert np.isinf(bending).all()
    six = (1.0, 2.0, 3.0, 4.0, 5.0, 6.0)
    design = msgspec.structs.replace(
        OPTIMAL, actuators=Actuators(stiffness_n_mm=six), struts=Struts(outer_mm=10.0)
    )
    stiffness, bending = stiffness_of(design)
    assert_allclose(stiffness, 10.0 * np.array(six))
    assert_allclose(bending, 70e3 * np.pi * 10.0**4 / 64.0 / 100.0)
    home = design.home_pose
    found = compliance(design, home.position, home.rotation, stiffness, bending)
    assert np.isfinite(found).all()


@pytest.mark.parametrize("count", [1, 600])
def test_compliance_of_singular_pose_is_infinite(count: int) -> None:
    positions = np.resize([3.0, 4.0, 5.0], (count, 3))
    found = compliance(OPTIMAL, positions, np.eye(3), STIFFNESS, BENDING)
    assert (found == np.inf).all()
    assert (deflection(found, [1.0, 0, 0, 0, 0, 0]) == np.inf).all()
    principal = principal_compliances(found)
    assert (principal.displacement == np.inf).all()
    assert np.isnan(principal.moment_directions).all()
    shares = compliance_shares(Configuration(OPTIMAL, positions, np.eye(3)), np.ones(6), STIFFNESS)
    assert np.isnan(shares).all()


def test_compliance_of_unusable_arguments_is_refused() -> None:
    home = OPTIMAL.home_pose
    given = OPTIMAL, home.position, home.rotation
    for stiffness in ([0.0] * 6, [-1.0] * 6, [1.0] * 5, [np.nan] * 6):
        message = refusal(compliance, *given, stiffness)
        assert "six" in message or "6 positive" in message
    assert "bending" in refusal(compliance, *given, STIFFNESS, [0.0, 1.0])


FREEDOMS = ("DX", "DY", "DZ", "RX", "RY", "RZ")
LOADS = ("FX", "FY", "FZ", "MX", "MY", "MZ")
# Stiffness of the platform's members. The compliance has a part that falls as one over it, which
# twice the stiffness shows; a still larger one would cost digits.
STIFF = 1e7
TIP = {"Rxj": True, "Ryj": True, "Rzj": True}


class Frame:
    """A frame of members with Young's modulus 1, so that its sections hold EA and EI."""

    def __init__(self) -> None:
        # The library has no types.
        self.model: Any = FEModel3D()
        self.model.add_material("unit", 1.0, 1.0, 0.0, 0.0)

    def add_node(self, name: str, place: FloatArray, held: str = "") -> None:
        """Add a node, some of whose freedoms are held, such as "DY RZ"."""
        self.model.add_node(name, *place.tolist())
        if held:
            self.model.def_support(name, **{f"support_{each}": True for each in held.split()})

    def add_member(
        self, start: str, end: str, stretching: float, bending: float, **free: bool
    ) -> None:
        """Add a member with its stiffness EA and EI, and the freedoms of its ends released."""
        name = f"{start} to {end}"
        self.model.add_section(name, stretching, bending, bending, bending)
        self.model.add_member(name, start, end, "unit", name)
        self.model.def_releases(name, **free)

    def compliance_at(self, node: str) -> FloatArray:
        """Return the displacements and turns of a node under unit loads, as columns."""
        for load in LOADS:
            self.model.add_node_load(node, load, 1.0, case=load)
            self.model.add_load_combo(load, {load: 1.0})
        # The check refuses members as stiff as the platform's for their rounding.
        self.model.analyze_linear(check_stability=False, sparse=False)
        at = self.model.nodes[node]
        return np.array([[getattr(at, freedom)[load] for load in LOADS] for freedom in FREEDOMS])


def frame_compliance(
    design: Design,
    position: FloatArray,
    rotation: FloatArray,
    stiffness: FloatArray,
    bending: FloatArray,
    tool: FloatArray,
    platform: float,
) -> FloatArray:
    """Return the compliance at the tool of a frame with the legs of a manipulator.

    Members of the platform have EA = EI = `platform`.
    """
    frame, points = Frame(), Configuration(design, position, rotation).points
    l1, d1, d2, d3, d4, l4 = inverse(design, position, rotation).tolist()
    frame.add_node("b4", points.b4)
    ends = {"b1": points.b1, "b2": points.b2, "b3": points.b3, "tool": position + rotation @ tool}
    for name, end in ends.items():
        frame.add_node(name, end)
        frame.add_member("b4", name, platform, platform)
    ball = {"Ryi": True, "Rzi": True, **TIP}
    for base, end, length, own in (
        ("a1", "b1", l1, stiffness[0]),
        ("a3", "b4", l4, stiffness[5]),
    ):
        frame.add_node(base, getattr(points, base), " ".join(FREEDOMS))
        # Only the stretching of such a member counts.
        frame.add_member(base, end, own * length, 1.0, **ball)
    for foot, end, (d, length), (along, own), stiff in (
        ("foot 2", "b2", (d1, d2), stiffness[1:3], bending[0]),
        ("foot 3", "b3", (d3, d4), stiffness[3:5], bending[1]),
    ):
        frame.add_node(foot, np.array([d, 0.0, 0.0]), "DY DZ RY RZ")
        frame.model.def_support_spring(foot, "DX", float(along))
        frame.add_member(foot, end, own * length, stiff, **TIP)
    return frame.compliance_at("tool")


@pytest.mark.parametrize("seed", range(4))
def test_compliance_is_that_of_a_frame_of_beams(seed: int) -> None:
    rng = np.random.default_rng(seed)
    design = OPTIMAL.with_variables((OPTIMAL.variables + rng.uniform(-1.0, 1.0, 6)).tolist())
    (position,), (rotation,) = random_poses(design, 1, seed)
    tool = rng.uniform(-3.0, 3.0, 3)
    stiffness = 10.0 ** rng.uniform(2.0, 4.0, 6)
    bending = 10.0 ** rng.uniform(4.0, 6.0, 2)
    found = compliance(design, position, rotation, stiffness, bending, tool)
    given = design, position, rotation, stiffness, bending, tool
    # The part that falls as one over the stiffness of the platform is taken away.
    frame = 2.0 * frame_compliance(*given, 2.0 * STIFF) - frame_compliance(*given, STIFF)
    for rows, columns in itertools.product((slice(0, 3), slice(3, 6)), repeat=2):
        size = np.abs(found[rows, columns]).max()
        assert_allclose(frame[rows, columns], found[rows, columns], atol=1e-5 * size, rtol=0.0)
