"""All benchmarks by name: that of a module here, which runs them."""

from __future__ import annotations

import importlib
from collections.abc import Iterable, Mapping

from benchmarks.table import Row

BENCHMARKS: Mapping[str, str] = {
    "forward_batch": "joint vectors per second of the forward kinematics, one core",
    "forward_once": "one call of the forward kinematics",
    "forward_error": "error of the forward kinematics over the reference cases",
    "slider": "from the arrival of a slider's event to the last message of the scene",
    "volume": "exact volume and gradient of the workspace",
    "solid": "the solid of the workspace",
    "solid_page": "from a design slider to the updated solid",
    "interference": "overlap of tetrahedra, clearances of the legs, whole moves",
    "accessible": "the workspace that a move leads to without collisions, against the radius",
    "nearest": "nearest singular pose of all three incidences",
    "validity": "whether poses and moves keep limits, margins and clearances",
    "forces": "forces of the actuators in many poses",
    "held": "the region that holds a load, beside marching cubes",
    "bearing": "a design that bears a load, beside COBYQA",
    "accuracy": "compliance and errors in many poses",
    "claims": "the claims of the paper",
    "optimise": "optimal designs: iterations, precision, time, random starts",
    "studies": "many designs: a second, on two workers, on Dask, with workers killed",
    "studies_scale": "a study of a million designs: overhead of tasks, memory, files, time",
    "planning": "paths between random poses that keep everything",
    "prototype": "parts of the prototype, their places, their files, STEP, the simulation",
    "prototype_page": "from a design slider to the new parts, and their moves with a pose",
    "report": "the report of a design as HTML and as PDF, from the command to the file",
    "orientation": "shares of orientations, greatest tilts at a position and over many",
    "drag_sockets": "lag of two long drags at once, seen by bare websocket clients",
    "tabs": "twenty tabs at once, each dragging a control",
    "undo": "undoing and redoing any step",
    "drag_browser": "lag of two long drags at once, seen in two tabs of a real browser",
    "saving": "saving a session of fifty steps, and opening it again",
    "page": "from starting the explorer to the first byte of its page",
    "frame_cost": "a frame of the scene in the software renderer, over viser's hello-world",
    "page_ready": "from the address to a page that has drawn all, over viser's hello-world",
    "screenshot": "the first picture from the command line",
    "first_minute": "the first searches on a machine that has never run the explorer",
    "command": "wall time of one command",
}
"""Each benchmark and what it measures, in the order of the table."""


def measure(name: str) -> list[Row]:
    """Run a benchmark and return its rows; only now is what it needs imported."""
    module, function = name.split("_") if name.startswith("forward_") else (name, "run")
    rows: Iterable[Row] = getattr(importlib.import_module(f"benchmarks.{module}"), function)()
    return list(rows)
