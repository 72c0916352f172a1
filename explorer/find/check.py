"""The check of a design against a requirement: each demand with its worst value, and what is spare.

Lengths, margins, swings and the order of the carriages are decided over the whole box and all
tilts; clearances, forces and errors too, by bounds over cells of poses. Where the bounds of one
stay open, it is computed in many random poses as well, and the answer says so.
"""

from __future__ import annotations

import math
from collections.abc import Iterator

import numpy as np

from explorer.find import machine_values as m
from explorer.find.answers import DemandCheck, RequirementCheck
from explorer.find.candidates import standard_poses
from explorer.find.certificate import (
    CLOSELY,
    LENGTH,
    SAMPLES,
    Certificate,
    certify,
    lengths_over,
    used_ranges,
)
from explorer.find.demands import Demand, every_demand
from explorer.find.over_poses import sample_demand
from explorer.find.over_tilts import CORNERS, poses_over
from explorer.find.requirement import Requirement
from explorer.find.terms import Terms, design_of, row_of
from explorer.legs.moves import StraightMoves
from explorer.mechanism.configuration import tool_offset
from explorer.mechanism.design import LENGTHS, Design
from explorer.mechanism.pose import Pose
from explorer.numerics.arrays import FloatArray
from explorer.paths.time_law import law_at_speed
from explorer.prototype.fitting import buildability

# Tolerance of lengths over the diagonal of the box, with which found designs keep their own limits.
CLOSE = 1e-7
# Miss below which a check tells a demand as kept, over the diagonal or over its limit.
KEPT = 1e-6


def check_requirement(design: Design, requirement: Requirement) -> RequirementCheck:
    """Return the check of a design against a requirement.

    The box lies with its centre at the design's tool at home, turned by `Design.required_yaw`. The
    design's own ranges of its lengths have to contain all that the box and the tilts need; payload,
    actuators, radii and swings are those of the requirement.
    """
    terms = Terms.of(requirement)
    x = row_of(design, terms)
    scale = design.unit_mm / terms.scale_mm
    low, high = scale * np.array([design.length_range(name) for name in LENGTHS]).T
    # Limits beyond what the box needs would leave the worst lengths unknown.
    with np.errstate(all="ignore"):
        used = used_ranges(x, terms, standard_poses(terms.tilt))
    low = np.maximum(low - CLOSE, used[:, 0])
    high = np.minimum(np.minimum(high, terms.longest) + CLOSE, used[:, 1])
    ranges = np.column_stack([low, high])
    return check_machine(design, x, terms, certify(x, terms, ranges=ranges))


def check_machine(
    design: Design, x: FloatArray, terms: Terms, certificate: Certificate
) -> RequirementCheck:
    """Return the check of a design, given as a machine too, from its certificate."""
    demands = tuple(_Check(design, x, terms, certificate).demands())
    is_open = not all(demand.proven for demand in demands)
    return RequirementCheck(demands, SAMPLES if is_open else 0)


def is_kept(x: FloatArray, terms: Terms, certificate: Certificate) -> bool:
    """Return whether a machine keeps all demands, those on its size, moves and parts too."""
    if not certificate.is_kept:
        return False
    design = design_of(x, terms, certificate.ranges, "machine")
    whole = _Check(design, x, terms, certificate).on_the_whole()
    return all(demand.kept for demand in whole)


