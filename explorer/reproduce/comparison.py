"""Claims that compare workspace and orientations of the 4-4 with those of tables on six legs."""

from __future__ import annotations

import itertools
from collections.abc import Iterator, Sequence
from dataclasses import asdict, dataclass
from functools import partial
from typing import NamedTuple

import msgspec
import numpy as np
from scipy.spatial.transform import Rotation

from explorer.mechanism.design_file import PRESETS
from explorer.mechanism.kinematics import inverse
from explorer.mechanism.margins import margins, mode_of
from explorer.numerics.arrays import BoolArray, FloatArray
from explorer.reproduce.claim import Measurement, judge
from explorer.six_legged.case import Holds, TableCase, greatest_tilts
from explorer.six_legged.files import six_four_twin
from explorer.six_legged.table import SixLegged, TableHome, TablePoses, table_of
from explorer.workspace.least_clearance import nodes_of
from explorer.workspace.limits.constraints import HalfSpace
from explorer.workspace.limits.region import Region, region_of
from explorer.workspace.limits.valid_poses import poses_are_valid
from explorer.workspace.slices.volume import region_volume
from explorer.workspace.workspace import Workspace

# In units of 1 mm, as the tables beside it.
OPTIMAL = msgspec.structs.replace(PRESETS["paper-optimal"], unit_mm=1.0)
# The optimum with no limit but its mode, the order of its carriages, and a stroke of one reach for
# each actuator, as the legs of the others have: the guide goes from a1 to a2.
FREE = msgspec.structs.replace(
    OPTIMAL.with_limits(box=None, guide=(0.0, OPTIMAL.reach)), home=OPTIMAL.home_pose
)
TWINS = [six_four_twin(OPTIMAL, a2x) for a2x in (10.0, OPTIMAL.reach)]
"""The twin at two positions of a2, in design units."""

BASES, RATIOS, SPREADS = (0.25, 0.4, 0.55), (0.3, 0.6, 0.9), (0.0, 15.0)
"""The tables of the family: radii of the base's circle over the reach, radii of the platform's
over the base's, and half the angle of each pair of neighbouring joints, in degrees; 0 is the
octahedral table."""

LEGEND = (
    "",
    "Tables: radius of the base over the reach, of the platform over that of the base, and",
    "half the angle of a pair of joints.",
)
POSITIONS, ORIENTATIONS, AZIMUTHS, TILT_STEPS = 100, 1000, 24, 90
# Standard errors up to which a difference counts as none.
SIGMAS = 3.0
MODE = mode_of(margins(OPTIMAL.home_pose.position, OPTIMAL.home_pose.rotation))
"""The assembly mode of home."""

# Relative difference up to which two volumes count as alike.
ALIKE = 0.01


class _Mechanism(NamedTuple):
    """A mechanism: its workspace at home's orientation, and which poses it can have."""

    name: str
    rotation: FloatArray
    region: Region
    holds: Holds


@dataclass(frozen=True)
class RelativeVolume:
    """The exact volume over the cubed reach at the orientation of home."""

    name: str
    volume: float


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


def two_circles(base: float, ratio: float, spread: float) -> SixLegged:
    """Return a table of the family, whose legs are as long as the reach at most."""
    corners = np.radians(np.repeat([0.0, 120.0, 240.0], 2) + np.tile([-spread, spread], 3))
    tips = np.radians(np.repeat([60.0, 180.0, 300.0], 2) + np.tile([-spread, spread], 3))
    # The second of a pair and the first of the next one lead to one pair of the platform.
    tips = np.roll(tips, 1)
    circles = [np.stack([np.cos(t), np.sin(t), 0.0 * t], axis=1) for t in (corners, tips)]
    reach = OPTIMAL.reach
    return table_of(
        name=f"table {base:g} {ratio:g} {spread:g}°",
        base_mm=base * reach * circles[0],
        platform_mm=base * ratio * reach * circles[1],
        shortest_mm=(0.0,) * 6,
        longest_mm=(reach,) * 6,
        home=TableHome((0.0, 0.0, 0.5 * reach)),
    )


def measure_workspaces() -> Measurement:
    """Compare the volume of the 4-4's workspace with those of tables on six legs."""
    regions = ("4-4", Workspace(FREE).region), *((each.name, each.region) for each in _mechanisms())
    ours, *others = (
        RelativeVolume(name, region_volume(region)[0] / OPTIMAL.reach**3)
        for name, region in regions
    )
    twins, family = others[: len(TWINS)], others[len(TWINS) :]
    volumes = [each.volume for each in family]

    def smaller(among: Sequence[RelativeVolume]) -> int:
        return sum(each.volume < (1.0 - ALIKE) * ours.volume for each in among)

    larger = sum(volume > (1.0 + ALIKE) * ours.volume for volume in volumes)

    words = {
        "ours": ours,
        "twins": ", ".join(f"{each.volume:.3f} ({each.name})" for each in twins),
        "smaller": smaller(family),
        "larger": larger,
        "family": len(family),
        "range": (min(volumes), max(volumes)),
    }
    lines = [f"{'':18}{'volume/reach³':>14}"]
    lines += [f"{each.name:18}{each.volume:14.3f}" for each in (ours, *others)]
    lines += LEGEND
    values = {"mechanisms": [asdict(each) for each in (ours, *others)]}
    is_smallest = smaller(twins) == len(twins)
    condition = "beside the 6-4 only, and not beside every table on six legs"
    is_largest = smaller(others) == len(others)
    return judge(is_largest, words, values, lines, condition if is_smallest else "")


