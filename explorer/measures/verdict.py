"""The verdict on a pose: singular, near a singularity, or clear, and by which incidence.

An incidence is measured by its margin, and by the distance of the nearest pose that has it
(`explorer.singularity.nearest`). Either may be small while the other is not: a small turn of the
platform can remove a large margin, and the margin of two nearly parallel lines is small however
far apart they are. So the smaller of the two counts, each over a warning length of its own. The
warning length of distances is the shorter one: the platform can turn as well as shift, so its
points move to the nearest singular pose by less than the margin.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

from explorer.measures.snapshot import Snapshot
from explorer.mechanism.margins import INCIDENCES
from explorer.singularity.bruhat import incidences

# Warning length of distances, as a share of that of margins.
DISTANCE_SHARE = 1.0 / 3.0

Kind = Literal["singular", "near", "clear"]
TITLES: dict[Kind, str] = {
    "singular": "Singular",
    "near": "Near a singularity",
    "clear": "Clear of singularities",
}


@dataclass(frozen=True)
class Verdict:
    """The nearness of a pose to a singularity.

    Attributes:
        kind: Whether the pose is singular, near a singularity, or clear of all.
        levels: Level of each incidence: the smaller of |δ| and the distance to its nearest
            singular pose, each over its warning length; 0 is singular, below 1 is near.
        incidences: Numbers 1 to 3 of the incidences that hold in a singular pose; of those
            that are near, the lowest level first; in a clear pose, of the nearest one.
        distance: Root-mean-square displacement of b1 to b4 to the nearest pose with the first
            of these incidences, in design units; 0 in a singular pose.
    """

    kind: Kind
    levels: tuple[float, float, float]
    incidences: tuple[int, ...]
    distance: float

    @property
    def title(self) -> str:
        """The verdict in words, such as "Near a singularity"."""
        return TITLES[self.kind]

    def reason(self, length: str) -> str:
        """Return the reason, such as "2.52 mm from δ2 = 0, lines a1a2 and b2b3 meeting".

        Args:
            length: Text of the distance, with its unit.
        """
        if self.kind == "singular":
            return "; ".join(f"δ{index} = 0: {INCIDENCES[index - 1]}" for index in self.incidences)
        first = self.incidences[0]
        return f"{length} from δ{first} = 0, {INCIDENCES[first - 1]}"


def verdict(snapshot: Snapshot, warn_below: float) -> Verdict:
    """Return the verdict on a pose.

    Args:
        snapshot: The design in the pose.
        warn_below: Warning length of the margins, in design units.
    """
    levels, distances = _levels(snapshot, warn_below), snapshot.nearest_distances
    if holding := incidences(snapshot.stratum):
        return Verdict("singular", levels, holding, 0.0)
    order = sorted((1, 2, 3), key=lambda incidence: levels[incidence - 1])
    if near := tuple(incidence for incidence in order if levels[incidence - 1] < 1.0):
        return Verdict("near", levels, near, distances[near[0] - 1])
    nearest = min((1, 2, 3), key=lambda incidence: distances[incidence - 1])
    return Verdict("clear", levels, (nearest,), distances[nearest - 1])


def _levels(snapshot: Snapshot, warn_below: float) -> tuple[float, float, float]:
    holding = incidences(snapshot.stratum)

    def level(incidence: int) -> float:
        if incidence in holding:
            return 0.0
        margin = abs(float(snapshot.margins[incidence - 1]))
        distance = snapshot.nearest_distances[incidence - 1]
        return min(margin, distance / DISTANCE_SHARE) / warn_below

    return level(1), level(2), level(3)
