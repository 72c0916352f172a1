"""The search: what it tells keeps the requirement in every pose; one seed tells the same."""

from __future__ import annotations

import itertools
import math

import msgspec
import numpy as np
import pytest
from needs import NEEDS, requirement_of, violations

from explorer import PRESETS, InputError
from explorer.find.answers import FoundDesigns
from explorer.find.check import check_requirement
from explorer.find.find import find_designs
from explorer.find.nearest import nearest_values
from explorer.find.requirement import (
    RequiredLegs,
    RequiredMotion,
    Requirement,
    decode_requirement,
    encode_requirement,
    legs_from_row,
)
from explorer.mechanism.design import LENGTHS
from explorer.mechanism.design_file import decode_design, encode_design
from explorer.prototype.fitting import buildability

NEED = requirement_of(NEEDS[0])
POSES = 50_000


@pytest.mark.parametrize(
    "changes",
    [
        {},
        {"gravity": (0.0, 0.0, 1.0), "prefer": "small"},
        {"tilt_deg": 0.0, "box_mm": (60.0, 60.0, 240.0)},
        {"free": ("orientation", "tool"), "buildable": True},
        {"hull_mm": 600.0},
        {"payload": msgspec.structs.replace(NEED.payload, mass_kg=0.0, force_n=0.0)},
    ],
)
def test_find_designs_keep_the_requirement_in_all_poses(changes: dict[str, object]) -> None:
    requirement = msgspec.structs.replace(NEED, **changes)
    seen: list[FoundDesigns] = []
    found = find_designs(requirement, count=2, seconds=2.0, watch=seen.append)
    assert found.status == "found"
    assert seen
    assert not sum(violations(each.design, requirement, POSES) for each in found.designs)
    rows = [(each.longest_mm, each.force_per_newton, each.clearance_mm) for each in found.designs]
    for one, other in itertools.combinations(rows, 2):
        assert np.abs(np.log(np.divide(one, other))).max() > 0.05
    for each in found.designs:
        assert each.check.kept
        again = decode_design(encode_design(each.design), "it")
        check = check_requirement(again, requirement)
        assert check.kept, [demand.name for demand in check.missed]
        assert each.longest_mm >= found.bound_mm
        assert each.design.required_box is not None
        lows, highs = np.array(each.design.required_box)
        edges = (highs - lows) * each.design.unit_mm
        assert edges == pytest.approx(requirement.box_mm)
        if requirement.buildable:
            built = buildability(each.design)
            assert not built.problems
            assert not built.short_legs


def test_find_designs_with_one_seed_are_the_same() -> None:
    first, second = (find_designs(NEED, count=1, seconds=1.0, seed=3) for _ in range(2))
    assert [each.design for each in first.designs] == [each.design for each in second.designs]
    assert first.designs


def test_find_designs_begin_with_a_given_one() -> None:
    found = find_designs(NEED, count=1, seconds=1.0)
    better = find_designs(NEED, count=1, seconds=2.0, design=found.designs[0].design)
    assert better.designs
    assert better.designs[0].check.kept


def test_find_designs_cancelled_keep_what_was_found() -> None:
    seen: list[FoundDesigns] = []
    found = find_designs(NEED, seconds=60.0, watch=seen.append, stop=lambda: bool(seen))
    assert found.designs
    assert found.status == "found"
    none = find_designs(NEED, seconds=60.0, stop=lambda: True)
    assert (none.status, none.designs) == ("cancelled", ())


def test_need_below_its_bound_is_refused_with_a_nearest_value_that_is_found() -> None:
    short = msgspec.structs.replace(NEED.legs, longest_mm=200.0)
    requirement = msgspec.structs.replace(NEED, legs=short)
    # A refusal takes no search.
    found = find_designs(requirement, stop=lambda: pytest.fail("searched"))
    assert found.status == "impossible"
    assert not found.designs
    first = next(nearest_values(requirement))
    assert first.demand == "legs.longest_mm"
    # Demands without which the others are impossible too are left alone.
    swings = msgspec.structs.replace(requirement, swing_deg=1.0)
    assert next(nearest_values(swings), None) is None
    assert found.bound_mm < first.value < 500.0
    seen: list[FoundDesigns] = []
    again = find_designs(first.requirement, seed=7, watch=seen.append, stop=lambda: bool(seen))
    assert again.designs


def test_check_of_the_papers_optimum_tells_what_it_misses_and_where() -> None:
    requirement = msgspec.structs.replace(
        NEED, hull_mm=600.0, move_s=1.0, transmission=0.1, buildable=True
    )
    legs = msgspec.structs.replace(NEED.legs, speed_mm_s=500.0)
    check = check_requirement(
        PRESETS["paper-optimal"], msgspec.structs.replace(requirement, legs=legs)
    )
    assert not check.kept
    for demand in check.demands:
        assert demand.kept == (demand.spare >= -1e-3) or demand.name == "buildable"
    # Its box is on both sides of a singular plane, where no force holds a load.
    rows = {demand.name: demand for demand in check.demands}
    assert len(rows) == len(check.demands)
    assert rows["margin"].worst < 0.0
    assert rows["force"].worst == math.inf
    assert rows["transmission index"].worst == 0.0
    # The worst pose of the longest leg has its length.
    worst = check.demands[0]
    assert worst.pose is not None
    design = PRESETS["paper-optimal"]
    offset = np.subtract(worst.pose.position, (*design.a3, 0.0))
    if worst.item == "longest l4":
        length = design.unit_mm * float(np.linalg.norm(offset))
        assert length == pytest.approx(worst.worst, rel=1e-6)


