"""The processes of a Dask cluster, as the same kind of executor. Needs the extra `cluster`.

Every worker needs this very version of the explorer; rows of other versions are refused.
"""

from __future__ import annotations

import asyncio
import contextlib
import importlib
import logging
import math
import time
from collections.abc import Callable, Generator
from concurrent.futures import Executor, Future, ThreadPoolExecutor
from typing import Any, ParamSpec, TypeVar
from urllib.parse import urlsplit

from explorer.errors import InputError, MissingExtraError
from explorer.sweep.workers import Workers

Arguments = ParamSpec("Arguments")
Result = TypeVar("Result")

SCHEMES = ("tcp", "tls", "ws", "wss")

# A task costs scheduler, worker and client some 8 ms between them.
TASK_SECONDS = 0.4
# Workers come and go; they are counted this often.
COUNT_SECONDS = 1.0
# Seconds to wait for a scheduler that may not be there.
PATIENCE = 5.0


class DaskWorkers(Workers):
    """The workers of a Dask scheduler.

    Args:
        address: Of the scheduler, such as tcp://10.0.0.1:8786.
        patience: Seconds to wait for it; `PATIENCE` if None.

    Raises:
        InputError: there is no scheduler at that address.
        MissingExtraError: Dask is not installed.
    """

    task_seconds = TASK_SECONDS

    def __init__(self, address: str, *, patience: float | None = None) -> None:
        distributed = _distributed()
        waits = PATIENCE if patience is None else patience
        _check(address)
        with contextlib.ExitStack() as quiet:
            quiet.enter_context(_silence())
            try:
                _greet(distributed, address, waits)
                self._client: Any = distributed.Client(
                    address, timeout=waits, set_as_default=False, name="explorer"
                )
            except Exception as error:  # noqa: BLE001 - Dask stumbles anywhere over other tongues
                raise InputError(
                    f"no Dask scheduler answers at {address} within {waits:g} s "
                    f"({type(error).__name__}): start one with dask scheduler, and workers with "
                    f"dask worker {address}"
                ) from None
            # A scheduler may be lost at any time.
            self._quiet = quiet.pop_all()
        # A task is a function of what it is given, but one whose worker died is tried again.
        self._executor: Executor = self._client.get_executor(pure=False)
        self._size, self._counted = 1, -math.inf
        self.died = (distributed.scheduler.KilledWorker,)

    @property
    def size(self) -> int:
        """How many threads the workers have; at least one, and known anew every second or so."""
        now = time.monotonic()
        if now - self._counted > COUNT_SECONDS:
            # It asks the scheduler, and whoever hands out tasks asks often. That it is gone, the
            # tasks tell.
            with contextlib.suppress(OSError, TimeoutError):
                self._size = max(1, self.threads)
            self._counted = now
        return self._size

    @property
    def threads(self) -> int:
        """How many threads the workers have now; none as long as no worker has come."""
        return sum(self._client.nthreads().values())

    def submit(
        self, fn: Callable[Arguments, Result], /, *args: Arguments.args, **kwargs: Arguments.kwargs
    ) -> Future[Result]:
        """Have a function called by one of the workers, see `concurrent.futures.Executor`."""
        return self._executor.submit(fn, *args, **kwargs)

    def shutdown(self, wait: bool = True, *, cancel_futures: bool = False) -> None:
        """Leave the scheduler; it and its workers stay.

        Args:
            wait: Until tasks have ended.
            cancel_futures: Drop all tasks.
        """
        with self._quiet:
            self._executor.shutdown(wait=wait and not cancel_futures)
            # A scheduler that is gone needs no farewell.
            with contextlib.suppress(OSError, TimeoutError):
                self._client.close()


def _check(address: str) -> None:
    """Raise an `InputError` for what is no address of a scheduler."""
    try:
        parts = urlsplit(address)
        is_one = parts.scheme in SCHEMES and bool(parts.hostname) and bool(parts.port)
    except ValueError:
        is_one = False
    if not is_one:
        raise InputError(
            f"a scheduler has an address such as tcp://10.0.0.1:8786, with its host and its port; "
            f"got {address!r}"
        )


def _greet(distributed: Any, address: str, waits: float) -> None:
    """Connect and leave again: Dask's client waits for ever where nobody returns its greeting."""
    options = distributed.security.Security().get_connection_args("client")

    async def greet() -> None:
        connection = distributed.comm.connect(address, timeout=waits, **options)
        (await asyncio.wait_for(connection, waits)).abort()

    # A notebook runs a loop of its own in this thread.
    with ThreadPoolExecutor(1) as thread:
        thread.submit(asyncio.run, greet()).result()


def _distributed() -> Any:
    try:
        return importlib.import_module("distributed")
    except ImportError:
        raise MissingExtraError(
            "a scheduler needs the extra cluster, in this environment and in that of every "
            'worker: pip install "flagged-explorer[study,cluster]"'
        ) from None


@contextlib.contextmanager
def _silence() -> Generator[None]:
    """Keep what Dask logs of lost connections off the terminal: we tell it in one line."""
    loggers = [logging.getLogger(name) for name in ("distributed", "distributed.client")]
    kept = [logger.level for logger in loggers]
    for logger in loggers:
        logger.setLevel(logging.CRITICAL)
    try:
        yield
    finally:
        for logger, level in zip(loggers, kept, strict=True):
            logger.setLevel(level)
