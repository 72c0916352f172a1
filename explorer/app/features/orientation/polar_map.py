"""The polar map of the tilts that a position can have, as SVG, with the limit that ends each."""

from __future__ import annotations

import itertools
import math
from collections import Counter
from collections.abc import Iterator
from html import escape

import msgspec

from explorer.app.widgets.colours import MARGIN_COLOURS, Rgb, css
from explorer.app.widgets.markup import reading, row, swatch, table
from explorer.mechanism.tilt_torsion import TiltTorsion
from explorer.workspace.orientations.tilts import GreatestTilt, TiltMap

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
    "margin δ1": MARGIN_COLOURS[0],
    "margin δ2": MARGIN_COLOURS[1],
    "margin δ3": MARGIN_COLOURS[2],
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


def colour_of(limit: str | None) -> Rgb:
    """Return the colour of a limit; None for no limit."""
    if limit is None:
        return FREE
    named = (colour for name, colour in COLOURS.items() if limit.startswith(name))
    return next(named, OTHER)


def edge_of(tilts: TiltMap, here: TiltTorsion, home: TiltTorsion) -> float:
    """Return the tilt at the edge of the map, in degrees."""
    finite = [tilt for tilt in tilts.tilts.tolist() if math.isfinite(tilt)]
    largest = max([LEAST_EDGE, here.tilt, home.tilt, *finite])
    return min(180.0, RING * math.ceil(largest / RING - 1e-9))


def polar_map(tilts: TiltMap, least: GreatestTilt, here: TiltTorsion, home: TiltTorsion) -> str:
    """Return the map as SVG: azimuth as the direction, tilt as the distance from the centre.

    Args:
        tilts: Greatest tilts in azimuths at equal distances.
        least: The greatest tilt in every azimuth, at the same torsion.
        here: The present orientation.
        home: The orientation of home.
    """
    edge = edge_of(tilts, here, home)
    facts = {"centre": CENTRE, "radius": RADIUS, "edge": edge}
    pieces = [*_rings(edge), *_region(tilts, edge), *_least(least, edge), *_labels(edge)]
    is_other = abs(math.remainder(home.torsion - here.torsion, 360.0)) > SAME_TORSION
    look = "home is-other" if is_other else "home"
    x, y = _place(home.azimuth, home.tilt, edge)
    pieces.append(f'<circle class="{look}" cx="{x:.1f}" cy="{y:.1f}" r="5"/>')
    x, y = _place(here.azimuth, here.tilt, edge)
    arms = f"M{x - 6:.1f} {y:.1f}h12M{x:.1f} {y - 6:.1f}v12"
    pieces.append(f'<path class="cross casing" d="{arms}"/><path class="cross" d="{arms}"/>')
    return (
        f'<svg class="ex-map ex-tilts" viewBox="0 0 {WIDTH:g} {HEIGHT:g}" role="img" '
        'aria-label="Greatest tilt by azimuth" '
        f'data-tilts="{escape(msgspec.json.encode(facts).decode())}">{"".join(pieces)}</svg>'
        f'<div class="ex-dim">{KEY_OF_OTHER if is_other else KEY}</div>' + reading(HINT)
    )


KEY = "+ present orientation, ○ home"
KEY_OF_OTHER = f"{KEY}, at another torsion"
HINT = "Point at the map to read it, click to tilt there."


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
        radius = RADIUS * ring / count
        look = "frame" if ring == count else "ring"
        yield f'<circle class="{look}" cx="{x}" cy="{y}" r="{radius:.1f}"/>'
    yield f'<path class="ring" d="M{x - RADIUS} {y}h{2 * RADIUS}M{x} {y - RADIUS}v{2 * RADIUS}"/>'


def _labels(edge: float) -> Iterator[str]:
    """Yield the labels of the circles and axes."""
    x, y = CENTRE
    count = round(edge / RING)
    for ring in range(1, count + 1):
        at = RADIUS * ring / count * math.sqrt(0.5)
        yield (
            f'<text class="angle" x="{x + at + 2:.1f}" y="{y + at + 10:.1f}">'
            f"{RING * ring:.0f}°</text>"
        )
    for words, dx, dy, anchor in (
        ("x", RADIUS + 8, 4, "start"),
        ("−x", -RADIUS - 8, 4, "end"),
        ("y", 0, -RADIUS - 7, "middle"),
        ("−y", 0, RADIUS + 15, "middle"),
    ):
        yield f'<text class="axis" x="{x + dx}" y="{y + dy}" text-anchor="{anchor}">{words}</text>'


def _least(least: GreatestTilt, edge: float) -> Iterator[str]:
    """Yield the circle of the greatest tilt in every azimuth, and a dot where it ends."""
    if math.isnan(least.tilt):
        return
    x, y = CENTRE
    yield f'<circle class="least" cx="{x}" cy="{y}" r="{RADIUS * least.tilt / edge:.1f}"/>'
    if least.limit is not None:
        x, y = _place(least.azimuth, least.tilt, edge)
        yield f'<circle class="dot" cx="{x:.1f}" cy="{y:.1f}" r="3"/>'


def _region(tilts: TiltMap, edge: float) -> Iterator[str]:
    """Yield the tilts that are possible, and their border in the colours of the limits."""
    values = [t if math.isfinite(t) else 0.0 for t in tilts.tilts.tolist()]
    points = [_place(a, t, edge) for a, t in zip(tilts.azimuths.tolist(), values, strict=True)]
    outline = " ".join(f"{x:.1f},{y:.1f}" for x, y in points)
    yield f'<polygon class="possible" points="{outline}"/>'
    middles = [
        (0.5 * (x + u), 0.5 * (y + v))
        for (x, y), (u, v) in zip(points, [*points[1:], points[0]], strict=True)
    ]
    for limit, group in itertools.groupby(range(len(points)), lambda k: tilts.limits[k]):
        part = [at for k in group for at in (middles[k - 1], points[k], middles[k])]
        path = "L".join(f"{x:.1f} {y:.1f}" for x, y in part)
        yield f'<path class="border" stroke="{css(colour_of(limit))}" d="M{path}"/>'
