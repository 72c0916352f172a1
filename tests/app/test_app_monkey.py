"""Random hands on a whole explorer, without a browser; see `monkey.py` for longer ones."""

from __future__ import annotations

import os
import threading

import psutil
from monkey import Monkey, explorer_with_data

# Enough for every kind of action many times over; EXPLORER_MONKEY asks for more.
ACTIONS = int(os.environ.get("EXPLORER_MONKEY", "1500"))
# Pools of threads grow with the first hands; optimiser and planner are processes of their own.
MORE_THREADS, MORE_PROCESSES = 80, 4


def test_random_hands_find_no_fault_and_leave_what_a_new_page_would_show() -> None:
    processes, threads = len(psutil.Process().children(recursive=True)), threading.active_count()
    with explorer_with_data() as running:
        report = Monkey(running, seed=11).run(ACTIONS)
    assert report.actions >= ACTIONS
    assert report.faults == []
    assert report.drift == []
    assert max(report.threads) <= threads + MORE_THREADS
    assert max(report.processes) <= processes + MORE_PROCESSES
