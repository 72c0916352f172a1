"""The moving page: one HTML file in which the mechanism of a design moves, without network.

The templates hold its look and its scripts. What is filled in here are the numbers of the design,
in millimetres and radians, its limits and their words.
"""

from __future__ import annotations

import math
from html import escape
from string import Template
from typing import Any

import msgspec
import numpy as np

from explorer import __version__
from explorer.export.controller import limit_rows, pair_rows, read_template
from explorer.legs.clearance import PAIRS, pair_name
from explorer.mechanism import rgb
from explorer.mechanism.design import JOINTS, LENGTHS, Design, Swing
from explorer.mechanism.feasible_intervals import possible_ranges
from explorer.mechanism.margins import INCIDENCES
from explorer.singularity import colours
from explorer.workspace.limits import quantities

# Of the limited quantities, in the order of `explorer.export.controller.limit_rows`: their names,
# and the legs of lengths and swings, in the drawing.
NAMES = (
    *("x of b4", "y of b4", "z of b4", "δ1", "δ2", "δ3", "d1", "d3", "|d1 − d3|", "d3 − d1"),
    *LENGTHS,
    *(f"Swing at {joint}" for joint in Swing.__struct_fields__),
)
LEGS = (*[None] * quantities.L1, *(0, 1, 2, 3), *(0, 3, 0, 1, 2, 3))
SIGNS = (quantities.DELTA1, quantities.DELTA2, quantities.DELTA3, quantities.ORDER)
# Share of its range by which a slider goes on beyond either end.
OVERRUN = 0.1


def moving_page(design: Design) -> bytes:
    """Return the page of a design as HTML."""
    # No text of a design ends the script that it stands in.
    data = msgspec.json.encode(page_data(design)).decode().replace("<", "\\u003c")
    scripts = [read_template(f"{name}.js") for name in ("kinematics", "scene", "controls")]
    fields = {
        "title": f"{escape(design.name)} – flagged 4-4 manipulator",
        "name": escape(design.name),
        "style": read_template("moving_page.css"),
        "script": "".join([*scripts, f"window.page = window.startPage({data});"]),
        "origin": f"Lengths in mm. Written by flagged-explorer {__version__}.",
    }
    return Template(read_template("moving_page.html")).substitute(fields).encode()


def page_data(design: Design) -> dict[str, Any]:
    """Return the data of a design for the page's scripts, as values of JSON."""
    unit, home, possible = design.unit_mm, design.home_pose, possible_ranges(design)
    ranges, axes, words = limit_rows(design)
    radii, pair_words = pair_rows(design)
    spans = dict(zip((*JOINTS, *"xyz"), (*possible.joints, *possible.position), strict=True))
    farthest = math.hypot(*(max(map(abs, span)) for span in possible.position))
    a3, b1 = design.a3, design.b1
    return {
        "a3": [unit * a3[0], unit * a3[1]],
        "b1": [unit * b1[0], unit * b1[1]],
        "b2": unit * design.b2,
        "b3": unit * design.b3,
        "a2x": unit * design.a2x,
        "reach": unit * design.reach,
        "warn": colours.WARN_SHARE * unit * design.reach,
        "leg_radii": [unit * radius for radius in design.limits.leg_radii],
        "home": {
            "position": (unit * np.array(home.position)).tolist(),
            "rotation": home.rotation.ravel().tolist(),
        },
        # JSON has no infinity: null is no bound.
        "limits": [
            {
                "name": name,
                "low": low if math.isfinite(low) else None,
                "high": high if math.isfinite(high) else None,
                "words": text,
                "unit": "°" if index >= quantities.ANGLE else "mm",
                "sign": index in SIGNS,
                "leg": LEGS[index],
            }
            for index, (name, (low, high), text) in enumerate(
                zip(NAMES, ranges.tolist(), words, strict=True)
            )
        ],
        "clearances": [
            {"name": f"Legs {pair_name(pair)}", "words": text}
            for pair, text in zip(PAIRS, pair_words, strict=True)
        ],
        "incidences": INCIDENCES,
        "axes": axes.tolist(),
        "radii": radii.tolist(),
        "spans": {
            name: [unit * (low - OVERRUN * (high - low)), unit * (high + OVERRUN * (high - low))]
            # Limits that contradict each other leave a range whose ends are reversed.
            for name, (low, high) in {
                **{name: sorted(span) for name, span in spans.items()},
                "r": (0.0, farthest),
            }.items()
        },
        "colours": {
            "tube": rgb.TUBE,
            "rod": rgb.ROD,
            "joint": rgb.JOINT,
            "ball": rgb.BALL,
            "base": rgb.BASE_BODY,
            "platform": rgb.PLATFORM_BODY,
            "rail": rgb.RAIL,
            "carriage": rgb.CARRIAGE,
            "leaves": rgb.LEAVES,
            "singular": colours.SINGULAR,
            "warned": colours.WARNED,
            "clear": colours.CLEAR,
            "far": colours.FAR,
            "alarm": rgb.OUTLINE,
            "margins": colours.MARGIN_COLOURS,
        },
    }
