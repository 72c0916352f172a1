"""The search: what it tells keeps the requirement in every pose; one seed tells the same."""

from __future__ import annotations

import itertools
import math

import msgspec
import numpy as np
import pytest
from needs import NEEDS, requirement_of, violations

from explorer import PRESETS, InputError
from explorer.find import find
from explorer.find.answers import FoundDesigns
from explorer.find.check import check_requirement
from explorer.find.find import find_designs
from explorer.find.nearest import nearest_values
from explorer.find.requirement import (
    RequiredLegs,
    Requirement,
    decode_requirement,
    encode_requirement,
    legs_from_row,
)
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


def test_find_designs_with_one_seed_are_the_same(monkeypatch: pytest.MonkeyPatch) -> None:
    # A machine that is busy with other things ends no search by the clock.
    monkeypatch.setattr(find, "PATIENCE", math.inf)
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


def test_need_below_its_bound_is_refused_with_a_nearest_value_that_is_found(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    for module in ("find", "nearest"):
        monkeypatch.setattr(f"explorer.find.{module}.PATIENCE", math.inf)
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
    with pytest.raises(InputError, match="no value"):
        legs_from_row("LA-20, blue", RequiredLegs())
