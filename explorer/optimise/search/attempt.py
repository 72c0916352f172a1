"""One attempt of a search, and its message."""

from __future__ import annotations

from typing import NamedTuple

from explorer.numerics.number_text import format_ascii
from explorer.optimise.curves import CALLED
from explorer.optimise.outcome import Iterate, Status
from explorer.optimise.problem import Problem


class Attempt(NamedTuple):
    """Result of one attempt."""

    status: Status
    holding: str
    message: str
    best: Iterate


def default_message(problem: Problem, attempt: Attempt, steps: int) -> str:
    """Return the message of a run."""
    name = CALLED[problem.objective]
    # F compares numbers of unit size.
    size = 1.0 if problem.objective == "match-volume" else 0.0
    objective = attempt.best.objective
    value = "infinite" if objective is None else format_ascii(objective, 6, size=size)
    end = f"{name} = {value} after {steps} iterations"
    held = f", held by {attempt.holding}" if attempt.holding else ""
    match attempt.status:
        case "converged":
            return f"converged: {end}{held}"
        case "infeasible":
            return f"no design was found that meets all demands: {end}{held}"
        case "not converged":
            return f"not converged: {end}{held}; allow more iterations or start elsewhere"
        case "stalled":
            return f"stalled: {end}{held}; try several starts"
        case "outdone":
            return f"no better than an earlier start, even without the clearance: {end}"
        case "cancelled":
            return f"cancelled: {end}"
