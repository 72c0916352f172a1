"""The constant-orientation workspace: volumes, gradients and nodes against independent methods.

Volumes are compared with reference values (good to 1e-4, those of Table 1 to 1e-6), with the
columns of another kernel (good to about 1e-4) and with random positions.
"""

from __future__ import annotations

import itertools
import json
import math
from collections.abc import Callable
from typing import Any

import msgspec
import numpy as np
import pytest
from hypothesis import settings
from limited_designs import (
    REFERENCE,
    limited,
    ordinary_case,
    reference_case,
    shell_case,
    troubled_case,
)
from long_cases import long_after
from reference import read_reference
from scipy.spatial.transform import Rotation

from explorer import PRESETS, Design, InputError
from explorer.mechanism.design import LENGTHS, VARIABLES, Swing
from explorer.mechanism.design_file import decode_design
from explorer.numerics.arrays import FloatArray
from explorer.workspace.limits.constraints import YAW
from explorer.workspace.limits.region import region_of
from explorer.workspace.slices.integration import (
    RESULTS,
    TOTAL,
    TOTAL_ERROR,
    integrate_slices,
    quadrature,
)
from explorer.workspace.slices.volume import node_count_of, workspace_volume
from explorer.workspace.solids.solids import workspace_solid
from explorer.workspace.workspace import Workspace

pytestmark = pytest.mark.usefixtures("warm_kernels")

OPTIMAL = PRESETS["paper-optimal"]


@pytest.mark.parametrize("index", long_after(8, range(len(REFERENCE["workspaces"]))))
def test_volume_of_reference_workspaces_is_theirs(index: int) -> None:
    design, rotation, volume = reference_case(index)
    assert workspace_volume(design, rotation).volume == pytest.approx(volume, rel=1e-4)


@pytest.mark.parametrize("row", REFERENCE["table1"], ids=lambda row: str(row["name"]))
def test_volume_and_nodes_of_table_1_rows_are_the_reference_ones(row: dict[str, Any]) -> None:
    nodes = node_count_of(Workspace(PRESETS[row["name"]]))
    found = workspace_volume(PRESETS[row["name"]]).volume
    assert found == pytest.approx(row["exact_volume"], rel=1e-6)
    assert nodes.count == row["node_count"]
    assert nodes.step == pytest.approx(row["step"], rel=1e-12)
    assert nodes.volume == pytest.approx(row["node_volume"], rel=1e-12)
    np.testing.assert_allclose(nodes.extent or (), row["extent"], rtol=1e-12, atol=1e-12)


@pytest.mark.parametrize("seed", range(4))
def test_nodes_counted_satisfy_every_limit(seed: int) -> None:
    design, rotation = ordinary_case(seed)
    step = 0.7
    nodes = node_count_of(Workspace(design, rotation), step)
    index = np.stack(np.meshgrid(*[np.arange(-45.0, 46.0)] * 3, indexing="ij"), axis=-1)
    grid = np.asarray(step * index.reshape(-1, 3), dtype=np.float64)
    kept = np.all(
        [limit.slack(grid) >= 0.0 for limit in Workspace(design, rotation).limits], axis=0
    )
    assert nodes.count == int(kept.sum())
    if nodes.extent is not None:
        inside = grid[kept]
        np.testing.assert_allclose(nodes.extent, [inside.min(axis=0), inside.max(axis=0)])


def varied(design: Design, rotation: FloatArray, name: str, by: float) -> tuple[Design, FloatArray]:
    """Return the design or the rotation with one parameter of a gradient changed."""
    limits = design.limits
    if name in VARIABLES:
        return with_added(design, name, by), rotation
    if name == YAW:
        return design, Rotation.from_rotvec([0.0, 0.0, by]).as_matrix() @ rotation
    if name == "margin":
        return limited(design, margin=(limits.margin or 0.0) + by), rotation
    words = name.split()
    end = 0 if words[-1] == "minimum" else 1
    if words[0] in LENGTHS or words[0] == "guide":
        ends = list(getattr(limits, words[0]))
        ends[end] += by
        return limited(design, **{words[0]: tuple(ends)}), rotation
    assert words[0] == "box"
    box = [list(each) for each in limits.box or pytest.fail("no box")]
    box[end]["xyz".index(words[1])] += by
    return limited(design, box=(tuple(box[0]), tuple(box[1]))), rotation


def with_added(design: Design, variable: str, by: float) -> Design:
    return design.with_variable(variable, design.variables[VARIABLES.index(variable)] + by)


@pytest.mark.parametrize("seed", range(6))
def test_volume_gradient_is_that_of_central_differences(seed: int) -> None:
    design, rotation = ordinary_case(seed)
    found = workspace_volume(design, rotation)
    assert {*VARIABLES, YAW, "margin", "l1 maximum", "d2 minimum"} <= set(found.gradient)
    largest = max(map(abs, found.gradient.values()))
    for name, rate in found.gradient.items():
        ahead, behind = (
            workspace_volume(*varied(design, rotation, name, by)).volume for by in (1e-5, -1e-5)
        )
        assert rate == pytest.approx((ahead - behind) / 2e-5, abs=1e-5 * largest), name


