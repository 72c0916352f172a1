"""Forces and precision near the singular set, and of designs with tiny and huge numbers.

Warnings are errors in tests: no intermediate result may leave the range of numbers by accident.
"""

from __future__ import annotations

import msgspec
import numpy as np
import pytest
from numpy.testing import assert_allclose

from explorer import PRESETS, Actuators, Guide, Payload, Struts, Tolerances, Tool
from explorer.mechanism.design import Limits
from explorer.mechanism.pose import Pose
from explorer.statics.forces import actuator_forces
from explorer.statics.loaded import LoadedPose
from explorer.statics.tool_precision import ToolPrecision

OPTIMAL = PRESETS["paper-optimal"]


@pytest.mark.parametrize("seed", range(40))
def test_forces_and_precision_of_extreme_designs_and_poses_are_numbers(seed: int) -> None:
    rng = np.random.default_rng(seed)
    variables = 10.0 ** rng.uniform(-9.0, 9.0) * np.array(OPTIMAL.variables)
    design = OPTIMAL.with_variables((variables * 10.0 ** rng.uniform(-2.0, 2.0, 6)).tolist())
    six = tuple((10.0 ** rng.uniform(-9.0, 9.0, 6)).tolist())
    offsets = tuple((10.0 ** rng.uniform(-9.0, 9.0, 3)).tolist())
    design = msgspec.structs.replace(
        design,
        limits=Limits(),
        home=None,
        tool=Tool(tuple((design.reach * rng.normal(size=3)).tolist())),
        payload=Payload(offsets[2], force_n=offsets[0]),
        guide=Guide(*offsets[:2]),
        actuators=Actuators(six, six[::-1], six, six),
        struts=Struts(outer_mm=offsets[0], stress_mpa=offsets[1]),
        tolerances=Tolerances(a1=offsets, b4=offsets),
    )
    # Down to positions whose squares vanish.
    position = design.reach * rng.normal(size=3) * 10.0 ** -rng.choice([0.0, 3.0, 14.0, 200.0])
    turn = rng.normal(size=4) * [1.0, *rng.choice([0.0, 1.0], 2), 1.0]
    pose = Pose(tuple(position.tolist()), tuple(turn.tolist()))
    loaded = LoadedPose(design, pose, six)
    precision = ToolPrecision(loaded)
    numbers = [
        *(loaded.share, loaded.largest_payload, loaded.newton.share, loaded.worst_force(1.0).share),
        *(precision.largest_displacement, *precision.worst()[:2], *precision.rms()),
        *np.ravel(precision.deflection).tolist(),
        *np.ravel(precision.principal.displacement).tolist(),
    ]
    assert not np.isnan([float(each) for each in numbers]).any()
    shares = np.array(precision.shares)
    assert np.isnan(shares).all() or sum(shares) == pytest.approx(1.0)
    if precision.is_regular:
        assert not np.isnan(precision.ellipsoid.semi_axes).any()
        assert np.isfinite(precision.carriages).all()


def test_pose_at_a1_is_singular_and_near_it_forces_grow_as_the_margins_shrink() -> None:
    at = np.array([0.3, 0.5, 0.8])
    rotation = Pose((0.0, 0.0, 0.0), (0.8, 0.1, 0.3, 0.5)).rotation
    forces = {
        size: actuator_forces(OPTIMAL, size * OPTIMAL.reach * at, rotation, (1, 2, 3, 4, 5, 6))
        for size in (1e-12, 1e-20, 1e-25, 1e-27, 1e-100, 1e-200, 1e-320, 0.0)
    }
    # Legs 1 and 4 divide by one margin; legs 2 and 3 hold what these two cause, over another.
    powers = np.array([1, 2, 2, 2, 2, 1])
    for size in (1e-20, 1e-25):
        expected = forces[1e-12] * (1e-12 / size) ** powers
        assert_allclose(forces[size], expected, rtol=1e-8)
    for size in (1e-27, 1e-100, 1e-200, 1e-320, 0.0):
        assert np.isinf(forces[size]).all()
