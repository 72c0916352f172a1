"""Settings for every test: the same random examples in every run, no time limits, no real data."""

from __future__ import annotations

import importlib
import pkgutil
import signal
from collections.abc import Generator

import pytest
from hypothesis import HealthCheck, settings

import explorer
from explorer.numerics.compiled import warm

settings.register_profile(
    "laws",
    derandomize=True,
    deadline=None,
    max_examples=60,
    database=None,
    suppress_health_check=[HealthCheck.too_slow],
)
settings.load_profile("laws")

# A shell that runs tests in its background has them ignore Ctrl-C, and what they start too.
if signal.getsignal(signal.SIGINT) is signal.SIG_IGN:
    signal.signal(signal.SIGINT, signal.default_int_handler)


@pytest.fixture(scope="session", autouse=True)
def _all_is_imported() -> None:  # pyright: ignore[reportUnusedFunction]
    """Import the whole package, which needs no optional one, before anything is drawn.

    Constants of the modules that are there are among the examples: else these would depend
    on the tests that ran before in the same process.
    """
    for module in pkgutil.walk_packages(explorer.__path__, "explorer."):
        importlib.import_module(module.name)


@pytest.fixture(scope="session", autouse=True)
def _data_of_its_own(  # pyright: ignore[reportUnusedFunction]
    tmp_path_factory: pytest.TempPathFactory,
) -> Generator[None]:
    """Keep tests, and the processes that they start, out of the user's data folder."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setenv("EXPLORER_DATA", str(tmp_path_factory.mktemp("data")))
        yield


@pytest.fixture(scope="session")
def warm_kernels() -> None:
    """Compile all kernels before the first test that asks for it."""
    warm()
