"""Whether no two legs collide on moves."""

from __future__ import annotations

from typing import Any

import numpy as np

from explorer.legs.moves import pairs_are_clear
from explorer.numerics.arrays import BoolArray


def moves_are_clear(*given: Any, **options: Any) -> BoolArray:
    """Return whether all pairs are clear by `pairs_are_clear`, shape (...)."""
    return np.asarray(pairs_are_clear(*given, **options).all(axis=-1))
