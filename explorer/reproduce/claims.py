"""The claims of the paper, in its order."""

from __future__ import annotations

import json
from collections.abc import Callable, Iterable, Iterator, Mapping
from types import MappingProxyType

from explorer.errors import InputError
from explorer.files.packaged import packaged_file
from explorer.reproduce import kinematics
from explorer.reproduce.claim import Claim, Measurement, Result
from explorer.reproduce.comparison import large_workspace, orientations
from explorer.reproduce.flags import chart, strata, uncoupled
from explorer.reproduce.interference import clear_optimum, lower_risk
from explorer.reproduce.search import search
from explorer.reproduce.table_one import extents

_MEASURES: Mapping[str, Callable[[], Measurement]] = {
    "same-kinematics": kinematics.same_kinematics,
    "interference": lower_risk,
    "closed-form": kinematics.closed_form,
    "flat-tetrahedra": kinematics.flat_tetrahedra,
    "strata": strata,
    "uncoupled-motions": uncoupled,
    "charts": chart,
    "paths": kinematics.mode_paths,
    "clear-optimum": clear_optimum,
    "table-1": extents,
    "search": search,
    "workspace": large_workspace,
    "orientations": orientations,
}

CLAIMS: Mapping[str, Claim] = MappingProxyType(
    {
        claim["name"]: Claim(**claim, measure=_MEASURES[claim["name"]])
        for claim in json.loads(packaged_file("claims", "paper.json").read_text("utf-8"))
    }
)
"""The claims by name, in the order in which they are listed; their words stand beside the page."""


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
