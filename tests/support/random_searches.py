"""Searches with random demands over a box, and random poses that look for a missed demand."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import msgspec
import numpy as np
from machines import same_for_all

from explorer import (
    PRESETS,
    Actuators,
    Design,
    Guide,
    Payload,
    Struts,
    Tool,
    make_problem,
    optimise_design,
)
from explorer.legs.clearance import leg_clearances
from explorer.measures.box import BoxStatics, box_margins
from explorer.mechanism.configuration import Configuration
from explorer.mechanism.margins import margins
from explorer.mechanism.pose import Pose
from explorer.mechanism.tilt_torsion import rotation_from_tilt_torsion
from explorer.motion.weights import MovingBodies, payload_wrench
from explorer.numerics.arrays import FloatArray
from explorer.optimise.outcome import Outcome
from explorer.optimise.problem import OF_THE_MACHINE, SHIFTS, Box, ObjectiveName, Problem
from explorer.statics import accuracy, compliance
from explorer.statics.reactions import largest_accelerations, limit_shares, reactions
from explorer.workspace.limits.constraints import slacks
from explorer.workspace.limits.valid_poses import Rules, poses_are_valid
from explorer.workspace.workspace import Workspace

OBJECTIVES: tuple[ObjectiveName, ...] = (
    "smallest-reach",
    "largest-volume",
    "largest-margin",
    *OF_THE_MACHINE,
)


def random_problem(seed: int) -> Problem:
    """Return a problem with random demands over a random box, near what the start keeps."""
    rng = np.random.default_rng([51, seed])
    objective = OBJECTIVES[int(rng.choice(6, p=[0.35, 0.25, 0.1, 0.1, 0.1, 0.1]))]
    design, box = _machine(rng), _box(rng)
    statics = BoxStatics(design, box, design.home_pose.rotation)

    def near(values: FloatArray) -> float:
        return float(rng.uniform(0.8, 1.5) * values.max())

    is_chosen = rng.random(7) < [0.5, 0.35, 0.35, 0.3, 0.3, 0.2, 0.5]
    demands: dict[str, Any] = {}
    if is_chosen[0]:
        demands["tilt"] = float(rng.uniform(3.0, 25.0))
    if box_margins(box, design.home_pose.rotation).all():
        if is_chosen[1]:
            demands["held"] = True
        if is_chosen[2]:
            demands["error"] = near(statics.errors.displacement)
        if is_chosen[3]:
            demands["deflection"] = near(statics.deflections)
        if is_chosen[4]:
            demands["acceleration"] = max(0.1, 0.7 * float(statics.accelerations.min()))
    if is_chosen[5]:
        demands["clearance"] = float(rng.uniform(0.05, 0.3))
    free = [*(["yaw"] if rng.random() < 0.3 or objective == "largest-margin" else [])]
    free += SHIFTS if is_chosen[6] else ()
    if objective == "smallest-reach":
        demands["volume"] = float(rng.uniform(1500.0, 5000.0))
    return make_problem(design, objective, required_box=box, free=free, **demands)


def _machine(rng: np.random.Generator) -> Design:
    """Return a design near the paper's optimum in a random machine with random limits."""
    base = PRESETS["paper-optimal"]
    turn = [-73.1, 0.0, 0.0]
    if rng.random() < 0.4:
        turn = [float(rng.uniform(-110.0, -40.0)), *rng.uniform(-15.0, 15.0, 2).tolist()]
    limits = msgspec.structs.replace(
        base.limits,
        box=None if rng.random() < 0.6 else base.limits.box,
        margin=[None, 0.0, 0.5][int(rng.integers(3))],
        gap=float(rng.choice([0.0, 0.3])),
        l1=(float(rng.choice([0.0, 4.0])), None),
        d2=(float(rng.choice([0.0, 2.0])), None),
        guide=None if rng.random() < 0.7 else (-4.0, 26.0),
    )
    own = np.array(base.variables) * rng.uniform(0.85, 1.2, 6)
    return msgspec.structs.replace(
        base.with_variables(own.tolist()),
        limits=limits,
        home=Pose.of_yaw_pitch_roll((10.0, 5.0, 9.0), turn),
        tool=Tool(tuple(rng.uniform(-2.0, 2.0, 3).tolist())),
        payload=Payload(
            float(rng.uniform(0.2, 2.0)),
            tuple(rng.uniform(-2.0, 2.0, 3).tolist()),
            force_n=float(rng.choice([0.0, 10.0])),
        ),
        actuators=Actuators(
            push_n=same_for_all(float(rng.uniform(100.0, 300.0))),
            error_mm=same_for_all(0.02),
            stiffness_n_mm=same_for_all(float(rng.uniform(100.0, 900.0))),
        ),
        struts=Struts(outer_mm=float(rng.uniform(8.0, 14.0)), moment_nm=float(rng.uniform(4, 20))),
        guide=Guide(force_n=300.0, moment_nm=20.0),
    )


