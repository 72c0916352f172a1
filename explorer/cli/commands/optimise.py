"""`explorer optimise`: an optimal design, or the best iterate of the search."""

from __future__ import annotations

import math
import re
from collections import Counter
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, ClassVar

import msgspec

from explorer.cli import options, output, values
from explorer.cli.streams import Meter
from explorer.errors import InputError, NoAnswerError
from explorer.files.writing import check_writable
from explorer.measures.catalogue import CATALOGUE, Measurements
from explorer.measures.measure import longest_leg
from explorer.mechanism.design import VARIABLES, Design
from explorer.mechanism.design_file import encode_design
from explorer.mechanism.machine import Six
from explorer.numerics.interruption import Interruption
from explorer.optimise import conflicts, outcome as outcomes, solver
from explorer.optimise.defaults import make_problem
from explorer.optimise.problem import ObjectiveName, Problem, Variable, with_box

MOVED = {
    "--required-box": "box_mm",
    **dict.fromkeys(("shift-x", "shift-y", "shift-z"), "box_mm"),
    "--tilt": "tilt_deg",
    "--held": "payload, and push_n and pull_n of legs",
    "--force": "force_n of payload",
    "--most": "push_n and pull_n of legs",
    "--stroke-ratio": "ratio of legs",
    "--error": "error_mm",
    "--deflection": "deflection_mm",
    "--acceleration": "move_s",
    "largest-margin": 'margin_mm, or "prefer": "far-from-singular"',
    "smallest-load": '"prefer": "little-force"',
    "smallest-error": '"prefer": "precise"',
    "smallest-deflection": '"prefer": "stiff"',
}
"""Words that ask about a box of positions, with what a requirement file states instead."""


