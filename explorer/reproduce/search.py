"""The claim on the optimisation: our optima beside the paper's, from its initial design."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from explorer.measures.catalogue import measures_in
from explorer.measures.measure import Case
from explorer.measures.measurements import Measurements, measure_design
from explorer.mechanism.design import Design
from explorer.mechanism.design_file import PRESETS
from explorer.optimise.defaults import (
    CLEARANCE,
    PAPER_VOLUME,
    paper_problem,
    paper_start,
    reach_problem,
)
from explorer.optimise.demands import Box
from explorer.optimise.solver import optimise_design
from explorer.reproduce.claim import Measurement, Values, below

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


def search() -> Measurement:
    """Match the paper's volume from its initial design, and search the smallest reach for it."""
    return judge_search(_optima())


def judge_search(optima: Sequence[Optimum]) -> Measurement:
    """Return the measurement of optima, in the order of `_optima`."""
    paper, matches = optima[1], [each for each in optima[2:] if each.objective is not None]
    exact = abs(1.0 - (paper.measured["volume"] or 0.0) / PAPER_VOLUME)
    smallest = min(each.measured["reach"] or 0.0 for each in optima if each.starts > 1)
    found = " and in ".join(f"{each.iterations} iterations ({each.name})" for each in matches)
    text = (
        f"The paper's optimum has F = {paper.objective:.1e} by its nodes and {exact:.3f} by the "
        "exact volume. From its initial design, in the box of its optimum, ours matches the exact "
        f"volume to {below(max(each.objective or 0.0 for each in matches), MATCHED)} in {found}. "
        f"The paper's {PAPER_ITERATIONS} iterations cannot be repeated: it prints neither its "
        "integration, its limits nor its sampling interval. The exact volume of its optimum fits "
        f"into a reach of {smallest:.2f} instead of {paper.measured['reach']:.2f}."
    )
    values = {"paper_objective_exact": exact, "optima": [_values(each) for each in optima]}
    table = tuple(_table(optima))
    if all(each.converged and (each.objective or 0.0) < MATCHED for each in matches):
        condition = "by our reading and our search, on the exact volume"
        return Measurement(text, "confirmed within", values, table, condition)
    return Measurement(text, "not confirmed", values, table)


def _optima() -> list[Optimum]:
    """Return the paper's designs and ours."""
    margin = paper_problem().demands.clearance_margin

    def measure(design: Design) -> Measurements:
        case = Case(design, demanded_margin=margin, box=BOX, node_step=STEP)
        return measure_design(case, (*measures_in("optimise"), "reach", "node_step"))

    optimal = measure(PRESETS["paper-optimal"])
    node_objective = abs(1.0 - (optimal["node_volume"] or 0.0) / PAPER_VOLUME)
    optima = [
        Optimum("the paper's initial design", measure(paper_start())),
        Optimum("the paper's optimum, by nodes", optimal, PAPER_ITERATIONS, node_objective),
    ]
    for name, problem, starts in (
        ("volume 8000, interference off", paper_problem(None), 1),
        ("volume 8000, interference on", paper_problem(), 1),
        ("smallest reach, interference off", reach_problem(), STARTS),
        ("smallest reach, interference on", reach_problem(CLEARANCE), STARTS),
    ):
        outcome = optimise_design(problem, starts=starts)
        objective = outcome.best.objective if problem.objective == "match-volume" else None
        optima.append(
            Optimum(
                name,
                measure(outcome.design),
                outcome.iterations,
                objective,
                outcome.converged,
                starts,
            )
        )
    return optima


def _values(optimum: Optimum) -> Values:
    """Return an optimum as plain values; None is not available."""
    measured = optimum.measured
    names = ("volume", "node_step", "node_count", "node_volume", "reach", "box_margin")
    return {
        "name": optimum.name,
        "iterations": optimum.iterations,
        "objective": optimum.objective,
        "variables": measured.design.variables,
        **{name: measured[name] for name in names},
        "clearance": measured["least_clearance"],
        "demanded_clearance": measured["demanded_clearance"],
    }


def _table(optima: Sequence[Optimum]) -> list[str]:
    heads = ("iterations", "F", "volume", "nodes", "reach", "margin/reach", "clearance")
    lines = [f"{'':34}" + "".join(f"{head:>13}" for head in heads)]
    for optimum in optima:
        measured, objective = optimum.measured, optimum.objective
        reach, margin = measured["reach"], measured["box_margin"]
        small = objective is not None and objective < MATCHED
        cells = (
            _cell(optimum.iterations, "d"),
            f"< {MATCHED:.0e}" if small else _cell(objective, ".0e"),
            _cell(measured["volume"], ".2f"),
            _cell(measured["node_count"], "d"),
            _cell(reach, ".3f"),
            _cell(margin and reach and margin / reach, ".3f"),
            _cell(measured["demanded_clearance"], ".3f"),
        )
        lines.append(f"{optimum.name:34}" + "".join(f"{cell:>13}" for cell in cells))
    demanded = optima[0].measured.demanded_margin or 0.0
    low, high = (", ".join(f"{x:g}" for x in end) for end in BOX)
    return [
        *lines,
        "",
        f"F = |1 − V / {PAPER_VOLUME:g}|: the paper's V is by nodes of step {STEP:g}, ours exact.",
        f"Interference on: legs keep {CLEARANCE:g} where every margin is {demanded:.4g} or more;",
        "clearance is the least of these.",
        f"Margin: the worst over the box ({low}) to ({high}).",
        f"Smallest reach: the best of {STARTS} starts, |b1y|, a3y and |b3 − b2| at least 1.",
    ]


def _cell(value: float | None, form: str) -> str:
    return "–" if value is None else format(value, form)
