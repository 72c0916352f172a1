"""The report as one HTML page: title block, sections, the search, and how to reproduce it."""

from __future__ import annotations

import datetime as dt
import shlex
from collections.abc import Callable, Iterable, Iterator
from hashlib import sha256
from xml.etree.ElementTree import Element

from explorer import __version__
from explorer.errors import ExplorerError
from explorer.export.drawings import markup
from explorer.export.drawings.charts import search_chart
from explorer.export.drawings.markup import Piece, Row, drawing_style, element, paragraph, whole
from explorer.export.drawings.mechanism import WIDTH, cover_drawing, svg_drawing
from explorer.export.report import mechanism, workspace
from explorer.export.report.data import ReportData
from explorer.files.packaged import packaged_file, versions
from explorer.find.requirement import encode_requirement
from explorer.measures.blocks import commands
from explorer.measures.catalogue import CATALOGUE
from explorer.mechanism.design import VARIABLES
from explorer.mechanism.design_file import encode_design
from explorer.numerics.number_text import UNITS, format_number
from explorer.optimise.outcome import GOALS, OBJECTIVE_SYMBOLS, Curve, Record, curves_of
from explorer.optimise.problem import REACH, YAW
from explorer.statics.loaded import LoadedPose
from explorer.workspace.accessible.workspace import AccessibleWorkspace

REQUIREMENT_FILE = "requirement.json"
# The height of the charts of the search, and the space around each.
HEIGHT = 190.0
LEFT, RIGHT, TOP, BOTTOM = 52.0, 14.0, 26.0, 36.0
# The page may fetch nothing.
_POLICY = "default-src 'none'; style-src 'unsafe-inline'; img-src data:"


def report_html(data: ReportData, date: dt.date) -> str:
    """Return the report of a date as HTML that needs no other file and no network.

    Equal data give equal reports, except for the date and the versions of the libraries.
    """
    body = element("body", element("header", *_title_block(data, date), class_="cover"))
    for section in _SECTIONS:
        # The search, and what gives the report again, are in the unit of the design's file.
        if data.filed and section is search_section:
            markup.name_millimetres(body)
        pieces = list(section(data))
        if pieces:
            body.append(element("section", *pieces))
    return page_html(f"{data.design.name} – design report", body)


def page_html(title: str, body: Element) -> str:
    """Return a page with the looks of a report as HTML that needs no other file and no network."""
    style = packaged_file("export/report", "style.css").read_text("utf-8") + drawing_style()
    head = element(
        "head",
        element("meta", charset="utf-8"),
        element("meta", name="viewport", content="width=device-width, initial-scale=1"),
        element("meta", http_equiv="Content-Security-Policy", content=_POLICY),
        element("meta", name="generator", content=f"Flagged 4-4 explorer {__version__}"),
        element("title", title),
        element("style", style),
    )
    return f"<!DOCTYPE html>\n{markup.as_html(element('html', head, body, lang='en-GB'))}\n"


def _title_block(data: ReportData, date: dt.date) -> Iterator[Element]:
    yield element("p", "Design report", class_="kind")
    yield element("h1", data.design.name)
    yield element("p", "Flagged 4-4 parallel manipulator", class_="subtitle")
    code = _hash(data)
    particulars = (
        ("Date", element("time", date.isoformat(), datetime=date.isoformat())),
        ("Made by", f"Flagged 4-4 explorer {__version__}"),
        ("Unit", f"1 unit = {format_number(data.as_filed.design.unit_mm, 6)} mm"),
        ("Design file, SHA-256", element("span", f"{code[:16]}…", title=code)),
    )
    yield element("dl", *(_entry(*each) for each in particulars), class_="particulars")
    caption = f"The mechanism in {data.pose_words}."
    yield markup.illustration(cover_drawing(data.snapshot), caption)
    yield element("dl", *(_entry(*each) for each in _headline(data)), class_="headline")


def _hash(data: ReportData) -> str:
    return sha256(encode_design(data.as_filed.design)).hexdigest()


def _entry(name: Piece, *pieces: Piece) -> Element:
    return element("div", element("dt", name), element("dd", *pieces))


