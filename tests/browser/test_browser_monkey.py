"""Random actions in a real browser; see `browser_monkey.py` for more of them."""

from __future__ import annotations

import os

import pytest
from browser_monkey import BrowserMonkey
from monkey import explorer_with_data
from playwright.sync_api import Browser

ACTIONS = int(os.environ.get("EXPLORER_BROWSER_MONKEY", "60"))


@pytest.mark.long
def test_random_actions_find_no_fault_and_the_browser_shows_what_the_server_has(
    browser: Browser,
) -> None:
    with explorer_with_data() as running:
        outcome = BrowserMonkey(browser, running, seed=3).run(ACTIONS)
    assert outcome.complaints == ()
    assert outcome.drift == ()
