"""The moving page: one HTML file in which the mechanism of a design moves, without network.

The templates hold its look and its scripts, which read a design as its file and a link have it.
"""

from __future__ import annotations

from html import escape
from typing import Any

import msgspec

from explorer import __version__
from explorer.export.controller import fill_template, read_template
from explorer.files.fragments import SCHEMA, sparse
from explorer.mechanism import rgb
from explorer.mechanism.design import LENGTHS, TOLERANCE, Design, Swing
from explorer.mechanism.design_file import PRESETS
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


def moving_page(design: Design) -> bytes:
    """Return the page of a design as HTML; in place of it, it shows that of a link."""
    # No text of a design ends the script that it stands in.
    data = msgspec.json.encode(page_data(design)).decode().replace("<", "\\u003c")
    scripts = [_read_short(f"{name}.js") for name in ("kinematics", "link", "scene", "controls")]
    fields = {
        "title": f"{escape(design.name)} – flagged 4-4 manipulator",
        "name": escape(design.name),
        "style": _read_short("moving_page.css"),
        "script": "\n".join([*scripts, f"window.openPage({data}, location.hash.slice(1));"]),
        "origin": f"Lengths in mm. Written by flagged-explorer {__version__}.",
    }
    return fill_template("moving_page.html", fields)


def _read_short(file: str) -> str:
    """Return the text of a template without indentation and lines of comments."""
    lines = map(str.strip, read_template(file).splitlines())
    return "\n".join(line for line in lines if line and not line.startswith("//"))


def page_data(design: Design) -> dict[str, Any]:
    """Return the data of a design, and of all, for the page's scripts, as values of JSON."""
    standard = Design(a3=(0.0, 1.0), b1=(0.0, 1.0), b2=0.0, b3=1.0)
    common = {
        "defaults": {
            name: msgspec.to_builtins(getattr(standard, name))
            for name in ("name", "unit_mm", "limits")
        },
        "tolerance": TOLERANCE,
        "digits": quantities.DIGITS,
        "warn": colours.WARN_SHARE,
        "limits": [
            {
                "name": name,
                "unit": "°" if index >= quantities.ANGLE else "mm",
                "sign": index in SIGNS,
                "leg": LEGS[index],
            }
            for index, name in enumerate(NAMES)
        ],
        "incidences": INCIDENCES,
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
    presets = {name: _link_to(preset) for name, preset in PRESETS.items()}
    return {"own": _link_to(design), "presets": presets, "schema": SCHEMA, "common": common}


def _link_to(design: Design) -> dict[str, Any]:
    """Return what a link holds of a design in its home pose."""
    return {"design": sparse(design), "home": sparse(design.home_pose)}
