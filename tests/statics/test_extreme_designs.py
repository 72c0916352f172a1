"""Forces, payloads and precision of designs with the largest and the smallest allowed numbers.

Warnings are errors in tests: no intermediate result may leave the range of numbers by accident.
"""

from __future__ import annotations

import math
from typing import Any

import msgspec
import numpy as np
import pytest
from numpy.testing import assert_allclose

from explorer import PRESETS, Actuators, Guide, Payload, Struts, Tool
from explorer.errors import DesignError
from explorer.mechanism.design import Design, Limits
from explorer.mechanism.machine import Tolerances
from explorer.mechanism.pose import Pose
from explorer.statics.forces import actuator_forces
from explorer.statics.loaded import LoadedPose
from explorer.statics.tool_precision import ToolPrecision

OPTIMAL = PRESETS["paper-optimal"]
SIZES = (1e-40, 1e-30, 1e-20, 1e-10, 1e-3, 1.0, 10.0, 1e3, 1e10, 1e20, 1e30, 1e40)


class Draw:
    """Random numbers of any allowed size."""

    def __init__(self, seed: int) -> None:
        self.rng = np.random.default_rng(seed)

    def chance(self, share: float) -> bool:
        return bool(self.rng.random() < share)

    def one(self, zeros: int = 0) -> float:
        return float(self.rng.choice((*SIZES, *(0.0,) * zeros)))

    def some(self, count: int, zeros: int = 0) -> tuple[Any, ...]:
        if self.chance(0.4):
            return (self.one(zeros),) * count
        return tuple(self.one(zeros) for _ in range(count))

    def design(self) -> Design | None:
        """Return a design, or None if it is degenerate."""
        rng = self.rng
        x = 10.0 ** rng.uniform(-29.0, 29.0) * np.array(OPTIMAL.variables) / OPTIMAL.reach
        if self.chance(0.5):
            x *= 10.0 ** rng.uniform(-6.0, 6.0, 6)
        reach = math.hypot(*x[:2])
        try:
            return msgspec.structs.replace(
                OPTIMAL,
                unit_mm=self.one() if self.chance(0.3) else 10.0,
                a3=(x[0], x[1]),
                b1=(x[2], x[3]),
                b2=x[4],
                b3=x[5],
                limits=Limits(),
                home=None,
                tool=Tool(tuple(reach * rng.normal(size=3))),
                payload=Payload(self.one(3), tuple(reach * rng.normal(size=3)), self.one(3)),
                actuators=Actuators(
                    self.some(6) if self.chance(0.7) else None,
                    self.some(6) if self.chance(0.5) else None,
                    self.some(6, 3),
                    self.some(6) if self.chance(0.7) else None,
                ),
                struts=Struts(
                    self.one() if self.chance(0.7) else None,
                    0.0,
                    self.one(),
                    self.one() if self.chance(0.5) else None,
                    self.one() if self.chance(0.5) else None,
                ),
                guide=Guide(*(self.one() if self.chance(0.5) else None for _ in range(2))),
                tolerances=Tolerances(
                    guide_tilt_deg=self.some(2, 3),
                    **{
                        name: self.some(3, 3)
                        for name in ("a1", "a3", "guide", "b1", "b2", "b3", "b4")
                    },
                ),
            )
        except DesignError:
            return None

    def pose(self, design: Design) -> Pose:
        rng = self.rng
        position = design.reach * rng.normal(size=3) * 10.0 ** rng.uniform(-6.0, 6.0)
        if self.chance(0.3):
            position *= 10.0 ** rng.uniform(-14.0, 14.0, 3)
        if self.chance(0.3):
            # Down to numbers whose squares vanish.
            position *= 10.0 ** -rng.uniform(0.0, 330.0)
        if self.chance(0.2):
            position[rng.integers(3)] = 0.0
        turn = rng.normal(size=4)
        if self.chance(0.2):
            turn[1:3] = 0.0
        return Pose(tuple(np.clip(position, -1e40, 1e40)), tuple(turn / np.linalg.norm(turn)))

    def load(self) -> Any:
        return tuple(float(self.rng.choice((-1, 1))) * each for each in self.some(6, 3))


@pytest.mark.parametrize("seed", range(8))
def test_no_allowed_number_leaves_the_range_of_numbers_by_accident(seed: int) -> None:
    draw = Draw(seed)
    count = regular = 0
    while count < 150:
        design = draw.design()
        if design is None:
            continue
        count += 1
        loaded = LoadedPose(design, draw.pose(design), draw.load())
        precision = ToolPrecision(loaded)
        numbers = [
            loaded.share,
            loaded.largest_payload,
            loaded.newton.share,
            loaded.worst_force(draw.one()).share,
            precision.largest_displacement,
            *precision.worst()[:2],
            *precision.rms(),
        ]
        assert not np.isnan([float(each) for each in numbers]).any()
        assert not np.isnan(precision.deflection).any()
        assert not np.isnan(precision.principal.displacement).any()
        shares = np.array(precision.shares)
        assert np.isnan(shares).all() or sum(shares) == pytest.approx(1.0)
        if precision.is_regular:
            regular += 1
            assert not np.isnan(precision.ellipsoid.semi_axes).any()
            assert np.isfinite(precision.carriages).all()
    assert regular > 40


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
