"""Loads, errors and compliance over the required box, at the nodes of a grid, or at one position.

The load is the payload's weight and its force of any direction; the legs count as weightless.
Forces are not linear in the position, so corners alone do not bound them; the grid has the corners
among its nodes. Where a box is on or across a singular plane, all of them are infinite.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from explorer.measures.size import box_margins, box_nodes
from explorer.mechanism.configuration import Configuration
from explorer.mechanism.design import Design
from explorer.mechanism.pose import Triple
from explorer.numerics.arrays import FloatArray
from explorer.statics.accuracy import ToolError, actuator_errors, worst_errors
from explorer.statics.compliance import (
    compliance_of,
    largest_deflection,
    principal_compliances,
    stiffness_of,
)
from explorer.statics.reactions import (
    Reactions,
    limit_shares,
    reactions,
)
from explorer.statics.slopes import (
    PARAMETERS,
    TwistSlopes,
    share_slopes,
    twist_slopes,
)
from explorer.statics.weights import design_weights, payload_wrench


@dataclass(frozen=True)
class BoxStatics:
    """A design under its payload over a box, at one orientation.

    A box whose lows are its highs is one position.

    Attributes:
        design: The manipulator.
        box: Lows and highs of the positions, in design units.
        rotation: Platform to base, shape (3, 3).
    """

    design: Design
    box: tuple[Triple, Triple]
    rotation: FloatArray

    @cached_property
    def is_regular(self) -> bool:
        """Whether no margin changes its sign or vanishes within the box."""
        return bool(box_margins(self.box, self.rotation).all())

    @cached_property
    def positions(self) -> FloatArray:
        """Nodes of the grid, shape (n, 3)."""
        return box_nodes(self.box)

    @cached_property
    def configuration(self) -> Configuration:
        """The design at the nodes of the grid, with its tool point."""
        return Configuration(self.design, self.positions, self.rotation, self.design.tool.position)

    @cached_property
    def held(self) -> Reactions:
        """The reactions to the weight of the payload."""
        return reactions(self.configuration, np.zeros(6), design_weights(self.design))

    @cached_property
    def errors(self) -> ToolError:
        """The worst errors of the tool at the nodes, each of shape (n,)."""
        return worst_errors(self.configuration, actuator_errors(self.design))

    @cached_property
    def compliances(self) -> FloatArray:
        """The compliance at the nodes, shape (n, 6, 6)."""
        return compliance_of(self.configuration, *stiffness_of(self.design))

    @cached_property
    def softest(self) -> FloatArray:
        """The largest displacement of the tool per force at the nodes, (n,), in units/N."""
        return principal_compliances(self.compliances).displacement[:, 0]

    @cached_property
    def deflections(self) -> FloatArray:
        """The largest displacement under the load at the nodes, shape (n,), in design units."""
        weight = payload_wrench(self.design, self.rotation)
        return largest_deflection(self.compliances, weight, self.design.payload.force_n)[0]

    @cached_property
    def node_shares(self) -> FloatArray:
        """The shares of the limits at the nodes, shape (n, 12), as in `LIMITED`."""
        return limit_shares(self.design, self.held)

    @property
    def shares(self) -> FloatArray:
        """The largest shares of the limits over the nodes, shape (12,), as in `LIMITED`."""
        return self.node_shares.max(axis=0)

    def worst(self, values: FloatArray) -> float:
        """Return the largest of values at the nodes; infinite if the box has singular positions."""
        return float(values.max()) if self.is_regular else np.inf

    @property
    def largest_share(self) -> float:
        """The largest share of any limit."""
        return self.worst(self.node_shares)

    @property
    def largest_bending(self) -> float:
        """The largest bending moment of a strut, in N m."""
        bending = self.held.bending + self.held.spread[:, 6:8]
        return 1e-3 * self.design.unit_mm * self.worst(bending)

    @property
    def worst_error(self) -> float:
        """The worst displacement of the tool by the actuators' errors, in design units."""
        return self.worst(self.errors.displacement)

    @property
    def largest_deflection(self) -> float:
        """The largest displacement of the tool under the load, in design units."""
        return self.worst(self.deflections)

    def slopes_at(
        self,
        values: FloatArray,
        slopes_of: Callable[[TwistSlopes], tuple[FloatArray, FloatArray]],
        factor: float = 1.0,
    ) -> Mapping[str, float]:
        """Return derivatives at the node with the largest value; {} if it is infinite.

        They are those by the design variables, and by the yaw in radians, times a factor.
        """
        if not self.is_regular:
            return {}
        slopes = twist_slopes(self.design, self.positions[[values.argmax()]], self.rotation)
        return _by_name(factor * slopes_of(slopes)[1][0])

    def share_slopes(self, limits: FloatArray) -> Mapping[str, float]:
        """Return those of the largest share of limits of the parts, shape (2, 10)."""
        if not self.is_regular:
            return {}
        slopes = twist_slopes(self.design, self.positions, self.rotation)
        parts = np.divmod(np.arange(10 * len(self.positions)), 10)
        shares, by = share_slopes(self.design, self.rotation, slopes, parts, limits)
        return _by_name(by[shares.argmax()])


def _by_name(slopes: FloatArray) -> Mapping[str, float]:
    """Return derivatives by `PARAMETERS`, shape (10,), by name, without those by position."""
    named = dict(zip(PARAMETERS, slopes.tolist(), strict=True))
    return {name: value for name, value in named.items() if name not in "xyz"}
