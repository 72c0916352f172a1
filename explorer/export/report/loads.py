"""The sections on loads and precision: what holds the payload, and how far the tool moves."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import replace
from xml.etree.ElementTree import Element

import msgspec

from explorer.export.drawings.markup import (
    Cell,
    Row,
    element,
    illustration,
    number,
    paragraph,
    percentage,
    range_of,
    table,
    vector,
)
from explorer.export.drawings.slice_drawing import legend, slices_through
from explorer.export.drawings.slices import Slices
from explorer.export.report.blocks import elements
from explorer.export.report.data import Missing, ReportData
from explorer.measures.blocks.block import Block
from explorer.measures.blocks.forces import most_held, reaction_tables, verdict, worst_force
from explorer.measures.blocks.precision import deflections, tool_errors
from explorer.mechanism.machine import Tool
from explorer.mechanism.pose import Pose, Triple, yaw_pitch_roll_from_rotation
from explorer.numerics.arrays import FloatArray
from explorer.singularity.colours import WARN_SHARE
from explorer.statics.loaded import LoadedPose, WorstForce
from explorer.workspace.carried_region import CarriedRegion
from explorer.workspace.position_bands import position_bands
from explorer.workspace.solids.solid import Solid


def loads_section(data: ReportData) -> Iterator[Element]:
    """Yield the section on loads; nothing without a tool, a payload and limits of forces."""
    if not data.has_machine:
        return
    yield element("h2", "Loads")
    yield paragraph(
        "What the platform carries, what its machine can bear, and what holds the payload: its "
        "weight, and the force at the tool in its worst direction. Platform and legs count as "
        f"weightless, and nothing has friction. All values are those in {data.pose_words}.",
    )
    yield element("div", _carried(data), _limits(data), class_="pair")
    yield from elements(_in_the_pose(data))
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
    rows.append(("bending of a strut, at most", _amount(struts.largest_moment, "N m", "no limit")))
    rows.append(("force across the guide, at most", _amount(guide.force_n, "N", "no limit")))
    rows.append(("moment on the guide, at most", _amount(guide.moment_nm, "N m", "no limit")))
    return table((), rows, align="<>", caption="Actuators, struts, and the guide at each carriage")


def _in_the_pose(data: ReportData) -> Iterator[Block]:
    loaded, case = data.loaded, data.case
    if not loaded.is_regular or (case.is_loaded and case.is_limited):
        yield verdict(loaded, "payload")
    if not loaded.is_regular:
        return
    if case.is_loaded:
        yield from reaction_tables(loaded)
    if case.is_limited:
        most = most_held(loaded)
        if data.design.payload.force_n:
            worst = worst_force(worst_payload_force(data), "the payload's force")
            most = replace(most, facts=(*most.facts, *worst))
        yield most


def worst_payload_force(data: ReportData) -> WorstForce:
    """Return the direction of the payload's force that uses the largest share of a limit."""
    payload = msgspec.structs.replace(data.design.payload, force_n=0.0)
    weighed = msgspec.structs.replace(data.design, payload=payload)
    return LoadedPose(weighed, data.case.at).worst_force(data.design.payload.force_n)


def _over_the_workspace(data: ReportData, held: CarriedRegion | Missing) -> Iterator[Element]:
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


def _volumes(data: ReportData, held: CarriedRegion) -> Element:
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


def _amount(value: float | None, unit: str, without: str = "none") -> Cell:
    """Return an amount to four digits; words if it is zero, infinite or not given."""
    return (number(value, 4), f" {unit}") if value and math.isfinite(value) else without


def precision_section(data: ReportData) -> Iterator[Element]:
    """Yield the section on precision; nothing of a design that is exact and rigid."""
    precision = data.precision
    if precision is None:
        return
    yield element("h2", "Precision")
    yield paragraph(
        "How far the tool is from where it should be: by the errors of the actuators and the "
        "tolerances of the dimensions, and because what holds the payload gives way. The model is "
        f"linear, without preload. All values are those in {data.pose_words}."
    )
    yield from elements(tool_errors(precision))
    if data.case.is_elastic:
        yield _stiffness(data)
    payload = data.design.payload
    load = "the payload’s weight" if payload.mass_kg else "no load"
    if payload.force_n:
        weight = f"{load} and " if payload.mass_kg else ""
        load = f"{weight}the payload’s force in its worst direction"
    yield from elements(deflections(precision, load, has_force=True))


def _stiffness(data: ReportData) -> Element:
    design, six = data.design, data.design.actuators.stiffness_n_mm
    rows: list[Row] = [
        ("stiffness of an actuator", "rigid" if six is None else range_of(six, "N/mm"))
    ]
    if design.struts.outer_mm is None:
        rows.append(("struts of legs 2 and 3", "rigid"))
    else:
        # In newton square metres, from square millimetres.
        bending = 1e-6 * design.struts.bending_stiffness
        rows.append(("bending stiffness EI of a strut", (number(bending, 4), " N m²")))
        tube = number(design.struts.outer_mm, 4), " × ", number(design.struts.inner_mm, 4), " mm"
        rows.append(("outer and inner diameter of a strut", tube))
        rows.append(("its Young’s modulus", (number(design.struts.modulus_gpa, 4), " GPa")))
    return table((), rows, align="<>", caption="What gives way")
