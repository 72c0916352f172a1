"""Measures of loads and precision over the required box: samples, needs, singular boxes."""

from __future__ import annotations

import math

import msgspec
import numpy as np
import pytest
from machines import PRECISE
from scipy.spatial.transform import Rotation

from explorer import PRESETS, Design, Guide, Pose, deflection, reactions
from explorer.measures.catalogue import CATALOGUE, measure_design, measures_in, reason_for_missing
from explorer.measures.measure import Case
from explorer.mechanism.configuration import Configuration
from explorer.mechanism.design import VARIABLES
from explorer.motion.weights import MovingBodies, payload_wrench
from explorer.numerics.number_text import Unit
from explorer.statics.accuracy import actuator_errors, worst_errors
from explorer.statics.compliance import compliance_of, stiffness_of
from explorer.statics.reactions import largest_accelerations, limit_shares

OPTIMAL = PRESETS["paper-optimal"]
BOX = ((9.0, 4.0, 8.0), (11.0, 6.0, 10.0))
NAMES = (
    *("load_share", "worst_actuator", "largest_payload"),
    *("acceleration", "largest_bending", "worst_error", "worst_turn", "softest_compliance"),
    "deflection",
)
WITH_GRADIENT = tuple(name for name in NAMES if name not in ("worst_actuator", "largest_payload"))


def values(
    design: Design, box: tuple[tuple[float, ...], ...] | None = BOX
) -> dict[str, float | None]:
    found = measure_design(Case(design, box=box), measures_in("optimise"))  # pyright: ignore[reportArgumentType]
    return {name: found.values[name] for name in NAMES if name in found.values}


def test_measures_of_statics_bound_those_of_samples_in_the_box() -> None:
    found = {name: value or math.nan for name, value in values(PRECISE).items()}
    assert tuple(found) == NAMES
    units = [CATALOGUE[name].unit_in(Unit("mm", 1.0)).name for name in NAMES]
    assert units == ["", "", "kg", "m/s²", "N m", "mm", "°", "mm/N", "mm"]
    rotation = PRECISE.home_pose.rotation
    positions = np.random.default_rng(1).uniform(*BOX, (1000, 3))
    given = PRECISE, positions, rotation
    held = reactions(Configuration(*given), np.zeros(6), MovingBodies().with_payload(PRECISE))
    shares = limit_shares(PRECISE, held)
    poses = Configuration(*given, PRECISE.tool.position)
    soft = compliance_of(poses, *stiffness_of(PRECISE))
    worst = worst_errors(poses, actuator_errors(PRECISE))
    bent = deflection(soft, payload_wrench(PRECISE, rotation))
    sampled = {
        "load_share": shares.max(),
        "largest_bending": held.bending.max() * 1e-3 * PRECISE.unit_mm,
        "worst_error": worst.displacement.max(),
        "softest_compliance": np.linalg.norm(soft[:, :3, :3], 2, axis=(1, 2)).max()
        * PRECISE.unit_mm,
        "worst_turn": np.degrees(worst.turn.max()),
        "deflection": np.linalg.norm(bent[:, :3], axis=1).max(),
    }
    for name, value in sampled.items():
        # The largest values lie at the border of the box, most of them at a corner.
        assert 0.7 * found[name] < value <= 1.001 * found[name], name
    assert found["worst_actuator"] == shares[:, :6].max(axis=0).argmax() + 1
    accelerations = largest_accelerations(poses).min()
    assert found["acceleration"] <= accelerations < 1.3 * found["acceleration"]
    # Without another load, shares are proportional to the mass.
    assert found["largest_payload"] == pytest.approx(0.6 / found["load_share"], rel=1e-9)


def test_measures_of_statics_need_a_box_and_the_parts_of_a_machine() -> None:
    assert values(OPTIMAL) == {}
    assert values(PRECISE, None) == {}
    parts = {
        "payload": ["largest_bending"],
        "struts": ["largest_payload", "softest_compliance"],
        "actuators": ["largest_payload", "worst_error", "worst_turn", "softest_compliance"],
    }
    for part, names in parts.items():
        design = msgspec.structs.replace(OPTIMAL, **{part: getattr(PRECISE, part)})
        assert list(values(design)) == names
    guided = msgspec.structs.replace(OPTIMAL, guide=Guide(force_n=10.0))
    assert list(values(guided)) == ["largest_payload"]


def test_measures_of_statics_in_a_singular_box_are_none_with_a_reason() -> None:
    box = ((9.0, 4.0, -1.0), (11.0, 6.0, 10.0))
    found = values(PRECISE, box)
    assert found.pop("largest_payload") == 0.0
    assert set(found.values()) == {None}
    case = Case(PRECISE, box=box)
    measured = measure_design(case, NAMES)
    assert "the required box has singular positions" in reason_for_missing(case, measured)
    for name in WITH_GRADIENT:
        gradient = CATALOGUE[name].gradient
        assert gradient is not None
        assert gradient(case) == {}


@pytest.mark.parametrize("prefix", ["home_", ""])
@pytest.mark.parametrize("seed", range(2))
def test_gradients_of_statics_match_central_differences(seed: int, prefix: str) -> None:
    rng = np.random.default_rng(seed)
    force = float(rng.uniform(0.0, 20.0)) if seed % 2 else 0.0
    design = msgspec.structs.replace(
        PRECISE.with_variables((PRECISE.variables + rng.uniform(-0.5, 0.5, 6)).tolist()),
        payload=msgspec.structs.replace(PRECISE.payload, force_n=force),
        guide=Guide(moment_nm=float(rng.uniform(1.0, 30.0))),
        gravity=tuple(rng.normal(size=3).tolist()),
    )
    home = Pose.of_yaw_pitch_roll((10.0, 5.0, 9.0), (-73.0, 4.0, -6.0))
    step = 1e-6

    def value(name: str, changed: Design, yaw: float = 0.0) -> float:
        r = Rotation.from_rotvec([0.0, 0.0, yaw]).as_matrix() @ home.rotation
        at = msgspec.structs.replace(changed, home=Pose.of(home.position, r))
        return CATALOGUE[name].function(Case(at, box=BOX))

    for kind in WITH_GRADIENT:
        name = f"{prefix}{kind}"
        gradient = CATALOGUE[name].gradient
        assert gradient is not None
        found = gradient(Case(msgspec.structs.replace(design, home=home), box=BOX))
        assert set(found) == {*VARIABLES, "yaw"}
        size = max(map(abs, found.values()))
        assert size > 0.0
        for parameter, own in zip(VARIABLES, design.variables, strict=True):
            ends = [design.with_variable(parameter, own + side * step) for side in (-1.0, 1.0)]
            low, high = (value(name, end) for end in ends)
            expected = (high - low) / (2.0 * step)
            assert found[parameter] == pytest.approx(expected, abs=1e-5 * size), parameter
        low, high = (value(name, design, side * step) for side in (-1.0, 1.0))
        assert found["yaw"] == pytest.approx((high - low) / (2.0 * step), abs=1e-5 * size)
