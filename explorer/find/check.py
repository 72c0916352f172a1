"""The check of a design against a requirement: each demand with its worst value, and what is spare.

Lengths, margins, swings and the order of the carriages are decided over the whole box and all
tilts; clearances, forces and errors too, by bounds over cells of poses. Where the bounds of one
stay open, it is computed in many random poses as well, and the answer says so.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from typing import NamedTuple

import numpy as np

from explorer.errors import InputError
from explorer.find import machine_values as m
from explorer.find.answers import DemandCheck, RequirementCheck
from explorer.find.certificate import SAMPLES, Certificate, certify, lengths_over
from explorer.find.machine_values import BoxPoses
from explorer.find.over_poses import demand_names
from explorer.find.over_tilts import CORNERS, SWINGS, limit_names
from explorer.find.requirement import Requirement
from explorer.find.terms import Terms, row_of
from explorer.legs.clearance import PAIRS, pair_name
from explorer.legs.moves import StraightMoves
from explorer.mechanism.configuration import tool_offset
from explorer.mechanism.design import LENGTHS, Design
from explorer.mechanism.pose import Pose
from explorer.numerics.arrays import FloatArray
from explorer.paths.time_law import law_at_speed
from explorer.prototype.fitting import buildability

# Tolerance of lengths over the diagonal of the box, with which found designs keep their own limits.
CLOSE = 1e-7
# Demands of which a singular pose keeps none.
UNBOUNDED = ("force", "transmission", "error", "deflection")


def check_requirement(design: Design, requirement: Requirement) -> RequirementCheck:
    """Return the check of a design against a requirement.

    The box lies with its centre at the design's tool at home, turned by `Design.required_yaw`. The
    design's own ranges of its lengths have to contain all that the box and the tilts need; payload,
    actuators, radii and swings are those of the requirement.
    """
    terms = Terms.of(requirement)
    x = row_of(design, terms)
    scale = design.unit_mm / terms.scale_mm
    ranges = scale * np.array([design.length_range(name) for name in LENGTHS])
    ranges[:, 1] = np.minimum(ranges[:, 1], terms.longest)
    ranges = ranges + CLOSE * np.array([-1.0, 1.0])
    return check_machine(design, x, terms, certify(x, terms, ranges=ranges))


def check_machine(
    design: Design, x: FloatArray, terms: Terms, certificate: Certificate
) -> RequirementCheck:
    """Return the check of a design, given as a machine too, from its certificate."""
    check = _Check(design, x, terms, certificate)
    demands = tuple(check.demands())
    is_open = not all(demand.proven for demand in demands)
    return RequirementCheck(demands, SAMPLES if is_open else 0)


class _Worst(NamedTuple):
    """The worst of several values: by how much it misses, its name and its pose, and the proof."""

    missed: float
    name: str
    poses: BoxPoses
    proven: bool


def _at_most(
    name: str, value: float, limit: float, unit: str, pose: Pose | None, proven: bool
) -> DemandCheck:
    """Return the check of a value that must not exceed a limit."""
    kept = value <= limit * (1.0 + CLOSE)
    return DemandCheck(name, kept, value, limit, limit - value, unit, pose, kept and proven)


class _Check:
    """The demands of a requirement on one machine."""

    def __init__(self, design: Design, x: FloatArray, terms: Terms, found: Certificate) -> None:
        self.design, self.x, self.terms, self.found = design, x, terms, found
        self.limits, self.names = limit_names(terms), demand_names(terms)

    def demands(self) -> Iterator[DemandCheck]:
        """Yield the demands in the order of the file."""
        requirement, terms = self.terms.requirement, self.terms
        yield from self._lengths()
        margin = self._worst_limit("margin")
        size = terms.scale_mm
        yield self._row(margin, requirement.least_margin_mm, "mm", margin.name, -1.0, size)
        order = self._worst_limit("carriage order")
        yield self._row(order, 0.0, "mm", "carriage order", -1.0, size)
        if terms.swing < math.pi:
            yield self._swing()
        requires = requirement.legs
        if terms.distance > 0.0:
            worst = self._worst_demand("clearance")
            name = f"clearance of legs {worst.name}"
            yield self._row(worst, requires.apart_mm, "mm", name, -1.0, size)
        if "force l1" in self.names:
            worst = self._worst_demand("force")
            push = requires.push_n or math.inf
            limit = min(push, requires.pull_n or push)
            yield self._row(worst, limit, "N", f"force of {worst.name}", 1.0, limit)
        if "speed l1" in self.names:
            worst, most = self._worst_demand("speed"), requires.speed_mm_s or math.inf
            yield self._row(worst, most, "mm/s", f"speed of {worst.name}", 1.0, most)
        if terms.transmission:
            worst = self._worst_demand("transmission")
            yield self._row(worst, terms.transmission, "", "transmission index", -1.0, 1.0)
        for name, limit in (
            ("error", requirement.error_mm),
            ("deflection", requirement.deflection_mm),
        ):
            if limit is not None:
                worst = self._worst_demand(name)
                yield self._row(worst, limit, "mm", name, 1.0, limit)
        if requirement.hull_mm is not None:
            yield self._hull(requirement.hull_mm)
        if requirement.move_s is not None:
            yield self._move(requirement.move_s)
        if requirement.buildable:
            problems = buildability(self.design)
            fits = not problems.problems and not problems.short_legs
            words = "; ".join(problems.problems) or (
                f"legs {', '.join(map(str, problems.short_legs))} need more than one rod"
                if problems.short_legs
                else ""
            )
            yield DemandCheck("buildable", fits, 0.0, 0.0, 0.0, "", None, fits, words)

    def _lengths(self) -> Iterator[DemandCheck]:
        """Yield the lengths within the design's own limits, the ratio and the longest leg."""
        found, size = self.found, self.terms.scale_mm
        index = int(found.missed_limits[:8].argmax())
        poses = found.limit_poses.at(slice(index, index + 1))
        used = lengths_over(self.x, self.terms, found.limit_poses.at(slice(0, 8)))
        leg, is_short = index % 4, index >= 4
        own = found.ranges[leg, 0 if is_short else 1]
        worst = used[leg, 0 if is_short else 1]
        spare = float(worst - own if is_short else own - worst)
        kept = spare >= -10.0 * CLOSE
        name = f"{'shortest' if is_short else 'longest'} {LENGTHS[leg]}"
        proven = bool(found.limits[:8].all()) and kept
        yield DemandCheck(
            name,
            kept,
            size * float(worst),
            size * float(own),
            size * spare,
            "mm",
            self._pose(poses),
            proven,
        )
        ratio = self.terms.ratio
        if math.isfinite(ratio):
            own_ratios = found.ranges[:, 1] / np.maximum(found.ranges[:, 0], 1e-300)
            used_ratios = used[:, 1] / used[:, 0]
            leg = int(used_ratios.argmax())
            value = float(used_ratios[leg])
            is_proven = proven and bool((own_ratios <= ratio * (1.0 + 1e-5)).all())
            pose = self._pose(found.limit_poses.at(slice(leg, leg + 1)))
            yield _at_most(f"ratio of {LENGTHS[leg]}", value, ratio, "", pose, is_proven)
        longest = self.terms.requirement.legs.longest_mm
        if longest is not None:
            leg = int(used[:, 1].argmax())
            value = size * float(used[leg, 1])
            pose = self._pose(found.limit_poses.at(slice(leg, leg + 1)))
            yield _at_most(f"longest leg ({LENGTHS[leg]})", value, longest, "mm", pose, proven)

    def _worst_limit(self, kind: str) -> _Worst:
        found = self.found
        rows = [i for i, name in enumerate(self.limits) if name.startswith(kind)]
        row = max(rows, key=lambda i: found.missed_limits[i])
        poses = found.limit_poses.at(slice(row, row + 1))
        proven = bool(found.limits[rows].all())
        return _Worst(float(found.missed_limits[row]), self.limits[row], poses, proven)

    def _worst_demand(self, kind: str) -> _Worst:
        found = self.found
        rows = [i for i, name in enumerate(self.names) if name.startswith(kind)]
        proven = bool(found.demands[rows].all())
        missed, poses = found.missed_demands, found.demand_poses
        row = max(rows, key=lambda i: missed[i])
        margins = [i for i, name in enumerate(self.limits) if name.startswith("margin")]
        closest = max(margins, key=lambda i: found.missed_limits[i])
        if kind in UNBOUNDED and found.missed_limits[closest] >= self.terms.margin:
            # The box is on both sides of a singular plane.
            at = found.limit_poses.at(slice(closest, closest + 1))
            most = self.terms.transmission if kind == "transmission" else math.inf
            return _Worst(most, self.names[row].split(maxsplit=1)[-1], at, False)
        name = self.names[row].split(maxsplit=1)[-1]
        if kind == "clearance":
            name = pair_name(PAIRS[row])
        return _Worst(float(missed[row]), name, poses.at(slice(row, row + 1)), proven)

    def _row(
        self, worst: _Worst, limit: float, unit: str, name: str, side: float, factor: float
    ) -> DemandCheck:
        """Return a demand from the amount by which it is missed, times a factor in its unit."""
        missed = factor * worst.missed
        kept = worst.missed <= 1e-6
        remark = "" if worst.proven or not kept else f"no violation in {SAMPLES} poses"
        return DemandCheck(
            name,
            kept,
            limit + side * missed,
            limit,
            -missed,
            unit,
            self._pose(worst.poses),
            worst.proven and kept,
            remark,
        )

    def _swing(self) -> DemandCheck:
        terms, found = self.terms, self.found
        rows = [i for i, name in enumerate(self.limits) if name.startswith("swing")]
        poses = found.limit_poses.at(rows)
        at, home = terms.values(self.x, poses), terms.values(self.x, m.HOME)
        cosines = np.stack(np.broadcast_arrays(*at.swings(home)))
        angles = np.degrees(np.arccos(np.clip(np.diag(cosines), -1.0, 1.0)))
        joint, limit = int(angles.argmax()), math.degrees(terms.swing)
        value = float(angles[joint])
        pose = self._pose(poses.at(slice(joint, joint + 1)))
        return _at_most(
            f"swing at {SWINGS[joint]}", value, limit, "°", pose, bool(found.limits[rows].all())
        )

    def _hull(self, limit: float) -> DemandCheck:
        """Return the check of the box about all joints, over a grid of tilts with its error."""
        terms, step = self.terms, 2.0 * math.pi / 48
        angles = step * np.arange(48)
        tilts = np.linspace(0.0, terms.tilt, 7 if terms.tilt else 1)
        vectors = np.array([(t * math.cos(a), t * math.sin(a)) for t in tilts for a in angles])
        poses = BoxPoses(np.tile(CORNERS, (len(vectors), 1)), np.repeat(vectors, 8, axis=0))
        at = terms.values(self.x, poses)
        arms = float(max(abs(self.x[m.B1X : m.HX]).max(), abs(self.x[m.TX : m.TILT]).max()))
        bend = (tilts[-1] / 6.0) ** 2 + step**2 * (
            math.sin(terms.tilt) + 2.0 - 2.0 * math.cos(terms.tilt)
        )
        error = 0.125 * 4.0 * bend * arms if terms.tilt else 0.0
        axes = [np.stack([end[axis] + 0.0 * at.p[0] for end in at.ends]) for axis in range(3)]
        base = [(0.0, self.x[m.A3X]), (0.0, self.x[m.A3Y]), (0.0, 0.0)]
        edges = [
            max(float(np.max(values)), *fixed) - min(float(np.min(values)), *fixed)
            for values, fixed in zip(axes, base, strict=True)
        ]
        value = terms.scale_mm * max(edges)
        most = value + 2.0 * terms.scale_mm * error
        kept = value <= limit
        return DemandCheck(
            f"outer size along {'xyz'[int(np.argmax(edges))]}",
            kept,
            value,
            limit,
            limit - value,
            "mm",
            None,
            most <= limit,
            "",
        )

    def _move(self, limit: float) -> DemandCheck:
        """Return the check of the time along the diagonals of the box at home's orientation."""
        legs, design = self.terms.requirement.legs, self.design
        speed, change = legs.speed_mm_s or math.inf, legs.acceleration_mm_s2 or math.inf
        if min(speed, change) == math.inf:
            raise InputError("move_s needs legs.speed_mm_s or legs.acceleration_mm_s2")
        home, times = design.home_pose, list[float]()
        offset = tool_offset(home.rotation, design.tool.position)
        for corner in CORNERS[:4]:
            ends = BoxPoses(np.array([corner, -corner]), np.zeros((2, 2)))
            tool, _ = self.terms.tool_at(self.x, ends)
            poses = [Pose.of(each / design.unit_mm - offset, home.rotation) for each in tool]
            law = law_at_speed(
                design, StraightMoves.along(poses), speed / design.unit_mm, change / design.unit_mm
            )
            times.append(law.duration)
        value = max(times)
        kept = value <= limit
        return DemandCheck("time of a move", kept, value, limit, limit - value, "s", None, kept, "")

    def _pose(self, poses: BoxPoses) -> Pose:
        """Return the pose of b4 in design units at a place of the box."""
        tool, rotation = self.terms.tool_at(self.x, poses)
        offset = tool_offset(rotation[0], self.design.tool.position)
        return Pose.of(tool[0] / self.design.unit_mm - offset, rotation[0])