@dataclass(frozen=True, kw_only=True)
class OptimiseCommand(options.JsonOptions, options.DesignOptions):
    """Optimise a design by SQP: match a volume, shorten the legs, or raise the volume.

    The gradients are exact, and the search starts from a given design, whose limits hold
    throughout. The search converges if all demands hold at a local optimum; otherwise the exit
    status is 1, and the output is the best iterate. Ctrl-C, or SIGTERM, ends it with the best so
    far. Machines for a box of positions are found by the command find.
    """

    moved: ClassVar[Mapping[str, str]] = MOVED

    objective: ObjectiveName = "match-volume"
    """Objective: F = |1 − V/V′| of the exact volume, the longest leg, or the volume."""

    target_volume: Annotated[values.PositiveVolume, values.OPTIONAL] = None
    """Volume to match, or least volume; for the shortest leg by default that of the design."""

    target_reach: Annotated[values.Positive, values.OPTIONAL] = None
    """Longest leg allowed; for the largest volume by default that of the design."""

    box: Annotated[
        Six | tuple[()] | None, values.numbers(values.CORNERS, or_none=True), values.OF_DESIGN
    ] = None
    """Box that bounds the workspace, in design units; none lifts that of the design."""

    clearance: Annotated[values.Positive, values.OPTIONAL] = None
    """Least clearance of every pair of legs over the workspace, in design units."""

    clearance_margin: Annotated[values.Positive, values.hint("default: a 20th of the reach")] = None
    """Least margin of the poses at which the clearance is demanded: legs meet at singularities."""

    least: Annotated[values.Positive, values.hint("default: a 20th of the largest variable")] = None
    """Smallest |a3y|, |b1y| and |b3 − b2|; a design with one of them zero is degenerate."""

    free: Annotated[tuple[str, ...], values.texts("yaw|reach"), values.OPTIONAL] = ()
    """Further free variables: yaw, and reach, one maximum of all lengths."""

    bounds: Annotated[tuple[str, ...], values.texts("NAME=LOW:HIGH …"), values.OPTIONAL] = ()
    """Bounds of variables, such as b1x=-10:10 yaw=-90:-45."""

    starts: Annotated[int, values.whole_number(1, 10_000)] = 1
    """Number of starts: the given design, and others within the bounds."""

    seed: Annotated[int, values.whole_number(0, 2**31 - 1)] = 0
    """Seed of the other starts."""

    iterations: Annotated[int, values.whole_number(1, 100_000)] = 300
    """Largest number of iterations per start."""

    out: Annotated[Path | None, values.FILE] = None
    """File for the optimal design, or for the best so far of a search that is interrupted; the
    record of the search is written beside it."""

    record: Annotated[Path | None, values.hint("default: OUT with .record.json", "FILE")] = None
    """File for the record: problem, history and versions, written even without convergence."""

    repeat: Annotated[Path | None, values.FILE] = None
    """Record whose problem to solve again, instead of one given by options."""

    def run(self) -> None:
        """Write the outcome of the search."""
        record = self.record
        if self.out is not None:
            # A folder has no name to which a suffix could be added.
            check_writable(self.out)
            record = record or self.out.with_suffix(".record.json")
        if record is not None:
            check_writable(record)
        problem, settings = self._problem()
        self._check_possible(problem)
        with Interruption() as interruption:
            outcome = _search(problem, settings, interruption.is_asked)
            is_kept = outcome.status in ("converged", "cancelled")
            files: dict[Path, bytes] = {}
            if self.out is not None and is_kept:
                files[self.out] = encode_design(optimised_design(outcome))
            if record is not None and (is_kept or self.record is not None):
                files[record] = outcomes.encode_record(outcomes.record_of(outcome, settings))
            written, unwritten = options.write_files(files)
        unsolved = [] if outcome.converged else [NoAnswerError(outcome.message)]
        self.write(
            lambda: outcome_json(outcome, written),
            outcome_lines(outcome, written),
            [*unsolved, *unwritten],
        )

    def _problem(self) -> tuple[Problem, outcomes.Settings]:
        """Return the problem and the settings that the options describe."""
        if self.repeat is not None:
            record = outcomes.load_record(self.repeat)
            return record.problem, record.settings
        if self.objective == "match-volume" and self.target_volume is None:
            raise InputError("say which volume to match with --target-volume")
        problem = make_problem(
            self._start(),
            self.objective,
            volume=self.target_volume,
            reach=self.target_reach,
            bounds=[_as_variable(word) for word in self.bounds],
            **output.attributes(self, "clearance clearance_margin least free"),
        )
        return problem, outcomes.Settings(**output.attributes(self, "starts seed iterations"))

    def _start(self) -> Design:
        """Return the design with the given limits; its home is fixed before its box changes."""
        design = self.read_design()
        if self.box is None:
            return design
        return with_box(design, (self.box[:3], self.box[3:]) if self.box else None)

    def _check_possible(self, problem: Problem) -> None:
        """Refuse a problem that the limits make infeasible, before kernels are compiled."""
        found = conflicts.find_conflicts(problem)
        if not found:
            return
        message = "; ".join(conflict.message for conflict in found)
        if self.repeat is None and any(each.limit == conflicts.BOX_LIMIT for each in found):
            advice = "lift the box with --box none"
            box = conflicts.paper_box(problem)
            if box is not None:
                corners = " ".join(f"{value:g}" for corner in box for value in corner)
                advice += f", or take the paper's with --box {corners}"
            message += f": {advice}"
        if self.json:
            output.write_json(infeasible_json(problem, found[0].limit, message))
        raise NoAnswerError(message)


def _search(
    problem: Problem, settings: outcomes.Settings, stop: Callable[[], bool]
) -> outcomes.Outcome:
    """Run a search with a progress bar, until it ends or is to stop."""
    starts, steps = settings.starts, Counter[int]()
    symbol = outcomes.OBJECTIVE_SYMBOLS[problem.objective]

    def show(iterate: outcomes.Iterate) -> None:
        run = iterate.run
        steps[run] += 1
        share = (run + min(1.0, steps[run] / settings.iterations)) / starts
        text = f"start {run + 1} of {starts}, {iterate.phase} {steps[run]}: {symbol} "
        text += f"{iterate.objective:.6g}, volume {iterate.volume:.6g}"
        meter.show(text + (f", missed: {iterate.worst}" if iterate.spare < 0.0 else ""), share)

    with Meter() as meter:
        given = msgspec.structs.asdict(settings)
        return solver.optimise_design(problem, watch=show, stop=stop, **given)


