"""Claims on the singularities: they are the poses in which a tetrahedron is flat, and no others."""

from __future__ import annotations

import numpy as np

from explorer.mechanism.kinematics import inverse
from explorer.mechanism.margins import margins
from explorer.numerics.arrays import FloatArray
from explorer.reproduce.claim import Measured
from explorer.reproduce.samples import random_design, random_poses
from explorer.singularity.ellipsoids import planes_of_singularity
from explorer.singularity.jacobian import determinant, inverse_condition, jacobian

DESIGNS, POSES = 12, 2000
# Margins over the reach of poses that count as off all singular planes.
OFF = 0.05
EXACT, SINGULAR = 1e-12, 1e-12


def flat_tetrahedra() -> Measured:
    """Compare det J with its closed form, and the condition of J on the planes and off them."""
    random = np.random.default_rng(5)
    identity, on_planes, off_planes = 0.0, 0.0, np.inf
    for _ in range(DESIGNS):
        design = random_design(random)
        p, r = random_poses(random, POSES, design.reach)
        joints, delta = inverse(design, p, r), margins(p, r)
        j = jacobian(design, p, r)
        rows = np.linalg.norm(j, axis=-1).prod(axis=-1)
        error = np.abs(np.linalg.det(j) - determinant(design, joints, delta)) / rows
        identity = max(identity, float(error.max()))
        condition = inverse_condition(j, design.reach)
        off = np.abs(delta).min(axis=-1) >= OFF * design.reach
        off_planes = min(off_planes, float(condition[off].min()))
        for index in range(3):
            flat = _on_plane(p, r, index)
            at_plane = inverse_condition(jacobian(design, flat, r), design.reach)
            on_planes = max(on_planes, float(at_plane.max()))
    count = DESIGNS * POSES
    text = (
        "det J · l1 d2 d4 l4 = −b1y a3y (b3 − b2)² δ1 δ2 δ3 holds in "
        f"{count:,} random poses of {DESIGNS} random designs within {identity:.1e} of the product "
        f"of the rows' lengths. Moved onto a plane δi = 0, their inverse condition is at most "
        f"{on_planes:.1e}; where every |δi| is at least {OFF:g} of the reach it is at least "
        f"{off_planes:.1e}."
    )
    is_so = identity < EXACT and on_planes < SINGULAR and off_planes > 1e6 * SINGULAR
    return Measured(
        text,
        "confirmed" if is_so else "not confirmed",
        {
            "poses": count,
            "identity_error": identity,
            "largest_condition_on_planes": on_planes,
            "least_condition_off_planes": off_planes,
        },
    )


def _on_plane(position: FloatArray, rotation: FloatArray, index: int) -> FloatArray:
    """Return the nearest positions at which a margin vanishes, shape (n, 3)."""
    normal = planes_of_singularity(rotation)[..., index, :]
    length = np.linalg.norm(normal, axis=-1, keepdims=True)
    normal = normal / length
    for _ in range(2):
        position = position - (position * normal).sum(axis=-1, keepdims=True) * normal
    return position
