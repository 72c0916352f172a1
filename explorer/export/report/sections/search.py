"""The section on the search that found the design."""

from __future__ import annotations

from collections.abc import Iterator
from xml.etree.ElementTree import Element

from explorer.export.report.data import ReportData
from explorer.export.report.drawings.history import charts, steps_of
from explorer.export.report.markup import Cell, element, illustration, paragraph, table, whole
from explorer.mechanism.design import VARIABLES
from explorer.optimise.curves import CALLED
from explorer.optimise.record import Record


def search_section(data: ReportData, record: Record) -> Iterator[Element]:
    """Yield the section on the search that found the design."""
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
    rows: list[tuple[Cell, ...]] = [
        ("objective", problem.objective.replace("-", " ")),
        ("status", run.status),
        ("iterations", whole(run.iterations)),
        ("evaluations", whole(run.evaluations)),
        ("starts", whole(record.settings.starts)),
        ("seed", whole(record.settings.seed)),
        ("time, s", record.seconds),
    ]
    if best is not None:
        rows.insert(2, (CALLED[problem.objective], best.objective))
        rows.insert(3, ("volume, units³", best.volume))
    if problem.demands.volume is not None:
        rows.insert(2, ("demanded volume, units³", problem.demands.volume))
    if run.holding:
        rows.append(("held by", run.holding))
    start, end = problem.start, record.design
    changes: list[tuple[Cell, ...]] = [
        (element("b", name), before, after, after - before)
        for name, before, after in zip(VARIABLES, start.variables, end.variables, strict=True)
    ]
    changes.append(
        ((element("b", "|a3|"), " reach"), start.reach, end.reach, end.reach - start.reach)
    )
    yield element(
        "div",
        table((), rows, align="<>", caption="The search"),
        table(("units", "start", "optimum", "change"), changes, align="<>>>", caption="The design"),
        class_="pair",
    )
    if not steps_of(record):
        yield paragraph("No iterate was recorded.")
