"""What becomes of the parts of the state when it is saved and when another design is opened.

Each field of the state, and of its parts, declares this as its metadata. A field that declares
nothing is saved, and is that of a new state once another design is opened.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import Field, fields
from typing import Any, cast

TRANSIENT: Mapping[str, Any] = {"is_saved": False}
"""Metadata of a field that no file holds: it describes work under way, or is computed again."""


def _unchanged(value: Any) -> Any:
    return value


STAYS: Mapping[str, Any] = {"on_open": _unchanged}
"""Metadata of a field that keeps its value when another design is opened.

Another function as `on_open` takes the value and returns what stays of it.
"""


def saved_fields(kind: Any) -> tuple[Field[Any], ...]:
    """Return the fields of a dataclass that a file holds."""
    return tuple(field for field in fields(kind) if field.metadata.get("is_saved", True))


def kept_on_open(state: Any) -> dict[str, Any]:
    """Return what stays of a state when another design is opened, by field."""
    return {
        field.name: field.metadata["on_open"](getattr(state, field.name))
        for field in fields(state)
        if "on_open" in cast("Mapping[str, Any]", field.metadata)
    }
