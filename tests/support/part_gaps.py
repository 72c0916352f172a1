"""Overlaps and gaps between the parts of a prototype, by manifold3d."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

import numpy as np
from manifold3d import Error, Manifold, Mesh64
from numpy.typing import ArrayLike

from explorer.motion.chains import Places
from explorer.numerics.arrays import FloatArray
from explorer.prototype.assembly import Prototype
from explorer.prototype.shapes import PrototypePart


def overlaps(parts: Sequence[PrototypePart], places: Places) -> Iterator[tuple[str, str, float]]:
    """Yield the pairs of parts that share a volume, and the volume in cubed design units.

    Args:
        parts: Parts to compare.
        places: Placements of the bodies in one pose.
    """
    known, boxes = placed(parts, places)
    for j, second in enumerate(known):
        for i, first in enumerate(known[:j]):
            if touching(boxes[i], boxes[j]):
                both = first ^ second
                assert both.status() == Error.NoError
                volume = float(both.volume())
                if volume > 0.0:
                    yield parts[i].name, parts[j].name, volume


def least_gap(
    parts: Sequence[PrototypePart], places: Places, within: float
) -> tuple[float, str, str]:
    """Return the least distance of two parts in design units, and their names.

    Args:
        parts: Parts to compare.
        places: Placements of the bodies in one pose.
        within: Largest distance of interest, in design units; returned if none is smaller.
    """
    known, boxes = placed(parts, places)
    found = (within, "", "")
    for j, second in enumerate(known):
        for i, first in enumerate(known[:j]):
            low, high = boxes[i]
            if touching((low - found[0], high + found[0]), boxes[j]):
                gap = float(first.min_gap(second, found[0]))
                if gap < found[0]:
                    found = (gap, parts[i].name, parts[j].name)
    return found


def vertices_at(prototype: Prototype, position: ArrayLike, rotation: ArrayLike) -> list[FloatArray]:
    """Return the vertices of all parts in one pose, in the base frame and design units."""
    places = prototype.places(position, rotation)
    each = zip(prototype.parts, places.origin, places.rotation, strict=True)
    return [part.vertices @ turn.T + origin for part, origin, turn in each]


def placed(
    parts: Sequence[PrototypePart], places: Places
) -> tuple[list[Manifold], list[tuple[FloatArray, FloatArray]]]:
    """Return the parts in one pose, and the corners of their bounding boxes."""
    known: list[Manifold] = []
    boxes: list[tuple[FloatArray, FloatArray]] = []
    for part in parts:
        turn, origin = places.rotation[part.body_index], places.origin[part.body_index]
        points = np.ascontiguousarray(part.vertices @ turn.T + origin)
        known.append(Manifold(Mesh64(points, part.faces.astype(np.uint64))))
        boxes.append((points.min(axis=0), points.max(axis=0)))
    return known, boxes


def touching(one: tuple[FloatArray, FloatArray], other: tuple[FloatArray, FloatArray]) -> bool:
    return bool((one[0] <= other[1]).all() and (other[0] <= one[1]).all())
