"""Claims on the kinematics: a closed form with eight modes, the same as that of the 6-4."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.spatial.transform import Rotation

from explorer.mechanism.design import Design
from explorer.mechanism.design_file import PRESETS
from explorer.mechanism.kinematics import forward, inverse
from explorer.mechanism.margins import margins
from explorer.numerics.arrays import FloatArray
from explorer.reproduce.claim import Measurement, below
from explorer.reproduce.samples import random_design, random_poses
from explorer.reproduce.six_legs import six_four_twin
from explorer.singularity.jacobian import jacobian

DESIGNS, POSES, STARTS, STEPS = 6, 4, 400, 80
# Residual of joints over the reach that counts as a solution, and distance that counts as the same.
SOLVED, SAME = 1e-11, 1e-6
# Accuracy that counts as exact, over the reach.
EXACT = 1e-9
TWIN_POSES, A2X = 500, (5.0, 12.0, 26.0)


@dataclass
class Search:
    """The solutions that a search from random starts finds, beside those of the closed form.

    Attributes:
        starts: Number of starts.
        converged: Number of starts from which the search converged.
        modes: Number of modes of the closed form.
        found: Number of these modes to which the search converged.
        others: Number of starts from which it converged to anything else.
    """

    starts: int = 0
    converged: int = 0
    modes: int = 0
    found: int = 0
    others: int = 0

    def add(self, is_mode: FloatArray, starts: int) -> None:
        """Add converged starts, given as truths (converged, modes) of what each is close to."""
        self.starts += starts
        self.converged += len(is_mode)
        self.modes += is_mode.shape[1]
        self.found += int(is_mode.any(axis=0).sum())
        self.others += int((~is_mode.any(axis=1)).sum())

    def words(self, what: str) -> str:
        """Return what was found, in words."""
        return (
            f"Newton's method on the {what} converged from {self.converged / self.starts:.0%} of "
            f"{self.starts:,} random starts, to {self.found} of the {self.modes} modes and "
            f"{self.others} times to anything else"
        )


def closed_form() -> Measurement:
    """Solve the forward kinematics by Newton's method in two forms, beside the closed form."""
    random = np.random.default_rng(4)
    designs = [*PRESETS.values(), *(random_design(random) for _ in range(DESIGNS))]
    loops, squares, worst = Search(), Search(), 0.0
    for design in designs:
        positions, rotations = random_poses(random, POSES, 0.7 * design.reach)
        for position, rotation in zip(positions, rotations, strict=True):
            joints = inverse(design, position, rotation)
            p, r, _ = forward(design, joints)
            back = np.abs(inverse(design, p, r) - joints).max() / design.reach
            worst = max(worst, float(back))
            loops.add(_solve_loops(design, joints, p, r, random), STARTS)
            squares.add(_solve_squares(design, joints, p, r, random), STARTS)
    return judge_closed_form(worst, loops, squares, len(designs) * POSES)


def judge_closed_form(worst: float, loops: Search, squares: Search, count: int) -> Measurement:
    """Return the measurement of the closed form.

    Args:
        worst: Largest difference of the joints of its modes from the given ones, over the reach.
        loops: Search on the six loop equations.
        squares: Search on the nine quadratic equations.
        count: Number of joint vectors.
    """
    text = (
        f"For {count} joint vectors of random poses, the eight modes of the closed form have the "
        f"joints to {below(worst, EXACT)} of the reach. {loops.words('six loop equations')}. "
        f"{squares.words('nine quadratic equations')}."
    )
    searches = (loops, squares)
    is_complete = all(each.found == each.modes and each.others == 0 for each in searches)
    return Measurement(
        text,
        "confirmed" if is_complete and worst < EXACT else "not confirmed",
        {"closed_form_error": worst, "loops": vars(loops), "quadratic": vars(squares)},
    )


def _solve_loops(
    design: Design,
    joints: FloatArray,
    modes: FloatArray,
    rotations: FloatArray,
    random: np.random.Generator,
) -> FloatArray:
    """Return which mode each converged start of Newton's method is close to, shape (n, 8)."""
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
    ok = np.abs(joints - inverse(design, p, r)).max(axis=1) < SOLVED * reach
    off = np.abs(p[ok][:, None] - modes).max(axis=-1) / reach
    off += np.abs(r[ok][:, None] - rotations).max(axis=(-2, -1))
    return off < SAME


