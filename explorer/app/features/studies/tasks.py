"""The task of the process of small studies."""

from __future__ import annotations

from pathlib import Path

from explorer.app.session.worker import Channel
from explorer.sweep.run import Progress, run_study
from explorer.sweep.study import Study
from explorer.sweep.workers import LocalWorkers, cores


def run(study: Study, folder: Path, channel: Channel) -> Progress:
    """Compute the missing designs of a study, and send the progress after each part.

    One core remains for the page.

    Args:
        study: The study.
        folder: Folder of its results.
        channel: Channel to the parent.

    Raises:
        InputError: the study cannot be run, or the folder is another's or in use.
        StorageError: the folder cannot be written.
        MissingExtraError: pyarrow is not installed.
        RunError: the workers are gone.
    """
    workers = LocalWorkers(max(1, cores() - 1))
    try:
        return run_study(study, folder, workers, watch=channel.send, stop=channel.is_cancelled)
    finally:
        # Designs of a cancelled study that are being computed are not needed.
        workers.shutdown(cancel_futures=True)
