"""Cases of a test of which only the first ones run every day."""

from __future__ import annotations

from collections.abc import Iterable

import pytest


def long_after(count: int, cases: Iterable[object]) -> list[object]:
    """Return the cases with all after the first `count` marked long."""
    return [
        case if index < count else pytest.param(case, marks=pytest.mark.long)
        for index, case in enumerate(cases)
    ]
