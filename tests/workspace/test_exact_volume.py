"""The exact volume over random designs of every kind, against laws.

A volume is the sum of the volumes of its parts. The quadrature over many parts has hundreds of
times the nodes and resolves what lies between those of the whole.
"""

from __future__ import annotations

import itertools
import json
from collections.abc import Callable
from typing import Any

import numpy as np
import pytest
from hypothesis import settings
from limited_designs import limited, ordinary_case, shell_case, troubled_case
from reference import read_reference

from explorer import Design
from explorer.mechanism.design import Swing
from explorer.mechanism.design_file import decode_design
from explorer.numerics.arrays import FloatArray
from explorer.workspace.limits.constraints import constraints
from explorer.workspace.limits.region import region_of
from explorer.workspace.slices.integration import RESULTS, TOTAL, TOTAL_ERROR, integrate_slices
from explorer.workspace.slices.volume import home_rotation, quadrature, workspace_volume

DEFECTS: list[dict[str, Any]] = read_reference("defects_volume")["workspaces"]
# A part of them each day, all with all tests.
SEEDS = min(40, settings().max_examples // 3)
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
    if region.box is None:
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
        assert kind != "ordinary" or found.error <= 1e-11 * found.volume
        if abs(found.volume - volume) > room:
            off.append((seed, found.volume / volume - 1.0))
    assert not off