class _Check:
    """The demands of a requirement on one machine."""

    def __init__(self, design: Design, x: FloatArray, terms: Terms, found: Certificate) -> None:
        self.design, self.x, self.terms, self.found = design, x, terms, found

    def demands(self) -> Iterator[DemandCheck]:
        """Yield the demands in the order of the file."""
        yield from self._lengths()
        for demand in every_demand(self.terms):
            yield self._demand(demand)
        yield from self.on_the_whole()

    def on_the_whole(self) -> Iterator[DemandCheck]:
        """Yield the demands on the machine as a whole, which a certificate does not have."""
        requirement = self.terms.requirement
        if requirement.hull_mm is not None:
            yield self._hull(requirement.hull_mm)
        if requirement.move_s is not None:
            yield self._move(requirement.move_s)
        if requirement.buildable:
            built = buildability(self.design)
            words = "; ".join(built.problems)
            if built.short_legs:
                short = ", ".join(map(str, built.short_legs))
                words = words or f"legs {short} need more than one rod"
            kept = not words
            yield DemandCheck("buildable", "", kept, 0.0, 0.0, 0.0, "", None, kept, words)

    def _lengths(self) -> Iterator[DemandCheck]:
        """Yield the lengths within the design's own limits, the ratio and the longest leg."""
        found, terms, own = self.found, self.terms, self.found.ranges
        used = terms.scale_mm * lengths_over(self.x, terms, found.poses[:8]).T[::-1].ravel()
        ends = np.array([self.design.length_range(name) for name in LENGTHS])
        limits = self.design.unit_mm * ends.T[::-1].ravel()
        proven = bool(found.proven[:8].all())
        yield self._worst(LENGTH, used, limits, "mm", proven)
        if math.isfinite(terms.ratio):
            is_bought = bool((own[:, 1] <= terms.ratio * (1.0 + 1e-5) * own[:, 0]).all())
            limits = np.full(4, terms.ratio)
            yield self._worst("ratio", used[:4] / used[4:], limits, "", proven and is_bought)
        longest = terms.requirement.legs.longest_mm
        if longest is not None:
            yield self._worst("longest leg", used[:4], np.full(4, longest), "mm", proven)

    def _worst(
        self, name: str, values: FloatArray, limits: FloatArray, unit: str, proven: bool
    ) -> DemandCheck:
        """Return the check of the worst of four longest lengths, or ratios, and four shortest."""
        spares = (limits - values) * np.repeat([1.0, -1.0], 4)[: len(values)]
        row = int(spares.argmin())
        worst, limit, spare = (float(each[row]) for each in (values, limits, spares))
        item = self.found.items[row] if name == LENGTH else LENGTHS[row]
        kept, pose = spare >= -KEPT * limit, self._pose(self.found.poses[row])
        return DemandCheck(name, item, kept, worst, limit, spare, unit, pose, kept and proven)

    def _demand(self, demand: Demand) -> DemandCheck:
        found, rows = self.found, self.found.rows(demand.name)
        missed, poses = found.missed[rows], found.poses[rows]
        proven = bool(found.proven[rows].all())
        planes = found.rows("margin")
        closest = max(planes, key=lambda row: found.missed[row])
        if demand.is_singular and found.missed[closest] >= self.terms.margin:
            # The box is on both sides of a singular plane.
            missed, poses = np.full(len(rows), math.inf), found.poses[[closest] * len(rows)]
            if demand.is_least:
                missed[:] = demand.limit
        told = demand.told(missed)
        if demand.tell is not None:
            shown = demand._replace(values=demand.tell, limit=demand.offset, factor=1.0, offset=0.0)
            closer = sample_demand(shown, self.x, self.terms, CLOSELY, found.poses)
            told, poses = shown.told(closer.values), closer.places
        worst = int((demand.side * told).argmax())
        limit, kept = float(demand.told(np.zeros(1))[0]), bool(missed.max() <= KEPT)
        remark = "" if proven or not kept else f"no violation in {SAMPLES} poses"
        return DemandCheck(
            demand.name,
            demand.items[worst],
            kept,
            float(told[worst]),
            limit,
            float(demand.side * (limit - told[worst])),
            demand.unit,
            self._pose(poses[worst]),
            proven and kept,
            remark,
        )

    def _hull(self, limit: float) -> DemandCheck:
        """Return the check of the box about all joints, over a grid of tilts with its error."""
        terms, step = self.terms, 2.0 * math.pi / 48
        tilts = np.linspace(0.0, terms.tilt, 7 if terms.tilt else 1)
        grid = [(step * azimuth, tilt) for tilt in tilts for azimuth in range(48)]
        at = terms.values(self.x, poses_over(CORNERS, np.array(grid)))
        arms = float(max(abs(self.x[m.B1X : m.HX]).max(), abs(self.x[m.TX : m.TILT]).max()))
        turning = math.sin(terms.tilt) + 2.0 - 2.0 * math.cos(terms.tilt)
        error = 0.5 * ((tilts[-1] / 6.0) ** 2 + step**2 * turning) * arms
        base = [np.zeros((1, 3)), [[self.x[m.A3X], self.x[m.A3Y], 0.0]]]
        joints = np.concatenate([*base, *map(m.rows_of, at.ends)])
        edges = terms.scale_mm * np.ptp(joints, axis=0)
        value, axis = float(edges.max()), "along " + "xyz"[int(edges.argmax())]
        kept, proven = value <= limit, value + 2.0 * terms.scale_mm * error <= limit
        return DemandCheck(
            "outer size", axis, kept, value, limit, limit - value, "mm", None, proven
        )

    def _move(self, limit: float) -> DemandCheck:
        """Return the check of the time along the diagonals of the box at home's orientation."""
        legs, design = self.terms.requirement.legs, self.design
        speed, change = legs.speed_mm_s or math.inf, legs.acceleration_mm_s2 or math.inf
        times: list[float] = []
        for corner in CORNERS[:4]:
            ends = poses_over(np.array([corner, -corner]), np.zeros((1, 2)))
            law = law_at_speed(
                design,
                StraightMoves.along([self._pose(end) for end in ends]),
                speed / design.unit_mm,
                change / design.unit_mm,
            )
            times.append(law.duration)
        value = max(times)
        kept = value <= limit
        return DemandCheck("time of a move", "", kept, value, limit, limit - value, "s", None, kept)

    def _pose(self, pose: FloatArray) -> Pose:
        """Return the pose of b4 in design units at a pose over the box."""
        at, scale = self.terms.values(self.x, pose[None]), self.terms.scale_mm
        rotation = np.column_stack([m.rows_of(axis)[0] for axis in (at.u, at.v, at.w)])
        offset = tool_offset(rotation, self.design.tool.position)
        return Pose.of(scale * m.rows_of(at.tool)[0] / self.design.unit_mm - offset, rotation)
