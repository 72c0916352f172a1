"""The tasks of the optimiser's process: to look for a design, and to compare two."""

from __future__ import annotations

from explorer.app.session.worker import Line
from explorer.app.state.optimisation import Comparison
from explorer.measures.case import Case
from explorer.measures.catalogue import measures_in
from explorer.measures.measurements import measure_design
from explorer.mechanism.design import Design
from explorer.optimise.outcome import Outcome
from explorer.optimise.problem import Box, Problem
from explorer.optimise.solver import optimise_design


def optimise(problem: Problem, starts: int, line: Line) -> Outcome:
    """Look for the best design, telling each iterate as it is found.

    Args:
        problem: What to look for.
        starts: From how many designs.
        line: To the parent.

    Raises:
        InputError: see `optimise_design`.
    """
    return optimise_design(problem, starts=starts, watch=line.tell, stop=line.is_cut)


def compare(
    before: Design,
    after: Design,
    demanded_margin: float | None,
    boxes: tuple[Box | None, Box | None],
) -> Comparison:
    """Return the measures of two designs.

    Args:
        before: The one to compare with.
        after: The other.
        demanded_margin: From which margin on a clearance was demanded; None if it was not.
        boxes: Over which the least margin of each is looked for, or None.
    """
    first, second = (
        measure_design(
            Case(design, demanded_margin=demanded_margin, box=box), measures_in("optimise")
        )
        for design, box in zip((before, after), boxes, strict=True)
    )
    return Comparison(first, second)
