"""The first minute on a machine that has never run the explorer: nothing is compiled yet."""

from __future__ import annotations

import os
import re
import signal
import statistics
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable, Generator, Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path

from benchmarks.table import Row, seconds
from benchmarks.timing import EXPLORER, ROOT, elapsed, run_to_end
from explorer.page.browser.headless import find_chromium, headless_browser

RUNS = 5
SEARCH = (
    *("optimise", "--design", "paper-initial", "--target-volume", "8000"),
    *("--box", "0", "-12", "0", "20", "22", "18", "--clearance", "0.2"),
)
COMPILE_ALL = """
import explorer.app.server, explorer.optimise.solver, explorer.paths.planning
import explorer.workspace.accessible.workspace
from explorer.numerics.compiled import warm
warm()
"""
SIZE = (1440, 900)
# Milliseconds that the page is waited for.
PATIENCE = 180_000.0
SHORT = {"RUNS": 1}


def run() -> Iterator[Row]:
    """Yield a row of the command line, one of the page and one of all kernels."""
    run_to_end(*EXPLORER, *SEARCH)
    compiled = statistics.median(elapsed(lambda: run_to_end(*EXPLORER, *SEARCH)) for _ in range(3))
    yield Row(
        f"first `explorer optimise … --clearance 0.2`, median of {RUNS}",
        _median(lambda home: elapsed(lambda: run_to_end(*EXPLORER, *SEARCH, environment=home))),
        "4 s",
        f"once all is compiled: {seconds(compiled)}",
    )
    title = f"first Optimise on the page, software renderer, {SIZE[0]} × {SIZE[1]}"
    if find_chromium() is None:
        yield Row(title, "not measured: no Chromium", "12 s")
    else:
        yield Row(f"{title}, from the press, median of {RUNS}", _median(_first_press), "12 s")
    yield Row(
        f"until all kernels are compiled, median of {RUNS}",
        _median(
            lambda home: elapsed(
                lambda: run_to_end(sys.executable, "-c", COMPILE_ALL, environment=home)
            )
        ),
        "10 s",
    )


def _median(measure: Callable[[Mapping[str, str]], float]) -> str:
    times: list[float] = []
    for _ in range(RUNS):
        with tempfile.TemporaryDirectory(ignore_cleanup_errors=True) as folder:
            times.append(measure(fresh_home(Path(folder))))
    return f"{seconds(statistics.median(times))}, worst {seconds(max(times))}"


def _first_press(home: Mapping[str, str]) -> float:
    """Return the seconds from the first press of Optimise until its result is shown."""
    with served(home) as address, headless_browser() as browser:
        page = browser.new_page(viewport={"width": SIZE[0], "height": SIZE[1]})
        page.set_default_timeout(PATIENCE)
        page.goto(address)
        page.get_by_role("tab", name="Optimise", exact=True).click()
        button = page.get_by_role("button", name=re.compile("^Optimise$"))
        button.click()
        start = time.perf_counter()
        page.get_by_text("Converged", exact=True).first.wait_for()
        return time.perf_counter() - start


def fresh_home(folder: Path) -> dict[str, str]:
    """Return the environment of somebody who has never run the explorer."""
    return {
        **os.environ,
        "XDG_CACHE_HOME": str(folder / "cache"),
        "LOCALAPPDATA": str(folder / "cache"),
        "EXPLORER_DATA": str(folder / "data"),
    }


@contextmanager
def served(environment: Mapping[str, str]) -> Generator[str]:
    """Serve the page from a process of its own and give its address."""
    process = subprocess.Popen(
        [*EXPLORER, "serve", "--no-open", "--port", "0"],
        cwd=ROOT,
        env=environment,
        stderr=subprocess.PIPE,
        text=True,
        # It may have started a process to compile in, which must end with it.
        start_new_session=True,
    )
    with process:
        assert process.stderr is not None
        line = process.stderr.readline()
        found = re.search(r"http://\S+", line)
        try:
            assert found, f"the explorer names no address but says {line!r}"
            yield found[0]
        finally:
            if sys.platform == "win32":
                process.kill()
            else:
                os.killpg(process.pid, signal.SIGKILL)
