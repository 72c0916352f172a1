"""The forces that hold a load in a pose, utilisations of the limits, and the most that is held."""

from __future__ import annotations

import math
from collections.abc import Iterator

import numpy as np

from explorer.measures.blocks import block
from explorer.mechanism.configuration import tool_position
from explorer.mechanism.design import JOINTS
from explorer.mechanism.pose import Pose, Triple
from explorer.numerics.arrays import FloatArray
from explorer.numerics.number_text import drop_rounding
from explorer.statics.forces import WorstDirection
from explorer.statics.loaded import LoadedPose, WorstForce
from explorer.statics.reactions import PART_NAMES, has_limits, limited_parts


def utilisations(loaded: LoadedPose) -> list[float | None]:
    """Return the utilisations of the limits in the order of `PART_NAMES`; None without a limit."""
    pairs = zip(loaded.shares.tolist(), limited_parts(loaded.design).tolist(), strict=True)
    return [share if is_limited else None for share, is_limited in pairs]


def verdict(loaded: LoadedPose, load: str = "load") -> block.Statement:
    """Return whether a load, such as a "payload", is held, and the part nearest to its limit."""
    if not loaded.is_regular:
        return block.Statement("Singular pose", f"The {in_singular_pose(loaded, load)}.", "beyond")
    if not has_limits(loaded.design):
        words = "Shares need limits of the actuators, the struts or the guide."
        return block.Statement("No limits are given", words)
    utilisation, part = loaded.share, PART_NAMES[loaded.worst]
    if utilisation > 1.0:
        words = part.capitalize(), " needs ", block.Share(utilisation), " of its limit"
        return block.Statement(f"Does not hold the {load}", words, "beyond")
    look = block.Share(utilisation).look
    near = ", close to a limit" if look == "close" else ""
    words = "Largest share of a limit: ", part, ", ", block.Share(utilisation)
    return block.Statement(f"Holds the {load}{near}", words, look)


def in_singular_pose(loaded: LoadedPose, load: str = "load") -> str:
    """Return the effect of a load on a singular pose, which no unique forces hold, in words."""
    work, held = "no work", "it is held, but by no unique forces"
    if loaded.moves_platform:
        work, held = "work", "no forces hold it"
    return f"{load} does {work} in a motion that locked actuators leave free: {held}"


def reaction_tables(loaded: LoadedPose) -> Iterator[block.Block]:
    """Yield the forces of the actuators, and the loads of struts and guide, beside their limits.

    There are none in a singular pose.
    """
    if not loaded.is_regular:
        return
    result, design = loaded.reactions, loaded.design
    spread = np.where(np.isfinite(result.spread), result.spread, 0.0)
    push, pull = (side.tolist() for side in design.actuators.limits)
    values = result.actuators.tolist()
    size = max((abs(value) for value in values if math.isfinite(value)), default=0.0)
    used, is_limited = utilisations(loaded), has_limits(design)
    if force := design.payload.force_n:
        words = "The payload's force of ", block.Number(force, " N"), " acts too, in any direction."
        yield block.Statement("", words)
    yield block.Table(
        "Forces of the actuators",
        (
            block.Names("actuator", JOINTS),
            block.Column("force", values, " N", size=_size(result.actuators, spread[:6])),
            *_process(loaded, spread[:6], " N"),
            block.Names("sense", [_sense(drop_rounding(value, size)) for value in values]),
            *(
                block.Column(head, limits, " N", infinite="no limit", wide=True)
                for head, limits in (("push at most", push), ("pull at most", pull))
                if is_limited
            ),
            *((block.Shares("of its limit", used[:6]),) if is_limited else ()),
        ),
        "A positive force pushes the value of its joint up.",
    )
    metres = np.repeat([1e-3 * design.unit_mm, 1.0, 1e-3 * design.unit_mm], 2)
    loads = metres * np.concatenate([result.bending, result.guide_force, result.guide_moment])
    guide = design.guide
    limits = [
        math.inf if limit is None else limit
        for limit in (design.struts.largest_moment, guide.force_n, guide.moment_nm)
        for _ in (2, 3)
    ]
    units = " N m", " N m", " N", " N", " N m", " N m"
    yield block.Table(
        "Struts and guide",
        (
            block.Names("part", PART_NAMES[6:]),
            block.Column("load", loads.tolist(), units, size=_size(loads, metres * spread[6:])),
            *_process(loaded, metres * spread[6:], units),
            *(
                (
                    block.Column("at most", limits, units, infinite="no limit", wide=True),
                    block.Shares("of its limit", used[6:]),
                )
                if is_limited
                else ()
            ),
        ),
        "The bending moment of a strut at its carriage, and the force and the moment of the "
        "carriage on the guide, across it.",
    )


