"""`explorer reproduce`: the claims of the paper, and tables on six legs beside its optimum."""

from __future__ import annotations

import itertools
from collections import Counter
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from textwrap import fill
from typing import TYPE_CHECKING, Annotated

from explorer.cli import values
from explorer.cli.options import JsonOptions
from explorer.cli.output import attributes, figure, table
from explorer.cli.streams import write_error
from explorer.errors import InputError
from explorer.measures.catalogue import CATALOGUE, MeasureValues, measure_design
from explorer.measures.measure import Case
from explorer.mechanism.design import Design
from explorer.mechanism.design_file import PRESETS
from explorer.six_legged.case import OF_TABLES, TABLE_MEASURES, TableCase, is_upper_bound
from explorer.six_legged.table import SixLegged

if TYPE_CHECKING:
    from explorer.reproduce.claim import Result

WIDTH = 96
OPTIMUM = PRESETS["paper-optimal"]

Measured = Sequence[tuple[Design | SixLegged, MeasureValues]]
"""Designs and tables with the values of their measures."""


@dataclass(frozen=True, kw_only=True)
class ReproduceCommand(JsonOptions):
    """Measure the claims of the paper again, and judge each.

    A claim is confirmed, confirmed within a condition, not confirmed, or not testable from the
    paper. What the paper leaves open is marked as our reading. All random cases have fixed seeds.
    """

    claim: Annotated[tuple[str, ...], values.texts("NAME …"), values.OPTIONAL] = ()
    """Names of the claims, such as table-1; all by default."""

    beside: Annotated[tuple[str, ...], values.texts("TABLE_OR_FILE …"), values.OPTIONAL] = ()
    """Tables on six legs, by name or in a file (JSON, or LinuxCNC's HAL with genhexkins), to
    measure beside the paper's optimum; claims are then measured only if --claim names them."""

    equal: values.Flag = False
    """Give these tables the longest stroke of the optimum's legs, and its cones."""

    def run(self) -> None:
        """Write the claims with their verdicts, and the tables beside the paper's optimum."""
        from explorer.numerics.compiled import warm
        from explorer.reproduce.claims import measure_claims
        from explorer.six_legged.files import load_table, made_equal

        if self.equal and not self.beside:
            raise InputError("--equal is for the tables of --beside: give --beside TABLE_OR_FILE")
        tables = [load_table(name) for name in self.beside]
        if self.equal:
            tables = [made_equal(table, OPTIMUM) for table in tables]
        warm()
        names = self.claim or (() if self.beside else None)
        results = list(measure_claims(names, lambda title: write_error(f"measuring: {title}")))
        answer: dict[str, object] = {}
        lines = list(_lines(results))
        if tables:
            measured: Measured = [
                (OPTIMUM, measure_design(Case(OPTIMUM), TABLE_MEASURES)),
                *((table, TableCase(table).measurements) for table in tables),
            ]
            design, *beside = itertools.starmap(_values_json, measured)
            # One table is an object, several are a list.
            answer = {"design": design, "beside": beside if len(beside) > 1 else beside[0]}
            lines += _beside_lines(measured)
        self.write(lambda: {"claims": [*map(_claim_json, results)], **answer}, lines)


def _values_json(of: Design | SixLegged, measured: MeasureValues) -> dict[str, object]:
    """Return values in millimetres and degrees, by names that end in their units."""
    units = {3: "_mm3", 1: "_mm"}
    texts = "name source" if isinstance(of, SixLegged) else "name"
    numbers: dict[str, object] = {
        f"{name}{units.get(measure.power, '_deg' if measure.unit == '°' else '')}": value
        and value * of.unit_mm**measure.power
        for name, value in measured.values.items()
        for measure in (CATALOGUE[name],)
    }
    return attributes(of, texts) | numbers | attributes(measured, "empty_because infinite")


def _beside_lines(columns: Measured) -> Iterator[str]:
    """Yield a table of measures: a column for the paper's optimum, and one for each table."""
    rows: list[tuple[str, ...]] = [("", "", *(of.name for of, _ in columns))]
    for name in TABLE_MEASURES:
        measure = CATALOGUE[name]
        row = [measure.label, measure.unit_in(OPTIMUM.millimetres).name]
        for of, measured in columns:
            value, bound = measured.value(name), "<= " if is_upper_bound(of, measure) else ""
            factor = measure.unit_in(of.millimetres).factor
            row.append("none" if value is None else bound + figure(value * factor))
        rows.append(tuple(row))
    yield table(rows, "<<" + ">" * len(columns))
    yield ""
    for of, measured in columns:
        if isinstance(of, SixLegged) and of.source:
            yield fill(f"{of.name}: {of.source}", WIDTH, break_on_hyphens=False)
        if measured.empty_because:
            causes = ", ".join(measured.empty_because)
            yield fill(f"{of.name} has an empty workspace; emptied by: {causes}", WIDTH)
    yield fill(OF_TABLES.replace("≤", "<="), WIDTH)


def _claim_json(result: Result) -> dict[str, object]:
    """Return a claim and its measurement as plain values."""
    claim, measurement = result.claim, result.measurement
    return {
        **attributes(claim, "name reading paper command"),
        **attributes(measurement, "verdict condition values"),
        "claim": claim.title,
        "measured": measurement.text,
    }


def _lines(results: Sequence[Result]) -> Iterator[str]:
    """Yield claims with their verdicts, and how often there is each verdict."""
    for result in results:
        yield from claim_lines(result)
    if len(results) > 1:
        counts = Counter(result.measurement.verdict for result in results)
        yield "; ".join(f"{count} {verdict}" for verdict, count in counts.items())


def claim_lines(result: Result) -> Iterator[str]:
    """Yield a claim and its measurement as lines of text."""
    claim, measurement = result.claim, result.measurement
    yield f"{measurement.verdict.upper()}: {claim.title}"
    for name, text in (
        ("condition", measurement.condition),
        ("paper", f"“{claim.paper}”"),
        ("our reading", claim.reading),
        ("measured", measurement.text),
        ("see", claim.command),
    ):
        if text:
            yield fill(
                text,
                WIDTH,
                initial_indent=f"  {name:12} ",
                subsequent_indent=" " * 15,
                break_on_hyphens=False,
            )
    if measurement.table:
        yield ""
        yield from (f"    {line}".rstrip() for line in measurement.table)
    yield ""
