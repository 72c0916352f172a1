"""Tasks of a process that send messages, are cancelled, fail or die with their process."""

from __future__ import annotations

import logging
import os
import platform
import signal
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path
from queue import Queue
from typing import Any

import pytest
from client import wait_for

from explorer.app.server import ALLOCATOR, LOG, start_log
from explorer.jobs.jobs import DIED_TWICE, RESTARTED, Jobs, LongJob, log_error
from explorer.jobs.process import CANCELLED
from tests.app import telling

ROOT = Path(__file__).resolve().parents[2]
PATIENCE = 120.0
# Seconds that nothing here takes, however busy the machine is; and so few that all do.
NEVER, AT_ONCE = 3600.0, 0.001


class Requester:
    """Requests tasks of a process, and keeps their messages and how they ended, in order."""

    job: LongJob

    def __init__(self, jobs: Jobs) -> None:
        self._jobs = jobs
        self._events: Queue[tuple[str, Any]] = Queue()

    def request(
        self,
        task: str,
        *arguments: Any,
        key: str | None = "task",
        sends: bool = True,
    ) -> None:
        self.job = self._jobs.start(
            getattr(telling, task),
            arguments,
            lambda value: self._events.put(("done", value)),
            lambda problem: self._events.put(("failed", problem)),
            (lambda value: self._events.put(("message", value))) if sends else None,
            key=key,
        )

    def next(self) -> tuple[str, Any]:
        return self._events.get(timeout=PATIENCE)

    def all(self) -> tuple[list[Any], tuple[str, Any]]:
        """Return all messages from now on, and the end."""
        messages: list[Any] = []
        while (event := self.next())[0] == "message":
            messages.append(event[1])
        return messages, event

    def assert_works(self) -> None:
        """Check that the process does what comes next."""
        self.request("say", "again", sends=False)
        assert self.next() == ("done", "again")


@pytest.fixture(scope="module")
def shared() -> Iterator[tuple[Jobs, list[str]]]:
    reports: list[str] = []
    jobs = Jobs(reports.append)
    yield jobs, reports
    jobs.stop()


@pytest.fixture
def jobs(shared: tuple[Jobs, list[str]]) -> Jobs:
    return shared[0]


@pytest.fixture
def reports(shared: tuple[Jobs, list[str]]) -> list[str]:
    """Return the reports of the worker, without those of tests before."""
    shared[1].clear()
    return shared[1]


@pytest.fixture
def requester(jobs: Jobs) -> Requester:
    return Requester(jobs)


def test_task_sends_all_messages_in_order_and_before_its_result(requester: Requester) -> None:
    requester.request("count", 500)
    assert requester.all() == (list(range(500)), ("done", 500))


def test_task_sends_messages_while_it_runs_and_ends_when_it_is_cancelled(
    requester: Requester, jobs: Jobs, reports: list[str]
) -> None:
    requester.request("count_until_cancelled")
    # The task ends for no other reason, so this came before its end.
    assert requester.next() == ("message", 0)
    process = jobs.process_ids()[0]
    requester.job.cancel(NEVER)
    messages, end = requester.all()
    assert end == ("done", len(messages) + 1)
    requester.assert_works()
    assert jobs.process_ids()[0] == process
    # One that ends by an exception says so.
    requester.request("end_when_cancelled")
    assert requester.next() == ("message", 0)
    requester.job.cancel(NEVER)
    assert requester.all()[1] == ("failed", CANCELLED)
    assert not reports


def test_next_task_is_neither_cancelled_nor_killed_with_the_last(
    requester: Requester, jobs: Jobs
) -> None:
    requester.request("count_until_cancelled")
    requester.job.cancel(NEVER)
    first = requester.job
    requester.all()
    process = jobs.process_ids()[0]
    requester.request("count_until_cancelled")
    # The deadline of the first one passes now.
    first.cancel(AT_ONCE)
    for number in range(100):
        assert requester.next() == ("message", number)
    requester.job.cancel(NEVER)
    assert requester.all()[1][0] == "done"
    assert jobs.process_ids()[0] == process


def test_task_that_does_not_end_when_cancelled_is_killed_without_a_report(
    requester: Requester, jobs: Jobs, reports: list[str]
) -> None:
    requester.request("hang")
    assert requester.next() == ("message", 0)
    process = jobs.process_ids()[0]
    requester.job.cancel(AT_ONCE)
    assert requester.next() == ("failed", CANCELLED)
    assert not reports
    requester.assert_works()
    assert jobs.process_ids()[0] != process


