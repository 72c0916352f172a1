"""Measures of positions at one orientation, and the bands of colour that show them.

Each value is zero in singular positions and grows away from them. For a load and for errors it is
the reciprocal of what the load asks of the machine, or of how far the tool moves, which is infinite
there: the first band has no end of its own, so that it holds whatever is beyond the last round
number.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import Literal

import numpy as np

from explorer.measures.blocks.block import UTILISATION_EDGES
from explorer.mechanism.configuration import Configuration
from explorer.mechanism.design import Design
from explorer.mechanism.machine import NO_LOAD
from explorer.mechanism.rgb import Rgb, mix
from explorer.motion.weights import payload_wrench
from explorer.numerics.arrays import FloatArray, IntArray
from explorer.numerics.computed_once import computed_once
from explorer.singularity import colours
from explorer.singularity.colours import CLEAR, FAR, SINGULAR, WARNED
from explorer.statics.accuracy import actuator_errors, worst_errors
from explorer.statics.compliance import compliance_of, deflection, is_elastic, stiffness_of
from explorer.statics.load_cases import largest_shares, load_case
from explorer.statics.reactions import has_limits
from explorer.workspace.workspace import Workspace

PositionMeasure = Literal["margin", "condition", "share", "force", "bending", "error", "deflection"]

MEASURE_WORDS: dict[PositionMeasure, tuple[str, str, float]] = {
    "share": ("largest share of a limit", "%", 100.0),
    "force": ("largest actuator force", "N", 1.0),
    "bending": ("largest bending of a strut", "N m", 1.0),
    "error": ("worst error of the tool", "mm", 1.0),
    "deflection": ("deflection under the load", "mm", 1.0),
}
"""Words and unit of the measures that are infinite in singular positions, and the factor from the
measure to that unit. The measures are in 1, N, N m and mm."""

LOAD_MEASURES: tuple[PositionMeasure, ...] = ("share", "force", "bending", "deflection")
"""Measures that depend on the load."""

STEPS = (1, 2, 5)
"""Ends of the bands of forces, moments and displacements, over powers of ten."""
# Number of these ends. The lowest exceeds this share of the values within the limits.
LEVELS, LEAST_SHARE = 6, 0.05

UTILISATION_COLOURS: tuple[Rgb, ...] = (FAR, mix(FAR, CLEAR, 0.5), CLEAR, WARNED, SINGULAR)
"""Colours of the bands of `UTILISATION_EDGES`, and of the one beyond the limit."""
STEP_COLOURS: tuple[Rgb, ...] = (
    *(mix(FAR, CLEAR, share) for share in (0.0, 1 / 3, 2 / 3, 1.0)),
    *(mix(WARNED, SINGULAR, share) for share in (0.0, 0.5, 1.0)),
)
# Nodes on each axis of the grid that finds the lowest end; largest value over the last edge.
NODES, FARTHEST = 16, 2.0


@dataclass(frozen=True)
class PositionBands:
    """A measure of positions at one orientation, in bands.

    Attributes:
        measure: The measure.
        edges: Least value of each band, ascending from 0.
        colours: Colour of each band.
        levels: The measure at each edge, in units for a margin; infinite at the first for the
            measures of `MEASURE_WORDS`.
        values: Function from positions (n, 3) to values (n,), which are zero in singular ones.
    """

    measure: PositionMeasure
    edges: tuple[float, ...]
    colours: tuple[Rgb, ...]
    levels: tuple[float, ...]
    values: Callable[[FloatArray], FloatArray]


@computed_once
def position_bands(
    workspace: Workspace,
    measure: PositionMeasure,
    *,
    warn_below: float,
    load: tuple[float, ...] = NO_LOAD,
) -> PositionBands:
    """Return the bands of a measure.

    Margins raise a warning below a length, in design units, which the warning value of the inverse
    condition number follows. The load (F; M), which only measures of a load need, acts at the tool
    point besides the payload, base axes, shape (6,), in N and N × unit.
    """

    def measure_at(points: FloatArray) -> FloatArray:
        return measure_positions(workspace, measure, points, load)[0]

    if measure in ("margin", "condition"):
        unit = warn_below
        if measure == "condition":
            unit = colours.warning_condition(workspace.design.reach, warn_below)
        edges, levels = colours.BAND_EDGES, tuple(unit * edge for edge in colours.BAND_EDGES)
        own = colours.band_colours()
        return PositionBands(measure, edges, own, levels, lambda points: measure_at(points) / unit)
    if measure == "share":
        levels, own = UTILISATION_EDGES, UTILISATION_COLOURS
    else:
        levels, own = _round_levels(workspace, measure_at), STEP_COLOURS
    highest = levels[-1]
    edges = (0.0, *(highest / level for level in reversed(levels)))

    def values(points: FloatArray) -> FloatArray:
        return highest / np.maximum(measure_at(points), highest / (FARTHEST * edges[-1]))

    return PositionBands(measure, edges, own[::-1], (math.inf, *reversed(levels)), values)


def measure_positions(
    workspace: Workspace,
    measure: PositionMeasure,
    positions: FloatArray,
    load: tuple[float, ...] = NO_LOAD,
) -> tuple[FloatArray, IntArray]:
    """Return a measure at positions (n, 3), and the margin or part that has it, (n,) each.

    The measure is in design units for a margin, else as in `MEASURE_WORDS`. Parts are those of
    `explorer.statics.reactions.part_limits`; the index is 0 for a measure of the whole machine. The
    load is as in `position_bands`.
    """
    design, rotation = workspace.design, workspace.rotation
    at = Configuration(design, positions, rotation, design.tool.position)
    whole, w = np.zeros(len(positions), dtype=np.int64), np.array(load)
    match measure:
        case "margin":
            sizes = np.abs(at.margins)
            return sizes.min(axis=-1), sizes.argmin(axis=-1)
        case "condition":
            return at.with_tool(np.zeros(3)).inverse_condition, whole
        case "error":
            displacement = worst_errors(at, actuator_errors(design)).displacement
            return displacement * design.unit_mm, whole
        case "deflection":
            wrench = payload_wrench(design, rotation) + w
            displacement = deflection(compliance_of(at, *stiffness_of(design)), wrench)[..., :3]
            return np.linalg.norm(displacement, axis=-1) * design.unit_mm, whole
        case _:
            # The share of a limit of one newton or one newton metre, in N × unit, is the value.
            units = np.full((2, 10), np.inf)
            if measure == "force":
                units[:, :6] = 1.0
            else:
                units[:, 6:8] = 1e3 / design.unit_mm
            loaded = load_case(design, rotation, w, None if measure == "share" else units)
            return largest_shares(loaded, rotation, positions)


def is_unstated(design: Design, measure: PositionMeasure) -> bool:
    """Return whether a design lacks the input without which a measure is zero.

    A share needs a limit of a part, the worst error an error of an actuator, and the deflection a
    stiffness of the actuators or the tube of a strut.
    """
    match measure:
        case "share":
            return not has_limits(design)
        case "error":
            return not any(design.actuators.error_mm)
        case "deflection":
            return not is_elastic(design)
        case _:
            return False


def _round_levels(
    workspace: Workspace, measure_at: Callable[[FloatArray], FloatArray]
) -> tuple[float, ...]:
    """Return round numbers that suit the measure within the limits, ascending."""
    lows, highs = workspace.region.box or (np.zeros(3), np.full(3, workspace.design.reach))
    shares = (np.indices((NODES,) * 3).reshape(3, -1).T + 1.0) / (NODES + 1)
    nodes = lows + (highs - lows) * shares
    within = nodes[workspace.contains(nodes)]
    found = measure_at(within if len(within) else nodes)
    found = found[np.isfinite(found) & (found > 0.0)]
    least = float(np.quantile(found, LEAST_SHARE)) if len(found) else 1.0
    exponent = math.floor(math.log10(least))
    steps = [float(f"{step}e{exponent + k}") for k in range(4) for step in STEPS]
    return tuple([step for step in steps if step >= least][:LEVELS])
