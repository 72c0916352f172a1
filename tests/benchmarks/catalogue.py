"""All benchmarks by name: that of a module here, whose `run` yields its rows."""

from __future__ import annotations

import importlib
from collections.abc import Iterable, Mapping

from benchmarks.table import Row

BENCHMARKS: Mapping[str, str] = {
    "forward": "the forward kinematics: a batch on one core, and one call",
    "slider": "from the arrival of a slider's event to the last message of the scene",
    "volume": "exact volume and gradient of the workspace",
    "solid": "the solid of the workspace",
    "interference": "overlap of tetrahedra, clearances of the legs, moves, accessible workspace",
    "nearest": "nearest singular pose of all three incidences",
    "forces": "forces of the actuators in many poses",
    "held": "the region that holds a load, beside marching cubes",
    "accuracy": "compliance and errors in many poses",
    "optimise": "optimal designs: iterations, precision, time, random starts",
    "studies": "many designs: a second, on two workers, a million: memory, files, time",
    "planning": "paths between random poses that keep everything",
    "report": "the report of a design as HTML and as PDF, from the command to the file",
    "orientation": "shares of orientations, greatest tilts at a position and over many",
    "frame_cost": "a frame of the scene in the software renderer, over viser's hello-world",
    "page_ready": "from the address to a page that has drawn all, over viser's hello-world",
    "first_minute": "the first searches on a machine that has never run the explorer",
    "command": "wall time of one command",
}
"""Each benchmark and what it measures, in the order of the table."""


def measure(name: str) -> list[Row]:
    """Run a benchmark and return its rows; only now is what it needs imported."""
    rows: Iterable[Row] = importlib.import_module(f"benchmarks.{name}").run()
    return list(rows)
