"""The volume of a box cut by planes: an upper bound of the workspace within it."""

from __future__ import annotations

import itertools
from collections.abc import Iterable

import numpy as np

from explorer.numerics.arrays import FloatArray
from explorer.optimise.demands import Box

# Tolerance of corners that lie on a plane, as a share of the edges of the box.
SLACK = 1e-9
# Three planes have no corner if the determinant of their normals is less than this.
FLAT = 1e-12


def cut_volume(box: Box, planes: Iterable[tuple[FloatArray, float]]) -> float:
    """Return the volume of a box where normal · p >= least for each plane.

    The corners of such a body are the points that three of its faces share; its volume is that
    of their convex hull.

    Args:
        box: (lows, highs); they may be equal.
        planes: The normal of each, shape (3,) and not zero, and the least.
    """
    from scipy.spatial import ConvexHull, QhullError

    lows, highs = np.array(box)
    edges = highs - lows
    if not (edges > 0.0).all():
        return 0.0
    normals = [*np.eye(3), *-np.eye(3)]
    offsets = [0.0, 0.0, 0.0, -1.0, -1.0, -1.0]
    for normal, least in planes:
        # In coordinates that run from 0 to 1 along each edge.
        scaled = normal * edges
        length = float(np.linalg.norm(scaled))
        normals.append(scaled / length)
        offsets.append((least - float(normal @ lows)) / length)
    a, b = np.array(normals), np.array(offsets)
    triples = np.array(list(itertools.combinations(range(len(a)), 3)))
    triples = triples[np.abs(np.linalg.det(a[triples])) > FLAT]
    corners = np.linalg.solve(a[triples], b[triples][..., None])[..., 0]
    corners = corners[(corners @ a.T >= b - SLACK).all(axis=1)]
    if len(corners) < 4:
        return 0.0
    try:
        share = float(ConvexHull(corners).volume)
    except QhullError:
        # All corners lie in one plane.
        return 0.0
    return share * float(edges.prod())
