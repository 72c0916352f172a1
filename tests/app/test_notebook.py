"""`explorer.show` without a browser: what a notebook displays, reads, sets and ends."""

from __future__ import annotations

import gc
import re
import subprocess
import sys
import threading
import time
import urllib.error
import urllib.request
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest

import explorer
from explorer import InputError, Pose

OPTIMAL = explorer.PRESETS["paper-optimal"]
PATIENCE = 30.0


@pytest.fixture
def shown() -> Iterator[explorer.Shown]:
    with explorer.show(OPTIMAL) as made:
        yield made


def answers(url: str) -> bool:
    """Whether the page is served there."""
    try:
        with urllib.request.urlopen(url, timeout=10.0) as page:
            return page.status == 200 and b"<html" in page.read()
    except (urllib.error.URLError, ConnectionError):
        return False


def displayed(shown: Any) -> dict[str, str]:
    """Return what a notebook asks for; of its two ways both say the same."""
    bundle = shown._repr_mimebundle_(include=None, exclude=None)
    assert bundle["text/html"] == shown._repr_html_()
    return bundle


def wait_until_gone(url: str) -> None:
    deadline = time.monotonic() + PATIENCE
    while answers(url):
        assert time.monotonic() < deadline, f"{url} is still served"
        time.sleep(0.02)


def test_a_notebook_gets_the_page_in_a_frame_and_a_shell_its_address(
    shown: explorer.Shown,
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


def test_design_and_pose_are_read_and_set_live(shown: explorer.Shown) -> None:
    home = explorer.home_pose(OPTIMAL)
    assert (shown.design, shown.pose) == (OPTIMAL, home)
    pose = Pose.of_yaw_pitch_roll((9.0, 4.0, 8.0), (-60.0, 10.0, 5.0))
    shown.pose = pose
    assert shown.pose == pose
    other = OPTIMAL.with_variable("b2", 2.0)
    shown.design = other
    assert shown.design == other
    assert shown.pose == explorer.home_pose(other)
    shown.design = "paper-initial"
    assert shown.design == explorer.PRESETS["paper-initial"]


def test_what_cannot_be_set_is_refused_in_one_line_and_changes_nothing(
    shown: explorer.Shown,
) -> None:
    untyped: object = 3
    with pytest.raises(InputError, match=r"^a design is an explorer\.Design, [^\n]*got 3$"):
        shown.design = untyped  # pyright: ignore[reportAttributeAccessIssue]
    with pytest.raises(InputError, match=r"^a pose is an explorer\.Pose; got 3$"):
        shown.pose = untyped  # pyright: ignore[reportAttributeAccessIssue]
    with pytest.raises(explorer.DesignError, match=r"^[^\n]*no-such-design[^\n]*$"):
        shown.design = "no-such-design"
    assert (shown.design, shown.pose) == (OPTIMAL, explorer.home_pose(OPTIMAL))


def test_several_are_shown_at_once_each_with_its_own_state(shown: explorer.Shown) -> None:
    with explorer.show("paper-initial", height=300) as other:
        assert other.url != shown.url
        assert answers(other.url)
        other.pose = Pose((4.0, 3.0, 4.0), other.pose.quaternion)
        assert shown.design == OPTIMAL
        assert shown.pose == explorer.home_pose(OPTIMAL)
        assert 'height="300"' in displayed(other)["text/html"]
    assert answers(shown.url)


def test_what_is_stopped_says_so_and_leaves_nothing_behind() -> None:
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
    deadline = time.monotonic() + PATIENCE
    while set(threading.enumerate()) - before:
        assert time.monotonic() < deadline, set(threading.enumerate()) - before
        time.sleep(0.02)


def test_what_nothing_refers_to_any_more_ends() -> None:
    shown = explorer.show()
    url = shown.url
    assert answers(url)
    del shown
    gc.collect()
    wait_until_gone(url)


def test_a_height_too_small_or_a_taken_port_is_refused(shown: explorer.Shown) -> None:
    with pytest.raises(InputError, match=r"^the height must be 100 pixels at least; got 5$"):
        explorer.show(height=5)
    port = int(shown.url.rpartition(":")[2])
    with pytest.raises(explorer.ExplorerError, match=f"^port {port} is taken"):
        explorer.show(port=port)


def test_a_shell_that_ends_ends_it_without_a_word() -> None:
    code = "import explorer; first, second = explorer.show(), explorer.show(); print(first)"
    done = subprocess.run(
        [sys.executable, "-c", code],
        capture_output=True,
        text=True,
        timeout=120,
        check=True,
        cwd=Path(explorer.__file__).parents[1],
    )
    assert re.fullmatch(
        r"Flagged 4-4 explorer of 'paper-optimal': http://127\.0\.0\.1:\d+\n", done.stdout
    )
    assert done.stderr == ""
