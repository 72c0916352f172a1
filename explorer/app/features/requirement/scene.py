"""The required box in the scene."""

from __future__ import annotations

import numpy as np

from explorer.app.features.feature import Services
from explorer.app.features.requirement.state import Required
from explorer.app.scene.placing import NO_POINTS, Placed, ScenePart
from explorer.app.scene.shapes import GHOST, add_lines
from explorer.find.requirement import Requirement
from explorer.measures.box import corners_of
from explorer.mechanism.configuration import tool_position
from explorer.mechanism.design import Design
from explorer.mechanism.pose import rotation_from_yaw_pitch_roll
from explorer.numerics.arrays import FloatArray
from explorer.page.widgets.assigning import Updates

# The twelve edges of a cube by its corners, whose bits are the axes.
EDGES = np.array([(a, a | 1 << axis) for a in range(8) for axis in range(3) if not a >> axis & 1])


class RequiredBox(ScenePart):
    """The edges of the required box, if there is one."""

    def __init__(self, services: Services) -> None:
        self._edges = add_lines(services.scene, "/required_box", len(EDGES), GHOST, 2.0)

    def updates(self, placed: Placed) -> Updates:
        """Yield the updates that draw the box of a frame."""
        corners = self.corners(placed)
        yield self._edges, "visible", len(corners) > 0
        if len(corners):
            yield self._edges, "points", corners[EDGES].astype(np.float32)

    def corners(self, placed: Placed) -> FloatArray:
        """Return the corners of the box, shape (8, 3) or (0, 3)."""
        state = placed.frame.state
        corners = box_corners(state.design, Required.of(state).requirement)
        return NO_POINTS if corners is None else placed.scale * corners


def box_corners(design: Design, requirement: Requirement | None = None) -> FloatArray | None:
    """Return the corners (8, 3) of the box of a requirement, else of the design; None for none."""
    if requirement is not None:
        # A requirement has the tool at home in the middle of its box.
        middle = np.array(tool_position(design.home_pose, design.tool.position))
        half = 0.5 * np.array(requirement.box_mm) / design.unit_mm
        box = np.array([middle - half, middle + half])
    elif design.required_box is not None:
        box = np.array(design.required_box)
        middle = box.mean(axis=0)
    else:
        return None
    rotation = rotation_from_yaw_pitch_roll(np.array([design.required_yaw, 0.0, 0.0]))
    return middle + (corners_of(box) - middle) @ rotation.T
