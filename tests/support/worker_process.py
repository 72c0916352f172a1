"""The child process of a worker."""

from __future__ import annotations

from explorer.app.session.worker import Worker


def process_id(worker: Worker) -> int | None:
    """Return the id of the child process of a worker; None if it has not been needed yet."""
    process = worker._process
    return None if process is None else process.pid
