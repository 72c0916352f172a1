"""The plates of base and platform, and the four legs, or the six of the 6-4 twin (Figure 1).

Legs 1 and 4: U joint, telescoping actuator, ball joint. Legs 2 and 3: a carriage on the
guide, a revolute about it, an actuator perpendicular to it, ball joint.
"""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
import viser

from explorer.app.features.feature import Services
from explorer.app.scene.placing import Placed, ScenePart, around
from explorer.app.scene.shapes import NO_MESH, Balls, Boxes, Mesh, Rods, plate
from explorer.app.widgets.assigning import Update
from explorer.app.widgets.colours import (
    BALL,
    BASE_BODY,
    CARRIAGE,
    JOINT,
    PLATFORM_BODY,
    RAIL,
    ROD,
    TUBE,
)
from explorer.legs.clearance import legs_of
from explorer.measures.snapshot import Snapshot
from explorer.numerics.arrays import FloatArray
from explorer.reproduce.six_legs import TWIN
from explorer.singularity.colours import OUTLINE

# Sizes in scene units.
PLATE_THICKNESS, BASE_RADIUS = 0.22, 0.75
PLATFORM_THICKNESS, PLATFORM_RADIUS = 0.2, 0.42
# Distance of the platform's plate from the plane of its joints.
PLATFORM_SHIFT = 0.26
PLATFORM_OPACITY = 0.82


# Sizes in scene units, at thickness one.
PLATE_TOP = -0.6
RAIL_HALF_WIDTH, RAIL_TOP = 0.3, -0.42
TUBE_RADIUS, ROD_RADIUS, COLLAR_RADIUS = 0.17, 0.095, 0.215
BALL_RADIUS, SOCKET_RADIUS = 0.24, 0.19
PIN_RADIUS, PIN_HALF_LENGTH = 0.085, 0.34
# Length of an actuator's cylinder, which does not depend on its stroke, as a share of the reach.
TUBE_SHARE = 0.34


class Bodies(ScenePart):
    """The base plate and the platform plate."""

    def __init__(self, services: Services) -> None:
        scene = services.scene
        # Whatever is rigid with the platform has this frame as its parent.
        self._frame = scene.add_frame("/platform", show_axes=False)
        self._base = scene.add_mesh_simple("/base/body", *NO_MESH, color=BASE_BODY)
        self._platform = scene.add_mesh_simple(
            "/platform/body", *NO_MESH, color=PLATFORM_BODY, opacity=PLATFORM_OPACITY, side="double"
        )

    def updates(self, placed: Placed) -> Iterator[Update]:
        """Yield the updates that draw the bodies of this frame."""
        state = placed.frame.state
        yield self._frame, "position", tuple(placed.points["b4"].tolist())
        yield self._frame, "wxyz", state.pose.quaternion
        for body in (self._base, self._platform):
            yield body, "visible", state.view.bodies and placed.is_schematic
        # The browser does not draw a translucent body inside another one.
        view = state.view
        is_inside = (
            view.workspace.solid
            or view.singular.ball
            or view.singular.ellipsoid != "none"
            or view.precision.ellipsoid
        )
        yield self._platform, "opacity", None if is_inside else PLATFORM_OPACITY
        for handle, (vertices, faces) in (
            (self._base, _base_plate(placed)),
            (self._platform, platform_plate(placed)),
        ):
            yield handle, "vertices", vertices.astype(np.float32)
            yield handle, "faces", faces.astype(np.uint32)

    def corners(self, placed: Placed) -> FloatArray:
        """Return the corners of cubes about the joints."""
        return around(np.array(list(placed.points.values())))


def _base_plate(placed: Placed) -> Mesh:
    points = np.array([placed.points[name][:2] for name in ("a1", "a2", "a3")])
    return plate(points, BASE_RADIUS, PLATE_TOP - PLATE_THICKNESS, PLATE_TOP)


def platform_plate(placed: Placed) -> Mesh:
    """Return the platform's plate in the platform frame, on the side away from the legs."""
    size = placed.thickness
    points = np.array([p[:2] for p in placed.platform_points.values()])
    near = PLATFORM_SHIFT * size * placed.facing
    far = near + PLATFORM_THICKNESS * size * placed.facing
    return plate(points, PLATFORM_RADIUS * size, min(near, far), max(near, far))


class Telescopes(Rods):
    """Actuators, each with a cylinder at the base end and a rod at the platform end."""

    def __init__(self, scene: viser.SceneApi, name: str, count: int) -> None:
        super().__init__(scene, name, [TUBE] * count + [ROD] * count + [JOINT] * (2 * count))

    def along(self, placed: Placed, bases: FloatArray, tips: FloatArray) -> Iterator[Update]:
        """Yield the updates that draw the actuators from bases (n, 3) to tips (n, 3)."""
        size, count = placed.thickness, len(bases)
        spans = tips - bases
        lengths = np.linalg.norm(spans, axis=1, keepdims=True)
        unit = spans / np.maximum(lengths, 1e-9)
        tube_ends = bases + unit * np.minimum(TUBE_SHARE * placed.reach, 0.8 * lengths)
        collars = tube_ends - unit * np.minimum(0.3 * size, 0.2 * lengths)
        sockets = tips - unit * np.minimum(0.5 * size, 0.3 * lengths)
        yield from self.between(
            np.concatenate([bases, collars, collars, sockets]),
            np.concatenate([tube_ends, tips, tube_ends, tips]),
            size * np.repeat([TUBE_RADIUS, ROD_RADIUS, COLLAR_RADIUS, SOCKET_RADIUS], count),
        )

    def colour_alarms(self, alarms: list[bool]) -> Iterator[Update]:
        """Yield the updates that give some actuators the colour of an alarm."""
        tubes = [OUTLINE if alarm else TUBE for alarm in alarms]
        rods = [OUTLINE if alarm else ROD for alarm in alarms]
        yield from self.colour([*tubes, *rods, *[JOINT] * (2 * len(alarms))])


