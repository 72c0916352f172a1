"""The improvement of a machine: every preference is lowered, with all demands kept."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from needs import NEEDS, requirement_of

from explorer.find import machine_values as m
from explorer.find.candidates import candidates, standard_poses
from explorer.find.improvement import GROWING, Improvement
from explorer.find.requirement import PREFERENCES, Preference, RequiredLegs
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


@pytest.mark.parametrize(
    ("field", "changes"),
    [
        ("tilt_deg", {"tilt_deg": 50.0}),
        ("box_mm", {"legs": RequiredLegs(ratio=1.8, longest_mm=250.0)}),
        ("swing_deg", {"swing_deg": 12.0}),
        ("transmission", {"transmission": 0.99}),
    ],
)
def test_improvement_for_a_field_keeps_all_other_demands(
    field: str, changes: dict[str, Any]
) -> None:
    terms = Terms.of(requirement_of(NEEDS[0], **changes))
    poses, start = standard_poses(terms.tilt), START.copy()
    start[[m.TILT, m.SIZE]] = [0.3 if field == each else 1.0 for each in ("tilt_deg", "box_mm")]
    search = Improvement(terms, field, start)
    before, improved = search.cost(poses), search.run(poses)
    assert improved.missed <= 1e-3
    assert improved.cost < before
    # Its own demand is missed, which no machine keeps with the others.
    own = Improvement(terms, "small", improved.x)
    if field in GROWING:
        assert start[GROWING[field]] < improved.x[GROWING[field]] < 1.0
    else:
        assert own.missed(improved.x, poses, np.array([0.0] * 4 + [8.0])) > 1e-3


def test_balanced_machine_is_a_little_larger_than_the_smallest_and_transmits_far_better() -> None:
    small, balanced = (
        Improvement(TERMS, each, START).run(POSES).x for each in ("small", "balanced")
    )
    lengths = [float(np.max(TERMS.values(x, POSES).lengths)) for x in (small, balanced)]
    indices = [float(np.min(TERMS.values(x, POSES).transmissions)) for x in (small, balanced)]
    assert lengths[0] < lengths[1] < 1.35 * lengths[0]
    assert indices[1] > 3.0 * indices[0]


def test_improvement_leaves_an_amount_to_spare() -> None:
    improved = Improvement(TERMS, "small", START, spare=0.01).run(POSES)
    assert improved.missed <= 1e-5
    at = TERMS.values(improved.x, POSES)
    ratios = [float(each.max() / each.min()) for each in at.lengths]
    assert TERMS.ratio * 0.98 < max(ratios) <= TERMS.ratio * 0.99
    assert min(float(np.abs(each).min()) for each in at.margins) >= TERMS.margin + 0.00999
