"""The largest acceleration in every direction, judged by linear programmes and inverse dynamics."""

from __future__ import annotations

import msgspec
import numpy as np
import pytest
from machines import FULL, six
from mujoco_models import random_design
from numpy.testing import assert_allclose
from scipy.optimize import linprog
from statics_cases import random_poses

from explorer import Actuators, Configuration, Design, Guide, Payload, Struts, inverse_dynamics
from explorer.mechanism.pose import Pose
from explorer.motion.weights import MovingBodies, carry
from explorer.numerics.arrays import FloatArray
from explorer.statics.reactions import (
    largest_accelerations,
    largest_payload,
    limit_shares,
    reactions,
)

REST = np.zeros(6)


def machine(seed: int) -> Design:
    """Return a random design with a payload off b4, and limits of which no two are alike."""
    rng = np.random.default_rng(seed)
    return msgspec.structs.replace(
        random_design(seed),
        payload=Payload(float(rng.uniform(0.2, 3.0)), tuple(rng.normal(size=3).tolist()), 5.0),
        gravity=tuple(rng.normal(size=3).tolist()),
        actuators=Actuators(six(rng.uniform(20.0, 300.0, 6)), six(rng.uniform(20.0, 300.0, 6))),
        struts=Struts(moment_nm=float(rng.uniform(2.0, 40.0))),
        guide=Guide(float(rng.uniform(20.0, 300.0)), float(rng.uniform(2.0, 40.0))),
    )


def straight(accelerations: FloatArray, design: Design) -> FloatArray:
    """Return accelerations (n, 3) in m/s² as those of a platform that does not turn, (n, 6)."""
    return 1e3 / design.unit_mm * np.pad(accelerations, ((0, 0), (0, 3)))


@pytest.mark.parametrize("seed", range(6))
def test_largest_acceleration_is_that_of_linear_programmes(seed: int) -> None:
    full = machine(seed)
    payload = msgspec.structs.replace(full.payload, force_n=0.0)
    design = msgspec.structs.replace(full, payload=payload, struts=Struts(), guide=Guide())
    push, pull = design.actuators.limits
    units = straight(np.vstack([np.zeros(3), np.eye(3)]), design)
    for pose in zip(*random_poses(design, 12), strict=True):
        radius = float(largest_accelerations(Configuration(design, *pose)).min())
        forces = inverse_dynamics(design, *pose, REST, units, legs=False)
        rows = (forces[1:] - forces[0]).T
        sides, room = np.vstack([rows, -rows]), np.concatenate([push - forces[0], pull + forces[0]])
        lengths = np.linalg.norm(sides, axis=1)
        if radius < 0.0:
            # The acceleration that meets the limit missed by most lies so far away.
            assert_allclose(radius, (room / lengths).min(), rtol=1e-6)
            continue
        ways = np.vstack(
            [sides / lengths[:, None], np.random.default_rng(seed).normal(size=(9, 3))]
        )
        found = [linprog([-1.0], (sides @ way)[:, None], room, bounds=(0, None)) for way in ways]
        most = [-(each.fun or 0.0) for each in found] * np.linalg.norm(ways, axis=1)
        assert_allclose(min(most), radius, rtol=1e-6)


@pytest.mark.parametrize("seed", range(6))
def test_accelerations_up_to_the_largest_keep_all_limits(seed: int) -> None:
    design, ways = machine(seed), np.random.default_rng(seed).normal(size=(20000, 3))
    ways /= np.linalg.norm(ways, axis=1, keepdims=True)
    bodies = MovingBodies().with_payload(design)
    for pose in zip(*random_poses(design, 12), strict=True):
        c = Configuration(design, *pose, design.tool.position)
        radius = float(largest_accelerations(c).min())
        assert (radius >= 0.0) == (float(largest_payload(c)) >= design.payload.mass_kg)
        for factor in (0.999, 1.02):
            moving = carry(c, bodies, REST, straight(factor * radius * ways, design))
            worst = float(limit_shares(design, reactions(c, REST, moving)).max())
            assert (worst <= 1.0) == (radius > 0.0 and factor < 1.0), (radius, factor, worst)


def test_machine_of_more_mass_and_strength_accelerates_alike() -> None:
    poses, own, guide = random_poses(FULL, 100), FULL.payload, FULL.guide
    strong = msgspec.structs.replace(
        FULL,
        payload=Payload(3.0 * own.mass_kg, own.centre, 3.0 * own.force_n),
        actuators=Actuators(*(six(3.0 * limit) for limit in FULL.actuators.limits)),
        struts=Struts(moment_nm=3.0 * FULL.struts.largest_moment),
        guide=Guide(3.0 * (guide.force_n or 0.0), 3.0 * (guide.moment_nm or 0.0)),
    )
    one, other = (largest_accelerations(Configuration(each, *poses)) for each in (FULL, strong))
    assert_allclose(other, one, rtol=1e-12)
    singular = Configuration.at(FULL, Pose((*FULL.a3, 0.0), FULL.home_pose.quaternion))
    assert np.isneginf(largest_accelerations(singular)).all()
