"""`explorer accuracy`: errors of the tool, its compliance, and its deflection under a load."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Annotated

import msgspec
import numpy as np

from explorer.cli.load_options import LoadOptions, check_regular
from explorer.cli.options import TypicalOptions
from explorer.cli.output import assumed_lines, figure, figures, heading, pose_table, table
from explorer.cli.values import hint, numbers
from explorer.mechanism.design import JOINTS, Design
from explorer.mechanism.machine import DIMENSIONS, Six
from explorer.mechanism.pose import Pose, Triple
from explorer.numerics.arrays import FloatArray
from explorer.statics.accuracy import Precision, ToolError, geometry_error, pose_precision
from explorer.statics.compliance import (
    PrincipalCompliances,
    compliance_shares,
    deflection,
    principal_compliances,
    stiffness_of,
)
from explorer.statics.error_sources import (
    by_source,
    largest_error,
    rms_of_sources,
    source_errors,
)
from explorer.statics.weights import carry, design_weights

ORDER = "l1 d1 d2 d3 d4 l4"
PARTS = ("guide", "struts", "actuators")


@dataclass(frozen=True)
class Answer:
    """What the command computes of a pose."""

    design: Design
    assumed: tuple[str, ...]
    pose: Pose
    tool: Triple | None
    precision: Precision
    principal: PrincipalCompliances
    deflection: FloatArray
    shares: tuple[float, ...]
    geometry: ToolError
    totals: dict[str, ToolError]


@dataclass(frozen=True, kw_only=True)
class Accuracy(TypicalOptions, LoadOptions):
    """Compute the errors and the deflection of the tool in a pose.

    Errors, stiffness, struts and tolerances are those of the design; a design without them is
    exact and rigid. The model is linear, without preload.
    """

    errors: Annotated[
        Six | None, numbers("--errors", ORDER, or_one=True), hint("default: those of the design")
    ] = None
    """Largest errors of the actuators in mm, or one for all."""

    stiffness: Annotated[
        Six | None, numbers("--stiffness", ORDER, or_one=True), hint("default: that of the design")
    ] = None
    """Stiffness of the actuators in N/mm, or one for all."""

    def run(self) -> None:
        """Write the errors, the compliance and the deflection."""
        design = self._with_actuators(self.read_loaded_design())
        design, assumed = self.with_typical(design)
        pose, tool = self.pose(design), self.tool(design)
        given = design, pose.position, pose.rotation
        precision = pose_precision(*given, tool)
        check_regular(pose, precision.by_geometry)
        wrench = carry(*given, design_weights(design), tool).wrench + self.load
        shares = compliance_shares(*given, wrench, *stiffness_of(design), tool)
        answer = Answer(
            design,
            assumed,
            pose,
            tool,
            precision,
            principal_compliances(precision.compliance),
            deflection(precision.compliance, wrench),
            tuple(float(share) for share in shares),
            geometry_error(design, precision.by_geometry),
            _totals(design, precision),
        )
        self.write(lambda: _as_json(answer), lambda: _as_lines(answer))

    def _with_actuators(self, design: Design) -> Design:
        """Return the design with the given errors and stiffness.

        Raises:
            DesignError: An error is negative, or a stiffness is not positive.
        """
        actuators = design.actuators
        if self.errors is not None:
            actuators = msgspec.structs.replace(actuators, error_mm=self.errors)
        if self.stiffness is not None:
            actuators = msgspec.structs.replace(actuators, stiffness_n_mm=self.stiffness)
        return msgspec.structs.replace(design, actuators=actuators)


def _totals(design: Design, precision: Precision) -> dict[str, ToolError]:
    """Return the worst and the RMS errors of the dimensions and of all sources together."""
    influences, errors = by_source(precision), source_errors(design)
    totals: dict[str, ToolError] = {}
    for name, sources in (("dimensions", slice(len(JOINTS), None)), ("all", slice(None))):
        given = influences[:, sources], errors[sources]
        worst = largest_error(*given)
        totals[f"worst_{{}}_of_{name}"] = ToolError(worst.displacement, worst.turn)
        totals[f"rms_{{}}_of_{name}"] = rms_of_sources(*given)
    return totals


def _as_json(answer: Answer) -> dict[str, object]:
    precision, principal = answer.precision, answer.principal
    shares = {
        name: None if np.isnan(v) else v for name, v in zip(PARTS, answer.shares, strict=True)
    }
    return {
        "compliance": precision.compliance,
        "deflection": answer.deflection,
        "deflection_shares": shares,
        "principal_compliances": {
            "displacement": principal.displacement,
            "force_directions": principal.force_directions,
            "turn": principal.turn,
            "moment_directions": principal.moment_directions,
        },
        "worst_displacement": float(precision.worst.displacement),
        "worst_turn": float(precision.worst.turn),
        "rms_displacement": float(precision.rms.displacement),
        "rms_turn": float(precision.rms.turn),
        "displacement_by_actuator": precision.by_actuator.displacement,
        "turn_by_actuator": precision.by_actuator.turn,
        "dimensions": list(DIMENSIONS),
        "pose_error_by_geometry": precision.by_geometry,
        "displacement_by_geometry": answer.geometry.displacement,
        "turn_by_geometry": answer.geometry.turn,
        **{
            name.format(kind): float(getattr(error, kind))
            for name, error in answer.totals.items()
            for kind in ToolError._fields
        },
        "assumed": answer.assumed,
    }


def _as_lines(answer: Answer) -> Iterator[str]:
    design, precision = answer.design, answer.precision
    yield from (heading(design), *assumed_lines(answer.assumed))
    yield from (pose_table(design, answer.pose, answer.tool), "")
    rows = [("error from", "displacement, units", "mm", "turn")]
    totals = [("actuators, worst", precision.worst), ("actuators, RMS", precision.rms)]
    if any(answer.geometry.displacement) or any(answer.geometry.turn):
        names = ("dimensions, worst", "dimensions, RMS", "all, worst", "all, RMS")
        totals += zip(names, answer.totals.values(), strict=True)
    for name, error in totals:
        rows.append((name, *_error(design, float(error.displacement), float(error.turn))))
    alone = precision.by_actuator
    for name, moved, turned in zip(JOINTS, *(each.tolist() for each in alone), strict=True):
        rows.append((name, *_error(design, moved, turned)))
    by_geometry = zip(DIMENSIONS, *(each.tolist() for each in answer.geometry), strict=True)
    ranked = sorted(by_geometry, key=lambda row: -row[1])
    rows += [(name, *_error(design, *error)) for name, *error in ranked if any(error)]
    yield from (table(rows, "<>>>"), "")
    if not precision.compliance.any():
        yield "rigid: the design states no stiffness of its actuators and no struts"
        return
    rows = [("softest first", "mm/N", "direction")]
    principal = answer.principal
    for value, axis in zip(
        principal.displacement.tolist(), principal.force_directions.tolist(), strict=True
    ):
        rows.append(("force", figure(value * design.unit_mm), "  ".join(figures(axis))))
    rows.append(("", "°/(N m)", ""))
    scale = float(np.degrees(1.0)) * 1e3 / design.unit_mm
    for value, axis in zip(
        principal.turn.tolist(), principal.moment_directions.tolist(), strict=True
    ):
        rows.append(("moment", figure(value * scale), "  ".join(figures(axis))))
    yield from (table(rows, "<><"), "")
    moved, turned = answer.deflection[:3], answer.deflection[3:]
    rows = [
        ("deflection", f"{'  '.join(figures((moved * design.unit_mm).tolist()))} mm"),
        ("turn", f"{'  '.join(figures(np.degrees(turned).tolist()))} °"),
    ]
    if not np.isnan(answer.shares[0]):
        parts = zip(PARTS, answer.shares, strict=True)
        rows.append(("of it", ", ".join(f"{name} {100.0 * part:.1f} %" for name, part in parts)))
    yield table(rows, "<<")


def _error(design: Design, moved: float, turned: float) -> tuple[str, str, str]:
    angle = figure(float(np.degrees(turned)))
    return figure(moved), figure(moved * design.unit_mm), f"{angle}°"
