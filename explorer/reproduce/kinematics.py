"""Claims on the kinematics and on singular poses.

A closed form with eight modes, the same as that of the 6-4; a flat tetrahedron in each singular
pose, and a singular pose on each path between modes.
"""

from __future__ import annotations

import msgspec
import numpy as np
from scipy.spatial.transform import Rotation

from explorer.mechanism.configuration import Configuration
from explorer.mechanism.design import Design
from explorer.mechanism.design_file import PRESETS
from explorer.mechanism.folds import from_folds, to_folds
from explorer.mechanism.kinematics import determinant, forward, inverse, tetrahedron_volumes
from explorer.mechanism.margins import margins, mode_of
from explorer.numerics.arrays import FloatArray
from explorer.reproduce import claim
from explorer.six_legged.files import six_four_twin
from explorer.six_legged.table import TablePoses

OPTIMAL = PRESETS["paper-optimal"]
PAPER = (PRESETS["paper-initial"], OPTIMAL)
DESIGNS, POSES, A2X = 6, 500, (5.0, 12.0, 26.0)
# Longest legs of the twin over the reach: the lengths are compared, not limited.
FAR = 10.0
# Errors that count as none, of joints over the reach and of poses.
EXACT, SAME = 1e-9, 1e-6
# Designs and poses for the flat tetrahedra, and the errors of these that count as none.
FLAT_DESIGNS, FLAT_POSES, FLAT = 12, 2000, 1e-12
# Margins over the reach of poses that count as off all singular planes.
OFF = 0.05
PATHS, ON_PATH, HALVINGS = 500, 200, 60
# Inverse condition of J up to which a pose on a path counts as singular.
SINGULAR = 1e-9
# Share of a margin that rounding may take.
ROUNDING = 1e-9


def measure_closed_form() -> claim.Measurement:
    """Solve the forward kinematics of the joints of random poses."""
    random = np.random.default_rng(4)
    off, missed, least = 0.0, 0.0, 8
    for design in (*PAPER, *(claim.random_design(random) for _ in range(DESIGNS))):
        position, rotation = claim.random_poses(random, POSES, 0.7 * design.reach)
        joints = inverse(design, position, rotation)
        p, r, _ = forward(design, joints)
        off = max(off, float(np.abs(inverse(design, p, r) - joints[:, None]).max()) / design.reach)
        apart = np.abs(p - position[:, None]).max(axis=-1) / design.reach
        apart += np.abs(r - rotation[:, None]).max(axis=(-2, -1))
        missed = max(missed, float(apart.min(axis=1).max()))
        modes = np.sort(mode_of(margins(p, r)), axis=1)
        least = min(least, 1 + int((np.diff(modes) > 0).sum(axis=1).min()))
    words = {
        "poses": POSES,
        "designs": len(PAPER) + DESIGNS,
        "joints": claim.below(off, EXACT),
        "pose": claim.below(missed, SAME),
    }
    is_so = off < EXACT and missed < SAME and least == 8
    return claim.judge(is_so, words, {"joints": off, "pose": missed, "modes": least})


def measure_same_kinematics() -> claim.Measurement:
    """Compare the actuated variables, modes and singular poses of the 4-4 and its 6-4 twin."""
    random = np.random.default_rng(11)
    errors = np.zeros(3)
    for design in (*PAPER, *(claim.random_design(random) for _ in range(DESIGNS))):
        positions, rotations = claim.random_poses(random, POSES, design.reach)
        joints = inverse(design, positions, rotations)
        p, r, _ = forward(design, joints)
        for a2x in A2X:
            # In units of 1 mm, as the twin.
            same = msgspec.structs.replace(design, unit_mm=1.0)
            twin = six_four_twin(same, a2x, FAR * design.reach)
            poses = TablePoses(twin, positions, rotations)
            given = poses.lengths
            modes = np.array([TablePoses(twin, p[:, k], r[:, k]).lengths for k in range(8)])
            back = _joints_of(given, a2x)
            # The determinant over the margins is a constant of the design.
            own = np.linalg.det(poses.jacobian) * given.prod(axis=1)
            product = margins(positions, rotations).prod(axis=-1)
            constant = float(np.median(own / product))
            off = (modes - given, back - joints, (own / constant - product) / design.reach**2)
            errors = np.maximum(errors, [np.abs(each).max() / design.reach for each in off])
    names = ("lengths", "joints", "determinant")
    values: dict[str, float] = dict(zip(names, errors.tolist(), strict=True))
    words = {name: claim.below(value, EXACT) for name, value in values.items()} | {
        "poses": POSES,
        "designs": len(PAPER) + DESIGNS,
        "a2x": ", ".join(f"{x:g}" for x in A2X),
    }
    return claim.judge(max(values.values()) < EXACT, words, values)


def _joints_of(lengths: FloatArray, a2x: float) -> FloatArray:
    """Return the joints (n, 6) of the 4-4 by the lengths of its twin, in the order of `TWIN`."""
    l1, h1, h3, h2, h4, l4 = lengths.T
    d1, d3 = ((a * a - b * b + a2x * a2x) / (2.0 * a2x) for a, b in ((h1, h2), (h3, h4)))
    d2, d4 = (np.sqrt(h * h - d * d) for h, d in ((h1, d1), (h3, d3)))
    return np.stack([l1, d1, d2, d3, d4, l4], axis=-1)


