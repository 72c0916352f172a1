"""The section on the claims of the paper, in reports of the paper's designs."""

from __future__ import annotations

import json
from collections.abc import Iterator
from xml.etree.ElementTree import Element

from explorer.export.report.data import ReportData
from explorer.export.report.markup import element, paragraph, table
from explorer.files.packaged import packaged_file
from explorer.mechanism.design_file import PRESETS


def claims_section(data: ReportData) -> Iterator[Element]:
    """Yield the section on the paper's claims; nothing for other designs."""
    of_paper = {preset.variables for preset in PRESETS.values()}
    if data.design.variables not in of_paper:
        return
    claims = json.loads(packaged_file("claims", "claims.json").read_text("utf-8"))
    yield element("h2", "The paper’s claims")
    yield paragraph(
        "The command explorer reproduce measures them again, with the paper’s words and our "
        "reading of what it leaves open."
    )
    rows = [(claim["claim"], claim["verdict"]) for claim in claims]
    yield table(("claim", "verdict"), rows, align="<<")
