"""The search for machines that keep a need, beside differential evolution on its demands."""

from __future__ import annotations

import time
from collections.abc import Iterator
from typing import Any

import numpy as np
from needs import NEEDS, requirement_of, violations
from scipy import optimize

from benchmarks.table import Row, seconds
from explorer.find.answers import FoundDesign
from explorer.find.candidates import HIGHS, LOWS, misses, standard_poses
from explorer.find.certificate import certify
from explorer.find.find import find_designs
from explorer.find.machine_values import TILT, TX, VARIABLES
from explorer.find.requirement import Requirement
from explorer.find.terms import Terms
from explorer.numerics.arrays import FloatArray

COUNT, SECONDS, POSES, EVOLVED = len(NEEDS), 10.0, 1_000_000, 5
SHORT = {"COUNT": 1, "SECONDS": 1.0, "POSES": 1000, "EVOLVED": 1}
# Cost of a whole miss of a demand, beside the logarithm of the longest leg.
MISS = 20.0


def run() -> Iterator[Row]:
    """Yield the rows."""
    found: list[tuple[FoundDesign, float]] = []
    firsts, broken = list[float](), 0
    for need in NEEDS[:COUNT]:
        requirement, first = requirement_of(need, prefer="small"), list[float]()
        began = time.perf_counter()
        answer = find_designs(
            requirement,
            count=1,
            seconds=SECONDS,
            watch=lambda _, first=first, began=began: first.append(time.perf_counter() - began),
        )
        firsts += first[:1]
        for each in answer.designs:
            found.append((each, answer.bound_mm))
            broken += violations(each.design, requirement, POSES)
    over = sorted(each.longest_mm / bound for each, bound in found)
    yield Row(
        f"{COUNT} needs: first certified machine",
        f"{len(firsts)} found, {seconds(max(firsts))} at most, median {seconds(_median(firsts))}",
        "20 in 1 s each",
    )
    yield Row(
        f"longest leg after {SECONDS:g} s over the proven bound",
        f"median {_median(over):.3f}, at most {over[-1]:.3f}",
        "median 1.12",
    )
    yield Row(f"violations in {POSES:,} poses of each", f"{broken}", "0")
    yield _beside_evolution()


def _beside_evolution() -> Row:
    kept, ratios = 0, list[float]()
    for need in NEEDS[:EVOLVED]:
        requirement = requirement_of(need, prefer="small")
        own = find_designs(requirement, count=1, seconds=SECONDS).designs
        other, missed = _evolve(requirement)
        kept += not missed
        ratios += [other / each.longest_mm for each in own]
    return Row(
        f"{EVOLVED} needs for {SECONDS:g} s",
        "all kept, over the whole box",
        beside=f"differential evolution, demands in corners: {kept} of {EVOLVED} kept over the "
        f"whole box, legs {_median(ratios):.2f} times as long",
    )


def _evolve(requirement: Requirement) -> tuple[float, bool]:
    """Return the longest leg, in mm, of a machine by SciPy, and whether it misses a demand."""
    terms, ends = Terms.of(requirement), time.perf_counter() + SECONDS
    poses = standard_poses(terms.tilt)

    def row(values: Any) -> FloatArray:
        x = np.ones(VARIABLES)
        x[:TX], x[TX:TILT] = values, 0.0
        return x

    def cost(values: Any) -> float:
        missed, longest = misses(terms, terms.values(row(values)[None], poses))
        return float(np.log(longest[0]) + MISS * max(0.0, missed[0]))

    def is_over(*_: Any, **__: Any) -> bool:
        return time.perf_counter() > ends

    evolve: Any = optimize.differential_evolution
    with np.errstate(all="ignore"):
        found = evolve(
            cost,
            list(zip(LOWS[:TX], HIGHS[:TX], strict=True)),
            seed=0,
            maxiter=100_000,
            callback=is_over,
        )
        certificate = certify(row(found.x), terms)
    return float(terms.scale_mm * certificate.ranges[:, 1].max()), not certificate.is_kept


def _median(values: list[float]) -> float:
    return float(np.median(values))
