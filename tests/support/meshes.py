"""Checks of meshes: topology, and distances from limit surfaces."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from explorer import Design
from explorer.numerics.arrays import FloatArray
from explorer.workspace.limits.constraints import Cone, HalfSpace, Never
from explorer.workspace.solids.solid import Solid
from explorer.workspace.workspace import Workspace


def corners_of(solid: Solid) -> tuple[FloatArray, FloatArray, FloatArray]:
    a, b, c = (solid.vertices[solid.faces[:, k]] for k in range(3))
    return a, b, c


def euler_characteristic(solid: Solid) -> int:
    """Return V - E + F: 2 for each ball, 0 for a ring."""
    return len(np.unique(solid.faces)) - len(solid.faces) // 2


def edges_are_paired(faces: NDArray[np.int32]) -> bool:
    """Return whether each edge is used once in each direction."""
    seen: dict[tuple[int, int], int] = {}
    for a, b, c in faces.tolist():
        for edge in ((a, b), (b, c), (c, a)):
            seen[edge] = seen.get(edge, 0) + 1
    return all(count == 1 and seen.get((b, a)) == 1 for (a, b), count in seen.items())


def assert_lies_on_its_limits(solid: Solid, design: Design, rotation: FloatArray) -> None:
    """Check that faces lie on the limits that they name, and that vertices satisfy all limits."""
    limits = Workspace(design, rotation).limits
    most = solid.tolerance * (1.0 + 1e-6)
    for index, name in enumerate(solid.limits):
        faces = solid.faces[solid.limit_of_face == index]
        if len(faces):
            middles = solid.vertices[faces].mean(axis=1)
            corners = solid.vertices[faces]
            named = [limit for limit in limits if limit.name == name]
            off = [np.maximum(x.distance(corners).max(axis=1), x.distance(middles)) for x in named]
            assert np.min(off, axis=0).max() <= most, name
    for limit in limits:
        assert not isinstance(limit, Never)
        slack = limit.slack(solid.vertices)
        if isinstance(limit, HalfSpace):
            slack = slack / float(np.linalg.norm(limit.normal))
        if isinstance(limit, Cone):
            slack = np.sign(slack) * limit.distance(solid.vertices)
        assert float(slack.min()) >= -most, limit.name
