"""The claims of the paper, in its order."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Mapping
from types import MappingProxyType

from explorer.errors import InputError
from explorer.reproduce.claim import Claim, Result
from explorer.reproduce.comparison import large_workspace, orientations
from explorer.reproduce.flags import chart, strata, uncoupled
from explorer.reproduce.interference import FROM, clear_optimum, lower_risk
from explorer.reproduce.kinematics import (
    closed_form,
    flat_tetrahedra,
    mode_paths,
    same_kinematics,
)
from explorer.reproduce.search import search
from explorer.reproduce.table_one import extents

OUR_READING = (
    "The platform has a yaw of −73.1°. Every length is at most the reach |a3| and has no minimum. "
    "Nodes are multiples of a step, 2 for the optimum and a 15th of the reach for the initial "
    "design, the boundary included. The paper prints none of these; yaw and steps are fitted to "
    "what it prints. The initial b3, 15 in the scan, is read as 1.5, and the demanded volume, "
    "8d@0 in the scan, as 8000."
)
SIX_LEGS = (
    "The paper compares with no design. Here it is the 6-4 twin with a2 at two places, and an "
    "octahedral Stewart-Gough platform of the same reach, whose base and platform are equilateral "
    "triangles with the areas of a1 a2 a3 and b1 b2 b3 for a2x at the reach. All six actuators of "
    "each have the same stroke, from 0 to the reach; the carriages of the 4-4 have it from a1 on."
)

CLAIMS: Mapping[str, Claim] = MappingProxyType(
    {
        claim.name: claim
        for claim in (
            Claim(
                "same-kinematics",
                "The 4-4 has the kinematic properties of the 6-4.",
                "The set of actuated variables in both platforms are in a one-to-one "
                "correspondence, so both platforms are kinematically equivalent … the original 6-4 "
                "parallel robot becomes a simpler 4-legged parallel robot with the same kinematic "
                "properties …",
                "The properties are read as the actuated variables, the assembly modes and the "
                "singular poses. Workspaces at equal strokes differ, and are claims of their own.",
                "explorer forward --joints 11.7 10.8 9.3 11.4 9.0 13.0",
                same_kinematics,
            ),
            Claim(
                "interference",
                "The 4-4 has a lower risk of leg interference than the 6-4.",
                "… and a lower risk of leg interference.",
                "The paper gives no measure of the risk and no place of a2. Here it is clearances "
                "and swept tetrahedra over the workspace of the optimum at the orientation of its "
                f"home, from z = {FROM:g} on, for a range of a2. Legs with a common joint do not "
                "count as a pair.",
                "explorer interference --design paper-optimal --position 10 5 9",
                lower_risk,
            ),
            Claim(
                "closed-form",
                "Three trilaterations solve the forward kinematics in closed form, with eight "
                "assembly modes.",
                "Its forward kinematics can be solved by a sequence of three trilaterations … so "
                "that they give a total of 8 assembly modes.",
                "",
                "explorer forward --joints 11.7 10.8 9.3 11.4 9.0 13.0",
                closed_form,
            ),
            Claim(
                "flat-tetrahedra",
                "The mechanism is singular exactly where one of three tetrahedra is flat.",
                "If, and only if, the points … form non-degenerate tetrahedra, there are eight "
                "possible configurations … Otherwise, the parallel manipulator is in a "
                "singularity.",
                "Singular is read as a loss of rank of the actuator Jacobian J.",
                "explorer singularity --design paper-optimal --position 10 5 0",
                flat_tetrahedra,
            ),
            Claim(
                "strata",
                "The singularities have the stratification of the flag manifold.",
                "The topology of their singularity spaces is the same for all members of the "
                "family … their singularity spaces can be easily decomposed into manifolds, or "
                "cells, forming what in algebraic geometry is called a stratification, derived "
                "from that of the flag manifold.",
                "",
                "explorer singularity --design paper-optimal --position 10 5 9",
                strata,
            ),
            Claim(
                "uncoupled-motions",
                "The singularities correspond to uncoupled translations and rotations.",
                "The singularities of flagged manipulators correspond to uncoupled translations "
                "and/or rotations in the workspace of the manipulator.",
                "A motion is uncoupled if it changes one of the three margins alone. A singularity "
                "corresponds to the motion that changes its margin, and to the one that it frees.",
                "explorer reproduce --claim uncoupled-motions",
                uncoupled,
            ),
            Claim(
                "charts",
                "Each cell has one chart of uncoupled translations and rotations.",
                "Each cell can be characterized using a single local chart whose coordinates "
                "directly correspond to uncoupled translations and/or rotations in the workspace "
                "of the manipulator.",
                "The charts are those of another paper, which is not at hand. Here a cell is a "
                "stratum or, if it is not connected, a connected part of it, and a coordinate is "
                "the amount of one of the platform's uncoupled motions, made one after the other. "
                "r is the distance a1b4, β and ε are the angles of the line a1b4 with the guide "
                "and with the line b2b3, and φ1, φ2 and φ3 are the angles by which the mechanism "
                "is folded at the line b2b3, at a1b4 and at the guide.",
                "explorer reproduce --claim charts",
                chart,
            ),
            Claim(
                "paths",
                "Every path between two assembly modes passes through a singularity.",
                "Any path connecting two assembly modes passes through a singularity (note that "
                "this assertion is not true in general …).",
                "",
                "explorer path --design paper-optimal --to 10 5 -9  # ends with status 1",
                mode_paths,
            ),
            Claim(
                "clear-optimum",
                "The optimum keeps the swept tetrahedra of its legs apart.",
                "The optimum design algorithm takes into account interferences among legs …",
                "The orientation stays that of home; a step leads from a node along x, y or z.",
                "explorer workspace --design paper-optimal --interference",
                clear_optimum,
            ),
            Claim(
                "table-1",
                "The designs of Table 1 have the printed extents and a volume of 7992.",
                "The workspace volume of the optimal solution is 7992.",
                OUR_READING,
                "explorer workspace --design paper-optimal",
                extents,
            ),
            Claim(
                "search",
                "Sequential quadratic programming matches a volume of 8000.",
                "[The] proposed optimum design algorithm takes 220 iterations to converge to a[n "
                "optimal] solution.",
                OUR_READING,
                "explorer optimise --design paper-initial --target-volume 8000 "
                "--box 0 -12 0 20 22 18",
                search,
            ),
            Claim(
                "workspace",
                "The workspace is large.",
                "It possesses a large workspace …",
                SIX_LEGS,
                "explorer workspace --design paper-optimal",
                large_workspace,
            ),
            Claim(
                "orientations",
                "The 4-4 has great orientation abilities.",
                "… with great orientation [abilities].",
                SIX_LEGS,
                "explorer orientation --design paper-optimal --position 10 5 9",
                orientations,
            ),
        )
    }
)
"""The claims by name, in the order in which they are listed."""


def measure_claims(
    names: Iterable[str] | None = None, report: Callable[[str], None] | None = None
) -> Iterator[Result]:
    """Yield claims of the paper with their measurements.

    Args:
        names: Names of claims, out of `CLAIMS`; None for all.
        report: Called with the title of each claim before it is measured.

    Raises:
        InputError: No such claim.
    """
    chosen = tuple(CLAIMS) if names is None else tuple(names)
    for name in chosen:
        if name not in CLAIMS:
            raise InputError(f"no claim {name!r}; there are {', '.join(CLAIMS)}")
    for name in chosen:
        claim = CLAIMS[name]
        if report is not None:
            report(claim.title)
        yield Result(claim, claim.measure())
