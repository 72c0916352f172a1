"""The map of tilts by azimuth, the strip of tilts by torsion, and the scale of tilts."""

from __future__ import annotations

import itertools
import math
from collections import Counter
from collections.abc import Iterable, Iterator
from html import escape

import msgspec
import numpy as np
from numpy.typing import NDArray

from explorer.app.features.orientation.work import TiltsDrawing
from explorer.app.widgets.markup import caption, dim, reading, row, swatch, table, ticks
from explorer.mechanism.tilt_torsion import TiltTorsion
from explorer.numerics.arrays import FloatArray
from explorer.singularity.colours import MARGIN_COLOURS, Rgb, css
from explorer.workspace.orientations.tilts import GreatestTilt, TiltByTorsion, TiltMap

WIDTH, HEIGHT = 316.0, 268.0
CENTRE, RADIUS = (158.0, 134.0), 112.0
RING = 30.0
# The map shows at least this tilt at its edge, in degrees.
LEAST_EDGE = 60.0
# Difference of torsions in degrees up to which the torsion of home is that of the map.
SAME_TORSION = 0.05

FREE: Rgb = (140, 150, 160)
"""Colour where the platform tilts by 180° without a limit."""

COLOURS: dict[str, Rgb] = {
    **{f"margin δ{index}": colour for index, colour in enumerate(MARGIN_COLOURS, 1)},
    "carriage order": (0, 150, 150),
    "gap": (120, 200, 200),
    "l1": (24, 74, 150),
    "d2": (60, 150, 230),
    "d4": (140, 190, 240),
    "l4": (70, 80, 200),
    "d1": (150, 120, 50),
    "d3": (205, 170, 80),
    "box": (90, 98, 110),
}
"""Colours of limits by the beginning of their names; those of margins are theirs in the scene."""

OTHER: Rgb = (120, 70, 40)
"""Colour of other limits, such as those of swings."""

# The strip, in pixels.
STRIP_HEIGHT = 96.0
LEFT, RIGHT, TOP, BOTTOM = 34.0, 306.0, 8.0, 72.0
TICKS = (-180, -90, 0, 90, 180)
# Difference of tilts in degrees below which they count as one.
SAME_TILT = 0.05

STOPS: tuple[Rgb, ...] = ((68, 1, 84), (59, 82, 139), (33, 145, 140), (94, 201, 98), (253, 231, 37))
"""Colours from no tilt to the largest: those of Matplotlib's viridis, of even lightness."""

# The end of the scale is a multiple of this, in degrees.
ROUND = 10.0


def _svg(label: str, data: str, facts: object, pieces: Iterable[str], height: float) -> str:
    """Return an SVG with facts in an attribute, which a script of the page reads."""
    attribute = f'data-{data}="{escape(msgspec.json.encode(facts).decode())}"'
    return (
        f'<svg class="ex-map ex-tilts" viewBox="0 0 {WIDTH:g} {height:g}" role="img" '
        f'aria-label="{label}" {attribute}>{"".join(pieces)}</svg>'
    )


def _circle(look: str, at: tuple[float, float], radius: float) -> str:
    x, y = at
    return f'<circle class="{look}" cx="{x:.1f}" cy="{y:.1f}" r="{radius:.1f}"/>'


def _round_up(tilt: float) -> float:
    """Return the next ring from a tilt on, in degrees."""
    return RING * math.ceil(tilt / RING - 1e-9)


def colour_of(limit: str | None) -> Rgb:
    """Return the colour of a limit; None for no limit."""
    if limit is None:
        return FREE
    named = (colour for name, colour in COLOURS.items() if limit.startswith(name))
    return next(named, OTHER)


def edge_of(tilts: TiltMap, here: TiltTorsion, home: TiltTorsion) -> float:
    """Return the tilt at the edge of the map, in degrees."""
    largest = float(np.nan_to_num(tilts.tilts).max())
    return min(180.0, _round_up(max(LEAST_EDGE, here.tilt, home.tilt, largest)))


