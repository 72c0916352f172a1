"""The imperfect machine of an export: what deviates, and where the tool is instead."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import Any

import numpy as np

from explorer.cli.output import assumed_lines, figure, figures, table
from explorer.export.imperfect import ImperfectMachine
from explorer.export.servos import servo_stiffness
from explorer.numerics.arrays import FloatArray
from explorer.statics.error_sources import SOURCES, UNITS, drawing_values, source_errors


def imperfect_json(machine: ImperfectMachine) -> dict[str, Any]:
    """Return deviations, errors of the tool at home and stiffness of the servos as plain values."""
    design = machine.design
    off, most = (
        drawing_values(design, each) for each in (machine.deviations, source_errors(design))
    )
    rows = zip(SOURCES, off.tolist(), most.tolist(), UNITS, strict=True)
    names = ("name", "deviation", "largest", "unit")
    stiffness = servo_stiffness(design)
    return {
        "seed": machine.seed,
        "deviations": [dict(zip(names, row, strict=True)) for row in rows],
        "tool_error": _tool_json(machine, machine.tool_error()),
        "linear_tool_error": _tool_json(machine, machine.linear_tool_error()),
        "servo_stiffness_n_mm": None if stiffness is None else (1e-3 * stiffness).tolist(),
    }


def _tool_json(machine: ImperfectMachine, error: FloatArray) -> dict[str, list[float]]:
    return {
        "displacement_mm": (machine.design.unit_mm * error[:3]).tolist(),
        "turn_degrees": np.degrees(error[3:]).tolist(),
    }


def imperfect_lines(facts: Mapping[str, Any]) -> Iterator[str]:
    """Yield the tables of a machine from what `imperfect_json` returns, and what is assumed."""
    yield from assumed_lines(facts["assumed"])
    stated = [row for row in facts["deviations"] if row["largest"] > 0.0]
    if not stated:
        yield "the design states neither errors nor tolerances: only its servos give way"
        return
    rows = [(f"seed {facts['seed']}", "deviation", "within ±", "")]
    rows += [
        (row["name"], figure(row["deviation"]), f"{row['largest']:g}", row["unit"])
        for row in stated
    ]
    yield from (table(rows, "<>><"), "")
    errors = [("tool at home off by", "size", *"xyz", "")]
    for part, unit in (("displacement", "mm"), ("turn", "degrees")):
        for words, key in (("", "tool_error"), (", linear model", "linear_tool_error")):
            vector = facts[key][f"{part}_{unit}"]
            size = float(np.linalg.norm(vector))
            x, y, z = figures(vector)
            errors.append((part + words, figure(size), x, y, z, unit))
    yield table(errors, "<>>>><")
