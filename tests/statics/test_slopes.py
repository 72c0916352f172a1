"""The derivatives of J⁻¹ at the tool, beside central differences over random designs."""

from __future__ import annotations

import msgspec
import numpy as np
import pytest
from numpy.testing import assert_allclose
from scipy.spatial.transform import Rotation

from explorer import Design, Tool, inverse
from explorer.numerics.arrays import FloatArray
from explorer.statics.equilibrium import twists_of_actuators
from explorer.statics.slopes import PARAMETERS, twist_slopes

STEP = 1e-5


def random_case(seed: int) -> tuple[Design, FloatArray, FloatArray]:
    """Return a random design with a tool, positions and a rotation."""
    random = np.random.default_rng(seed)
    a3 = tuple(random.uniform(6.0, 14.0, 2).tolist())
    b1 = tuple((random.choice((-1.0, 1.0), 2) * random.uniform(2.0, 5.0, 2)).tolist())
    b2, gap = random.uniform(-2.0, 2.0), random.uniform(1.0, 4.0)
    design = Design(a3=a3, b1=b1, b2=b2, b3=b2 + gap)
    tool = Tool(tuple(random.normal(size=3).tolist()))
    rotation = Rotation.from_euler("zyx", random.uniform(-1.2, 1.2, 3)).as_matrix()
    positions = random.uniform((2.0, 2.0, 5.0), (12.0, 8.0, 12.0), (8, 3))
    return msgspec.structs.replace(design, tool=tool), positions, rotation


@pytest.mark.parametrize("seed", range(6))
def test_slopes_match_central_differences(seed: int) -> None:
    design, positions, rotation = random_case(seed)
    slopes = twist_slopes(design, positions, rotation)

    def moved(index: int, step: float) -> tuple[FloatArray, FloatArray]:
        variables, at, r = list(design.variables), positions.copy(), rotation
        if index < len(variables):
            variables[index] += step
        elif PARAMETERS[index] == "yaw":
            r = Rotation.from_rotvec([0.0, 0.0, step]).as_matrix() @ rotation
        else:
            at[:, "xyz".index(PARAMETERS[index])] += step
        changed = design.with_variables(variables)
        twists = twists_of_actuators(changed, at, r, design.tool.position)
        return twists, inverse(changed, at, r)[:, [2, 4]]

    for index in range(len(PARAMETERS)):
        ahead, behind = moved(index, STEP), moved(index, -STEP)
        twists, struts = ((a - b) / (2.0 * STEP) for a, b in zip(ahead, behind, strict=True))
        size = np.abs(slopes.twists).max() ** 2 + 1.0
        assert_allclose(slopes.by[:, index], twists, rtol=1e-6, atol=1e-7 * size)
        assert_allclose(slopes.struts_by[:, index], struts, rtol=1e-6, atol=1e-8)
