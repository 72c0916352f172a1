"""The script that writes the manual's page of claims, and the data of the report's section.

From the checkout: python tests/claims_page.py
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

`explorer reproduce` measures every claim of the paper again and judges it; this page is made from
its output. *Confirmed within* holds under what the measured values state. *Our reading* marks what
the paper leaves open. `--claim NAME` measures one of them, `--json` writes all figures.

| claim | verdict |
|---|---|
"""


def page(results: list[Result]) -> str:
    """Return the page in Markdown."""
    parts = [HEAD]
    parts += [f"| {result.claim.title} | {result.measured.verdict} |\n" for result in results]
    for result in results:
        claim, measured = result.claim, result.measured
        parts.append(f"\n## {claim.title}\n\n> {claim.paper}\n\n")
        parts.append(f"**{measured.verdict[:1].upper()}{measured.verdict[1:]}.** ")
        parts.append(f"{measured.text}\n")
        if claim.reading:
            parts.append(f"\n*Our reading.* {claim.reading.removeprefix('Our reading: ')}\n")
        if measured.table:
            # As the command prints it, which a test compares.
            table = "\n".join(f"    {line}".rstrip() for line in measured.table)
            parts.append(f"\n```sh\nexplorer reproduce --claim {claim.name}\n```\n")
            parts.append(f"\n```text\n{table}\n```\n")
        parts.append(f"\n```sh\n{claim.command}\n```\n")
    return "".join(parts)


def data(results: list[Result]) -> str:
    """Return what the report's section needs, as JSON."""
    rows = [
        {
            "claim": result.claim.title,
            "verdict": result.measured.verdict,
            "measured": result.measured.text,
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
