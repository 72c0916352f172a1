"""Claims that compare workspace and orientations of the 4-4 with those of other mechanisms."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import asdict, dataclass

import msgspec
import numpy as np
from scipy.spatial.transform import Rotation
from scipy.stats import qmc

from explorer.mechanism.design_file import PRESETS
from explorer.mechanism.kinematics import inverse
from explorer.mechanism.margins import margins, mode_of
from explorer.numerics.arrays import BoolArray, FloatArray
from explorer.reproduce.claim import Measurement, judge
from explorer.reproduce.six_legs import SixLegs, octahedral, six_four_twin
from explorer.workspace.limits.valid_poses import poses_are_valid
from explorer.workspace.slices.volume import workspace_volume

OPTIMAL = PRESETS["paper-optimal"]
# The optimum with no limit but its mode, the order of its carriages, and a stroke of one reach for
# each actuator, as the legs of the others have: the guide goes from a1 to a2.
STROKES = OPTIMAL.with_limits(box=None, guide=(0.0, OPTIMAL.reach))
FREE = msgspec.structs.replace(STROKES, home=OPTIMAL.home_pose)
TWINS = [six_four_twin(OPTIMAL, a2x) for a2x in (10.0, OPTIMAL.reach)]
"""The twin at two positions of a2, in design units."""
SIZES = (0.75, 1.0, 1.5)
"""Factors of the base of the octahedral platform."""

# Sets of points whose spread gives the error of a volume, and the binary logarithm of their size.
SETS, POINTS_LOG2 = 8, 16
POSITIONS, ORIENTATIONS, AZIMUTHS, MOST_TILT = 300, 1000, 24, 90
# Standard errors up to which a difference counts as none.
SIGMAS = 3.0
# Relative difference up to which two volumes count as alike.
ALIKE = 0.01

Holds = Callable[[FloatArray, FloatArray], BoolArray]


@dataclass(frozen=True)
class RelativeVolume:
    """The volume over the cubed reach at the orientation of home, and its standard error."""

    name: str
    volume: float
    error: float


@dataclass(frozen=True)
class Abilities:
    """The orientations that a mechanism can have, as means over positions of its workspace.

    They are the share of all orientations, and the greatest tilt in every azimuth from home's
    orientation in degrees, each with its standard error.
    """

    name: str
    share: float
    share_error: float
    tilt: float
    tilt_error: float


def measure_workspaces() -> Measurement:
    """Compare the volume of the 4-4's workspace with those of six-legged mechanisms."""
    exact = workspace_volume(FREE).volume / OPTIMAL.reach**3
    ours = RelativeVolume("4-4", exact, 0.0)
    twins = [_workspace(each) for each in TWINS]
    octahedra = [_workspace(octahedral(OPTIMAL, size)) for size in SIZES]
    others = (*twins, *octahedra)
    lines = [f"{'':18}{'volume/reach³':>14}{'error':>8}"]
    lines += [f"{each.name:18}{each.volume:14.3f}{each.error:8.3f}" for each in (ours, *others)]
    words = {
        "ours": ours,
        "others": ", ".join(f"{each.volume:.3f} ({each.name})" for each in others),
    }
    values = {"mechanisms": [asdict(each) for each in (ours, *others)]}

    def is_largest(among: Sequence[RelativeVolume]) -> bool:
        return all(each.volume < (1.0 - ALIKE) * ours.volume for each in among)

    condition = "beside the 6-4; an octahedral platform has more or less by the size of its base"
    is_within = is_largest(twins) and any(is_largest([each]) for each in octahedra)
    return judge(is_largest(others), words, values, lines, condition if is_within else "")


