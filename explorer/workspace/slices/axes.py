"""The axes of a slice: the axis that it is cut across, and its own two."""

from __future__ import annotations

from explorer.errors import InputError

AXES = "xyz"


def axes_of_slice(axis: str) -> tuple[int, int, int]:
    """Return the indices of the axis across which a slice is cut and of the slice's own axes.

    Raises:
        InputError: the axis is not "x", "y" or "z".
    """
    if axis not in AXES or len(axis) != 1:
        raise InputError(f"a slice is cut across x, y or z; got {axis!r}")
    cut = AXES.index(axis)
    first, second = (other for other in range(3) if other != cut)
    return cut, first, second
