"""Random machines with tool, payload, gravity and limits, random weights, and short moves."""

from __future__ import annotations

import msgspec
import numpy as np
from scipy.spatial.transform import Rotation

from explorer import Actuators, Design, Guide, Payload, Pose, Struts, Tool
from explorer.mechanism.design import VARIABLES
from explorer.statics.weights import Weights


def random_machine(design: Design, seed: int, strength: float = 1.0) -> Design:
    """Return a design with variables near those given, and a random machine around it.

    Args:
        design: The design without a machine.
        seed: Seed of the random numbers.
        strength: Factor of all limits.
    """
    rng = np.random.default_rng(seed)
    for name, value in zip(VARIABLES, design.variables, strict=True):
        design = design.with_variable(name, value * rng.uniform(0.9, 1.1))

    def three() -> tuple[float, float, float]:
        x, y, z = rng.normal(size=3).tolist()
        return x, y, z

    def six() -> tuple[float, float, float, float, float, float]:
        a, b, c, d, e, f = (strength * rng.uniform(50.0, 150.0, 6)).tolist()
        return a, b, c, d, e, f

    return msgspec.structs.replace(
        design,
        unit_mm=float(rng.choice([5.0, 10.0, 40.0])),
        tool=Tool(three()),
        payload=Payload(float(rng.uniform(0.0, 5.0)), three(), float(rng.choice([0.0, 10.0]))),
        gravity=three(),
        actuators=Actuators(six(), six()),
        struts=Struts(moment_nm=strength * float(rng.uniform(1.0, 3.0))),
        guide=Guide(
            strength * float(rng.uniform(50.0, 150.0)), strength * float(rng.uniform(1.0, 3.0))
        ),
    )


def random_weights(design: Design, seed: int) -> Weights:
    """Return weights of all bodies of a design, its payload included."""
    rng = np.random.default_rng([1, seed])

    def four() -> tuple[float, float, float, float]:
        a, b, c, d = rng.uniform(0.0, 2.0, 4).tolist()
        return a, b, c, d

    return Weights(
        on_platform=(design.payload, Payload(1.0, (1.0, 2.0, 3.0))),
        carriages=four(),
        cylinders=four(),
        cylinder_centres=four(),
        rods=four(),
        rod_centres=four(),
    )


def random_move(pose: Pose, seed: int, size: float, angle: float) -> tuple[Pose, Pose]:
    """Return two poses near a pose, by distances of about `size` and turns of about `angle`."""
    rng = np.random.default_rng([2, seed])
    first, last = (
        Pose.of(
            np.array(pose.position) + size * rng.normal(size=3),
            Rotation.from_rotvec(angle * rng.normal(size=3)).as_matrix() @ pose.rotation,
        )
        for _ in range(2)
    )
    return first, last
