"""The accessible workspace, for `explorer workspace`: what is left without collisions of legs."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from explorer.cli.output import (
    attributes,
    figure,
    finite,
    lengths,
    mesh_json,
    table,
)
from explorer.mechanism.design import Design
from explorer.numerics.arrays import FloatArray

if TYPE_CHECKING:
    from explorer.workspace.accessible.radii import RadiusCurve
    from explorer.workspace.accessible.workspace import AccessibleWorkspace

# The number of rows of the radius curve in a table, less one.
ROWS = 10


def interference_json(workspace: AccessibleWorkspace) -> dict[str, object]:
    """Return the accessible workspace as plain values, added to those of the workspace."""
    return {
        **attributes(workspace, "accessible_volume accessible_node_count"),
        "harmless_radius": finite(workspace.harmless_radius),
        "pairs": [
            {
                "legs": pair.legs,
                "clearance": finite(pair.clearance),
                "bound": finite(pair.bound),
                "blocked_volume": pair.blocked_volume,
            }
            for pair in workspace.pairs
        ],
        "accessible_solid": mesh_json(workspace.solid),
    }


def curve_json(curve: RadiusCurve) -> dict[str, object]:
    """Return a radius curve as plain values."""
    answer = attributes(curve, "radii volumes harmless harmless_bound")
    return {**answer, "closest": curve.closest_legs}


def curve_table(design: Design, curve: RadiusCurve, shift: FloatArray | None = None) -> str:
    """Return a radius curve at a few radii, and the largest radius without a loss.

    The place at which legs come closest is moved by `shift`, shape (3,), unless that is None.
    """
    rows = [("radius of all legs", "mm", "accessible (units³)", "share")]
    # The last radius comes twice: beyond it the volume is zero.
    last = max(0, len(curve.radii) - 2)
    for index in sorted({round(last * row / ROWS) for row in range(ROWS + 1)}):
        radius, volume = float(curve.radii[index]), float(curve.volumes[index])
        share = volume / float(curve.volumes[0]) if curve.volumes[0] > 0.0 else 0.0
        rows.append((*lengths(design, radius), figure(volume), f"{100.0 * share:.1f} %"))
    lines = [table(rows, ">>>>")]
    if curve.closest_legs is not None:
        i, j = curve.closest_legs
        at = np.array(curve.closest_position) + (0.0 if shift is None else shift)
        place = ", ".join(f"{x:.4g}" for x in at.tolist())
        if curve.harmless > 0.0:
            lines.append(f"no legs collide up to a radius of {figure(curve.harmless)}")
            lines.append(f"legs {i} and {j} come closest, at ({place})")
        else:
            lines.append(f"no radius is harmless: legs {i} and {j} touch at ({place})")
    return "\n".join(lines)
