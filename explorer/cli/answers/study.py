"""The progress and the results of a study, for `explorer sweep`."""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
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
    odd = progress.done - progress.counts.get("done", 0)
    return text + (f", {odd} not done" if odd else "")


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


def progress_lines(study: Study, folder: Path, progress: Progress) -> list[str]:
    """Return the progress at the end of a run as lines of text."""
    computed = progress.done - progress.kept
    lines = [
        f"{study.name}: {progress.done} of {progress.total} designs in {folder}",
        f"computed now: {computed} in {_duration(progress.seconds)}"
        + (f", {progress.rate:.3g}/s" if computed else ""),
        *_count_lines(progress.counts),
    ]
    if not progress.is_complete:
        lines.append("not complete: the same command continues")
    return lines


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
        "objectives": json.loads(msgspec.json.encode(summary.study.objectives)),
        "front": summary.front,
    }


def summary_lines(summary: Summary) -> list[str]:
    """Return the results of a study as lines of text, with the Pareto front."""
    study = summary.study
    lines = [
        f"{study.name}: {summary.count} of {study.count} designs",
        *_count_lines(summary.counts),
        "",
    ]
    if not study.objectives:
        return [*lines, "the study names no objectives, so it has no front"]
    named = [each.measure for each in study.objectives]
    objectives = ", ".join(f"{each.measure} {each.sense}" for each in study.objectives)
    lines.append(f"Pareto front ({objectives}): {len(summary.front)} designs")
    if summary.incomparable:
        lines.append(
            f"without a value of an objective, so not in the front: {summary.incomparable}"
        )
    others = [name for name in study.varied if name not in named]
    shown = _spread(summary.front)
    cells = [("index", *named, *others)]
    cells += [_cells(row, [*named, *others]) for row in shown]
    if shown:
        lines.append(table(cells, ">" * len(cells[0])))
    if len(shown) < len(summary.front):
        lines.append(f"{len(shown)} of them, evenly spread; --json has all")
    return lines


def _cells(row: Mapping[str, Value], names: Sequence[str]) -> tuple[str, ...]:
    return (str(row["index"]), *(figure(float(row[name] or 0.0)) for name in names))


def _spread(rows: list[dict[str, Value]]) -> list[dict[str, Value]]:
    """Return at most `SHOWN` rows, evenly spread from the first to the last."""
    if len(rows) <= SHOWN:
        return rows
    return [rows[round(k * (len(rows) - 1) / (SHOWN - 1))] for k in range(SHOWN)]


def _count_lines(counts: Mapping[str, int]) -> list[str]:
    return [f"  {status}: {count}" for status, count in _ordered(counts).items()]


def _ordered(counts: Mapping[str, int]) -> dict[str, int]:
    """Return counts of statuses, most frequent first."""
    return dict(sorted(counts.items(), key=lambda each: (-each[1], each[0])))


def _duration(seconds: float) -> str:
    """Return a duration in words, such as 2 min 5 s."""
    if seconds < 60.0:
        return f"{seconds:.1f} s"
    whole = round(seconds)
    if whole < 3600:
        return f"{whole // 60} min {whole % 60} s"
    return f"{whole // 3600} h {whole % 3600 // 60} min"
