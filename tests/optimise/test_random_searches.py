"""Searches with random limits and clearances, against random positions that miss one."""

from __future__ import annotations

import msgspec
import numpy as np
import pytest
from long_cases import long_after

from explorer import PRESETS, Pose, leg_clearances, make_problem, margins, optimise_design
from explorer.mechanism.configuration import Configuration
from explorer.optimise.problem import Problem
from explorer.workspace.limits.constraints import slacks
from explorer.workspace.workspace import Workspace

pytestmark = pytest.mark.usefixtures("warm_kernels")

# Searches that find an optimum.
SEEDS = [4, 5, 15, 1, 3, 8, 12, 14, 17]
POSITIONS = 80_000


def random_problem(seed: int) -> Problem:
    """Return a problem with random limits and a clearance, from near the paper's optimum."""
    rng = np.random.default_rng([51, seed])
    base = PRESETS["paper-optimal"]
    turn = [-73.1, 0.0, 0.0]
    if rng.random() < 0.4:
        turn = [float(rng.uniform(-110.0, -40.0)), *rng.uniform(-15.0, 15.0, 2).tolist()]
    start = msgspec.structs.replace(
        base.with_variables((np.array(base.variables) * rng.uniform(0.85, 1.2, 6)).tolist()),
        limits=msgspec.structs.replace(
            base.limits,
            box=None if rng.random() < 0.5 else base.limits.box,
            margin=[None, 0.0, 0.5][int(rng.integers(3))],
            gap=float(rng.choice([0.0, 0.3])),
            l1=(float(rng.choice([0.0, 4.0])), None),
            d2=(float(rng.choice([0.0, 2.0])), None),
            guide=None if rng.random() < 0.7 else (-4.0, 26.0),
            leg_radii=tuple(rng.choice([0.0, 0.1], 4).tolist()),
        ),
        home=Pose.of_yaw_pitch_roll((10.0, 5.0, 9.0), turn),
    )
    return make_problem(
        start,
        "smallest-reach" if rng.random() < 0.6 else "largest-volume",
        volume=float(rng.uniform(1500.0, 5000.0)),
        clearance=float(rng.uniform(0.05, 0.4)),
        free=["yaw"] if rng.random() < 0.3 else [],
    )


@pytest.mark.parametrize("seed", long_after(4, SEEDS))
def test_clearance_of_a_search_that_has_converged_is_missed_by_no_position(seed: int) -> None:
    rng = np.random.default_rng(seed)
    outcome = optimise_design(random_problem(seed), iterations=120)
    assert outcome.converged
    design, demands = outcome.design, outcome.problem.demands
    rotation = design.home_pose.rotation
    reach = max(design.length_range(name)[1] for name in ("l1", "d2", "d4", "l4"))
    lows, highs = np.array(design.limits.box or ((-reach,) * 3, (reach,) * 3))
    positions = lows + (highs - lows) * rng.random((POSITIONS, 3))
    # Legs are nearest at the least margins: as many positions again lie where one is the least.
    off = np.abs(margins(positions, rotation))[np.arange(POSITIONS), rng.integers(0, 3, POSITIONS)]
    on = positions * ((1.0 + 1e-12) * demands.clearance_margin / off)[:, None]
    positions = np.vstack([positions, on])
    inside = slacks(Workspace(design, rotation).limits, positions).min(axis=-1) >= 0.0
    at = Configuration(design, positions[inside], rotation)
    counts = np.abs(at.margins).min(axis=-1) >= demands.clearance_margin
    assert counts.sum() > 1000
    assert demands.clearance is not None
    assert leg_clearances(at).clearance[counts].min() >= demands.clearance
