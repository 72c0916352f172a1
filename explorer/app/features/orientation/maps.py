"""The map of tilts by azimuth, and the scale of tilts."""

from __future__ import annotations

import itertools
import math
from collections import Counter
from collections.abc import Iterator
from html import escape
from xml.etree.ElementTree import Element

import msgspec
import numpy as np
from numpy.typing import NDArray

from explorer.app.features.orientation.work import TiltsDrawing
from explorer.app.widgets.markup import caption, dim, reading, row, swatch, table, ticks
from explorer.export.drawings.markup import circle, drawing_text, element, page_picture, path_of
from explorer.mechanism.rgb import Rgb, css
from explorer.mechanism.tilt_torsion import TiltTorsion
from explorer.numerics.arrays import FloatArray
from explorer.singularity.colours import MARGIN_COLOURS
from explorer.workspace.orientations.tilts import GreatestTilt, TiltMap

WIDTH, HEIGHT = 316.0, 268.0
CENTRE, RADIUS = (158.0, 134.0), 112.0
RING = 30.0
# The map shows at least this tilt at its edge, in degrees.
LEAST_EDGE = 60.0
# Difference of torsions in degrees up to which the torsion of home is that of the map.
SAME_TORSION = 0.05

FREE: Rgb = (132, 156, 199)
"""Colour where the platform tilts by 180° without a limit."""

COLOURS: dict[str, Rgb] = {
    **{f"margin δ{index}": colour for index, colour in enumerate(MARGIN_COLOURS, 1)},
    "carriage order": (10, 153, 149),
    "gap": (61, 203, 114),
    "l1": (40, 56, 119),
    "d2": (79, 98, 191),
    "d4": (151, 179, 235),
    "l4": (71, 64, 173),
    "d1": (162, 109, 0),
    "d3": (216, 167, 35),
    "box": (90, 98, 110),
}
"""Colours of limits by the beginning of their names; those of margins are theirs in the scene.

Any two differ for colour-blind eyes too, since any limit may end the tilts beside any other.
"""

OTHER: Rgb = (121, 70, 38)
"""Colour of other limits, such as those of swings."""

# Difference of tilts in degrees below which they count as one.
SAME_TILT = 0.05

STOPS: tuple[Rgb, ...] = ((68, 1, 84), (59, 82, 139), (33, 145, 140), (94, 201, 98), (253, 231, 37))
"""Colours from no tilt to the largest: those of Matplotlib's viridis, of even lightness."""

# The end of the scale is a multiple of this, in degrees.
ROUND = 10.0


def colour_of(limit: str | None) -> Rgb:
    """Return the colour of a limit; None for no limit."""
    if limit is None:
        return FREE
    named = (colour for name, colour in COLOURS.items() if limit.startswith(name))
    return next(named, OTHER)


def edge_of(tilts: TiltMap, here: TiltTorsion, home: TiltTorsion) -> float:
    """Return the tilt at the edge of the map, a whole number of rings, in degrees."""
    largest = max(LEAST_EDGE, here.tilt, home.tilt, float(np.nan_to_num(tilts.tilts).max()))
    return min(180.0, RING * math.ceil(largest / RING - 1e-9))


def polar_map(tilts: TiltMap, least: GreatestTilt, here: TiltTorsion, home: TiltTorsion) -> str:
    """Return the map as SVG: azimuth as the direction, tilt as the distance from the centre.

    It shows the greatest tilt by azimuth and in every azimuth, the present orientation and home.
    """
    edge = edge_of(tilts, here, home)
    # What a script reads the position by, in degrees from the centre.
    scale = RADIUS / edge
    ends = {"lows": (-edge, -edge), "highs": (edge, edge), "radius": edge, "decimals": 2}
    place = (CENTRE[0] - RADIUS, CENTRE[1] + RADIUS, scale)
    facts = {"name": "orientation", "place": place, **ends}
    pieces = [*_rings(edge), *_region(tilts, edge), *_least(least, edge), *_labels(edge)]
    is_other = abs(math.remainder(home.torsion - here.torsion, 360.0)) > SAME_TORSION
    look = f"home{' is-other' if is_other else ''}"
    pieces.append(circle(_place(home.azimuth, home.tilt, edge), 5.0, look))
    x, y = _place(here.azimuth, here.tilt, edge)
    arms = f"M{x - 6:.1f} {y:.1f}h12M{x:.1f} {y - 6:.1f}v12"
    pieces += (_path(look, arms) for look in ("cross casing", "cross"))
    key = f"+ present orientation, ○ home{', at another torsion' if is_other else ''}"
    return (
        page_picture(
            "ex-map ex-tilts",
            "Greatest tilt by azimuth",
            *pieces,
            viewBox=f"0 0 {WIDTH:g} {HEIGHT:g}",
            data_within="",
            data_map=msgspec.json.encode(facts).decode(),
        )
        + f'<div class="ex-dim">{key}</div>'
        + reading("Point at the map to read it, click to tilt there.")
    )