def _headline(data: ReportData) -> Iterator[tuple[Piece, ...]]:
    snapshot, reach = data.snapshot, data.design.reach * data.design.unit_mm
    for name, value in data.measurements.values.items():
        measure = CATALOGUE[name]
        title = f"{measure.heading[:1].upper()}{measure.heading[1:]}"
        if value is None:
            yield title, "infinite" if name in data.measurements.infinite else "–"
            continue
        unit = measure.unit_in(data.design.millimetres if data.filed else UNITS, value)
        figure = markup.number(unit.convert(value))
        if name == "node_volume" and not isinstance(data.node_count, ExplorerError):
            count = element("span", whole(data.node_count.count), " nodes")
            yield title, figure, _unit(f"{unit.name}, "), count
        else:
            yield title, figure, _unit(unit.name)
    yield "Reach", markup.number(reach, 4), _unit("mm")
    yield "Smallest margin |δ| here", markup.number(snapshot.proximity * reach, 4), _unit("mm")
    condition = markup.number(float(snapshot.inverse_condition), 4)
    yield "Inverse condition here", condition, _unit("of 1")
    clearance = float(snapshot.clearances.clearance.min()) * data.design.unit_mm
    yield "Least clearance here", markup.number(clearance, 4), _unit("mm")


def _unit(words: str) -> Element:
    return element("span", f" {words}")


def search_section(data: ReportData) -> Iterator[Element]:
    """Yield the section on the search that found the design; nothing without a record."""
    record, data = data.record, data.as_filed
    if record is None:
        return
    yield element("h2", "Optimisation")
    run, problem = record.runs[record.chosen], record.problem
    if record.design.variables != data.design.variables:
        words = "The design of this report is not the one that this search found."
        yield paragraph(words, class_="note")
    yield paragraph(f"{run.message[:1].upper()}{run.message[1:].rstrip('.')}.")
    drawn = charts(record)
    if drawn is not None:
        words = "The search from the chosen start, by iterations; dashed lines are the demands."
        yield markup.illustration(drawn, words)
    best = next((step for step in record.history if step.number == run.best), None)
    rows: list[Row] = [("objective", problem.objective.replace("-", " ")), ("status", run.status)]
    if problem.demands.volume is not None:
        rows.append(("demanded volume, units³", problem.demands.volume))
    if best is not None:
        rows.append((OBJECTIVE_SYMBOLS[problem.objective], best.objective))
        rows.append(("volume, units³", best.volume))
    rows += [
        ("iterations", whole(run.iterations)),
        ("evaluations", whole(run.evaluations)),
        ("starts", whole(record.settings.starts)),
        ("seed", whole(record.settings.seed)),
        ("time, s", record.seconds),
    ]
    if run.holding:
        rows.append(("held by", run.holding))
    names = [*((element("b", name),) for name in VARIABLES), (element("b", "|a3|"), " reach")]
    before, after = ((*each.variables, each.reach) for each in (problem.start, record.design))
    changes: list[Row] = [(*row, row[2] - row[1]) for row in zip(names, before, after, strict=True)]
    if best is not None:
        labels = {YAW: "yaw of home, °", REACH: "longest leg"}
        for name, old, new in zip(problem.names, problem.start_values, best.values, strict=True):
            if name in labels:
                changes.append((labels[name], old, new, new - old))
    heads = ("units", "start", "optimum", "change")
    search = markup.table((), rows, "<>", "The search")
    yield element("div", search, markup.table(heads, changes, "<>>>", "The design"), class_="pair")
    if drawn is None:
        yield paragraph("No iterate was recorded.")


def charts(record: Record) -> Element | None:
    """Return the charts of the chosen start; None if it has no iterates."""
    steps = [step for step in record.history if step.run == record.chosen]
    if not steps:
        return None
    curves = curves_of(record.problem, steps)
    width = WIDTH / len(curves)
    drawn: list[Element] = []
    for index, curve in enumerate(curves):
        left = index * width + LEFT
        drawn.append(markup.drawing_text(_title(record, curve), left - 30.0, 13.0, "title"))
        inner, height = width - LEFT - RIGHT, HEIGHT - TOP - BOTTOM
        drawn.extend(search_chart(curve, left, inner, TOP, height))
    return svg_drawing(HEIGHT, "The search, by iterations", *drawn)


