"""Files that the worker makes: what replaces what while it waits."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any
from unittest.mock import Mock

import pytest
from services import StubWorker

from explorer.app.browser.downloads import Downloads


def encoded(what: str) -> bytes:
    return what.encode()


@pytest.fixture
def files(worker: StubWorker) -> Downloads:
    server: Any = SimpleNamespace(get_clients=lambda: {1: Mock(), 2: Mock()})
    return Downloads(server, worker, lambda message, who: pytest.fail(f"{who}: {message}"))


def test_only_a_file_of_the_same_name_and_browser_is_replaced(
    files: Downloads, worker: StubWorker
) -> None:
    for who, name in ((1, "workspace.3mf"), (1, "hull.3mf"), (2, "hull.3mf"), (1, "hull.3mf")):
        files.compute(who, name, encoded, (name,))
    workspace, hull, of_another, again = (order.key for order in worker.orders)
    assert hull == again
    assert len({workspace, hull, of_another}) == 3


def test_file_announced_by_a_notice_is_never_replaced(files: Downloads, worker: StubWorker) -> None:
    for _ in range(2):
        files.compute(1, "report.pdf", encoded, ("report",), ("Report", "A moment."))
    first, second = (order.key for order in worker.orders)
    assert first != second


def test_file_for_a_browser_that_is_gone_is_not_made(files: Downloads, worker: StubWorker) -> None:
    files.compute(7, "hull.3mf", encoded, ("hull",))
    assert worker.orders == []
