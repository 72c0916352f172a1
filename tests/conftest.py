"""Settings for every test: the same random examples in every run, no time limits, no real data."""

from __future__ import annotations

import math
import signal
import sys
from collections.abc import Generator
from pathlib import Path

import pytest
from hypothesis import HealthCheck, settings
from hypothesis.internal.conjecture import providers
from kernels import import_all

from explorer.numerics.compiled import warm

TESTS = Path(__file__).parent

# The folders of each ring of tests, which is a marker too: `pytest -m laws`.
RINGS = {
    "laws": (
        "mechanism",
        "singularity",
        "legs",
        "motion",
        "statics",
        "workspace",
        "measures",
        "six_legged",
        "paths",
        "optimise",
        "find",
        "calibration",
        "prototype",
        "numerics",
    ),
    "answers": ("house", "files", "sweep", "reproduce", "export", "cli", "manual"),
    "page": ("app",),
    "browser": ("browser",),
}
RING_OF = {folder: ring for ring, folders in RINGS.items() for folder in folders}

EXAMPLES, EXAMPLES_OF_ALL = 25, 300


def pytest_addoption(parser: pytest.Parser) -> None:
    parser.addoption(
        "--all", action="store_true", help="run the tests marked long too, with 300 examples"
    )


def pytest_configure(config: pytest.Config) -> None:
    for ring in RINGS:
        config.addinivalue_line("markers", f"{ring}: a ring of tests, see CONTRIBUTING.md")
    config.addinivalue_line("markers", "long: searches long or repeats by design; runs with --all")
    settings.register_profile(
        "laws",
        derandomize=True,
        deadline=None,
        max_examples=EXAMPLES_OF_ALL if config.getoption("--all") else EXAMPLES,
        database=None,
        suppress_health_check=[HealthCheck.too_slow],
    )
    settings.load_profile("laws")


def pytest_collection_modifyitems(config: pytest.Config, items: list[pytest.Item]) -> None:
    """Mark each test with its ring, and leave out the long ones unless all are asked for."""
    for item in items:
        item.add_marker(RING_OF[item.path.relative_to(TESTS).parts[0]])
    if config.getoption("--all"):
        return
    long = [item for item in items if item.get_closest_marker("long")]
    config.hook.pytest_deselected(items=long)
    items[:] = [item for item in items if not item.get_closest_marker("long")]


# A shell that runs tests in its background has them ignore Ctrl-C, and what they start too; nohup
# has them ignore that the terminal is closed.
if signal.getsignal(signal.SIGINT) is signal.SIG_IGN:
    signal.signal(signal.SIGINT, signal.default_int_handler)
if sys.platform != "win32" and signal.getsignal(signal.SIGHUP) is signal.SIG_IGN:
    signal.signal(signal.SIGHUP, signal.SIG_DFL)


@pytest.fixture(scope="session", autouse=True)
def _same_examples() -> Generator[None]:  # pyright: ignore[reportUnusedFunction]
    """Let Hypothesis draw no constants of the package's modules.

    It would draw those of the modules that are imported by then, so that the examples of a test
    depended on the tests that ran before it, and it would read each of these modules first.
    """

    def is_local_module_file(path: str) -> bool:
        return False

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(providers, "is_local_module_file", is_local_module_file)
        yield


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
    """Load all kernels before the first test that asks for it."""
    import_all()
    warm()


@pytest.fixture(scope="session", autouse=True)
def _searches_end_by_their_work() -> Generator[None]:  # pyright: ignore[reportUnusedFunction]
    """Let no search for machines end by the clock, however busy the machine is."""
    with pytest.MonkeyPatch.context() as patch:
        for module in ("find", "nearest"):
            patch.setattr(f"explorer.find.{module}.PATIENCE", math.inf)
        yield
