"""Random actions on a whole explorer, without a browser; see `monkey.py` for longer ones."""

from __future__ import annotations

import threading

import psutil
import pytest
from monkey import Monkey, explorer_with_data

# Pools of threads grow with the first actions; optimiser and planner are processes of their own.
MORE_THREADS, MORE_PROCESSES = 80, 4


@pytest.mark.parametrize("actions", [100, pytest.param(1500, marks=pytest.mark.long)])
def test_random_actions_cause_no_fault_and_leave_what_a_new_page_would_show(actions: int) -> None:
    processes, threads = len(psutil.Process().children(recursive=True)), threading.active_count()
    with explorer_with_data() as running:
        report = Monkey(running, seed=11).run(actions)
    assert report.actions >= actions
    assert report.faults == []
    assert report.drift == []
    assert max(report.threads) <= threads + MORE_THREADS
    assert max(report.processes) <= processes + MORE_PROCESSES
