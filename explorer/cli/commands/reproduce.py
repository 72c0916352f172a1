"""`explorer reproduce`: the claims of the paper, each beside what is measured."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from textwrap import fill
from typing import TYPE_CHECKING, Annotated

from explorer.cli import values
from explorer.cli.options import JsonOptions
from explorer.cli.output import attributes
from explorer.cli.streams import write_error

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

    def run(self) -> None:
        """Write the claims with their verdicts."""
        from explorer.numerics.compiled import warm
        from explorer.reproduce.claims import measure_claims

        warm()
        results = list(
            measure_claims(self.claim or None, lambda title: write_error(f"measuring: {title}"))
        )
        self.write(lambda: {"claims": [*map(_claim_json, results)]}, _lines(results))


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
