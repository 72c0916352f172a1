"""The controls of the tolerances of the 23 geometric dimensions."""

from __future__ import annotations

import msgspec

from explorer.app.inputs.bindings import Bound
from explorer.app.inputs.controls import Controls
from explorer.app.state.action import Action
from explorer.app.state.actions import Set
from explorer.app.state.frame import Frame
from explorer.app.state.state import State
from explorer.mechanism.machine import Tolerances
from explorer.numerics.number_text import format_number

# Fields of lengths, each with the words for its hint.
LENGTHS = {
    "a1": "the base joint of leg 1, along the axes of the base",
    "a3": "the base joint of leg 4, along the axes of the base",
    "guide": "the guide's offset, along the axes of the base",
    "b1": "b1, along the axes of the platform",
    "b2": "b2, along the axes of the platform",
    "b3": "b3, along the axes of the platform",
    "b4": "b4, along the axes of the platform",
}
EVERY_LENGTH, BOTH_TILTS = "Every length (± mm)", "Both tilts (± °)"
TILTS = "guide_tilt_deg"
STEP = 0.001


def add_tolerances(controls: Controls) -> None:
    """Add the controls: one number for all lengths, one for both tilts, and each by itself."""
    controls.number(
        EVERY_LENGTH,
        "Tolerance of all 21 lengths below; the field shows the largest of them.",
        Bound(_largest_length, _set_lengths),
        least=0.0,
        step=STEP,
        small=True,
    )
    controls.number(
        BOTH_TILTS,
        "Tolerance of both tilts of the guide through a1; the field shows the larger one.",
        Bound(
            lambda frame: max(frame.state.design.tolerances.guide_tilt_deg),
            lambda _, value: Set(
                f"design.tolerances.{TILTS}", (value, value), BOTH_TILTS, format_number(value, 6)
            ),
        ),
        least=0.0,
        step=STEP,
        small=True,
    )
    for name, meaning in LENGTHS.items():
        controls.triple(
            f"{name} (± mm)",
            f"Tolerance of {meaning}.",
            f"design.tolerances.{name}",
            step=STEP,
            small=True,
        )
    for index, axis in enumerate("yz"):
        controls.number(
            f"guide tilt {axis} (± °)",
            f"Tolerance of the guide's turn about {axis} through a1.",
            f"design.tolerances.{TILTS}.{index}",
            least=0.0,
            step=STEP,
            small=True,
        )


def _largest_length(frame: Frame) -> float:
    tolerances = frame.state.design.tolerances
    return max(value for name in LENGTHS for value in getattr(tolerances, name))


def _set_lengths(state: State, value: float) -> Action:
    lengths = dict.fromkeys(LENGTHS, (value, value, value))
    tolerances: Tolerances = msgspec.structs.replace(state.design.tolerances, **lengths)
    return Set("design.tolerances", tolerances, EVERY_LENGTH, format_number(value, 6))
