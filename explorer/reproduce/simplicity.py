"""Claims on simplicity and cost: parts and joints of the 4-4 counted beside those of others."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import asdict, dataclass

import numpy as np

from explorer.mechanism.design_file import PRESETS
from explorer.reproduce.claim import Measurement
from explorer.reproduce.six_legs import SixLegs, octahedral, six_four_twin

OPTIMAL = PRESETS["paper-optimal"]

UPS, PRPS = (2, 1, 3), (1, 1, 1, 3)
"""Freedoms of the joints of a leg: universal, prismatic, spherical; and prismatic, revolute,
prismatic, spherical."""


@dataclass(frozen=True)
class Parts:
    """The parts of a mechanism.

    Attributes:
        name: Name of the mechanism.
        legs: Number of legs.
        bodies: Number of moving bodies.
        joints: Number of joints.
        freedoms: Sum of the freedoms of the joints.
        shared: Number of places where the joints of several legs have one centre.
        bent: Number of legs that bear bending.
    """

    name: str
    legs: int
    bodies: int
    joints: int
    freedoms: int
    shared: int
    bent: int

    @property
    def mobility(self) -> int:
        """Degrees of freedom by the formula of Kutzbach and Grübler."""
        return 6 * (self.bodies - self.joints) + self.freedoms


def simplicity() -> Measurement:
    """Count legs, bodies and joints of the 4-4, the 6-4 and an octahedral platform."""
    return judge_simplicity(
        _parts("4-4", (UPS, PRPS, PRPS, UPS), 0),
        [
            _parts("6-4", (UPS,) * 6, _shared(six_four_twin(OPTIMAL, OPTIMAL.a2x))),
            _parts("octahedral", (UPS,) * 6, _shared(octahedral(OPTIMAL))),
        ],
    )


def judge_simplicity(ours: Parts, others: Sequence[Parts]) -> Measurement:
    """Return the measurement of the counts."""
    heads = ("legs", "bodies", "joints", "freedoms", "shared", "bent", "dof")
    lines = [f"{'':12}" + "".join(f"{head:>10}" for head in heads)]
    for p in (ours, *others):
        counts = (p.legs, p.bodies, p.joints, p.freedoms, p.shared, p.bent, p.mobility)
        lines.append(f"{p.name:12}" + "".join(f"{count:10}" for count in counts))
    text = (
        f"The 4-4 has {ours.legs} legs, {ours.bodies} moving bodies and {ours.joints} joints, "
        f"{ours.shared} centres common to several joints, and {ours.bent} legs that bear bending; "
        + "; ".join(
            f"the {p.name} has {p.legs}, {p.bodies}, {p.joints}, {p.shared} and {p.bent}"
            for p in others
        )
        + ". Robots with three legs, two actuators in each, have fewer parts still."
    )
    values = {"mechanisms": [asdict(p) for p in (ours, *others)]}
    if all(ours.bodies < p.bodies and ours.joints < p.joints for p in others):
        condition = "in bodies and joints, beside the 6-4 and the octahedral platform"
        return Measurement(text, "confirmed within", values, tuple(lines), condition)
    return Measurement(text, "not confirmed", values, tuple(lines))


def cost() -> Measurement:
    """Say why the cost cannot be tested."""
    return Measurement(
        "The paper prints no parts list, material, tolerance or price, neither of its prototype "
        "nor of another design.",
        "not testable from the paper",
    )


def _parts(name: str, legs: tuple[tuple[int, ...], ...], shared: int) -> Parts:
    """Return the parts of a mechanism whose legs are chains of joints with these freedoms."""
    joints = sum(map(len, legs))
    bodies = 1 + sum(len(leg) - 1 for leg in legs)
    return Parts(name, len(legs), bodies, joints, sum(map(sum, legs)), shared, legs.count(PRPS))


def _shared(mechanism: SixLegs) -> int:
    """Return the number of points in which several legs have a joint."""
    count = 0
    for points in (mechanism.base, mechanism.platform):
        _, times = np.unique(points, axis=0, return_counts=True)
        count += int((times > 1).sum())
    return count
