"""The precision of a report: a design with errors or stiffness in one pose under its payload."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from explorer.measures.case import Case
from explorer.statics.compliance import largest_deflection
from explorer.statics.loaded import LoadedPose
from explorer.statics.tool_precision import ToolPrecision


def precision_of(case: Case) -> ToolPrecision | None:
    """Return the precision of a design in its pose; None if the design is exact and rigid.

    The load is the payload's weight, and its force in the direction that moves the tool the most.
    """
    weighed = ToolPrecision(LoadedPose(case.design, case.at))
    if not (weighed.has_errors or case.is_elastic):
        return None
    force = case.design.payload.force_n
    _, worst = largest_deflection(weighed.compliance, weighed.wrench, force)
    if not np.isfinite(worst).all():
        return weighed
    x, y, z = worst.tolist()
    return ToolPrecision(replace(weighed.loaded, load=(x, y, z, 0.0, 0.0, 0.0)))
