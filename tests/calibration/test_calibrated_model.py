"""A model in MuJoCo is the machine that is measured: what is identified from it holds elsewhere."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from measured_machines import ELSEWHERE, POSES, TYPICAL, design_itself, rms, with_errors
from mujoco_models import at_home, engine, joints_of, loops_of

from explorer import BuiltMachine, calibrate, calibration_poses
from explorer.export.simulation import simulation_mjcf
from explorer.mechanism.configuration import Configuration
from explorer.motion.chains import ACTUATED
from explorer.numerics.arrays import FloatArray
from explorer.prototype.imperfect import ImperfectMachine

METRES = 1e-3 * TYPICAL.unit_mm
PASSIVE = np.setdiff1d(np.arange(15), ACTUATED)


def poses_of_model(model: Any, poses: Configuration, readings: FloatArray) -> Configuration:
    """Return the poses of a model's platform where its encoders read joints, shape (n, 6).

    The passive joints close the loops by Newton's method, from poses (n) nearby.
    """
    data = at_home(model)
    positions, rotations = np.empty((len(readings), 3)), np.empty((len(readings), 3, 3))
    starts = joints_of(TYPICAL, poses.position, poses.rotation)
    for k, (start, joints) in enumerate(zip(starts, readings, strict=True)):
        data.qpos[:] = start
        data.qpos[list(ACTUATED)] = METRES * joints
        for _ in range(8):
            engine.mj_forward(model, data)
            residuals, slopes = loops_of(model, data)
            move = np.zeros(15)
            move[PASSIVE] = np.linalg.solve(slopes[:, PASSIVE], -residuals)
            engine.mj_integratePos(model, data.qpos, move, 1.0)
        engine.mj_forward(model, data)
        assert np.abs(loops_of(model, data)[0]).max() < 1e-12
        platform = data.body("platform")
        positions[k], rotations[k] = platform.xpos / METRES, platform.xmat.reshape(3, 3)
    return Configuration(TYPICAL, positions, rotations)


@pytest.mark.parametrize("seed", [0, 1, 7])
def test_calibrated_controller_brings_the_model_where_it_should(seed: int) -> None:
    model = engine.MjModel.from_xml_string(simulation_mjcf(ImperfectMachine.draw(TYPICAL, seed)))
    # Limits of lengths are no part of the kinematics.
    model.opt.disableflags |= int(engine.mjtDisableBit.mjDSBL_LIMIT)
    asked = calibration_poses(TYPICAL, 30, POSES)
    readings = asked.joints
    there = poses_of_model(model, asked, readings)
    exact = replace(POSES, values=POSES.model(there.position, there.rotation, np.zeros(0)))
    found = calibrate(TYPICAL, readings, with_errors(exact, np.random.default_rng(seed)))
    assert found.seen == 30
    assert abs(found.excess) < 3.0
    held_out = Configuration(TYPICAL, ELSEWHERE.position[:40], ELSEWHERE.rotation[:40])

    def off(known: BuiltMachine) -> float:
        commands = known.inverse(held_out.position, held_out.rotation)
        reached = poses_of_model(model, held_out, commands)
        sizes = np.linalg.norm(reached.position - held_out.position, axis=1)
        return rms(sizes) * TYPICAL.unit_mm

    assert off(design_itself()) > 0.4
    assert off(found.machine) < 0.01
