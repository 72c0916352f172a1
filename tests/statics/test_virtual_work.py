"""Laws of virtual work: forces against rates, kinetic energy against power, and unit forces."""

from __future__ import annotations

import msgspec
import numpy as np
from hypothesis import assume, given, strategies as st
from numpy.testing import assert_allclose
from smooth_motion import derivatives, random_motions
from strategies import Case, ordinary_cases

from explorer import PRESETS, Configuration, Payload, Tool, inverse_dynamics, joint_rates
from explorer.motion.inverse_jacobian import forces_of
from explorer.numerics.arrays import FloatArray
from explorer.statics.reactions import reactions

OPTIMAL = msgspec.structs.replace(
    PRESETS["paper-optimal"], payload=Payload(0.5, (1.0, -2.0, 1.5), inertia_kg_mm2=(3.0, 5.0, 4.0))
)
sixes = st.tuples(*[st.floats(-5.0, 5.0)] * 6).map(np.array)
points = st.tuples(*[st.floats(-5.0, 5.0)] * 3).map(np.array)


@given(ordinary_cases(), sixes, sixes, points)
def test_power_of_forces_and_load_is_zero_in_every_twist(
    case: Case, load: FloatArray, twist: FloatArray, tool: FloatArray
) -> None:
    assume(case.regularity > 1e-6)
    at = case.at.with_tool(tool)
    powers = forces_of(at, load) * (at.jacobian @ twist)
    assert_allclose(powers.sum(), -load @ twist, atol=1e-8 * np.abs(powers).max() + 1e-9)


@given(st.integers(0, 2**32 - 1))
def test_power_of_inverse_dynamics_is_the_rate_of_energy_of_a_symmetric_inertia(seed: int) -> None:
    motion, other = random_motions(OPTIMAL, 2, seed, rate=2.0).each()
    rest = np.zeros(6)

    def forces(pose: tuple[FloatArray, FloatArray], rate: FloatArray) -> FloatArray:
        """Return the forces that accelerate all bodies from rest, without those at rest."""
        still = inverse_dynamics(OPTIMAL, *pose, rest, rest)
        return inverse_dynamics(OPTIMAL, *pose, rest, rate) - still

    def energy(time: float) -> FloatArray:
        pose, twist = motion.pose_at(time), motion.twist + time * motion.acceleration
        return 0.5 * joint_rates(OPTIMAL, *pose, twist) @ forces(pose, twist)

    pose = motion.position, motion.rotation
    rates, others = (joint_rates(OPTIMAL, *pose, each.twist) for each in (motion, other))
    here = float(energy(0.0))
    assert here > 0.0
    symmetric = rates @ forces(pose, other.twist), others @ forces(pose, motion.twist)
    assert_allclose(*symmetric, rtol=1e-9, atol=1e-9 * here)
    powers = rates * inverse_dynamics(OPTIMAL, *motion)
    held = rates @ inverse_dynamics(OPTIMAL, *pose, rest, rest)
    change, _ = derivatives(energy, step=0.01)
    assert_allclose(powers.sum(), held + change, atol=1e-6 * np.abs(powers).max())


@given(ordinary_cases(), sixes, points, points)
def test_spread_bounds_the_change_by_a_force_of_any_direction_and_is_met_by_one(
    case: Case, load: FloatArray, tool: FloatArray, force: FloatArray
) -> None:
    assume(case.regularity > 1e-6 and np.linalg.norm(force) > 0.1)
    payload = Payload(force_n=float(np.linalg.norm(force)))
    design = msgspec.structs.replace(case.design, tool=Tool(tuple(tool.tolist())), payload=payload)
    at = Configuration(design, case.position, case.rotation, tool)
    held = reactions(at, load)
    # The gradient of an actuator's force is along its worst direction.
    units = np.array([reactions(at, np.eye(6)[axis]).actuators for axis in range(3)]).T
    sizes = np.maximum(np.linalg.norm(units, axis=1), 1e-300)
    worst = payload.force_n * units / sizes[:, None]
    pushed = reactions(at, load + np.pad(np.vstack([force, worst]), ((0, 0), (0, 3))))
    spread, size = held.spread[:6], 1e-8 * (np.abs(pushed.actuators).max() + 1.0)
    changes = pushed.actuators - held.actuators
    assert (np.abs(changes) <= spread + size).all()
    assert_allclose(changes[1:].diagonal(), spread, atol=size)
    across = np.abs(pushed.bending - held.bending)
    assert (across <= held.spread[6:8] + size * np.abs(at.joints).max()).all()