def test_worst_values_are_no_milder_than_those_of_random_poses() -> None:
    design = PRESETS["buildable"]
    worst = {each.name: each.worst for each in check_requirement(design, NEED).demands}
    clearance, force = worst["clearance"] - 1e-3, worst["force"] + 1e-3
    legs = msgspec.structs.replace(NEED.legs, apart_mm=clearance, push_n=force, pull_n=force)
    assert violations(design, msgspec.structs.replace(NEED, legs=legs), 200_000) == 0


def test_requirement_file_is_read_back_and_strict() -> None:
    assert decode_requirement(encode_requirement(NEED), "it") == NEED
    with pytest.raises(InputError, match="tilt"):
        decode_requirement(b'{"kind": "requirement", "box_mm": [1, 1, 1], "tlt_deg": 1}', "it")
    with pytest.raises(InputError, match=r"legs\.ratio"):
        RequiredLegs(ratio=0.9)
    with pytest.raises(InputError, match="box_mm"):
        Requirement(box_mm=(1.0, 0.0, 1.0))


def test_row_of_a_data_sheet_gives_its_values() -> None:
    legs = legs_from_row(
        "stroke: 150 mm, retracted 220 mm, push 300N; speed=50mm/s", RequiredLegs()
    )
    assert legs.ratio == pytest.approx(370.0 / 220.0)
    assert (legs.longest_mm, legs.push_n, legs.speed_mm_s) == (370.0, 300.0, 50.0)
    metric = legs_from_row("push 3 kN, speed 0.05 m/s; accuracy ±50 µm", RequiredLegs())
    assert (metric.push_n, metric.speed_mm_s) == (3000.0, 50.0)
    assert metric.error_mm == pytest.approx(0.05)
    sheet = legs_from_row("diameter 1 in; push 300,5 N (accuracy +/-0,125 mm), speed 5 cm/s.", legs)
    assert (sheet.push_n, sheet.diameter_mm) == (300.5, pytest.approx(25.4))
    assert (sheet.error_mm, sheet.speed_mm_s) == (0.125, 50.0)
    assert legs_from_row("Force-20 push 1.5e3", legs).push_n == 1500.0


@pytest.mark.parametrize(
    ("row", "reason"),
    [
        ("LA-20, blue", "no value"),
        ("stroke 150", "only together; got stroke alone"),
        ("retracted 220 push 300 N", "only together; got retracted alone"),
        ("push -300 N", r"push_n must be positive; got -300"),
        ("push \u2212300 N", r"push_n must be positive; got -300"),
        ("push 1e-14 N", "push_n must be at least 1e-07 in size"),
        ("push 1.500,5 N", "got 1.500,5"),
        (f"push{980 * ' '}300 lbf", "in N, kN; got 300 lbf"),
        ("long" * 2000, "^a row has at most 1000 letters; got 8000"),
        ("push 300 lbf", "in N, kN; got 300 lbf"),
        ("push 1,500 N", "got 1,500"),
        ("stroke 150 retracted 0", "retracted"),
    ],
)
def test_row_of_a_data_sheet_that_cannot_be_read_is_refused(row: str, reason: str) -> None:
    with pytest.raises(InputError, match=reason):
        legs_from_row(row, RequiredLegs())


def test_limits_of_lengths_beyond_the_need_change_no_worst_value() -> None:
    design = PRESETS["buildable"]
    lengths = dict.fromkeys(LENGTHS, (0.1, 1000.0))
    limits = msgspec.structs.replace(design.limits, **lengths)
    legs = msgspec.structs.replace(NEED.legs, ratio=1.74)
    need = msgspec.structs.replace(NEED, legs=legs)
    wide = check_requirement(msgspec.structs.replace(design, limits=limits), need)
    own = check_requirement(design, need)
    assert [each.name for each in own.missed] == [each.name for each in wide.missed] == ["ratio"]
    length, *worst = [each.worst for each in own.demands]
    assert [each.worst for each in wide.demands][1:] == pytest.approx(worst, rel=1e-4)
    assert length < own.demands[0].limit == 446.0


def test_demands_that_lack_what_they_need_are_refused_and_a_pull_alone_is_a_limit() -> None:
    design = PRESETS["buildable"]
    pull = msgspec.structs.replace(NEED.legs, push_n=None, pull_n=1.0)
    check = check_requirement(design, msgspec.structs.replace(NEED, legs=pull))
    assert [each.name for each in check.missed] == ["force"]
    for field, value in (("tool", RequiredMotion(1000.0)), ("move_s", 1.0)):
        with pytest.raises(InputError, match=r"needs? legs\.speed_mm_s"):
            check_requirement(design, msgspec.structs.replace(NEED, **{field: value}))
