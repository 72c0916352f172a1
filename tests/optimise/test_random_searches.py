"""Searches with random demands over a box, against random poses that look for a missed one."""

from __future__ import annotations

import pytest
from long_cases import long_after
from random_searches import missed_demands, search

# Searches that find an optimum, those that are over at once first.
SEEDS = [2, 3, 4, 7, 8, 12, 18, 0, 1, 9, 10, 15, 20, 22, 32, 33, 38, 49, 50, 51]


@pytest.mark.parametrize("seed", long_after(7, SEEDS))
def test_search_that_has_converged_misses_no_demand(seed: int) -> None:
    outcome = search(seed)
    assert outcome.converged
    assert list(missed_demands(outcome, 20_000, seed)) == []
