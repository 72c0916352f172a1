"""Claims on the kinematics: a closed form with eight modes, the same as that of the 6-4."""

from __future__ import annotations

import math
from dataclasses import asdict, dataclass

import numpy as np

from explorer.mechanism.design import Design
from explorer.mechanism.design_file import PRESETS
from explorer.mechanism.kinematics import forward, inverse
from explorer.mechanism.margins import margins, mode_of
from explorer.numerics.arrays import FloatArray, dot
from explorer.reproduce.claim import Measurement, below, random_design, random_poses
from explorer.reproduce.six_legs import six_four_twin

DESIGNS, POSES, A2X = 6, 500, (5.0, 12.0, 26.0)
# Errors that count as none, of joints over the reach and of poses.
EXACT, SAME = 1e-9, 1e-6


@dataclass
class FormErrors:
    """The errors of the closed form.

    Attributes:
        joints: Largest error of the joints of its poses, over the reach.
        pose: Largest distance of a pose from the nearest of those with its joints.
        modes: Least number of triples of signs of the margins in these.
    """

    joints: float = 0.0
    pose: float = 0.0
    modes: int = 8


def closed_form() -> Measurement:
    """Solve the forward kinematics by the paper's three trilaterations, one after the other."""
    random = np.random.default_rng(4)
    errors = FormErrors()
    for design in (*PRESETS.values(), *(random_design(random) for _ in range(DESIGNS))):
        position, rotation = random_poses(random, POSES, 0.7 * design.reach)
        joints = inverse(design, position, rotation)
        p, r = solve_by_trilaterations(design, joints)
        off = np.abs(inverse(design, p, r) - joints[:, None]).max() / design.reach
        errors.joints = max(errors.joints, float(off))
        apart = np.abs(p - position[:, None]).max(axis=-1) / design.reach
        apart += np.abs(r - rotation[:, None]).max(axis=(-2, -1))
        errors.pose = max(errors.pose, float(apart.min(axis=1).max()))
        modes = np.sort(mode_of(margins(p, r)), axis=1)
        errors.modes = min(errors.modes, 1 + int((np.diff(modes) > 0).sum(axis=1).min()))
    return judge_closed_form(errors)


def judge_closed_form(errors: FormErrors) -> Measurement:
    """Return the measurement of the closed form."""
    text = (
        f"For the joints of {POSES} random poses of each of {len(PRESETS) + DESIGNS} designs, "
        "trilaterations of a1, a2 and a3 in turn, with two mirror points each, lead to eight poses "
        f"with these joints to {below(errors.joints, EXACT)} of the reach. Their margins have "
        f"{errors.modes} triples of signs. Each of the random poses is one of the eight of its "
        f"joints, to {below(errors.pose, SAME)}: there are no others."
    )
    is_so = errors.joints < EXACT and errors.pose < SAME and errors.modes == 8
    return Measurement(text, "confirmed" if is_so else "not confirmed", asdict(errors))


