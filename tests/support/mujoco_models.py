"""Models in MuJoCo: their state at a keyframe, and the constraints that close their loops."""

from __future__ import annotations

from typing import Any

import msgspec
import mujoco  # pyright: ignore[reportMissingTypeStubs]
import numpy as np

from explorer import PRESETS, Payload
from explorer.mechanism.design import JOINTS, VARIABLES, Design
from explorer.mechanism.pose import quaternion_from_rotation
from explorer.motion.chains import BODIES, CHAIN_JOINTS, Chains
from explorer.numerics.arrays import FloatArray

engine: Any = mujoco


OPTIMAL = PRESETS["paper-optimal"]


def random_design(seed: int) -> Design:
    """Return a design about the optimum, with random payload, gravity and radii of the legs."""
    rng = np.random.default_rng(seed)
    design = OPTIMAL
    for name, value in zip(VARIABLES, design.variables, strict=True):
        design = design.with_variable(name, value * rng.uniform(0.8, 1.2))
    limits = msgspec.structs.replace(design.limits, leg_radii=tuple(rng.uniform(0.1, 0.6, 4)))
    return msgspec.structs.replace(
        design,
        limits=limits,
        unit_mm=float(rng.choice([5.0, 10.0, 40.0])),
        payload=Payload(
            rng.uniform(0.1, 3.0),
            tuple(rng.normal(size=3) * 2.0),
            inertia_kg_mm2=tuple(rng.uniform(0.5, 1.0, 3) * 1e3),
        ),
        gravity=tuple(rng.normal(size=3)),
    )


def at_home(model: Any, key: str = "home") -> Any:
    """Return the data of a model at a keyframe."""
    data = engine.MjData(model)
    engine.mj_resetDataKeyframe(model, data, model.key(key).id)
    engine.mj_forward(model, data)
    return data


def loops_of(model: Any, data: Any) -> tuple[FloatArray, FloatArray]:
    """Return the residuals (9,) of three ball joints, in metres, and their Jacobian (9, 15)."""
    own = np.array(data.efc_type) == int(engine.mjtConstraint.mjCNSTR_EQUALITY)
    assert own.sum() == 9
    dense = np.zeros((data.nefc, model.nv))
    if engine.mj_isSparse(model):
        engine.mju_sparse2dense(
            dense, data.efc_J, data.efc_J_rownnz, data.efc_J_rowadr, data.efc_J_colind
        )
    else:
        dense[:] = np.array(data.efc_J).reshape(dense.shape)
    return np.array(data.efc_pos)[own], dense[own]


def joints_of(design: Design, position: FloatArray, rotation: FloatArray) -> FloatArray:
    """Return the joint values of the model in a pose (MuJoCo's `qpos`), shape (..., 16).

    The values are the joints of the four chains, in the order of `SIMULATION_JOINTS`: actuated
    ones are lengths in metres, the others angles from home. Then comes the quaternion (w, x, y, z)
    of the platform's ball joint, its rotation from home.

    Args:
        design: The manipulator.
        position: Position of b4 in the base frame, shape (..., 3), in design units.
        rotation: Rotation from platform to base, shape (..., 3, 3).
    """
    chains, home = Chains.of(design), design.home_pose
    values_at_home = chains.joints(home.position, home.rotation)
    joints = chains.joints(position, rotation)
    is_actuated = np.isin(CHAIN_JOINTS, JOINTS)
    values = np.where(is_actuated, 1e-3 * design.unit_mm * joints, joints - values_at_home)
    holder = BODIES.index("rod 4")
    start = chains.places(values_at_home, home.position, home.rotation).rotation[holder]
    rod = chains.places(joints, position, rotation).rotation[..., holder, :, :]
    ball = home.rotation.T @ start @ np.swapaxes(rod, -1, -2) @ rotation
    return np.concatenate([values, quaternion_from_rotation(ball)], axis=-1)
