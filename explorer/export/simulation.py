"""The mechanism for physics engines: an MJCF model, in metres, kilograms and radians.

Every leg is a chain of three joints from the base; the platform is free, and each ball
joint is a `connect` that closes a loop. The home pose is the reference configuration; joint
values are those of `explorer.prototype.chains`, with lengths in metres. Position servos move
the six actuators.

The swing limit of a universal joint is a cone; its two hinges have the box around it. Limits
of the ball joints and of the pose (box, margins) have no counterpart in MJCF and are left out, as
is the payload, whose weight would need servos of its own size.

The model of an imperfect machine has its dimensions, and starts where its loops close. A joint has
the value that its encoder reads, which is off by the zero of the encoder: commands, ranges and
`qpos` are what a controller knows. Its servos have the stiffness of the design.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping
from xml.etree import ElementTree as ET

import numpy as np

from explorer import __version__
from explorer.errors import InputError
from explorer.export.imperfect import ImperfectMachine
from explorer.export.servos import Servos, spring_servos
from explorer.mechanism.design import DOWN, JOINTS, Design
from explorer.mechanism.home import home_pose
from explorer.mechanism.kinematics import platform_points
from explorer.mechanism.machine import STANDARD_GRAVITY
from explorer.mechanism.pose import quaternion_from_rotation
from explorer.numerics.arrays import FloatArray
from explorer.prototype.chains import (
    ACTUATED,
    BODIES,
    CHAIN_JOINTS,
    LEGS,
    ON_GUIDE,
    Chains,
    Places,
)
from explorer.prototype.mass import Mass
from explorer.prototype.sketch import BALL, ROD, leg_radii, sketch_masses
from explorer.statics.error_sources import SOURCES, UNITS, drawing_values
from explorer.workspace.limits.constraints import demanded_order

DENSITY = 1240.0
"""The default density of the bodies, in kg/m³: that of printed PLA."""

TIMESTEP = 5e-4
# The natural frequency of the servos, in rad/s; their own weight deflects them by g/ω².
SERVO = 300.0
# MuJoCo treats lighter moving bodies as massless, in kg and kg m².
LEAST_MASS = LEAST_INERTIA = 1e-14

X, Y, Z = (1, 0, 0), (0, 1, 0), (0, 0, 1)


def simulation_joints(design: Design, position: FloatArray, rotation: FloatArray) -> FloatArray:
    """Return the joint values of the model in a pose (MuJoCo's `qpos`), shape (..., 19).

    The values are the joints of the four chains, with lengths in metres, then the position of
    the platform and its quaternion (w, x, y, z).

    Args:
        design: The manipulator.
        position: Position of b4 in the base frame, shape (..., 3), in design units.
        rotation: Rotation from platform to base, shape (..., 3, 3).

    Raises:
        InputError: The position is not finite, or the rotation is not one.
    """
    return _qpos(design, Chains.of(design).joints(position, rotation), position, rotation)


def _qpos(
    design: Design, joints: FloatArray, position: FloatArray, rotation: FloatArray
) -> FloatArray:
    """Return `qpos`, shape (..., 19), of chain joints (..., 12) in design units."""
    metres, values = 1e-3 * design.unit_mm, joints
    values = np.where(np.isin(CHAIN_JOINTS, JOINTS), values * metres, values)
    platform_position = np.broadcast_to(position * metres, (*values.shape[:-1], 3))
    quaternion = np.broadcast_to(quaternion_from_rotation(rotation), (*values.shape[:-1], 4))
    return np.concatenate([values, platform_position, quaternion], axis=-1)


def simulation_mjcf(
    design: Design | ImperfectMachine,
    density: float = DENSITY,
    masses: Mapping[str, Mass] | None = None,
) -> str:
    """Return the model as XML.

    Args:
        design: The manipulator, or an imperfect machine of it, such as
            `explorer.ImperfectMachine.draw(design, seed)`.
        density: Density of the bodies, in kg/m³.
        masses: Masses of the bodies in their own frames, in metres and kilograms, such as
            `explorer.prototype.assembly.Prototype.masses`; those of bars with the legs' radii
            if None.

    Raises:
        InputError: The density is not positive, a leg has zero length in the home pose, or bodies
            are so light that MuJoCo treats them as massless.
        NoAnswerError: The legs of the imperfect machine do not close near home, or its home is
            singular.
    """
    if not (math.isfinite(density) and density > 0.0):
        raise InputError(f"the density must be positive; got {density:g}")
    return _Model(design, density, masses).text()


class _Model:
    """The elements of the model, from a design in its home pose."""

    def __init__(
        self,
        given: Design | ImperfectMachine,
        density: float,
        masses: Mapping[str, Mass] | None,
    ) -> None:
        self.machine = given if isinstance(given, ImperfectMachine) else None
        self.design = design = given.design if isinstance(given, ImperfectMachine) else given
        self.metres = 1e-3 * design.unit_mm
        self.home = home_pose(design)
        self.chains = Chains.of(design)
        position, rotation = np.array(self.home.position), self.home.rotation
        joints = self.chains.joints(position, rotation)
        for leg in LEGS:
            if not joints[3 * leg - 1] > 0.0:
                raise InputError(
                    f"leg {leg} has no length in the home pose, so that a model that starts "
                    "there has no direction for it; choose another home"
                )
        self.places: Places = self.chains.places(joints, position, rotation)
        self.nominal = self.values = simulation_joints(design, position, rotation).tolist()
        self.masses = masses or {
            name: mass.scaled(self.metres, density * self.metres**3)
            for name, mass in sketch_masses(self.chains, joints, 1.0).items()
        }
        self._check_masses()
        self.radii = [radius * self.metres for radius in leg_radii(design)]
        self.points = platform_points(design)
        self.servos: Servos | None = None
        self.timestep = TIMESTEP
        if self.machine is not None:
            self._deviate(self.machine)

    def _deviate(self, machine: ImperfectMachine) -> None:
        """Replace what differs in an imperfect machine."""
        position, rotation = np.array(machine.home.position), machine.home.rotation
        joints = machine.chain_joints(position, rotation)
        self.places = machine.places(joints, position, rotation)
        joints[list(ACTUATED)] -= machine.encoder_offsets
        self.values = _qpos(self.design, joints, position, rotation).tolist()
        self.points = machine.points
        self.servos = spring_servos(self.design, self.masses)
        if self.servos is not None:
            self.timestep = min(TIMESTEP, float(f"{self.servos.timestep:.2g}"))

    def _check_masses(self) -> None:
        def inertia(mass: Mass) -> float:
            return float(np.linalg.eigvalsh(mass.inertia)[0])

        name, lightest = min(self.masses.items(), key=lambda item: inertia(item[1]))
        least = inertia(lightest)
        if least < LEAST_INERTIA or lightest.mass < LEAST_MASS:
            # Inertia grows with the fifth power of the size.
            factor = 1.02 * (LEAST_INERTIA / least) ** 0.2 if least > 0.0 else math.inf
            raise InputError(
                f"{name} has a mass of {lightest.mass:.3g} kg and an inertia of {least:.3g} kg m², "
                "which physics engines take for none; the unit must be at least "
                f"{factor * self.design.unit_mm:.3g} mm, or the legs thicker"
            )

    def text(self) -> str:
        """Return the model as XML."""
        root = ET.Element("mujoco", model=self.design.name)
        root.append(
            ET.Comment(
                f" flagged-explorer {__version__}; metres, kilograms, radians; "
                f"one design unit is {self.design.unit_mm:g} mm "
            )
        )
        if self.machine is not None:
            root.append(ET.Comment(self._remarks(self.machine)))
        ET.SubElement(root, "compiler", angle="radian", autolimits="true")
        option = ET.SubElement(
            root,
            "option",
            timestep=repr(self.timestep),
            integrator="implicitfast",
            solver="Newton",
            iterations="100",
            tolerance="1e-12",
        )
        if self.design.gravity != DOWN:
            option.set("gravity", _row([STANDARD_GRAVITY * part for part in self.design.gravity]))
        default = ET.SubElement(root, "default")
        # Bodies overlap in their joints, so contacts are off; the explorer checks collisions.
        ET.SubElement(default, "geom", contype="0", conaffinity="0")
        stiff = {"solref": f"{2 * self.timestep!r} 1", "solimp": "0.9999 0.99999 1e-5"}
        ET.SubElement(default, "equality", stiff)
        self._bodies(ET.SubElement(root, "worldbody"))
        equality = ET.SubElement(root, "equality")
        for leg in LEGS:
            ends = {"site1": f"rod {leg} b{leg}", "site2": f"platform b{leg}"}
            ET.SubElement(equality, "connect", {"name": f"ball {leg}", **ends})
        self._gap(root)
        self._actuators(ET.SubElement(root, "actuator"))
        key = ET.SubElement(ET.SubElement(root, "keyframe"), "key", name="home")
        key.set("qpos", _row(self.values))
        key.set("ctrl", _row(self.nominal[index] for index in ACTUATED))
        ET.indent(root)
        return ET.tostring(root, encoding="unicode") + "\n"

    def _bodies(self, world: ET.Element) -> None:
        design, metres = self.design, self.metres
        low, high = design.limits.guide or (0.0, design.a2x)
        thin = min(self.radii[1:3])
        if high > low:
            ends = [self._base_point(2, (x, 0.0)) for x in (low, high)]
            _geom(world, "capsule", thin, "guide", fromto=_row(np.concatenate(ends)))
        for name, leg, place in (("a1", 1, (0.0, 0.0)), ("a3", 4, design.a3)):
            _geom(world, "sphere", thin, name, pos=_row(self._base_point(leg, place)))
        for leg in LEGS:
            radius = self.radii[leg - 1]
            names = BODIES[3 * leg - 2 : 3 * leg + 1]
            length = self.values[3 * leg - 1]
            first = self._body(world, names[0], "base")
            _geom(first, "sphere", BALL * radius)
            cylinder = self._body(first, names[1], names[0])
            # Half of the leg at home, whatever the stroke, so that no gap shows.
            _geom(cylinder, "capsule", radius, fromto=_row([0, 0, 0, 0, 0, 0.5 * length]))
            rod = self._body(cylinder, names[2], names[1])
            _geom(rod, "capsule", ROD * radius, fromto=_row([0, 0, -length, 0, 0, 0]))
            ET.SubElement(rod, "site", name=f"rod {leg} b{leg}", size=repr(radius))
        platform = self._body(world, "platform", "base")
        points = self.points * metres
        hub = points.mean(axis=0)
        for leg, radius, point in zip(LEGS, self.radii, points, strict=True):
            size, where = repr(radius), _row(point)
            ET.SubElement(platform, "site", name=f"platform b{leg}", size=size, pos=where)
            _geom(platform, "sphere", BALL * radius, pos=where)
            if (point != hub).any():
                _geom(platform, "capsule", radius, fromto=_row([*hub, *point]))

    def _base_point(self, leg: int, place: tuple[float, float]) -> FloatArray:
        """Return where a point (x, y) of the base at a leg lies, shape (3,), in metres."""
        point = np.array([*place, 0.0])
        if self.machine is not None:
            point = self.machine.shifts[leg - 1] + self.machine.turns[leg - 1] @ point
        return point * self.metres

    def _body(self, parent: ET.Element, name: str, within: str) -> ET.Element:
        """Add a body with its joint and its mass, placed as in the home pose."""
        index, outer = BODIES.index(name), BODIES.index(within)
        origin, turn = self.places.origin, self.places.rotation
        offset = turn[outer].T @ (origin[index] - origin[outer]) * self.metres
        quaternion = quaternion_from_rotation(turn[outer].T @ turn[index])
        body = ET.SubElement(parent, "body", name=name, pos=_row(offset), quat=_row(quaternion))
        if name == "platform":
            ET.SubElement(body, "freejoint", name="platform")
        else:
            self._joint(body, index - 1)
        mass = self.masses[name]
        i = mass.inertia
        ET.SubElement(
            body,
            "inertial",
            pos=_row(mass.centre),
            mass=repr(mass.mass),
            fullinertia=_row([i[0, 0], i[1, 1], i[2, 2], i[0, 1], i[0, 2], i[1, 2]]),
        )
        return body

    def _joint(self, body: ET.Element, index: int) -> None:
        name = CHAIN_JOINTS[index]
        leg, place = divmod(index, 3)
        on_guide = leg + 1 in ON_GUIDE
        slides = place == 2 or (place == 0 and on_guide)
        axis = Z if place == 2 else Y if place == 1 and not on_guide else X
        joint = ET.SubElement(
            body,
            "joint",
            name=name,
            type="slide" if slides else "hinge",
            axis=_row(axis),
            ref=repr(self.values[index]),
        )
        limits = self._range(name, self.nominal[index])
        if limits is not None:
            joint.set("range", _row(limits))

    def _range(self, name: str, at_home: float) -> tuple[float, float] | None:
        limits = self.design.limits
        if name in ("d1", "d3"):
            low, high = limits.guide or (0.0, 0.0)
        elif name in JOINTS:
            low, high = self.design.length_range(name)
        else:
            degrees = {"a1": limits.swing.a1, "a3": limits.swing.a3}.get(name[:2])
            # A cone of 90° or more does not limit the joint's first angle.
            if degrees is None or degrees >= 90.0:
                return None
            swing = math.radians(degrees)
            return at_home - swing, at_home + swing
        # MuJoCo refuses a range of zero width.
        return (low * self.metres, high * self.metres) if high > low else None

    def _gap(self, root: ET.Element) -> None:
        """Keep the carriages apart, in the order that they have at home."""
        gap = self.design.limits.gap
        if gap <= 0.0 and not demanded_order(self.design):
            return
        d1, d3 = (self.nominal[CHAIN_JOINTS.index(name)] for name in ("d1", "d3"))
        order = 1 if d1 > d3 else -1
        limits = _row([gap * self.metres, 1e3 * self.design.reach * self.metres])
        tendon = ET.SubElement(ET.SubElement(root, "tendon"), "fixed", name="gap", range=limits)
        for joint, sign in (("d1", order), ("d3", -order)):
            ET.SubElement(tendon, "joint", joint=joint, coef=str(sign))

    def _actuators(self, parent: ET.Element) -> None:
        moving = sum(mass.mass for mass in self.masses.values())
        for index, name in enumerate(JOINTS):
            limits = self._range(name, 0.0)
            kp, kv = moving * SERVO**2, 2.0 * moving * SERVO
            if self.servos is not None:
                kp, kv = float(self.servos.stiffness[index]), float(self.servos.damping[index])
            servo = ET.SubElement(
                parent, "position", name=name, joint=name, kp=repr(kp), kv=repr(kv)
            )
            if limits is not None:
                servo.set("ctrlrange", _row(limits))

    def _remarks(self, machine: ImperfectMachine) -> str:
        """Return what differs from the perfect machine, as lines of a comment."""
        seed = "" if machine.seed is None else f", drawn with seed {machine.seed}"
        lines = [
            f"An imperfect machine{seed}.",
            "Values of the six actuated joints are what their encoders read: the true ones less",
            "the deviation of the zero. The keyframe commands the joints of the perfect machine.",
        ]
        values = drawing_values(machine.design, machine.deviations)
        rows = zip(SOURCES, values.tolist(), UNITS, strict=True)
        lines += [f"{name}: {value:+.6g} {unit}" for name, value, unit in rows if value]
        if self.servos is not None:
            lines += [
                "The servos have the stiffness of the actuators; those of d1 and d3 are in series",
                "with struts 2 and 3 of the lengths at home. What the design leaves rigid has a",
                "servo ten times as stiff as the stiffest spring.",
            ]
        return "\n    ".join(["", *lines]) + "\n  "


def _geom(parent: ET.Element, kind: str, radius: float, name: str = "", **where: str) -> None:
    named = {"name": name} if name else {}
    ET.SubElement(parent, "geom", {**named, "type": kind, "size": repr(radius), **where})


def _row(values: Iterator[float] | FloatArray | list[float] | tuple[float, ...]) -> str:
    return " ".join(repr(float(value)) for value in values)
