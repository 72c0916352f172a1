"""Bands of what a load asks and of how far the tool moves, against reactions of each position."""

from __future__ import annotations

import itertools

import msgspec
import numpy as np
import pytest
from machines import FULL, six

from explorer import PRESETS, Actuators, Design, Payload, Struts, Tool, inverse, reactions
from explorer.measures.blocks.block import UTILISATION_EDGES
from explorer.measures.position_bands import (
    LOAD_MEASURES,
    MEASURE_WORDS,
    STEPS,
    PositionMeasure,
    is_unstated,
    position_bands,
)
from explorer.mechanism.configuration import Configuration
from explorer.mechanism.design import Limits
from explorer.mechanism.margins import planes_of_singularity
from explorer.mechanism.pose import rotation_from_yaw_pitch_roll
from explorer.motion.weights import MovingBodies
from explorer.numerics.arrays import FloatArray
from explorer.statics.reactions import limit_shares
from explorer.workspace.workspace import Workspace

MEASURES: tuple[PositionMeasure, ...] = tuple(MEASURE_WORDS)
DISPLACEMENTS: tuple[PositionMeasure, ...] = ("error", "deflection")

OPTIMAL = PRESETS["paper-optimal"]
ERRORS, STIFFNESS = (0.05, 0.02, 0.08, 0.03, 0.01, 0.1), (900, 400, 1500, 700, 1000, 600)
LOADED = msgspec.structs.replace(
    FULL,
    unit_mm=8.0,
    actuators=msgspec.structs.replace(FULL.actuators, error_mm=ERRORS, stiffness_n_mm=STIFFNESS),
    struts=Struts(outer_mm=12.0, inner_mm=10.0, moment_nm=4.0),
    # Singular planes pass through a workspace in which any signs of the margins are allowed.
    limits=Limits(box=((0.0, -12.0, -10.0), (20.0, 22.0, 18.0)), margin=None),
)
LOAD = np.array([4.0, -3.0, -6.0, 5.0, 10.0, -5.0])
SIX = tuple(LOAD.tolist())
ORIENTATIONS = [
    OPTIMAL.home_pose.rotation,
    *(rotation_from_yaw_pitch_roll(angles) for angles in ((-40, 25, 10), (-120, -35, 60))),
]


def near_planes(rotation: FloatArray, count: int) -> FloatArray:
    """Return random positions, of which most are near a singular plane, some within rounding."""
    random = np.random.default_rng(5)
    points = random.uniform((0.0, -12.0, -10.0), (20.0, 22.0, 18.0), (count, 3))
    for k, normal in enumerate(planes_of_singularity(rotation)):
        size = float(np.linalg.norm(normal))
        some = slice(k, None, 4)
        off = 10.0 ** random.uniform(-12.0, 0.0, len(points[some]))
        points[some] -= np.outer(points[some] @ normal / size - off, normal / size)
    return points


def on_plane(normal: FloatArray) -> FloatArray:
    """Return a position on a plane through a1 with a normal."""
    point = np.array([10.0, 5.0, 9.0])
    return point - (point @ normal) / (normal @ normal) * normal


def asked(design: Design, points: FloatArray, rotation: FloatArray, measure: str) -> FloatArray:
    """Return what the load asks at positions (n, 3), by reactions."""
    if measure == "error":
        return largest_displacement(design, points, rotation)
    tool, weights = design.tool.position, MovingBodies().with_payload(design)
    held = reactions(Configuration(design, points, rotation, tool), LOAD, weights)
    if measure == "deflection":
        return displacement(design, points, rotation, held.actuators)
    if measure == "share":
        return np.asarray(limit_shares(design, held).max(axis=-1))
    if measure == "force":
        return np.asarray((np.abs(held.actuators) + held.spread[..., :6]).max(axis=-1))
    bending = (held.bending + held.spread[..., 6:8]).max(axis=-1)
    return np.asarray(bending * design.unit_mm * 1e-3)


def unit_forces(design: Design, points: FloatArray, rotation: FloatArray) -> FloatArray:
    """Return the actuator forces that hold unit forces at the tool, shape (3, n, 6)."""
    loads, tool = np.eye(6)[:3], design.tool.position
    return np.stack(
        [reactions(Configuration(design, points, rotation, tool), w).actuators for w in loads]
    )


def largest_displacement(design: Design, points: FloatArray, rotation: FloatArray) -> FloatArray:
    """Return the largest displacement by errors, by virtual work, over all signs, in mm."""
    forces = unit_forces(design, points, rotation)
    corners = np.array(list(itertools.product((-1.0, 1.0), repeat=6))) * design.actuators.error_mm
    # Where no finite forces hold a load, any error moves the tool without a bound.
    moved = np.where(np.isfinite(forces), forces, 0.0) @ corners.T
    sizes: FloatArray = np.linalg.norm(moved, axis=0).max(axis=-1)
    return np.where(np.isfinite(forces[0, :, 0]), sizes, np.inf)


def displacement(
    design: Design, points: FloatArray, rotation: FloatArray, forces: FloatArray
) -> FloatArray:
    """Return the displacement of the tool by Castigliano's theorem, in mm, shape (n,).

    Actuators store f² / 2k, and the struts of legs 2 and 3 f² d³ / 6EI; forces are those that hold
    the load, shape (n, 6), in N.
    """
    virtual = unit_forces(design, points, rotation)
    softness = softness_of(design, points, rotation)
    is_regular = np.isfinite(forces[:, 0])
    parts = np.where(is_regular[:, None], virtual * softness * forces, 0.0)
    return np.where(is_regular, np.linalg.norm(parts.sum(axis=-1), axis=0), np.inf)


