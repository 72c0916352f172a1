"""`explorer reproduce`: the claims of the paper, and tables on six legs beside its optimum."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from textwrap import fill
from typing import TYPE_CHECKING, Annotated

from explorer.cli import values
from explorer.cli.options import JsonOptions
from explorer.cli.output import attributes, figure, table
from explorer.cli.streams import write_error
from explorer.measures.catalogue import CATALOGUE, MeasureValues, measure_design
from explorer.measures.measure import Case
from explorer.mechanism.design_file import PRESETS
from explorer.six_legged.case import OF_TABLES, TABLE_MEASURES, TableCase

if TYPE_CHECKING:
    from explorer.reproduce.claim import Result

WIDTH = 96


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
    measure beside the paper's optimum; then only claims that are named are measured too."""

    equal: values.Flag = False
    """Give these tables the longest stroke of the optimum's legs, and its cones."""

    def run(self) -> None:
        """Write the claims with their verdicts, and the tables beside the paper's optimum."""
        from explorer.numerics.compiled import warm
        from explorer.reproduce.claims import measure_claims
        from explorer.six_legged.files import load_table, made_equal

        tables = [load_table(name) for name in self.beside]
        if self.equal:
            tables = [made_equal(table, PRESETS["paper-optimal"]) for table in tables]
        warm()
        names = self.claim or (() if self.beside else None)
        results = list(measure_claims(names, lambda title: write_error(f"measuring: {title}")))
        cases = [TableCase(table) for table in tables]
        beside = [
            {
                "name": case.table.name,
                "source": case.table.source,
                **_values_json(case.measurements),
            }
            for case in cases
        ]
        # One table is an object, several are a list.
        answer = {"beside": beside if len(beside) > 1 else beside[0]} if beside else {}
        self.write(
            lambda: {"claims": [*map(_claim_json, results)], **answer},
            [*_lines(results), *(_beside_lines(cases) if cases else ())],
        )


def _values_json(measured: MeasureValues) -> dict[str, object]:
    """Return values in millimetres and degrees, by names that end in their units."""
    units = {3: "_mm3", 1: "_mm"}
    return {
        f"{name}{units.get(measure.power, '_deg' if measure.unit == '°' else '')}": value
        for name, value in measured.values.items()
        for measure in (CATALOGUE[name],)
    }


def _beside_lines(cases: Sequence[TableCase]) -> Iterator[str]:
    """Yield a table of measures: a column for the paper's optimum, and one for each table."""
    design = PRESETS["paper-optimal"]
    own = measure_design(Case(design), TABLE_MEASURES)
    columns = [
        (own, design.millimetres),
        *((case.measurements, case.table.millimetres) for case in cases),
    ]
    rows: list[tuple[str, ...]] = [("", "", design.name, *(case.table.name for case in cases))]
    for name in TABLE_MEASURES:
        measure = CATALOGUE[name]
        unit = measure.unit_in(design.millimetres).name
        factors = [measure.unit_in(lengths).factor for _, lengths in columns]
        found = [each.value(name) for each, _ in columns]
        cells = [
            "none" if value is None else figure(value * factor)
            for value, factor in zip(found, factors, strict=True)
        ]
        rows.append((measure.label, unit, *cells))
    yield table(rows, "<<" + ">" * len(columns))
    yield ""
    for case in cases:
        text = f"{case.table.name}: {case.table.source}" if case.table.source else case.table.name
        yield fill(text, WIDTH, break_on_hyphens=False)
    yield fill(OF_TABLES, WIDTH)


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
