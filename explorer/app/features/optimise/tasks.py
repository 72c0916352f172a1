"""The tasks of the optimiser's process: search for a design, compare two."""

from __future__ import annotations

from explorer.app.session.worker import Channel
from explorer.app.state.optimisation import Comparison
from explorer.measures.case import Case
from explorer.measures.catalogue import measures_in
from explorer.measures.measurements import measure_design
from explorer.mechanism.design import Design
from explorer.optimise.demands import Box
from explorer.optimise.outcome import Outcome
from explorer.optimise.problem import Problem
from explorer.optimise.solver import optimise_design


def optimise(problem: Problem, starts: int, channel: Channel) -> Outcome:
    """Search for the best design, and send each iterate to the parent.

    Args:
        problem: Problem to solve.
        starts: Number of designs to start from.
        channel: Channel to the parent.

    Raises:
        InputError: see `optimise_design`.
    """
    return optimise_design(problem, starts=starts, watch=channel.send, stop=channel.is_cancelled)


def compare(
    before: Design,
    after: Design,
    demanded_margin: float | None,
    boxes: tuple[Box | None, Box | None],
) -> Comparison:
    """Return the measures of two designs.

    Args:
        before: Design to compare with.
        after: Other design.
        demanded_margin: Margin from which on a clearance is demanded; None without a demand.
        boxes: Box of each for its least margin, or None.
    """
    first, second = (
        measure_design(
            Case(design, demanded_margin=demanded_margin, box=box), measures_in("optimise")
        )
        for design, box in zip((before, after), boxes, strict=True)
    )
    return Comparison(first, second)
