"""The progress and the results of a study, for `explorer sweep`."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import TYPE_CHECKING

import msgspec

from explorer.cli.output import figure, table

if TYPE_CHECKING:
    from explorer.sweep.results import Summary
    from explorer.sweep.rows import Value
    from explorer.sweep.run import Progress
    from explorer.sweep.study import Study


SHOWN = 20
"""The largest number of rows of the front in the text; the JSON has all."""


def progress_line(progress: Progress) -> str:
    """Return the line beside the progress bar."""
    text = f"{progress.done} of {progress.total} designs"
    if progress.rate > 0.0:
        text += f", {progress.rate:.3g}/s"
    left = progress.seconds_left
    if left:
        text += f", {_duration(left)} left"
    failed = progress.done - progress.counts.get("done", 0)
    return text + (f", {failed} not done" if failed else "")


def progress_json(progress: Progress) -> dict[str, object]:
    """Return the progress at the end of a run as plain values."""
    return {
        "total": progress.total,
        "done": progress.done,
        "computed": progress.done - progress.kept,
        "complete": progress.is_complete,
        "counts": _ordered(progress.counts),
        "seconds": progress.seconds,
    }


def progress_lines(study: Study, folder: Path, progress: Progress) -> Iterator[str]:
    """Yield the progress at the end of a run as lines of text."""
    computed = progress.done - progress.kept
    rate = f", {progress.rate:.3g}/s" if computed else ""
    yield f"{study.name}: {progress.done} of {progress.total} designs in {folder}"
    yield f"computed now: {computed} in {_duration(progress.seconds)}{rate}"
    yield from _count_lines(progress.counts)
    if not progress.is_complete:
        yield "not complete: the same command continues"


def summary_json(summary: Summary, folder: Path) -> dict[str, object]:
    """Return the results of a study as plain values."""
    return {
        "study": summary.study.name,
        "folder": str(folder),
        "total": summary.study.count,
        "rows": summary.count,
        "complete": summary.count == summary.study.count,
        "counts": _ordered(summary.counts),
        "incomparable": summary.incomparable,
        "damaged_parts": summary.damaged,
        "stray_files": summary.strays,
        "objectives": msgspec.to_builtins(summary.study.objectives),
        "front": summary.front,
    }


def summary_lines(summary: Summary) -> Iterator[str]:
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
    names = [*dict.fromkeys([*(goal.measure for goal in study.objectives), *study.varied])]
    shown = _spread(summary.front)
    if shown:
        rows = [("index", *names)]
        rows += [
            (str(row["index"]), *(figure(float(row[name] or 0.0)) for name in names))
            for row in shown
        ]
        yield table(rows, ">" * len(rows[0]))
    if len(shown) < len(summary.front):
        yield f"{len(shown)} of them, evenly spread; --json has all"


def _spread(rows: list[dict[str, Value]]) -> list[dict[str, Value]]:
    """Return at most `SHOWN` rows, evenly spread from the first to the last."""
    if len(rows) <= SHOWN:
        return rows
    return [rows[round(k * (len(rows) - 1) / (SHOWN - 1))] for k in range(SHOWN)]


def _count_lines(counts: Mapping[str, int]) -> list[str]:
    return [f"  {status}: {count}" for status, count in _ordered(counts).items()]


def _ordered(counts: Mapping[str, int]) -> dict[str, int]:
    """Return counts of statuses, most frequent first."""
    return dict(sorted(counts.items(), key=lambda count: (-count[1], count[0])))


def _duration(seconds: float) -> str:
    """Return a duration in words, such as 2 min 5 s."""
    if seconds < 60.0:
        return f"{seconds:.1f} s"
    whole = round(seconds)
    if whole < 3600:
        return f"{whole // 60} min {whole % 60} s"
    return f"{whole // 3600} h {whole % 3600 // 60} min"
