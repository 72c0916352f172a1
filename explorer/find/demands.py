"""The demands of a requirement on the values of a machine in every pose, each declared once.

A demand tells its values of machines in poses, their limit, and how they are told. The proofs, the
search and the check take it from here; over cells of poses the values are bounds.
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Callable, Iterator
from typing import Any, NamedTuple

import numpy as np

from explorer.find import machine_values as m
from explorer.find.machine_values import MachineValues
from explorer.find.terms import Terms
from explorer.legs.clearance import PAIRS, pair_name
from explorer.mechanism.design import GUIDE_ROWS, JOINTS
from explorer.numerics.arrays import FloatArray

# Signs of errors, up to a common one.
SIGNS = np.array([*itertools.product((1.0, -1.0), repeat=5)])
# Shares by which poses of a search keep their demands, so that poses between them keep these too:
# near in the variables, or with steep values.
NEAR, STEEP = 1e-4, 2e-2


class Demand(NamedTuple):
    """Values of a machine that are at most a limit in every pose, or at least.

    Attributes:
        name: Name, such as "force".
        items: What each value is of, such as "l1".
        values: Function that returns the values, over the diagonal of the box or without a unit.
        limit: Their limit.
        unit, factor, offset: Unit in which they are told, and value · factor + offset in it.
        is_least: Whether the limit is the least value that is allowed.
        reserve: What poses of a search have to spare.
        is_singular: Whether no limit is kept on both sides of a singular plane.
        tell: Function that returns the values in their unit, where these are no such numbers.
    """

    name: str
    items: tuple[str, ...]
    values: Callable[[MachineValues], list[Any]]
    limit: float
    unit: str
    factor: float
    offset: float = 0.0
    is_least: bool = False
    reserve: float = NEAR
    is_singular: bool = False
    tell: Callable[[MachineValues], list[Any]] | None = None

    @property
    def side(self) -> float:
        """The sign of values that are too large."""
        return -1.0 if self.is_least else 1.0

    def missed(self, at: MachineValues) -> list[Any]:
        """Return by how much each value misses the limit, or upper bounds over cells."""
        return [m.most(self.side * (value - self.limit)) for value in self.values(at)]

    def missed_rows(self, at: MachineValues) -> FloatArray:
        """Return by how much each value of one machine misses the limit in k poses, (k, items)."""
        shape = (len(at.poses),)
        missed = np.stack([np.broadcast_to(each, shape) for each in self.missed(at)], axis=1)
        return np.where(np.isnan(missed), np.inf, missed)

    def told(self, missed: FloatArray) -> FloatArray:
        """Return the values that miss the limit by some amounts, in their unit."""
        return self.factor * (self.limit + self.side * missed) + self.offset


def limits_of(terms: Terms) -> list[Demand]:
    """Return the demands that corners of the box decide at each orientation."""
    size = terms.scale_mm

    def margins(at: MachineValues) -> list[Any]:
        return [side * each for side, each in zip(at.sides[:3], at.margins, strict=True)]

    def order(at: MachineValues) -> list[Any]:
        return [at.sides[3] * at.order]

    planes, least = ("δ1", "δ2", "δ3"), terms.margin
    reserve = NEAR * least
    found = [
        Demand("margin", planes, margins, least, "mm", size, is_least=True, reserve=reserve),
        Demand("carriage order", ("",), order, 0.0, "mm", size, is_least=True, reserve=0.01),
    ]
    if terms.swing < math.pi:
        cosine = math.cos(terms.swing)

        def beyond(at: MachineValues) -> list[Any]:
            # Concave in the leg, and the distance of its end from the cone to first order.
            lengths = [at.lengths[i] for i in m.SWINGING]
            return [cosine * a - b for a, b in zip(lengths, at.along_home, strict=True)]

        def angles(at: MachineValues) -> list[Any]:
            return [np.degrees(np.arccos(np.clip(each, -1.0, 1.0))) for each in at.swings]

        joints, degrees = ("a1", "a3", "b1", "b2", "b3", "b4"), math.degrees(terms.swing)
        found.append(Demand("swing", joints, beyond, 0.0, "°", 0.0, degrees, tell=angles))
    return found


def demands_of(terms: Terms) -> list[Demand]:
    """Return the demands that are proven over cells of poses."""
    return [*_clearances(terms), *_of_actuators(terms)]


def _clearances(terms: Terms) -> Iterator[Demand]:
    if terms.distance > 0.0:
        yield Demand(
            "clearance",
            tuple(f"legs {pair_name(pair)}" for pair in PAIRS),
            _distances,
            terms.distance,
            "mm",
            terms.scale_mm,
            -terms.requirement.legs.diameter_mm,
            is_least=True,
            reserve=100.0 * NEAR * terms.distance,
        )


def _distances(at: MachineValues) -> list[Any]:
    return at.distances


def _transmissions(at: MachineValues) -> list[Any]:
    return at.transmissions


def _of_actuators(terms: Terms) -> Iterator[Demand]:
    """Yield the demands on what the actuators do, over their limits."""
    requirement = terms.requirement
    weight: m.Vec = tuple(terms.weight.tolist())
    centre: m.Vec = tuple(terms.centre.tolist())

    def forces(at: MachineValues) -> list[Any]:
        held = at.weight_forces(weight, centre)
        return [
            np.maximum(
                (m.most(own) + terms.force * speed) / terms.push,
                (m.most(-own) + terms.force * speed) / terms.pull,
            )
            for own, speed in zip(held, at.tool_speeds, strict=True)
        ]

    def speeds(at: MachineValues) -> list[Any]:
        found: list[Any] = []
        for joint, point in enumerate(m.POINTS):
            leg = m.times(1.0 / at.lengths[point], at.legs[point])
            along: m.Vec = (1.0, 0.0, 0.0) if joint in GUIDE_ROWS else leg
            lever = m.longest(m.cross(m.minus(at.ends[point], at.tool), along))
            found.append((terms.velocity + terms.turning * lever) / terms.speed)
        return found

    def error(at: MachineValues) -> list[Any]:
        # The errors of all actuators have one size, so that signs alone tell the sums apart.
        sums: list[Any] = []
        for signs in SIGNS.tolist():
            total, *others = at.velocities
            for sign, velocity in zip(signs, others, strict=True):
                total = m.plus(total, m.times(sign, velocity))
            sums.append(m.longest(total))
        return [terms.actuator_error / terms.error * np.max(sums, axis=0)]

    def deflection(at: MachineValues) -> list[Any]:
        held = at.weight_forces(weight, centre)
        bends = [
            speed * (m.size(own) + terms.force * speed)
            for speed, own in zip(at.tool_speeds, held, strict=True)
        ]
        return [terms.flexibility / terms.deflection * sum(bends)]

    def demand(
        name: str, items: tuple[str, ...], values: Any, unit: str, limit: float | None
    ) -> Demand:
        is_singular = name != "speed"
        most = limit or math.inf
        return Demand(name, items, values, 1.0, unit, most, 0.0, False, STEEP, is_singular)

    legs = requirement.legs
    if math.isfinite(terms.push) and (terms.force or terms.weight.any()):
        yield demand("force", JOINTS, forces, "N", min(terms.push, terms.pull))
    if math.isfinite(terms.speed) and (terms.velocity or terms.turning):
        yield demand("speed", JOINTS, speeds, "mm/s", legs.speed_mm_s)
    if terms.transmission:
        least = terms.transmission
        reserve = STEEP * least
        yield Demand(
            "transmission index",
            JOINTS,
            _transmissions,
            least,
            "",
            1.0,
            is_least=True,
            reserve=reserve,
            is_singular=True,
        )
    if math.isfinite(terms.error):
        yield demand("error", ("",), error, "mm", requirement.error_mm)
    if math.isfinite(terms.deflection):
        yield demand("deflection", ("",), deflection, "mm", requirement.deflection_mm)
