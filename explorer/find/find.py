"""The search for machines that keep a requirement.

Of many random machines the best few are improved by SQP, with their certificate as the oracle: the
poses that miss a demand join the search, until none is found. Later starts are others of the
random machines, and the best machines so far, shaken. How much is done in a second is fixed, so
that a search with the same seed finds the same machines.
"""

from __future__ import annotations

import math
import time
from collections.abc import Callable, Iterator
from dataclasses import dataclass, field

import numpy as np

from explorer.find import machine_values as m
from explorer.find.answers import FoundDesign, FoundDesigns
from explorer.find.candidates import candidates, standard_poses
from explorer.find.certificate import Certificate, certify, is_regular

from explorer.find.improvement import Improvement, free_variables
from explorer.find.machine_values import HOME
from explorer.find.requirement import PREFERENCES, Preference, Requirement
from explorer.find.terms import Terms, design_of, row_of
from explorer.legs.clearance import PAIRS
from explorer.mechanism.design import Design
from explorer.numerics import checks
from explorer.numerics.arrays import FloatArray
from explorer.optimise.search.sqp import Stop

# Units of work in a second: about those of one core of a laptop.
UNITS_PER_SECOND = 250.0
# Units of a block of candidates, of one evaluation of a machine, and of a certificate.
BLOCK_UNITS, EVALUATION_UNITS, CERTIFICATE_UNITS = 50.0, 1.0, 20.0
# Factor on the seconds after which a search ends on a slow machine all the same.
PATIENCE = 4.0
# Rounds of an improvement and a certificate, and cells of poses of the latter.
ROUNDS, CELLS = 8, 4000
# Random machines that are certified as they are until one is kept, and improved ones of a block.
TRIED, IMPROVED = 8, 6
# Share of the distance of legs beyond which a clearance that is missed is that of crossed legs.
CROSSED = 0.7
# Sizes of the shakes of the best machines, over their variables' ranges.
SHAKES = (0.02, 0.06, 0.15)

OTHER_KINDS: tuple[Preference, ...] = (
    "balanced", "small", "far-from-singular", "easy-to-build", "little-force", "precise", "stiff",
)
"""The kinds of further answers, in their order."""


@dataclass
class Machine:
    """A machine that keeps a requirement: its row, its certificate and its cost of a kind."""

    x: FloatArray
    certificate: Certificate
    cost: float
    kind: Preference


@dataclass
class Search:
    """A search for machines that keep a requirement, of some kinds.

    Attributes:
        terms: The requirement.
        kinds: The kinds, the preferred one first.
        units: Units of work that it may take.
        ends: Time of the clock at which it ends at the latest.
        stop: Function that says whether to end.
        best: The best machine of each kind.
    """

    terms: Terms
    kinds: tuple[Preference, ...]
    units: float
    ends: float
    stop: Callable[[], bool]
    seed: int
    best: dict[Preference, Machine] = field(default_factory=dict[Preference, Machine])
    nearly: list[tuple[float, FloatArray]] = field(default_factory=list[tuple[float, FloatArray]])
    done: float = 0.0
    is_cancelled: bool = False

    def spend(self, units: float) -> None:
        """Count units of work; raise `Stop` if there are none left, or if the search is to end."""
        self.done += units
        if self.stop():
            self.is_cancelled = True
            raise Stop
        if self.done > self.units or time.perf_counter() > self.ends:
            raise Stop

    def run(self, start: FloatArray | None, tell: Callable[[], None]) -> None:
        """Search from a start, or from random machines, and tell each time one is better."""
        try:
            for each in self._starts(start):
                found = each if isinstance(each, Machine) else self.improve(*each)
                if found is not None and self._add(found):
                    tell()
        except Stop:
            return

    def _add(self, found: Machine) -> bool:
        """Keep a machine if it is the best of its kind; return whether it is."""
        known = self.best.get(found.kind)
        if known is not None and known.cost <= found.cost + 1e-6:
            return False
        self.best[found.kind] = found
        return True

    def _starts(self, start: FloatArray | None) -> Iterator[tuple[FloatArray, Preference] | Machine]:
        """Yield kinds and machines to improve, without an end."""
        random = np.random.default_rng(self.seed + 1)
        if start is not None:
            for kind in self.kinds:
                yield start, kind
            while True:
                yield self._shake(start, random), self.kinds[0]
        first = True
        for x, missed, large in candidates(self.terms, self.seed):
            self.spend(BLOCK_UNITS)
            if first and len(x):
                for row in np.argsort(missed)[:TRIED]:
                    self.spend(CERTIFICATE_UNITS)
                    certificate = certify(x[row], self.terms, cells=CELLS)
                    if certificate.is_kept:
                        search = Improvement(self.terms, self.kinds[0], x[row])
                        cost = search.cost(standard_poses(self.terms.tilt))
                        yield Machine(x[row], certificate, cost, self.kinds[0])
                        break
            score = np.log(large) + 4.0 * np.maximum(missed, 0.0)
            order = np.argsort(score)[: IMPROVED if first else IMPROVED // 2]
            for row in order:
                yield x[row], self.kinds[0]
            first = False
            for kind in self.kinds:
                if self.best:
                    best = self.best.get(kind) or min(self.best.values(), key=lambda each: each.cost)
                    yield best.x if kind not in self.best else self._shake(best.x, random), kind
            if self.kinds[0] in self.best:
                for _ in SHAKES:
                    yield self._shake(self.best[self.kinds[0]].x, random), self.kinds[0]

    def _shake(self, x: FloatArray, random: np.random.Generator) -> FloatArray:
        """Return a machine near another one."""
        free, moved = free_variables(self.terms), x.copy()
        moved[free] += random.choice(SHAKES) * random.normal(size=len(free))
        return moved

    def improve(self, x: FloatArray, kind: Preference) -> Machine | None:
        """Return the machine after an improvement, certified; None if it misses a demand."""
        poses = standard_poses(self.terms.tilt)
        poses = poses.plus(certify(x, self.terms, is_quick=True, cells=64).worst_poses)
        for _ in range(ROUNDS):
            search = Improvement(self.terms, kind, x, lambda: self.spend(EVALUATION_UNITS))
            improved = search.run(poses)
            x = improved.x
            if improved.missed > 1e-5 or not is_regular(x):
                return None
            self.spend(CERTIFICATE_UNITS)
            found = certify(x, self.terms, cells=CELLS, is_quick=True)
            if found.is_kept:
                return Machine(x, found, improved.cost, kind)
            # Legs that cross between the poses stay crossed.
            crossed = found.missed_demands[: len(PAIRS)] > CROSSED * self.terms.distance
            if self.terms.distance > 0.0 and crossed.any():
                return None
            poses = poses.plus(found.worst_poses)
        return None
