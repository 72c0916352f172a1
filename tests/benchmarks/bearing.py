"""The design that bears ten newtons in any direction, beside COBYQA on the same problem."""

from __future__ import annotations

import time
from collections.abc import Iterator
from typing import Any

import msgspec
import numpy as np

from benchmarks.samples import DESIGN
from benchmarks.table import Row, seconds, times
from explorer import Payload, Struts, make_problem
from explorer.errors import DesignError
from explorer.numerics.compiled import warm
from explorer.optimise.search.model import Model
from explorer.optimise.solver import optimise_design

BOX = ((6.0, 1.0, 1.0), (14.0, 9.0, 11.0))
LOADED = msgspec.structs.replace(
    DESIGN, payload=Payload(force_n=10.0), struts=Struts(moment_nm=1.0)
)
EVALUATIONS = 600


def run() -> Iterator[Row]:
    """Yield the rows."""
    from scipy.optimize import Bounds, NonlinearConstraint, minimize

    warm()
    problem = make_problem(
        LOADED, "smallest-load", volume=8000.0, reach=DESIGN.reach, required_box=BOX
    )
    began = time.perf_counter()
    outcome = optimise_design(problem)
    ours = time.perf_counter() - began
    model = Model(problem, problem.start_values)

    def values(u: Any) -> Any:
        try:
            return model.at(u).values
        except DesignError:
            return np.full(len(model.names), -1e3)

    def objective(u: Any) -> float:
        return -float(u[-1])

    untyped: Any = minimize
    began = time.perf_counter()
    found = untyped(
        objective,
        model.start,
        method="COBYQA",
        bounds=Bounds(*model.bounds.T),
        constraints=NonlinearConstraint(values, 0.0, np.inf),
        options={"maxfev": EVALUATIONS},
    )
    theirs = time.perf_counter() - began
    at = model.at(found.x)
    missed = max(0.0, -float(at.values.min()))
    yield Row(
        f"worst bending {outcome.best.objective:.3f} N m from "
        f"{model.reported(model.at(model.start)):.2f} over the box, volume 8000",
        seconds(ours),
        "10 s",
        f"COBYQA of SciPy, {found.nfev} evaluations: {model.reported(at):.3f} N m, demands missed "
        f"by {missed:.1e}, {seconds(theirs)}; {times(theirs / ours)}",
    )
