"""The report in a real browser: laid out as meant, and printed as PDF."""

from __future__ import annotations

import re
from pathlib import Path

import msgspec
import pytest
from likeness import Likeness, assert_alike
from pictures import FOLDER, draw_report
from playwright.sync_api import Browser

import explorer
from explorer.app.features.sharing.reporting import make_report
from explorer.cli import run

OPTIMAL = explorer.PRESETS["paper-optimal"]


def test_report_of_a_hostile_name_asks_for_nothing_and_runs_nothing(browser: Browser) -> None:
    hostile = '</title></style><script>window.hit = 1</script><img src=x onerror="window.hit=1">'
    html = make_report(msgspec.structs.replace(OPTIMAL, name=hostile)).decode()
    page = browser.new_page(viewport={"width": 1000, "height": 1200})
    asked: list[str] = []
    complaints: list[str] = []
    page.on("request", lambda request: asked.append(request.url))
    page.on("console", lambda message: complaints.append(message.text))
    page.on("pageerror", lambda error: complaints.append(str(error)))
    page.set_content(html, wait_until="load")
    assert page.locator("h1").inner_text() == hostile
    assert page.evaluate("window.hit") is None
    assert page.evaluate("document.compatMode") == "CSS1Compat"
    assert asked == []
    assert complaints == []
    page.close()


def test_report_is_nowhere_wider_than_its_page(browser: Browser) -> None:
    page = browser.new_page()
    page.set_content(make_report(OPTIMAL).decode(), wait_until="load")
    for width in (360, 820, 1280):
        page.set_viewport_size({"width": width, "height": 900})
        assert page.evaluate("document.documentElement.scrollWidth") <= width
        # Words of drawings stay within them.
        beyond = page.evaluate(
            """() => [...document.querySelectorAll('svg')].flatMap(svg => {
                const frame = svg.getBoundingClientRect();
                return [...svg.querySelectorAll('text')].filter(text => {
                    const box = text.getBoundingClientRect();
                    return box.left < frame.left - 1 || box.right > frame.right + 1
                        || box.top < frame.top - 1 || box.bottom > frame.bottom + 1;
                }).map(text => text.textContent);
            })"""
        )
        assert beyond == [], width
    page.close()


def test_report_as_pdf_is_the_same_page_on_paper(
    capsys: pytest.CaptureFixture[str], tmp_path: Path
) -> None:
    out = tmp_path / "report.pdf"
    assert run(["report", "--out", str(out)]) == 0
    assert capsys.readouterr().out == f"{out}\n"
    data = out.read_bytes()
    assert data.startswith(b"%PDF-")
    assert b"%%EOF" in data[-32:]
    pages = len(re.findall(rb"/Type\s*/Page\b(?!s)", data))
    assert 5 <= pages <= 12
    counted = max(int(number) for number in re.findall(rb"/Count (\d+)", data))
    assert counted >= pages
    # A4 in points, and bookmarks to the sections.
    assert re.search(rb"/MediaBox \[0 0 59[45][.\d]* 84[12][.\d]*\]", data)
    assert b"/Outlines" in data


@pytest.mark.long
def test_report_looks_like_its_stored_picture(browser: Browser) -> None:
    # Text in another font of the same size is as far off as panels are.
    limit = Likeness(structure=0.3, colour=2.5, spot=100.0)
    expected = (FOLDER / "report.png").read_bytes()
    assert_alike("report", expected, draw_report(browser), limit)
