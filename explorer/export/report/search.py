"""The sections on where the design comes from: its search, and the claims of the paper."""

from __future__ import annotations

import json
import math
from collections.abc import Iterator
from xml.etree.ElementTree import Element

import msgspec
import numpy as np

from explorer.export.drawings.markup import (
    Row,
    coordinate,
    drawing_text,
    element,
    illustration,
    paragraph,
    table,
    whole,
)
from explorer.export.drawings.mechanism import WIDTH, round_length, svg_drawing
from explorer.export.report.data import ReportData
from explorer.files.packaged import packaged_file
from explorer.mechanism.design import VARIABLES
from explorer.mechanism.design_file import PRESETS
from explorer.numerics.number_text import format_number, power_of_ten
from explorer.optimise.record import OBJECTIVE_SYMBOLS, Curve, Record, Step, curves_of


def search_section(data: ReportData) -> Iterator[Element]:
    """Yield the section on the search that found the design; nothing without a record."""
    record = data.record
    if record is None:
        return
    yield element("h2", "Optimisation")
    run, problem = record.runs[record.chosen], record.problem
    if record.design.variables != data.design.variables:
        yield paragraph(
            "The design of this report is not the one that this search found.", class_="note"
        )
    yield paragraph(f"{run.message[:1].upper()}{run.message[1:].rstrip('.')}.")
    drawn = charts(record)
    if drawn is not None:
        yield illustration(
            drawn,
            "The search from the chosen start, by iterations; dashed lines are the demands.",
        )
    best = next((step for step in record.history if step.number == run.best), None)
    rows: list[Row] = [
        ("objective", problem.objective.replace("-", " ")),
        ("status", run.status),
    ]
    if problem.demands.volume is not None:
        rows.append(("demanded volume, units³", problem.demands.volume))
    if best is not None:
        value = "infinite" if best.objective is None else best.objective
        rows.append((OBJECTIVE_SYMBOLS[problem.objective], value))
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
    start, end = problem.start, record.design
    names = [*((element("b", name),) for name in VARIABLES), (element("b", "|a3|"), " reach")]
    before, after = ((*design.variables, design.reach) for design in (start, end))
    changes = [(*row, row[2] - row[1]) for row in zip(names, before, after, strict=True)]
    yield element(
        "div",
        table((), rows, align="<>", caption="The search"),
        table(("units", "start", "optimum", "change"), changes, align="<>>>", caption="The design"),
        class_="pair",
    )
    if not steps_of(record):
        yield paragraph("No iterate was recorded.")


HEIGHT = 190.0
LEFT, RIGHT, TOP, BOTTOM = 52.0, 14.0, 26.0, 36.0
_TICKS = 5


def steps_of(record: Record) -> list[Step]:
    """Return the iterates of the chosen start."""
    return [step for step in record.history if step.run == record.chosen]


def charts(record: Record) -> Element | None:
    """Return the charts of the chosen start; None if it has no iterates."""
    steps = steps_of(record)
    if not steps:
        return None
    curves = curves_of(record.problem, steps)
    width = WIDTH / len(curves)
    drawn: list[Element] = []
    for index, curve in enumerate(curves):
        drawn.append(
            element(
                "text", _title(record, curve), x=index * width + LEFT - 30.0, y=13.0, class_="title"
            )
        )
        drawn.extend(_chart(curve, index * width + LEFT, width - LEFT - RIGHT))
    return svg_drawing(HEIGHT, "The search, by iterations", *drawn)


def _title(record: Record, curve: Curve) -> str:
    if curve.kind == "volume":
        return "Exact volume (units³)"
    if curve.kind == "spare":
        return "Worst demand; missed below 0"
    if curve.powers:
        return "F = |1 − V / V′|"
    return f"{OBJECTIVE_SYMBOLS[record.problem.objective].capitalize()} (units)"


