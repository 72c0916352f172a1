"""The colours of tilts over the workspace, and their scale."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from explorer.app.features.orientation.tasks import TiltsDrawing
from explorer.app.widgets.colours import Rgb, css
from explorer.app.widgets.markup import caption, dim, ticks
from explorer.numerics.arrays import FloatArray

STOPS: tuple[Rgb, ...] = (
    (68, 1, 84),
    (59, 82, 139),
    (33, 145, 140),
    (94, 201, 98),
    (253, 231, 37),
)
"""Colours from no tilt to the largest: those of Matplotlib's viridis, of even lightness."""

ROUND = 10.0


def most_of(drawing: TiltsDrawing) -> float:
    """Return the tilt at the end of the scale, in degrees."""
    largest = float(drawing.tilts.max(initial=0.0))
    return max(ROUND, ROUND * math.ceil(largest / ROUND))


def colours_of(tilts: FloatArray, most: float) -> NDArray[np.uint8]:
    """Return the colours of tilts (n,) on a scale from 0 to `most`, shape (n, 3)."""
    places = np.linspace(0.0, most, len(STOPS))
    stops = np.array(STOPS, dtype=np.float64)
    channels = [np.interp(tilts, places, stops[:, k]) for k in range(3)]
    return np.column_stack(channels).round().astype(np.uint8)


def scale_of_tilts(drawing: TiltsDrawing) -> str:
    """Return the scale of colours as HTML."""
    if not len(drawing.tilts):
        return dim("Tilt zero is beyond a limit all over, at this torsion.")
    most = most_of(drawing)
    stops = ",".join(
        f"{css(colour)} {100.0 * k / (len(STOPS) - 1):g}%" for k, colour in enumerate(STOPS)
    )
    places = ticks((0.0, "0°"), (50.0, f"{0.5 * most:g}°"), (100.0, f"{most:g}°"))
    least, largest = drawing.tilts.min(), drawing.tilts.max()
    return (
        f"{caption('Greatest tilt in every azimuth')}"
        f'<div class="ex-legend" style="--colours:{stops}"></div>{places}'
        f"{dim(f'{len(drawing.tilts):,} nodes, {least:.1f}° to {largest:.1f}°')}"
    )
