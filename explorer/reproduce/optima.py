"""Claims on the paper's two designs: Table 1 with extents and volumes, and the optimisation."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from textwrap import wrap
from typing import NamedTuple

import msgspec
import numpy as np

from explorer.measures.box import box_margins
from explorer.measures.catalogue import Measurements, measure_design, measures_in
from explorer.measures.measure import Case
from explorer.mechanism.design import Design
from explorer.mechanism.design_file import PRESETS
from explorer.numerics.number_text import set_true_minus
from explorer.optimise import defaults
from explorer.optimise.problem import YAW, Box, with_values
from explorer.optimise.solver import optimise_design
from explorer.reproduce.claim import Measurement, Values, below, judge
from explorer.workspace.slices import volume
from explorer.workspace.workspace import Workspace

Extent = tuple[tuple[float, float, float], tuple[float, float, float]]

# Largest difference of an extent that the paper prints with three decimals.
PRINTED_TO = 1e-3
# Distance of a face from a plane of nodes, in steps, up to which nodes lie on it.
ON_NODE = 1e-9
YAWS = (-72.6, -73.0, -73.1, -73.2, -73.6, -75.0, -90.0)
"""Yaws at which the nodes of both designs are counted, in degrees."""


class Printed(NamedTuple):
    """A row as the paper prints it: lows and highs, and the node volume; None if not printed."""

    extent: Extent
    volume: float | None


PRINTED: Mapping[str, Printed] = {
    "paper-initial": Printed(((0.0, -5.026, 0.0), (10.052, 10.770, 9.334)), None),
    "paper-optimal": Printed(((0.0, -12.0, 0.0), (20.0, 22.0, 18.0)), 7992.0),
}
"""The rows by preset, lengths in design units."""


@dataclass(frozen=True)
class Row:
    """A row of Table 1 as it is measured: nodes with their extent, and the exact volume."""

    preset: str
    nodes: volume.NodeCount
    exact: float


def measure_table() -> Measurement:
    """Count the nodes of both designs by our reading, and compare extents and volume."""
    given = {name: Workspace(PRESETS[name]) for name in PRINTED}
    rows = [
        Row(name, volume.node_count_of(each), volume.workspace_volume(each.design).volume)
        for name, each in given.items()
    ]
    optimal, initial = PRESETS["paper-optimal"], PRESETS["paper-initial"]
    by_yaw = {
        yaw: (_nodes_at(optimal, yaw).count, _off("paper-initial", _nodes_at(initial, yaw)))
        for yaw in YAWS
    }
    as_scanned = msgspec.structs.replace(initial, b3=15.0, home=initial.home_pose)
    off = min(_off("paper-initial", _nodes_at(as_scanned, yaw)) for yaw in range(-180, 180))
    beyond = _beyond_box(optimal)
    worst, last = max(_off(row.preset, row.nodes) for row in rows), rows[-1]
    excess = last.nodes.volume - last.exact
    why = (
        "A node on the boundary counts as a whole cell, so that cells stand out of the workspace. "
        f"Where a face of the optimum's box lies on a plane of nodes it is half a cell: "
        f"{beyond:.0f} of the excess of {excess:.0f} units³."
    )
    near = [difference <= PRINTED_TO for _, difference in by_yaw.values()]
    words = {
        "worst": worst,
        "optimal": last,
        "excess": excess / last.exact,
        "by_yaw": set_true_minus(
            ", ".join(f"{count} at {yaw:g}°" for yaw, (count, _) in by_yaw.items())
        ),
        "near": sum(near),
        "yaws": len(near),
        "off": off,
    }
    lines = [line for row in rows for line in _lines(row)]
    lines += ["", "by the yaw of the platform: nodes of the optimum, error of the initial extents"]
    lines += [f"  {yaw:7.1f}°  {count:5}  {error:9.4f}" for yaw, (count, error) in by_yaw.items()]
    values = {
        "table1": [
            {
                "design": row.preset,
                "printed": dict(zip(("extent", "node_volume"), PRINTED[row.preset], strict=True)),
                "node_step": row.nodes.step,
                "node_count": row.nodes.count,
                "node_volume": row.nodes.volume,
                "extent": row.nodes.extent,
                "volume": row.exact,
            }
            for row in rows
        ],
        "nodes_by_yaw": {f"{yaw:g}": count for yaw, (count, _) in by_yaw.items()},
        "note": why,
    }
    is_within = worst <= PRINTED_TO and last.nodes.volume == PRINTED[last.preset].volume
    condition = "by our reading, whose yaw and steps are fitted to the printed numbers"
    table = (*lines, "", *wrap(why, 88))
    return judge(False, words, values, table, condition if is_within else "")


def _beyond_box(design: Design) -> float:
    """Return half a step times the area of the faces of the box on which nodes lie."""
    step = volume.node_step_of(design)
    gradient = volume.workspace_volume(design).gradient
    lows, highs = design.limits.box or ((), ())
    area = 0.0
    for name in filter(lambda name: name.startswith("box "), gradient):
        _, axis, end = name.split()
        bound = (lows if end == "minimum" else highs)["xyz".index(axis)]
        if abs(bound / step - round(bound / step)) < ON_NODE:
            area += abs(gradient[name])
    return 0.5 * step * area


def _extent(nodes: volume.NodeCount) -> Extent:
    return nodes.extent or ((0.0, 0.0, 0.0), (0.0, 0.0, 0.0))


def _nodes_at(design: Design, yaw: float) -> volume.NodeCount:
    return volume.node_count_of(Workspace(with_values(design, {YAW: yaw})))


def _off(preset: str, nodes: volume.NodeCount) -> float:
    """Return the largest difference of the extent of nodes from the printed one of a preset."""
    return float(np.abs(np.subtract(_extent(nodes), PRINTED[preset].extent)).max())


def _lines(row: Row) -> list[str]:
    printed, nodes = PRINTED[row.preset], row.nodes
    lines = [f"{row.preset:16}{'printed':>22}{'here':>22}"]
    for axis, low, high, own_low, own_high in zip(
        "xyz", *printed.extent, *_extent(nodes), strict=True
    ):
        given, own = f"{low:.3f} to {high:.3f}", f"{own_low:z.3f} to {own_high:z.3f}"
        lines.append(f"{axis:16}{given:>22}{own:>22}")
    text = "not printed" if printed.volume is None else f"{printed.volume:.2f}"
    lines.append(f"{'step':16}{'not printed':>22}{nodes.step:>22.4f}")
    lines.append(f"{'nodes':16}{'not printed':>22}{nodes.count:>22}")
    lines.append(f"{'node volume':16}{text:>22}{nodes.volume:>22.2f}")
    lines.append(f"{'exact volume':16}{'not printed':>22}{row.exact:>22.2f}")
    return lines


PAPER_ITERATIONS = 220
# Value of F from which on a volume counts as matched.
MATCHED = 1e-9

BOX: Box = ((8.0, 3.0, 7.0), (12.0, 7.0, 11.0))
"""Box about the home position, over which margins are compared; it lies in all workspaces but the
initial one's."""

