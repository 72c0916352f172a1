"""Shares of all orientations against an independent count, pose by pose, and over seeds.

The independent count is over 400,000 random orientations.
"""

from __future__ import annotations

import math
from typing import Any

import msgspec
import numpy as np
import pytest
from limited_designs import limited
from long_cases import long_after
from reference import read_reference
from scipy.spatial.transform import Rotation

from explorer import PRESETS, Design, InputError, Limits, margins
from explorer.mechanism.design import LENGTHS, Swing
from explorer.mechanism.pose import Pose
from explorer.workspace.orientations.share import orientation_capability, orientation_share

pytestmark = pytest.mark.usefixtures("warm_kernels")

OPTIMAL = PRESETS["paper-optimal"]
CASES: list[dict[str, Any]] = read_reference("orientation")["cases"]
# Standard error of the reference's count.
REFERENCE_ERROR = 7e-4


def case_design(case: dict[str, Any]) -> Design:
    """Return the design of a case, with a home of the signs and the order that it demands."""
    lengths: dict[str, Any] = {
        name: (low, high)
        for name, low, high in zip(LENGTHS, case["least"], case["most"], strict=True)
    }
    x = case["design"]
    free = Design(a3=tuple(x["a3"]), b1=tuple(x["b1"]), b2=x["b2"], b3=x["b3"])
    rotations = np.asarray(Rotation.random(1000, rng=np.random.default_rng(0)).as_matrix())
    signs = np.sign(margins(case["position"], rotations)) == case["signs"]
    order = np.sign((free.b3 - free.b2) * rotations[:, 0, 0]) == case["order"]
    home = Pose.of(case["position"], rotations[signs.all(axis=1) & order][0])
    return msgspec.structs.replace(free, limits=Limits(**lengths), home=home)


@pytest.mark.parametrize("index", long_after(4, range(len(CASES))))
def test_share_is_that_of_an_independent_count(index: int) -> None:
    case = CASES[index]
    design, position = case_design(case), case["position"]
    for name, limits in (
        ("share_with_signs_and_order", {}),
        ("share_with_signs", {"carriage_order": "any"}),
        ("share_of_lengths", {"carriage_order": "any", "margin": None}),
    ):
        found = orientation_share(limited(design, **limits), position)
        error = math.hypot(found.standard_error, REFERENCE_ERROR)
        assert found.share == pytest.approx(case[name], abs=4.5 * error), name
        assert found.share == pytest.approx(case[name], abs=0.004), name
        assert found.standard_error < 1.5e-3
        assert found.orientations == 100_000


def test_standard_error_is_the_spread_over_seeds() -> None:
    design = limited(OPTIMAL, l1=(5.0, 15.0), swing=Swing(b1=70.0))
    p = OPTIMAL.home_pose.position
    found = [orientation_share(design, p, 2000, seed) for seed in range(60)]
    spread = float(np.std([each.share for each in found]))
    told = math.sqrt(float(np.mean([each.standard_error**2 for each in found])))
    assert told == pytest.approx(spread, rel=0.35)
    mean = float(np.mean([each.share for each in found]))
    assert mean == pytest.approx(orientation_share(design, p, 200_000).share, abs=2e-3)
    # As many independent orientations have a larger one.
    assert told < 0.8 * math.sqrt(mean * (1.0 - mean) / 2000)


def test_share_is_the_same_for_a_seed_and_none_outside_the_box() -> None:
    p = OPTIMAL.home_pose.position
    assert orientation_share(OPTIMAL, p, 500, 7) == orientation_share(OPTIMAL, p, 500, 7)
    outside = orientation_share(OPTIMAL, [30.0, 5.0, 9.0], 100)
    assert (outside.share, outside.standard_error) == (0.0, 0.0)


def test_unusable_positions_numbers_and_seeds_are_refused() -> None:
    p = OPTIMAL.home_pose.position
    refused: list[tuple[str, dict[str, Any]]] = [
        *(("number of orientations", {"n": n}) for n in (1, -5, 10**9)),
        ("number of orientations must be a whole number", {"n": 2.5}),
        ("seed", {"seed": -1}),
        ("seed must be a whole number", {"seed": 0.5}),
    ]
    for message, given in refused:
        with pytest.raises(InputError, match=message):
            orientation_share(OPTIMAL, p, **given)
    with pytest.raises(InputError, match="whole number"):
        orientation_capability(OPTIMAL, p, math.nan)
    with pytest.raises(InputError, match="one position"):
        orientation_share(OPTIMAL, [p])
    with pytest.raises(InputError, match="position"):
        orientation_share(OPTIMAL, [math.nan, 0.0, 0.0])