def legend(tilts: TiltMap) -> str:
    """Return the limits that end the tilts, with the number of azimuths of each, as HTML."""
    counts = Counter(tilts.limits)
    rows = [
        row(
            f"{swatch(colour_of(limit))} {escape(limit or 'no limit')}",
            f"{100.0 * count / len(tilts.limits):.0f} %",
        )
        for limit, count in counts.most_common()
    ]
    return table(rows)


def _path(look: str, data: str) -> Element:
    return element("path", class_=look, d=data)


def _place(azimuth: float, tilt: float, edge: float) -> tuple[float, float]:
    angle, distance = math.radians(azimuth), RADIUS * tilt / edge
    return CENTRE[0] + distance * math.cos(angle), CENTRE[1] - distance * math.sin(angle)


def _rings(edge: float) -> Iterator[Element]:
    """Yield the circles of tilts and the axes x and y."""
    x, y = CENTRE
    count = round(edge / RING)
    for ring in range(1, count + 1):
        yield circle(CENTRE, RADIUS * ring / count, "frame" if ring == count else "ring")
    yield _path("ring", f"M{x - RADIUS} {y}h{2 * RADIUS}M{x} {y - RADIUS}v{2 * RADIUS}")


def _labels(edge: float) -> Iterator[Element]:
    """Yield the labels of the circles and axes."""
    count = round(edge / RING)
    for ring in range(1, count + 1):
        x, y = _place(-45.0, RING * ring, edge)
        yield drawing_text(f"{RING * ring:.0f}°", x + 2.0, y + 10.0, "angle")
    x, y = CENTRE
    for words, dx, dy, anchor in (
        ("x", RADIUS + 8, 4, "start"),
        ("−x", -RADIUS - 8, 4, "end"),
        ("y", 0, -RADIUS - 7, "middle"),
        ("−y", 0, RADIUS + 15, "middle"),
    ):
        yield drawing_text(words, x + dx, y + dy, "axis", anchor=anchor)


def _least(least: GreatestTilt, edge: float) -> Iterator[Element]:
    """Yield the circle of the greatest tilt in every azimuth, and a dot where it ends."""
    if not math.isnan(least.tilt):
        yield circle(CENTRE, RADIUS * least.tilt / edge, "least")
        if least.limit is not None:
            yield circle(_place(least.azimuth, least.tilt, edge), 3.0, "dot")


def _region(tilts: TiltMap, edge: float) -> Iterator[Element]:
    """Yield the tilts that are possible, and their border in the colours of the limits."""
    azimuths, values = np.radians(tilts.azimuths), np.nan_to_num(tilts.tilts) * RADIUS / edge
    x, y = CENTRE[0] + values * np.cos(azimuths), CENTRE[1] - values * np.sin(azimuths)
    points = np.column_stack([x, y])
    yield _path("possible", path_of(points, decimals=1))
    middles = 0.5 * (points + np.roll(points, -1, axis=0))
    parts = np.stack([np.roll(middles, 1, axis=0), points, middles], axis=1)
    for limit, group in itertools.groupby(range(len(points)), lambda k: tilts.limits[k]):
        border = path_of(parts[[*group]].reshape(-1, 2), "", 1)
        yield element("path", class_="border", stroke=css(colour_of(limit)), d=border)


def most_of(drawing: TiltsDrawing) -> float:
    """Return the tilt at the end of the scale, in degrees."""
    largest = float(drawing.tilts.max(initial=0.0))
    return max(ROUND, ROUND * math.ceil(largest / ROUND))


def colours_of(tilts: FloatArray, most: float) -> NDArray[np.uint8]:
    """Return the colours of tilts (n,) on a scale from 0 to `most`, shape (n, 3)."""
    places = np.linspace(0.0, most, len(STOPS))
    channels = [np.interp(tilts, places, channel) for channel in zip(*STOPS, strict=True)]
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
