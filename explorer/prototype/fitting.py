"""Sizes of parts that fit a design, and what to change in a design that has no room for them.

Joints scale with the legs; walls and clearances do not. A leg may be too thin to hold a rod in
its cylinder, or too thick beside its neighbours. A larger unit helps in both cases.
"""

from __future__ import annotations

import math

import msgspec
import numpy as np

from explorer.errors import InputError
from explorer.mechanism.design import Design
from explorer.mechanism.home import home_pose
from explorer.numerics.arrays import FloatArray
from explorer.prototype.chains import LEGS
from explorer.prototype.joint_limits import broken_joint_limits
from explorer.prototype.sizes import Sizes

THICKEST_SHARE = 0.012
"""Largest radius, over the reach, of a leg that has none in the design."""

LARGEST_FACTOR = 1e4
"""Largest factor on the unit that is tried to make a design fit."""


def sizes_of(design: Design) -> Sizes:
    """Return the sizes of a design's parts.

    Legs without a radius in the design get the largest that fits, up to a share of the reach.

    Raises:
        InputError: the design is too tight for its parts, or its home breaks the limits of a
            leg; the message names the parts, their distance and what would fit.
    """
    design = msgspec.structs.replace(design, home=home_pose(design))
    share = 1.0 if all(design.limits.leg_radii) else _thicker(design, 1.0)[0]
    found = _sizes(design, 1.0, share or 1.0)
    if found.worst is not None:
        raise InputError(_refusal(design, found.worst))
    for leg in LEGS:
        low, high = found.asked(leg)
        # At home a pose on a limit is within it, whatever its last bits say.
        if not low * (1.0 - 1e-9) <= found.at_home(leg) <= high * (1.0 + 1e-9):
            raise InputError(
                f"leg {leg} is {found.at_home(leg):.4g} mm long at home, but its limits are "
                f"{low:.4g} to {high:.4g} mm; choose another home"
            )
    home = home_pose(design)
    for problem in broken_joint_limits(found, home.position, home.rotation):
        raise InputError(f"at home {problem}; choose another home")
    return found


def _sizes(design: Design, unit: float, share: float, all_of: bool = False) -> Sizes:
    """Return sizes with a scaled unit and scaled radii.

    Args:
        design: The manipulator.
        unit: Factor on its unit.
        share: Factor on the radii that the design leaves open.
        all_of: Whether `share` also scales the radii that the design gives.
    """
    larger = msgspec.structs.replace(design, unit_mm=unit * design.unit_mm)
    open_radius = THICKEST_SHARE * design.reach * share
    factor = share if all_of else 1.0
    radii = (factor * radius or open_radius for radius in design.limits.leg_radii)
    return Sizes(larger, tuple(radius * larger.unit_mm for radius in radii))


def _thicker(
    design: Design, unit: float, all_of: bool = False
) -> tuple[float | None, float | None]:
    """Return the largest factor up to 1 on the radii that fits, and the smallest from 1 on."""

    def first(shares: FloatArray) -> float | None:
        for share in shares.tolist():
            if _sizes(design, unit, share, all_of).worst is None:
                return share
        return None

    # Thin legs lack room for walls, thick ones beside each other: what fits is one interval.
    return first(np.geomspace(1.0, 1e-2, 100)), first(np.geomspace(1.0, 1e2, 100))


def _refusal(design: Design, worst: tuple[str, float, float]) -> str:
    parts, apart, needed = worst
    if parts.startswith("the radius"):
        text = f"too thin: {parts} is {_mm(apart)} and must be at least {_mm(needed)}"
    else:
        text = f"too tight for the parts: {parts} are {_mm(apart)} apart and need {_mm(needed)}"
    ways: list[str] = []
    unit = _least_unit(design)
    if unit is not None:
        ways.append(f"with a unit of at least {_rounded(unit * design.unit_mm, up=True)} mm")
    given = max(design.limits.leg_radii)
    smaller, larger = _thicker(design, 1.0, all_of=True) if given else (None, None)
    if smaller is not None:
        ways.append(f"with legs of radius at most {_rounded(smaller * given, up=False)}")
    elif larger is not None:
        ways.append(f"with legs of radius at least {_rounded(larger * given, up=True)}")
    if not ways:
        return (
            f"{text}; no unit makes that fit: take thinner legs, another home, or points that "
            "are farther apart"
        )
    return f"{text}; it fits {' or '.join(ways)}"


def _least_unit(design: Design) -> float | None:
    """Return the least factor on the unit with which everything fits, None if there is none."""
    share: float | None = 1.0
    if not all(design.limits.leg_radii):
        # With a huge unit clearances vanish, so open radii are at their largest.
        share = _thicker(design, LARGEST_FACTOR)[0]

    def fits(factor: float) -> bool:
        return share is not None and _sizes(design, factor, share).worst is None

    low, high = 1.0, LARGEST_FACTOR
    if not fits(high):
        return None
    while high > 1.001 * low:
        middle = math.sqrt(low * high)
        low, high = (low, middle) if fits(middle) else (middle, high)
    return high


def _mm(value: float) -> str:
    return f"{value:.3g} mm"


def _rounded(value: float, up: bool) -> str:
    """Return a value to three digits, rounded up or down."""
    step = 10.0 ** (math.floor(math.log10(value)) - 2)
    whole = math.ceil(value / step) if up else math.floor(value / step)
    return f"{whole * step:.6g}"
