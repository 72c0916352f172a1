"""The plates of base and platform, their flags, and the four legs, or the twin's six (Figure 1).

Legs 1 and 4: U joint, telescoping actuator, ball joint. Legs 2 and 3: a carriage on the guide, a
revolute about it, an actuator perpendicular to it, ball joint.

A flag is a point, a line through it and a plane through the line, each in the colour of its
incidence: a1 and the platform plane in that of δ1, the lines of δ2, b4 and the base plane of δ3.
Where an incidence is near, lines and planes reach out from the mechanism to its gap.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
import viser

from explorer.app.features.feature import Services, show
from explorer.app.features.mechanism.incidences import Approach, approaches, margin_hover
from explorer.app.scene import shapes
from explorer.app.scene.placing import NO_POINTS, Placed, ScenePart, around
from explorer.legs.clearance import legs_of
from explorer.measures.snapshot import Snapshot
from explorer.mechanism import rgb
from explorer.mechanism.rgb import OUTLINE, Rgb
from explorer.numerics.arrays import FloatArray
from explorer.page.widgets.assigning import Updates
from explorer.singularity.colours import proximity_colour
from explorer.six_legged.files import TWIN

# Sizes in scene units.
PLATE_THICKNESS, BASE_RADIUS = 0.22, 0.75
PLATFORM_THICKNESS, PLATFORM_RADIUS = 0.2, 0.42
# Distance of the platform's plate from the plane of its joints.
PLATFORM_SHIFT = 0.26
PLATFORM_OPACITY = 0.82

# Sizes in scene units, at thickness one.
PLATE_TOP = -0.6
RAIL_HALF_WIDTH, RAIL_TOP = 0.3, -0.42
BALL_RADIUS = 0.24
# Of the line of a leg that has no radius, whatever the thickness.
AXIS_RADIUS = 0.05
PIN_RADIUS, PIN_HALF_LENGTH = 0.085, 0.34
POINT_RADIUS, LINE_RADIUS = 0.36, 0.075
# Radii of an actuator's cylinder, rod, collar and socket, over that of its leg, or of its line.
SHARES, LINE_SHARES = (0.94, 0.75, 1.0, 0.9), (1.0, 1.0, 0.5, 0.5)
# Length of an actuator's cylinder, which does not depend on its stroke, as a share of the reach.
TUBE_SHARE = 0.34
PLANE_OPACITY = 0.2
# How far lines and planes go on beyond the end of a gap, as a share of the reach.
BEYOND = 0.06
# Ends of a gap.
BASE, PLATFORM = 0, 1
ALONG_X = shapes.turn_z_to(np.array([[1.0, 0.0, 0.0]]))[0]


class Bodies(ScenePart):
    """The base plate and the platform plate."""

    def __init__(self, services: Services) -> None:
        scene = services.scene
        # Whatever is rigid with the platform has this frame as its parent.
        self._frame = scene.add_frame("/platform", show_axes=False)
        self._base = scene.add_mesh_simple("/base/body", *shapes.NO_MESH, color=rgb.BASE_BODY)
        self._platform = scene.add_mesh_simple(
            "/platform/body", *shapes.NO_MESH, color=rgb.PLATFORM_BODY, side="double"
        )

    def updates(self, placed: Placed) -> Updates:
        """Yield the updates that draw the bodies of this frame."""
        view = placed.frame.state.view
        yield self._frame, "position", tuple(placed.points["b4"].tolist())
        yield self._frame, "wxyz", placed.frame.state.pose.quaternion
        # The browser does not draw a translucent body inside another one.
        is_inside = (
            view.workspace.solid
            or view.singular.ball
            or view.singular.ellipsoid != "none"
            or view.precision.ellipsoid
        )
        yield self._platform, "opacity", None if is_inside else PLATFORM_OPACITY
        feet = np.array([placed.points[name][:2] for name in ("a1", "a2", "a3")])
        base = shapes.plate(feet, BASE_RADIUS, PLATE_TOP - PLATE_THICKNESS, PLATE_TOP)
        yield from show(view.bodies and placed.is_schematic, self._base, self._platform)
        yield from shapes.draw_mesh(self._base, base)
        yield from shapes.draw_mesh(self._platform, platform_plate(placed))

    def corners(self, placed: Placed) -> FloatArray:
        """Return the corners of cubes about the joints."""
        return around(np.array(list(placed.points.values())))


def platform_plate(placed: Placed) -> shapes.Mesh:
    """Return the platform's plate in the platform frame, on the side away from the legs."""
    size = placed.thickness
    points = np.array([p[:2] for p in placed.platform_points.values()])
    near = PLATFORM_SHIFT * size * placed.facing
    far = near + PLATFORM_THICKNESS * size * placed.facing
    return shapes.plate(points, PLATFORM_RADIUS * size, min(near, far), max(near, far))


