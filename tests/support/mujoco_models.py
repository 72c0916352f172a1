"""Models in MuJoCo: their state at a keyframe, and the constraints that close their loops."""

from __future__ import annotations

from typing import Any

import mujoco  # pyright: ignore[reportMissingTypeStubs]
import numpy as np

from explorer.numerics.arrays import FloatArray

engine: Any = mujoco


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
