"""The search for machines that keep a requirement.

Of many random machines the best few are improved by SQP, while their certificate decides: the
poses that miss a demand join the search, until none is found. Later starts are others of the
random machines, and machines near the best so far. How much is done in a second is fixed, so
that a search with the same seed finds the same machines.
"""

from __future__ import annotations

import itertools
import math
import time
from collections.abc import Callable, Iterator
from dataclasses import dataclass, field, replace

import msgspec
import numpy as np

from explorer.find.answers import FoundDesign, FoundDesigns
from explorer.find.bound import impossible_demands, least_longest_mm
from explorer.find.candidates import best_first, candidates, standard_poses
from explorer.find.certificate import Certificate, certify, is_regular, lengths_over
from explorer.find.check import check_machine, is_kept
from explorer.find.demands import demands_of, every_demand, largest_error
from explorer.find.improvement import Improvement, free_variables
from explorer.find.over_tilts import nearest_poses
from explorer.find.requirement import PREFERENCES, Preference, Requirement
from explorer.find.terms import Terms, design_of, row_of
from explorer.mechanism.design import LENGTHS, Design
from explorer.numerics import checks
from explorer.numerics.arrays import FloatArray
from explorer.optimise.search.sqp import Stop

# Units of work in a second: about those of one core of a laptop.
UNITS_PER_SECOND = 150.0
# Units of a block of candidates, of one evaluation of a machine, and of a certificate.
BLOCK_UNITS, EVALUATION_UNITS, CERTIFICATE_UNITS = 50.0, 1.0, 20.0
# Factor on the seconds after which a search ends on a slow machine all the same.
PATIENCE = 4.0
# Rounds of an improvement and a certificate, and most cells of poses of the latter.
ROUNDS, CELLS = 8, 4000
# Azimuths of the tilts in whose nearest places an improvement looks.
AZIMUTHS = 16
# Amount of a miss between the poses up to which the next round leaves as much to spare.
SPARE = 5e-3
# Amount of a miss at which an improvement goes on with more poses.
NEARLY = 1e-3
# Random machines that are certified as they are until one is kept, and improved ones of a block.
TRIED, IMPROVED = 8, 6
# Share of the distance of legs beyond which a clearance that is missed is that of crossed legs.
CROSSED = 0.7
# Sizes of the changes of the best machines, over their variables' ranges.
CHANGES = (0.02, 0.06, 0.15)

OTHER_KINDS: tuple[Preference, ...] = (
    *("balanced", "small", "far-from-singular", "easy-to-build"),
    *("little-force", "precise", "stiff"),
)
"""The kinds of further answers, in their order."""


@dataclass
class Machine:
    """A machine that keeps a requirement: row, certificate, cost of its kind, and poses."""

    x: FloatArray
    certificate: Certificate
    cost: float
    kind: str
    poses: FloatArray


