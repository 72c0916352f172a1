"""The report of a design as bytes: HTML, or the same page printed as PDF by a browser.

A worker process makes it, so it takes plain values. It imports no viser, and HTML needs no browser.
"""

from __future__ import annotations

import datetime as dt
from concurrent.futures import ThreadPoolExecutor
from typing import Literal

from explorer.find.requirement import Requirement
from explorer.mechanism.design import Design
from explorer.mechanism.pose import Pose
from explorer.optimise.outcome import Record
from explorer.paths.drives import TimedPath

ReportFormat = Literal["html", "pdf"]


def make_report(
    design: Design,
    pose: Pose | None = None,
    record: Record | None = None,
    file_format: ReportFormat = "html",
    path: TimedPath | None = None,
    requirement: Requirement | None = None,
    in_mm: bool = False,
    *,
    date: dt.date | None = None,
) -> bytes:
    """Return the report of a design.

    Args:
        design: The manipulator.
        pose: Pose of its platform, whose orientation the workspace has; home if None.
        record: Record of the search that gave the design, which adds its history.
        file_format: HTML, or PDF by a headless browser.
        path: Path whose speeds and forces are told.
        requirement: Requirement that the design is checked against.
        in_mm: Whether lengths are in millimetres alone, rather than in design units too.
        date: Date of the report; today if None.

    Raises:
        MissingExtraError: PDF without Playwright or a Chromium.
        PictureError: The browser did not start.
    """
    from explorer.export.report.data import ReportData
    from explorer.export.report.document import report_html

    data = ReportData(design, pose=pose, record=record, path=path, requirement=requirement)
    html = report_html(data.in_millimetres() if in_mm else data, date or dt.date.today())
    if file_format == "html":
        return html.encode()
    # Playwright refuses calls on a thread with an event loop, such as a notebook's.
    with ThreadPoolExecutor(1) as pool:
        return pool.submit(_print, html).result()


def _print(html: str) -> bytes:
    from explorer.page.browser.headless import headless_browser

    with headless_browser() as browser:
        # A report has no scripts and fetches nothing; the browser ensures that.
        page = browser.new_context(java_script_enabled=False, offline=True).new_page()
        page.set_content(html, wait_until="load")
        return page.pdf(prefer_css_page_size=True, print_background=True, outline=True, tagged=True)
