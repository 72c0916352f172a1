"""The sections on the workspace, on loads, on a path in time and on precision."""

from __future__ import annotations

import math
from collections.abc import Iterator
from xml.etree.ElementTree import Element

import msgspec
import numpy as np

from explorer.errors import ExplorerError
from explorer.export.drawings import markup
from explorer.export.drawings.drives import force_speed_chart, time_charts
from explorer.export.drawings.markup import Cell, Piece, Row, element, number, paragraph, whole
from explorer.export.drawings.slices import Slices, legend, slices_through
from explorer.export.drawings.workspace_drawing import workspace_views
from explorer.export.report.data import ReportData, compute
from explorer.export.report.mechanism import angle_rows, point_rows
from explorer.export.tables import corners_csv
from explorer.measures.blocks import forces, precision as blocks
from explorer.measures.blocks.block import Block
from explorer.measures.catalogue import CATALOGUE
from explorer.measures.position_bands import position_bands
from explorer.mechanism.machine import Tool
from explorer.mechanism.pose import Pose
from explorer.numerics.arrays import FloatArray
from explorer.numerics.number_text import format_number
from explorer.paths.drives import drive_blocks, drives_along
from explorer.singularity.colours import WARN_SHARE
from explorer.statics.loaded import LoadedPose, WorstForce
from explorer.workspace.carried_region import CarriedRegion
from explorer.workspace.limits.table import bounds_angles
from explorer.workspace.solids.solid import Solid, convex_hull


def workspace_section(data: ReportData) -> Iterator[Element]:
    """Yield the section on the workspace."""
    yield element("h2", "Workspace")
    if data.volume.volume <= 0.0:
        causes = ", ".join(data.volume.empty_because)
        yield paragraph(
            f"The workspace is empty at this orientation because of {causes}: "
            "no position of b4 keeps all limits.",
            class_="note",
        )
        return
    how = "integrated from exact slices and exact to rounding"
    if not data.volume.gradient:
        how = "integrated over columns, since joints bound the swing of legs"
    yield paragraph(
        "All positions of b4 within the limits, at the orientation of ",
        f"{data.pose_words}. The volume is {how}; ",
        "the node volume is counted as in the paper: grid nodes, boundary included, times step³.",
    )
    solid, bounding = data.solid, None
    if isinstance(solid, ExplorerError):
        yield paragraph(f"There is no picture of it: {solid}", class_="note")
    elif solid.is_empty:
        yield paragraph("It is too thin to be drawn.", class_="note")
    else:
        yield from _pictures(data, solid)
        bounding = _bounds(solid)
    yield _volumes(data)
    if isinstance(data.accessible, ExplorerError):
        words = f"The accessible workspace cannot be computed: {data.accessible}."
        yield paragraph(words, class_="note")
    rates, heads = data.volume.gradient, ("with", "units³ per unit; yaw per radian")
    gradient = markup.table(heads, rates.items(), "<>", "Gradient of the volume")
    extent = element("div", _extent(data), bounding)
    yield element("div", extent, gradient if rates else None, class_="pair")


def _pictures(data: ReportData, solid: Solid) -> Iterator[Element]:
    slices, position = Slices.of(data.workspace, solid.ends), data.at.position
    yield markup.illustration(
        workspace_views(data.snapshot, solid, slices),
        "The workspace about the mechanism: whole, and cut open at "
        f"y = {format_number(position[1], 4)} with the map of the cut, in the colours of the next "
        "figure.",
    )
    yield markup.illustration(
        element("div", slices_through(slices, position), legend(slices, data.design.unit_mm)),
        "Slices through b4 (the cross), axes in design units, coloured by the smallest "
        "of the three margins. ",
        "Limits on swings bound it, so the outlines are those of a fine grid."
        if bounds_angles(data.design)
        else "Outlines are exact arcs and lines; bands are exact too, since margins are linear "
        "in the position.",
        " Beyond the bands, thin lines mark every ",
        number(slices.contour_step),
        " units of it.",
    )


def _volumes(data: ReportData) -> Element:
    counted, solid, accessible = data.node_count, data.solid, data.accessible
    is_exact = data.volume.error <= 1e-6 * data.volume.volume
    within = "± ", number(data.volume.error, digits=1), " units³"
    remarks: dict[str, Cell] = {"volume": "exact" if is_exact else within}
    if not isinstance(counted, ExplorerError):
        steps = (" nodes at multiples of ", number(counted.step), " units")
        remarks["node_volume"] = (whole(counted.count), *steps)
    rows: list[Row] = []

    def add(name: str, volume: float | None, remark: Cell) -> None:
        cubic = None if volume is None else volume * (0.1 * data.design.unit_mm) ** 3
        rows.append((name, *("–" if each is None else each for each in (volume, cubic)), remark))

    for name, value in data.measurements.values.items():
        measure = CATALOGUE[name]
        if measure.power == CATALOGUE["volume"].power:
            add(measure.heading, value, remarks.get(name) or measure.reason(data))
    hull = solid if isinstance(solid, ExplorerError) else compute(lambda: convex_hull(solid).volume)
    if isinstance(hull, ExplorerError):
        add("convex hull", None, str(hull))
    else:
        add("convex hull", hull, "of the mesh")
    if accessible is not None and not isinstance(accessible, ExplorerError):
        count, within = accessible.accessible_node_count, accessible.node_count
        share: tuple[Piece, ...] = ("without a collision of legs",)
        if count is not None and within is not None:
            share = (*share, "; ", whole(count), " of ", whole(within), " nodes")
        name = CATALOGUE["accessible_volume"].heading
        add(name, accessible.accessible_volume, share)
    return markup.table(("volume", "units³", "cm³", ""), rows, "<>><", "Volumes")