def _size(values: FloatArray, spread: FloatArray) -> float:
    return float(np.abs(values[np.isfinite(values)]).max(initial=0.0)) + float(spread.max())


def _process(
    loaded: LoadedPose, spread: FloatArray, unit: str | tuple[str, ...]
) -> tuple[block.Column, ...]:
    """Return the column of what the payload's force of any direction adds; none without one."""
    if not loaded.design.payload.force_n:
        return ()
    return (block.Column("payload's force", spread.tolist(), unit, 3, before="± "),)


def _sense(force: float) -> str:
    return "" if not math.isfinite(force) or force == 0.0 else "pushes" if force > 0.0 else "pulls"


def largest_loads(loaded: LoadedPose) -> block.Facts:
    """Return the largest payload, and the largest force in every direction."""
    payload, unit = loaded.largest_payload, loaded.unit_force
    largest = block.Fact(
        "payload",
        (block.Number(payload, " kg"),) if math.isfinite(payload) else "no limit",
        hint="Largest mass at the centre of the payload, besides the load, that keeps all limits",
    )
    hint = (
        "Largest force at the tool, alone, that all parts hold in every direction, and the part "
        "that gives way first"
    )
    force = _largest_force(unit.utilisation, unit.direction, PART_NAMES[unit.part], hint)
    return block.Facts("Most that is held here", (largest, *force))


def most_of_actuators(worst: WorstDirection) -> block.Facts:
    """Return the largest force in every direction that the actuators alone hold."""
    part = f"actuator {JOINTS[int(worst.actuator)]}"
    facts = (*_largest_force(float(worst.utilisation), worst.direction, part),)
    return block.Facts("Most that the actuators hold", facts)


def _largest_force(
    share: float, along: FloatArray, part: str, hint: str = ""
) -> Iterator[block.Fact]:
    """Yield the largest force in every direction, given the worst direction of one newton."""
    name = "force in every direction"
    if not share:
        yield block.Fact(name, "no limit", hint=hint)
        return
    yield block.Fact(name, (block.Number(1.0 / share, " N"),), f"limited by {part}", hint)
    if np.isfinite(along).all():
        yield block.Fact("its worst direction", _along(along), wide=True)


def worst_force(worst: WorstForce, force: str) -> Iterator[block.Fact]:
    """Yield the worst direction of a force in words, such as "this force".

    There is none in a singular pose or without limits.
    """
    if np.isfinite(worst.direction).all():
        remark = f"{PART_NAMES[worst.part]} at ", block.Share(worst.utilisation)
        yield block.Fact(f"worst direction of {force}", _along(worst.direction), remark, act="turn")


def nearest_carrying(
    loaded: LoadedPose, nearest: Pose | None, tool: Triple | None
) -> block.Statement:
    """Return where the nearest position is that holds the load of a pose that does not.

    The nearest pose is None if none was found. The position told is that of the tool, a point in
    the platform frame, or of b4 if it is None.
    """
    if nearest is None:
        return block.Statement(
            "", "No position in this orientation and mode was found that holds it."
        )
    unit, reach = loaded.design.unit_mm, loaded.design.reach
    apart = block.Number(
        unit * math.dist(nearest.position, loaded.pose.position), " mm", 3, unit * reach
    )
    there = nearest.position if tool is None else tool_position(nearest, tool)
    point = "b4" if tool is None else "the tool"
    words = "Held ", apart, f" from here, with {point} at ", block.Vector(there, digits=4)
    return block.Statement("", words, act="go")


def _along(direction_: FloatArray) -> block.Words:
    return (block.direction(direction_.tolist()),)
