"""The machine around the mechanism: values that are usable or refused, and what follows."""

from __future__ import annotations

import json
import math
from typing import Any

import msgspec
import numpy as np
import pytest
from hypothesis import given, strategies as st
from hypothesis.extra import numpy as hnp
from refusals import refusal

from explorer import PRESETS, Design, decode_design, encode_design
from explorer.errors import DesignError
from explorer.mechanism.machine import DIMENSIONS, Guide, Payload, Struts, Tolerances, Tool
from explorer.numerics.arrays import FloatArray

OPTIMAL = PRESETS["paper-optimal"]
SIX = [1.0, 2.0, 3.0, 4.0, 5.0, 6.0]


def decode(**fields: Any) -> Design:
    """Return the optimal design with other fields, read from the text of a file."""
    given: dict[str, Any] = json.loads(encode_design(OPTIMAL)) | fields
    return decode_design(json.dumps(given).encode(), "some.json")


@pytest.mark.parametrize(
    ("fields", "words"),
    [
        ({"tool": {"position": [20_000, 0, 0]}}, "tool.position must lie within 100 reaches"),
        ({"tool": {"position": [0, 0]}}, "tool.position"),
        ({"tool": {"quaternion": [0, 0, 0, 0]}}, "tool.quaternion must not be all zeros"),
        ({"tool": {"offset": 1}}, "offset in tool is unknown"),
        ({"payload": {"mass_kg": -1}}, "payload.mass_kg must not be negative; got -1"),
        ({"payload": {"centre": [0, 1e5, 0]}}, "payload.centre must lie within"),
        ({"payload": {"inertia_kg_mm2": [1, -1, 1]}}, "payload.inertia_kg_mm2 must not be neg"),
        (
            {"payload": {"mass_kg": 1, "inertia_kg_mm2": [1e6, 0, 0]}},
            "payload.inertia_kg_mm2 has a moment above the sum of the other two, 0, as no body has",
        ),
        ({"payload": {"mass_kg": 1, "inertia_kg_mm2": [2, 3, 5.001]}}, "two, 5, as no body has"),
        (
            {"payload": {"inertia_kg_mm2": [3, 4, 5]}},
            "payload.inertia_kg_mm2 must be zero without a mass; state payload.mass_kg too",
        ),
        ({"payload": None}, "payload"),
        ({"gravity": [0, 0, 0]}, "gravity must not be all zeros"),
        ({"gravity": [0, 0]}, "gravity"),
        ({"actuators": {"push_n": [0, *SIX[1:]]}}, "actuators.push_n must be positive; got 0"),
        ({"actuators": {"pull_n": [-1, *SIX[1:]]}}, "actuators.pull_n must be positive"),
        ({"actuators": {"push_n": SIX[1:]}}, "actuators.push_n"),
        ({"actuators": {"error_mm": [-1, *SIX[1:]]}}, "actuators.error_mm must not be negative"),
        ({"actuators": {"stiffness_n_mm": [0] * 6}}, "actuators.stiffness_n_mm must be positive"),
        ({"actuators": {"speed_mm_s": [0] * 6}}, "actuators.speed_mm_s must be positive; got 0"),
        ({"actuators": {"acceleration_mm_s2": SIX[1:]}}, "actuators.acceleration_mm_s2"),
        ({"actuators": {"continuous_n": [-1] * 6}}, "actuators.continuous_n must be positive"),
        ({"struts": {"outer_mm": 0}}, "struts.outer_mm must be positive"),
        ({"struts": {"outer_mm": 8, "inner_mm": 8}}, "below the outer diameter 8"),
        ({"struts": {"moment_nm": 0}}, "struts.moment_nm must be positive"),
        ({"struts": {"modulus_gpa": 0}}, "struts.modulus_gpa must be positive"),
        ({"guide": {"force_n": 0}}, "guide.force_n must be positive"),
        ({"guide": {"moment_nm": -2}}, "guide.moment_nm must be positive"),
        ({"tolerances": {"b1": [0, -1, 0]}}, "tolerances.b1 must not be negative"),
        ({"tolerances": {"guide_tilt_deg": [0, 0, 0]}}, "tolerances.guide_tilt_deg"),
    ],
)
def test_machine_unusable_value_is_refused_by_its_name(fields: dict[str, Any], words: str) -> None:
    assert words in refusal(lambda: decode(**fields), kind=DesignError)


@given(st.floats(1e-6, 1e3), hnp.arrays(np.float64, (4, 3), elements=st.floats(-1e3, 1e3)))
def test_payload_has_the_moments_of_any_body(mass_kg: float, points: FloatArray) -> None:
    squares = (points * points).sum(axis=0)
    moments = mass_kg * (squares.sum() - squares)
    payload = Payload(mass_kg, inertia_kg_mm2=tuple(moments.tolist()))
    assert payload.inertia_kg_mm2 == tuple(moments.tolist())


@pytest.mark.parametrize("odd", [math.nan, math.inf, "1", True, 10**400])
def test_machine_value_that_is_no_finite_number_is_refused(odd: Any) -> None:
    refusal(lambda: Payload(mass_kg=odd), kind=DesignError)
    refusal(lambda: Tool(position=(0.0, odd, 0.0)), kind=DesignError)
    refusal(lambda: Guide(force_n=odd), kind=DesignError)
    refusal(lambda: msgspec.structs.replace(OPTIMAL, payload=odd), kind=DesignError)
    refusal(lambda: Struts(stress_mpa=odd), kind=DesignError)
    refusal(lambda: msgspec.structs.replace(OPTIMAL, gravity=(0.0, 0.0, odd)), kind=DesignError)


def test_machine_has_unit_vectors_and_pulls_as_it_pushes_unless_it_states_more() -> None:
    design = decode(tool={"quaternion": [1, 2, 3, 4]}, gravity=[1, -2, 3])
    assert math.hypot(*design.gravity) == pytest.approx(1.0, rel=1e-15)
    assert math.hypot(*design.tool.quaternion) == pytest.approx(1.0, rel=1e-15)
    assert np.isinf(design.actuators.limits).all()
    push, pull = decode(actuators={"push_n": SIX}).actuators.limits
    np.testing.assert_array_equal(push, pull)


def test_struts_largest_moment_is_that_of_a_tube() -> None:
    # A tube of 10 and 8 mm: I = 289.8 mm⁴, W = 57.96 mm³, at 200 MPa 11.59 N m.
    tube = Struts(outer_mm=10.0, inner_mm=8.0, stress_mpa=200.0, modulus_gpa=70.0)
    assert tube.largest_moment == pytest.approx(11.592, rel=1e-4)
    assert tube.bending_stiffness == pytest.approx(70e3 * 289.81, rel=1e-4)
    assert msgspec.structs.replace(tube, moment_nm=3.0).largest_moment == 3.0
    assert math.isinf(msgspec.structs.replace(tube, stress_mpa=None).largest_moment)


def test_tolerances_have_the_order_of_the_dimensions() -> None:
    tolerances = Tolerances(a3=(0.0, 2.0, 0.0), guide_tilt_deg=(0.0, 90.0), b1=(4.0, 0.0, 0.0))
    values = dict(zip(DIMENSIONS, tolerances.stated, strict=True))
    assert {name: value for name, value in values.items() if value} == pytest.approx(
        {"a3y": 2.0, "guide tilt z": 90.0, "b1x": 4.0}
    )
