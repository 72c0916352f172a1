"""The section on the search that found the design."""

from __future__ import annotations

from collections.abc import Iterator
from xml.etree.ElementTree import Element

from explorer.export.report.data import ReportData
from explorer.export.report.drawings.history import charts, steps_of
from explorer.export.report.markup import Row, element, illustration, paragraph, table, whole
from explorer.mechanism.design import VARIABLES
from explorer.optimise.curves import CALLED


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
        rows.append((CALLED[problem.objective], value))
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