def test_cancelled_task_that_waits_is_not_begun_and_those_before_it_are(
    jobs: Jobs, reports: list[str]
) -> None:
    first, second, third, fourth = (Requester(jobs) for _ in range(4))
    first.request("count_until_cancelled")
    assert first.next() == ("message", 0)
    process = jobs.process_ids()[0]
    # Both wait for their turn.
    second.request("say", "still wanted", key="second", sends=False)
    third.request("say", "nobody asks any more", key="third", sends=False)
    fourth.request("count_until_cancelled", key="fourth")
    for each in (third, fourth, first):
        each.job.cancel(NEVER)
    assert second.next() == ("done", "still wanted")
    assert fourth.next() == ("failed", CANCELLED)
    assert third.next() == ("failed", CANCELLED)
    assert jobs.process_ids()[0] == process
    assert not reports


def test_task_that_is_cancelled_after_some_time_makes_room_for_the_next(
    requester: Requester, jobs: Jobs, reports: list[str]
) -> None:
    requester.request("count_until_cancelled")
    assert requester.next() == ("message", 0)
    process = jobs.process_ids()[0]
    first = requester.job
    requester.request("count", 3)
    first.cancel(after=0.05)
    messages, end = requester.all()
    # The first one ends for no other reason.
    assert end == ("done", len(messages) + 1)
    assert requester.all() == ([0, 1, 2], ("done", 3))
    assert jobs.process_ids()[0] == process
    assert not reports


@pytest.mark.parametrize(
    ("task", "messages", "problem", "expected"),
    [
        ("die", [0, 0], DIED_TWICE, [RESTARTED, DIED_TWICE]),
        ("fall", [], DIED_TWICE, [RESTARTED, DIED_TWICE]),
        ("refuse", [0], "refused on purpose", []),
    ],
)
def test_task_that_refuses_or_kills_its_process_is_reported(
    requester: Requester,
    reports: list[str],
    task: str,
    messages: list[int],
    problem: str,
    expected: list[str],
) -> None:
    requester.request(task, sends=task != "fall")
    assert requester.all() == (messages, ("failed", problem))
    requester.assert_works()
    assert reports == expected


def test_request_of_a_key_replaces_the_one_that_waits(requester: Requester, jobs: Jobs) -> None:
    requester.request("say", "first", sends=False)
    assert requester.next() == ("done", "first")
    process = jobs.process_ids()[0]
    assert process != os.getpid()
    # Stopped, so that it is at the first of them while the others are posted.
    os.kill(process, signal.SIGSTOP)
    for number in range(40):
        requester.request("say", str(number), sends=False)
    # What has no key is replaced by none.
    for text in ("one", "another"):
        requester.request("say", text, key=None, sends=False)
    os.kill(process, signal.SIGCONT)
    assert jobs.wait_until_idle(PATIENCE)
    requester.request("say", "end", sends=False)
    results: list[str] = []
    while (result := requester.next()[1]) != "end":
        results.append(result)
    assert results[-3:] == ["39", "one", "another"]
    assert len(results) <= 4


def test_killed_worker_is_reported_and_started_again(
    requester: Requester, jobs: Jobs, reports: list[str]
) -> None:
    requester.request("say", "first", sends=False)
    assert requester.next() == ("done", "first")
    first = jobs.process_ids()[0]
    # Stopped, so that the kill hits it in the middle of its work, which is done all the same.
    os.kill(first, signal.SIGSTOP)
    requester.request("say", "again", sends=False)
    os.kill(first, signal.SIGKILL)
    assert requester.next() == ("done", "again")
    second = jobs.process_ids()[0]
    assert second != first
    # And once more, while it has nothing to do.
    os.kill(second, signal.SIGKILL)
    requester.request("say", "once more", sends=False)
    assert requester.next() == ("done", "once more")
    assert reports == [RESTARTED] * 2
    assert jobs.process_ids()[0] not in (first, second)


def test_stopped_worker_ends_its_process_whatever_it_does() -> None:
    reports: list[str] = []
    jobs = Jobs(reports.append)
    requester = Requester(jobs)
    requester.request("hang")
    assert requester.next() == ("message", 0)
    process = jobs.process_ids()[0]
    os.kill(process, signal.SIGSTOP)
    jobs.stop()
    with pytest.raises(ProcessLookupError):
        os.kill(process, 0)
    assert not reports