def _as_variable(word: str) -> Variable:
    """Return the variable in a word such as b1x=-10:10."""
    match = re.fullmatch(r"([^=]+)=([^:]+):([^:]+)", word)
    try:
        ends = [float(end) for end in match.groups()[1:]] if match else []
    except ValueError:
        ends = []
    if match is None or not ends:
        raise InputError(f"--bounds takes NAME=LOW:HIGH, such as b1x=-10:10; got {word!r}")
    return Variable(match[1].strip(), *ends)


def optimised_design(outcome: outcomes.Outcome) -> Design:
    """Return the design of an outcome, renamed."""
    name = f"{outcome.problem.start.name[:80]}, optimised"
    return msgspec.structs.replace(outcome.design, name=name)


def outcome_json(outcome: outcomes.Outcome, written: Sequence[Path]) -> dict[str, object]:
    """Return an outcome as plain values."""
    best, run, problem = outcome.best, outcome.run, outcome.problem
    return {
        "design": optimised_design(outcome),
        "objective": best.objective,
        "objective_name": problem.objective,
        "volume": best.volume,
        "reach": outcome.design.reach,
        "longest_leg": longest_leg(outcome.design),
        **output.attributes(run, "iterations evaluations"),
        **output.attributes(outcome, "seconds converged status message"),
        "holding": run.holding,
        "values": dict(zip(problem.names, best.values, strict=True)),
        "runs": [
            {
                "status": start.status,
                "objective": outcome.history[start.best].objective,
                **output.attributes(start, "iterations attempts"),
            }
            for start in outcome.runs
        ],
        "files": written,
    }


def infeasible_json(problem: Problem, limit: str, message: str) -> dict[str, object]:
    """Return the answer to a problem that a limit makes infeasible; null is not measured."""
    return {
        **dict.fromkeys(("objective", "volume")),
        **dict.fromkeys(("iterations", "evaluations", "seconds"), 0),
        "design": problem.start,
        "objective_name": problem.objective,
        "reach": problem.start.reach,
        "longest_leg": longest_leg(problem.start),
        "converged": False,
        "status": "infeasible",
        "holding": limit,
        "message": message,
        "values": dict(zip(problem.names, problem.start_values, strict=True)),
        "runs": [],
        "files": [],
    }


def outcome_lines(outcome: outcomes.Outcome, written: Sequence[Path]) -> Iterator[str]:
    """Yield an outcome as lines of text, with the start and the best design side by side."""
    problem = outcome.problem
    yield output.heading(optimised_design(outcome))
    before, after = outcomes.compare_designs(problem, problem.start, outcome.design)
    optimum = "optimum" if outcome.converged else "best so far"
    rows: list[tuple[str, ...]] = [("", "start", optimum, "change")]
    for name, pair in measure_rows(before, after):
        finite = [value for value in pair if value is not None and math.isfinite(value)]
        change = f"{finite[1] - finite[0]:+.6g}" if len(finite) == len(pair) else ""
        rows.append((name, *map(_cell, pair), change))
    if outcome.converged:
        yield from (outcome.message, "")
    yield output.table(rows, "<>>>")
    yield (
        f"\n{len(outcome.runs)} start{'s' if len(outcome.runs) > 1 else ''}, "
        f"{outcome.run.iterations} iterations and {outcome.run.evaluations} evaluations of the "
        f"best, {outcome.seconds:.2f} s in all"
    )
    yield from map(str, written)


def measure_rows(
    before: Measurements, after: Measurements
) -> Iterator[tuple[str, tuple[float | None, float | None]]]:
    """Yield the label and the two values, which may be infinite, of the second one's measures."""
    for name in dict.fromkeys((*VARIABLES, *after.values)):
        new = after.value(name)
        if new is None:
            continue
        measure = CATALOGUE[name]
        label = f"{measure.label} (degrees)" if measure.unit == "°" else measure.label
        if "demanded_margin" in measure.needs:
            label += f", margins ≥ {after.demanded_margin:.4g}"
        yield label, (before.value(name), new)


def _cell(value: float | None) -> str:
    if value is None:
        return "none"
    return output.figure(value) if math.isfinite(value) else "infinite"
