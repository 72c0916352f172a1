"""The precision of a design in one pose under a load: errors, compliance and deflection."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import NamedTuple

import numpy as np

from explorer.numerics.arrays import FloatArray
from explorer.statics.accuracy import (
    UNIFORM,
    LargestError,
    ToolError,
    error_by_source,
    errors_alone,
    largest_error,
    rms_of_sources,
    source_errors,
)
from explorer.statics.compliance import (
    ComplianceShares,
    PrincipalCompliances,
    compliance_of,
    compliance_shares,
    deflection,
    largest_deflection,
    principal_compliances,
    stiffness_of,
)
from explorer.statics.forces import GUIDE_ROWS, twists_of_actuators
from explorer.statics.loaded import LoadedPose

BY_ACTUATORS, BY_DIMENSIONS, BY_ALL = slice(0, 6), slice(6, 29), slice(0, 29)
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
        stiffness = stiffness_of(self.loaded.design)
        return compliance_of(self.loaded.configuration, *stiffness)

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
        """Largest errors of the sources, shape (29,), in design units and radians."""
        return source_errors(self.loaded.design)

    @cached_property
    def by_source(self) -> FloatArray:
        """The tool's error per error of each source, shape (6, 29)."""
        return error_by_source(self.loaded.configuration)

    def worst(self, sources: slice = BY_ALL) -> LargestError:
        """Return the largest errors by some of the sources."""
        return largest_error(self.by_source[:, sources], self.bounds[sources])

    def rms(self, sources: slice = BY_ALL) -> ToolError:
        """Return the root-mean-square errors by some of the sources, uniform within bounds."""
        return rms_of_sources(self.by_source[:, sources], self.bounds[sources])

    @cached_property
    def alone(self) -> ToolError:
        """The errors that each source alone causes, each of shape (29,)."""
        return errors_alone(self.by_source, self.bounds)

    @cached_property
    def ellipsoid(self) -> ErrorEllipsoid:
        """The ellipsoid of the tool's RMS displacement by all sources, in a regular pose."""
        values, vectors = np.linalg.eigh(self._covariance)
        return ErrorEllipsoid(np.sqrt(np.maximum(values[::-1], 0.0)), vectors[:, ::-1].T)

    @property
    def _covariance(self) -> FloatArray:
        moved = self.by_source[:3] * (UNIFORM * self.bounds)
        return moved @ moved.T

    @cached_property
    def wrench(self) -> FloatArray:
        """The load and the weights as (F; M) at the tool, shape (6,), in N and N × unit."""
        return self.loaded.load + self.loaded.carried.wrench

    @cached_property
    def deflection(self) -> FloatArray:
        """Displacement and turn of the tool under the wrench, shape (6,)."""
        return deflection(self.compliance, self.wrench)

    @cached_property
    def principal(self) -> PrincipalCompliances:
        """The six principal directions of the compliance."""
        return principal_compliances(self.compliance)

    @cached_property
    def shares(self) -> ComplianceShares:
        """Shares of guide, struts and actuators in the deflection's work."""
        stiffness = stiffness_of(self.loaded.design)
        return compliance_shares(self.loaded.configuration, self.wrench, *stiffness)

    @cached_property
    def largest_displacement(self) -> float:
        """Largest displacement of the tool with the payload's force besides, in design units."""
        force = self.loaded.design.payload.force_n
        return float(largest_deflection(self.compliance, self.wrench, force)[0])

    @cached_property
    def carriages(self) -> FloatArray:
        """Displacements of the carriages along the guide, shape (2,), in a regular pose."""
        guide = list(GUIDE_ROWS)
        forces = -twists_of_actuators(self.loaded.configuration)[:, guide].T @ self.wrench
        return -forces / stiffness_of(self.loaded.design)[0][guide]
