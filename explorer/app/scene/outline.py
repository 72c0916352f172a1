"""The outline of a mechanism: the fewest lines that show it."""

from __future__ import annotations

import numpy as np

from explorer.measures.snapshot import Snapshot
from explorer.numerics.arrays import FloatArray


def outline(snapshot: Snapshot) -> FloatArray:
    """Return lines along base, legs and platform, in design units, shape (n, 2, 3)."""
    points = snapshot.points
    d1, d3 = float(snapshot.joints[1]), float(snapshot.joints[3])
    first, second = np.array([d1, 0.0, 0.0]), np.array([d3, 0.0, 0.0])
    # The part of the guide between a1 and the carriages.
    low, high = np.array([[min(0.0, d1, d3), 0.0, 0.0], [max(0.0, d1, d3), 0.0, 0.0]])
    base = ((low, high), (points.a1, points.a3), (high, points.a3))
    legs = (
        (points.a1, points.b1),
        (first, points.b2),
        (second, points.b3),
        (points.a3, points.b4),
    )
    corners = (points.b1, points.b2, points.b3, points.b4)
    platform = tuple((a, b) for index, a in enumerate(corners) for b in corners[index + 1 :])
    return np.array([*base, *legs, *platform])
