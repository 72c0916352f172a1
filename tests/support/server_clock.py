"""The clock of the server in tests, which advance it, slow it down or end all its pauses."""

from __future__ import annotations

import time
from collections.abc import Callable
from concurrent import futures
from functools import partial
from typing import Any
from unittest import mock

from explorer.app.features.designs.feature import SavedDesigns
from explorer.app.features.optimise.runner import SEARCH
from explorer.app.features.optimise.state import Optimisation
from explorer.app.features.requirement.state import CHECK_FEED
from explorer.app.page import Page
from explorer.jobs.jobs import PAGE
from explorer.page.session import clock
from explorer.page.widgets import assigning

# Seconds of the clock in a second of the machine's, and when that began there.
_pace, _paced_at = 1.0, 0.0
# Seconds by which the clock was ahead then.
_ahead = 0.0


def advance(seconds: float) -> None:
    """Advance the clock, which ends the pauses that are over by then."""
    global _ahead  # noqa: PLW0603 - the clock is one for the whole process
    with clock.changed:
        _ahead += seconds
        clock.changed.notify_all()


def set_pace(pace: float) -> None:
    """Make so many seconds, at most one, pass on the clock in a second of the machine's."""
    global _ahead, _pace, _paced_at
    with clock.changed:
        _ahead, _pace, _paced_at = _shift(), pace, time.monotonic()
        clock.changed.notify_all()


def _shift() -> float:
    return _ahead + (_pace - 1.0) * (time.monotonic() - _paced_at)


def wait_until_drawn(page: Page, timeout: float = 30.0) -> bool:
    """Wait until the newest state and all that follows are drawn; return whether they are."""
    deadline = time.monotonic() + timeout
    idle = page.session.wait_until_idle(timeout)
    while Optimisation.of(page.session.state).is_on and time.monotonic() < deadline:
        time.sleep(0.02)
    # Drawing may request a job, whose result is drawn again.
    for process in (SEARCH, CHECK_FEED.process, PAGE, PAGE):
        idle = idle and page.session.wait_until_idle(deadline - time.monotonic())
        idle = idle and page.jobs.wait_until_idle(deadline - time.monotonic(), process)
    return idle and page.session.wait_until_idle(deadline - time.monotonic())


def wait_until_handled(page: Page, timeout: float) -> bool:
    """Wait until the presses on markup that have come are handled; return whether they are."""
    buttons: Any = page.buttons
    # One thread handles them in their order.
    return not futures.wait([buttons._thread.submit(int)], timeout).not_done


def wait_until_quiet(timeout: float) -> bool:
    """Wait until no pause is pending and no call after one is at work; return whether none is."""
    with clock.changed:
        return clock.changed.wait_for(lambda: not clock.pending, timeout)


def settle(page: Page, timeout: float) -> bool:
    """Wait until all is drawn and no pause is pending; return whether that is so.

    What waits for a pause of the user happens at once. Saved designs are read on a thread of their
    own.
    """
    deadline = time.monotonic() + timeout
    services = page.services
    waits: list[Callable[[float], bool]] = [
        partial(wait_until_handled, page),
        partial(wait_until_drawn, page),
    ]
    if services.has(SavedDesigns):
        waits.append(services.get(SavedDesigns).wait_until_idle)
    with mock.patch.object(assigning, "QUIET_SECONDS", 0.0):
        while all(wait(deadline - time.monotonic()) for wait in waits):
            with clock.changed:
                for pause in page.pauses:
                    pause.due = clock.now()
                clock.changed.notify_all()
            if not wait_until_quiet(deadline - time.monotonic()):
                return False
            # What happened after a pause may have changed more.
            if page.session.wait_until_idle(0.0) and wait_until_quiet(0.0):
                return True
    return False


setattr(clock, "ahead", _shift)  # noqa: B010 - a function in the place of another
