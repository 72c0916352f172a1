"""Claims on the forward kinematics: a closed form, by three trilaterations, with eight modes."""

from __future__ import annotations

import numpy as np
from scipy.spatial.transform import Rotation

from explorer.mechanism.design import Design
from explorer.mechanism.design_file import PRESETS
from explorer.mechanism.kinematics import forward, inverse
from explorer.numerics.arrays import FloatArray
from explorer.reproduce.claim import Measured
from explorer.reproduce.samples import random_design, random_poses
from explorer.singularity.jacobian import jacobian

DESIGNS, POSES, STARTS, STEPS = 6, 4, 400, 80
# Residual of joints over the reach that counts as a solution, and distance that counts as the same.
SOLVED, SAME = 1e-11, 1e-6
# Accuracy that counts as exact, over the reach.
EXACT = 1e-9


def closed_form() -> Measured:
    """Solve the forward kinematics by Newton's method from random starts, beside the closed form.

    The closed form must solve the nine quadratic equations too: the squared distances of the three
    trilaterations, in the platform frame.
    """
    random = np.random.default_rng(4)
    designs = [*PRESETS.values(), *(random_design(random) for _ in range(DESIGNS))]
    worst, equations, found, missing, strange, solved, tried = 0.0, 0.0, 0, 0, 0, 0, 0
    for design in designs:
        positions, rotations = random_poses(random, POSES, 0.7 * design.reach)
        for position, rotation in zip(positions, rotations, strict=True):
            joints = inverse(design, position, rotation)
            p, r, feasible = forward(design, joints)
            if not bool(feasible):
                missing += 8
                continue
            back = np.abs(inverse(design, p, r) - joints).max() / design.reach
            worst = max(worst, float(back))
            equations = max(equations, _quadratic_residual(design, joints, p, r))
            hits, others, count = _newton(design, joints, p, r, random)
            found += hits
            missing += len(p) - hits
            strange += others
            solved += count
            tried += STARTS
    text = (
        f"The closed form returns to the joints within {worst:.1e} of the reach and solves the "
        f"nine quadratic equations within {equations:.1e}. Newton's method on the six loop "
        f"equations from {tried:,} random starts converged {solved:,} times, to {found} of the "
        f"{found + missing} modes of {len(designs) * POSES} joint vectors and {strange} times to "
        "anything else."
    )
    is_exact = worst < EXACT and equations < EXACT and strange == 0
    verdict = "confirmed" if is_exact and missing == 0 else "not confirmed"
    return Measured(
        text,
        verdict,
        {
            "closed_form_error": worst,
            "quadratic_residual": equations,
            "starts": tried,
            "converged": solved,
            "modes_found": found,
            "modes_missed": missing,
            "other_solutions": strange,
        },
    )


def _newton(
    design: Design,
    joints: FloatArray,
    modes: FloatArray,
    rotations: FloatArray,
    random: np.random.Generator,
) -> tuple[int, int, int]:
    """Return how many modes Newton's method finds, how often anything else, how often any."""
    reach = design.reach
    p, r = random_poses(random, STARTS, 1.5 * reach)
    for _ in range(STEPS):
        missed = joints - inverse(design, p, r)
        system = jacobian(design, p, r) + 1e-14 * np.eye(6)
        step = np.linalg.solve(system, missed[..., None])[..., 0]
        # Far from a solution a whole step may lead anywhere.
        length = np.abs(step[:, :3]).max(axis=1) / (0.3 * reach)
        turn = np.linalg.norm(step[:, 3:], axis=1) / 0.5
        step /= np.maximum(1.0, np.maximum(length, turn))[:, None]
        p = p + step[:, :3]
        r = Rotation.from_rotvec(step[:, 3:]).as_matrix() @ r
    missed = np.abs(joints - inverse(design, p, r)).max(axis=1)
    ok = missed < SOLVED * reach
    off = np.abs(p[ok][:, None] - modes).max(axis=-1) / reach
    off += np.abs(r[ok][:, None] - rotations).max(axis=(-2, -1))
    is_mode = off < SAME
    found = int(is_mode.any(axis=0).sum())
    return found, int((~is_mode.any(axis=1)).sum()), int(ok.sum())


def _quadratic_residual(
    design: Design, joints: FloatArray, positions: FloatArray, rotations: FloatArray
) -> float:
    """Return the largest residual of the nine quadratic equations, over the squared reach.

    The unknowns are a1, a2 and a3 in the platform frame; the lengths h1 to h4 follow from d1 to d4
    by the theorem of Pythagoras.
    """
    l1, d1, d2, d3, d4, l4 = joints.tolist()
    a2x, a3 = design.a2x, np.array([*design.a3, 0.0])
    b1, b4 = np.array([*design.b1, 0.0]), np.zeros(3)
    b2, b3 = np.array([design.b2, 0.0, 0.0]), np.array([design.b3, 0.0, 0.0])
    turned = np.swapaxes(rotations, -1, -2)
    a1p, a2p, a3p = (
        np.einsum("kij,kj->ki", turned, a - positions)
        for a in (np.zeros(3), np.array([a2x, 0.0, 0.0]), a3)
    )
    across = np.array([a2x, 0.0, 0.0]) - a3
    equations = (
        (a1p, b1, l1**2),
        (a1p, b2, d1**2 + d2**2),
        (a1p, b3, d3**2 + d4**2),
        (a2p, a1p, a2x**2),
        (a2p, b2, (d1 - a2x) ** 2 + d2**2),
        (a2p, b3, (d3 - a2x) ** 2 + d4**2),
        (a3p, a1p, float(a3 @ a3)),
        (a3p, a2p, float(across @ across)),
        (a3p, b4, l4**2),
    )
    size = design.reach**2 + a2x**2 + float(joints @ joints)
    worst = max(
        float(np.abs(((one - two) ** 2).sum(axis=-1) - square).max())
        for one, two, square in equations
    )
    return worst / size