STEP = 2.0
"""Step of the paper's nodes, in design units."""

STARTS = 14


@dataclass(frozen=True)
class Optimum:
    """A design and the search that led to it; None and 0 where the paper has no such number.

    The objective is F = |1 − V/V′|, with V as its source measures it; the measures are those of
    the optimiser, and the step of the nodes.
    """

    name: str
    measured: Measurements
    iterations: int | None = None
    objective: float | None = None
    converged: bool | None = None
    starts: int = 0


def measure_search() -> Measurement:
    """Match the paper's volume from its initial design, and search the smallest reach for it."""
    margin = defaults.paper_problem().demands.clearance_margin

    def measure(design: Design) -> Measurements:
        case = Case(design, demanded_margin=margin, node_step=STEP)
        return measure_design(case, (*measures_in("optimise"), "reach", "node_step"))

    optimal = measure(PRESETS["paper-optimal"])
    node_objective = abs(1.0 - (optimal["node_volume"] or 0.0) / defaults.PAPER_VOLUME)
    optima = [
        Optimum("the paper's initial design", measure(defaults.paper_start())),
        Optimum("the paper's optimum, by nodes", optimal, PAPER_ITERATIONS, node_objective),
    ]
    for name, problem, starts in (
        ("volume 8000, interference off", defaults.paper_problem(None), 1),
        ("volume 8000, interference on", defaults.paper_problem(), 1),
        ("smallest reach, interference off", defaults.reach_problem(), STARTS),
        ("smallest reach, interference on", defaults.reach_problem(defaults.CLEARANCE), STARTS),
    ):
        found = optimise_design(problem, starts=starts)
        objective = found.best.objective if problem.objective == "match-volume" else None
        result = measure(found.design), found.iterations, objective, found.converged
        optima.append(Optimum(name, *result, starts))
    paper, matches = optima[1], [each for each in optima[2:] if each.objective is not None]
    exact = abs(1.0 - (paper.measured["volume"] or 0.0) / defaults.PAPER_VOLUME)
    smallest = min(each.measured["reach"] or 0.0 for each in optima if each.starts > 1)
    words = {
        "paper": paper,
        "exact": exact,
        "match": below(max(each.objective or 0.0 for each in matches), MATCHED),
        "found": " and in ".join(f"{each.iterations} iterations ({each.name})" for each in matches),
        "iterations": PAPER_ITERATIONS,
        "smallest": smallest,
        "reach": paper.measured["reach"],
    }
    values = {"paper_objective_exact": exact, "optima": [_values(each) for each in optima]}
    is_within = all(each.converged and (each.objective or 0.0) < MATCHED for each in matches)
    condition = "by our reading and our search, on the exact volume" if is_within else ""
    return judge(False, words, values, _table(optima), condition)


