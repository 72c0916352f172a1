"""`explorer sweep`: a study of many designs, on this machine or a cluster, and its front."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import msgspec
import tyro

from explorer.cli.answers.study import (
    progress_json,
    progress_line,
    progress_lines,
    summary_json,
    summary_lines,
)
from explorer.cli.options import JsonOptions, load
from explorer.cli.progress import Meter
from explorer.cli.streams import write, write_error
from explorer.cli.usage import UsageError
from explorer.cli.values import DESIGN_NAME, OPTIONAL, Flag, hint, whole_number
from explorer.mechanism.design_file import encode_design

if TYPE_CHECKING:
    from explorer.sweep.study import Study
    from explorer.sweep.workers import Workers

_PROGRAM = "explorer sweep"


@dataclass(frozen=True, kw_only=True)
class Sweep(JsonOptions):
    """Measure the designs of a study, on every core or a cluster; list the Pareto front.

    The results are Parquet files; after an interruption at any point the same command continues.
    `--summary` prints the Pareto front of a folder of results. Needs the extra `study`.
    """

    study: Annotated[
        str | None, tyro.conf.Positional, tyro.conf.arg(metavar="[STUDY]", help_behavior_hint="")
    ] = None
    """Study file (JSON), or a built-in study (trade-off)."""

    out: Annotated[Path | None, hint("needed for results", "FOLDER")] = None
    """Folder of the results, with one file per chunk; created if it does not exist."""

    design: Annotated[str | None, hint("default: the study's", DESIGN_NAME)] = None
    """Design to vary instead of the study's own: a preset, a design file, or the name of a design
    saved on the page."""

    workers: Annotated[
        int | None, whole_number("--workers", 1, 1024), hint("default: one a core")
    ] = None
    """Number of processes of this machine that evaluate designs."""

    scheduler: Annotated[str | None, hint("optional", "tcp://HOST:PORT")] = None
    """Dask scheduler whose workers evaluate designs instead; needs the extra `cluster`."""

    limit: Annotated[int | None, whole_number("--limit", 1, 2**30), OPTIONAL] = None
    """Stop after about this many further designs; the same command continues."""

    summary: Flag = False
    """Summarise the folder with its Pareto front, and compute nothing."""

    row: Annotated[int | None, whole_number("--row", 0, 2**30), OPTIONAL] = None
    """Write the design with this index in the results as a design file, and compute nothing."""

    new: Flag = False
    """Write an example of a study file, and compute nothing."""

    def run(self) -> None:
        """Compute the missing designs and summarise the folder.

        Raises:
            RunError: The workers were lost or cannot evaluate designs.
            MissingExtraError: An extra is not installed.
        """
        if self.new:
            self._write_study()
            return
        if self.out is None:
            raise UsageError("name the folder of the results with --out", _PROGRAM)
        if self.row is not None:
            from explorer.sweep.results import design_at

            write(encode_design(design_at(self.out, self.row)).decode())
        elif self.summary:
            self._write_summary(self.out)
        elif self.study is not None:
            self._compute(self._load_study(self.study), self.out)
        else:
            raise UsageError(
                "name a study file, or give --summary to summarise the folder", _PROGRAM
            )

    def _load_study(self, name: str) -> Study:
        from explorer.sweep.study import load_study

        study = load_study(name)
        if self.design is None:
            return study
        return msgspec.structs.replace(study, design=load(self.design))

    def _compute(self, study: Study, folder: Path) -> None:
        from explorer.sweep.run import run_study

        workers = self._workers()
        with Meter() as meter:
            try:
                progress = run_study(
                    study,
                    folder,
                    workers,
                    limit=self.limit,
                    watch=lambda progress: meter.show(
                        progress_line(progress), progress.done / progress.total
                    ),
                )
            except KeyboardInterrupt:
                meter.clear()
                write_error("stopped; finished designs are kept, and the same command continues")
                raise
            finally:
                # Pending tasks are useless after any kind of end.
                workers.shutdown(cancel_futures=True)
        self.write(
            lambda: progress_json(progress) | {"study": study.name, "folder": folder},
            lambda: progress_lines(study, folder, progress),
        )

    def _workers(self) -> Workers:
        if self.scheduler is None:
            from explorer.sweep.workers import LocalWorkers

            return LocalWorkers(self.workers)
        if self.workers is not None:
            raise UsageError("give one of --workers and --scheduler, not both", _PROGRAM)
        from explorer.sweep.cluster import DaskWorkers

        workers = DaskWorkers(self.scheduler)
        if not workers.threads:
            write_error(
                f"the scheduler has no worker yet: start one with dask worker {self.scheduler}"
            )
        return workers

    def _write_summary(self, folder: Path) -> None:
        from explorer.sweep.results import summarise

        summary = summarise(folder)
        if summary.damaged:
            one = summary.damaged == 1
            write_error(
                f"{summary.damaged} damaged part{' is' if one else 's are'} left out; "
                f"a run computes {'it' if one else 'them'} again"
            )
        if summary.strays:
            more = f" and {len(summary.strays) - 1} more" if len(summary.strays) > 1 else ""
            write_error(
                f"left out, since no part of the study has that name: {summary.strays[0]!r}{more}; "
                "move such files away, because programs that read the whole folder read them too"
            )
        self.write(lambda: summary_json(summary, folder), lambda: summary_lines(summary))

    def _write_study(self) -> None:
        from explorer.sweep.study import STUDIES, encode_study

        study = self._load_study(self.study or next(iter(STUDIES)))
        write(encode_study(study).decode())
