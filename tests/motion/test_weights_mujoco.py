"""Forces with all weights, judged by MuJoCo: the equilibrium of the model."""

from __future__ import annotations

from typing import Any

import msgspec
import numpy as np
import pytest
from mujoco_models import engine, joints_of, loops_of, random_design
from numpy.testing import assert_allclose
from statics_cases import random_poses

from explorer import PRESETS, Design, Payload, actuator_forces
from explorer.export.simulation import DENSITY, simulation_mjcf
from explorer.mechanism.configuration import Configuration
from explorer.mechanism.design import DOWN
from explorer.mechanism.machine import STANDARD_GRAVITY
from explorer.motion.chains import ACTUATED
from explorer.motion.masses import bar_masses, moving_bodies
from explorer.motion.weights import carry

OPTIMAL = PRESETS["paper-optimal"]
THICK = msgspec.structs.replace(
    OPTIMAL,
    limits=msgspec.structs.replace(OPTIMAL.limits, leg_radii=(0.3, 0.4, 0.5, 0.35)),
    payload=Payload(0.5, (1.0, -2.0, 1.5)),
)
TILTED = msgspec.structs.replace(THICK, gravity=(0.4, -0.5, -0.8))
TOOL = np.array([0.5, 1.0, -2.0])
LOAD = np.array([3.0, -2.0, 4.0, 20.0, -10.0, 5.0])


def apply_load(design: Design, model: Any, data: Any) -> None:
    """Apply the load at the tool, as generalised forces of the model."""
    metres = 1e-3 * design.unit_mm
    platform = data.body("platform")
    base = data.body("base").xmat.reshape(3, 3)
    point = platform.xpos + platform.xmat.reshape(3, 3) @ (metres * TOOL)
    force, moment = base @ LOAD[:3], base @ (metres * LOAD[3:])
    data.qfrc_applied[:] = 0.0
    engine.mj_applyFT(model, data, force, moment, point, platform.id, data.qfrc_applied)


DESIGNS = [THICK, TILTED, *map(random_design, range(4))]


@pytest.mark.parametrize("design", DESIGNS, ids=range(len(DESIGNS)))
def test_forces_with_weights_are_those_of_the_models_equilibrium(design: Design) -> None:
    model = engine.MjModel.from_xml_string(simulation_mjcf(design))
    # Gravity is that of the scene, MuJoCo's own 9.81 m/s².
    model.opt.gravity[:] = STANDARD_GRAVITY * np.array(DOWN)
    weights = moving_bodies(design, bar_masses(design, DENSITY))
    data = engine.MjData(model)
    positions, rotations = random_poses(design, 10, seed=2)
    for position, rotation in zip(positions, rotations, strict=True):
        data.qpos[:] = joints_of(design, position, rotation)
        data.qvel[:] = 0.0
        engine.mj_forward(model, data)
        apply_load(design, model, data)
        # What weights and load leave to the servos and to the ball joints.
        needed = np.array(data.qfrc_bias) - np.array(data.qfrc_applied)
        columns = np.concatenate([np.eye(model.nv)[list(ACTUATED)], loops_of(model, data)[1]]).T
        forces = np.linalg.solve(columns, needed)[:6]
        wrench = LOAD + carry(Configuration(design, position, rotation, TOOL), weights).wrench
        ours = actuator_forces(design, position, rotation, wrench, TOOL)
        assert_allclose(ours, forces, atol=1e-8 * np.abs(forces).max())
