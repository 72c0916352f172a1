"""What the process of small studies does: it runs one and tells how far it is."""

from __future__ import annotations

from pathlib import Path

from explorer.app.session.worker import Line
from explorer.sweep.run import Progress, run_study
from explorer.sweep.study import Study
from explorer.sweep.workers import LocalWorkers, cores


def run(study: Study, folder: Path, line: Line) -> Progress:
    """Compute what is missing of a study, telling the progress after each part.

    One core is left to the page.

    Args:
        study: The study.
        folder: For its results.
        line: To the parent.

    Raises:
        InputError: the study cannot be run, or the folder is another's or in use.
        StorageError: the folder cannot be written.
        MissingExtraError: pyarrow is not installed.
        RunError: the workers are gone.
    """
    workers = LocalWorkers(max(1, cores() - 1))
    try:
        return run_study(study, folder, workers, told=line.tell, is_cut=line.is_cut)
    finally:
        # Of a study that was cancelled nothing under way is of use any more.
        workers.shutdown(cancel_futures=True)
