"""The greatest tilt in every azimuth by torsion, as SVG."""

from __future__ import annotations

import itertools
import math
from collections.abc import Iterator
from html import escape

import msgspec

from explorer.app.features.orientation.polar_map import RING
from explorer.app.widgets.markup import caption, reading
from explorer.numerics.arrays import FloatArray
from explorer.workspace.orientations.torsions import TiltByTorsion

WIDTH, HEIGHT = 316.0, 96.0
LEFT, RIGHT, TOP, BOTTOM = 34.0, 306.0, 8.0, 72.0
TICKS = (-180, -90, 0, 90, 180)
HINT = "Click to turn the platform to a torsion."


# Difference of tilts in degrees that is not told.
SAME_TILT = 0.05


def tilt_at(found: TiltByTorsion, torsion: float) -> float:
    """Return the tilt at a torsion between those of the row; NaN where no tilt is possible."""
    count = len(found.tilts)
    # Without full turns first, since a torsion may be as large as any number.
    turned = math.remainder(torsion, 360.0) - float(found.torsions[0])
    place = turned * count / 360.0 % count
    left, share = int(place), place % 1.0
    tilts = found.tilts.tolist()
    return (1.0 - share) * tilts[left % count] + share * tilts[(left + 1) % count]


def torsion_strip(found: TiltByTorsion, torsion: float, tilt: float) -> str:
    """Return the tilt by torsion as SVG, with marks at the present and the best torsion.

    The best torsion is marked only where it allows a larger tilt than the present one.

    Args:
        found: Greatest tilts by torsion.
        torsion: The present torsion, in degrees.
        tilt: The greatest tilt in every azimuth there, in degrees; NaN where none is possible.
    """
    largest = 0.0 if math.isnan(found.best.tilt) else found.best.tilt
    top = max(RING, RING * math.ceil(largest / RING - 1e-9))
    tilts = [round(t, 1) if math.isfinite(t) else None for t in found.tilts.tolist()]
    facts = {"left": LEFT, "right": RIGHT, "tilts": tilts}
    pieces = [*_axes(top), *_area(found.torsions, tilts, top)]
    x = _across(torsion)
    pieces.append(f'<path class="here" d="M{x:.1f} {TOP}V{BOTTOM}"/>')
    if not math.isnan(found.best.tilt) and not found.best.tilt - tilt <= SAME_TILT:
        x, y = _across(math.remainder(found.best.torsion, 360.0)), _up(found.best.tilt, top)
        pieces.append(f'<circle class="dot" cx="{x:.1f}" cy="{y:.1f}" r="3"/>')
    return (
        caption("Greatest tilt in every azimuth by torsion")
        + f'<svg class="ex-map ex-tilts" viewBox="0 0 {WIDTH:g} {HEIGHT:g}" role="img" '
        'aria-label="Greatest tilt by torsion" '
        f'data-torsions="{escape(msgspec.json.encode(facts).decode())}">{"".join(pieces)}</svg>'
        + reading(HINT)
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
        yield (
            f'<text class="angle" x="{x:.1f}" y="{BOTTOM + 15}" text-anchor="{anchor}">'
            f"{words}</text>"
        )
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
