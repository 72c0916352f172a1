"""The ellipsoid of the tool's error, and the mechanism as the load deflects it."""

from __future__ import annotations

import math

import numpy as np

from explorer.app.features.feature import Services, show
from explorer.app.features.loads.load import Loads
from explorer.app.features.loads.scene import tool_point
from explorer.app.features.mechanism.bodies import platform_plate
from explorer.app.scene import shapes
from explorer.app.scene.ellipsoid import EllipsoidNode
from explorer.app.scene.placing import Placed, ScenePart, round_step
from explorer.measures.blocks.precision import DIGITS
from explorer.mechanism.rgb import Rgb
from explorer.numerics.arrays import FloatArray
from explorer.numerics.number_text import format_number
from explorer.page.widgets.assigning import Updates
from explorer.statics.compliance import is_elastic
from explorer.statics.loaded import ToolPrecision

ERROR: Rgb = (176, 60, 120)
DEFLECTED: Rgb = (222, 110, 20)
PLATE_OPACITY = 0.7
# Sizes over the reach that an automatic magnification gives the longest semi-axis and the largest
# displacement, and the shortest semi-axis that is drawn as a share of the longest.
ELLIPSOID_SIZE, DEFLECTION_SIZE, THINNEST = 0.18, 0.25, 0.01
# Pieces of a drawn strut, and its radius in scene units.
PIECES, RADIUS = 12, 0.1
# Displacements along a strut over that of its tip. Along x it is a cantilever with a force at its
# tip: (3 u² − u³) / 2 at the share u of its length.
U = np.linspace(0.0, 1.0, PIECES + 1)
ALONG = np.stack([0.5 * (3.0 * U**2 - U**3), U, U], axis=1)
# Largest automatic magnification, and largest drawn displacement over the reach.
LARGEST_TIMES, FARTHEST = 1e12, 5.0


class ErrorEllipsoidScene(ScenePart):
    """The ellipsoid of the tool's RMS displacement by all sources of errors."""

    def __init__(self, services: Services) -> None:
        self._loads = services.get(Loads)
        self._ellipsoid = EllipsoidNode(services.scene, "/precision/ellipsoid")

    def updates(self, placed: Placed) -> Updates:
        """Yield the updates that draw the ellipsoid of this frame."""
        precision = self._loads.precision(placed.frame)
        shown = (
            placed.frame.state.view.precision.ellipsoid
            and not placed.is_apart
            and precision.has_errors
            and precision.is_regular
        )
        longest = float(precision.ellipsoid.semi_axes[0]) if shown else 0.0
        yield from self._ellipsoid.show(longest > 0.0)
        if not longest > 0.0:
            return
        ellipsoid, design = precision.ellipsoid, placed.frame.state.design
        times = fitting_times(longest / (ELLIPSOID_SIZE * design.reach))
        lengths = times * placed.scale * np.maximum(ellipsoid.semi_axes, THINNEST * longest)
        axes = ellipsoid.directions.T * np.linalg.det(ellipsoid.directions)
        error = design.unit_mm * float(precision.rms().displacement)
        words = f"RMS error {format_number(error, DIGITS)} mm, drawn × {format_number(times)}"
        yield from self._ellipsoid.draw(tool_point(placed), axes, lengths, ERROR, words)


