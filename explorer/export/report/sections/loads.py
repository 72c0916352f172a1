"""The section on loads: the machine, what holds the payload in the pose, and where it is held."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from typing import NamedTuple
from xml.etree.ElementTree import Element

import numpy as np

from explorer.export.report.data import Missing, ReportData
from explorer.export.report.drawings.slice_drawing import legend, slices_through
from explorer.export.report.drawings.slices import Slices
from explorer.export.report.loads import ReportLoads
from explorer.export.report.markup import (
    Cell,
    Row,
    element,
    illustration,
    number,
    numbers,
    paragraph,
    percentage,
    range_of,
    table,
    vector,
)
from explorer.mechanism.design import JOINTS
from explorer.mechanism.machine import Tool
from explorer.mechanism.pose import Pose, Triple, yaw_pitch_roll_from_rotation
from explorer.numerics.arrays import FloatArray
from explorer.singularity.colours import WARN_SHARE
from explorer.statics.reactions import PART_NAMES
from explorer.workspace.held import HeldWorkspace
from explorer.workspace.position_bands import position_bands
from explorer.workspace.solids.solid import Solid

# Digits of forces and moments.
_MANY = 4


def loads_section(data: ReportData) -> Iterator[Element]:
    """Yield the section on loads; nothing without a tool, a payload and limits of forces."""
    loads = data.loads
    if loads is None:
        return
    yield element("h2", "Loads")
    yield paragraph(
        "What the platform carries, what its machine can bear, and what holds the payload: its "
        "weight, and the force at the tool in its worst direction. Platform and legs count as "
        "weightless, and nothing has friction.",
    )
    yield element("div", _carried(data), _limits(data), class_="pair")
    case = data.case
    if not loads.loaded.is_regular:
        yield paragraph("The pose is singular: no finite forces hold a load in it.", class_="note")
    elif case.is_loaded or case.is_limited:
        yield from _in_the_pose(data, loads)
    if data.held is not None and data.volume.volume > 0.0:
        yield from _over_the_workspace(data, data.held)


def _carried(data: ReportData) -> Element:
    design, unit = data.design, data.unit_mm
    rows = _point("tool point", design.tool.position, unit)
    if design.tool.quaternion != Tool().quaternion:
        rotation = Pose((0.0, 0.0, 0.0), design.tool.quaternion).rotation
        angles = yaw_pitch_roll_from_rotation(rotation).tolist()
        for name, angle in zip(("yaw", "pitch", "roll"), angles, strict=True):
            rows.append((f"{name} of the tool", (number(angle), "°"), ""))
    payload = design.payload
    rows.append(("mass of the payload", _amount(payload.mass_kg, "kg"), ""))
    if payload.mass_kg:
        rows += _point("payload’s centre", payload.centre, unit)
    rows.append(("force at the tool, any direction", _amount(payload.force_n, "N"), ""))
    rows.append(("gravity, along x, y, z of the base", vector(design.gravity), ""))
    return table(
        ("", "units", "mm"),
        rows,
        align="<>>",
        caption="Tool and payload, from b4 in the platform’s axes",
    )


def _point(name: str, point: Triple, unit_mm: float) -> list[Row]:
    return [
        (f"{axis} of the {name}", value, value * unit_mm)
        for axis, value in zip("xyz", point, strict=True)
    ]


def _limits(data: ReportData) -> Element:
    actuators, struts, guide = data.design.actuators, data.design.struts, data.design.guide
    rows: list[Row] = []
    for name, six in (
        ("push of an actuator, at most", actuators.push_n),
        ("pull of an actuator, at most", actuators.pull_n or actuators.push_n),
    ):
        rows.append((name, "no limit" if six is None else range_of(six, "N")))
    if struts.outer_mm is not None:
        rows.append(("outer diameter of the struts", _amount(struts.outer_mm, "mm")))
        rows.append(("inner diameter of the struts", _amount(struts.inner_mm, "mm")))
    if struts.stress_mpa is not None:
        rows.append(("stress of the struts, at most", _amount(struts.stress_mpa, "MPa")))
    rows.append(("bending of a strut, at most", _limit(struts.largest_moment, "N m")))
    rows.append(("force across the guide, at most", _limit(guide.force_n, "N")))
    rows.append(("moment on the guide, at most", _limit(guide.moment_nm, "N m")))
    return table((), rows, align="<>", caption="Actuators, struts, and the guide at each carriage")


class _Part(NamedTuple):
    """A row of a table of loaded parts, its limits to either side in the unit of its value."""

    name: Cell
    weight: float
    force: float
    limits: Sequence[float]
    share: float


def _in_the_pose(data: ReportData, loads: ReportLoads) -> Iterator[Element]:
    if data.case.is_loaded and data.case.is_limited:
        yield _verdict(data, loads)
    heads = ("actuator", "push at most, N", "pull at most, N")
    caption = f"Forces of the actuators in {data.pose_words}; positive ones push the joint’s value"
    yield _parts(data, heads, _actuators(loads), f"{caption} up", ", N")
    caption = f"Struts and guide in {data.pose_words}"
    yield _parts(data, ("part", "at most"), _struts_and_guide(loads), caption, "")
    if data.case.is_limited:
        yield _most(data, loads)


def _actuators(loads: ReportLoads) -> list[_Part]:
    held, (push, pull) = loads.loaded.held, loads.case.design.actuators.limits
    return [
        _Part(
            element("b", joint),
            float(held.actuators[k]),
            float(held.spread[k]),
            (float(push[k]), float(pull[k])),
            float(loads.loaded.shares[k]),
        )
        for k, joint in enumerate(JOINTS)
    ]


def _struts_and_guide(loads: ReportLoads) -> list[_Part]:
    held, design = loads.loaded.held, loads.case.design
    metres, guide = 1e-3 * design.unit_mm, design.guide
    force = math.inf if guide.force_n is None else guide.force_n
    moment = math.inf if guide.moment_nm is None else guide.moment_nm
    parts: list[_Part] = []
    # Each of the three takes two places in the order of `LIMITED`.
    for start, name, factor, values, limit in (
        (6, "bending of strut {}, N m", metres, held.bending, design.struts.largest_moment),
        (8, "force of carriage {} across the guide, N", 1.0, held.guide_force, force),
        (10, "moment of carriage {} on the guide, N m", metres, held.guide_moment, moment),
    ):
        for k, leg in enumerate((2, 3)):
            spread, share = float(held.spread[start + k]), float(loads.loaded.shares[start + k])
            value = factor * float(values[k])
            parts.append(_Part(name.format(leg), value, factor * spread, (limit,), share))
    return parts


def _verdict(data: ReportData, loads: ReportLoads) -> Element:
    share, part, pose = loads.loaded.share, PART_NAMES[loads.loaded.worst], data.pose_words
    if share > 1.0:
        words = f"The payload is not held in {pose}: {part} needs "
        return paragraph(words, percentage(share), " of its limit.", class_="note")
    words = f"The payload is held in {pose}. The largest share of a limit is that of {part}: "
    return paragraph(words, percentage(share), ".")


def _parts(
    data: ReportData, heads: tuple[str, ...], parts: Sequence[_Part], caption: str, of_unit: str
) -> Element:
    """Return a table of loaded parts, with columns for what the design has: loads and limits."""
    payload = data.design.payload
    name, *limits = heads
    columns: list[tuple[str, Sequence[Cell]]] = [(name, [part.name for part in parts])]
    if payload.mass_kg:
        columns.append((f"by the weight{of_unit}", numbers([part.weight for part in parts])))
    if payload.force_n:
        columns.append((f"by the force, ±{of_unit}", numbers([part.force for part in parts])))
    if data.case.is_limited:
        for side, head in enumerate(limits):
            columns.append((head, [_limit(part.limits[side], "") for part in parts]))
        if data.case.is_loaded:
            columns.append(("share of its limit", [_share_cell(part) for part in parts]))
    rows = list(zip(*(cells for _, cells in columns), strict=True))
    align = "<" + ">" * (len(columns) - 1)
    return table([head for head, _ in columns], rows, align=align, caption=caption)


def _share_cell(part: _Part) -> Cell:
    return percentage(part.share) if any(map(math.isfinite, part.limits)) else "–"


def _most(data: ReportData, loads: ReportLoads) -> Element:
    loaded, force = loads.loaded, data.design.payload.force_n
    newton, besides = loaded.newton, " besides its force" if force else ""
    rows: list[Row] = [
        ("payload", _limit(loaded.largest_payload, "kg"), f"mass at the payload’s centre{besides}"),
        (
            "force in every direction",
            _limit(1.0 / newton.share if newton.share else math.inf, "N"),
            "at the tool, held by all parts, without a payload",
        ),
    ]
    if newton.share and np.isfinite(newton.direction).all():
        direction = vector(newton.direction.tolist())
        remark = f"where {PART_NAMES[newton.part]} gives way first"
        rows.append(("its worst direction", direction, remark))
    worst = loads.worst_payload_force
    if force and np.isfinite(worst.direction).all():
        direction = vector(worst.direction.tolist())
        remark = f"with the weight; {PART_NAMES[worst.part]} needs ", percentage(worst.share)
        rows.append(
            ("worst direction of the payload’s force", direction, (*remark, " of its limit"))
        )
    return table((), rows, align="<><", caption=f"Most that is held in {data.pose_words}")


def _over_the_workspace(data: ReportData, held: HeldWorkspace | Missing) -> Iterator[Element]:
    yield element("h3", "Where the payload is held")
    if isinstance(held, Missing):
        yield paragraph(
            f"The volume that holds it cannot be computed: {held.reason}.", class_="note"
        )
    else:
        yield _volumes(data, held)
        if held.best is not None and held.factor is not None:
            yield _best(held.best, held.factor)
    if isinstance(data.solid, Solid) and not data.solid.is_empty:
        yield _slices(data, data.solid)
    yield paragraph(
        "Towards a singular plane every force and every share grows without bound, so that no "
        "machine holds the payload up to it. Positions beyond one, where a margin has another sign "
        "than at home, do not count as held, whatever their shares: nothing holds the payload on "
        "the way."
    )


def _volumes(data: ReportData, held: HeldWorkspace) -> Element:
    cubic, whole = (0.1 * data.unit_mm) ** 3, data.volume.volume
    rows: list[Row] = [
        (name, volume, volume * cubic, percentage(volume / whole), remark)
        for name, volume, remark in (
            ("whole workspace", whole, ""),
            ("holds the payload", held.held_volume, "of a mesh, to half a per cent"),
        )
    ]
    heads = ("volume", "units³", "cm³", "share", "")
    return table(heads, rows, align="<>>><")


def _best(position: FloatArray, factor: float) -> Element:
    """Return the words for the position of an empty solid that holds most of the payload."""
    at = ("(", *vector(position.tolist()), ")")
    if factor > 1.0:
        words = "The positions that hold the payload are too few for a solid. The best is "
        return paragraph(words, *at, ".", class_="note")
    words = "No position of the workspace holds the payload. The best one found, "
    of_it = percentage(factor), " of its weight and force."
    return paragraph(words, *at, ", holds ", *of_it, class_="note")


def _slices(data: ReportData, solid: Solid) -> Element:
    design, rotation = data.design, data.snapshot.rotation
    warn_below = WARN_SHARE * design.reach
    bands = position_bands(design, rotation, "share", warn_below=warn_below)
    extent = solid.vertices.min(axis=0), solid.vertices.max(axis=0)
    slices = Slices.of(design, rotation, extent, bands)
    maps = slices_through(slices, data.snapshot.pose.position, "load")
    return illustration(
        element("div", maps, legend(slices, data.unit_mm)),
        "Slices through b4 (the cross), axes in design units, coloured by the largest share of a "
        "limit that the payload uses; it is held where that is at most 100 %.",
    )


def _amount(value: float, unit: str) -> Cell:
    return (_figure(value), f" {unit}") if value else "none"


def _limit(value: float | None, unit: str) -> Cell:
    if value is None or math.isinf(value):
        return "no limit"
    return (_figure(value), f" {unit}") if unit else _figure(value)


def _figure(value: float) -> Element:
    return number(value, _MANY)