def polar_map(tilts: TiltMap, least: GreatestTilt, here: TiltTorsion, home: TiltTorsion) -> str:
    """Return the map as SVG: azimuth as the direction, tilt as the distance from the centre.

    It shows the greatest tilt by azimuth and in every azimuth, the present orientation and home.
    """
    edge = edge_of(tilts, here, home)
    facts = {"centre": CENTRE, "radius": RADIUS, "edge": edge}
    pieces = [*_rings(edge), *_region(tilts, edge), *_least(least, edge), *_labels(edge)]
    is_other = abs(math.remainder(home.torsion - here.torsion, 360.0)) > SAME_TORSION
    look = f"home{' is-other' if is_other else ''}"
    pieces.append(_circle(look, _place(home.azimuth, home.tilt, edge), 5.0))
    x, y = _place(here.azimuth, here.tilt, edge)
    arms = f"M{x - 6:.1f} {y:.1f}h12M{x:.1f} {y - 6:.1f}v12"
    pieces.append(f'<path class="cross casing" d="{arms}"/><path class="cross" d="{arms}"/>')
    key = f"+ present orientation, ○ home{', at another torsion' if is_other else ''}"
    return (
        _svg("Greatest tilt by azimuth", "tilts", facts, pieces, HEIGHT)
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


def _place(azimuth: float, tilt: float, edge: float) -> tuple[float, float]:
    angle, distance = math.radians(azimuth), RADIUS * tilt / edge
    return CENTRE[0] + distance * math.cos(angle), CENTRE[1] - distance * math.sin(angle)


def _rings(edge: float) -> Iterator[str]:
    """Yield the circles of tilts and the axes x and y."""
    x, y = CENTRE
    count = round(edge / RING)
    for ring in range(1, count + 1):
        yield _circle("frame" if ring == count else "ring", CENTRE, RADIUS * ring / count)
    yield f'<path class="ring" d="M{x - RADIUS} {y}h{2 * RADIUS}M{x} {y - RADIUS}v{2 * RADIUS}"/>'


def _labels(edge: float) -> Iterator[str]:
    """Yield the labels of the circles and axes."""
    count = round(edge / RING)
    for ring in range(1, count + 1):
        x, y = _place(-45.0, RING * ring, edge)
        yield f'<text class="angle" x="{x + 2:.1f}" y="{y + 10:.1f}">{RING * ring:.0f}°</text>'
    x, y = CENTRE
    for words, dx, dy, anchor in (
        ("x", RADIUS + 8, 4, "start"),
        ("−x", -RADIUS - 8, 4, "end"),
        ("y", 0, -RADIUS - 7, "middle"),
        ("−y", 0, RADIUS + 15, "middle"),
    ):
        yield f'<text class="axis" x="{x + dx}" y="{y + dy}" text-anchor="{anchor}">{words}</text>'


def _least(least: GreatestTilt, edge: float) -> Iterator[str]:
    """Yield the circle of the greatest tilt in every azimuth, and a dot where it ends."""
    if not math.isnan(least.tilt):
        yield _circle("least", CENTRE, RADIUS * least.tilt / edge)
        if least.limit is not None:
            yield _circle("dot", _place(least.azimuth, least.tilt, edge), 3.0)


def _region(tilts: TiltMap, edge: float) -> Iterator[str]:
    """Yield the tilts that are possible, and their border in the colours of the limits."""
    azimuths, values = np.radians(tilts.azimuths), np.nan_to_num(tilts.tilts) * RADIUS / edge
    x, y = CENTRE[0] + values * np.cos(azimuths), CENTRE[1] - values * np.sin(azimuths)
    points = np.column_stack([x, y])
    outline = " ".join(f"{x:.1f},{y:.1f}" for x, y in points.tolist())
    yield f'<polygon class="possible" points="{outline}"/>'
    middles = 0.5 * (points + np.roll(points, -1, axis=0))
    parts = np.stack([np.roll(middles, 1, axis=0), points, middles], axis=1)
    for limit, group in itertools.groupby(range(len(points)), lambda k: tilts.limits[k]):
        path = "L".join(f"{x:.1f} {y:.1f}" for x, y in parts[[*group]].reshape(-1, 2).tolist())
        yield f'<path class="border" stroke="{css(colour_of(limit))}" d="M{path}"/>'


def torsion_strip(by_torsion: TiltByTorsion, torsion: float, tilt: float) -> str:
    """Return the tilt by torsion as SVG, with marks at the present and the best torsion.

    The best torsion is marked only where it allows a larger tilt than the present one, at which
    the greatest tilt in every azimuth is `tilt`, NaN where none is possible. Angles in degrees.
    """
    best = by_torsion.best
    largest = 0.0 if math.isnan(best.tilt) else best.tilt
    top = max(RING, _round_up(largest))
    tilts = [round(t, 1) if math.isfinite(t) else None for t in by_torsion.tilts.tolist()]
    facts = {"left": LEFT, "right": RIGHT, "tilts": tilts}
    pieces = [*_axes(top), *_area(by_torsion.torsions, tilts, top)]
    pieces.append(f'<path class="here" d="M{_across(torsion):.1f} {TOP}V{BOTTOM}"/>')
    if not math.isnan(best.tilt) and not best.tilt - tilt <= SAME_TILT:
        at = _across(math.remainder(best.torsion, 360.0)), _up(best.tilt, top)
        pieces.append(_circle("dot", at, 3.0))
    return (
        caption("Greatest tilt in every azimuth by torsion")
        + _svg("Greatest tilt by torsion", "torsions", facts, pieces, STRIP_HEIGHT)
        + reading("Click to turn the platform to a torsion.")
    )


def _across(torsion: float) -> float:
    return LEFT + (RIGHT - LEFT) * ((torsion + 180.0) / 360.0)


def _up(tilt: float, top: float) -> float:
    return BOTTOM - (BOTTOM - TOP) * tilt / top


def _axes(top: float) -> Iterator[str]:
    """Yield the frame and its labels."""
    yield f'<path class="frame" d="M{LEFT} {TOP}V{BOTTOM}H{RIGHT}V{TOP}"/>'
    for tilt in (0.0, top):
        y = _up(tilt, top) + 4.0
        yield f'<text class="angle" x="{LEFT - 5}" y="{y:.1f}" text-anchor="end">{tilt:g}°</text>'
    for tick in TICKS:
        x, words = _across(tick), f"{tick}°".replace("-", "−")
        anchor = "end" if tick == TICKS[-1] else "middle"
        place = f'x="{x:.1f}" y="{BOTTOM + 15}" text-anchor="{anchor}"'
        yield f'<text class="angle" {place}>{words}</text>'
        yield f'<path class="ring" d="M{x:.1f} {TOP}V{BOTTOM}"/>'


def _area(torsions: FloatArray, tilts: list[float | None], top: float) -> Iterator[str]:
    """Yield the tilts as an area, with a gap where no tilt is possible."""
    ends = zip([*torsions.tolist(), 180.0], [*tilts, tilts[0]], strict=True)
    for is_possible, group in itertools.groupby(ends, lambda end: end[1] is not None):
        if not is_possible:
            continue
        points = [(_across(torsion), _up(tilt or 0.0, top)) for torsion, tilt in group]
        outline = "L".join(f"{x:.1f} {y:.1f}" for x, y in points)
        first, last = points[0][0], points[-1][0]
        yield (
            f'<path class="possible" d="M{first:.1f} {BOTTOM}L{outline}L{last:.1f} {BOTTOM}Z"/>'
            f'<path class="curve" d="M{outline}"/>'
        )


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
