"""Reference cases from independent computations, the files in tests/data."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any


def read_reference(name: str) -> Any:
    """Return the contents of a file in tests/data, named without its suffix."""
    path = Path(__file__).parents[1] / "data" / f"{name}.json"
    return json.loads(path.read_text(encoding="utf-8"))