def solve_by_trilaterations(design: Design, joints: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Return the poses of joints (n, 6) by the paper's Figure 2: (n, 8, 3) and (n, 8, 3, 3).

    a1 follows from b1, b2 and b3, then a2 from a1, b2 and b3, and a3 from b4, a1 and a2, in the
    frame of the platform. The lengths h1 to h4 follow from d1 to d4 by the theorem of Pythagoras.
    """
    l1, d1, d2, d3, d4, l4 = joints.T
    a2x, (a3x, a3y) = design.a2x, design.a3
    b1, b4 = np.array([*design.b1, 0.0]), np.zeros(3)
    b2, b3 = np.array([design.b2, 0.0, 0.0]), np.array([design.b3, 0.0, 0.0])
    one = _trilaterate((b1, b2, b3), (l1, np.hypot(d1, d2), np.hypot(d3, d4)))
    h2, h4 = np.hypot(d1 - a2x, d2), np.hypot(d3 - a2x, d4)
    two = _trilaterate((one, b2, b3), (a2x, h2[:, None], h4[:, None]))
    one = np.broadcast_to(one[:, :, None], two.shape)
    to_a2 = math.hypot(a3x - a2x, a3y)
    three = _trilaterate((b4, one, two), (l4[:, None, None], design.reach, to_a2))
    one, two = (np.broadcast_to(a[:, :, :, None], three.shape) for a in (one, two))
    x = (two - one) / a2x
    y = (three - one - a3x * x) / a3y
    rotation = np.stack([x, y, np.cross(x, y)], axis=-2).reshape(-1, 8, 3, 3)
    return -(rotation @ one.reshape(-1, 8, 3, 1))[..., 0], rotation


def _trilaterate(
    centres: tuple[FloatArray, FloatArray, FloatArray], radii: tuple[FloatArray | float, ...]
) -> FloatArray:
    """Return the two points at three distances from three centres, shape (..., 2, 3)."""
    origin, second, third = np.broadcast_arrays(*centres)
    r0, r1, r2 = radii
    x = second - origin
    d = np.linalg.norm(x, axis=-1)
    x = x / d[..., None]
    i = dot(third - origin, x)
    y = third - origin - i[..., None] * x
    j = np.linalg.norm(y, axis=-1)
    y = y / j[..., None]
    along = (r0 * r0 - r1 * r1 + d * d) / (2.0 * d)
    across = (r0 * r0 - r2 * r2 + i * i + j * j - 2.0 * i * along) / (2.0 * j)
    height = np.sqrt(np.maximum(r0 * r0 - along * along - across * across, 0.0))
    foot = origin + along[..., None] * x + across[..., None] * y
    normal = height[..., None] * np.cross(x, y)
    return np.stack([foot + normal, foot - normal], axis=-2)


@dataclass
class TwinErrors:
    """The largest differences of the 4-4 and its 6-4 twin.

    Attributes:
        lengths: Difference of the twin's lengths in the eight modes of the 4-4, over the reach.
        joints: Difference of the joints that these lengths give, over the reach.
        determinant: Relative error of the determinant of the twin by the margins.
    """

    lengths: float = 0.0
    joints: float = 0.0
    determinant: float = 0.0


def same_kinematics() -> Measurement:
    """Compare the actuated variables, modes and singular poses of the 4-4 and its 6-4 twin."""
    random = np.random.default_rng(11)
    errors = TwinErrors()
    for design in (*PRESETS.values(), *(random_design(random) for _ in range(DESIGNS))):
        reach = design.reach
        positions, rotations = random_poses(random, POSES, reach)
        joints = inverse(design, positions, rotations)
        p, r, _ = forward(design, joints)
        for a2x in A2X:
            twin = six_four_twin(design, a2x)
            given = twin.lengths(positions, rotations)
            modes = np.array([twin.lengths(p[:, k], r[:, k]) for k in range(8)])
            errors.lengths = max(errors.lengths, float(np.abs(modes - given).max()) / reach)
            back = np.abs(_joints_of(given, a2x) - joints).max() / reach
            errors.joints = max(errors.joints, float(back))
            # The determinant over the margins is a constant of the design.
            own = twin.determinant(positions, rotations) * given.prod(axis=1)
            product = margins(positions, rotations).prod(axis=-1)
            constant = float(np.median(own / product))
            off = np.abs(own - constant * product).max() / (np.abs(constant) * reach**3)
            errors.determinant = max(errors.determinant, float(off))
    return judge_same_kinematics(errors)


def judge_same_kinematics(errors: TwinErrors) -> Measurement:
    """Return the measurement of the twin."""
    text = (
        f"For {POSES} random poses of each of {len(PRESETS) + DESIGNS} designs and a2x = "
        f"{', '.join(f'{x:g}' for x in A2X)}, the lengths of the 6-4 and the joints of the 4-4 "
        "determine each other: all eight modes of the 4-4 give the six legs the same lengths, to "
        f"{below(errors.lengths, EXACT)} of the reach, and these give back the joints by the "
        f"theorem of Pythagoras, to {below(errors.joints, EXACT)}. The determinant of the 6-4 "
        "times its lengths is a constant times δ1 δ2 δ3, to "
        f"{below(errors.determinant, EXACT)}. So both have the same modes and the same singular "
        "poses."
    )
    is_same = max(errors.lengths, errors.joints, errors.determinant) < EXACT
    return Measurement(text, "confirmed" if is_same else "not confirmed", asdict(errors))


def _joints_of(lengths: FloatArray, a2x: float) -> FloatArray:
    """Return the joints (n, 6) of the 4-4 by the lengths of its twin, in the order of `TWIN`."""
    l1, h1, h3, h2, h4, l4 = lengths.T
    d1, d3 = ((a * a - b * b + a2x * a2x) / (2.0 * a2x) for a, b in ((h1, h2), (h3, h4)))
    d2, d4 = (np.sqrt(h * h - d * d) for h, d in ((h1, d1), (h3, d3)))
    return np.stack([l1, d1, d2, d3, d4, l4], axis=-1)
