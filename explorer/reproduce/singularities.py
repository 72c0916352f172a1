"""The claim that the singular poses are those in which a tetrahedron is flat, and no others."""

from __future__ import annotations

from dataclasses import asdict, dataclass

import numpy as np

from explorer.mechanism.configuration import Configuration
from explorer.mechanism.design import Design
from explorer.mechanism.kinematics import inverse
from explorer.mechanism.margins import margins
from explorer.numerics.arrays import FloatArray
from explorer.reproduce.claim import Measurement, below
from explorer.reproduce.samples import PHI1, PHI2, PHI3, flatten, random_design, random_poses
from explorer.singularity.jacobian import (
    determinant,
    inverse_condition,
    jacobian,
    tetrahedron_volumes,
)

DESIGNS, POSES = 12, 2000
# Margins over the reach of poses that count as off all singular planes.
OFF = 0.05
EXACT = 1e-12


@dataclass
class Errors:
    """The largest errors over all poses, and the conditions of J on and off the singular planes.

    Attributes:
        volumes: Error of the volumes of the tetrahedra by the margins, over the cubed reach.
        identity: Error of the formula of det J, over the product of the lengths of its rows.
        on_planes: Largest inverse condition of J at poses with a flat tetrahedron.
        off_planes: Least inverse condition of J at poses with every |δi| above `OFF`.
    """

    volumes: float = 0.0
    identity: float = 0.0
    on_planes: float = 0.0
    off_planes: float = float("inf")


def flat_tetrahedra() -> Measurement:
    """Compare volumes and det J with closed forms, and the condition of J on and off the planes."""
    random = np.random.default_rng(5)
    errors = Errors()
    for _ in range(DESIGNS):
        design = random_design(random)
        p, r = random_poses(random, POSES, design.reach)
        joints, delta = inverse(design, p, r), margins(p, r)
        by_margins = np.abs(tetrahedron_volumes(design, delta))
        off = np.abs(_volumes(design, p, r) - by_margins).max() / design.reach**3
        errors.volumes = max(errors.volumes, float(off))
        j = jacobian(design, p, r)
        rows = np.linalg.norm(j, axis=-1).prod(axis=-1)
        error = np.abs(np.linalg.det(j) - determinant(design, joints, delta)) / rows
        errors.identity = max(errors.identity, float(error.max()))
        condition = inverse_condition(j, design.reach)
        is_off = np.abs(delta).min(axis=-1) >= OFF * design.reach
        errors.off_planes = min(errors.off_planes, float(condition[is_off].min()))
        for column in (PHI1, PHI2, PHI3):
            flat = inverse_condition(jacobian(design, *flatten(p, r, column)), design.reach)
            errors.on_planes = max(errors.on_planes, float(flat.max()))
    return judge_flat(errors)


def judge_flat(errors: Errors) -> Measurement:
    """Return the measurement of the errors and conditions."""
    text = (
        f"In {DESIGNS * POSES:,} random poses of {DESIGNS} random designs the volumes of the "
        "tetrahedra, computed from their points, are those of the margins to "
        f"{below(errors.volumes, EXACT)} of the cubed reach, and det J · l1 d2 d4 l4 = "
        "−b1y a3y (b3 − b2)² δ1 δ2 δ3 holds to "
        f"{below(errors.identity, EXACT)} of the product of the rows' lengths. Where a tetrahedron "
        f"is flat the inverse condition of J is {below(errors.on_planes, EXACT)}; where every |δi| "
        f"is at least {OFF:g} of the reach it is at least {errors.off_planes:.0e}."
    )
    is_so = max(errors.volumes, errors.identity, errors.on_planes) < EXACT
    is_regular = errors.off_planes > 1e6 * EXACT
    verdict = "confirmed" if is_so and is_regular else "not confirmed"
    return Measurement(text, verdict, asdict(errors))


def _volumes(design: Design, position: FloatArray, rotation: FloatArray) -> FloatArray:
    """Return the volumes of the three tetrahedra from their points, shape (n, 3)."""
    points = Configuration(design, position, rotation).points
    a1, a3 = np.zeros(3), np.array([*design.a3, 0.0])
    a2 = np.array([design.a2x, 0.0, 0.0])
    b1, b2, b3, b4 = points.b1, points.b2, points.b3, points.b4
    tetrahedra = ((b1, b2, b3, a1), (a1, a2, b2, b3), (b4, a1, a2, a3))
    return np.stack(
        [
            np.abs(np.linalg.det(np.stack(np.broadcast_arrays(q - o, r - o, s - o), axis=-1))) / 6.0
            for o, q, r, s in tetrahedra
        ],
        axis=-1,
    )
