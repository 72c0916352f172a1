"""`explorer.show` without a browser: what a notebook displays, reads, sets and ends."""

from __future__ import annotations

import gc
import re
import subprocess
import sys
import threading
import urllib.request
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest
from client import wait_for

import explorer
from explorer import InputError, Pose
from explorer.app.notebook import Shown
from explorer.errors import DesignError

OPTIMAL = explorer.PRESETS["paper-optimal"]


@pytest.fixture(scope="module")
def started() -> Iterator[Shown]:
    with explorer.show(OPTIMAL) as shown:
        yield shown


@pytest.fixture
def shown(started: Shown) -> Shown:
    """An explorer that shows the paper's optimum at home."""
    started.design = OPTIMAL
    return started


def answers(url: str) -> bool:
    """Whether the page is served there."""
    try:
        with urllib.request.urlopen(url, timeout=20.0) as page:
            return page.status == 200 and b"<html" in page.read()
    except OSError:
        # Refused, or taken by a server that ends before it answers.
        return False


def displayed(shown: Any) -> dict[str, str]:
    """Return what a notebook asks for."""
    return {"text/html": shown._repr_html_(), "text/plain": repr(shown)}


def ends(threads: set[threading.Thread]) -> bool:
    """Whether only these threads are left."""
    return not set(threading.enumerate()) - threads


def test_notebook_gets_the_page_in_a_frame_and_a_shell_its_address(
    shown: Shown,
) -> None:
    assert answers(shown.url)
    bundle = displayed(shown)
    assert set(bundle) == {"text/html", "text/plain"}
    html = bundle["text/html"]
    frame = re.fullmatch(r'<iframe src="([^"]+)" [^>]*height="600"[^>]*></iframe>', html)
    assert frame is not None
    assert frame[1] == shown.url
    assert bundle["text/plain"] == repr(shown)
    assert repr(shown) == f"Flagged 4-4 explorer of 'paper-optimal': {shown.url}"


def test_design_and_pose_are_read_and_set_live(shown: Shown) -> None:
    home = OPTIMAL.home_pose
    assert (shown.design, shown.pose) == (OPTIMAL, home)
    pose = Pose.of_yaw_pitch_roll((9.0, 4.0, 8.0), (-60.0, 10.0, 5.0))
    shown.pose = pose
    assert shown.pose == pose
    other = OPTIMAL.with_variable("b2", 2.0)
    shown.design = other
    assert shown.design == other
    assert shown.pose == other.home_pose
    shown.design = "paper-initial"
    assert shown.design == explorer.PRESETS["paper-initial"]


def test_value_that_cannot_be_set_is_refused_in_one_line_and_changes_nothing(
    shown: Shown,
) -> None:
    untyped: Any = 3
    with pytest.raises(InputError, match=r"^a design is an explorer\.Design, [^\n]*got 3$"):
        shown.design = untyped
    with pytest.raises(InputError, match=r"^a pose is an explorer\.Pose; got 3$"):
        shown.pose = untyped
    with pytest.raises(DesignError, match=r"^[^\n]*no-such-design[^\n]*$"):
        shown.design = "no-such-design"
    assert (shown.design, shown.pose) == (OPTIMAL, OPTIMAL.home_pose)
    with pytest.raises(InputError, match=r"^the height must be 100 pixels at least; got 5$"):
        explorer.show(height=5)
    port = int(shown.url.rpartition(":")[2])
    with pytest.raises(explorer.ExplorerError, match=f"^port {port} is taken"):
        explorer.show(port=port)


def test_explorers_shown_at_once_have_a_state_each(shown: Shown) -> None:
    with explorer.show("paper-initial", height=300) as other:
        assert other.url != shown.url
        assert answers(other.url)
        other.pose = Pose((4.0, 3.0, 4.0), other.pose.quaternion)
        assert shown.design == OPTIMAL
        assert shown.pose == OPTIMAL.home_pose
        assert 'height="300"' in displayed(other)["text/html"]
    assert answers(shown.url)


def test_explorer_that_is_stopped_says_so_and_leaves_nothing_behind() -> None:
    before = set(threading.enumerate())
    with explorer.show() as shown:
        url = shown.url
    assert not answers(url)
    assert not shown.is_running
    assert repr(shown) == "Flagged 4-4 explorer, stopped"
    assert displayed(shown)["text/html"] == "<p>Flagged 4-4 explorer, stopped</p>"
    with pytest.raises(InputError, match=r"^this explorer is stopped; call explorer\.show again$"):
        _ = shown.pose
    with pytest.raises(InputError, match="stopped"):
        shown.design = OPTIMAL
    shown.stop()
    wait_for(lambda: ends(before))
    # One that nothing refers to any more ends too.
    shown = explorer.show()
    url = shown.url
    assert answers(url)
    del shown
    gc.collect()
    wait_for(lambda: not answers(url))


def test_shell_that_ends_stops_its_explorers_without_a_word() -> None:
    code = "import explorer; first, second = explorer.show(), explorer.show(); print(first)"
    done = subprocess.run(
        [sys.executable, "-c", code],
        capture_output=True,
        text=True,
        check=True,
        cwd=Path(explorer.__file__).parents[1],
    )
    assert re.fullmatch(
        r"Flagged 4-4 explorer of 'paper-optimal': http://127\.0\.0\.1:\d+\n", done.stdout
    )
    assert done.stderr == ""
