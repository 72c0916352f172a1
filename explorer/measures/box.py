"""The positions of a required box, and the loads, errors and compliance of a design over it.

The load is the payload's weight and its force of any direction; the legs count as weightless.
Forces are not linear in the position, so corners alone do not bound them: they are computed at the
nodes of a grid that has the corners among its nodes. Where a box is on or across a singular plane,
all of them are infinite.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from functools import cached_property
from typing import Literal

import numpy as np
from numpy.typing import ArrayLike

from explorer.errors import InputError, NoAnswerError
from explorer.mechanism.configuration import Configuration
from explorer.mechanism.design import Design
from explorer.mechanism.margins import SINGULAR, margins
from explorer.mechanism.pose import Pose, Triple
from explorer.motion.weights import payload_wrench
from explorer.numerics.arrays import FloatArray, lengths_of
from explorer.statics import compliance, slopes
from explorer.statics.accuracy import ToolError, actuator_errors, worst_errors
from explorer.statics.reactions import largest_accelerations, limit_shares, payload_reactions
from explorer.workspace.least_clearance import node_measures
from explorer.workspace.workspace import Workspace

BOX_NODES = 9
"""Number of nodes on each axis of the grid over a required box, its faces included."""

PositionSet = Literal["pose", "box", "workspace"]
"""The position of a pose, the nodes of a box, or nodes of the workspace."""


def corners_of(box: tuple[Triple, Triple] | FloatArray) -> FloatArray:
    """Return the corners of a box (lows, highs), shape (8, 3)."""
    lows, highs = box
    return np.array([[(lows, highs)[c >> a & 1][a] for a in range(3)] for c in range(8)])


def box_nodes(box: tuple[Triple, Triple]) -> FloatArray:
    """Return the nodes of a grid over a box (lows, highs), its corners included, shape (n, 3).

    An axis has `BOX_NODES` of them, or one if its low is its high.
    """
    axes = [
        np.linspace(low, high, BOX_NODES if high > low else 1)
        for low, high in zip(*box, strict=True)
    ]
    return np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1).reshape(-1, 3)


def positions_over(
    design: Design, over: PositionSet, pose: Pose, box: tuple[Triple, Triple] | None
) -> FloatArray:
    """Return positions of b4 in the base frame, shape (n, 3), in design units.

    Those of the workspace are the centres of 20 × 20 × 20 cells about it that lie within the
    limits.

    Args:
        design: The manipulator.
        over: Kind of the set.
        pose: Pose with the one position, and with the orientation of the workspace.
        box: Lows and highs of the box; None for none.

    Raises:
        InputError: Positions over a box are meant, and there is none.
        NoAnswerError: No node is within the limits.
    """
    if over == "pose":
        return np.array([pose.position])
    if over == "box":
        if box is None:
            raise InputError("positions over a box need a box, and the design has none")
        return box_nodes(box)
    nodes = node_measures(Workspace(design, pose.rotation)).positions
    if not len(nodes):
        raise NoAnswerError("no position of a grid of 20 × 20 × 20 nodes is within the limits")
    return nodes


def box_margins(box: tuple[Triple, Triple], rotation: FloatArray) -> FloatArray:
    """Return the least |δ1|, |δ2| and |δ3| over a box, shape (3,), in design units.

    Margins are linear in the position, so that the corners decide: of one sign, they have the
    least value; of both, there is a zero between them. What is zero but for rounding is 0.
    """
    corners = corners_of(box)
    at = margins(corners, rotation)
    least = np.maximum(at.min(axis=0), -at.max(axis=0))
    return np.where(least > SINGULAR * lengths_of(corners).max(), least, 0.0)


class BoxStatics(Configuration):
    """A design under its payload at nodes of a box, at one orientation, with its tool point.

    A box whose lows are its highs is one position.

    Args:
        design: The manipulator.
        box: Lows and highs of the positions, in design units.
        rotation: Platform to base, shape (3, 3).
        places: Further positions to evaluate, as shares of the box's edges, shape (k, 3).
    """

    def __init__(
        self,
        design: Design,
        box: tuple[Triple, Triple],
        rotation: FloatArray,
        places: ArrayLike = (),
    ) -> None:
        self.box, (lows, highs) = box, np.array(box)
        further = lows + (highs - lows) * np.reshape(places, (-1, 3))
        nodes = np.vstack([box_nodes(box), further])
        super().__init__(design, nodes, rotation, design.tool.position)

    @cached_property
    def is_regular(self) -> bool:
        """Whether no margin changes its sign or vanishes within the box."""
        return bool(box_margins(self.box, self.rotation).all())

    @cached_property
    def errors(self) -> ToolError:
        """The worst errors of the tool at the nodes, each of shape (n,)."""
        return worst_errors(self, actuator_errors(self.design))

    @cached_property
    def compliances(self) -> FloatArray:
        """The compliance at the nodes, shape (n, 6, 6)."""
        return compliance.compliance_of(self, *compliance.stiffness_of(self.design))

    @cached_property
    def softest(self) -> FloatArray:
        """The largest displacement of the tool per force at the nodes, (n,), in units/N."""
        return compliance.principal_compliances(self.compliances).displacement[:, 0]

    @cached_property
    def deflections(self) -> FloatArray:
        """The largest displacement under the load at the nodes, shape (n,), in design units."""
        weight, force = payload_wrench(self.design, self.rotation), self.design.payload.force_n
        return compliance.largest_deflection(self.compliances, weight, force)[0]

    @cached_property
    def node_utilisations(self) -> FloatArray:
        """The utilisations of the limits at the nodes, shape (n, 12), as in `LIMITED`."""
        return limit_shares(self.design, payload_reactions(self))

    @property
    def utilisations(self) -> FloatArray:
        """The largest utilisations of the limits over the nodes, shape (12,), as in `LIMITED`."""
        return self.node_utilisations.max(axis=0)

    @property
    def bending(self) -> FloatArray:
        """The bending moments of the struts at the nodes, shape (n, 2), in N × unit."""
        held = payload_reactions(self)
        return held.bending + held.spread[:, slopes.BENDING]

    @cached_property
    def accelerations(self) -> FloatArray:
        """The largest accelerations by each part at the nodes, shape (n, 10), in m/s²."""
        return largest_accelerations(self)

    def worst(self, values: FloatArray) -> float:
        """Return the largest of values at the nodes; infinite if the box has singular positions."""
        return float(values.max()) if self.is_regular else np.inf

    def slopes_at_worst(
        self,
        values: FloatArray,
        slopes_of: Callable[[slopes.TwistSlopes], tuple[FloatArray, FloatArray]],
        factor: float = 1.0,
    ) -> Mapping[str, float]:
        """Return derivatives at the node with the largest value; {} if it is infinite.

        They are those by the design variables, and by the yaw in radians, times a factor.
        """
        if not self.is_regular:
            return {}
        worst = self.positions[[values.argmax()]]
        twists = slopes.twist_slopes(self.design, worst, self.rotation)
        return _by_name(factor * slopes_of(twists)[1][0])

    def utilisation_slopes(self, limits: FloatArray) -> Mapping[str, float]:
        """Return those of the largest utilisation of limits of the parts, shape (2, 10)."""
        if not self.is_regular:
            return {}
        twists = slopes.twist_slopes(self.design, self.positions, self.rotation)
        parts = np.divmod(np.arange(10 * len(self.positions)), 10)
        largest, by = slopes.utilisation_slopes(self.design, self.rotation, twists, parts, limits)
        return _by_name(by[largest.argmax()])

    def acceleration_slopes(self) -> Mapping[str, float]:
        """Return those of the least of the largest accelerations, as `slopes_at_worst` does."""
        if not self.is_regular:
            return {}
        node, part = np.divmod([self.accelerations.argmin()], 10)
        worst, parts = self.positions[node], (np.zeros_like(part), part)
        return _by_name(slopes.acceleration_slopes(self.design, worst, self.rotation, parts)[1][0])


def _by_name(derivatives: FloatArray) -> Mapping[str, float]:
    """Return derivatives by `PARAMETERS`, shape (10,), by name, without those by position."""
    named = dict(zip(slopes.PARAMETERS, derivatives.tolist(), strict=True))
    return {name: value for name, value in named.items() if name not in "xyz"}
