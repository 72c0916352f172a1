"""`explorer sweep`: a study of many designs, on this machine or a cluster, and its front."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated

import msgspec
import tyro

from explorer.cli import options, output, values
from explorer.cli.streams import Meter, write, write_error
from explorer.errors import InputError
from explorer.mechanism.design_file import encode_design
from explorer.sweep import results, study as studies, workers as pools
from explorer.sweep.cluster import DaskWorkers
from explorer.sweep.run import Progress, run_study


@dataclass(frozen=True, kw_only=True)
class SweepCommand(options.JsonOptions):
    """Measure the designs of a study, on every core or a cluster; list the Pareto front.

    The results are Parquet files; after an interruption at any point the same command continues.
    `--summary` prints the Pareto front of a folder of results. Needs the extra `study`.
    """

    study: Annotated[
        str | None, tyro.conf.Positional, tyro.conf.arg(metavar="[STUDY]", help_behavior_hint="")
    ] = None
    """Study file (JSON), or a built-in study (trade-off)."""

    out: Annotated[Path | None, values.hint("needed for results", "FOLDER")] = None
    """Folder of the results, with one file per chunk; created if it does not exist."""

    design: Annotated[str | None, values.hint("default: the study's", values.DESIGN_NAME)] = None
    """Design to vary instead of the study's own: a preset, a design file, or the name of a design
    saved on the page."""

    workers: Annotated[
        int | None, values.whole_number(1, 1024), values.hint("default: one a core")
    ] = None
    """Number of processes of this machine that evaluate designs."""

    scheduler: Annotated[str | None, values.hint("optional", "tcp://HOST:PORT")] = None
    """Dask scheduler whose workers evaluate designs instead; needs the extra `cluster`."""

    limit: Annotated[int | None, values.whole_number(1, 2**30), values.OPTIONAL] = None
    """Stop after about this many further designs; the same command continues."""

    summary: values.Flag = False
    """Summarise the folder with its Pareto front, and compute nothing."""

    row: Annotated[int | None, values.whole_number(0, 2**30), values.OPTIONAL] = None
    """Write the design with this index in the results as a design file, and compute nothing."""

    new: values.Flag = False
    """Write an example of a study file, and compute nothing."""

    def run(self) -> None:
        """Compute the missing designs and summarise the folder."""
        if self.new:
            study = self._load_study(self.study or next(iter(studies.STUDIES)))
            write(studies.encode_study(study).decode())
            return
        if self.out is None:
            raise InputError("name the folder of the results with --out")
        if self.row is not None:
            write(encode_design(results.load_results(self.out).design_at(self.row)).decode())
        elif self.summary:
            self._write_summary(self.out)
        elif self.study is not None:
            self._compute(self._load_study(self.study), self.out)
        else:
            raise InputError("name a study file, or give --summary to summarise the folder")

    def _load_study(self, name: str) -> studies.Study:
        return options.replace_given(
            studies.load_study(name),
            design=None if self.design is None else options.load(self.design),
        )

    def _compute(self, study: studies.Study, folder: Path) -> None:
        workers = self._workers()
        try:
            with Meter() as meter:
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
            write_error("stopped; finished designs are kept, and the same command continues")
            raise
        finally:
            # Pending tasks are useless after any kind of end.
            workers.shutdown(cancel_futures=True)
        self.write(
            lambda: {
                **output.attributes(progress, "total done"),
                "computed": progress.done - progress.kept,
                "complete": progress.is_complete,
                "counts": dict(progress.counts),
                "seconds": progress.seconds,
                "study": study.name,
                "folder": folder,
            },
            progress_lines(study, folder, progress),
        )

    def _workers(self) -> pools.Workers:
        if self.scheduler is None:
            return pools.LocalWorkers(self.workers)
        if self.workers is not None:
            raise InputError("give one of --workers and --scheduler, not both")
        workers = DaskWorkers(self.scheduler)
        if not workers.threads:
            write_error(
                f"the scheduler has no worker yet: start one with dask worker {self.scheduler}"
            )
        return workers

    def _write_summary(self, folder: Path) -> None:
        summary = results.summarise(folder)
        if summary.damaged:
            write_error(f"damaged parts are left out; a run computes them again: {summary.damaged}")
        if summary.strays:
            more = f" and {len(summary.strays) - 1} more" if len(summary.strays) > 1 else ""
            write_error(
                f"left out, since no part of the study has that name: {summary.strays[0]!r}{more}; "
                "move such files away, because programs that read the whole folder read them too"
            )
        self.write(
            lambda: {
                "study": summary.study.name,
                "folder": folder,
                "total": summary.study.count,
                "rows": summary.count,
                "complete": summary.count == summary.study.count,
                "counts": dict(summary.counts),
                "incomparable": summary.incomparable,
                "damaged_parts": summary.damaged,
                "stray_files": summary.strays,
                "objectives": msgspec.to_builtins(summary.study.objectives),
                "front": summary.front,
            },
            summary_lines(summary),
        )


SHOWN = 20
"""The largest number of rows of the front in the text; the JSON has all."""


def progress_line(progress: Progress) -> str:
    """Return the line beside the progress bar."""
    text = f"{progress.done} of {progress.total} designs"
    if progress.rate > 0.0:
        text += f", {progress.rate:.3g}/s"
    if progress.seconds_left:
        text += f", {_duration(progress.seconds_left)} left"
    failed = progress.done - progress.counts.get("done", 0)
    return text + (f", {failed} not done" if failed else "")


def progress_lines(study: studies.Study, folder: Path, progress: Progress) -> Iterator[str]:
    """Yield the progress at the end of a run as lines of text."""
    computed = progress.done - progress.kept
    rate = f", {progress.rate:.3g}/s" if computed else ""
    yield f"{study.name}: {progress.done} of {progress.total} designs in {folder}"
    yield f"computed now: {computed} in {_duration(progress.seconds)}{rate}"
    yield from _count_lines(progress.counts)
    if not progress.is_complete:
        yield "not complete: the same command continues"


def summary_lines(summary: results.Summary) -> Iterator[str]:
    """Yield the results of a study as lines of text, with the Pareto front."""
    study = summary.study
    yield f"{study.name}: {summary.count} of {study.count} designs"
    yield from (*_count_lines(summary.counts), "")
    if not study.objectives:
        yield "the study names no objectives, so it has no front"
        return
    objectives = ", ".join(f"{goal.measure} {goal.sense}" for goal in study.objectives)
    yield f"Pareto front ({objectives}): {len(summary.front)} designs"
    if summary.incomparable:
        yield f"without a value of an objective, so not in the front: {summary.incomparable}"
    names = [*dict.fromkeys([*(goal.measure for goal in study.objectives), *study.variables])]
    step = max(1.0, (len(summary.front) - 1) / (SHOWN - 1))
    rows = [summary.front[round(k * step)] for k in range(min(SHOWN, len(summary.front)))]
    if rows:
        cells = [
            (str(row["index"]), *(output.figure(float(row[n] or 0.0)) for n in names))
            for row in rows
        ]
        yield output.table([("index", *names), *cells], ">" * (1 + len(names)))
    if len(rows) < len(summary.front):
        yield f"{len(rows)} of them, evenly spread; --json has all"


def _count_lines(counts: Mapping[str, int]) -> list[str]:
    """Return the counts of statuses as lines of text, most frequent first."""
    return [f"  {status}: {count}" for status, count in Counter(counts).most_common()]


def _duration(seconds: float) -> str:
    """Return a duration in words, such as 2 min 5 s."""
    if seconds < 60.0:
        return f"{seconds:.1f} s"
    minutes, rest = divmod(round(seconds), 60)
    return f"{minutes} min {rest} s" if minutes < 60 else f"{minutes // 60} h {minutes % 60} min"