def _extent(data: ReportData) -> Element | None:
    if isinstance(data.node_count, ExplorerError) or data.node_count.extent is None:
        return None
    rows = [
        (axis, markup.range_of(ends), markup.range_of([end * data.design.unit_mm for end in ends]))
        for axis, *ends in zip("xyz", *data.node_count.extent, strict=True)
    ]
    return markup.table(("axis", "units", "mm"), rows, "<>>", "Extent of the counted nodes")


def _bounds(solid: Solid) -> Element:
    areas = np.bincount(solid.limit_of_face, solid.areas, len(solid.limits))
    shares = areas / solid.areas.sum()
    rows = [
        (name, (number(100.0 * share, 3), " %"))
        for share, name in sorted(zip(shares.tolist(), solid.limits, strict=True), reverse=True)
        if share > 0.0
    ]
    return markup.table(("bounded by", "share of the surface"), rows, "<>", "Limits that bound it")


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
    yield element("div", _payload(data), _limits(data), class_="pair")
    yield from markup.elements(_in_the_pose(data))
    if data.carrying_part is not None and data.volume.volume > 0.0:
        yield from _over_the_workspace(data, data.carrying_part)


def _payload(data: ReportData) -> Element:
    tool, payload = data.design.tool, data.design.payload
    rows = [*point_rows(data, "the tool point", tool.position)]
    if tool.quaternion != Tool().quaternion:
        rows += angle_rows(Pose((0.0, 0.0, 0.0), tool.quaternion).rotation, " of the tool")
    rows.append(("mass of the payload", _amount(payload.mass_kg, "kg"), ""))
    if payload.mass_kg:
        rows += point_rows(data, "the payload’s centre", payload.centre)
    if any(payload.inertia_kg_mm2):
        rows.append(("inertia about it, kg mm²", markup.vector(payload.inertia_kg_mm2), ""))
    rows.append(("force at the tool, any direction", _amount(payload.force_n, "N"), ""))
    rows.append(("gravity, along x, y, z of the base", markup.vector(data.design.gravity), ""))
    caption = "Tool and payload, from b4 in the platform’s axes"
    return markup.table(("", "units", "mm"), rows, "<>>", caption)


def _limits(data: ReportData) -> Element:
    actuators, struts, guide = data.design.actuators, data.design.struts, data.design.guide
    rows: list[Row] = [
        (
            f"{name} of an actuator, at most",
            markup.range_of(six, f" {unit}", 4) if six else "no limit",
        )
        for name, unit, six in (
            ("push", "N", actuators.push_n),
            ("pull", "N", actuators.pull_n or actuators.push_n),
            ("continuous force", "N", actuators.continuous_n),
            ("speed", "mm/s", actuators.speed_mm_s),
            ("acceleration", "mm/s²", actuators.acceleration_mm_s2),
        )
    ]
    if struts.outer_mm is not None:
        rows.append(("outer diameter of the struts", _amount(struts.outer_mm, "mm")))
        rows.append(("inner diameter of the struts", _amount(struts.inner_mm, "mm")))
    if struts.stress_mpa is not None:
        rows.append(("stress of the struts, at most", _amount(struts.stress_mpa, "MPa")))
    rows += [
        ("bending of a strut, at most", _amount(struts.largest_moment, "N m", "no limit")),
        ("force across the guide, at most", _amount(guide.force_n, "N", "no limit")),
        ("moment on the guide, at most", _amount(guide.moment_nm, "N m", "no limit")),
    ]
    return markup.table((), rows, "<>", "Actuators, struts, and the guide at each carriage")


def _in_the_pose(data: ReportData) -> Iterator[Block]:
    loaded = data.loaded_pose
    if not loaded.is_regular or (data.has("is_loaded") and data.has("is_limited")):
        yield forces.verdict(loaded, "payload")
    if not loaded.is_regular:
        return
    if data.has("is_loaded"):
        yield from forces.reaction_tables(loaded)
    if data.has("is_limited"):
        most = forces.largest_loads(loaded)
        if data.design.payload.force_n:
            worst = forces.worst_force(worst_payload_force(data), "the payload's force")
            most = most.add(*worst)
        yield most


