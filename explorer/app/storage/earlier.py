"""Sessions of the first two schemas, read as states of the present one.

These schemas held a state by columns: for each field its distinct values, and by step which of
them it is. The fields were those of the state, but for the parts listed in `MOVED`, whose values
stood beside them; of a run, the designs of its iterates were left out.
"""

from __future__ import annotations

from typing import Annotated, Any, cast

import msgspec

from explorer.app.storage.packing import (
    present_design,
    present_paths,
    present_view,
    present_words,
)
from explorer.errors import InputError
from explorer.optimise.problem import Problem
from explorer.optimise.record import Step, iterate_of

Index = Annotated[int, msgspec.Meta(ge=0)]

MOVED = {
    "path_modes": ("paths", "modes"),
    "path_start": ("paths", "start"),
    "path_goal": ("paths", "goal"),
    "path_seconds": ("paths", "seconds"),
    "journey": ("paths", "journey"),
    "wish": ("optimisation", "request"),
    "runs": ("optimisation", "count"),
    "run": ("optimisation", "run"),
}
"""The present part and field of each value that stood by itself."""


class _Column(msgspec.Struct, forbid_unknown_fields=True):
    values: list[Any]
    rows: list[Index]


class Body(msgspec.Struct, forbid_unknown_fields=True):
    """The second line of a file of the first two schemas."""

    words: list[str]
    at: Index
    first: Index
    columns: dict[str, _Column]


def states_of(body: Body, schema: int) -> list[dict[str, Any]]:
    """Return the fields of each state in a body, that of the page last.

    Raises:
        InputError: columns that differ in length.
        LookupError, TypeError, AttributeError: a body that no explorer wrote.
    """
    count = len(body.words) + 1
    if any(len(column.rows) != count for column in body.columns.values()):
        raise InputError("its columns differ in length")
    # Each distinct value is brought up to date once, so that states share it again.
    columns = {
        name: [_upgrade(name, value, schema) for value in column.values]
        for name, column in body.columns.items()
    }
    return [
        _regroup({name: columns[name][body.columns[name].rows[row]] for name in columns})
        for row in range(count)
    ]


def _upgrade(name: str, value: Any, schema: int) -> Any:
    """Return the value of a field as it is in the present schema."""
    value = _upgrade_designs(value)
    if name == "view":
        value = present_view(value)
        if schema == 1 and "ghost" in value.get("singular", {}):
            ghost = value["singular"]["ghost"].replace("κ", "δ")
            return {**value, "singular": {**value["singular"], "ghost": ghost}}
    if name == "studies":
        return {"plan" if field == "wish" else field: old for field, old in value.items()}
    if name == "run" and value is not None:
        problem = msgspec.convert(value["problem"], Problem)
        steps = msgspec.convert(value["iterates"], list[Step])
        own = {field: _upgrade(field, old, schema) for field, old in value["own"].items()}
        return value | {
            "own": _regroup(own),
            "phase": "ended",
            "iterates": [msgspec.to_builtins(iterate_of(problem, step)) for step in steps],
        }
    return value


def _regroup(session: dict[str, Any]) -> dict[str, Any]:
    """Return a state with values in the parts that they belong to."""
    state: dict[str, Any] = {"paths": {}, "optimisation": {}}
    joint, at = session.pop("asked", None), session.pop("journey_at", 0.0)
    for name, value in session.items():
        part, field = MOVED.get(name, ("", name))
        (state[part] if part else state)[field] = value
    if state["paths"].get("journey") is not None:
        state["paths"]["journey"] = present_paths(state["paths"]["journey"] | {"at": at})
    state["paths"] = present_paths(state["paths"])
    if joint is not None:
        unclosed = {"joint": joint, "asked": session["joints"][joint], "nearest": None}
        state["unclosed"] = unclosed | {"failing": []}
    return state


def _upgrade_designs(value: Any) -> Any:
    if isinstance(value, list):
        return [_upgrade_designs(entry) for entry in cast("list[Any]", value)]
    if not isinstance(value, dict):
        return value
    fields = cast("dict[str, Any]", value)
    present = {name: _upgrade_designs(old) for name, old in fields.items()}
    return present_design(present_words(present))