def _chart(curve: Curve, left: float, width: float) -> list[Element]:
    """Return one chart with its axes."""
    tall = HEIGHT - TOP - BOTTOM
    low, high = _range(curve)
    last = max(1, len(curve.values) - 1)

    def place(index: float, value: float) -> tuple[float, float]:
        return left + width * index / last, TOP + tall * (high - value) / (high - low)

    axes = element("g", class_="ruler")
    axes.append(
        element("path", d=f"M{coordinate(left)},{TOP}v{tall}h{coordinate(width)}", class_="frame")
    )
    for tick in _ticks(low, high, whole=curve.powers):
        _, y = place(0.0, tick)
        axes.append(element("line", x1=left, y1=y, x2=left + width, y2=y, class_="grid"))
        words = power_of_ten(round(tick)) if curve.powers else format_number(tick, 5)
        axes.append(drawing_text(words, left - 5.0, y + 3.5, anchor="end"))
    for tick in _ticks(0.0, float(last), whole=True):
        x, _ = place(tick, low)
        axes.append(element("line", x1=x, y1=TOP + tall, x2=x, y2=TOP + tall + 4.0))
        axes.append(drawing_text(format_number(tick, 6), x, TOP + tall + 15.0))
    axes.append(drawing_text("iteration", left + 0.5 * width, HEIGHT - 6.0, class_="axis"))
    pieces = [axes]
    if curve.level is not None:
        _, y = place(0.0, curve.level)
        pieces.append(element("line", x1=left, y1=y, x2=left + width, y2=y, class_="level"))
    finite = [(i, value) for i, value in enumerate(curve.values.tolist()) if math.isfinite(value)]
    points = [place(index, value) for index, value in finite]
    if points:
        data = "M" + "L".join(f"{coordinate(x)},{coordinate(y)}" for x, y in points)
        pieces.append(element("path", d=data, class_="curve"))
    if len(points) <= 60:
        pieces += [element("circle", cx=x, cy=y, r=2.2, class_="point") for x, y in points]
    return pieces


def _range(curve: Curve) -> tuple[float, float]:
    every = [*curve.values.tolist(), *([] if curve.level is None else [curve.level])]
    finite = [value for value in every if math.isfinite(value)] or [0.0]
    low, high = min(finite), max(finite)
    if curve.powers:
        low = math.floor(low)
        return float(low), float(max(math.ceil(high), low + 1))
    room = 0.08 * (high - low) or 0.05 * abs(high) or 1.0
    return low - room, high + room


def _ticks(low: float, high: float, *, whole: bool) -> list[float]:
    step = round_length((high - low) / _TICKS * 1.6)
    if whole:
        step = max(1.0, float(np.ceil(step)))
    first, last = math.ceil(low / step - 1e-9), math.floor(high / step + 1e-9)
    return [tick * step for tick in range(first, last + 1)]


def claims_section(data: ReportData) -> Iterator[Element]:
    """Yield the section on the paper's claims; nothing for designs other than the paper's."""
    design = data.design
    is_of_paper = any(
        msgspec.structs.replace(preset, name=design.name, unit_mm=design.unit_mm) == design
        for preset in PRESETS.values()
    )
    if not is_of_paper:
        return
    claims = json.loads(packaged_file("claims", "claims.json").read_text("utf-8"))
    yield element("h2", "The paper’s claims")
    yield paragraph(
        "The command explorer reproduce measures them again, with the paper’s words and the values "
        "behind each verdict. Numbers mark our reading of what the paper leaves open."
    )
    readings = list(dict.fromkeys(claim["reading"] for claim in claims if claim["reading"]))
    rows = [
        (
            claim["claim"],
            claim["verdict"],
            str(readings.index(claim["reading"]) + 1) if claim["reading"] else "",
        )
        for claim in claims
    ]
    yield table(("claim", "verdict", "our reading"), rows, align="<<<")
    for number, reading in enumerate(readings, start=1):
        yield paragraph(f"{number}. {reading}")
