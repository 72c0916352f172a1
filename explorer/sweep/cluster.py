"""The workers of a Dask cluster as an executor. Needs the extra `cluster`.

Every worker needs this very version of the explorer; rows of other versions are refused.
"""

from __future__ import annotations

import asyncio
import contextlib
import logging
from collections.abc import Callable
from concurrent.futures import Executor, Future, ThreadPoolExecutor
from typing import Any

from explorer.errors import InputError
from explorer.files.extras import load_extra
from explorer.sweep.workers import Arguments, Result, Workers

# Seconds to wait for a scheduler that may not be there.
PATIENCE = 15.0


class DaskWorkers(Workers):
    """The workers of a Dask scheduler at an address such as tcp://10.0.0.1:8786.

    From the first on, Dask logs only what is critical. The patience is in seconds.

    Raises:
        InputError: There is no scheduler at that address.
        MissingExtraError: Dask is not installed.
    """

    def __init__(self, address: str, *, patience: float = PATIENCE) -> None:
        (distributed,) = load_extra("cluster", "distributed")
        # Of a lost scheduler Dask would log many lines at any time; the explorer writes one.
        for name in ("distributed", "distributed.client"):
            logging.getLogger(name).setLevel(logging.CRITICAL)
        try:
            _try_connection(distributed, address, patience)
            self._client: Any = distributed.Client(
                address, timeout=patience, set_as_default=False, name="explorer"
            )
        except Exception as error:  # noqa: BLE001 - Dask raises anything for other addresses
            raise InputError(
                f"no Dask scheduler answers at {address} within {patience:g} s "
                f"({type(error).__name__}): start one with dask scheduler, and workers with "
                "dask worker and its address, such as tcp://10.0.0.1:8786"
            ) from None
        # A task whose worker died must be computed again, although its arguments are the same.
        self._executor: Executor = self._client.get_executor(pure=False)
        self.died = (distributed.scheduler.KilledWorker,)

    @property
    def size(self) -> int:
        """Number of threads of the workers now, at least one; each count asks the scheduler."""
        # Without a scheduler the tasks fail.
        with contextlib.suppress(OSError, TimeoutError):
            return max(1, self.threads)
        return 1

    @property
    def threads(self) -> int:
        """Number of threads of the workers now; 0 before the first worker comes."""
        return sum(self._client.nthreads().values())

    def submit(
        self, fn: Callable[Arguments, Result], /, *args: Arguments.args, **kwargs: Arguments.kwargs
    ) -> Future[Result]:
        """Call a function in one of the workers, see `concurrent.futures.Executor`."""
        return self._executor.submit(fn, *args, **kwargs)

    def shutdown(self, wait: bool = True, *, cancel_futures: bool = False) -> None:
        """Leave the scheduler, which stays with its workers; wait for tasks, or drop all."""
        self._executor.shutdown(wait=wait and not cancel_futures)
        # The scheduler may be gone.
        with contextlib.suppress(OSError, TimeoutError):
            self._client.close()


def _try_connection(distributed: Any, address: str, timeout: float) -> None:
    """Connect once: Dask's client waits for ever where nothing answers its handshake."""
    options = distributed.security.Security().get_connection_args("client")

    async def connect_once() -> None:
        connection = distributed.comm.connect(address, timeout=timeout, **options)
        (await asyncio.wait_for(connection, timeout)).abort()

    # A notebook runs a loop of its own in this thread.
    with ThreadPoolExecutor(1) as thread:
        thread.submit(asyncio.run, connect_once()).result()
