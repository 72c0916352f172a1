"""The script that writes the manual's page of claims, and the data of the report's section.

From the checkout: python tests/tools/claims_page.py
"""

from __future__ import annotations

import json
from pathlib import Path

from explorer.files.packaged import SOURCES
from explorer.numerics.compiled import warm
from explorer.reproduce.claim import Result
from explorer.reproduce.claims import measure_claims

ASSETS = SOURCES / "assets"

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


def data(results: list[Result]) -> str:
    """Return what the report's section needs, as JSON."""
    rows = [
        {
            "claim": result.claim.title,
            "verdict": verdict_of(result),
            "reading": result.claim.reading,
        }
        for result in results
    ]
    return json.dumps(rows, ensure_ascii=False, indent=1) + "\n"


def write(assets: Path) -> None:
    """Write both files into the folder of assets."""
    warm()
    results = list(measure_claims())
    (assets / "manual" / "claims.md").write_text(page(results), encoding="utf-8")
    (assets / "claims" / "claims.json").write_text(data(results), encoding="utf-8")


if __name__ == "__main__":
    write(ASSETS)
