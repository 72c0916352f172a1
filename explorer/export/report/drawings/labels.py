"""Labels beside points, placed where they cover least."""

from __future__ import annotations

import itertools
import math
from collections.abc import Sequence
from typing import TypeAlias
from xml.etree.ElementTree import Element

import numpy as np

from explorer.export.report.markup import drawing_text
from explorer.numerics.arrays import FloatArray

Box: TypeAlias = tuple[float, float, float, float]
Offset: TypeAlias = tuple[float, float]
"""The distance of a label from its point, and its direction in radians."""

# The size of a letter of a label, in points of paper.
LETTER, HEIGHT = 6.4, 12.0
_DIRECTIONS = tuple(math.radians(angle) for angle in (45, 135, -45, -135, 90, -90, 0, 180))
_DISTANCES = (13.0, 19.0, 26.0)
_ALONG = np.linspace(0.0, 1.0, 25)[:, None]


def labels(
    names: Sequence[tuple[str, FloatArray]],
    lines: Sequence[tuple[FloatArray, FloatArray]],
    within: Box,
) -> list[Element]:
    """Return labels of points.

    Args:
        names: Words of each label and its point, shape (2,).
        lines: Straight lines to keep clear, by their ends, each of shape (2,).
        within: Frame of the labels: left, top, right, bottom.
    """
    taken = [_box(point, 9.0, 9.0) for _, point in names]
    covered = np.concatenate([np.zeros((0, 2)), *(a + _ALONG * (b - a) for a, b in lines)])
    texts: list[Element] = []
    for name, point in names:
        width = LETTER * len(name) + 4.0

        def cost(offset: Offset, point: FloatArray = point, width: float = width) -> float:
            x0, y0, x1, y1 = box = _placed(point, offset, width)
            inside = ((covered > (x0, y0)) & (covered < (x1, y1))).all(axis=1)
            outside = max(0.0, within[0] - x0, x1 - within[2], within[1] - y0, y1 - within[3])
            overlap = sum(_overlap(box, other) for other in taken)
            return overlap + 4.0 * float(inside.sum()) + 50.0 * outside + 0.4 * offset[0]

        best = min(itertools.product(_DISTANCES, _DIRECTIONS), key=cost)
        box = _placed(point, best, width)
        taken.append(box)
        texts.append(drawing_text(name, 0.5 * (box[0] + box[2]), box[3] - 2.5, class_="label"))
    return texts


def _placed(point: FloatArray, offset: Offset, width: float) -> Box:
    distance, angle = offset
    x, y = point.tolist()
    off_x = math.cos(angle) * (distance + 0.5 * width - 4.0)
    return _box(np.array([x + off_x, y - math.sin(angle) * distance]), width, HEIGHT)


def _box(middle: FloatArray, width: float, height: float) -> Box:
    x, y = middle.tolist()
    return x - 0.5 * width, y - 0.5 * height, x + 0.5 * width, y + 0.5 * height


def _overlap(one: Box, other: Box) -> float:
    wide = min(one[2], other[2]) - max(one[0], other[0])
    high = min(one[3], other[3]) - max(one[1], other[1])
    return max(0.0, wide) * max(0.0, high)