def _box(rng: np.random.Generator) -> Box:
    middle = np.array([10.0, 5.0, 9.0]) + rng.uniform(-2.0, 2.0, 3)
    half = rng.uniform(0.5, 4.0, 3)
    (ax, ay, az), (bx, by, bz) = (middle - half).tolist(), (middle + half).tolist()
    return (ax, ay, az), (bx, by, bz)


def positions_of_box(box: Box, count: int, rng: np.random.Generator) -> FloatArray:
    """Return random positions of a box (n, 3), about half of them on its faces, edges, corners."""
    lows, highs = np.array(box)
    shares = rng.random((count, 3))
    is_end = rng.random((count, 3)) < 0.3
    return lows + (highs - lows) * np.where(is_end, np.round(shares), shares)


def missed_demands(outcome: Outcome, count: int, seed: int = 0) -> Iterator[str]:
    """Yield the demands that the design of an outcome misses in one of as many random poses.

    They are the demands over the required box and the clearance over the workspace.
    """
    rng, demands, design = np.random.default_rng(seed), outcome.problem.demands, outcome.design
    rotation = design.home_pose.rotation
    positions = positions_of_box(outcome.problem.required_box_at(outcome.best.values), count, rng)
    rules = Rules.of(design).without_clearances()
    tilt = demands.tilt or 0.0
    tilts = np.where(rng.random(count) < 0.5, tilt, tilt * np.sqrt(rng.random(count)))
    turns = np.column_stack([rng.uniform(0.0, 360.0, count), tilts, np.zeros(count)])
    rotations = rotation_from_tilt_torsion(turns) @ rotation
    if not poses_are_valid(design, positions, rotations, rules=rules).all():
        yield f"limits with tilts up to {tilt:.6g}°"
    at = Configuration(design, positions, rotation, design.tool.position)
    held = reactions(at, np.zeros(6), MovingBodies().with_payload(design))
    if demands.held and not (limit_shares(design, held) <= 1.0).all():
        yield "load"
    if demands.acceleration and not (largest_accelerations(at) >= demands.acceleration).all():
        yield "acceleration"
    if demands.error:
        errors = accuracy.worst_errors(at, accuracy.actuator_errors(design)).displacement
        if not (errors <= demands.error).all():
            yield "error"
    if demands.deflection:
        soft = compliance.compliance_of(at, *compliance.stiffness_of(design))
        load, force = payload_wrench(design, rotation), design.payload.force_n
        if not (compliance.largest_deflection(soft, load, force)[0] <= demands.deflection).all():
            yield "deflection"
    if demands.clearance and _least_clearance(outcome, count, rng) < demands.clearance:
        yield "clearance"


def _least_clearance(outcome: Outcome, count: int, rng: np.random.Generator) -> float:
    """Return the least clearance at random positions of the workspace off the singular planes."""
    design, margin = outcome.design, outcome.problem.demands.clearance_margin
    rotation, limits = (
        design.home_pose.rotation,
        Workspace(design, design.home_pose.rotation).limits,
    )
    longest = max(design.length_range(name)[1] for name in ("l1", "d2", "d4", "l4"))
    around = (-longest, -longest, -longest), (longest, longest, longest)
    positions = positions_of_box(design.limits.box or around, 4 * count, rng)
    # Legs are nearest at the least margins: as many positions again lie where one is the least.
    off = margins(positions, rotation)[np.arange(len(positions)), rng.integers(0, 3, 4 * count)]
    on = positions[off != 0.0] * ((1.0 + 1e-12) * margin / np.abs(off[off != 0.0]))[:, None]
    positions = np.vstack([positions, on])
    is_inside = slacks(limits, positions).min(axis=-1) >= 0.0
    at = Configuration(design, positions[is_inside], rotation)
    counts = np.abs(at.margins).min(axis=-1) >= margin
    clearances = leg_clearances(at).clearance[counts]
    return float(clearances.min(initial=np.inf))


def search(seed: int, iterations: int = 80) -> Outcome:
    """Return the outcome of a search with random demands."""
    return optimise_design(random_problem(seed), iterations=iterations)
