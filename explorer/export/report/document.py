"""The report as one HTML page: title block, sections, and how to make it again."""

from __future__ import annotations

import datetime as dt
import shlex
from collections.abc import Iterator
from importlib import resources
from xml.etree.ElementTree import Element

from explorer import __version__
from explorer.export.report.drawings.mechanism import lead
from explorer.export.report.findings import Findings, Missing
from explorer.export.report.markup import (
    Piece,
    as_html,
    count,
    element,
    figure,
    illustration,
    paragraph,
    table,
    written,
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

# What a browser may fetch for this page: nothing at all.
_POLICY = "default-src 'none'; style-src 'unsafe-inline'; img-src data:"


def report_html(found: Findings, date: dt.date) -> str:
    """Return the report, which needs no other file and no network.

    The same findings make the same report, but for the date and the versions that it tells.

    Args:
        found: What it tells.
        date: Of the report.
    """
    title = f"{_name(found)} – design report"
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
    body = element("body", element("header", *_title_block(found, date), class_="cover"))
    for section in (mechanism_section, workspace_section, singularity_section, legs_section):
        body.append(element("section", *section(found)))
    body.append(element("section", *parts_section(found)))
    if found.record is not None:
        body.append(element("section", *search_section(found, found.record)))
    body.append(element("section", *_reproduction(found)))
    return f"<!DOCTYPE html>\n{as_html(element('html', head, body, lang='en-GB'))}\n"


def _meta(name: str, content: str) -> Element:
    return element("meta", name=name, content=content)


def _title_block(found: Findings, date: dt.date) -> Iterator[Element]:
    design = found.design
    yield element("p", "Design report", class_="kind")
    yield element("h1", _name(found))
    yield element("p", "Flagged 4-4 parallel manipulator", class_="subtitle")
    particulars: tuple[tuple[str, Piece], ...] = (
        ("Date", element("time", date.isoformat(), datetime=date.isoformat())),
        ("Made by", f"Flagged 4-4 explorer {__version__}"),
        ("Unit", f"1 unit = {written(design.unit_mm)} mm"),
        (
            "Design file, SHA-256",
            element("span", f"{found.design_hash[:16]}…", title=found.design_hash),
        ),
    )
    yield element("dl", *map(_entry, particulars), class_="particulars")
    yield illustration(lead(found.snapshot), f"The mechanism in {pose_words(found)}.")
    yield element("dl", *map(_entry, _headline(found)), class_="headline")


def _name(found: Findings) -> str:
    return found.design.name or "untitled"


def _entry(entry: tuple[str, Piece | tuple[Piece, ...]]) -> Element:
    name, value = entry
    pieces = value if isinstance(value, tuple) else (value,)
    return element("div", element("dt", name), element("dd", *pieces))


def _headline(found: Findings) -> Iterator[tuple[str, tuple[Piece, ...]]]:
    unit = found.design.unit_mm
    yield "Exact volume", (figure(found.volume.volume), _unit("units³"))
    if isinstance(found.nodes, Missing):
        yield "Node volume", ("–",)
    else:
        many = element("span", count(found.nodes.count), " nodes")
        yield "Node volume", (figure(found.nodes.volume), _unit("units³, "), many)
    yield "Reach", (figure(found.design.reach * unit, 4), _unit("mm"))
    margin = found.snapshot.proximity * found.design.reach
    yield "Smallest margin |κ| here", (figure(margin * unit, 4), _unit("mm"))
    yield "Inverse condition here", (figure(found.snapshot.inverse_condition, 4), _unit("of 1"))
    clearance = float(found.snapshot.clearances.clearance.min())
    yield "Least clearance of legs here", (figure(clearance * unit, 4), _unit("mm"))


def _unit(words: str) -> Element:
    return element("span", f" {words}")


def _reproduction(found: Findings) -> Iterator[Element]:
    design = found.design
    yield element("h2", "How to reproduce it")
    is_preset = PRESETS.get(design.name) == design
    source = design.name if is_preset else "design.json"
    pose = found.snapshot.pose
    orientation = f" --quaternion {_words(pose.quaternion)}"
    position = f" --position {_words(pose.position)}"
    at = "" if found.is_home else position + orientation
    turned = "" if found.is_home else orientation
    radii = " --interference" if isinstance(found.reachable, ReachableWorkspace) else ""
    record = "" if found.record is None else " --record record.json"
    commands = [
        f"explorer report --design {shlex.quote(source)}{at}{record} --out report.html",
        f"explorer workspace --design {shlex.quote(source)}{turned} --hull{radii}",
        f"explorer singularity --design {shlex.quote(source)}{at}",
        f"explorer interference --design {shlex.quote(source)}{at}",
    ]
    if not isinstance(found.bill, Missing):
        commands.append(
            f"explorer export mechanism --design {shlex.quote(source)} --out mechanism.zip"
        )
    if found.record is not None:
        commands.append("explorer optimise --repeat record.json --out found.json")
    where: tuple[Piece, ...] = ("The design comes along with the explorer. ",)
    if not is_preset:
        where = ("Save the file below as ", element("code", "design.json"), ". ")
    yield paragraph(*where, "These commands tell the same figures:")
    yield element("pre", "\n".join(commands), id="commands")
    if found.record is not None:
        settings = found.record.settings
        yield paragraph(
            "The search is the same each time: seed ",
            count(settings.seed),
            ", ",
            count(settings.starts),
            " start" if settings.starts == 1 else " starts",
            " of at most ",
            count(settings.iterations),
            " iterations. All else here has no chance in it.",
        )
    else:
        yield paragraph("Nothing here depends on chance; there is no seed.")
    heads, rows = ("", "this report"), [(name, value) for name, value in versions().items()]
    yield element("h3", "Versions")
    if found.record is None:
        yield table(heads, rows, align="<<")
    else:
        searched = found.record.versions
        names = dict.fromkeys((*versions(), *searched))
        yield table(
            ("", "this report", "the search"),
            [(name, versions().get(name, "–"), searched.get(name, "–")) for name in names],
            align="<<<",
        )
    yield element("h3", "Design file")
    yield paragraph("SHA-256 ", element("code", found.design_hash, id="design-hash"), class_="dim")
    yield element("pre", found.design_file, id="design")


def _words(values: tuple[float, ...]) -> str:
    return " ".join(repr(float(value)) for value in values)
