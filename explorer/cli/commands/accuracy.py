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
from explorer.mechanism.design import Design
from explorer.mechanism.machine import DIMENSIONS, Six
from explorer.mechanism.pose import Triple
from explorer.statics.accuracy import RMS_ERRORS, error_by_geometry
from explorer.statics.compliance import is_elastic
from explorer.statics.error_sources import SOURCES
from explorer.statics.loaded import LoadedPose
from explorer.statics.tool_precision import BY_ACTUATORS, BY_DIMENSIONS, GROUPS, ToolPrecision

B4: Triple = (0.0, 0.0, 0.0)
ORDER = "l1 d1 d2 d3 d4 l4"
PARTS = ("guide", "struts", "actuators")


@dataclass(frozen=True)
class Answer:
    """What the command computes of a pose.

    Attributes:
        assumed: Words for what is assumed of the design.
        tool: Tool point in the platform frame, in design units; None for b4.
        precision: Errors, compliance and deflection at this point.
    """

    assumed: tuple[str, ...]
    tool: Triple | None
    precision: ToolPrecision


@dataclass(frozen=True, kw_only=True)
class Accuracy(TypicalOptions, LoadOptions):
    """Compute the errors and the deflection of the tool in a pose.

    Errors, stiffness, struts and tolerances are those of the design; a design without them is
    exact and rigid. The model is linear, without preload. RMS errors are those of independent
    errors, each uniform within its bounds.
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
        loaded = LoadedPose(design, pose, self.load, point=tool or B4)
        precision = ToolPrecision(loaded)
        check_regular(pose, precision.by_source, "errors and compliance")
        answer = Answer(assumed, tool, precision)
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


def _totals(precision: ToolPrecision) -> Iterator[tuple[str, str, tuple[float, float]]]:
    """Yield each group of sources, "worst" or "RMS", and its displacement and turn."""
    for group, sources in GROUPS.items():
        for kind, error in (("worst", precision.worst(sources)), ("RMS", precision.rms(sources))):
            yield group, kind, (float(error.displacement), float(error.turn))


def _as_json(answer: Answer) -> dict[str, object]:
    precision = answer.precision
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
        "assumed": answer.assumed,
    }


def _as_lines(answer: Answer) -> Iterator[str]:
    precision = answer.precision
    loaded = precision.loaded
    design = loaded.design
    yield from (heading(design), *assumed_lines(answer.assumed))
    yield from (pose_table(design, loaded.pose, answer.tool), "")
    rows = [("error from", "displacement, units", "mm", "turn")]
    moved, turned = (each.tolist() for each in precision.alone)
    has_tolerances = any(moved[BY_DIMENSIONS]) or any(turned[BY_DIMENSIONS])
    for group, kind, error in _totals(precision):
        if has_tolerances or group == "actuators":
            rows.append((f"{group}, {kind}", *_error(design, *error)))
    by_source = [*zip(SOURCES, moved, turned, strict=True)]
    dimensions = sorted(by_source[BY_DIMENSIONS], key=lambda row: -row[1])
    for name, *error in (*by_source[BY_ACTUATORS], *(each for each in dimensions if any(each[1:]))):
        rows.append((name, *_error(design, *error)))
    yield from (table(rows, "<>>>"), f"RMS errors are those of {RMS_ERRORS}", "")
    if not is_elastic(design):
        yield "rigid: the design states no stiffness of its actuators and no struts"
        return
    rows = [("softest first", "mm/N", "direction")]
    principal = precision.principal
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
    moved, turned = precision.deflection[:3], precision.deflection[3:]
    rows = [
        ("deflection", f"{'  '.join(figures((moved * design.unit_mm).tolist()))} mm"),
        ("turn", f"{'  '.join(figures(np.degrees(turned).tolist()))} °"),
    ]
    if not np.isnan(precision.shares.guide):
        parts = zip(PARTS, precision.shares, strict=True)
        rows.append(("of it", ", ".join(f"{name} {100.0 * part:.1f} %" for name, part in parts)))
    yield table(rows, "<<")


def _error(design: Design, moved: float, turned: float) -> tuple[str, str, str]:
    angle = figure(float(np.degrees(turned)))
    return figure(moved), figure(moved * design.unit_mm), f"{angle}°"
