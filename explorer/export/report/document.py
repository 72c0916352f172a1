"""The report as one HTML page: title block, sections, and the commands that reproduce it."""

from __future__ import annotations

import datetime as dt
import shlex
from collections.abc import Callable, Iterable, Iterator
from hashlib import sha256
from xml.etree.ElementTree import Element

from explorer import __version__
from explorer.export.drawings.markup import (
    Piece,
    as_html,
    element,
    illustration,
    number,
    paragraph,
    table,
    whole,
)
from explorer.export.drawings.mechanism import cover_drawing
from explorer.export.report.data import Missing, ReportData
from explorer.export.report.loads import loads_section, precision_section
from explorer.export.report.mechanism import mechanism_section, parts_section
from explorer.export.report.search import claims_section, search_section
from explorer.export.report.singularity import legs_section, singularity_section
from explorer.export.report.workspace import workspace_section
from explorer.files.packaged import packaged_file, versions
from explorer.measures.blocks import source as sources
from explorer.measures.catalogue import CATALOGUE
from explorer.mechanism.design_file import encode_design
from explorer.numerics.number_text import format_number
from explorer.statics.loaded import LoadedPose
from explorer.workspace.accessible.workspace import AccessibleWorkspace

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
    style = packaged_file("export/report", "style.css").read_text("utf-8")
    head = element(
        "head",
        element("meta", charset="utf-8"),
        element("meta", name="viewport", content="width=device-width, initial-scale=1"),
        element("meta", http_equiv="Content-Security-Policy", content=_POLICY),
        element("meta", name="generator", content=f"Flagged 4-4 explorer {__version__}"),
        element("title", title),
        element("style", style),
    )
    body = element("body", element("header", *_title_block(data, date), class_="cover"))
    for section in _SECTIONS:
        pieces = list(section(data))
        if pieces:
            body.append(element("section", *pieces))
    return f"<!DOCTYPE html>\n{as_html(element('html', head, body, lang='en-GB'))}\n"


def _title_block(data: ReportData, date: dt.date) -> Iterator[Element]:
    yield element("p", "Design report", class_="kind")
    yield element("h1", _name(data))
    yield element("p", "Flagged 4-4 parallel manipulator", class_="subtitle")
    code = _hash(data)
    particulars = (
        ("Date", element("time", date.isoformat(), datetime=date.isoformat())),
        ("Made by", f"Flagged 4-4 explorer {__version__}"),
        ("Unit", f"1 unit = {format_number(data.unit_mm, 6)} mm"),
        ("Design file, SHA-256", element("span", f"{code[:16]}…", title=code)),
    )
    yield element("dl", *(_entry(*each) for each in particulars), class_="particulars")
    yield illustration(cover_drawing(data.snapshot), f"The mechanism in {data.pose_words}.")
    yield element("dl", *(_entry(*each) for each in _headline(data)), class_="headline")


def _name(data: ReportData) -> str:
    return data.design.name or "untitled"


def _hash(data: ReportData) -> str:
    """Return the SHA-256 of the design file, in hexadecimal."""
    return sha256(encode_design(data.design)).hexdigest()


def _entry(name: Piece, *pieces: Piece) -> Element:
    return element("div", element("dt", name), element("dd", *pieces))


def _headline(data: ReportData) -> Iterator[tuple[Piece, ...]]:
    unit, snapshot = data.unit_mm, data.snapshot
    for name, value in data.measured.values.items():
        measure = CATALOGUE[name]
        title = f"{measure.heading[:1].upper()}{measure.heading[1:]}"
        if value is None:
            yield title, "infinite" if name in data.measured.infinite else "–"
        elif name == "node_volume" and not isinstance(data.nodes, Missing):
            count = element("span", whole(data.nodes.count), " nodes")
            yield title, number(value), _unit("units³, "), count
        else:
            yield title, number(value), _unit(measure.unit_in("units"))
    yield "Reach", number(data.design.reach * unit, 4), _unit("mm")
    margin = snapshot.proximity * data.design.reach
    yield "Smallest margin |δ| here", number(margin * unit, 4), _unit("mm")
    yield "Inverse condition here", number(snapshot.inverse_condition, 4), _unit("of 1")
    clearance = float(snapshot.clearances.clearance.min())
    yield "Least clearance here", number(clearance * unit, 4), _unit("mm")


def _unit(words: str) -> Element:
    return element("span", f" {words}")


def _reproduction(data: ReportData) -> Iterator[Element]:
    yield element("h2", "How to reproduce it")
    name = sources.name_of(data.design)
    where: tuple[Piece, ...] = ("The design is a preset of the explorer. ",)
    if name == sources.DESIGN_FILE:
        where = ("Save the file below as ", element("code", name), ". ")
    yield paragraph(*where, "These commands give the same figures:")
    yield element("pre", "\n".join(_commands(data, shlex.quote(name))), id="commands")
    if data.record is None:
        yield paragraph("Nothing here is random; there is no seed.")
    else:
        settings = data.record.settings
        yield paragraph(
            *("The search is the same each time: seed ", whole(settings.seed), ", "),
            *(whole(settings.starts), " start" if settings.starts == 1 else " starts"),
            *(" of at most ", whole(settings.iterations), " iterations. "),
            "Nothing else here is random.",
        )
    columns = {"this report": versions()}
    if data.record is not None:
        columns["the search"] = data.record.versions
    names = dict.fromkeys(name for each in columns.values() for name in each)
    rows = [(name, *(each.get(name, "–") for each in columns.values())) for name in names]
    yield element("h3", "Versions")
    yield table(("", *columns), rows, align="<" * (1 + len(columns)))
    yield element("h3", "Design file")
    yield paragraph("SHA-256 ", element("code", _hash(data), id="design-hash"), class_="dim")
    yield element("pre", encode_design(data.design).decode(), id="design")


def _commands(data: ReportData, source: str) -> Iterator[str]:
    design, pose = data.design, data.snapshot.pose
    turned = "" if data.is_home else f" --quaternion {' '.join(map(repr, pose.quaternion))}"
    legs = " --interference" if isinstance(data.accessible, AccessibleWorkspace) else ""
    record = "" if data.record is None else " --record record.json"
    at = sources.pose_options(design, pose)
    yield f"explorer report --design {source}{at}{record} --out report.html"
    yield f"explorer workspace --design {source}{turned} --hull{legs}"
    yield sources.pose_source("singularity", design, pose).command
    yield sources.pose_source("interference", design, pose).command
    loaded = LoadedPose(design, pose)
    if data.case.is_loaded or data.case.is_limited:
        yield sources.load_source("forces", loaded).command
    if data.precision is not None:
        yield sources.load_source("accuracy", data.precision.loaded).command
    if data.held is not None:
        yield f"explorer workspace --design {source}{turned} --load 0 0 0"
    if not isinstance(data.bill, Missing):
        yield f"explorer export mechanism --design {source} --out mechanism.zip"
    if data.record is not None:
        yield "explorer optimise --repeat record.json --out data.json"


_SECTIONS: tuple[Callable[[ReportData], Iterable[Element]], ...] = (
    mechanism_section,
    workspace_section,
    singularity_section,
    legs_section,
    loads_section,
    precision_section,
    parts_section,
    search_section,
    claims_section,
    _reproduction,
)
