"""The report as one HTML page: title block, sections, and the commands that reproduce it."""

from __future__ import annotations

import datetime as dt
import shlex
from collections.abc import Iterator
from importlib import resources
from xml.etree.ElementTree import Element

from explorer import __version__
from explorer.export.report.data import Missing, ReportData
from explorer.export.report.drawings.mechanism import cover_drawing
from explorer.export.report.markup import (
    Piece,
    as_html,
    element,
    format_number,
    illustration,
    number,
    paragraph,
    table,
    whole,
)
from explorer.export.report.sections.legs import legs_section
from explorer.export.report.sections.mechanism import mechanism_section, pose_words
from explorer.export.report.sections.parts import parts_section
from explorer.export.report.sections.search import search_section
from explorer.export.report.sections.singularity import singularity_section
from explorer.export.report.sections.workspace import workspace_section
from explorer.files.versions import versions
from explorer.mechanism.design_file import PRESETS
from explorer.workspace.accessible.workspace import ReachableWorkspace

# The page may fetch nothing.
_POLICY = "default-src 'none'; style-src 'unsafe-inline'; img-src data:"


def report_html(data: ReportData, date: dt.date) -> str:
    """Return the report as HTML that needs no other file and no network.

    Equal data give equal reports, except for the date and the versions of the libraries.

    Args:
        data: Data of the report.
        date: Date of the report.
    """
    title = f"{_name(data)} – design report"
    style = (
        resources.files("explorer.export.report").joinpath("style.css").read_text(encoding="utf-8")
    )
    head = element(
        "head",
        element("meta", charset="utf-8"),
        _meta("viewport", "width=device-width, initial-scale=1"),
        element("meta", http_equiv="Content-Security-Policy", content=_POLICY),
        _meta("generator", f"Flagged 4-4 explorer {__version__}"),
        element("title", title),
        element("style", style),
    )
    body = element("body", element("header", *_title_block(data, date), class_="cover"))
    for section in (mechanism_section, workspace_section, singularity_section, legs_section):
        body.append(element("section", *section(data)))
    body.append(element("section", *parts_section(data)))
    if data.record is not None:
        body.append(element("section", *search_section(data, data.record)))
    body.append(element("section", *_reproduction(data)))
    return f"<!DOCTYPE html>\n{as_html(element('html', head, body, lang='en-GB'))}\n"


def _meta(name: str, content: str) -> Element:
    return element("meta", name=name, content=content)


def _title_block(data: ReportData, date: dt.date) -> Iterator[Element]:
    design = data.design
    yield element("p", "Design report", class_="kind")
    yield element("h1", _name(data))
    yield element("p", "Flagged 4-4 parallel manipulator", class_="subtitle")
    particulars: tuple[tuple[str, Piece], ...] = (
        ("Date", element("time", date.isoformat(), datetime=date.isoformat())),
        ("Made by", f"Flagged 4-4 explorer {__version__}"),
        ("Unit", f"1 unit = {format_number(design.unit_mm)} mm"),
        (
            "Design file, SHA-256",
            element("span", f"{data.design_hash[:16]}…", title=data.design_hash),
        ),
    )
    yield element("dl", *map(_entry, particulars), class_="particulars")
    yield illustration(cover_drawing(data.snapshot), f"The mechanism in {pose_words(data)}.")
    yield element("dl", *map(_entry, _headline(data)), class_="headline")


def _name(data: ReportData) -> str:
    return data.design.name or "untitled"


def _entry(entry: tuple[str, Piece | tuple[Piece, ...]]) -> Element:
    name, value = entry
    pieces = value if isinstance(value, tuple) else (value,)
    return element("div", element("dt", name), element("dd", *pieces))


def _headline(data: ReportData) -> Iterator[tuple[str, tuple[Piece, ...]]]:
    unit = data.design.unit_mm
    yield "Exact volume", (number(data.volume.volume), _unit("units³"))
    if isinstance(data.nodes, Missing):
        yield "Node volume", ("–",)
    else:
        many = element("span", whole(data.nodes.count), " nodes")
        yield "Node volume", (number(data.nodes.volume), _unit("units³, "), many)
    yield "Reach", (number(data.design.reach * unit, 4), _unit("mm"))
    margin = data.snapshot.proximity * data.design.reach
    yield "Smallest margin |δ| here", (number(margin * unit, 4), _unit("mm"))
    yield "Inverse condition here", (number(data.snapshot.inverse_condition, 4), _unit("of 1"))
    clearance = float(data.snapshot.clearances.clearance.min())
    yield "Least clearance of legs here", (number(clearance * unit, 4), _unit("mm"))


def _unit(words: str) -> Element:
    return element("span", f" {words}")


def _reproduction(data: ReportData) -> Iterator[Element]:
    design = data.design
    yield element("h2", "How to reproduce it")
    is_preset = PRESETS.get(design.name) == design
    source = design.name if is_preset else "design.json"
    pose = data.snapshot.pose
    orientation = f" --quaternion {_words(pose.quaternion)}"
    position = f" --position {_words(pose.position)}"
    at = "" if data.is_home else position + orientation
    turned = "" if data.is_home else orientation
    radii = " --interference" if isinstance(data.reachable, ReachableWorkspace) else ""
    record = "" if data.record is None else " --record record.json"
    commands = [
        f"explorer report --design {shlex.quote(source)}{at}{record} --out report.html",
        f"explorer workspace --design {shlex.quote(source)}{turned} --hull{radii}",
        f"explorer singularity --design {shlex.quote(source)}{at}",
        f"explorer interference --design {shlex.quote(source)}{at}",
    ]
    if not isinstance(data.bill, Missing):
        commands.append(
            f"explorer export mechanism --design {shlex.quote(source)} --out mechanism.zip"
        )
    if data.record is not None:
        commands.append("explorer optimise --repeat record.json --out data.json")
    where: tuple[Piece, ...] = ("The design is a preset of the explorer. ",)
    if not is_preset:
        where = ("Save the file below as ", element("code", "design.json"), ". ")
    yield paragraph(*where, "These commands give the same figures:")
    yield element("pre", "\n".join(commands), id="commands")
    if data.record is not None:
        settings = data.record.settings
        yield paragraph(
            "The search is the same each time: seed ",
            whole(settings.seed),
            ", ",
            whole(settings.starts),
            " start" if settings.starts == 1 else " starts",
            " of at most ",
            whole(settings.iterations),
            " iterations. Nothing else here is random.",
        )
    else:
        yield paragraph("Nothing here is random; there is no seed.")
    heads, rows = ("", "this report"), [(name, value) for name, value in versions().items()]
    yield element("h3", "Versions")
    if data.record is None:
        yield table(heads, rows, align="<<")
    else:
        searched = data.record.versions
        names = dict.fromkeys((*versions(), *searched))
        yield table(
            ("", "this report", "the search"),
            [(name, versions().get(name, "–"), searched.get(name, "–")) for name in names],
            align="<<<",
        )
    yield element("h3", "Design file")
    yield paragraph("SHA-256 ", element("code", data.design_hash, id="design-hash"), class_="dim")
    yield element("pre", data.design_file, id="design")


def _words(values: tuple[float, ...]) -> str:
    return " ".join(repr(float(value)) for value in values)
