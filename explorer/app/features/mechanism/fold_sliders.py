"""The sliders of the folds: their ends are walls of the assembly mode, where the pose is singular.

A track has the colours of the margins that its coordinate changes, the least of them, while the
other five coordinates stay.
"""

from __future__ import annotations

import math

from explorer.app.inputs.bindings import Bound
from explorer.app.inputs.controls import Controls
from explorer.app.inputs.ranges import length_span
from explorer.app.inputs.tracks import Span
from explorer.app.state.folds import FIRST_FOLD, HALF_TURN, SetFold
from explorer.app.state.frame import Frame
from explorer.app.state.state import State
from explorer.app.widgets.colours import FAR_WARNINGS, css, proximity_colour
from explorer.mechanism.folds import FOLDS
from explorer.mechanism.margins import signs_of

HINTS = (
    "The distance of a1 and b4. All three margins grow with it.",
    "The angle at a1 between the guide and the line a1b4. At 0 and 180° δ2 and δ3 are zero.",
    "The angle between the vector a1b4 and the platform's x. At 0 and 180° δ1 and δ2 are zero.",
    "The fold at the line b2b3. It changes δ1 alone, which is zero at both ends.",
    "The fold at the line a1b4. It changes δ2 alone, which is zero at both ends.",
    "The fold at the guide. It changes δ3 alone, which is zero at both ends.",
)
FACTORS = ((0, 2, 3), (0, 1, 2, 4), (0, 1, 5))
"""The coordinates of which each margin is the product: r itself, and the sines of the others."""

STEP = 0.1
# Levels at which the colours of a track change, just below the warning value and at it.
LEVELS = (0.0, math.nextafter(1.0, 0.0), 1.0, FAR_WARNINGS)
# Level of a track on which the pose is singular everywhere.
LEAST_LEVEL = 1e-9


def add_fold_sliders(controls: Controls) -> None:
    """Add a slider for each of the six coordinates, visible while these are chosen."""
    for index in range(len(FOLDS)):
        _add_slider(controls, index)


def _add_slider(controls: Controls, index: int) -> None:
    name = FOLDS[index]
    controls.slider(
        name if index == 0 else f"{name} (°)",
        HINTS[index],
        Bound(lambda frame: frame.folds[index], lambda _, value: SetFold(index, value)),
        lambda state: fold_span(state, index),
        visible=lambda state: state.view.coordinates == "folds",
        coloured=lambda frame, span: colour_stops(frame, index, span),
    )


def fold_span(state: State, index: int) -> Span:
    """Return the range of a coordinate of the folds in the present assembly mode."""
    if index == 0:
        return length_span(state)
    if index < FIRST_FOLD:
        return Span(0.0, HALF_TURN, STEP)
    is_positive = signs_of(state.mode)[index - FIRST_FOLD] > 0
    return Span(0.0, HALF_TURN, STEP) if is_positive else Span(-HALF_TURN, 0.0, STEP)


def colour_stops(frame: Frame, index: int, span: Span) -> str:
    """Return the colours along the track of a coordinate, as stops of a CSS gradient.

    Args:
        frame: The frame that is shown.
        index: Index of the coordinate in `FOLDS`.
        span: Range of the track.
    """
    r, *angles = frame.folds
    factors = (r, *(abs(math.sin(math.radians(angle))) for angle in angles))
    # The largest value of a margin along the track: that where its own factor is r's end, or 1.
    largest = span.high if index == 0 else 1.0
    peak = min(
        largest * math.prod(factors[each] for each in margin if each != index)
        for margin in FACTORS
        if index in margin
    )
    peak = max(peak / frame.state.warn_below, LEAST_LEVEL)
    levels = [*(level for level in LEVELS if level < peak), peak]
    shares = [level / peak for level in levels]
    if index > 0:
        # Along half the track a sine rises to its peak.
        shares = [math.asin(share) / math.pi for share in shares]
    colours = [css(proximity_colour(level)) for level in levels]
    stops = list(zip(colours, shares, strict=True))
    if index > 0:
        stops += [(colour, 1.0 - share) for colour, share in reversed(stops[:-1])]
    return ",".join(f"{colour} {100.0 * share:.1f}%" for colour, share in stops)