class DeflectedScene(ScenePart):
    """Platform and legs where the load deflects them to, magnified."""

    def __init__(self, services: Services) -> None:
        scene, self._loads = services.scene, services.get(Loads)
        self._plate = shapes.add_translucent(
            scene, "/precision/platform", shapes.NO_MESH, PLATE_OPACITY, colour=DEFLECTED
        )
        self._legs = shapes.Rods(
            scene, "/precision/legs", [shapes.linear_colour(DEFLECTED)] * (2 + 2 * PIECES)
        )
        self._balls = shapes.Balls(scene, "/precision/balls", [shapes.linear_colour(DEFLECTED)] * 5)
        self._way = shapes.add_lines(scene, "/precision/way", 1, DEFLECTED, 2.5)
        self._label = shapes.add_label(scene, "/precision/label", "0 mm")

    def updates(self, placed: Placed) -> Updates:
        """Yield the updates that draw the deflection of this frame."""
        precision = self._loads.precision(placed.frame)
        view = placed.frame.state.view
        shown = (
            view.precision.deflected
            and not (view.is_twin or placed.is_apart)
            and is_elastic(precision.loaded.design)
            and precision.is_regular
        )
        yield from show(shown, self._plate, self._way, self._label, self._legs, self._balls)
        if not shown:
            return
        tool, names = tool_point(placed), list(placed.platform_points)
        points = np.array([*(placed.points[name] for name in names), tool])
        times = magnification(placed, precision)
        moved = points + times * placed.scale * _displacements(precision, placed, points)
        yield from self._draw_legs(placed, precision, moved[:4], times)
        yield from self._balls.at(moved, np.full(5, 1.6 * RADIUS * placed.thickness))
        vertices, faces = platform_plate(placed)
        plate = placed.points["b4"] + vertices @ placed.frame.snapshot.rotation.T
        plate = plate + times * placed.scale * _displacements(precision, placed, plate)
        yield from shapes.draw_mesh(self._plate, (plate, faces))
        yield self._way, "points", np.stack([tool, moved[4]])[None].astype(np.float32)
        design, deflection = precision.loaded.design, precision.deflection
        total = format_number(design.unit_mm * math.hypot(*deflection[:3].tolist()), DIGITS)
        turn = format_number(math.degrees(math.hypot(*deflection[3:].tolist())), DIGITS)
        words = f"{total} mm, {turn}°, drawn × {format_number(times)}"
        yield from shapes.write_label(self._label, words, moved[4])

    def _draw_legs(
        self, placed: Placed, precision: ToolPrecision, tips: FloatArray, times: float
    ) -> Updates:
        """Yield the updates that draw legs 1 and 4 straight, and the struts of 2 and 3 bent."""
        feet = placed.struts[0]
        lines = [np.stack([feet[[0, 3]], tips[[0, 3]]], axis=1)]
        for index, leg in enumerate((2, 3)):
            foot = feet[leg - 1].copy()
            foot[0] += times * placed.scale * precision.carriages[index]
            points = foot + ALONG * (tips[leg - 1] - foot)
            lines.append(np.stack([points[:-1], points[1:]], axis=1))
        pieces = np.concatenate(lines)
        radii = np.full(len(pieces), RADIUS * placed.thickness)
        yield from self._legs.between(pieces[:, 0], pieces[:, 1], radii)


def _displacements(precision: ToolPrecision, placed: Placed, points: FloatArray) -> FloatArray:
    """Return displacements (n, 3), in design units, of platform points (n, 3) in scene units."""
    arms = (points - tool_point(placed)) / placed.scale
    x, y, z = precision.deflection[3:].tolist()
    # A product of matrices is much faster than `np.cross`.
    return precision.deflection[:3] + arms @ np.array([[0.0, z, -y], [-z, 0.0, x], [y, -x, 0.0]])


def magnification(placed: Placed, precision: ToolPrecision) -> float:
    """Return the magnification of the drawn deflection."""
    reach = placed.frame.state.design.reach
    points = np.array([*placed.points.values(), tool_point(placed)])
    largest = float(np.linalg.norm(_displacements(precision, placed, points), axis=1).max())
    chosen = placed.frame.state.view.precision.times
    if chosen is None:
        return fitting_times(largest / (DEFLECTION_SIZE * reach))
    # Beyond this the drawing would leave the scene.
    return min(chosen, FARTHEST * reach / largest) if largest > 0.0 else chosen


def fitting_times(share: float) -> float:
    """Return the magnification, 1, 2 or 5 times a power of ten, that makes a share about 1."""
    return round_step(1.0 / max(share, 1.0 / LARGEST_TIMES))
