"""Requests that failed unexpectedly are saved, reported, limited in number and run again."""

from __future__ import annotations

import io
import json
import os
import subprocess
import sys
from pathlib import Path
from queue import Queue
from typing import Any

import numpy as np
import pytest

from explorer.app.features.singularity.tasks import StrataRequest
from explorer.app.session import faults as module
from explorer.app.session.faults import Fault, Faults, log_fault, read_fault
from explorer.app.session.jobs import RESTARTED, Worker
from explorer.errors import InputError
from explorer.mechanism.design_file import PRESETS
from explorer.mechanism.home import home_pose
from tests.app import telling

ROOT = Path(__file__).resolve().parents[2]
TASKS = telling.__name__
PATIENCE = 120.0
OPTIMAL = PRESETS["paper-optimal"]


def a_fault(number: int = 0, **changes: Any) -> Fault:
    given: dict[str, Any] = {
        "module": TASKS,
        "task": "fail",
        "arguments": (1.5, ("δ", "−"), np.arange(3.0), StrataRequest(OPTIMAL, home_pose(OPTIMAL))),
        "is_sending": True,
        "problem": "ValueError: it failed",
        "trace": f'Traceback\n  File "telling.py", line {number}, in fail\nValueError: it failed\n',
    }
    return Fault(**(given | changes))


def asked(worker: Worker, task: str, *arguments: Any, is_sending: bool = True) -> str:
    """Return how a task failed."""
    failed: Queue[str] = Queue()
    told: Queue[object] = Queue()
    hear = told.put if is_sending else None
    worker.submit(
        "task", getattr(telling, task), arguments, lambda _: failed.put("done"), failed.put, hear
    )
    return failed.get(timeout=PATIENCE)


def test_fault_of_a_task_is_saved_and_message_and_log_say_where(
    tmp_path: Path, capfd: pytest.CaptureFixture[str]
) -> None:
    reports: list[str] = []
    worker = Worker(reports.append, faults=Faults(tmp_path / "faults"))
    try:
        problem = asked(worker, "fail", 2.5, ("a", "b"))
    finally:
        worker.stop()
    assert problem == "ValueError: setting 2.5 with ('a', 'b')"
    (path,) = (tmp_path / "faults").iterdir()
    (report,) = reports
    assert problem in report
    assert str(path) in report
    kept = read_fault(path)
    assert (kept.module, kept.task, kept.is_sending) == (TASKS, "fail", True)
    assert kept.arguments == (2.5, ("a", "b"))
    assert kept.problem == problem
    assert "in fail" in kept.trace
    log = capfd.readouterr().err
    assert str(path) in log
    assert "Traceback" in log


def test_request_that_kills_its_process_twice_is_saved(tmp_path: Path) -> None:
    reports: list[str] = []
    worker = Worker(reports.append, died="it died", faults=Faults(tmp_path))
    try:
        assert asked(worker, "fall", is_sending=False) == "it died"
    finally:
        worker.stop()
    (path,) = tmp_path.iterdir()
    assert reports == [RESTARTED, f"it died; the request is kept in {str(path)!r}"]
    assert read_fault(path).task == "fall"


def test_refusal_is_no_fault(tmp_path: Path) -> None:
    reports: list[str] = []
    worker = Worker(reports.append, faults=Faults(tmp_path))
    try:
        assert asked(worker, "refuse") == "refused on purpose"
    finally:
        worker.stop()
    assert not reports
    assert not list(tmp_path.iterdir())


def test_saved_request_is_read_back_with_all_its_arguments(tmp_path: Path) -> None:
    Faults(tmp_path).save(a_fault())
    (path,) = tmp_path.iterdir()
    number, words, array, request = read_fault(path).arguments
    assert (number, words) == (1.5, ("δ", "−"))
    assert np.array_equal(array, np.arange(3.0))
    assert request == StrataRequest(OPTIMAL, home_pose(OPTIMAL))
    # What people read in it.
    text = json.loads(path.read_text(encoding="utf-8"))
    assert text["problem"] == "ValueError: it failed"
    assert "19.1829" in text["arguments"][3]
    assert text["versions"]["numpy"] == np.__version__


def test_newest_fault_of_each_kind_and_newest_kinds_are_kept(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(module, "MOST_FILES", 3)
    kept = Faults(tmp_path)
    for number in range(5):
        kept.save(a_fault(number, arguments=(number,)))
        for age, path in enumerate(sorted(tmp_path.iterdir(), key=lambda p: p.stat().st_mtime_ns)):
            os.utime(path, ns=(number * 100 + age, number * 100 + age))
    # The message of an error may have numbers in it, and is another each time.
    kept.save(a_fault(4, arguments=(99,), trace=a_fault(4).trace.replace("it failed", "again")))
    found = sorted(read_fault(path).arguments for path in tmp_path.iterdir())
    assert found == [(2,), (3,), (99,)]


def test_too_large_request_is_saved_without_its_arguments(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(module, "MOST_PACKED", 1000)
    noise = np.random.default_rng(1).bytes(5000)
    Faults(tmp_path).save(a_fault(arguments=(noise,)))
    (path,) = tmp_path.iterdir()
    assert path.stat().st_size < 10_000
    with pytest.raises(InputError, match="too large"):
        read_fault(path)


def test_folder_that_takes_no_file_is_reported(tmp_path: Path) -> None:
    (tmp_path / "faults").write_text("in the way")
    assert "could not be kept" in Faults(tmp_path / "faults").save(a_fault())


@pytest.mark.parametrize("text", ["", "{}", '{"packed": 1}', "[]"])
def test_other_file_is_refused(tmp_path: Path, text: str) -> None:
    path = tmp_path / "x.json"
    path.write_text(text)
    with pytest.raises(InputError):
        read_fault(path)


def test_saved_request_is_run_again_by_one_command(tmp_path: Path) -> None:
    Faults(tmp_path).save(a_fault(arguments=(7.0, ("x",))))
    Faults(tmp_path).save(a_fault(task="say", arguments=("hello",), is_sending=False))
    fail, say = sorted(tmp_path.iterdir())
    command = [sys.executable, str(ROOT / "tests" / "tools" / "again.py")]
    done = subprocess.run(
        [*command, str(fail)], capture_output=True, text=True, check=False, timeout=PATIENCE
    )
    assert done.returncode == 1
    assert "setting 7.0 with" in done.stderr
    assert "in fail" in done.stderr
    done = subprocess.run(
        [*command, str(say)], capture_output=True, text=True, check=False, timeout=PATIENCE
    )
    assert done.returncode == 0
    assert "hello" in done.stdout


def test_fault_that_neither_file_nor_log_can_take_is_reported(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    closed = io.StringIO()
    closed.close()
    monkeypatch.setattr(sys, "stderr", closed)
    half = a_fault(problem="ValueError: \ud800")
    assert "could not be kept" in log_fault(half, "it failed", Faults(tmp_path))


def test_kind_of_a_fault_is_where_it_was_raised_whatever_its_message() -> None:
    first = a_fault(trace='  File "telling.py", line 3, in fail\nValueError: 1\nof 2\n')
    second = a_fault(trace='  File "telling.py", line 3, in fail\nValueError: 7\nof 9\n')
    assert first.kind == second.kind
    assert first.kind != a_fault(4).kind
