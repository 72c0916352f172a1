"""The map of a slice of the workspace: the report's exact drawing, with axes, and the pose in it.

The worker draws the map itself; the page puts it between axes, marks b4 or the tool point, and
gives the words for what is under the pointer.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from html import escape
from typing import Literal
from xml.etree.ElementTree import Element

import msgspec
import numpy as np

from explorer.app.scene.surfaces import Colouring
from explorer.app.widgets.markup import reading
from explorer.export.drawings.markup import as_html, coordinate, element
from explorer.export.drawings.slices import Slices, cross, in_plane, map_transform, ruler
from explorer.measures.position_bands import MEASURE_WORDS, measure_positions
from explorer.mechanism.pose import Triple
from explorer.numerics.arrays import FloatArray, IntArray
from explorer.numerics.number_text import Unit, decimals_for, format_decimals, format_number
from explorer.statics.reactions import PART_NAMES
from explorer.workspace.carried_region import part_names
from explorer.workspace.solids.solid import Solid

Axis = Literal["x", "y", "z"]

AXES: tuple[Axis, ...] = ("x", "y", "z")
CUT = "cut"
"""Name of the limit whose faces lie in the plane of a cut."""

# Width and greatest height of the picture, and the space around the map, in pixels.
WIDTH, MOST_HEIGHT = 316.0, 236.0
LEFT, RIGHT, TOP, BOTTOM = 42.0, 10.0, 8.0, 36.0
# Digits of a coordinate of the size of the reach.
DIGITS = 4
# Decimals of 1 / cond J.
CONDITION_DECIMALS = 5
HINT = "Point at the map to read it, click to go there."
# Distance up to which the point counts as in the slice, over the reach.
IN_SLICE = 1e-3


@dataclass(frozen=True)
class SliceMap:
    """The map of a slice across an axis, without its axes; lengths in design units.

    Attributes:
        lows, highs: Ends of the map on the two other axes.
        own_scale: The map's own points per design unit.
        markup: The map as SVG, from its lows, y upwards.
        left_out: Words for positions within the limits beyond the part that is drawn.
        offset: Vector from b4 to the point of which the map is, shape (3,).
    """

    axis: Axis
    level: float
    lows: tuple[float, float]
    highs: tuple[float, float]
    own_scale: float
    markup: str
    left_out: str
    colouring: Colouring
    offset: FloatArray

    def shift(self, offset: FloatArray) -> SliceMap:
        """Return the map of positions moved by a vector in design units, shape (3,)."""
        across, (first, second) = AXES.index(self.axis), in_plane(self.axis)
        du, dv, dw = offset[[first, second, across]].tolist()
        (u0, v0), (u1, v1) = self.lows, self.highs
        lows, highs = (u0 + du, v0 + dv), (u1 + du, v1 + dv)
        return replace(self, level=self.level + dw, lows=lows, highs=highs, offset=offset)

    def words_at(self, point: Triple, unit: Unit) -> str:
        """Return the coordinates of a position on the map and the measure there, in a unit."""
        workspace, measure, f = self.colouring.workspace, self.colouring.banded, unit.factor
        decimals = decimals_for(f * workspace.design.reach, DIGITS)
        at = ", ".join(
            f"{AXES[k]} {format_decimals(f * point[k], decimals)}" for k in in_plane(self.axis)
        )
        positions = (np.array(point) - self.offset)[None]
        values, found = measure_positions(workspace, measure, positions, self.colouring.load)
        value, index = float(values[0]), int(found[0])
        match measure:
            case "margin":
                words = f"min |δ| {format_decimals(f * value, decimals)} (δ{index + 1})"
            case "condition":
                words = f"1 / cond J {format_decimals(value, CONDITION_DECIMALS)}"
            case _:
                name, symbol, factor = MEASURE_WORDS[measure]
                words = f"{name} {format_number(factor * value, 3, infinite='∞')} {symbol}"
                parts = {
                    "share": part_names(workspace.design),
                    "force": PART_NAMES,
                    "bending": PART_NAMES,
                }
                if measure in parts and 0.0 < value < math.inf:
                    words += f" ({parts[measure][index]})"
        return f"{at} {unit.name}: {words}"


def level_within(low: float, high: float, level: float | None) -> float:
    """Return the level of a cut: the one given if it is within the extent, else the middle."""
    return level if level is not None and low <= level <= high else 0.5 * (low + high)


def keeps_above(axis: Axis, flipped: bool) -> bool:
    """Whether a cut keeps what lies above its level.

    The half that faces the isometric camera is cut away, or kept if the cut is flipped.
    """
    return (axis == "y") != flipped


def slice_map(
    colouring: Colouring,
    extent: tuple[FloatArray, FloatArray],
    axis: Axis,
    level: float,
    whole: Solid | None,
    part: Solid | None,
    left_out: str,
) -> SliceMap:
    """Return the map of a slice through a workspace that is not empty.

    The extent is that of the workspace within the limits. Where only a part of it is drawn, the
    cut solids of the whole and of the part are given, with words for what is left out of it.
    """
    slices = Slices.of(colouring.workspace, extent, colouring.bands)
    first, second = in_plane(axis)
    loops: list[FloatArray] = []
    if whole is not None and part is not None:
        # By the even-odd rule, the one without the other.
        loops = [loop for solid in (whole, part) for loop in cut_loops(solid, (first, second))]
    drawn = slices.map(axis, level, "workspace-slice", loops)
    (u0, v0), (u1, v1) = (ends[[first, second]].tolist() for ends in (slices.lows, slices.highs))
    scale, markup = slices.own_scale, as_html(drawn)
    ends = (u0, v0), (u1, v1)
    return SliceMap(axis, level, *ends, scale, markup, left_out, colouring, np.zeros(3))


def cut_loops(solid: Solid, axes: tuple[int, int]) -> list[FloatArray]:
    """Return the polygons around the faces with the limit `CUT` in a plane of two axes, (n, 2)."""
    if CUT not in solid.limits:
        return []
    faces: IntArray = solid.faces[solid.limit_of_face == solid.limits.index(CUT)].astype(np.int64)
    sides = {
        (a, b) for face in faces.tolist() for a, b in zip(face, (*face[1:], face[0]), strict=True)
    }
    # A side between two faces of the cut runs both ways.
    following: dict[int, list[int]] = {}
    for a, b in sides:
        if (b, a) not in sides:
            following.setdefault(a, []).append(b)
    loops: list[FloatArray] = []
    while following:
        chain = [next(iter(following))]
        while chain[-1] in following:
            after = following[chain[-1]]
            chain.append(after.pop())
            if not after:
                del following[chain[-2]]
        loops.append(solid.vertices[chain][:, axes])
    return loops


def map_picture(mapped: SliceMap, position: Triple, reach: float, unit: Unit) -> str:
    """Return the map between its axes as SVG, with the present position of its point as a cross."""
    (u0, v0), (u1, v1), f = mapped.lows, mapped.highs, unit.factor
    first, second = in_plane(mapped.axis)
    scale = min((WIDTH - LEFT - RIGHT) / (u1 - u0), (MOST_HEIGHT - TOP - BOTTOM) / (v1 - v0))
    height = TOP + BOTTOM + scale * (v1 - v0)
    left, bottom = LEFT, height - BOTTOM
    u, v = position[first], position[second]
    pieces: list[Element] = []
    if u0 <= u <= u1 and v0 <= v <= v1:
        off = abs(position[AXES.index(mapped.axis)] - mapped.level)
        # Beside the slice it is projected to it, and drawn faint.
        look = "ex-here" if off <= IN_SLICE * reach else "ex-here is-off"
        pieces.append(
            element("g", *cross(left + scale * (u - u0), bottom - scale * (v - v0)), class_=look)
        )
    pieces += [
        ruler(
            f"{AXES[first]} ({unit.name})",
            (f * u0, f * u1),
            left,
            scale / f,
            across=bottom,
            up=False,
        ),
        ruler(AXES[second], (f * v0, f * v1), bottom, scale / f, across=left, up=True),
    ]
    facts = {
        "name": "workspace",
        "axis": AXES.index(mapped.axis),
        "level": mapped.level,
        "lows": mapped.lows,
        "highs": mapped.highs,
        "place": (left, bottom, scale),
        "decimals": decimals_for(reach, DIGITS),
        "leftOut": mapped.left_out,
        # Another number if the measure may be another one anywhere: then the page asks again.
        "measure": hash(repr(mapped.colouring)),
    }
    wide, high = scale * (u1 - u0), scale * (v1 - v0)
    frame = element("rect", x=left, y=bottom - high, width=wide, height=high, class_="frame")
    size = map_transform(scale / mapped.own_scale, left, bottom)
    words = f"Map of the slice at {mapped.axis} = {unit.text(mapped.level)}"
    return (
        f'<svg class="ex-map" viewBox="0 0 {coordinate(WIDTH)} {coordinate(height)}" role="img" '
        f'aria-label="{words}" data-map="{escape(msgspec.json.encode(facts).decode())}">'
        f'{as_html(frame)}<g transform="{size}" data-within="">{mapped.markup}</g>'
        f"{''.join(map(as_html, pieces))}</svg>" + reading(HINT)
    )
