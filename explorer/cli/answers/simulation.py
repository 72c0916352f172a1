"""The model of a simulation: its servos, what it leaves out, and what deviates in it."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping
from typing import Any

import numpy as np

from explorer.cli.output import assumed_lines, figure, figures, table
from explorer.export.imperfect import ImperfectMachine
from explorer.export.simulation import SIMULATION_BODIES, SIMULATION_JOINTS, SimulationModel
from explorer.mechanism.design import JOINTS, Design
from explorer.numerics.arrays import FloatArray
from explorer.numerics.number_text import format_number
from explorer.statics.error_sources import SOURCES, UNITS, drawing_values, source_errors


def simulation_json(model: SimulationModel) -> dict[str, Any]:
    """Return names, servos and what is left out of a model as plain values."""
    servos = model.servos
    return {
        "format": "mjcf",
        "bodies": SIMULATION_BODIES[1:],
        "joints": SIMULATION_JOINTS,
        "servo_stiffness_n_mm": (1e-3 * servos.stiffness).tolist(),
        "servo_forces_n": servos.forces.tolist(),
        "servo_rotors_kg": servos.rotors.tolist(),
        "droop": _tool_json(model.design, servos.droop(model.design, servos.forces)),
        "droop_without_forces": _tool_json(model.design, servos.droop(model.design, np.zeros(6))),
        "left_out": model.left_out,
    }


def imperfect_json(machine: ImperfectMachine) -> dict[str, Any]:
    """Return deviations and errors of the tool at home as plain values."""
    design = machine.design
    off, most = (
        drawing_values(design, each) for each in (machine.deviations, source_errors(design))
    )
    rows = zip(SOURCES, off.tolist(), most.tolist(), UNITS, strict=True)
    names = ("name", "deviation", "largest", "unit")
    return {
        "seed": machine.seed,
        "deviations": [dict(zip(names, row, strict=True)) for row in rows],
        "tool_error": _tool_json(design, machine.tool_error()),
        "linear_tool_error": _tool_json(design, machine.linear_tool_error()),
    }


def _tool_json(design: Design, error: FloatArray) -> dict[str, list[float]]:
    return {
        "displacement_mm": (design.unit_mm * error[:3]).tolist(),
        "turn_degrees": np.degrees(error[3:]).tolist(),
    }


def simulation_lines(facts: Mapping[str, Any]) -> Iterator[str]:
    """Yield the tables of a model from what `simulation_json` and `imperfect_json` return."""
    if "deviations" in facts:
        yield from _imperfect_lines(facts)
        yield ""
    keys = ("servo_stiffness_n_mm", "servo_forces_n", "servo_rotors_kg")
    columns = (figures(facts[key]) for key in keys)
    head = ("servo", "stiffness, N/mm", "force at home, N", "rotor, kg")
    yield table([head, *zip(JOINTS, *columns, strict=True)], "<>>>")
    words = f"at home the weights move the tool by {_sizes(facts['droop'])}"
    if facts["droop"] != facts["droop_without_forces"]:
        words += f"; without the forces at home by {_sizes(facts['droop_without_forces'])}"
    yield words
    yield f"left out: {', '.join(facts['left_out'])}"


def _sizes(error: Mapping[str, list[float]]) -> str:
    """Return the sizes of a displacement and a turn in words."""
    moved, turned = (math.hypot(*error[key]) for key in ("displacement_mm", "turn_degrees"))
    return f"{format_number(moved, 3)} mm and {format_number(turned, 3)}°"


def _imperfect_lines(facts: Mapping[str, Any]) -> Iterator[str]:
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