def test_worker_process_ends_when_its_parent_is_gone() -> None:
    code = """
import os, sys
from explorer.jobs.jobs import Jobs
from tests.app import telling
jobs = Jobs(print)
def receive(value):
    if value == 5:
        print(jobs.process_ids()[0], flush=True)
        os._exit(0)
jobs.start(telling.count_until_cancelled, (), print, print, receive)
jobs.wait_until_idle(600.0)
"""
    done = subprocess.run(
        [sys.executable, "-c", code], stdout=subprocess.PIPE, text=True, cwd=ROOT, check=True
    )
    child = int(done.stdout)
    assert child != os.getpid()
    wait_for(lambda: has_ended(child))


def has_ended(process: int) -> bool:
    """Whether a process is gone, or only waits for its parent to ask how it ended."""
    try:
        state = Path(f"/proc/{process}/stat").read_text().rpartition(")")[2].split()[0]
    except FileNotFoundError:
        return True
    return state == "Z"


PROBLEM = "ValueError: setting 2.5 with ('a', 'b')"


@pytest.fixture
def log(tmp_path: Path) -> Iterator[Path]:
    """The log of this process, in a folder of its own."""
    root = logging.getLogger()
    before = [*root.handlers]
    start_log(tmp_path / "new")
    yield tmp_path / "new" / LOG
    for handler in {*root.handlers} - {*before}:
        root.removeHandler(handler)
        handler.close()


@pytest.mark.parametrize(
    ("task", "arguments", "problem", "reports", "logged"),
    [
        (
            "fail",
            (2.5, ("a", "b")),
            PROBLEM,
            [PROBLEM],
            ["ValueError", "telling.fail", "('a', 'b')"],
        ),
        # With a message of its own no task is done again.
        ("fall", (), "it died", ["it died"], ["it died", "telling.fall"]),
        ("refuse", (), "refused on purpose", [], []),
    ],
)
def test_error_of_a_task_is_logged_and_reported_unless_it_is_a_refusal(
    log: Path,
    task: str,
    arguments: tuple[Any, ...],
    problem: str,
    reports: list[str],
    logged: list[str],
) -> None:
    messages, failed = list[str](), Queue[str]()
    receive = None if task == "fall" else Queue[object]().put
    jobs = Jobs(messages.append)
    try:
        call = getattr(telling, task)
        jobs.start(call, arguments, failed.put, failed.put, receive, died="it died")
        assert failed.get(timeout=PATIENCE) == problem
    finally:
        jobs.stop()
    assert len(messages) == len(reports)
    assert all(report in each for report, each in zip(reports, messages, strict=True))
    assert log.exists() == bool(logged)
    if logged:
        assert messages[-1].endswith(f"; the log is {log}")
        text = log.read_text()
        assert all(words in text for words in logged)


def test_log_that_cannot_be_written_hides_no_error(
    log: Path, capfd: pytest.CaptureFixture[str]
) -> None:
    log.parent.rmdir()
    log.parent.write_bytes(b"")
    assert log_error("it failed", "Traceback").startswith("it failed")
    assert "it failed" in capfd.readouterr().err


THREADS = """
import ctypes, threading
if {is_set}:
    from explorer.app.server import set_allocator
    set_allocator()
library, together = ctypes.CDLL(None), threading.Barrier(8)
def allocate():
    library.malloc(100_000)
    together.wait()
    library.malloc(100_000)
threads = [threading.Thread(target=allocate) for _ in range(8)]
for each in threads:
    each.start()
for each in threads:
    each.join()
library.fdopen.restype = ctypes.c_void_p
out = ctypes.c_void_p(library.fdopen(1, b"w"))
library.malloc_info(0, out)
library.fflush(out)
"""


@pytest.mark.skipif(platform.libc_ver()[0] != "glibc", reason="arenas are of glibc")
def test_server_allocates_from_few_arenas_however_many_threads_it_has() -> None:
    counts = [
        subprocess.run(
            [sys.executable, "-c", THREADS.format(is_set=is_set)],
            capture_output=True,
            check=True,
        ).stdout.count(b"<heap nr=")
        for is_set in (False, True)
    ]
    arenas = ALLOCATOR[-8]
    assert counts[0] > arenas
    assert counts[1] <= arenas
