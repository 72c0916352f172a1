"""The exact volume and its gradient over random designs of every kind, against laws.

A volume is the sum of the volumes of its parts. The quadrature over many parts has hundreds of
times the nodes and resolves what lies between those of the whole. Under scaling a volume grows
with the cube of all lengths, so lengths times derivatives add up to three volumes (Euler).
"""

from __future__ import annotations

import itertools
import json
import math
from collections.abc import Callable
from typing import Any

import numpy as np
import pytest
from limited_designs import limited, ordinary_case, shell_case, troubled_case
from reference import read_reference

from explorer import Design
from explorer.mechanism.design import LENGTHS, VARIABLES, Swing
from explorer.mechanism.design_file import decode_design
from explorer.numerics.arrays import FloatArray
from explorer.workspace.limits.constraints import YAW, constraints
from explorer.workspace.limits.region import region_of
from explorer.workspace.slices.integration import RESULTS, TOTAL, TOTAL_ERROR, integrate_slices
from explorer.workspace.slices.volume import bounds, home_rotation, quadrature, workspace_volume

DEFECTS: list[dict[str, Any]] = read_reference("defects_volume")["workspaces"]
SEEDS = 40
PARTS = 150
# The rounding of the sum of the parts, as a share of it.
ROUNDING = 1e-13


@pytest.fixture(autouse=True, scope="module")
def _compiled_kernel() -> None:  # pyright: ignore[reportUnusedFunction]
    integrate_slices.compile()


def unbounded(design: Design, rotation: FloatArray | None) -> tuple[Design, FloatArray]:
    """Return the design without cones, which have no exact slices, and its rotation."""
    return limited(design, swing=Swing()), home_rotation(design) if rotation is None else rotation


def troubled_without_cones(seed: int) -> tuple[Design, FloatArray]:
    """Return a troubled case without its cones."""
    return unbounded(*troubled_case(seed))


CASES: dict[str, Callable[[int], tuple[Design, FloatArray]]] = {
    "ordinary": ordinary_case,
    "shell": shell_case,
    "troubled": troubled_without_cones,
}


def volume_in_parts(design: Design, rotation: FloatArray) -> tuple[float, float]:
    """Return the volume as the sum of many parts along x, and the sum of their errors."""
    region = region_of(constraints(design, rotation))
    lows, highs = bounds(region)
    if region.is_empty or not (lows < highs).all():
        return 0.0, 0.0
    rates = np.zeros((len(region.circles) + len(region.planes), 4))
    result, total, error = np.zeros(RESULTS), 0.0, 0.0
    ends = np.linspace(region.low, region.high, PARTS + 1).tolist()
    for low, high in itertools.pairwise(ends):
        rows = region.circles, region.planes, low, high
        integrate_slices(1, *rows, quadrature(), result, rates)
        total += float(result[TOTAL])
        error += float(result[TOTAL_ERROR])
    return total, error


def decoded(case: dict[str, Any]) -> tuple[Design, FloatArray]:
    """Return the design and rotation of a case in the data."""
    return decode_design(json.dumps(case["design"]).encode(), "case"), np.array(case["rotation"])


@pytest.mark.parametrize("case", DEFECTS)
def test_volume_with_breaks_between_nodes_is_the_reference_one(case: dict[str, Any]) -> None:
    design, rotation = decoded(case)
    found = workspace_volume(design, rotation)
    assert found.volume == pytest.approx(case["volume"], rel=1e-7)
    volume, _ = volume_in_parts(design, rotation)
    assert found.volume == pytest.approx(volume, rel=1e-12, abs=found.error)
    assert found.error <= 1e-10 * found.volume


@pytest.mark.parametrize("kind", CASES)
def test_volume_in_parts_sums_to_the_whole_within_its_error(kind: str) -> None:
    off: list[tuple[int, float]] = []
    for seed in range(SEEDS):
        design, rotation = CASES[kind](seed)
        found = workspace_volume(design, rotation, explain=False)
        volume, error = volume_in_parts(design, rotation)
        room = found.error + min(error, found.error) + ROUNDING * volume
        if abs(found.volume - volume) > room:
            off.append((seed, found.volume / volume - 1.0))
    assert not off


@pytest.mark.parametrize("seed", range(SEEDS))
def test_volume_error_of_ordinary_designs_is_rounding(seed: int) -> None:
    found = workspace_volume(*ordinary_case(seed), explain=False)
    assert found.error <= 1e-11 * found.volume


def length_of(design: Design, name: str) -> float:
    """Return the length with respect to which a derivative is taken."""
    if name in VARIABLES:
        return design.variables[VARIABLES.index(name)]
    if name == "margin":
        return design.limits.margin or 0.0
    words = name.split()
    end = 0 if words[-1] == "minimum" else 1
    if words[0] in LENGTHS:
        return design.length_range(words[0])[end]
    if words[0] == "guide":
        return (design.limits.guide or pytest.fail("no guide"))[end]
    assert words[0] == "box"
    return (design.limits.box or pytest.fail("no box"))[end]["xyz".index(words[1])]


@pytest.mark.parametrize("kind", CASES)
def test_volume_gradient_times_lengths_is_three_volumes(kind: str) -> None:
    off: list[tuple[int, float]] = []
    for seed in range(SEEDS):
        design, rotation = CASES[kind](seed)
        found = workspace_volume(design, rotation, explain=False)
        terms = [
            length_of(design, name) * rate for name, rate in found.gradient.items() if name != YAW
        ]
        # For a thin shell the terms are far larger than the volume, and cancel. A face that begins
        # just beyond a piece as a square root costs its derivative more digits than the volume.
        room = 1e-7 * math.fsum(map(abs, terms)) + 3.0 * found.error
        if abs(math.fsum(terms) - 3.0 * found.volume) > room:
            off.append((seed, math.fsum(terms) / (3.0 * found.volume) - 1.0))
    assert not off
