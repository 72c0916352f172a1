"""The report of a design as a file's contents; PDF is the same page, printed by a browser.

Plain values in and bytes out, so that it can be made in a process of its own. It imports no
viser, and HTML needs no browser.
"""

from __future__ import annotations

import datetime as dt
from concurrent.futures import ThreadPoolExecutor
from typing import Literal, get_args

from explorer.mechanism.design import Design
from explorer.mechanism.pose import Pose
from explorer.optimise.record import Record

ReportFormat = Literal["html", "pdf"]

FORMATS: tuple[ReportFormat, ...] = get_args(ReportFormat)


def make_report(
    design: Design,
    pose: Pose | None = None,
    *,
    record: Record | None = None,
    file_format: ReportFormat = "html",
    date: dt.date | None = None,
) -> bytes:
    """Return the report of a design.

    Args:
        design: The manipulator.
        pose: Of its platform, whose orientation the workspace has; its home pose if None.
        record: Of the search that found the design; its history is told then.
        file_format: HTML, or PDF by a headless browser.
        date: Of the report; today if None.

    Raises:
        MissingExtraError: PDF without Playwright or a Chromium.
        PictureError: the browser did not start.
    """
    from explorer.export.report.data import gather_report_data
    from explorer.export.report.document import report_html

    html = report_html(gather_report_data(design, pose, record), date or dt.date.today())
    if file_format == "html":
        return html.encode()
    # In a thread of its own: where an event loop runs, as in a notebook, the browser's calls
    # would be refused.
    with ThreadPoolExecutor(1) as pool:
        return pool.submit(_printed, html).result()


def _printed(html: str) -> bytes:
    from explorer.app.browser.headless import headless_browser

    with headless_browser() as browser:
        # A report has no scripts and fetches nothing; the browser is told so too.
        context = browser.new_context(java_script_enabled=False, offline=True)
        page = context.new_page()
        page.set_content(html, wait_until="load")
        return page.pdf(prefer_css_page_size=True, print_background=True, outline=True, tagged=True)
