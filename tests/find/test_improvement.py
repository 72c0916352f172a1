"""The improvement of a machine: every preference is lowered, with all demands kept."""

from __future__ import annotations

import numpy as np
import pytest
from needs import NEEDS, requirement_of

from explorer.find.candidates import candidates, standard_poses
from explorer.find.improvement import Improvement
from explorer.find.requirement import PREFERENCES, Preference
from explorer.find.terms import Terms

TERMS = Terms.of(requirement_of(NEEDS[0]))
POSES = standard_poses(TERMS.tilt)
X, MISSED, LARGE = next(candidates(TERMS, 0))
# The machine with the shortest legs of those that keep the limits in the standard poses.
START = X[np.argmin(np.where(MISSED <= 0.0, LARGE, np.inf))]


@pytest.mark.parametrize("preference", PREFERENCES)
def test_improvement_lowers_what_a_preference_asks_for(preference: Preference) -> None:
    search = Improvement(TERMS, preference, START)
    before, improved = search.cost(POSES), search.run(POSES, rounds=6)
    assert improved.missed <= 1e-3
    assert improved.cost < before - 0.05


def test_improvement_leaves_an_amount_to_spare() -> None:
    improved = Improvement(TERMS, "small", START, spare=0.01).run(POSES)
    assert improved.missed <= 1e-5
    at = TERMS.values(improved.x, POSES)
    ratios = [float(each.max() / each.min()) for each in at.lengths]
    assert TERMS.ratio * 0.98 < max(ratios) <= TERMS.ratio * 0.99
    assert min(float(np.abs(each).min()) for each in at.margins) >= TERMS.margin + 0.00999
