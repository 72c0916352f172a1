"""Searches with random demands, each checked by random poses.

From the checkout: python tests/tools/searches.py [COUNT [FIRST SEED [POSES]]]

A search that has converged must miss no demand in any pose.
"""

from __future__ import annotations

import sys
import time
from collections import Counter
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parents[1] / "support"))

from random_searches import missed_demands, search

from explorer.errors import InputError
from explorer.numerics.compiled import warm

COUNT, POSES = 200, 100_000


def main(count: int = COUNT, first: int = 0, poses: int = POSES) -> int:
    """Run searches, and return the number of those that converged with a missed demand."""
    warm()
    statuses: Counter[str] = Counter()
    missed, seed = 0, first
    while statuses.total() < count:
        began = time.perf_counter()
        try:
            outcome = search(seed)
        except InputError as error:
            print(f"{seed}: refused: {error}", flush=True)
            seed += 1
            continue
        took = time.perf_counter() - began
        statuses[outcome.status] += 1
        found = list(missed_demands(outcome, poses, seed)) if outcome.converged else []
        missed += bool(found)
        words = f"MISSED {', '.join(found)}" if found else ""
        print(f"{seed}: {took:.1f} s, {outcome.message} {words}", flush=True)
        seed += 1
    print(f"{dict(statuses)}; converged with a missed demand: {missed}")
    return missed


if __name__ == "__main__":
    sys.exit(main(*map(int, sys.argv[1:])) > 0)
