"""Compliance against a frame of beams, solved by the finite elements of Pynite."""

from __future__ import annotations

import itertools
from typing import Any

import numpy as np
import pytest
from numpy.testing import assert_allclose
from Pynite import FEModel3D  # pyright: ignore[reportMissingTypeStubs]
from statics_cases import random_poses

from explorer import PRESETS, Design, compliance, inverse
from explorer.mechanism.kinematics import attachment_points
from explorer.numerics.arrays import FloatArray

OPTIMAL = PRESETS["paper-optimal"]
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
    frame, points = Frame(), attachment_points(design, position, rotation)
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