def worst_payload_force(data: ReportData) -> WorstForce:
    """Return the direction of the payload's force that uses the largest share of a limit."""
    payload = msgspec.structs.replace(data.design.payload, force_n=0.0)
    weighed = msgspec.structs.replace(data.design, payload=payload)
    return LoadedPose(weighed, data.at).worst_force(data.design.payload.force_n)


def _over_the_workspace(
    data: ReportData, carried: CarriedRegion | ExplorerError
) -> Iterator[Element]:
    yield element("h3", "Where the payload is held")
    if isinstance(carried, ExplorerError):
        yield paragraph(f"The volume that holds it cannot be computed: {carried}.", class_="note")
    else:
        cubic, entire = (0.1 * data.design.unit_mm) ** 3, data.volume.volume
        rows: list[Row] = [
            (name, volume, volume * cubic, markup.percentage(volume / entire), remark)
            for name, volume, remark in (
                ("whole workspace", entire, ""),
                ("holds the payload", carried.held_volume, "of columns, to a thousandth"),
            )
        ]
        yield markup.table(("volume", "units³", "cm³", "share", ""), rows, "<>>><")
        if carried.best is not None and carried.factor is not None:
            yield _best(carried.best, carried.factor)
    if isinstance(data.solid, Solid) and not data.solid.is_empty:
        yield _share_slices(data, data.solid)
    yield paragraph(
        "Towards a singular plane forces and shares grow without bound, unless the payload does no "
        "work in the motion that becomes free there. Positions beyond one, where a margin has "
        "another sign than at home, do not count as held, whatever their shares: on the way no "
        "unique forces hold the payload."
    )


def _best(position: FloatArray, factor: float) -> Element:
    at = ("(", *markup.vector(position.tolist()), ")")
    if factor > 1.0:
        words = "The positions that hold the payload are too few for a solid. The best is "
        return paragraph(words, *at, ".", class_="note")
    words = "No position of the workspace holds the payload. The best one found, "
    of_it = markup.percentage(factor), " of its weight and force."
    return paragraph(words, *at, ", holds ", *of_it, class_="note")


def _share_slices(data: ReportData, solid: Solid) -> Element:
    warn_below = WARN_SHARE * data.design.reach
    bands = position_bands(data.workspace, "share", warn_below=warn_below)
    slices = Slices.of(data.workspace, solid.ends, bands)
    maps = slices_through(slices, data.at.position, "load")
    return markup.illustration(
        element("div", maps, legend(slices, data.design.unit_mm)),
        "Slices through b4 (the cross), axes in design units, coloured by the largest share of a "
        "limit that the payload uses; it is held where that is at most 100 %.",
    )


def _amount(value: float | None, unit: str, without: str = "none") -> Cell:
    """Return an amount to four digits; words if it is zero, infinite or not given."""
    return (number(value, 4), f" {unit}") if value and math.isfinite(value) else without


def path_section(data: ReportData) -> Iterator[Element]:
    """Yield the section on what a path asks of the actuators; nothing without a path."""
    if data.path is None:
        return
    design, path = data.as_filed.design, data.path
    found = compute(lambda: drives_along(design, path))
    yield element("h2", "Drives")
    if isinstance(found, ExplorerError):
        yield paragraph(f"The path has no speeds and forces: {found}.", class_="note")
        return
    yield from markup.elements(drive_blocks(found))
    charts = time_charts(found), force_speed_chart(found)
    yield markup.illustration(
        element("div", *charts, class_="pair"),
        "Speeds, forces and powers of the actuators over time, and force against speed with the "
        f"limits as dotted boxes. The bars of the legs and the platform have {path.density:g} "
        "kg/m³; friction and the rotors of motors are left out.",
    )
    yield paragraph("Corners of the path, a table for the option --path of explorer drives:")
    yield element("pre", corners_csv(path.poses, path.tool))


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
    yield from markup.elements(blocks.tool_errors(precision))
    if data.has("is_elastic"):
        yield _stiffness(data)
    payload = data.design.payload
    load = "the payload’s weight" if payload.mass_kg else "no load"
    if payload.force_n:
        weight = f"{load} and " if payload.mass_kg else ""
        load = f"{weight}the payload’s force in its worst direction"
    yield from markup.elements(blocks.deflections(precision, load, has_force=True))


def _stiffness(data: ReportData) -> Element:
    struts, six = data.design.struts, data.design.actuators.stiffness_n_mm
    actuators = "rigid" if six is None else markup.range_of(six, " N/mm", 4)
    rows: list[Row] = [("stiffness of an actuator", actuators)]
    if struts.outer_mm is None:
        rows.append(("struts of legs 2 and 3", "rigid"))
    else:
        tube = number(struts.outer_mm, 4), " × ", number(struts.inner_mm, 4), " mm"
        rows += [
            # In newton square metres, from square millimetres.
            ("bending stiffness EI of a strut", _amount(1e-6 * struts.bending_stiffness, "N m²")),
            ("outer and inner diameter of a strut", tube),
            ("its Young’s modulus", _amount(struts.modulus_gpa, "GPa")),
        ]
    return markup.table((), rows, "<>", "What gives way")
