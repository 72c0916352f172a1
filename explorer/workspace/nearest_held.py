"""The nearest position at which a load is held, at one orientation and without a singular plane.

Nodes of a grid over all positions that the limits allow are tried first. From the nearest ones that
hold the load, descents of the distance follow, along the limits of the machine and of the design. A
region of such positions that contains no node of the grid may be missed.
"""

from __future__ import annotations

import numpy as np

from explorer.mechanism.design import Design
from explorer.mechanism.margins import margins
from explorer.mechanism.pose import Pose
from explorer.numerics.arrays import BoolArray, FloatArray
from explorer.numerics.descent import descend
from explorer.statics.loaded import LoadedPose
from explorer.statics.reactions import limit_shares, reactions
from explorer.workspace.limits.constraints import constraints, home_signs, slacks
from explorer.workspace.limits.valid_poses import Rules, poses_are_valid

NODES = 25
"""Number of nodes of the grid on each axis."""
# Number of nodes from which descents begin.
BEGINNINGS = 6
# Share of a limit that is kept free, and the largest share that a descent sees.
KEPT, FAR = 1e-6, 100.0


def nearest_held(loaded: LoadedPose) -> Pose | None:
    """Return the nearest pose of the same orientation that holds the load; None if none is found.

    It keeps all limits and clearances of the design and has the signs of the margins of the given
    pose, so that no singular plane lies between; the straight way there need not hold the load.

    Args:
        loaded: A pose under a load and weights.
    """
    design, here = loaded.design, np.array(loaded.pose.position)
    lows, highs = _bounds(design, loaded.pose.rotation)
    if (lows > highs).any():
        return None
    steps = np.linspace(0.0, 1.0, NODES)
    axes = [low + steps * (high - low) for low, high in zip(lows, highs, strict=True)]
    nodes = np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1).reshape(-1, 3)
    nodes = np.vstack([here[None], nodes])
    found = nodes[_holds(loaded, nodes)]
    if not len(found):
        return None
    near = np.linalg.norm(found - here, axis=1).argsort()[:BEGINNINGS]
    settled = [_settled(loaded, start) for start in found[near]]
    # Clearances are no constraints of the descent, so that it may end where legs collide.
    tried = np.vstack([found[near], *settled])
    held = tried[_holds(loaded, tried)]
    x, y, z = held[np.linalg.norm(held - here, axis=1).argmin()].tolist()
    return Pose((x, y, z), loaded.pose.quaternion)


def _settled(loaded: LoadedPose, start: FloatArray) -> FloatArray:
    """Return the position to which a descent of the distance leads along the limits, shape (3,)."""
    reach, here = loaded.design.reach, np.array(loaded.pose.position)
    limits = constraints(loaded.design, loaded.pose.rotation)

    def distance(at: FloatArray) -> tuple[float, FloatArray]:
        apart = at - here / reach
        return float(apart @ apart), 2.0 * apart

    def spare(at: FloatArray) -> FloatArray:
        # Near a singular plane shares are infinite, and the descent turns back.
        shares = np.minimum(_shares(loaded, reach * at), FAR)
        return np.concatenate([1.0 - KEPT - shares, slacks(limits, reach * at) / reach])

    found = descend(distance, spare, start / reach)
    return start if found is None else reach * found


def _holds(loaded: LoadedPose, positions: FloatArray) -> BoolArray:
    """Return at which positions (n, 3) the load is held within all limits and signs, shape (n,)."""
    design, pose = loaded.design, loaded.pose
    here = np.sign(margins(pose.position, pose.rotation)).tolist()
    # A margin of zero has no sign of its own.
    first, second, third = (
        int(own) or home for own, home in zip(here, home_signs(design), strict=True)
    )
    rules = Rules.of(design, (first, second, third))
    valid = poses_are_valid(design, positions, pose.rotation, rules=rules)
    valid[valid] = (_shares(loaded, positions[valid]) <= 1.0).all(axis=-1)
    return valid


def _shares(loaded: LoadedPose, positions: FloatArray) -> FloatArray:
    """Return the shares of the limits at positions (..., 3), shape (..., 12)."""
    design, rotation = loaded.design, loaded.pose.rotation
    held = reactions(design, positions, rotation, loaded.load, loaded.tool, loaded.weights)
    return limit_shares(design, held)


def _bounds(design: Design, rotation: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Return lows and highs of the positions that the lengths of legs 1 and 4 and the box allow."""
    b1, a3 = rotation @ np.array([*design.b1, 0.0]), np.array([*design.a3, 0.0])
    l1, l4 = (design.length_range(name)[1] for name in ("l1", "l4"))
    lows, highs = np.maximum(a3 - l4, -b1 - l1), np.minimum(a3 + l4, l1 - b1)
    if design.limits.box is not None:
        lows = np.maximum(lows, design.limits.box[0])
        highs = np.minimum(highs, design.limits.box[1])
    return lows, highs
