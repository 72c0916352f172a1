"""The section on the workspace: pictures, slices, volumes, and the limits that bound it."""

from __future__ import annotations

from collections.abc import Iterator
from xml.etree.ElementTree import Element

import numpy as np

from explorer.export.drawings.markup import (
    Cell,
    Piece,
    Row,
    element,
    ends,
    illustration,
    number,
    paragraph,
    table,
    whole,
)
from explorer.export.drawings.slice_drawing import legend, slice_strip, slices_through
from explorer.export.drawings.slices import Slices
from explorer.export.drawings.workspace_drawing import workspace_views
from explorer.export.report.data import Missing, ReportData, compute
from explorer.measures.catalogue import CATALOGUE
from explorer.numerics.number_text import format_number
from explorer.workspace.solids.booleans import convex_hull
from explorer.workspace.solids.solid import Solid


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
    yield paragraph(
        "All positions of b4 within the limits, at the orientation of ",
        f"{data.pose_words}. The volume is integrated from exact slices and exact to rounding; ",
        "the node volume is counted as in the paper: grid nodes, boundary included, times step³.",
    )
    solid = data.solid
    if isinstance(solid, Missing):
        yield paragraph(f"There is no picture of it: {solid.reason}", class_="note")
    elif solid.is_empty:
        yield paragraph("It is too thin to be drawn.", class_="note")
    else:
        yield from _pictures(data, solid)
    yield _volumes(data)
    if isinstance(data.accessible, Missing):
        reason = data.accessible.reason
        yield paragraph(f"The accessible workspace cannot be computed: {reason}.", class_="note")
    bounding = _bounding(solid) if isinstance(solid, Solid) and not solid.is_empty else None
    gradient = _gradient(data) if data.volume.gradient else None
    yield element("div", element("div", _extent(data), bounding), gradient, class_="pair")


def _pictures(data: ReportData, solid: Solid) -> Iterator[Element]:
    extent = solid.vertices.min(axis=0), solid.vertices.max(axis=0)
    slices = Slices.of(data.design, data.snapshot.rotation, extent)
    snapshot = data.snapshot
    level = format_number(snapshot.pose.position[1], 4)
    yield illustration(
        workspace_views(snapshot, solid, slices),
        "The workspace about the mechanism: whole, and cut open at "
        f"y = {level} with the map of the cut, in the colours of the next figure.",
    )
    yield illustration(
        element(
            "div",
            slices_through(slices, snapshot.pose.position),
            legend(slices, snapshot.design.unit_mm),
        ),
        "Slices through b4 (the cross), axes in design units, coloured by the smallest "
        "of the three margins. ",
        "Outlines are exact arcs and lines; bands are exact too, since margins are linear "
        "in the position."
        if slices.are_exact
        else "Limits on swings bound it, so the outlines are those of a fine grid.",
        " Beyond the bands, thin lines mark every ",
        number(slices.contour_step),
        " units of it.",
    )
    drawn, areas = slice_strip(slices, "x")
    yield illustration(drawn, "Slices along the guide, at one scale, in the same colours.")
    known = [area for _, area in areas if area is not None]
    if len(known) == len(areas):
        square = (0.1 * data.unit_mm) ** 2
        heads = ("slice at", *(f"x = {format_number(x, 4)}" for x, _ in areas))
        rows = [
            ("area, units²", *(number(area, 5) for area in known)),
            ("area, cm²", *(number(area * square, 5) for area in known)),
        ]
        yield table(heads, rows, align="<" + ">" * len(areas))


def _volumes(data: ReportData) -> Element:
    nodes, solid, accessible = data.nodes, data.solid, data.accessible
    hull = solid if isinstance(solid, Missing) else compute(lambda: convex_hull(solid).volume)
    remarks: dict[str, Cell] = {}
    is_exact = data.volume.error <= 1e-6 * data.volume.volume
    remarks["volume"] = "exact" if is_exact else "to four digits"
    if not isinstance(nodes, Missing):
        steps = (" nodes at multiples of ", number(nodes.step), " units")
        remarks["node_volume"] = (whole(nodes.count), *steps)
    rows: list[Row] = []

    def add(name: str, volume: float | None, remark: Cell) -> None:
        cells = ("–", "–") if volume is None else (volume, volume * (0.1 * data.unit_mm) ** 3)
        rows.append((name, *cells, remark))

    for name, value in data.measured.values.items():
        measure = CATALOGUE[name]
        if measure.power == CATALOGUE["volume"].power:
            remark = remarks.get(name) or measure.reason(data.case)
            add(measure.heading, value, remark)
    if isinstance(hull, Missing):
        add("convex hull", None, hull.reason)
    else:
        add("convex hull", hull, "of the mesh")
    if accessible is not None and not isinstance(accessible, Missing):
        count, within = accessible.accessible_node_count, accessible.node_count
        share: tuple[Piece, ...] = ()
        if count is not None and within is not None:
            share = ("; ", whole(count), " of ", whole(within), " nodes")
        name = CATALOGUE["accessible_volume"].heading
        add(name, accessible.accessible_volume, ("without a collision of legs", *share))
    return table(("volume", "units³", "cm³", ""), rows, align="<>><", caption="Volumes")


def _extent(data: ReportData) -> Element | None:
    if isinstance(data.nodes, Missing) or data.nodes.extent is None:
        return None
    rows = [
        (axis, ends(low, high), ends(low * data.unit_mm, high * data.unit_mm))
        for axis, low, high in zip("xyz", *data.nodes.extent, strict=True)
    ]
    return table(("axis", "units", "mm"), rows, align="<>>", caption="Extent of the counted nodes")


def _bounding(solid: Solid) -> Element:
    corners = solid.vertices[solid.faces]
    size = float(np.ptp(solid.vertices, axis=0).max())
    sides = (corners[:, 1:] - corners[:, :1]) / size
    areas = np.linalg.norm(np.cross(sides[:, 0], sides[:, 1]), axis=1)
    shares = np.bincount(solid.limit_of_face, areas, len(solid.limits)) / areas.sum()
    rows = [
        (name, (number(100.0 * share, 3), " %"))
        for share, name in sorted(zip(shares.tolist(), solid.limits, strict=True), reverse=True)
        if share > 0.0
    ]
    heads = ("bounded by", "share of the surface")
    return table(heads, rows, align="<>", caption="Limits that bound it")


def _gradient(data: ReportData) -> Element:
    heads = ("with", "units³ per unit; yaw per radian")
    rows = [*data.volume.gradient.items()]
    return table(heads, rows, align="<>", caption="Gradient of the volume")