class Legs(ScenePart):
    """The four legs with their joints, carriages and guide."""

    def __init__(self, services: Services) -> None:
        scene = services.scene
        self._actuators = Telescopes(scene, "/legs/actuators", 4)
        # A post and two pins for each U joint, and a sleeve about the guide for each carriage.
        self._joints = Rods(scene, "/legs/joints", [JOINT, ROD, ROD] * 2 + [JOINT] * 2)
        self._balls = Balls(scene, "/legs/balls", [BALL] * 4 + [JOINT] * 2)
        self._guide = Boxes(scene, "/legs/guide", [RAIL, CARRIAGE, CARRIAGE])

    def updates(self, placed: Placed) -> Iterator[Update]:
        """Yield the updates that draw the legs of this frame."""
        view = placed.frame.state.view
        visible = view.legs and not view.is_twin and placed.is_schematic
        for part in (self._actuators, self._joints, self._balls, self._guide):
            yield from part.show(visible)
        if not visible:
            return
        size, (bases, tips) = placed.thickness, placed.struts
        yield from self._actuators.along(placed, bases, tips)
        yield from self._actuators.colour_alarms(colliding_legs(placed.frame.snapshot))
        yield from self._balls.at(
            np.concatenate([tips, bases[[0, 3]]]),
            size * np.array([BALL_RADIUS] * 4 + [1.2 * TUBE_RADIUS] * 2),
        )
        yield from self._joint_rods(bases, tips, size)
        yield from self._guide_boxes(placed, bases[1], bases[2], size)

    def _joint_rods(self, bases: FloatArray, tips: FloatArray, size: float) -> Iterator[Update]:
        starts: list[FloatArray] = []
        ends: list[FloatArray] = []
        for base, tip in ((bases[0], tips[0]), (bases[3], tips[3])):
            first = np.array([1.0, 0.0, 0.0])
            # The second axis of the U joint is perpendicular to the first and to the leg.
            second = np.array([0.0, base[2] - tip[2], tip[1] - base[1]])
            norm = float(np.linalg.norm(second))
            second = second / norm if norm > 1e-9 else np.array([0.0, 1.0, 0.0])
            half = PIN_HALF_LENGTH * size
            starts += [base + [0.0, 0.0, PLATE_TOP], base - half * first, base - half * second]
            ends += [base, base + half * first, base + half * second]
        sleeve = np.array([0.4 * size, 0.0, 0.0])
        starts += [bases[1] - sleeve, bases[2] - sleeve]
        ends += [bases[1] + sleeve, bases[2] + sleeve]
        radii = size * np.array([*[0.2, PIN_RADIUS, PIN_RADIUS] * 2, 0.28, 0.28])
        yield from self._joints.between(np.array(starts), np.array(ends), radii)

    def _guide_boxes(
        self, placed: Placed, d1: FloatArray, d3: FloatArray, size: float
    ) -> Iterator[Update]:
        low, high = guide_span(placed)
        half = 0.42 * size
        lows = np.array(
            [
                [low, -RAIL_HALF_WIDTH, PLATE_TOP],
                *([d[0] - half, -0.4, RAIL_TOP - 0.1] for d in (d1, d3)),
            ]
        )
        highs = np.array(
            [
                [high, RAIL_HALF_WIDTH, RAIL_TOP],
                *([d[0] + half, 0.4, -0.2 * size] for d in (d1, d3)),
            ]
        )
        yield from self._guide.span(lows, highs)


class TwinLegs(ScenePart):
    """The six legs of the 6-4 twin, which start at a1 and a2 instead of the carriages."""

    def __init__(self, services: Services) -> None:
        scene = services.scene
        self._actuators = Telescopes(scene, "/twin/actuators", len(TWIN))
        self._balls = Balls(scene, "/twin/balls", [JOINT] * 3 + [BALL] * 4)
        self._posts = Rods(scene, "/twin/posts", [JOINT] * 3)

    def updates(self, placed: Placed) -> Iterator[Update]:
        """Yield the updates that draw the twin's legs of this frame."""
        view = placed.frame.state.view
        visible = view.legs and view.is_twin
        for part in (self._actuators, self._balls, self._posts):
            yield from part.show(visible)
        if not visible:
            return
        p, size = placed.points, placed.thickness
        bases = np.array([p[base] for base, _ in TWIN])
        tips = np.array([p[tip] for _, tip in TWIN])
        yield from self._actuators.along(placed, bases, tips)
        feet = np.array([p["a1"], p["a2"], p["a3"]])
        heads = np.array([p["b1"], p["b2"], p["b3"], p["b4"]])
        yield from self._balls.at(np.concatenate([feet, heads]), np.full(7, BALL_RADIUS * size))
        yield from self._posts.between(feet + [0.0, 0.0, PLATE_TOP], feet, np.full(3, 0.2 * size))

    def corners(self, placed: Placed) -> FloatArray:
        """Return the ends of the guide."""
        low, high = guide_span(placed)
        return np.array([[low, 0.0, 0.0], [high, 0.0, 0.0]])


def colliding_legs(snapshot: Snapshot) -> list[bool]:
    """Return which of the four legs collide with another."""
    return legs_of(snapshot.clearances.clearance < 0.0)


def guide_span(placed: Placed) -> tuple[float, float]:
    """Return the x in the scene of both drawn ends of the guide, beyond a1, a2 and carriages."""
    p = placed.points
    stations = [float(p[name][0]) for name in ("a1", "a2", "b2", "b3")]
    return min(stations) - 0.7, max(stations) + 0.7
