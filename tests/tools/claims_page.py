"""The script that writes the manual's page of claims.

From the checkout: python tests/tools/claims_page.py
"""

from __future__ import annotations

from explorer.files.packaged import SOURCES
from explorer.numerics.compiled import warm
from explorer.reproduce.claim import Result
from explorer.reproduce.claims import measure_claims

HEAD = """\
# The paper's claims

`explorer reproduce` measures these claims of the paper again and judges each; this page is made
from its output. *Confirmed within* states the condition under which a claim is confirmed. *Our
reading* is how the explorer reads what the paper leaves open. `--claim NAME` measures one claim,
`--json` writes all values.

| claim | verdict |
|---|---|
"""
TAIL = """\

## Simpler and cheaper

> It is simpler in structure (it posses four legs) and consequently cheaper than most other designs.

`explorer reproduce` leaves this claim out. The 4-4 has 4 legs, 11 moving bodies and 14 joints; its
6-4 twin and an octahedral Stewart-Gough platform have 6 legs, 13 bodies and 18 joints. No two
joints of the 4-4 share a centre, as they do in 4 and 6 points of the others, but its legs 2 and 3
bear bending, and robots with three legs, two actuators in each, have fewer parts still. The cost
cannot be tested: the paper prints no parts list, material, tolerance or price, neither of its
prototype nor of another design.
"""


def verdict_of(result: Result) -> str:
    """Return the verdict with its condition."""
    measurement = result.measurement
    return ": ".join(filter(None, (measurement.verdict, measurement.condition)))


def page(results: list[Result]) -> str:
    """Return the page in Markdown."""
    parts = [HEAD]
    parts += [f"| {result.claim.title} | {verdict_of(result)} |\n" for result in results]
    for result in results:
        claim, measurement = result.claim, result.measurement
        verdict = verdict_of(result)
        parts.append(f"\n## {claim.title}\n\n> {claim.paper}\n\n")
        parts.append(f"**{verdict[:1].upper()}{verdict[1:]}.** {measurement.text}\n")
        if claim.reading:
            parts.append(f"\n*Our reading.* {claim.reading}\n")
        own = f"explorer reproduce --claim {claim.name}"
        if measurement.table:
            # As the command prints it, which a test compares.
            table = "\n".join(f"    {line}".rstrip() for line in measurement.table)
            parts.append(f"\n```sh\n{own}\n```\n\n```text\n{table}\n```\n")
        if claim.command != own or not measurement.table:
            parts.append(f"\n```sh\n{claim.command}\n```\n")
    return "".join([*parts, TAIL])


if __name__ == "__main__":
    warm()
    results = list(measure_claims())
    (SOURCES / "assets" / "manual" / "claims.md").write_text(page(results), encoding="utf-8")
