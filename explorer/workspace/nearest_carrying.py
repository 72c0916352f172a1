"""The nearest position that carries a load, at one orientation, no singular plane in between.

Positions all over the workspace of the pose's mode are tried first. From the nearest ones that hold
the load, descents of the distance follow, along the limits of the machine and of the design. Finer
grids between the pose and what is found, and descents of the largest share there, find nearer
regions; one that is small beside the cells of all these grids may be missed.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from explorer.mechanism.configuration import Configuration
from explorer.mechanism.margins import margins
from explorer.mechanism.pose import Pose
from explorer.numerics.arrays import FloatArray, IntArray, triple
from explorer.statics.loaded import LoadedPose
from explorer.statics.reactions import limit_shares, reactions
from explorer.workspace.accessible.nodes import descend_towards, make_grid
from explorer.workspace.carried_region import best_positions, positions_within
from explorer.workspace.solids.solids import whole_solid
from explorer.workspace.workspace import Workspace

NODES = 25
"""Number of nodes of each grid on each axis."""
# Number of positions from which descents begin, and of grids between the pose and what is found.
BEGINNINGS, ROUNDS = 6, 4
# Share of a limit that is kept free, the largest share that a descent sees, and the share of its
# distance by which a position must be nearer.
KEPT, FAR, NEARER = 1e-6, 100.0, 1e-6


def nearest_carrying_pose(loaded: LoadedPose) -> Pose | None:
    """Return the nearest pose of the same orientation that holds the load; None if none is found.

    It keeps all limits and clearances of the design and has the signs of the margins of the given
    pose, so that no singular plane lies between; the straight way there need not hold the load.
    """
    design, pose = loaded.design, loaded.pose
    own = np.sign(margins(pose.position, pose.rotation)).astype(np.int64).tolist()
    # A margin of zero takes the sign of home.
    x, y, z = (sign or home for sign, home in zip(own, design.home_signs, strict=True))
    workspace = Workspace(design, pose.rotation, signs=(x, y, z))
    whole = whole_solid(workspace)
    if whole.is_empty:
        return None
    search, ends = _Search(loaded, workspace), whole.ends
    grid = make_grid(*ends, NODES, 0)
    tried = np.vstack([search.here, positions_within(whole, grid, workspace.is_valid)])
    found = search.nearest(tried, grid.step)
    if found is None:
        return None
    for _ in range(ROUNDS):
        distance = float(search.distance(found))
        if distance == 0.0:
            break
        lows = np.maximum(ends[0], search.here - distance)
        highs = np.minimum(ends[1], search.here + distance)
        grid = make_grid(lows, highs, NODES, 0)
        tried = grid.positions.reshape(-1, 3)
        tried = tried[search.distance(tried) < (1.0 - NEARER) * distance]
        nearer = search.nearest(tried[workspace.is_valid(tried)], grid.step)
        if nearer is None or search.distance(nearer) >= (1.0 - NEARER) * distance:
            break
        found = nearer
    return Pose(triple(found), pose.quaternion)


@dataclass(frozen=True)
class _Search:
    """A search for positions that hold the load of a pose, in the workspace of its mode."""

    loaded: LoadedPose
    workspace: Workspace

    @property
    def here(self) -> FloatArray:
        """Position of the pose, shape (3,)."""
        return np.array(self.loaded.pose.position)

    def distance(self, positions: FloatArray) -> FloatArray:
        """Return the distances of positions (..., 3) from the pose, shape (...)."""
        return np.asarray(np.linalg.norm(positions - self.here, axis=-1))

    def largest(self, positions: FloatArray) -> tuple[FloatArray, IntArray]:
        """Return the largest shares of a limit at positions (n, 3), and the parts, (n,) each."""
        shares = self._shares(positions)
        return shares.max(axis=-1), shares.argmax(axis=-1)

    def nearest(self, tried: FloatArray, step: FloatArray) -> FloatArray | None:
        """Return the nearest position that is found from allowed ones on a grid, shape (3,)."""
        if not len(tried):
            return None
        holds = self.largest(tried)[0] <= 1.0
        starts, others = tried[holds], tried[~holds]
        if len(others):
            better = best_positions(others, step, self.largest, self.workspace.is_valid, 1.0 - KEPT)
            starts = np.vstack([starts, *(best.position for best in better if best.share <= 1.0)])
        if not len(starts):
            return None
        starts = starts[self.distance(starts).argsort()[:BEGINNINGS]]
        # Clearances are no constraints of the descent, so that it may end where legs collide.
        ends = np.vstack([starts, *map(self._descend, starts)])
        ends = ends[self.workspace.is_valid(ends)]
        ends = ends[self.largest(ends)[0] <= 1.0]
        return ends[self.distance(ends).argmin()] if len(ends) else None

    def _descend(self, start: FloatArray) -> FloatArray:
        """Return where a descent of the distance leads along the limits, shape (3,)."""
        reach = self.loaded.design.reach

        def spare(at: FloatArray) -> FloatArray:
            # Near a singular plane shares are infinite, and the descent turns back.
            shares = np.minimum(self._shares(reach * at), FAR)
            return np.concatenate([1.0 - KEPT - shares, self.workspace.slacks(reach * at) / reach])

        return descend_towards(self.here, spare, start, reach)

    def _shares(self, positions: FloatArray) -> FloatArray:
        """Return the shares of the limits at positions (..., 3), shape (..., 12)."""
        loaded = self.loaded
        at = Configuration(loaded.design, positions, loaded.pose.rotation, loaded.tool)
        return limit_shares(loaded.design, reactions(at, loaded.load, loaded.weights))