def measure_orientations() -> Measurement:
    """Compare the orientations of the 4-4 with those of tables on six legs.

    Those with carriages in any order are reported only.
    """
    own = Workspace(FREE).rotation, Workspace(FREE).region
    both = (("4-4", four_four), ("4-4, any order", in_any_order))
    mechanisms = (_Mechanism(name, *own, holds) for name, holds in both)
    ours, crossed, *others = map(_abilities, (*mechanisms, *_mechanisms()))
    twins, family = others[: len(TWINS)], others[len(TWINS) :]
    lines = [f"{'':18}{'mean share':>12}{'error':>8}{'mean tilt':>11}{'error':>8}"]
    lines += [
        f"{a.name:18}{a.share:12.1%}{a.share_error:8.1%}{a.tilt:10.1f}°{a.tilt_error:7.1f}°"
        for a in (ours, crossed, *others)
    ]
    lines += LEGEND
    less = [
        SIGMAS * np.hypot(ours.share_error, a.share_error) < ours.share - a.share for a in others
    ]
    lower = [SIGMAS * np.hypot(ours.tilt_error, a.tilt_error) < ours.tilt - a.tilt for a in others]
    shares, tilts = [a.share for a in family], [a.tilt for a in family]
    words = {
        "ours": ours,
        "crossed": crossed,
        "shares": ", ".join(f"{a.share:.1%} ({a.name})" for a in twins),
        "tilts": ", ".join(f"{a.tilt:.0f}° ({a.name})" for a in twins),
        "family": len(family),
        "less": sum(less[len(twins) :]),
        "lower": sum(lower[len(twins) :]),
        "range": (min(shares), max(shares)),
        "tilt_range": (min(tilts), max(tilts)),
    }
    values = {"mechanisms": [asdict(each) for each in (ours, crossed, *others)]}
    condition = "by the greatest tilt" if all(lower) else ""
    condition = "by the share of all orientations" if all(less) else condition
    return judge(all(less) and all(lower), words, values, lines, condition)


def _mechanisms() -> Iterator[_Mechanism]:
    """Yield the twins in the mode of the 4-4, and the family, each above the plane of its base."""
    signs = [limit for limit in Workspace(FREE).limits if "δ" in limit.name]
    above = HalfSpace("above the base", np.array([0.0, 0.0, -1.0]), 0.0)
    family = itertools.starmap(two_circles, itertools.product(BASES, RATIOS, SPREADS))
    for tables, limits, holds in ((TWINS, signs, _holds_mode), (family, [above], _holds_sign)):
        for case in map(TableCase, tables):
            region = region_of((*case.limits, *limits))
            yield _Mechanism(case.table.name, case.at_rotation, region, partial(holds, case))


def _holds_mode(case: TableCase, position: FloatArray, rotation: FloatArray) -> BoolArray:
    return case.holds(position, rotation) & _keeps_mode(position, rotation)


def _holds_sign(case: TableCase, position: FloatArray, rotation: FloatArray) -> BoolArray:
    """Return whether poses are within limits and det J has the sign that it has at home."""
    poses, home = TablePoses(case.table, position, rotation), case.home_indices
    determinants = np.linalg.det(poses.jacobian) * np.linalg.det(home.jacobian)
    return case.holds(position, rotation) & (determinants > 0.0)


def _keeps_mode(position: FloatArray, rotation: FloatArray) -> BoolArray:
    return np.asarray(mode_of(margins(position, rotation)) == MODE)


def four_four(position: FloatArray, rotation: FloatArray) -> BoolArray:
    """Return whether poses keep the strokes, the mode and the order of the carriages of home."""
    return poses_are_valid(FREE, position, rotation)


def in_any_order(position: FloatArray, rotation: FloatArray) -> BoolArray:
    """Return whether poses keep the strokes and the mode of home."""
    joints = inverse(OPTIMAL, position, rotation)
    within = (joints >= 0.0) & (joints <= OPTIMAL.reach)
    return within.all(axis=-1) & _keeps_mode(position, rotation)


def _abilities(mechanism: _Mechanism) -> Abilities:
    """Return the orientations of a mechanism at nodes spread over its workspace."""
    name, rotation, region, holds = mechanism
    nodes = nodes_of(region)
    chosen = nodes[np.linspace(0, len(nodes) - 1, POSITIONS).astype(np.int64)]
    turns = np.asarray(Rotation.random(ORIENTATIONS, rng=np.random.default_rng(10)).as_matrix())
    shares = np.array([holds(p, turns).mean() for p in chosen])
    # In parts, which bounds the memory.
    parts = np.array_split(chosen, 10)
    tilts = [greatest_tilts(holds, part, rotation, AZIMUTHS, TILT_STEPS) for part in parts]
    root = len(chosen) ** 0.5
    both = [
        (float(each.mean()), float(each.std(ddof=1)) / root)
        for each in (shares, np.concatenate(tilts))
    ]
    return Abilities(name, *both[0], *both[1])
