"""A design in one pose under a load and weights: forces, utilisations, and precision."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import NamedTuple

import msgspec
import numpy as np

from explorer.mechanism.configuration import Configuration
from explorer.mechanism.design import GUIDE_ROWS, Design
from explorer.mechanism.machine import NO_LOAD, Payload, Six
from explorer.mechanism.pose import Pose, Triple
from explorer.motion.inverse_jacobian import twists_of_actuators
from explorer.motion.weights import Carried, MovingBodies, carry
from explorer.numerics.arrays import FloatArray, lengths_of
from explorer.singularity.freedoms import ZERO, free_twists
from explorer.statics import accuracy, compliance as elasticity
from explorer.statics.reactions import (
    Reactions,
    has_limits,
    largest_payload,
    limit_shares,
    reactions,
)


class WorstForce(NamedTuple):
    """The direction in which a force has the largest utilisation of a limit.

    Attributes:
        direction: Unit vector, base axes, shape (3,); NaN if singular or if no part has a limit.
        part: Index in `explorer.statics.reactions.LIMITED` of the part with this utilisation.
        utilisation: The utilisation; infinite in a singular pose.
    """

    direction: FloatArray
    part: int
    utilisation: float


class LoadedPose(Configuration):
    """A design in one pose, under a load at the tool point, its payload and other weights.

    Args:
        design: The manipulator, with its tool, payload and limits.
        pose: The pose.
        load: (F; M) at the tool point, base axes, in N and N × unit.
        own: Masses of the bodies besides the payload; None for none.
        weighs_payload: Whether the payload has its weight.
        point: Point at which the load acts in place of the tool, in the platform frame and design
            units; None for the tool.
    """

    def __init__(
        self,
        design: Design,
        pose: Pose,
        load: Six = NO_LOAD,
        own: MovingBodies | None = None,
        weighs_payload: bool = True,
        point: Triple | None = None,
    ) -> None:
        self.point = design.tool.position if point is None else point
        super().__init__(design, pose.position, pose.rotation, self.point)
        self.pose, self.load, self.own, self.weighs_payload = pose, load, own, weighs_payload

    def with_load(self, load: Six) -> LoadedPose:
        """Return the pose under another load."""
        rest = self.own, self.weighs_payload, self.point
        return LoadedPose(self.design, self.pose, load, *rest)

    @cached_property
    def weights(self) -> MovingBodies:
        """All masses."""
        own = self.own or MovingBodies()
        return own.with_payload(self.design) if self.weighs_payload else own

    @cached_property
    def carried(self) -> Carried:
        """The effect of all weights."""
        return carry(self, self.weights)

    @cached_property
    def reactions(self) -> Reactions:
        """The reactions to the load and the weights."""
        return reactions(self, self.load, self.carried)

    @cached_property
    def shares(self) -> FloatArray:
        """Utilisations of the limits, shape (12,), as in `LIMITED`; 0 without a limit."""
        return limit_shares(self.design, self.reactions)

    @cached_property
    def is_regular(self) -> bool:
        """Whether unique forces hold any load: whether the pose is not singular."""
        return bool(np.isfinite(self.reactions.actuators).all())

    @cached_property
    def moves_platform(self) -> bool:
        """Whether the load does work in a motion that locked actuators leave free.

        No forces hold such a load. Any other load is held in a singular pose, too, but by no unique
        forces: those that balance each other can be added.
        """
        twists, reach = free_twists(self.with_tool(np.zeros(3))), self.design.reach
        velocities, turning = reach * twists[:, :3], twists[:, 3:]
        at_tool = velocities + np.cross(turning, self.pose.rotation @ self.tool)
        force, moment = np.split(self.carried.wrench + self.load, 2)
        work = np.abs(at_tool @ force + turning @ moment)
        size = reach * np.linalg.norm(force) + np.linalg.norm(moment)
        is_pushed = self.design.payload.force_n > 0.0
        is_moved = is_pushed & (lengths_of(at_tool) > ZERO * reach)
        return bool(np.any((work > ZERO * size) | is_moved))

    @property
    def worst(self) -> int:
        """Index in `LIMITED` of the part with the largest utilisation."""
        return int(self.shares.argmax())

    @property
    def share(self) -> float:
        """The largest utilisation of a limit; infinite in a singular pose."""
        return float(self.shares.max())

    @cached_property
    def largest_payload(self) -> float:
        """The largest mass in place of the payload that keeps all limits, in kg."""
        return float(largest_payload(self, self.load, self.own))

    @cached_property
    def unit_force(self) -> WorstForce:
        """A force of 1 N alone at the tool, in the direction of the largest utilisation.

        Neither load nor payload act besides; the largest force that all parts hold in every
        direction is 1 / utilisation.
        """
        bare = msgspec.structs.replace(self.design, payload=Payload())
        return LoadedPose(bare, self.pose, point=self.point).worst_force(1.0)

    def worst_force(self, force: float) -> WorstForce:
        """Return the direction of an added force at the tool, in N, of the largest utilisation.

        What a limit bounds is linear in the force, or the length of a vector that is, and changes
        with one component of the force only: that along the row of an actuator in J⁻ᵀ. So the
        largest utilisation is that of one of these six or of their opposites.
        """
        rows = twists_of_actuators(self)[:3].T
        if not np.isfinite(rows).all():
            return WorstForce(np.full(3, np.nan), self.worst, np.inf)
        if not has_limits(self.design):
            return WorstForce(np.full(3, np.nan), 0, 0.0)
        sizes = np.linalg.norm(rows, axis=1)
        units = rows[sizes > 0.0] / sizes[sizes > 0.0, None]
        directions = np.concatenate([units, -units])
        loads = np.tile(self.load, (len(directions), 1))
        loads[:, :3] += force * directions
        shares = limit_shares(self.design, reactions(self, loads, self.carried))
        row, part = (int(i) for i in np.unravel_index(shares.argmax(), shares.shape))
        share = float(shares[row, part])
        direction = directions[row] if share > 0.0 else np.full(3, np.nan)
        return WorstForce(direction, part, share)


BY_ACTUATORS, BY_DIMENSIONS, BY_ALL = slice(0, 6), slice(6, 31), slice(0, 31)
"""The sources of errors that are actuators, those that are dimensions, and all of them."""

GROUPS = {"actuators": BY_ACTUATORS, "dimensions": BY_DIMENSIONS, "all": BY_ALL}
"""The groups of sources by their names."""


class ErrorEllipsoid(NamedTuple):
    """The ellipsoid of the tool's displacements one standard deviation from its place.

    Attributes:
        semi_axes: Semi-axes, from the longest to the shortest, shape (3,), in design units.
        directions: Unit vectors of the semi-axes, base axes, as rows, shape (3, 3).
    """

    semi_axes: FloatArray
    directions: FloatArray


@dataclass(frozen=True)
class ToolPrecision:
    """Errors, compliance and deflection at the tool of a design in one pose under a load.

    Values are infinite in a singular pose.

    Attributes:
        loaded: The pose under its load, its payload and other weights.
    """

    loaded: LoadedPose

    @cached_property
    def compliance(self) -> FloatArray:
        """The compliance at the tool, shape (6, 6)."""
        stiffness = elasticity.stiffness_of(self.loaded.design)
        return elasticity.compliance_of(self.loaded, *stiffness)

    @cached_property
    def is_regular(self) -> bool:
        """Whether the pose is not singular."""
        return bool(np.isfinite(self.compliance).all())

    @cached_property
    def has_errors(self) -> bool:
        """Whether an actuator has an error or a dimension a tolerance."""
        return bool(self.bounds.any())

    @cached_property
    def bounds(self) -> FloatArray:
        """Largest errors of the sources, shape (31,), in design units and radians."""
        return accuracy.source_errors(self.loaded.design)

    @cached_property
    def by_source(self) -> FloatArray:
        """The tool's error per error of each source, shape (6, 31)."""
        return accuracy.error_by_source(self.loaded)

    def worst(self, sources: slice = BY_ALL) -> accuracy.LargestError:
        """Return the largest errors by some of the sources."""
        return accuracy.largest_error(self.by_source[:, sources], self.bounds[sources])

    def rms(self, sources: slice = BY_ALL) -> accuracy.ToolError:
        """Return the root-mean-square errors by some of the sources, uniform within bounds."""
        return accuracy.rms_of_sources(self.by_source[:, sources], self.bounds[sources])

    @cached_property
    def alone(self) -> accuracy.ToolError:
        """The errors that each source alone causes, each of shape (31,)."""
        return accuracy.errors_alone(self.by_source, self.bounds)

    @cached_property
    def ellipsoid(self) -> ErrorEllipsoid:
        """The ellipsoid of the tool's RMS displacement by all sources, in a regular pose."""
        by_source = self.by_source[:3] * (accuracy.UNIFORM * self.bounds)
        values, vectors = np.linalg.eigh(by_source @ by_source.T)
        return ErrorEllipsoid(np.sqrt(np.maximum(values[::-1], 0.0)), vectors[:, ::-1].T)

    @cached_property
    def wrench(self) -> FloatArray:
        """The load and the weights as (F; M) at the tool, shape (6,), in N and N × unit."""
        return self.loaded.load + self.loaded.carried.wrench

    @cached_property
    def deflection(self) -> FloatArray:
        """Displacement and turn of the tool under the wrench, shape (6,)."""
        return elasticity.deflection(self.compliance, self.wrench)

    @cached_property
    def principal(self) -> elasticity.PrincipalCompliances:
        """The six principal directions of the compliance."""
        return elasticity.principal_compliances(self.compliance)

    @cached_property
    def shares(self) -> elasticity.ComplianceShares:
        """Shares of guide, struts and actuators in the deflection's work."""
        stiffness = elasticity.stiffness_of(self.loaded.design)
        return elasticity.compliance_shares(self.loaded, self.wrench, *stiffness)

    @cached_property
    def largest_displacement(self) -> float:
        """Largest displacement of the tool with the payload's force besides, in design units."""
        force = self.loaded.design.payload.force_n
        return float(elasticity.largest_deflection(self.compliance, self.wrench, force)[0])

    @cached_property
    def carriages(self) -> FloatArray:
        """Displacements of the carriages along the guide, shape (2,), in a regular pose."""
        by_guide = twists_of_actuators(self.loaded)[:, GUIDE_ROWS]
        return by_guide.T @ self.wrench / elasticity.stiffness_of(self.loaded.design)[0][GUIDE_ROWS]