def platform_joints(placed: Placed, positions: FloatArray, rotations: FloatArray) -> FloatArray:
    """Return b1 … b4 of n poses in the scene, shape (n, 4, 3)."""
    local = np.array(list(placed.platform_points.values()))
    turned = np.einsum("mij,nj->mni", rotations, local)
    return placed.scale * positions[:, None] + turned


def leg_lines(placed: Placed, tips: FloatArray) -> FloatArray:
    """Return lines along the legs of n poses with b1 … b4 at tips (n, 4, 3), shape (4 n, 2, 3)."""
    bases = np.zeros_like(tips)
    bases[:, 1:3, 0] = tips[:, 1:3, 0]
    bases[:, 3] = placed.points["a3"]
    return np.stack([bases, tips], axis=2).reshape(-1, 2, 3)


class Telescopes(shapes.Rods):
    """Actuators, each with a cylinder at the base end and a rod at the platform end."""

    def __init__(self, scene: viser.SceneApi, name: str, count: int) -> None:
        super().__init__(scene, name, _colours_of_parts([False] * count))

    def along(
        self, placed: Placed, bases: FloatArray, tips: FloatArray, radii: FloatArray
    ) -> Updates:
        """Yield the updates that draw the actuators from bases (n, 3) to tips (n, 3).

        They are as thick as their radii (n,); a line along its axis stands for one that has none.
        """
        size = placed.thickness
        spans = tips - bases
        lengths = np.linalg.norm(spans, axis=1, keepdims=True)
        unit = spans / np.maximum(lengths, 1e-9)
        tube_ends = bases + unit * np.minimum(TUBE_SHARE * placed.reach, 0.8 * lengths)
        collars = tube_ends - unit * np.minimum(0.3 * size, 0.2 * lengths)
        lines = AXIS_RADIUS * np.array(LINE_SHARES)[:, None]
        sockets = tips - unit * np.minimum(0.5 * size, 0.3 * lengths)
        yield from self.between(
            np.concatenate([bases, collars, collars, sockets]),
            np.concatenate([tube_ends, tips, tube_ends, tips]),
            np.where(radii > 0.0, np.outer(SHARES, radii), lines).ravel(),
        )


def _colours_of_parts(alarms: list[bool]) -> list[Rgb]:
    tubes = [OUTLINE if alarm else rgb.TUBE for alarm in alarms]
    rods = [OUTLINE if alarm else rgb.ROD for alarm in alarms]
    return [*tubes, *rods, *[rgb.JOINT] * (2 * len(alarms))]


