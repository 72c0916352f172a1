"""The demands of a requirement on the values of a machine in every pose, each declared once.

A demand tells its values of machines in poses, their limit, and how they are told. The proofs, the
search and the check take it from here; over cells of poses the values are bounds.
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Callable, Iterator
from functools import partial, reduce
from operator import attrgetter
from typing import Any, NamedTuple

import numpy as np

from explorer.find import machine_values as m
from explorer.find.machine_values import MachineValues
from explorer.find.terms import Terms
from explorer.legs.clearance import PAIRS, pair_name
from explorer.mechanism.design import GUIDE_ROWS, JOINTS
from explorer.mechanism.machine import STANDARD_GRAVITY
from explorer.numerics.arrays import FloatArray

# Signs of errors, up to a common one.
SIGNS = np.array([*itertools.product((1.0, -1.0), repeat=5)])
# Shares by which poses of a search keep their demands, so that poses between them keep these too,
# and so that they can be proven: of limits over tilts, and of all others.
NEAR, STEEP = 1e-4, 0.05


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
            # Convex in the leg, unlike the angle and its cosine.
            sizes = [(at.lengths[i], at.home.lengths[i]) for i in m.SWINGING]
            rows = zip(sizes, at.along_home, strict=True)
            return [(cosine * length - along) / own for (length, own), along in rows]

        def angles(at: MachineValues) -> list[Any]:
            return [np.degrees(np.arccos(np.clip(each, -1.0, 1.0))) for each in at.swings]

        joints, degrees = ("a1", "a3", "b1", "b2", "b3", "b4"), math.degrees(terms.swing)
        found.append(Demand("swing", joints, beyond, 0.0, "°", 0.0, degrees, tell=angles))
    return found


def demands_of(terms: Terms) -> list[Demand]:
    """Return the demands that are proven over cells of poses."""
    return [*clearances_of(terms), *_of_actuators(terms)]


def sizes_of(terms: Terms) -> Iterator[Demand]:
    """Yield the demand of searches on the box about all joints, if there is one.

    It asks for more than its largest edge: no joint is farther than half of that, along each axis,
    from the middle of the joints at home.
    """
    most = terms.requirement.hull_mm

    def farthest(at: MachineValues) -> list[Any]:
        found: list[Any] = []
        for axis in range(3):
            home = [point[axis] for point in (*at.home.bases, *at.home.ends)]
            middle = 0.5 * (reduce(np.maximum, home) + reduce(np.minimum, home))
            ends = [point[axis] for point in (*at.bases, *at.ends)]
            found.append(reduce(np.maximum, [m.size(each - middle) for each in ends]))
        return found

    if most is not None:
        limit = 0.5 * most / terms.scale_mm
        reserve = STEEP * limit
        yield Demand("outer size", tuple("xyz"), farthest, limit, "mm", 1.0, reserve=reserve)


def every_demand(terms: Terms) -> list[Demand]:
    """Return the demands on the values of a machine in every pose."""
    return [*limits_of(terms), *demands_of(terms)]


def clearances_of(terms: Terms) -> Iterator[Demand]:
    """Yield the demand on the distances of the legs, if there is one."""
    if terms.distance > 0.0:
        yield Demand(
            "clearance",
            tuple(f"legs {pair_name(pair)}" for pair in PAIRS),
            attrgetter("distances"),
            terms.distance,
            "mm",
            terms.scale_mm,
            -terms.requirement.legs.diameter_mm,
            is_least=True,
            reserve=STEEP * terms.distance,
        )


def _of_actuators(terms: Terms) -> Iterator[Demand]:
    """Yield the demands on what the actuators do, over their limits."""
    need, legs, payload = terms.requirement, terms.requirement.legs, terms.requirement.payload
    weight = tuple(payload.mass_kg * STANDARD_GRAVITY * np.array(need.gravity))
    centre, force = tuple(np.array(payload.centre_mm) / terms.scale_mm), payload.force_n
    demand = partial(Demand, limit=1.0, reserve=STEEP, is_singular=True)

    def held(at: MachineValues) -> list[Any]:
        return at.forces(weight, m.cross(at.of_platform(centre), weight))

    if (legs.push_n or legs.pull_n) and (payload.mass_kg or force):
        push = legs.push_n or math.inf
        pull = legs.pull_n or push

        def forces(at: MachineValues) -> list[Any]:
            return [
                np.maximum(
                    (m.most(own) + force * gain) / push, (m.most(-own) + force * gain) / pull
                )
                for own, gain in zip(held(at), at.tool_speeds, strict=True)
            ]

        yield demand("force", JOINTS, forces, unit="N", factor=min(push, pull))
    speed, turning = need.tool.speed_mm_s, math.radians(need.tool.turning_deg_s) * terms.scale_mm
    if (fastest := legs.speed_mm_s) is not None and (speed or turning):

        def speeds(at: MachineValues) -> list[Any]:
            found: list[Any] = []
            for joint, point in enumerate(m.POINTS):
                leg = m.times(1.0 / at.lengths[point], at.legs[point])
                along: m.Vec = (1.0, 0.0, 0.0) if joint in GUIDE_ROWS else leg
                lever = m.longest(m.cross(m.minus(at.ends[point], at.tool), along))
                found.append((speed + turning * lever) / fastest)
            return found

        yield demand("speed", JOINTS, speeds, unit="mm/s", factor=fastest, is_singular=False)
    if (least := need.transmission) is not None:
        index = Demand("transmission index", JOINTS, attrgetter("transmissions"), least, "", 1.0)
        yield index._replace(is_least=True, reserve=STEEP * least, is_singular=True)
    if (most_error := need.error_mm) is not None:

        def error(at: MachineValues) -> list[Any]:
            return [legs.error_mm / most_error * largest_error(at)]

        yield demand("error", ("",), error, unit="mm", factor=most_error)
    if (most_bend := need.deflection_mm) is not None:
        compliance = 1.0 / (legs.stiffness_n_mm or math.inf)

        def deflection(at: MachineValues) -> list[Any]:
            bends = [
                gain * (m.size(own) + force * gain)
                for gain, own in zip(at.tool_speeds, held(at), strict=True)
            ]
            return [compliance / most_bend * sum(bends)]

        yield demand("deflection", ("",), deflection, unit="mm", factor=most_bend)


def largest_error(at: MachineValues) -> Any:
    """Return the largest displacement of the tool for errors of a unit of all actuators."""
    sums: list[Any] = []
    for signs in SIGNS.tolist():
        total, *others = at.velocities
        for sign, velocity in zip(signs, others, strict=True):
            total = m.plus(total, m.times(sign, velocity))
        sums.append(m.longest(total))
    return np.max(sums, axis=0)
