"""Bounds that hold for every machine: the least longest leg, and demands that no machine keeps."""

from __future__ import annotations

from explorer.find.requirement import Requirement


def least_longest_mm(requirement: Requirement) -> float:
    """Return a length that the longest leg of every machine has at least, in millimetres.

    A leg of a ratio ρ that reaches both ends of the smallest edge is at least edge · ρ / (ρ − 1)
    long.
    """
    ratio = requirement.legs.ratio
    return 0.0 if ratio is None else min(requirement.box_mm) * ratio / (ratio - 1.0)


def impossible_demands(requirement: Requirement) -> tuple[str, ...]:
    """Return clauses on demands that no machine keeps, proven."""
    least, longest = least_longest_mm(requirement), requirement.legs.longest_mm
    return (f"no machine has legs below {least:.4g} mm",) if longest and longest < least else ()