class Legs(ScenePart):
    """The four legs with their joints, carriages and guide."""

    def __init__(self, services: Services) -> None:
        scene, joint, rod = services.scene, rgb.JOINT, rgb.ROD
        self._actuators = Telescopes(scene, "/legs/actuators", 4)
        # A post and two pins for each U joint, and a sleeve about the guide for each carriage.
        self._joints = shapes.Rods(scene, "/legs/joints", [joint, rod, rod] * 2 + [joint] * 2)
        self._balls = shapes.Balls(scene, "/legs/balls", [rgb.BALL] * 4 + [joint] * 2)
        boxes = [rgb.RAIL, rgb.CARRIAGE, rgb.CARRIAGE]
        self._guide = shapes.Instances(scene, "/legs/guide", shapes.box(), boxes)

    def updates(self, placed: Placed) -> Updates:
        """Yield the updates that draw the legs of this frame."""
        view = placed.frame.state.view
        visible = view.legs and not view.is_twin and placed.is_schematic
        yield from show(visible, self._actuators, self._joints, self._balls, self._guide)
        if not visible:
            return
        size, (bases, tips) = placed.thickness, placed.struts
        yield from self._actuators.along(placed, bases, tips, placed.leg_radii)
        alarms = colliding_legs(placed.frame.snapshot)
        yield from self._actuators.colour(_colours_of_parts(alarms))
        yield from self._balls.at(
            np.concatenate([tips, bases[[0, 3]]]),
            np.maximum(size * BALL_RADIUS, placed.leg_radii[[0, 1, 2, 3, 0, 3]]),
        )
        yield from self._joint_rods(bases, tips, size)
        low, high = guide_span(placed)
        half, stations = 0.42 * size, (float(bases[1, 0]), float(bases[2, 0]))
        rail_low, rail_high = (low, -RAIL_HALF_WIDTH, PLATE_TOP), (high, RAIL_HALF_WIDTH, RAIL_TOP)
        lows = np.array([rail_low, *((x - half, -0.4, RAIL_TOP - 0.1) for x in stations)])
        highs = np.array([rail_high, *((x + half, 0.4, -0.2 * size) for x in stations)])
        yield from self._guide.place(0.5 * (lows + highs), None, highs - lows)

    def _joint_rods(self, bases: FloatArray, tips: FloatArray, size: float) -> Updates:
        rods: list[tuple[FloatArray, FloatArray]] = []
        pin = np.array([PIN_HALF_LENGTH * size, 0.0, 0.0])
        for base, tip in ((bases[0], tips[0]), (bases[3], tips[3])):
            # The second axis of the U joint is perpendicular to the first and to the leg.
            second = np.array([0.0, base[2] - tip[2], tip[1] - base[1]])
            norm = float(np.linalg.norm(second))
            second = second / norm if norm > 1e-9 else np.array([0.0, 1.0, 0.0])
            post, second = np.array([0.0, 0.0, PLATE_TOP]), PIN_HALF_LENGTH * size * second
            rods += [(base + post, base), (base - pin, base + pin), (base - second, base + second)]
        sleeve = np.array([0.4 * size, 0.0, 0.0])
        rods += [(base - sleeve, base + sleeve) for base in bases[1:3]]
        starts, ends = zip(*rods, strict=True)
        radii = size * np.array([*[0.2, PIN_RADIUS, PIN_RADIUS] * 2, 0.28, 0.28])
        yield from self._joints.between(np.array(starts), np.array(ends), radii)


class TwinLegs(ScenePart):
    """The six legs of the 6-4 twin, which start at a1 and a2 instead of the carriages."""

    def __init__(self, services: Services) -> None:
        scene, joints = services.scene, [rgb.JOINT] * 3
        self._actuators = Telescopes(scene, "/twin/actuators", len(TWIN))
        self._balls = shapes.Balls(scene, "/twin/balls", joints + [rgb.BALL] * 4)
        self._posts = shapes.Rods(scene, "/twin/posts", joints)

    def updates(self, placed: Placed) -> Updates:
        """Yield the updates that draw the twin's legs of this frame."""
        view = placed.frame.state.view
        visible = view.legs and view.is_twin
        yield from show(visible, self._actuators, self._balls, self._posts)
        if not visible:
            return
        p, size = placed.points, placed.thickness
        bases = np.array([p[base] for base, _ in TWIN])
        tips = np.array([p[tip] for _, tip in TWIN])
        yield from self._actuators.along(placed, bases, tips, np.zeros(len(TWIN)))
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


class Extent(NamedTuple):
    """The part of a plane that is drawn, in its flag's frame; the line is part of the x-axis."""

    low: float
    high: float
    bottom: float
    top: float

    @property
    def corners(self) -> FloatArray:
        """The corners, shape (4, 3)."""
        low, high, bottom, top = self
        return np.array([[low, bottom, 0], [high, bottom, 0], [high, top, 0], [low, top, 0]], float)

    def towards(self, point: FloatArray, share: float, beyond: float) -> Extent:
        """Return the extent grown by a share of the way to one with a point (3,) in it."""
        x, y, _ = point.tolist()
        grown = (
            min(self.low, x - beyond),
            max(self.high, x + beyond),
            min(self.bottom, y - beyond),
            max(self.top, y + beyond),
        )
        return Extent(*(a + share * (b - a) for a, b in zip(self, grown, strict=True)))


