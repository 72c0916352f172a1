"""`explorer sweep`: a study of many designs, on this machine or a cluster, and its Pareto front."""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import msgspec
import tyro

from explorer.cli.options import JsonOptions, load
from explorer.cli.output import figure, table, write_json, write_lines
from explorer.cli.progress import Meter
from explorer.cli.streams import complain, write
from explorer.cli.usage import UsageError
from explorer.cli.values import whole_number
from explorer.mechanism.design_file import encode_design

if TYPE_CHECKING:
    from explorer.sweep.results import Summary
    from explorer.sweep.rows import Value
    from explorer.sweep.run import Progress
    from explorer.sweep.study import Study
    from explorer.sweep.workers import Workers

_PROGRAM = "explorer sweep"
_OPTIONAL = tyro.conf.arg(help_behavior_hint="(optional)")
_FILE = tyro.conf.arg(metavar="FILE", help_behavior_hint="(optional)")

# Rows of the front that people are shown; all are in the JSON.
SHOWN = 20


@dataclass(frozen=True, kw_only=True)
class Sweep(JsonOptions):
    """Measure many designs as a study says, on every core or a cluster; tell the front.

    The results are kept as Parquet, and killed at any point, the same command goes on where it
    was. `--summary` prints the Pareto front of a folder of results. Needs the extra `study`.
    """

    study: Annotated[
        str | None, tyro.conf.Positional, tyro.conf.arg(metavar="[STUDY]", help_behavior_hint="")
    ] = None
    """A study file (JSON), or one that comes along (trade-off)."""

    out: Annotated[
        Path | None, tyro.conf.arg(metavar="FOLDER", help_behavior_hint="(needed for results)")
    ] = None
    """The folder of the results, a part file for each chunk; made if it is not there."""

    design: Annotated[
        str | None,
        tyro.conf.arg(metavar="PRESET_OR_FILE", help_behavior_hint="(default: the study's)"),
    ] = None
    """A preset, a design file, or a design that was saved on the page, by its name, to vary
    instead of the study's own."""

    workers: Annotated[
        int | None,
        whole_number("--workers", 1, 1024),
        tyro.conf.arg(help_behavior_hint="(default: one a core)"),
    ] = None
    """How many processes of this machine evaluate designs."""

    scheduler: Annotated[
        str | None, tyro.conf.arg(metavar="tcp://HOST:PORT", help_behavior_hint="(optional)")
    ] = None
    """A Dask scheduler whose workers evaluate them instead; needs the extra `cluster`."""

    limit: Annotated[int | None, whole_number("--limit", 1, 2**30), _OPTIONAL] = None
    """End after about so many more designs; the same command goes on."""

    summary: Annotated[bool, tyro.conf.FlagCreatePairsOff] = False
    """Tell what the folder holds, and its Pareto front, and compute nothing."""

    row: Annotated[int | None, whole_number("--row", 0, 2**30), _OPTIONAL] = None
    """Write the design with this index in the results as a design file, and compute nothing."""

    new: Annotated[bool, tyro.conf.FlagCreatePairsOff] = False
    """Write a study file to begin with, and compute nothing."""

    def run(self) -> None:
        """Compute what is missing in the folder, and write what it holds.

        Raises:
            InputError: a study, folder, index or scheduler that cannot be used.
            RunError: the workers were lost or cannot do the work.
            MissingExtraError: an extra is not installed.
        """
        if self.new:
            self._write_study()
            return
        if self.out is None:
            raise UsageError("name the folder of the results with --out", _PROGRAM)
        if self.summary or self.row is not None:
            if self.row is not None:
                self._write_design(self.out, self.row)
            else:
                self._write_summary(self.out)
            return
        if self.study is None:
            raise UsageError(
                "name a study file, or give --summary for what the folder holds", _PROGRAM
            )
        self._compute(self._asked(self.study), self.out)

    def _asked(self, name: str) -> Study:
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
                    told=lambda progress: meter.show(_progress_line(progress), _share(progress)),
                )
            except KeyboardInterrupt:
                meter.clear()
                complain("stopped; what is finished is kept, and the same command goes on")
                raise
            finally:
                # However it ends, the tasks under way are of no use any more.
                workers.shutdown(cancel_futures=True)
        if self.json:
            write_json(_progress_json(progress) | {"study": study.name, "folder": str(folder)})
        else:
            write_lines(*_progress_lines(study, folder, progress))

    def _workers(self) -> Workers:
        if self.scheduler is None:
            from explorer.sweep.workers import LocalWorkers

            return LocalWorkers(self.workers)
        if self.workers is not None:
            raise UsageError("give one of --workers and --scheduler, not both", _PROGRAM)
        from explorer.sweep.cluster import DaskWorkers

        workers = DaskWorkers(self.scheduler)
        if not workers.threads:
            complain(
                f"no worker has come to the scheduler yet: start one with dask worker "
                f"{self.scheduler}"
            )
        return workers

    def _write_summary(self, folder: Path) -> None:
        from explorer.sweep.results import summarise

        found = summarise(folder)
        if found.damaged:
            one = found.damaged == 1
            complain(
                f"{found.damaged} damaged part{' is' if one else 's are'} left out; a run computes "
                f"{'it' if one else 'them'} again"
            )
        if found.strays:
            more = f" and {len(found.strays) - 1} more" if len(found.strays) > 1 else ""
            complain(
                f"left out, since no part of the study has that name: {found.strays[0]!r}{more}; "
                "move such files away, for what reads the whole folder reads them too"
            )
        if self.json:
            write_json(_summary_json(found, folder))
        else:
            write_lines(*_summary_lines(found))

    def _write_design(self, folder: Path, index: int) -> None:
        from explorer.sweep.results import design_at

        write(encode_design(design_at(folder, index)).decode())

    def _write_study(self) -> None:
        from explorer.sweep.study import STUDIES, encode_study

        study = self._asked(self.study or next(iter(STUDIES)))
        write(encode_study(study).decode())