@pytest.mark.parametrize(
    ("limits", "because"),
    [
        ({"gap": 50.0}, ("gap |d1 − d3|",)),
        ({"margin": 19.0}, ("box z maximum", "margin δ3")),
        *(({name: (5.0, 5.0)}, (f"{name} minimum", f"{name} maximum")) for name in LENGTHS),
        ({"l1": (30.0, 40.0)}, ("l1 minimum", "box x maximum")),
        ({"d4": (0.0, 0.0)}, ("d4 maximum",)),
        ({"guide": (100.0, 101.0)}, ("d3 minimum", "box x maximum")),
        ({"box": ((0.0, 0.0, 50.0), (1.0, 1.0, 51.0))}, ("box z minimum",)),
        ({"box": ((3.0, 3.0, 3.0), (3.0, 9.0, 9.0))}, ("box x minimum", "box x maximum")),
        ({"swing": Swing(a1=1.0, b4=1.0), "l1": (13.0, None)}, ()),
    ],
)
def test_workspace_empty_names_the_limits_that_empty_it(
    limits: dict[str, Any], because: tuple[str, ...]
) -> None:
    design = limited(OPTIMAL, **limits)
    found = workspace_volume(design)
    assert found.volume == 0.0
    names = found.empty_because
    assert names == because if because else any(name.startswith("swing") for name in names)
    # Nodes lie on boundaries too, but never apart from the region.
    assert node_count_of(Workspace(design)).count == 0 or because == (
        "box x minimum",
        "box x maximum",
    )


def test_workspace_of_parallel_lines_is_empty_unless_no_margin_is_demanded() -> None:
    level = np.eye(3)
    assert workspace_volume(OPTIMAL, level).empty_because == ("margin δ2",)
    assert workspace_volume(limited(OPTIMAL, margin=None), level).volume > 1000.0


def test_balls_that_are_equal_count_once() -> None:
    rotation = OPTIMAL.home_pose.rotation
    # The centre of l1 is -R b1: put a3 there, and the balls of l1 and l4 are one.
    b1x, b1y = (-(rotation.T @ [*OPTIMAL.a3, 0.0]))[:2].tolist()
    design = msgspec.structs.replace(OPTIMAL, b1=(b1x, b1y), home=OPTIMAL.home_pose)
    without = workspace_volume(limited(design, l4=(0.0, 1e3))).volume
    assert workspace_volume(design).volume == pytest.approx(without, rel=1e-12)


@pytest.mark.parametrize("step", [0.0, math.nan, 1e-3])
def test_nodes_with_an_unusable_step_or_rotation_are_refused(step: float) -> None:
    with pytest.raises(InputError, match="node"):
        node_count_of(Workspace(OPTIMAL), step=step)
    for measure in (workspace_volume, workspace_solid):
        with pytest.raises(InputError, match="rotation"):
            measure(OPTIMAL, 2.0 * np.eye(3))


DEFECTS: list[dict[str, Any]] = read_reference("defects_volume")["workspaces"]
# A part of them each day, all with all tests.
SEEDS = min(40, settings().max_examples // 3)
PARTS = 150
# The rounding of the sum of the parts, as a share of it.
ROUNDING = 1e-13


def troubled_without_cones(seed: int) -> tuple[Design, FloatArray]:
    """Return a troubled case without its cones, which have no exact slices."""
    design, rotation = troubled_case(seed)
    rotation = design.home_pose.rotation if rotation is None else rotation
    return limited(design, swing=Swing()), rotation


CASES: dict[str, Callable[[int], tuple[Design, FloatArray]]] = {
    "ordinary": ordinary_case,
    "shell": shell_case,
    "troubled": troubled_without_cones,
}


def volume_in_parts(design: Design, rotation: FloatArray) -> tuple[float, float]:
    """Return the volume as the sum of many parts along x, and the sum of their errors."""
    region = region_of(Workspace(design, rotation).limits)
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


@pytest.mark.parametrize("case", DEFECTS)
def test_volume_with_breaks_between_nodes_is_the_reference_one(case: dict[str, Any]) -> None:
    design = decode_design(json.dumps(case["design"]).encode(), "case")
    rotation = np.array(case["rotation"])
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
        found = workspace_volume(design, rotation)
        volume, error = volume_in_parts(design, rotation)
        room = found.error + min(error, found.error) + ROUNDING * volume
        assert kind != "ordinary" or found.error <= 1e-11 * found.volume
        if abs(found.volume - volume) > room:
            off.append((seed, found.volume / volume - 1.0))
    assert not off
