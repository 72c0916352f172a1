"""The section on the workspace: pictures, slices, volumes, and the limits that bound it."""

from __future__ import annotations

from collections.abc import Iterator
from xml.etree.ElementTree import Element

import numpy as np

from explorer.export.report.data import Missing, ReportData
from explorer.export.report.drawings.slice_drawing import legend, slice_strip, slices_through
from explorer.export.report.drawings.slices import Slices
from explorer.export.report.drawings.workspace_drawing import workspace_views
from explorer.export.report.markup import (
    Cell,
    element,
    format_number,
    illustration,
    number,
    paragraph,
    table,
    whole,
)
from explorer.export.report.sections.mechanism import pose_words
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
        f"{pose_words(data)}. The volume is integrated from exact slices and exact to rounding; ",
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
    yield from _accessible(data)
    tables = [
        _extent(data),
        _bounding(solid) if isinstance(solid, Solid) and not solid.is_empty else None,
    ]
    yield element(
        "div",
        element("div", *tables),
        _gradient(data) if data.volume.gradient else None,
        class_="pair",
    )


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
    if all(area is not None for _, area in areas):
        unit = snapshot.design.unit_mm
        yield table(
            ("slice at", *(f"x = {format_number(x, 4)}" for x, _ in areas)),
            [
                ("area, units²", *(number(area or 0.0, 5) for _, area in areas)),
                ("area, cm²", *(number((area or 0.0) * (0.1 * unit) ** 2, 5) for _, area in areas)),
            ],
            align="<" + ">" * len(areas),
        )


def _volumes(data: ReportData) -> Element:
    centimetres = (0.1 * data.design.unit_mm) ** 3
    rows: list[tuple[Cell, ...]] = []

    def add(name: str, volume: float, *remark: Cell) -> None:
        rows.append((name, volume, volume * centimetres, *(remark or ("",))))

    exact = "exact" if data.volume.error <= 1e-6 * data.volume.volume else "to four digits"
    add("exact volume", data.volume.volume, exact)
    if isinstance(data.nodes, Missing):
        rows.append(("node volume", "–", "–", data.nodes.reason))
    else:
        nodes = data.nodes
        remark = (whole(nodes.count), " nodes at multiples of ", number(nodes.step), " units")
        add("node volume", nodes.volume, remark)
    if isinstance(data.hull_volume, Missing):
        rows.append(("convex hull", "–", "–", data.hull_volume.reason))
    else:
        add("convex hull", data.hull_volume, "of the mesh")
    reachable = data.reachable
    if reachable is not None and not isinstance(reachable, Missing):
        remark = ("without a collision of legs",)
        of, within = reachable.reachable_node_count, reachable.node_count
        if of is not None and within is not None:
            remark = (*remark, "; ", whole(of), " of ", whole(within), " nodes")
        add("accessible", reachable.reachable_volume, remark)
    return table(("volume", "units³", "cm³", ""), rows, align="<>><", caption="Volumes")


def _extent(data: ReportData) -> Element | None:
    if isinstance(data.nodes, Missing) or data.nodes.extent is None:
        return None
    unit, (lows, highs) = data.design.unit_mm, data.nodes.extent
    extents: list[tuple[Cell, ...]] = [
        (
            axis,
            (number(low), " to ", number(high)),
            (number(low * unit), " to ", number(high * unit)),
        )
        for axis, low, high in zip("xyz", lows, highs, strict=True)
    ]
    return table(
        ("axis", "units", "mm"), extents, align="<>>", caption="Extent of the counted nodes"
    )


def _accessible(data: ReportData) -> Iterator[Element]:
    if isinstance(data.reachable, Missing):
        yield paragraph(
            f"The accessible workspace cannot be computed: {data.reachable.reason}.",
            class_="note",
        )


def _bounding(solid: Solid) -> Element:
    corners = solid.vertices[solid.faces]
    size = float(np.ptp(solid.vertices, axis=0).max())
    sides = (corners[:, 1:] - corners[:, :1]) / size
    areas = np.linalg.norm(np.cross(sides[:, 0], sides[:, 1]), axis=1)
    shares = np.bincount(solid.limit_of_face, areas, len(solid.limits)) / areas.sum()
    rows: list[tuple[Cell, ...]] = [
        (name, (number(100.0 * share, 3), " %"))
        for share, name in sorted(zip(shares.tolist(), solid.limits, strict=True), reverse=True)
        if share > 0.0
    ]
    return table(
        ("bounded by", "share of the surface"), rows, align="<>", caption="Limits that bound it"
    )


def _gradient(data: ReportData) -> Element:
    rows: list[tuple[Cell, ...]] = [(name, rate) for name, rate in data.volume.gradient.items()]
    return table(
        ("with", "units³ per unit; yaw per radian"),
        rows,
        align="<>",
        caption="Gradient of the volume",
    )
