"""A problem at given variables: the design there, and the derivatives of all parameters.

The solver works in scaled variables u of about unit size: lengths over the size of the
start, the yaw in radians.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping
from functools import cached_property

import numpy as np

from explorer.mechanism.design import LENGTHS, Design
from explorer.numerics.arrays import FloatArray, lengths_of
from explorer.optimise.problem import REACH, YAW, Problem
from explorer.workspace.limits import constraints
from explorer.workspace.slices.volume import unexplained_volume
from explorer.workspace.workspace import Workspace

Chain = Mapping[str, FloatArray]
"""By parameter of a workspace: its derivatives by the n scaled variables, shape (n,)."""


def scales(problem: Problem) -> FloatArray:
    """Return the size of one unit of each scaled variable, shape (n,)."""
    return np.array([math.degrees(1.0) if name == YAW else problem.size for name in problem.names])


def bounds_of(problem: Problem) -> FloatArray:
    """Return the lows and highs of the scaled variables, shape (n, 2)."""
    pairs = np.array([(variable.low, variable.high) for variable in problem.variables])
    return pairs / scales(problem)[:, None]


class SearchState:
    """A problem at scaled variables (n,); each property is computed once."""

    def __init__(self, problem: Problem, u: FloatArray) -> None:
        self.problem, self.u = problem, u
        self.values: FloatArray = u * scales(problem)

    @cached_property
    def design(self) -> Design:
        """The design here."""
        return self.problem.design_at(self.values.tolist())

    @cached_property
    def workspace(self) -> Workspace:
        """The workspace at the orientation of home."""
        return Workspace(self.design)

    @property
    def rotation(self) -> FloatArray:
        """The orientation of the workspace, shape (3, 3)."""
        return self.workspace.rotation

    @cached_property
    def regions(self) -> dict[str, constraints.BallOrCylinder | constraints.HalfSpace]:
        """The limits of the workspace by name, without those that no position keeps."""
        return {
            limit.name: limit
            for limit in self.workspace.limits
            if isinstance(limit, constraints.BallOrCylinder | constraints.HalfSpace)
        }

    @property
    def volume(self) -> float:
        """The exact volume of the workspace."""
        return unexplained_volume(self.workspace).volume

    def volume_root(self, unit: float) -> tuple[float, FloatArray]:
        """Return the cube root of the volume over a unit, and its derivatives, shape (n,)."""
        root = (self.volume / unit) ** (1.0 / 3.0)
        slope = root / (3.0 * self.volume) if self.volume > 0.0 else 0.0
        return root, slope * self.along(unexplained_volume(self.workspace).gradient)

    @cached_property
    def chain(self) -> Chain:
        """Derivatives of each parameter of the workspace by the scaled variables."""
        problem, n = self.problem, len(self.u)
        chain: dict[str, FloatArray] = {}
        for index, (name, scale) in enumerate(zip(problem.names, scales(problem), strict=True)):
            unit = np.zeros(n)
            unit[index] = scale
            if name == YAW:
                chain[constraints.YAW] = np.radians(unit)
            elif name == REACH:
                chain.update({f"{length} maximum": unit for length in LENGTHS})
            else:
                chain[name] = unit
        return chain

    @cached_property
    def longest_leg(self) -> tuple[float, FloatArray]:
        """The largest of the four maximum lengths, and its derivatives, shape (n,)."""
        design = self.design
        longest = max(LENGTHS, key=lambda name: design.length_range(name)[1])
        if getattr(design.limits, longest)[1] is not None:
            return design.length_range(longest)[1], self.along({f"{longest} maximum": 1.0})
        (x, y), reach = design.a3, design.reach
        return reach, self.along({"a3x": x / reach, "a3y": y / reach})

    def along(self, gradient: Mapping[str, float]) -> FloatArray:
        """Return derivatives by the scaled variables, shape (n,), from those by parameters."""
        total = np.zeros(len(self.u))
        for name, derivative in gradient.items():
            if name in self.chain:
                total += derivative * self.chain[name]
        return total

    def slack_slopes(
        self, limit: constraints.BallOrCylinder | constraints.HalfSpace, p: FloatArray
    ) -> FloatArray:
        """Return the derivatives of the slack of a limit at fixed positions (k, 3), (k, n)."""
        if not limit.rates:
            return np.zeros((len(p), len(self.u)))
        by_limit = np.ones((len(p), 4))
        match limit:
            case constraints.BallOrCylinder():
                offsets = (p - limit.centre) * (1.0 if limit.is_ball else constraints.ACROSS)
                by_limit[:, :3] = offsets / np.maximum(lengths_of(offsets), 1e-300)[:, None]
                by_limit *= 1.0 if limit.inside else -1.0
            case constraints.HalfSpace():
                by_limit[:, :3] = -p
        # The centre and the radius, or the normal and the offset, by the scaled variables, (4, n).
        motion = np.column_stack([*limit.rates.values()]) @ self.rows(limit.rates)
        return by_limit @ motion

    def rows(self, names: Iterable[str]) -> FloatArray:
        """Return the derivatives of k parameters by the scaled variables, shape (k, n)."""
        zero = np.zeros(len(self.u))
        return np.array([self.chain.get(name, zero) for name in names])