def _share(progress: Progress) -> float:
    return progress.done / progress.total


def _progress_line(progress: Progress) -> str:
    text = f"{progress.done} of {progress.total} designs"
    if progress.rate > 0.0:
        text += f", {progress.rate:.3g}/s"
    left = progress.seconds_left
    if left:
        text += f", {_duration(left)} left"
    odd = progress.done - progress.counts.get("done", 0)
    return text + (f", {odd} not done" if odd else "")


def _progress_json(progress: Progress) -> dict[str, object]:
    return {
        "total": progress.total,
        "done": progress.done,
        "computed": progress.done - progress.kept,
        "complete": progress.is_complete,
        "counts": _ordered(progress.counts),
        "seconds": progress.seconds,
    }


def _progress_lines(study: Study, folder: Path, progress: Progress) -> list[str]:
    computed = progress.done - progress.kept
    lines = [
        f"{study.name}: {progress.done} of {progress.total} designs in {folder}",
        f"computed now: {computed} in {_duration(progress.seconds)}"
        + (f", {progress.rate:.3g}/s" if computed else ""),
        *_count_lines(progress.counts),
    ]
    if not progress.is_complete:
        lines.append("not complete: the same command goes on")
    return lines


def _summary_json(found: Summary, folder: Path) -> dict[str, object]:
    return {
        "study": found.study.name,
        "folder": str(folder),
        "total": found.study.count,
        "rows": found.count,
        "complete": found.count == found.study.count,
        "counts": _ordered(found.counts),
        "incomparable": found.incomparable,
        "damaged_parts": found.damaged,
        "stray_files": found.strays,
        "objectives": json.loads(msgspec.json.encode(found.study.objectives)),
        "front": found.front,
    }


def _summary_lines(found: Summary) -> list[str]:
    study = found.study
    lines = [
        f"{study.name}: {found.count} of {study.count} designs",
        *_count_lines(found.counts),
        "",
    ]
    if not study.objectives:
        return [*lines, "the study names no objectives, so it has no front"]
    named = [each.measure for each in study.objectives]
    wanted = ", ".join(f"{each.measure} {each.sense}" for each in study.objectives)
    lines.append(f"Pareto front ({wanted}): {len(found.front)} designs")
    if found.incomparable:
        lines.append(
            f"done but without a measure that is wanted, so not in it: {found.incomparable}"
        )
    others = [name for name in study.varied if name not in named]
    shown = _spread(found.front)
    cells = [("index", *named, *others)]
    cells += [_cells(row, [*named, *others]) for row in shown]
    if shown:
        lines.append(table(cells, ">" * len(cells[0])))
    if len(shown) < len(found.front):
        lines.append(f"{len(shown)} of them, evenly spread; --json has all")
    return lines


def _cells(row: Mapping[str, Value], names: Sequence[str]) -> tuple[str, ...]:
    return (str(row["index"]), *(figure(float(row[name] or 0.0)) for name in names))


def _spread(rows: list[dict[str, Value]]) -> list[dict[str, Value]]:
    """Return some rows from the first to the last."""
    if len(rows) <= SHOWN:
        return rows
    return [rows[round(k * (len(rows) - 1) / (SHOWN - 1))] for k in range(SHOWN)]


def _count_lines(counts: Mapping[str, int]) -> list[str]:
    return [f"  {status}: {count}" for status, count in _ordered(counts).items()]


def _ordered(counts: Mapping[str, int]) -> dict[str, int]:
    """Return counts of statuses, most frequent first."""
    return dict(sorted(counts.items(), key=lambda each: (-each[1], each[0])))


def _duration(seconds: float) -> str:
    """Return a duration in the two units that suit it."""
    if seconds < 60.0:
        return f"{seconds:.1f} s"
    whole = round(seconds)
    if whole < 3600:
        return f"{whole // 60} min {whole % 60} s"
    return f"{whole // 3600} h {whole % 3600 // 60} min"
