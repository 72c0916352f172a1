"""The worker's tasks for records and reports."""

from __future__ import annotations

from explorer.app.features.sharing.reporting import ReportFormat, make_report
from explorer.export.session_log import SessionTable, session_csv
from explorer.mechanism.design import Design
from explorer.mechanism.pose import Pose
from explorer.optimise.record import Record


def export_session(table: SessionTable) -> bytes:
    """Return the poses of a session as comma-separated values."""
    return session_csv(table).encode()


def export_report(
    design: Design, pose: Pose, record: Record | None, file_format: ReportFormat
) -> bytes:
    """Return the report of a design in a pose, with the record of its search if there is one.

    Raises:
        ExplorerError: PDF without a browser to print it.
    """
    return make_report(design, pose, record=record, file_format=file_format)
