"""The colours of the margins: legible, and distinct in every common colour-vision deficiency."""

from __future__ import annotations

import itertools

import numpy as np
import pytest

from explorer.app.features.orientation.maps import COLOURS, FREE, OTHER
from explorer.app.scene.shapes import COMPARED
from explorer.mechanism.rgb import OUTLINE, Rgb
from explorer.numerics.arrays import FloatArray
from explorer.singularity.colours import FAR_WARNINGS, MARGIN_COLOURS, margin_text, proximity_colour

LIGHT, DARK = (255, 255, 255), (36, 36, 36)
"""Background of light panels and of dark ones."""

# Colours seen with all cones, and without those for long, middle or short waves (Machado,
# Oliveira and Fernandes 2009).
VISIONS = (
    np.eye(3),
    np.array([[0.152, 1.053, -0.205], [0.115, 0.786, 0.099], [-0.004, -0.048, 1.052]]),
    np.array([[0.367, 0.861, -0.228], [0.280, 0.673, 0.047], [-0.012, 0.043, 0.969]]),
    np.array([[1.256, -0.077, -0.179], [-0.078, 0.931, 0.148], [0.005, 0.691, 0.304]]),
)
# Ottosson's OKLab (2020), in which equal differences look equal.
TO_CONES = np.array(
    [[0.41222, 0.53633, 0.05145], [0.21190, 0.68070, 0.10740], [0.08830, 0.28172, 0.62998]]
)
TO_LAB = np.array(
    [[0.21045, 0.79362, -0.00407], [1.97800, -2.42859, 0.45059], [0.02590, 0.78277, -0.80868]]
)


def linear(colour: Rgb) -> FloatArray:
    share = np.array(colour) / 255.0
    return np.where(share <= 0.04045, share / 12.92, ((share + 0.055) / 1.055) ** 2.4)


def contrast(a: Rgb, b: Rgb) -> float:
    """Return the contrast of two colours by WCAG 2, 1 to 21."""
    light, dark = sorted(
        (float(linear(c) @ [0.2126, 0.7152, 0.0722]) for c in (a, b)), reverse=True
    )
    return (light + 0.05) / (dark + 0.05)


def difference(a: Rgb, b: Rgb, vision: FloatArray) -> float:
    """Return the difference of two colours in OKLab; black and white differ by 1."""

    def lab(colour: Rgb) -> FloatArray:
        return TO_LAB @ np.cbrt(np.clip(TO_CONES @ np.clip(vision @ linear(colour), 0, 1), 0, 1))

    return float(np.linalg.norm(lab(a) - lab(b)))


@pytest.mark.parametrize("incidence", [1, 2, 3])
def test_names_of_margins_are_legible_on_light_and_dark_pages(incidence: int) -> None:
    on_light, on_dark = margin_text(incidence)
    assert contrast(on_light, LIGHT) >= 4.5
    assert contrast(on_dark, DARK) >= 4.5
    for background in (LIGHT, DARK):
        assert contrast(MARGIN_COLOURS[incidence - 1], background) >= 3.0


@pytest.mark.parametrize("vision", VISIONS)
def test_margins_are_told_apart_in_every_common_vision(vision: FloatArray) -> None:
    for a, b in itertools.combinations(MARGIN_COLOURS, 2):
        assert difference(a, b, vision) > 0.1


@pytest.mark.parametrize("vision", VISIONS)
def test_margins_are_told_from_danger_and_from_compared_designs(vision: FloatArray) -> None:
    danger = [proximity_colour(level) for level in np.linspace(0.0, FAR_WARNINGS, 60)]
    for colour in MARGIN_COLOURS:
        assert min(difference(colour, other, vision) for other in danger) > 0.05
        assert min(difference(colour, other, vision) for other in (*COMPARED, OUTLINE)) > 0.04


@pytest.mark.parametrize("vision", VISIONS)
def test_limits_that_end_tilts_are_told_apart_in_every_common_vision(vision: FloatArray) -> None:
    for a, b in itertools.combinations((*COLOURS.values(), OTHER, FREE), 2):
        assert difference(a, b, vision) > 0.07
