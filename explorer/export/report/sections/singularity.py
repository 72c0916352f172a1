"""The section on singularities: margins, measures, the nearest poses, performance."""

from __future__ import annotations

from collections.abc import Iterator
from xml.etree.ElementTree import Element

from explorer.export.report.data import ReportData
from explorer.export.report.markup import Cell, Piece, element, number, paragraph, table, whole
from explorer.measures.verdict import verdict
from explorer.mechanism.design import JOINTS
from explorer.mechanism.margins import INCIDENCES, TETRAHEDRA, describe_modes
from explorer.mechanism.pose import yaw_pitch_roll_from_rotation
from explorer.numerics.number_text import format_number
from explorer.singularity.bruhat import describe_stratum
from explorer.singularity.ellipsoids import Ellipsoid


def singularity_section(data: ReportData) -> Iterator[Element]:
    """Yield the section on singularities."""
    snapshot, unit = data.snapshot, data.design.unit_mm
    yield element("h2", "Singularities")
    here = verdict(snapshot)
    if here.kind == "singular":
        names = " and ".join(INCIDENCES[index - 1] for index in here.incidences)
        yield paragraph(f"The pose is singular: {names}.", class_="note")
    else:
        note = None if here.kind == "clear" else "note"
        yield paragraph(f"{here.title}: {here.reason(unit)}.", class_=note)
    yield paragraph(
        "The mechanism is singular exactly where one of three margins is zero: there a "
        "tetrahedron is flat. δ1 and δ3 are distances, δ2 is the mutual moment of two lines, a "
        "distance times a sine. The signs of the three name the assembly mode."
    )
    yield table(
        ("margin", "zero when", "units", "mm", "tetrahedron", "volume, units³"),
        [
            (
                element("b", f"δ{k + 1}"),
                INCIDENCES[k],
                float(snapshot.margins[k]),
                float(snapshot.margins[k]) * unit,
                " ".join(TETRAHEDRA[k]),
                float(snapshot.volumes[k]),
            )
            for k in range(3)
        ],
        align="<<>><>",
        caption=f"Margins in {data.pose_words}",
    )
    yield table(
        (),
        [
            ("determinant of the Jacobian", snapshot.determinant, ""),
            (
                "inverse condition number, with the reach",
                snapshot.inverse_condition,
                "0 singular, 1 best",
            ),
            (
                "smallest singular value σ of J, with the reach",
                snapshot.smallest_singular_value,
                "errors and loads grow at most 1/σ times",
            ),
            ("manipulability |det J|, with the reach", snapshot.manipulability, ""),
            (
                "output transmission index",
                snapshot.transmission_index,
                f"of {JOINTS[snapshot.transmissions.argmin()]}; 0 singular, good above 0.64 to 0.7",
            ),
            ("proximity: smallest |δ| over the reach", snapshot.proximity, ""),
            ("assembly mode", _mode_figure(snapshot.bordering_modes), snapshot.sign_words),
            (
                "stratum of the two flags",
                " ".join(map(str, snapshot.stratum)),
                f"dimension {snapshot.stratum_dimension}: {describe_stratum(snapshot.stratum)}",
            ),
            (
                "ball of positions without a singular one",
                data.ball.radius,
                ("radius in units; ", number(data.ball.radius * unit), " mm"),
            ),
            (
                "all poses nearer than this are regular",
                data.certified,
                ("units, root mean square of b1 to b4; ", number(data.certified * unit), " mm"),
            ),
        ],
        align="<><",
        caption="Measures",
    )
    yield _nearest(data)
    yield element(
        "div",
        _ellipsoid(data.performance.translation, "Speed of b4 per actuator speed"),
        _ellipsoid(data.performance.rotation, "Turning, times the reach"),
        class_="pair",
    )
    yield paragraph(
        "Gains are also the actuator force per force, or per moment over the reach, along the same "
        "direction: where the platform is fast, it is weak.",
        class_="dim",
    )


def _mode_figure(modes: tuple[int, ...]) -> Piece:
    return whole(modes[0]) if len(modes) == 1 else describe_modes(modes)


def _nearest(data: ReportData) -> Element:
    unit = data.design.unit_mm
    rows: list[tuple[Cell, ...]] = []
    for nearest in data.snapshot.nearest:
        angles = yaw_pitch_roll_from_rotation(nearest.pose.rotation).tolist()
        rows.append(
            (
                element("b", f"δ{nearest.incidence} = 0"),
                nearest.distance,
                nearest.distance * unit,
                *(number(value, 5) for value in nearest.pose.position),
                *((number(value, 5), "°") for value in angles),
            )
        )
    return table(
        ("nearest with", "units", "mm", "x", "y", "z", "yaw", "pitch", "roll"),
        rows,
        align="<>>>>>>>>",
        caption="Nearest singular poses, by the root-mean-square displacement of b1 to b4 "
        "(Nawratil’s metric)",
    )


def _ellipsoid(ellipsoid: Ellipsoid, caption: str) -> Element:
    rows: list[tuple[Cell, ...]] = [
        (
            format_number(index, 1),
            float(gain),
            ", ".join(f"{x:z.3f}".replace("-", "−") for x in axis.tolist()),
        )
        for index, (gain, axis) in enumerate(zip(ellipsoid.gain, ellipsoid.axes.T, strict=True), 1)
    ]
    return table(("", "gain", "along (x, y, z)"), rows, align="<>>", caption=caption)
