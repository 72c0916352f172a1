"""Files sent to browsers, each to the one that asked and to no other.

The process of the page makes files that need computing; a thread here waits for those that a
browser draws.
"""

from __future__ import annotations

from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from typing import Any

import viser

from explorer.app.session.session import Who
from explorer.errors import ExplorerError
from explorer.jobs.jobs import Jobs

# Number of browsers that are waited for at the same time.
MOST_WAITED_FOR = 4

File = tuple[str, bytes]
"""The name of a file and its content."""


class Downloads:
    """Sends files, each to one browser; those that need computing come from the page's process.

    `complain` is called with a message for people and the client it is for.
    """

    def __init__(
        self, server: viser.ViserServer, jobs: Jobs, complain: Callable[[str, Who], None]
    ) -> None:
        self._server = server
        self._jobs = jobs
        self._complain = complain
        self._threads = ThreadPoolExecutor(MOST_WAITED_FOR, thread_name_prefix="downloads")

    def stop(self) -> None:
        """Start no further file."""
        self._threads.shutdown(wait=False, cancel_futures=True)

    def send(self, who: Who, name: str, data: bytes) -> None:
        """Send a file that is made already."""
        client = self._client(who)
        if client is not None:
            _send(client, name, data)

    def compute(
        self,
        who: Who,
        name: str,
        task: Callable[..., bytes],
        arguments: tuple[Any, ...],
        notice: tuple[str, str] | None = None,
    ) -> None:
        """Send a file that the process of the page makes, by a task with its arguments.

        It replaces one of the same name that waits for the same browser, unless a notice,
        of a title and a text, is shown there meanwhile.
        """
        client = self._client(who)
        if client is None:
            return
        notification = None
        if notice is not None:
            notification = client.add_notification(*notice, loading=True, with_close_button=False)

        def done(data: bytes) -> None:
            if notification is not None:
                notification.remove()
            _send(client, name, data)

        def failed(problem: str) -> None:
            if notification is not None:
                notification.remove()
            self._complain(problem, who)

        # A file that a notice announces is never replaced.
        key = None if notice is not None else ("download", who, name)
        self._jobs.start(task, arguments, done, failed, key=key)

    def make(self, who: Who, doing: str, make: Callable[[viser.ClientHandle], File]) -> None:
        """Send a file that a thread makes with the browser, which shows a notice meanwhile."""
        client = self._client(who)
        if client is None:
            return

        def work() -> None:
            notice = client.add_notification(doing, "", loading=True, with_close_button=False)
            try:
                _send(client, *make(client))
            except ExplorerError as error:
                self._complain(str(error), who)
            finally:
                notice.remove()

        self._threads.submit(work)

    def _client(self, who: Who) -> viser.ClientHandle | None:
        return self._server.get_clients().get(-1 if who is None else who)


def _send(client: viser.ClientHandle, name: str, data: bytes) -> None:
    # Shells and addresses read a "#" as the end of a name; designs of studies have one. A name that
    # begins with a point is hidden.
    name = name.replace("#", "").lstrip(" ")
    name = f"design{name}" if name.startswith(".") else name
    client.send_file_download(name, data, save_immediately=True)