def _values(optimum: Optimum) -> Values:
    """Return an optimum as plain values; None is not available."""
    measured = optimum.measured
    names = ("volume", "node_step", "node_count", "node_volume", "reach")
    return {
        "name": optimum.name,
        "iterations": optimum.iterations,
        "objective": optimum.objective,
        "variables": measured.design.variables,
        **{name: measured[name] for name in names},
        "box_margin": _box_margin(measured.design),
        "clearance": measured["least_clearance"],
        "demanded_clearance": measured["demanded_clearance"],
    }


def _table(optima: Sequence[Optimum]) -> list[str]:
    heads = ("iterations", "F", "volume", "nodes", "reach", "margin/reach", "clearance")
    lines = [f"{'':34}" + "".join(f"{head:>13}" for head in heads)]
    for optimum in optima:
        measured, objective = optimum.measured, optimum.objective
        reach, margin = measured["reach"], _box_margin(measured.design)
        small = objective is not None and objective < MATCHED
        cells = (
            _cell(optimum.iterations, "d"),
            f"< {MATCHED:.0e}" if small else _cell(objective, ".0e"),
            _cell(measured["volume"], ".2f"),
            _cell(measured["node_count"], "d"),
            _cell(reach, ".3f"),
            _cell(reach and margin / reach, ".3f"),
            _cell(measured["demanded_clearance"], ".3f"),
        )
        lines.append(f"{optimum.name:34}" + "".join(f"{cell:>13}" for cell in cells))
    demanded = optima[0].measured.demanded_margin or 0.0
    low, high = (", ".join(f"{x:g}" for x in end) for end in BOX)
    volume, clearance = defaults.PAPER_VOLUME, defaults.CLEARANCE
    return [
        *lines,
        "",
        f"F = |1 − V / {volume:g}|: the paper's V is by nodes of step {STEP:g}, ours exact.",
        f"Interference on: legs keep {clearance:g} where every margin is {demanded:.4g} or more;",
        "clearance is the least of these.",
        f"Margin: the worst over the box ({low}) to ({high}).",
        f"Smallest reach: the best of {STARTS} starts, |b1y|, a3y and |b3 − b2| at least 1.",
    ]


def _box_margin(design: Design) -> float:
    """Return the least |δ| over the box about the home position, in design units."""
    return float(box_margins(BOX, design.home_pose.rotation).min())


def _cell(value: float | None, form: str) -> str:
    return "–" if value is None else format(value, form)
