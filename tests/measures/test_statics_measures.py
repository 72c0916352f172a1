"""Measures of loads and precision at home: what they are, need, and lack in singular poses."""

from __future__ import annotations

import msgspec
import pytest
from machines import PRECISE

from explorer import PRESETS, Design, Guide, Pose
from explorer.measures.catalogue import CATALOGUE, measure_design, measures_in, reason_for_missing
from explorer.measures.measure import Case
from explorer.numerics.number_text import Unit
from explorer.statics.loaded import LoadedPose, ToolPrecision

OPTIMAL = PRESETS["paper-optimal"]
NAMES = tuple(
    f"home_{name}"
    for name in (
        *("load_share", "worst_actuator", "largest_payload"),
        *("acceleration", "largest_bending", "worst_error", "worst_turn", "softest_compliance"),
        "deflection",
    )
)


def values(design: Design) -> dict[str, float | None]:
    found = measure_design(Case(design), measures_in("studies"))
    return {name: found.values[name] for name in NAMES if name in found.values}


def test_measures_of_statics_are_those_of_the_loaded_home_pose() -> None:
    found = values(PRECISE)
    assert tuple(found) == NAMES
    units = [CATALOGUE[name].unit_in(Unit("mm", 1.0)).name for name in NAMES]
    assert units == ["", "", "kg", "m/s²", "N m", "mm", "°", "mm/N", "mm"]
    loaded = LoadedPose(PRECISE, PRECISE.home_pose)
    precision = ToolPrecision(loaded)
    assert found["home_load_share"] == loaded.share
    assert found["home_worst_actuator"] == loaded.shares[:6].argmax() + 1
    bending = float(loaded.reactions.bending.max()) * 1e-3 * PRECISE.unit_mm
    assert found["home_largest_bending"] == pytest.approx(bending, rel=1e-12)
    assert found["home_deflection"] == precision.largest_displacement
    worst = precision.worst(slice(0, 6)).displacement
    assert found["home_worst_error"] == pytest.approx(float(worst), rel=1e-12)
    # Without another load, shares are proportional to the mass.
    share = found["home_load_share"]
    assert share is not None
    assert found["home_largest_payload"] == pytest.approx(0.6 / share, rel=1e-9)


def test_measures_of_statics_need_the_parts_of_a_machine() -> None:
    assert values(OPTIMAL) == {}
    parts = {
        "payload": ["largest_bending"],
        "struts": ["largest_payload", "softest_compliance"],
        "actuators": ["largest_payload", "worst_error", "worst_turn", "softest_compliance"],
    }
    for part, names in parts.items():
        design = msgspec.structs.replace(OPTIMAL, **{part: getattr(PRECISE, part)})
        assert list(values(design)) == [f"home_{name}" for name in names]
    guided = msgspec.structs.replace(OPTIMAL, guide=Guide(force_n=10.0))
    assert list(values(guided)) == ["home_largest_payload"]


def test_measures_of_statics_in_a_singular_home_are_none_with_a_reason() -> None:
    home = Pose.of_yaw_pitch_roll((9.0, 4.0, 0.0), (-73.0, 0.0, 0.0))
    singular = msgspec.structs.replace(PRECISE, home=home)
    found = values(singular)
    assert found.pop("home_largest_payload") == 0.0
    assert set(found.values()) == {None}
    case = Case(singular.with_limits(margin=None))
    measured = measure_design(case, NAMES)
    assert {*measured.infinite} >= {"home_load_share", "home_largest_bending", "home_deflection"}
    assert "home is singular" in reason_for_missing(case, measured)