def measure_orientations() -> Measurement:
    """Compare the orientations of the 4-4 with those of six-legged mechanisms.

    Those with carriages in any order are reported only.
    """
    reach = OPTIMAL.reach
    points = qmc.scale(_points(0), 3 * [-2.0 * reach], 3 * [2.0 * reach])
    rotation = OPTIMAL.home_pose.rotation
    ours = _abilities("4-4", four_four, points, rotation)
    crossed = _abilities("4-4, any order", in_any_order, points, rotation)
    others = [
        _abilities(each.name, each.holds, qmc.scale(_points(0), *each.box), each.home[1])
        for each in (*TWINS, octahedral(OPTIMAL))
    ]
    lines = [f"{'':18}{'mean share':>12}{'error':>8}{'mean tilt':>11}{'error':>8}"]
    lines += [
        f"{a.name:18}{a.share:12.1%}{a.share_error:8.1%}{a.tilt:10.1f}°{a.tilt_error:7.1f}°"
        for a in (ours, crossed, *others)
    ]
    words = {
        "ours": ours,
        "crossed": crossed,
        "shares": ", ".join(f"{a.share:.1%} ({a.name})" for a in others),
        "tilts": ", ".join(f"{a.tilt:.0f}° ({a.name})" for a in others),
    }
    values = {"mechanisms": [asdict(each) for each in (ours, crossed, *others)]}
    by_share = all(
        ours.share - a.share > SIGMAS * np.hypot(ours.share_error, a.share_error) for a in others
    )
    by_tilt = all(
        ours.tilt - a.tilt > SIGMAS * np.hypot(ours.tilt_error, a.tilt_error) for a in others
    )
    condition = "by the greatest tilt" if by_tilt else ""
    condition = "by the share of all orientations" if by_share else condition
    return judge(by_share and by_tilt, words, values, lines, condition)


def four_four(position: FloatArray, rotation: FloatArray) -> BoolArray:
    """Return whether poses keep the strokes, the mode and the order of the carriages of home."""
    return poses_are_valid(FREE, position, rotation)


def in_any_order(position: FloatArray, rotation: FloatArray) -> BoolArray:
    """Return whether poses keep the strokes and the mode of home."""
    joints, home = inverse(OPTIMAL, position, rotation), OPTIMAL.home_pose
    within = (joints >= 0.0) & (joints <= OPTIMAL.reach)
    mode = mode_of(margins(home.position, home.rotation))
    return within.all(axis=-1) & (mode_of(margins(position, rotation)) == mode)


def _points(seed: int) -> FloatArray:
    """Return scrambled points of the sequence of Sobol in the unit cube, shape (n, 3)."""
    return qmc.Sobol(3, rng=np.random.default_rng([10, seed])).random_base2(POINTS_LOG2)


def _workspace(mechanism: SixLegs) -> RelativeVolume:
    """Return the volume of a mechanism by several sets of points in a box about its workspace."""
    lows, highs = mechanism.box
    size = float(np.prod(highs - lows)) / OPTIMAL.reach**3
    sets = (qmc.scale(_points(seed), lows, highs) for seed in range(SETS))
    shares = [float(mechanism.holds(points, mechanism.home[1]).mean()) for points in sets]
    error = float(np.std(shares, ddof=1)) / SETS**0.5
    return RelativeVolume(mechanism.name, size * float(np.mean(shares)), size * error)


def _abilities(name: str, holds: Holds, points: FloatArray, rotation: FloatArray) -> Abilities:
    """Return the orientations of a mechanism at the first of some points in its workspace."""
    inside = holds(points, np.broadcast_to(rotation, (len(points), 3, 3)))
    chosen = points[inside][:POSITIONS]
    turns = np.asarray(Rotation.random(ORIENTATIONS, rng=np.random.default_rng(10)).as_matrix())
    shares = np.array([holds(np.tile(p, (len(turns), 1)), turns).mean() for p in chosen])
    tilts = np.array([_greatest_tilt(holds, p, rotation) for p in chosen])
    root = len(chosen) ** 0.5
    both = [(float(each.mean()), float(each.std(ddof=1)) / root) for each in (shares, tilts)]
    return Abilities(name, *both[0], *both[1])


def _greatest_tilt(holds: Holds, position: FloatArray, rotation: FloatArray) -> float:
    """Return the greatest tilt in every azimuth up to which every whole degree holds."""
    azimuths = np.linspace(0.0, 2.0 * np.pi, AZIMUTHS, endpoint=False)
    axes = np.column_stack([np.cos(azimuths), np.sin(azimuths), np.zeros(AZIMUTHS)])
    angles = np.radians(np.arange(MOST_TILT + 1))
    vectors = (angles[:, None, None] * axes).reshape(-1, 3)
    turned = np.asarray(Rotation.from_rotvec(vectors).as_matrix()) @ rotation
    kept = holds(np.tile(position, (len(turned), 1)), turned).reshape(len(angles), AZIMUTHS)
    all_kept = kept.all(axis=1)
    return float(all_kept.argmin() - 1) if not all_kept.all() else float(MOST_TILT)