class Flag:
    """One flag in its own frame: the point at the origin, the line along x."""

    def __init__(self, scene: viser.SceneApi, root: str, deltas: tuple[int, int, int]) -> None:
        # Indices of the margins that colour the point, the line and the plane.
        self._deltas = deltas
        # Each browser makes its mesh.
        self._point = scene.add_icosphere(f"{root}/flag/point", subdivisions=8)
        self._line = scene.add_mesh_simple(f"{root}/flag/line", *shapes.cylinder(), wxyz=ALONG_X)
        self._patch = shapes.Patch(scene, f"{root}/flag", PLANE_OPACITY)

    def updates(self, placed: Placed, line: Extent, plane: Extent, size: float) -> Updates:
        """Yield the updates that draw the flag; `size` scales its thicknesses."""
        levels, visible = placed.frame.verdict.levels, _are_visible(placed)
        point, along, across = (proximity_colour(levels[index]) for index in self._deltas)
        yield from show(visible, self._point, self._line, self._patch)
        yield self._point, "color", point
        yield self._point, "scale", POINT_RADIUS * size
        yield self._line, "color", along
        yield self._line, "position", (line.low, 0.0, 0.0)
        yield self._line, "scale", (LINE_RADIUS * size, LINE_RADIUS * size, line.high - line.low)
        yield from self._patch.span(plane.corners, across)


class Flags(ScenePart):
    """The base's flag and the platform's."""

    def __init__(self, services: Services) -> None:
        scene, self._hovered = services.scene, services.get(margin_hover)
        self._base = Flag(scene, "/base", deltas=(0, 1, 2))
        self._platform = Flag(scene, "/platform", deltas=(2, 1, 0))

    def updates(self, placed: Placed) -> Updates:
        """Yield the updates that draw the flags of this frame."""
        beyond = BEYOND * placed.reach
        to_platform_plane, of_lines, to_base_plane = approaches(placed, self._hovered.row)

        def grow(extent: Extent, approach: Approach, end: int) -> Extent:
            if approach.ends is None:
                return extent
            point = approach.ends[end]
            if end == PLATFORM:
                point = (point - placed.points["b4"]) @ placed.frame.snapshot.rotation
            return extent.towards(point, approach.arrival, beyond)

        base, platform = _base_extent(placed), _platform_extent(placed)
        yield from self._base.updates(
            placed, grow(base, of_lines, BASE), grow(base, to_base_plane, BASE), 1.0
        )
        yield from self._platform.updates(
            placed,
            grow(platform, of_lines, PLATFORM),
            grow(platform, to_platform_plane, PLATFORM),
            max(0.6, placed.thickness),
        )

    def corners(self, placed: Placed) -> FloatArray:
        """Return the corners of both planes where no incidence is near."""
        if not _are_visible(placed):
            return NO_POINTS
        rotation = placed.frame.snapshot.rotation
        platform = placed.points["b4"] + _platform_extent(placed).corners @ rotation.T
        return np.concatenate([_base_extent(placed).corners, platform])


def _are_visible(placed: Placed) -> bool:
    # They would stand among parts that are drawn apart.
    return placed.frame.state.view.flags and not placed.is_apart


def _base_extent(placed: Placed) -> Extent:
    low, high = guide_span(placed)
    return _between(low - 1.0, high + 1.0, 1.2 * float(placed.points["a3"][1]))


def _platform_extent(placed: Placed) -> Extent:
    local = placed.platform_points
    stations = [float(point[0]) for point in local.values()]
    beyond, side = 0.16 * placed.reach, float(local["b1"][1])
    edge = side + float(np.copysign(0.5 * beyond, side))
    return _between(min(stations) - beyond, max(stations) + beyond, edge)


def _between(low: float, high: float, y: float) -> Extent:
    """Return the extent between the x-axis and a line at y."""
    return Extent(low, high, min(0.0, y), max(0.0, y))
