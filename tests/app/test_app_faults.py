"""Requests that failed unexpectedly are saved, reported, limited in number and run again."""

from __future__ import annotations

import os
import runpy
import sys
from pathlib import Path
from queue import Queue
from typing import Any

import pytest

from explorer.app.session import faults as module
from explorer.app.session.faults import Fault, Faults, read_fault
from explorer.app.session.jobs import RESTARTED, Worker
from tests.app import telling

ROOT = Path(__file__).resolve().parents[2]
PATIENCE = 120.0
PROBLEM = "ValueError: setting 2.5 with ('a', 'b')"


def fault_of(number: int, line: int = 1) -> Fault:
    """Return a fault of a task that was given a number and failed in a line of its module."""
    trace = f'Traceback\n  File "telling.py", line {line}, in fail\nValueError: {number}\n'
    return Fault(telling.__name__, "fail", (number, ("x",)), True, f"ValueError: {number}", trace)


@pytest.mark.parametrize(
    ("task", "arguments", "problem", "reports"),
    [
        ("fail", (2.5, ("a", "b")), PROBLEM, [PROBLEM]),
        ("fall", (), "it died", [RESTARTED, "it died; the request is kept in"]),
        ("refuse", (), "refused on purpose", []),
    ],
)
def test_fault_of_a_task_is_saved_and_reported_unless_it_is_a_refusal(
    tmp_path: Path, task: str, arguments: tuple[Any, ...], problem: str, reports: list[str]
) -> None:
    told, failed = list[str](), Queue[str]()
    receive = None if task == "fall" else Queue[object]().put
    worker = Worker(told.append, died="it died", faults=Faults(tmp_path / "faults"))
    try:
        worker.submit(task, getattr(telling, task), arguments, failed.put, failed.put, receive)
        assert failed.get(timeout=PATIENCE) == problem
    finally:
        worker.stop()
    assert len(told) == len(reports)
    assert all(report in each for report, each in zip(reports, told, strict=True))
    kept = list((tmp_path / "faults").glob("*"))
    assert len(kept) == bool(reports)
    for path in kept:
        assert str(path) in told[-1]
        fault = read_fault(path)
        assert (fault.task, fault.arguments) == (task, arguments)


def test_newest_fault_of_each_kind_and_newest_kinds_are_kept(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(module, "MOST_FILES", 3)
    # The last one is of the kind of the one before: its message does not count.
    for count, (number, line) in enumerate([(0, 0), (1, 1), (2, 2), (3, 3), (4, 4), (99, 4)]):
        Faults(tmp_path).save(fault_of(number, line))
        for age, path in enumerate(sorted(tmp_path.iterdir(), key=lambda p: p.stat().st_mtime_ns)):
            os.utime(path, ns=(count * 100 + age, count * 100 + age))
    assert sorted(read_fault(path).arguments[0] for path in tmp_path.iterdir()) == [2, 3, 99]


def test_saved_request_is_run_again_by_one_command(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    Faults(tmp_path).save(fault_of(7))
    (path,) = tmp_path.iterdir()
    again = ROOT / "tests" / "tools" / "again.py"
    monkeypatch.setattr(sys, "argv", [str(again), str(path)])
    with pytest.raises(ValueError, match="setting 7 with"):
        runpy.run_path(str(again), run_name="__main__")
