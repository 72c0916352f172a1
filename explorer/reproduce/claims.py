"""The claims of the paper, in its order, and their measurement."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Mapping
from types import MappingProxyType

from explorer.errors import InputError
from explorer.reproduce import (
    comparison,
    flags,
    interference,
    kinematics,
    mode_paths,
    search,
    singularities,
    table_one,
)
from explorer.reproduce.claim import Claim, Result

OUR_READING = (
    "Our reading: the platform has a yaw of −73.1°, every length is at most the reach |a3| and has "
    "no minimum, and nodes are multiples of a step, the boundary included. The initial b3, 15 in "
    "the scan, is 1.5. The paper prints none of these."
)

CLAIMS: Mapping[str, Claim] = MappingProxyType(
    {
        claim.name: claim
        for claim in (
            Claim(
                "closed-form",
                "Three trilaterations solve the forward kinematics in closed form, with eight "
                "assembly modes.",
                "Its forward kinematics can be solved by a sequence of three trilaterations … a "
                "total of 8 assembly modes.",
                "The system of quadratic equations of [6] is not printed; here it is that of the "
                "nine squared distances.",
                "explorer forward --joints 11.7 10.8 9.3 11.4 9.0 13.0",
                kinematics.closed_form,
            ),
            Claim(
                "interference",
                "The 4-4 has a lower risk of leg interference than the 6-4.",
                "The original 6-4 parallel robot becomes a simpler 4-legged parallel robot with "
                "the same kinematic properties and a lower risk of leg interference.",
                "The paper gives no measure of the risk and no place of a2; here it is the "
                "clearance of legs over the workspace of the optimum, for a range of a2.",
                "explorer interference --design paper-optimal --position 10 5 9",
                interference.interference,
            ),
            Claim(
                "flat-tetrahedra",
                "The mechanism is singular exactly where one of three tetrahedra is flat.",
                "If, and only if, the points … form non-degenerate tetrahedra, there are eight "
                "possible configurations. Otherwise, the manipulator is in a singularity.",
                "",
                "explorer singularity --design paper-optimal --position 10 5 0",
                singularities.flat_tetrahedra,
            ),
            Claim(
                "strata",
                "The singularities have the stratification of the flag manifold.",
                "The topology of its singularity spaces is the same for all members of the family; "
                "they can be easily decomposed into manifolds, or cells, forming a stratification.",
                "",
                "explorer singularity --design paper-optimal --position 10 5 9",
                flags.strata,
            ),
            Claim(
                "uncoupled-motions",
                "The singularities correspond to uncoupled translations and rotations.",
                "The singularities of flagged manipulators correspond to uncoupled translations "
                "and/or rotations in the workspace.",
                "",
                "explorer singularity --design paper-optimal --position 10 5 9",
                flags.uncoupled,
            ),
            Claim(
                "charts",
                "Each cell has one chart of uncoupled translations and rotations.",
                "Each cell can be characterized using a single local chart whose coordinates "
                "directly correspond to uncoupled translations and/or rotations.",
                "The coordinates are read as the travels of the six uncoupled motions.",
                "explorer singularity --design paper-optimal --position 10 5 9",
                flags.chart,
            ),
            Claim(
                "paths",
                "Every path between two assembly modes passes through a singularity.",
                "Any path connecting two assembly modes passes through a singularity (note that "
                "this assertion is not true in general).",
                "",
                "explorer path --design paper-optimal --to 10 5 -9  # ends with status 1",
                mode_paths.paths,
            ),
            Claim(
                "table-1",
                "The designs of Table 1 have the printed extents and a volume of 7992.",
                "The workspace volume of the optimal solution is 7992.",
                OUR_READING,
                "explorer workspace --design paper-optimal",
                table_one.extents,
            ),
            Claim(
                "search",
                "Sequential quadratic programming matches a volume of 8000.",
                "The proposed optimum design algorithm takes 220 iterations to converge to an "
                "optimal solution.",
                OUR_READING,
                "explorer optimise --design paper-initial --target-volume 8000 "
                "--box 0 -12 0 20 22 18",
                search.search,
            ),
            Claim(
                "orientations",
                "The workspace is large, with great orientation abilities.",
                "It possesses a large workspace, with great orientation abilities.",
                "The paper compares with no design. Here it is the 6-4 twin and an octahedral "
                "Stewart-Gough platform of the same reach, whose base and platform are equilateral "
                "triangles with the areas of a1 a2 a3 and b1 b2 b3.",
                "explorer orientation --design paper-optimal --position 10 5 9",
                comparison.orientations,
            ),
            Claim(
                "simpler",
                "It is simpler in structure than most other designs.",
                "It is simpler in structure (it possesses four legs) and consequently cheaper than "
                "most other designs.",
                "Counted against the 6-4 and an octahedral Stewart-Gough platform.",
                "explorer export mechanism --out mechanism.zip",
                comparison.simplicity,
            ),
            Claim(
                "cheaper",
                "It is cheaper than most other designs.",
                "… and consequently cheaper than most other designs.",
                "",
                "explorer reproduce --claim simpler",
                comparison.cost,
            ),
        )
    }
)
"""The claims by name, in the order in which they are listed."""


def measure_claims(
    names: Iterable[str] | None = None, tell: Callable[[str], None] | None = None
) -> Iterator[Result]:
    """Yield claims of the paper with what is measured for them.

    Args:
        names: Names of claims, out of `CLAIMS`; None for all.
        tell: Called with the title of each claim before it is measured.

    Raises:
        InputError: No such claim.
    """
    chosen = tuple(CLAIMS) if names is None else tuple(names)
    for name in chosen:
        if name not in CLAIMS:
            raise InputError(f"no claim {name!r}; there are {', '.join(CLAIMS)}")
    for name in chosen:
        claim = CLAIMS[name]
        if tell is not None:
            tell(claim.title)
        yield Result(claim, claim.measure())
