"""The verdict on a pose: singular, near a singularity, or clear, and by which incidence.

An incidence is measured twice: by its margin, and by the distance of the nearest pose that has
it (`explorer.singularity.nearest`). Either may be small while the other is not: a small turn of the
platform can undo a large margin, and the margin of two lines that are nearly parallel is small
however far apart they are. So the smaller counts, each as a multiple of its own warning length:
that of the distances is a share of that of the margins, since b1 to b4 reach a singular pose by
a way that is shorter than the margin: the platform may turn as well as shift.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

from explorer.measures.snapshot import Snapshot
from explorer.mechanism.margins import INCIDENCES
from explorer.singularity.bruhat import incidences

# The warning length of the distances, as a share of that of the margins.
DISTANCE_SHARE = 1.0 / 3.0

Kind = Literal["singular", "near", "clear"]
TITLES: dict[Kind, str] = {
    "singular": "Singular",
    "near": "Near a singularity",
    "clear": "Clear of singularities",
}


@dataclass(frozen=True)
class Verdict:
    """How near a pose is to a singularity.

    Attributes:
        kind: Whether the pose is singular, near a singularity, or clear of all.
        levels: Of each incidence, the smaller of |margin| and distance to its nearest singular
            pose, each over its warning length: 0 is singular, below 1 is near.
        incidences: Those that hold where the pose is singular; else those that are near, the
            lowest level first; else the one whose nearest singular pose is the nearest; 1 to 3.
        distance: The root-mean-square way of b1 to b4 to the nearest pose with the first of
            these incidences, in design units; 0 where the pose is singular.
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
        """Return what it rests on, such as "2.52 mm from δ2 = 0, lines a1a2 and b2b3 meeting".

        Args:
            length: The distance, with its unit.
        """
        if self.kind == "singular":
            return "; ".join(f"δ{each} = 0: {INCIDENCES[each - 1]}" for each in self.incidences)
        first = self.incidences[0]
        return f"{length} from δ{first} = 0, {INCIDENCES[first - 1]}"


def verdict(snapshot: Snapshot, warn_below: float) -> Verdict:
    """Return the verdict on a pose.

    Args:
        snapshot: The design in the pose.
        warn_below: The warning length of the margins, in design units.
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