def _solve_squares(
    design: Design,
    joints: FloatArray,
    modes: FloatArray,
    rotations: FloatArray,
    random: np.random.Generator,
) -> FloatArray:
    """Return which mode each converged start on the nine quadratic equations is close to, (n, 8).

    The unknowns are a1, a2 and a3 in the platform frame, and the equations their squared distances
    to the points of the three trilaterations. The lengths h1 to h4 follow from d1 to d4 by the
    theorem of Pythagoras.
    """
    l1, d1, d2, d3, d4, l4 = joints.tolist()
    a2x = design.a2x
    base = np.array([[0.0, 0.0, 0.0], [a2x, 0.0, 0.0], [*design.a3, 0.0]])
    b1, b4 = np.array([*design.b1, 0.0]), np.zeros(3)
    b2, b3 = np.array([design.b2, 0.0, 0.0]), np.array([design.b3, 0.0, 0.0])
    to_points = (
        (0, b1, l1**2),
        (0, b2, d1**2 + d2**2),
        (0, b3, d3**2 + d4**2),
        (1, b2, (d1 - a2x) ** 2 + d2**2),
        (1, b3, (d3 - a2x) ** 2 + d4**2),
        (2, b4, l4**2),
    )
    between = [(i, j, float(((base[i] - base[j]) ** 2).sum())) for i, j in ((0, 1), (0, 2), (1, 2))]
    size = max(design.reach, a2x, float(np.abs(joints).max()))
    a = random.uniform(-1.5 * size, 1.5 * size, (STARTS, 3, 3))

    def equations() -> tuple[FloatArray, FloatArray]:
        """Return the residuals (n, 9) and their derivatives by the unknowns (n, 9, 9)."""
        residual, slopes = np.empty((STARTS, 9)), np.zeros((STARTS, 9, 3, 3))
        for k, (i, point, square) in enumerate(to_points):
            apart = a[:, i] - point
            residual[:, k] = (apart**2).sum(axis=-1) - square
            slopes[:, k, i] = 2.0 * apart
        for k, (i, j, square) in enumerate(between, start=len(to_points)):
            apart = a[:, i] - a[:, j]
            residual[:, k] = (apart**2).sum(axis=-1) - square
            slopes[:, k, i], slopes[:, k, j] = 2.0 * apart, -2.0 * apart
        return residual, slopes.reshape(STARTS, 9, 9)

    for _ in range(2 * STEPS):
        residual, slopes = equations()
        system = slopes + 1e-13 * size * np.eye(9)
        step = np.linalg.solve(system, residual[..., None])[..., 0]
        step /= np.maximum(1.0, np.abs(step).max(axis=1) / (0.5 * size))[:, None]
        a = a - step.reshape(STARTS, 3, 3)
    ok = np.abs(equations()[0]).max(axis=1) < SOLVED * size**2
    found = np.swapaxes(rotations, -1, -2)[:, None] @ (base - modes[:, None])[..., None]
    off = np.abs(a[ok][:, None] - found[..., 0]).max(axis=(-2, -1)) / size
    return off < SAME


def same_kinematics() -> Measurement:
    """Compare the modes and the singular poses of the 4-4 and of its 6-4 twin."""
    random = np.random.default_rng(11)
    lengths, ratio = 0.0, 0.0
    for design in (*PRESETS.values(), *(random_design(random) for _ in range(DESIGNS))):
        positions, rotations = random_poses(random, TWIN_POSES, design.reach)
        p, r, _ = forward(design, inverse(design, positions, rotations))
        for a2x in A2X:
            twin = six_four_twin(design, a2x)
            given = twin.lengths(positions, rotations)
            modes = [twin.lengths(p[:, k], r[:, k]) for k in range(8)]
            lengths = max(lengths, float(np.abs(np.array(modes) - given).max()) / design.reach)
            # The determinant over the margins is a constant of the design.
            own = twin.determinant(positions, rotations) * given.prod(axis=1)
            product = margins(positions, rotations).prod(axis=-1)
            constant = float(np.median(own / product))
            size = np.abs(constant) * design.reach**3
            ratio = max(ratio, float(np.abs(own - constant * product).max()) / size)
    return judge_same_kinematics(lengths, ratio)


def judge_same_kinematics(lengths: float, ratio: float) -> Measurement:
    """Return the measurement of the twin, given relative errors of lengths and determinants."""
    text = (
        f"For {TWIN_POSES} random poses of each of {len(PRESETS) + DESIGNS} designs and a2x = "
        f"{', '.join(f'{x:g}' for x in A2X)}, all eight modes of the 4-4 give the six legs of the "
        f"6-4 the same lengths to {below(lengths, EXACT)} of the reach, and the determinant of "
        f"the 6-4 times its lengths is a constant times δ1 δ2 δ3 to {below(ratio, EXACT)}: both "
        "have the same "
        "modes and the same singular poses."
    )
    is_same = lengths < EXACT and ratio < EXACT
    return Measurement(
        text,
        "confirmed" if is_same else "not confirmed",
        {"largest_length_difference": lengths, "determinant_error": ratio},
    )
