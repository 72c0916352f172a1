"""The tasks of the optimiser's process: to look for a design, and to compare two."""

from __future__ import annotations

from explorer.app.optimisation import Comparison
from explorer.app.worker import Line
from explorer.compiled import warm
from explorer.design import Design
from explorer.optimise.facts import facts_of
from explorer.optimise.outcome import Outcome
from explorer.optimise.problem import Box, Problem
from explorer.optimise.solver import optimise_design
from explorer.workspace import node_step_of


def ready() -> None:
    """Load what a search needs, so that the first one starts at once."""
    import scipy.optimize  # noqa: F401 # pyright: ignore[reportUnusedImport]

    warm()


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
    before: Design, after: Design, clearance_margin: float, boxes: tuple[Box | None, Box | None]
) -> Comparison:
    """Return the measures of two designs, by the same yardsticks.

    Args:
        before: The one to compare with.
        after: The other.
        clearance_margin: From which margin on clearances count.
        boxes: Over which the worst margin of each is looked for, or None.
    """
    step = node_step_of(before)
    first, second = (
        facts_of(design, clearance_margin=clearance_margin or None, box=box, step=step)
        for design, box in zip((before, after), boxes, strict=True)
    )
    return Comparison(first, second)