@dataclass
class Search:
    """A search for machines that keep a requirement, of some kinds.

    Attributes:
        terms: The requirement.
        kinds: The kinds, the preferred one first.
        units: Units of work that it may take.
        ends: Time of the clock at which it ends at the latest.
        stop: Function that says whether to end.
        seed: Seed of the random machines.
        enough: Longest leg over the diagonal of the box that ends the search.
        best: The best machine of each kind.
        done: Units of work that it has taken.
        is_cancelled: Whether `stop` has ended it.
    """

    terms: Terms
    kinds: tuple[str, ...]
    units: float
    ends: float
    stop: Callable[[], bool]
    seed: int
    enough: float = 0.0
    best: dict[str, Machine] = field(default_factory=dict[str, Machine])
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
        if start is None and math.isfinite(self.terms.longest):
            # Legs are shortened without a limit first, which most machines are far beyond.
            free = replace(self.terms, longest=math.inf)
            short = replace(self, terms=free, kinds=("small",), enough=self.terms.longest, best={})
            short.run(None, lambda: None)
            self.done, self.is_cancelled = short.done, short.is_cancelled
            if "small" not in short.best:
                return
            start = short.best["small"].x
        try:
            for each in self._starts(start):
                found = each if isinstance(each, Machine) else self.improve(*each)
                if found is not None and self._add(found):
                    tell()
                    if found.certificate.ranges[:, 1].max() <= self.enough:
                        return
        except Stop:
            return

    def _add(self, found: Machine) -> bool:
        """Keep a machine if it is the best of its kind; return whether it is."""
        known = self.best.get(found.kind)
        if known is not None and known.cost <= found.cost + 1e-6:
            return False
        self.best[found.kind] = found
        return True

    def _starts(self, start: FloatArray | None) -> Iterator[tuple[FloatArray, str] | Machine]:
        """Yield kinds and machines to improve, without an end."""
        random = np.random.default_rng(self.seed + 1)
        if start is not None:
            as_it_is = self._as_it_is(start)
            if as_it_is is not None:
                yield as_it_is
            for kind in self.kinds:
                yield start, kind
            for kind in itertools.cycle(self.kinds):
                best = self.best.get(kind)
                yield self._near(start if best is None else best.x, random), kind
        first = True
        for x, missed, large in candidates(self.terms, self.seed):
            self.spend(BLOCK_UNITS)
            if first and len(x):
                tried = map(self._as_it_is, x[np.argsort(missed)[:TRIED]])
                kept = next((each for each in tried if each is not None), None)
                if kept is not None:
                    yield kept
            order = best_first(missed, large)[: IMPROVED if first else IMPROVED // 2]
            before = self.best.get(self.kinds[0])
            for row in order:
                yield x[row], self.kinds[0]
                best = self.best.get(self.kinds[0])
                if best is not None and best is not before:
                    before = best
                    # What fails from one machine may succeed from another.
                    for kind in (*self.kinds, *self.kinds):
                        if kind not in self.best:
                            others = [*self.best.values()]
                            yield others[random.integers(len(others))].x, kind
            first = False
            for kind in self.kinds:
                if self.best:
                    others = [*self.best.values()]
                    best = self.best.get(kind) or others[random.integers(len(others))]
                    yield best.x if kind not in self.best else self._near(best.x, random), kind
            if self.kinds[0] in self.best:
                for _ in CHANGES:
                    yield self._near(self.best[self.kinds[0]].x, random), self.kinds[0]

    def _as_it_is(self, x: FloatArray) -> Machine | None:
        """Return a machine with its certificate, of the preferred kind; None if it fails."""
        self.spend(CERTIFICATE_UNITS)
        certificate = certify(x, self.terms, cells=CELLS)
        if not is_kept(x, self.terms, certificate):
            return None
        poses, kind = standard_poses(self.terms.tilt), self.kinds[0]
        cost = Improvement(self.terms, kind, x).cost(poses)
        return Machine(x, certificate, cost, kind, poses)

    def _near(self, x: FloatArray, random: np.random.Generator) -> FloatArray:
        """Return a machine near another one."""
        free, moved = free_variables(self.terms), x.copy()
        moved[free] += random.choice(CHANGES) * random.normal(size=len(free))
        return moved

    def improve(self, x: FloatArray, kind: str, known: Machine | None = None) -> Machine | None:
        """Return the machine after an improvement, certified; None if it misses a demand.

        It goes on with the certificate and the poses of a machine if one is known.
        """
        if known is None:
            poses = standard_poses(self.terms.tilt)
            ranges = lengths_over(x, self.terms, poses)
            found = certify(x, self.terms, ranges=ranges, is_quick=True, cells=64)
        else:
            found, poses = known.certificate, known.poses
        azimuths = np.linspace(-math.pi, math.pi, AZIMUTHS + 1)[1:]
        tilts = np.array([(0.0, 0.0), *((each, self.terms.tilt) for each in azimuths)])
        for _ in range(ROUNDS):
            nearest = nearest_poses(x, self.terms, tilts)
            poses = np.concatenate([poses, found.worst_poses, nearest])
            missed = float(found.missed.max())
            spare = missed if 0.0 < missed < SPARE else 0.0
            search = Improvement(self.terms, kind, x, lambda: self.spend(EVALUATION_UNITS), spare)
            improved = search.run(poses)
            x = improved.x
            best = self.best.get(kind)
            # What further poses demand does not lower the cost.
            is_worse = best is not None and improved.cost >= best.cost
            if is_worse or improved.missed > NEARLY or not is_regular(x):
                return None
            self.spend(CERTIFICATE_UNITS)
            found, is_machine = self.certify(x, poses)
            if found.is_kept:
                return Machine(x, found, improved.cost, kind, poses) if is_machine else None
            # Legs that cross between the poses stay crossed.
            crossed = found.missed[found.rows("clearance")] > CROSSED * self.terms.distance
            if crossed.any():
                return None
        return None

    def certify(self, x: FloatArray, poses: FloatArray) -> tuple[Certificate, bool]:
        """Return the certificate of an improved machine, and whether it keeps all demands.

        The certificate is quick if a limit is missed.
        """
        found = certify(x, self.terms, cells=CELLS, poses=poses, is_quick=True)
        return found, is_kept(x, self.terms, found)

    def finish(self) -> None:
        """Certify the best machines with more cells; improve those again that miss a demand."""
        self.units = math.inf
        for kind in list(self.best):
            last: Machine | None = self.best.pop(kind)
            while last is not None:
                last = replace(last, certificate=certify(last.x, self.terms))
                if last.certificate.is_kept:
                    self.best[kind] = last
                    break
                try:
                    last = self.improve(last.x, kind, last)
                except Stop:
                    last = None


def find_designs(
    requirement: Requirement,
    *,
    prefer: Preference | None = None,
    count: int = 4,
    seconds: float = 10.0,
    seed: int = 0,
    design: Design | None = None,
    watch: Callable[[FoundDesigns], None] | None = None,
    stop: Callable[[], bool] | None = None,
) -> FoundDesigns:
    """Search for designs that keep a requirement; refuse at once what no machine keeps.

    With the same seed and the same seconds the designs are the same, unless the machine is so slow
    that the search ends by the clock.

    Args:
        requirement: The requirement.
        prefer: Kind of machine that is preferred; that of the requirement if None.
        count: Number of designs, of different kinds, 1 to 7.
        seconds: Time of the search on a usual core.
        seed: Seed of the random machines.
        design: Design to improve in place of random machines; it need not keep the requirement.
        watch: Called with what is found so far each time it is better.
        stop: Called some hundred times a second; True ends the search and keeps what was found.

    Raises:
        InputError: A number is out of range, or there is no such preference.
    """
    preferred = checks.one_of("prefer", prefer or requirement.prefer, PREFERENCES)
    checks.whole("count", count, 1, len(PREFERENCES))
    checks.whole("seed", seed, 0, 2**31 - 1)
    seconds = checks.positive("seconds", seconds)
    terms = Terms.of(requirement)
    bounded = requirement
    if design is not None and any(design.tool.position):
        # The tool stays beside b4, whose bounds do not hold then.
        bounded = msgspec.structs.replace(requirement, free=(*requirement.free, "tool"))
    bound, impossible = least_longest_mm(bounded), impossible_demands(bounded)
    kinds = tuple(dict.fromkeys((preferred, *OTHER_KINDS)))[:count]
    if impossible:
        return FoundDesigns((), bound, impossible, status="impossible")
    start = None if design is None else row_of(design, terms)
    ends = time.perf_counter() + PATIENCE * seconds
    units = UNITS_PER_SECOND * seconds
    search = Search(terms, kinds, units, ends, stop or (lambda: False), seed)

    def so_far() -> FoundDesigns:
        found = [search.best[kind] for kind in search.kinds if kind in search.best]
        designs = tuple(_answer(each, terms, design) for each in found)
        binding = () if not found else _binding(found[0], terms)
        return FoundDesigns(designs, bound, (), binding)

    search.run(start, lambda: watch(so_far()) if watch else None)
    search.finish()
    found, status = so_far(), "cancelled" if search.is_cancelled else "none"
    return found if found.designs else replace(found, status=status)


def _answer(found: Machine, terms: Terms, base: Design | None) -> FoundDesign:
    """Return a machine as a design with its check."""
    certificate = found.certificate
    name = f"{terms.requirement.name} {found.kind}"
    design = design_of(found.x, terms, certificate.ranges, name, base)
    poses = np.concatenate([standard_poses(terms.tilt), certificate.poses])
    at = terms.values(found.x, poses)
    speeds = np.stack(np.broadcast_arrays(*at.tool_speeds))
    used = (each.values(at) for each in demands_of(terms) if each.name == "force")
    legs = terms.requirement.legs
    return FoundDesign(
        design=design,
        check=check_machine(design, found.x, terms, certificate),
        kind=found.kind,
        longest_mm=float(terms.scale_mm * certificate.ranges[:, 1].max()),
        utilisation=float(max((np.max(each) for each in used), default=0.0)),
        force_per_newton=float(speeds.max()),
        clearance_mm=float(terms.scale_mm * np.min(at.uncrossed_distances)) - legs.diameter_mm,
        transmission=float(np.min(at.transmissions)),
        error_mm=float(legs.error_mm * np.max(largest_error(at))),
    )


# Demands with less than this to spare beside the reserve of the search, over the diagonal or over
# their limit, bind a design.
BINDING = 5e-3


def _binding(found: Machine, terms: Terms) -> tuple[str, ...]:
    """Return the names of the demands that bind a machine."""
    certificate = found.certificate
    ratios = certificate.ranges[:, 1] / certificate.ranges[:, 0]
    reserve = {each.name: each.reserve for each in every_demand(terms)}
    rows = zip(certificate.names[8:], certificate.items[8:], certificate.missed[8:], strict=True)
    binding = [
        f"{name} {item}".strip() for name, item, each in rows if each > -BINDING - reserve[name]
    ]
    limits = [("ratio", ratios, terms.ratio)]
    limits.append(("longest leg", certificate.ranges[:, 1], terms.longest))
    legs = [
        f"{name} {leg}"
        for name, values, most in limits
        for leg, value in zip(LENGTHS, values.tolist(), strict=True)
        if value > most * (1.0 - BINDING)
    ]
    return (*legs, *binding)