def softness_of(design: Design, points: FloatArray, rotation: FloatArray) -> FloatArray:
    """Return 1 / k of the actuators with d³ / 3EI of the struts, in mm/N, shape (n, 6).

    The design has the stiffness `STIFFNESS` and tubes of aluminium of 12 × 10 mm.
    """
    softness = np.tile(1.0 / np.array(STIFFNESS), (len(points), 1))
    lengths = design.unit_mm * inverse(design, points, rotation)[:, [2, 4]]
    softness[:, [1, 3]] += lengths**3 / (3.0 * 70e3 * np.pi * (12.0**4 - 10.0**4) / 64.0)
    return softness


@pytest.mark.parametrize("measure", MEASURES)
@pytest.mark.parametrize("rotation", ORIENTATIONS[1:])
def test_values_are_reciprocal_to_what_reactions_ask(
    measure: PositionMeasure, rotation: FloatArray
) -> None:
    bands = position_bands(
        Workspace(LOADED, rotation), measure, warn_below=1.0, load=tuple(LOAD.tolist())
    )
    points = near_planes(rotation, 1000)
    # The last ones lie on the singular planes.
    points[-3:] = [on_plane(normal) for normal in planes_of_singularity(rotation)]
    expected = asked(LOADED, points, rotation, measure)
    expected[-3:] = np.inf
    assert (expected[:-3] > 1e6).any()
    highest, lowest = bands.levels[1], bands.levels[-1]
    values = bands.values(points)
    np.testing.assert_allclose(
        values, highest / np.maximum(expected, 0.5 * lowest), rtol=1e-7, atol=1e-12
    )
    # Each position is in the band between the levels of its edges.
    index = np.searchsorted(bands.edges, values, side="right") - 1
    levels = np.array((*bands.levels, 0.0))
    assert (expected <= levels[index] * (1.0 + 1e-7)).all()
    assert (expected >= levels[index + 1] * (1.0 - 1e-7)).all()


@pytest.mark.parametrize("measure", DISPLACEMENTS)
def test_displacement_of_a_tool_on_the_singular_axis_is_bounded_beside_the_plane(
    measure: PositionMeasure,
) -> None:
    """Where δ1 vanishes the platform turns about b2b3, which moves no point on that line."""
    rotation = ORIENTATIONS[1]
    design = msgspec.structs.replace(LOADED, tool=Tool(), payload=Payload())
    bands = position_bands(
        Workspace(design, rotation), measure, warn_below=1.0, load=(0.0, 0.0, 50.0, 0.0, 0.0, 0.0)
    )
    normal = planes_of_singularity(rotation)[0]
    beside = on_plane(normal) + np.outer([-1e-3, -1e-6, 0.0, 1e-6, 1e-3], normal)
    values = bands.values(beside)
    assert values[2] == 0.0
    np.testing.assert_allclose(values[[0, 1, 3, 4]], values[1], rtol=1e-2)
    assert values[1] > 0.1


def with_actuators(actuators: Actuators) -> Design:
    return msgspec.structs.replace(OPTIMAL, actuators=actuators)


def test_measures_are_unstated_where_a_design_is_ideal() -> None:
    stated = {
        "share": with_actuators(Actuators(push_n=six(np.ones(6)))),
        "error": with_actuators(Actuators(error_mm=(0.0, 0.0, 0.01, 0.0, 0.0, 0.0))),
        "deflection": msgspec.structs.replace(OPTIMAL, struts=Struts(outer_mm=12.0)),
        "deflection of actuators": with_actuators(Actuators(stiffness_n_mm=six(np.ones(6)))),
    }
    point, rotation = np.array([[10.0, 5.0, 9.0]]), ORIENTATIONS[0]
    for measure in MEASURES:
        # Nothing is asked where nothing loads.
        empty = position_bands(Workspace(OPTIMAL, rotation), measure, warn_below=1.0)
        assert (empty.values(point) > empty.edges[-1]).all()
        needs = measure in ("share", *DISPLACEMENTS)
        assert is_unstated(OPTIMAL, measure) == needs
        bands = position_bands(
            Workspace(OPTIMAL, rotation), measure, warn_below=1.0, load=tuple(LOAD.tolist())
        )
        assert (bands.values(point)[0] > bands.edges[-1]) == needs
        for name, design in stated.items():
            assert is_unstated(design, measure) == (needs and not name.startswith(measure))
    assert set(MEASURE_WORDS) - set(LOAD_MEASURES) == {"error"}


@pytest.mark.parametrize("factor", [1e-3, 1.0, 3e4])
def test_levels_of_forces_are_round_numbers_that_suit_the_load(factor: float) -> None:
    rotation = ORIENTATIONS[0]
    bands = position_bands(
        Workspace(OPTIMAL, rotation), "force", warn_below=1.0, load=tuple((factor * LOAD).tolist())
    )
    shares = position_bands(
        Workspace(LOADED, rotation), "share", warn_below=1.0, load=tuple((factor * LOAD).tolist())
    )
    assert shares.levels[:0:-1] == UTILISATION_EDGES
    assert np.isinf(bands.levels[0])
    levels = bands.levels[:0:-1]
    assert len(bands.colours) == len(bands.edges) == len(levels) + 1
    for level in levels:
        first_digit = level / 10.0 ** np.floor(np.log10(level) + 1e-9)
        assert np.abs(np.array(STEPS) - first_digit).min() < 1e-9
    at_home = asked_force(factor, rotation)
    assert levels[0] / 5.0 < at_home < levels[-1]


def asked_force(factor: float, rotation: FloatArray) -> float:
    held = reactions(Configuration(OPTIMAL, OPTIMAL.home_pose.position, rotation), factor * LOAD)
    return float(np.abs(held.actuators).max())