def measure_flat_tetrahedra() -> claim.Measurement:
    """Compare volumes and det J with closed forms, and the condition of J on and off the planes."""
    random = np.random.default_rng(5)
    volumes = identity = on_planes = 0.0
    off_planes = np.inf
    for _ in range(FLAT_DESIGNS):
        design = claim.random_design(random)
        p, r = claim.random_poses(random, FLAT_POSES, design.reach)
        at = Configuration(design, p, r)
        delta, j = at.margins, at.jacobian
        by_margins = np.abs(tetrahedron_volumes(design, delta))
        off = np.abs(_volumes(design, p, r) - by_margins).max() / design.reach**3
        volumes = max(volumes, float(off))
        rows = np.linalg.norm(j, axis=-1).prod(axis=-1)
        error = np.abs(np.linalg.det(j) - determinant(design, at.joints, delta)) / rows
        identity = max(identity, float(error.max()))
        condition = at.inverse_condition
        is_off = np.abs(delta).min(axis=-1) >= OFF * design.reach
        off_planes = min(off_planes, float(condition[is_off].min()))
        for column in (claim.PHI1, claim.PHI2, claim.PHI3):
            flat = Configuration(design, *claim.flatten(p, r, column)).inverse_condition
            on_planes = max(on_planes, float(flat.max()))
    errors = {"volumes": volumes, "identity": identity, "on_planes": on_planes}
    words = {name: claim.below(value, FLAT) for name, value in errors.items()} | {
        "poses": FLAT_DESIGNS * FLAT_POSES,
        "designs": FLAT_DESIGNS,
        "off": OFF,
    }
    is_so = max(errors.values()) < FLAT and off_planes > 1e6 * FLAT
    return claim.judge(is_so, words, {**errors, "off_planes": off_planes})


def _volumes(design: Design, position: FloatArray, rotation: FloatArray) -> FloatArray:
    """Return the volumes of the three tetrahedra from their points, shape (n, 3)."""
    at = Configuration(design, position, rotation).points
    tetrahedra = (
        (at.b1, at.b2, at.b3, at.a1),
        (at.a1, at.a2, at.b2, at.b3),
        (at.b4, at.a1, at.a2, at.a3),
    )
    edges = (np.broadcast_arrays(q - o, r - o, s - o) for o, q, r, s in tetrahedra)
    products = [np.linalg.det(np.stack(each, axis=-1)) for each in edges]
    return np.abs(np.stack(products, axis=-1)) / 6.0


def measure_mode_paths() -> claim.Measurement:
    """Find a singular pose on random paths between modes, and try to stay off them in a mode."""
    random = np.random.default_rng(8)
    worst = float(conditions_at_crossings(*random_paths(random, PATHS)).max())
    # The least |δi| on straight lines in the folds, over the smaller of its ends.
    one, other = (to_folds(*claim.random_poses(random, PATHS, OPTIMAL.reach)) for _ in range(2))
    other[:, 3:] = np.copysign(other[:, 3:], one[:, 3:])
    shares = np.linspace(0.0, 1.0, ON_PATH)[:, None, None]
    sizes = np.abs(margins(*from_folds(one + shares * (other - one))))
    kept = float((sizes / np.minimum(sizes[0], sizes[-1])).min())
    words = {"worst": claim.below(worst, SINGULAR), "kept": kept}
    values = {"paths": PATHS, "largest_inverse_condition": worst, "kept_share_of_margins": kept}
    return claim.judge(worst < SINGULAR and kept > 1.0 - ROUNDING, words, values)


def paths_at(
    shares: FloatArray, start: FloatArray, rotation: FloatArray, way: FloatArray, detour: FloatArray
) -> tuple[FloatArray, FloatArray]:
    """Return positions (n, 3) and rotations (n, 3, 3) at a share of each path, shape (n,).

    Paths go from a pose along a way, with a detour that is largest in the middle. Both are shifts
    of b4 and rotation vectors, shape (n, 6).
    """
    s = shares[:, None]
    moves = s * way + np.sin(np.pi * s) * detour
    turns = np.asarray(Rotation.from_rotvec(moves[:, 3:]).as_matrix())
    return start + moves[:, :3], turns @ rotation


def random_paths(random: np.random.Generator, count: int) -> tuple[FloatArray, ...]:
    """Return paths, as of `paths_at`, between two modes of the joints of random poses."""
    reach = OPTIMAL.reach
    p, r, _ = forward(OPTIMAL, inverse(OPTIMAL, *claim.random_poses(random, count, reach)))
    first, last = random.permuted(np.tile(np.arange(8), (count, 1)), axis=1)[:, :2].T
    rows = np.arange(count)
    start, end = r[rows, first], r[rows, last]
    turn = Rotation.from_matrix(end @ np.swapaxes(start, 1, 2)).as_rotvec()
    way = np.concatenate([p[rows, last] - p[rows, first], turn], axis=1)
    detour = random.normal(size=(count, 6)) * [reach, reach, reach, 1.0, 1.0, 1.0]
    return p[rows, first], start, way, detour


def conditions_at_crossings(*paths: FloatArray) -> FloatArray:
    """Return the inverse condition of J where a margin changes its sign on each path, shape (n,).

    It is the first margin whose signs at both ends differ; without one the end of the path counts.
    """
    rows = np.arange(len(paths[0]))

    def signs(shares: FloatArray) -> FloatArray:
        return np.sign(margins(*paths_at(shares, *paths)))

    low, high = np.zeros(len(rows)), np.ones(len(rows))
    start = signs(low)
    which = (start != signs(high)).argmax(axis=1)
    for _ in range(HALVINGS):
        middle = 0.5 * (low + high)
        is_before = (signs(middle) == start)[rows, which]
        low, high = np.where(is_before, middle, low), np.where(is_before, high, middle)
    return Configuration(OPTIMAL, *paths_at(low, *paths)).inverse_condition
