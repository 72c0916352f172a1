"""The claims of the paper, in its order."""

from __future__ import annotations

import json
from collections.abc import Callable, Iterable, Iterator, Mapping
from dataclasses import replace
from types import MappingProxyType

from explorer.errors import InputError
from explorer.files.packaged import packaged_file
from explorer.reproduce import comparison, flags, interference, kinematics, optima
from explorer.reproduce.claim import Claim, Measurement, Result

_MEASURES: Mapping[str, Callable[[], Measurement]] = {
    "same-kinematics": kinematics.measure_same_kinematics,
    "interference": interference.measure_risk,
    "closed-form": kinematics.measure_closed_form,
    "flat-tetrahedra": kinematics.measure_flat_tetrahedra,
    "strata": flags.measure_strata,
    "uncoupled-motions": flags.measure_uncoupled_motions,
    "charts": flags.measure_charts,
    "paths": kinematics.measure_mode_paths,
    "clear-optimum": interference.measure_optimum,
    "table-1": optima.measure_table,
    "search": optima.measure_search,
    "workspace": comparison.measure_workspaces,
    "orientations": comparison.measure_orientations,
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
    """Yield claims of the paper, all or those with some names, with their measurements.

    The title of each claim is reported before it is measured.

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
        measured = claim.measure()
        text = claim.found.format(**{**measured.values, **measured.words})
        yield Result(claim, replace(measured, text=text))