def _title(record: Record, curve: Curve) -> str:
    if curve.kind == "volume":
        return "Exact volume (units³)"
    if curve.kind == "spare":
        return "Worst demand; missed below 0"
    if curve.powers:
        return "F = |1 − V / V′|"
    objective = record.problem.objective
    unit = CATALOGUE[GOALS[objective]].unit_in(UNITS).name
    return f"{OBJECTIVE_SYMBOLS[objective].capitalize()}{f' ({unit})' if unit else ''}"


def _reproduction(data: ReportData) -> Iterator[Element]:
    yield element("h2", "How to reproduce it")
    filed, record = data.as_filed.design, data.record
    name = commands.name_of(filed)
    where: tuple[Piece, ...] = ("The design is a preset of the explorer. ",)
    if name == commands.DESIGN_FILE:
        where = ("Save the file below as ", element("code", name), ". ")
    if data.requirement is not None:
        where += ("Save the requirement below as ", element("code", REQUIREMENT_FILE), ". ")
    yield paragraph(*where, "These commands give the same figures:")
    yield element("pre", "\n".join(_commands(data, shlex.quote(name))), id="commands")
    columns = {"this report": versions()}
    if record is None:
        yield paragraph("Nothing here is random; there is no seed.")
    else:
        seed, starts = record.settings.seed, record.settings.starts
        yield paragraph(
            *("The search is the same each time: seed ", whole(seed), ", ", whole(starts)),
            *(" start" if starts == 1 else " starts", " of at most "),
            *(whole(record.settings.iterations), " iterations. Nothing else here is random."),
        )
        columns["the search"] = record.versions
    names = dict.fromkeys(name for each in columns.values() for name in each)
    rows = [(name, *(each.get(name, "–") for each in columns.values())) for name in names]
    yield element("h3", "Versions")
    yield markup.table(("", *columns), rows, "<" * (1 + len(columns)))
    yield element("h3", "Design file")
    yield paragraph("SHA-256 ", element("code", _hash(data), id="design-hash"), class_="dim")
    yield element("pre", encode_design(filed).decode(), id="design")
    if data.requirement is not None:
        yield element("h3", "Requirement file")
        yield element("pre", encode_requirement(data.requirement).decode(), id="requirement")


def _commands(data: ReportData, source: str) -> Iterator[str]:
    design, pose = data.as_filed.design, data.as_filed.at
    turned = "" if data.is_home else f" --quaternion {' '.join(map(repr, pose.quaternion))}"
    legs = " --interference" if isinstance(data.accessible, AccessibleWorkspace) else ""
    record = "" if data.record is None else " --record record.json"
    needed = "" if data.requirement is None else f" --requirement {REQUIREMENT_FILE}"
    at = commands.pose_options(design, pose)
    yield f"explorer report --design {source}{at}{record}{needed} --out report.html"
    yield f"explorer workspace --design {source}{turned} --hull{legs}"
    yield commands.pose_command("singularity", design, pose)
    yield commands.pose_command("interference", design, pose)
    if data.has("is_loaded") or data.has("is_limited"):
        yield commands.load_command("forces", LoadedPose(design, pose))
    if data.precision is not None:
        yield commands.load_command("accuracy", (data.as_filed.precision or data.precision).loaded)
    if data.carrying_part is not None:
        yield f"explorer workspace --design {source}{turned} --load 0 0 0"
    if not isinstance(data.bill, ExplorerError):
        yield f"explorer export mechanism --design {source} --out mechanism.zip"
    if data.record is not None:
        yield "explorer optimise --repeat record.json --out data.json"


_SECTIONS: tuple[Callable[[ReportData], Iterable[Element]], ...] = (
    mechanism.requirement_section,
    mechanism.mechanism_section,
    workspace.workspace_section,
    mechanism.singularity_section,
    mechanism.legs_section,
    workspace.loads_section,
    workspace.path_section,
    workspace.precision_section,
    mechanism.parts_section,
    search_section,
    _reproduction,
)
