"""`explorer accuracy`: errors of the tool, its compliance, and its deflection under a load."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Annotated

import msgspec
import numpy as np

from explorer.cli.blocks import lines
from explorer.cli.load_options import LoadOptions, check_regular
from explorer.cli.options import TypicalOptions
from explorer.cli.output import assumed_lines, heading, pose_table
from explorer.cli.values import OF_DESIGN, numbers
from explorer.measures.blocks.precision import deflections, tool_errors
from explorer.mechanism.design import Design
from explorer.mechanism.machine import DIMENSIONS, Six
from explorer.mechanism.pose import Triple
from explorer.statics.accuracy import error_by_geometry
from explorer.statics.loaded import BY_ACTUATORS, BY_DIMENSIONS, GROUPS, LoadedPose, ToolPrecision

B4: Triple = (0.0, 0.0, 0.0)
ORDER = "l1 d1 d2 d3 d4 l4"
PARTS = ("guide", "struts", "actuators")


@dataclass(frozen=True, kw_only=True)
class Accuracy(TypicalOptions, LoadOptions):
    """Compute the errors and the deflection of the tool in a pose.

    Errors, stiffness, struts and tolerances are those of the design; a design without them is
    exact and rigid. The model is linear, without preload. RMS errors are those of independent
    errors, each uniform within its bounds.
    """

    errors: Annotated[Six | None, numbers("--errors", ORDER, or_one=True), OF_DESIGN] = None
    """Largest errors of the actuators in mm, or one for all."""

    stiffness: Annotated[Six | None, numbers("--stiffness", ORDER, or_one=True), OF_DESIGN] = None
    """Stiffness of the actuators in N/mm, or one for all."""

    def run(self) -> None:
        """Write the errors, the compliance and the deflection."""
        design = self._with_actuators(self.read_loaded_design())
        design, assumed = self.with_typical(design)
        pose, tool = self.pose(design), self.tool(design)
        loaded = LoadedPose(design, pose, self.load, point=tool or B4)
        precision = ToolPrecision(loaded)
        check_regular(pose, precision.by_source, "errors and compliance")
        head = (heading(design), *assumed_lines(assumed), pose_table(design, pose, tool))
        self.write(
            lambda: {**_as_json(precision), "assumed": assumed},
            lambda: (*head, *_as_lines(precision)),
        )

    def _with_actuators(self, design: Design) -> Design:
        """Return the design with the given errors and stiffness."""
        actuators = design.actuators
        if self.errors is not None:
            actuators = msgspec.structs.replace(actuators, error_mm=self.errors)
        if self.stiffness is not None:
            actuators = msgspec.structs.replace(actuators, stiffness_n_mm=self.stiffness)
        return msgspec.structs.replace(design, actuators=actuators)


def _totals(precision: ToolPrecision) -> Iterator[tuple[str, str, tuple[float, float]]]:
    """Yield each group of sources, "worst" or "RMS", and its displacement and turn."""
    for group, sources in GROUPS.items():
        for kind, error in (("worst", precision.worst(sources)), ("RMS", precision.rms(sources))):
            yield group, kind, (float(error.displacement), float(error.turn))


def _as_json(precision: ToolPrecision) -> dict[str, object]:
    principal, alone = precision.principal, precision.alone
    shares = {
        name: None if np.isnan(share) else float(share)
        for name, share in zip(PARTS, precision.shares, strict=True)
    }
    totals: dict[str, float] = {}
    for group, kind, (moved, turned) in _totals(precision):
        suffix = "" if group == "actuators" else f"_of_{group}"
        totals[f"{kind.lower()}_displacement{suffix}"] = moved
        totals[f"{kind.lower()}_turn{suffix}"] = turned
    return {
        "compliance": precision.compliance,
        "deflection": precision.deflection,
        "deflection_shares": shares,
        "principal_compliances": {
            "displacement": principal.displacement,
            "force_directions": principal.force_directions,
            "turn": principal.turn,
            "moment_directions": principal.moment_directions,
        },
        **totals,
        "displacement_by_actuator": alone.displacement[BY_ACTUATORS],
        "turn_by_actuator": alone.turn[BY_ACTUATORS],
        "dimensions": list(DIMENSIONS),
        "pose_error_by_geometry": error_by_geometry(precision.loaded.configuration),
        "displacement_by_geometry": alone.displacement[BY_DIMENSIONS],
        "turn_by_geometry": alone.turn[BY_DIMENSIONS],
    }


def _as_lines(precision: ToolPrecision) -> Iterator[str]:
    yield from lines(tool_errors(precision, listed=None))
    yield from lines(deflections(precision, "the load and the payload's weight"))
