"""The section on the claims of the paper, in reports of the paper's designs."""

from __future__ import annotations

import json
from collections.abc import Iterator
from xml.etree.ElementTree import Element

import msgspec

from explorer.export.report.data import ReportData
from explorer.export.report.markup import element, paragraph, table
from explorer.files.packaged import packaged_file
from explorer.mechanism.design_file import PRESETS


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
