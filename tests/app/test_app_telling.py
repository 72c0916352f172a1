"""Tasks that tell of themselves while they run, and are ended early: by a word, else by force."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
import threading
from collections.abc import Iterator
from pathlib import Path
from queue import Queue
from typing import Any

import pytest

from explorer.app.session import jobs
from explorer.app.session.jobs import RESTARTED, Worker
from explorer.app.session.worker import CANCELLED
from tests.app import telling

ROOT = Path(__file__).resolve().parents[2]
PATIENCE = 120.0
# Seconds that nothing here takes, however busy the machine is; and so few that all do.
NEVER, AT_ONCE = 3600.0, 0.001


class Ear:
    """What was heard, in order: what was told, then how it ended."""

    def __init__(self, worker: Worker) -> None:
        self._worker = worker
        self._heard: Queue[tuple[str, Any]] = Queue()
        self.number = -1

    def ask(
        self,
        task: str,
        *arguments: Any,
        key: str = "task",
        tells: bool = True,
        is_drawing: bool = False,
    ) -> None:
        self.number = self._worker.submit(
            key,
            getattr(telling, task),
            arguments,
            lambda value: self._heard.put(("done", value)),
            lambda problem: self._heard.put(("failed", problem)),
            receive=(lambda value: self._heard.put(("told", value))) if tells else None,
            is_drawing=is_drawing,
        )

    def next(self) -> tuple[str, Any]:
        return self._heard.get(timeout=PATIENCE)

    def all(self) -> tuple[list[Any], tuple[str, Any]]:
        """Return all that was told from now on, and the end."""
        told: list[Any] = []
        while (heard := self.next())[0] == "told":
            told.append(heard[1])
        return told, heard


@pytest.fixture
def reports() -> list[str]:
    return []


@pytest.fixture
def worker(reports: list[str]) -> Iterator[Worker]:
    made = Worker(reports.append, died="it died")
    yield made
    made.stop()


@pytest.fixture
def ear(worker: Worker) -> Ear:
    return Ear(worker)


def test_what_is_told_comes_whole_in_order_and_before_the_result(ear: Ear) -> None:
    ear.ask("count", 500)
    assert ear.all() == (list(range(500)), ("done", 500))


def test_it_comes_while_the_task_runs_and_a_word_ends_the_task(
    ear: Ear, worker: Worker, reports: list[str]
) -> None:
    ear.ask("count_until_cancelled")
    # The task ends for no other reason, so this came before its end.
    assert ear.next() == ("told", 0)
    process = worker.process_id
    worker.cancel(ear.number, NEVER)
    told, end = ear.all()
    assert end == ("done", len(told) + 1)
    ear.ask("say", "again", tells=False)
    assert ear.next() == ("done", "again")
    assert worker.process_id == process
    assert not reports


def test_what_is_cancelled_before_it_was_begun_ends_at_once(ear: Ear, worker: Worker) -> None:
    ear.ask("count_until_cancelled")
    worker.cancel(ear.number, NEVER)
    told, end = ear.all()
    assert end == ("done", len(told))


def test_the_next_task_is_not_cancelled_with_the_last(ear: Ear, worker: Worker) -> None:
    ear.ask("count_until_cancelled")
    worker.cancel(ear.number, NEVER)
    ear.all()
    ear.ask("count_until_cancelled")
    for number in range(20):
        assert ear.next() == ("told", number)
    worker.cancel(ear.number, NEVER)
    assert ear.all()[1][0] == "done"


def test_who_does_not_heed_the_word_is_ended_by_force_and_nobody_complains(
    ear: Ear, worker: Worker, reports: list[str]
) -> None:
    ear.ask("hang")
    assert ear.next() == ("told", 0)
    process = worker.process_id
    worker.cancel(ear.number, AT_ONCE)
    assert ear.next() == ("failed", "it died")
    assert not reports
    ear.ask("say", "again", tells=False)
    assert ear.next() == ("done", "again")
    assert worker.process_id != process


def test_what_does_not_tell_is_not_begun_once_it_is_cancelled(
    ear: Ear, worker: Worker, reports: list[str]
) -> None:
    ear.ask("count_until_cancelled")
    assert ear.next() == ("told", 0)
    first, process = ear.number, worker.process_id
    ear.ask("say", "nobody asks any more", tells=False)
    # Its turn comes when the first one is done.
    worker.cancel(ear.number, NEVER)
    worker.cancel(first, NEVER)
    assert ear.all()[1][0] == "done"
    assert ear.next() == ("failed", "it died")
    ear.ask("say", "again", tells=False)
    assert ear.next() == ("done", "again")
    assert worker.process_id == process
    assert not reports


def test_a_cancelled_task_leaves_those_before_it_alone(worker: Worker) -> None:
    first, second, third = Ear(worker), Ear(worker), Ear(worker)
    first.ask("count_until_cancelled")
    assert first.next() == ("told", 0)
    # Both wait for their turn.
    second.ask("say", "still wanted", key="second", tells=False)
    third.ask("say", "nobody asks any more", key="third", tells=False)
    worker.cancel(third.number, NEVER)
    worker.cancel(first.number, NEVER)
    assert second.next() == ("done", "still wanted")
    assert third.next() == ("failed", "it died")


def test_a_long_drawing_ends_as_soon_as_a_newer_one_waits(
    ear: Ear, worker: Worker, reports: list[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(jobs, "LONG_SECONDS", 0.0)
    ear.ask("count_until_cancelled", is_drawing=True)
    assert ear.next() == ("told", 0)
    process = worker.process_id
    ear.ask("count", 3, is_drawing=True)
    told, end = ear.all()
    # The first one ends for no other reason.
    assert end == ("done", len(told) + 1)
    assert ear.all() == ([0, 1, 2], ("done", 3))
    assert worker.process_id == process
    assert not reports


def test_a_drawing_that_kills_its_process_is_tried_twice_although_it_tells(
    ear: Ear, reports: list[str]
) -> None:
    ear.ask("die", is_drawing=True)
    assert ear.all() == ([0, 0], ("failed", "it died"))
    assert reports == [RESTARTED, "it died"]


def test_a_task_that_ends_itself_when_cancelled_answers_so(ear: Ear, worker: Worker) -> None:
    ear.ask("end_when_cancelled")
    assert ear.next() == ("told", 0)
    worker.cancel(ear.number, NEVER)
    assert ear.all()[1] == ("failed", CANCELLED)


def test_force_does_not_hit_the_next_task(ear: Ear, worker: Worker) -> None:
    ear.ask("count_until_cancelled")
    ear.next()
    worker.cancel(ear.number, NEVER)
    first = ear.number
    assert ear.all()[1][0] == "done"
    process = worker.process_id
    ear.ask("count_until_cancelled")
    ear.next()
    # As if the deadline of the first one passed only now.
    held: Any = worker
    held._kill(first)
    worker.cancel(ear.number, NEVER)
    assert ear.all()[1][0] == "done"
    assert worker.process_id == process


def test_a_refusal_and_a_death_after_some_words(
    ear: Ear, worker: Worker, reports: list[str]
) -> None:
    ear.ask("refuse")
    assert ear.all() == ([0], ("failed", "refused on purpose"))
    assert not reports
    ear.ask("die")
    assert ear.all() == ([0], ("failed", "it died"))
    assert reports == ["it died"]
    ear.ask("count", 3)
    assert ear.all() == ([0, 1, 2], ("done", 3))


def test_work_that_kills_its_process_is_tried_twice(
    ear: Ear, worker: Worker, reports: list[str]
) -> None:
    ear.ask("fall", tells=False)
    assert ear.next() == ("failed", "it died")
    assert reports == [RESTARTED, "it died"]
    ear.ask("say", "again", tells=False)
    assert ear.next() == ("done", "again")
    assert len(reports) == 2


def test_only_the_newest_request_of_a_key_waits(ear: Ear, worker: Worker) -> None:
    ear.ask("say", "first", tells=False)
    assert ear.next() == ("done", "first")
    process = worker.process_id
    assert process not in (None, os.getpid())
    assert process is not None
    # Stopped, so that it is at the first of them while the others are posted.
    os.kill(process, signal.SIGSTOP)
    for number in range(40):
        ear.ask("say", str(number), tells=False)
    os.kill(process, signal.SIGCONT)
    assert worker.wait_until_idle(PATIENCE)
    ear.ask("say", "end", tells=False)
    results: list[str] = []
    while (result := ear.next()[1]) != "end":
        results.append(result)
    assert len(results) <= 2
    assert results[-1] == "39"


def test_killed_worker_is_reported_and_started_again(
    ear: Ear, worker: Worker, reports: list[str]
) -> None:
    ear.ask("say", "first", tells=False)
    assert ear.next() == ("done", "first")
    first = worker.process_id
    assert first is not None
    # Stopped, so that the kill hits it in the middle of its work, which is done all the same.
    os.kill(first, signal.SIGSTOP)
    ear.ask("say", "again", tells=False)
    os.kill(first, signal.SIGKILL)
    assert ear.next() == ("done", "again")
    second = worker.process_id
    assert second not in (None, first)
    assert second is not None
    # And once more, while it has nothing to do.
    os.kill(second, signal.SIGKILL)
    ear.ask("say", "once more", tells=False)
    assert ear.next() == ("done", "once more")
    assert reports == [RESTARTED] * 2
    assert worker.process_id not in (None, first, second)


def test_stopped_worker_ends_its_process_whatever_it_does(
    ear: Ear, worker: Worker, reports: list[str]
) -> None:
    ear.ask("hang")
    assert ear.next() == ("told", 0)
    process = worker.process_id
    assert process is not None
    os.kill(process, signal.SIGSTOP)
    worker.stop()
    with pytest.raises(ProcessLookupError):
        os.kill(process, 0)
    assert not reports


def test_no_process_is_left_when_the_parent_is_gone() -> None:
    code = """
import os, sys
from explorer.app.session.jobs import Worker
from tests.app import telling
worker = Worker(print)
def told(value):
    if value == 5:
        print(worker.process_id, flush=True)
        os._exit(0)
worker.submit("task", telling.count_until_cancelled, (), print, print, receive=told)
worker.wait_until_idle(600.0)
"""
    command = [sys.executable, "-c", code]
    done = subprocess.run(
        command, stdout=subprocess.PIPE, text=True, timeout=PATIENCE, cwd=ROOT, check=True
    )
    child = int(done.stdout)
    assert child != os.getpid()
    assert _has_ended(child)


def _has_ended(process: int) -> bool:
    for _ in range(1000):
        try:
            os.kill(process, 0)
            state = Path(f"/proc/{process}/stat").read_text().rpartition(")")[2].split()[0]
        except (ProcessLookupError, FileNotFoundError):
            return True
        if state == "Z":
            return True
        threading.Event().wait(0.02)
    return False
