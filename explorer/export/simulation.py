"""The mechanism for physics engines: an MJCF model, in metres, kilograms and radians.

Every leg is a chain of three joints from the body `base`; the platform, with the payload, hangs on
a ball joint at the end of leg 4, and three `connect` close the other loops. The home pose is the
reference configuration. Six position servos move the actuators, see `explorer.export.servos`.

The model can be part of a scene: it sets no option of one. Angles are zero at home and limited by
tendons, so that the scene may count them in degrees or radians. Gravity is that of the scene,
downwards; the body `base` is turned if that of the design is not.

MuJoCo's loops give way by a share of what the bodies at their ends would do apart from each other.
A `connect` ends at a socket on the rod, a body of hardly any mass about the base joint, so that
light legs do not let a heavy platform droop.

A joint of an imperfect machine has the value that its encoder reads: commands, ranges and `qpos`
are what a controller knows. Its servos have the stiffness of the design.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import cast
from xml.etree import ElementTree as ET

import msgspec
import numpy as np
from numpy.typing import ArrayLike

from explorer import __version__
from explorer.errors import InputError
from explorer.export.servos import droop_text, servos_of, strokes_of
from explorer.mechanism.design import DOWN, JOINTS, Design
from explorer.mechanism.machine import Guide
from explorer.motion.chains import ACTUATED, BODIES, CHAIN_JOINTS, LEGS, ON_GUIDE, Chains
from explorer.motion.masses import BALL, DENSITY, ROD, Mass, bar_masses, leg_radii, with_payload
from explorer.numerics.arrays import FloatArray
from explorer.prototype.imperfect import ImperfectMachine
from explorer.statics.accuracy import SOURCES, source_errors
from explorer.statics.compliance import is_elastic

SIMULATION_BODIES = tuple(name.replace(" ", "_") for name in BODIES)
"""The bodies with mass, and the base."""

SIMULATION_JOINTS = (*(name.replace(" ", "_") for name in CHAIN_JOINTS), "ball_4")
"""The joints of the model, in the order of `qpos`."""

CLASS = "flagged"
# Settings of the class. A scene may have defaults of its own, which hold where nothing is stated.
# Bodies overlap in their joints, so contacts are off. MuJoCo limits the impedance to 0.9999, and
# the time constant of the loops to two time steps or more.
DEFAULTS: Mapping[str, Mapping[str, str]] = {
    "geom": {"contype": "0", "conaffinity": "0", "mass": "0"},
    "joint": {
        **dict.fromkeys(("armature", "damping", "frictionloss", "stiffness", "ref", "margin"), "0"),
        **dict.fromkeys(("limited", "actuatorfrclimited", "actuatorgravcomp"), "false"),
        "pos": "0 0 0",
        "springdamper": "0 0",
    },
    "equality": {"active": "true", "solref": "1e-5 1", "solimp": "0.9999 0.9999 1e-5"},
    "tendon": {
        "limited": "true",
        **dict.fromkeys(("damping", "frictionloss", "stiffness", "margin"), "0"),
    },
    "general": {
        "dyntype": "none",
        "gaintype": "fixed",
        "biastype": "affine",
        "gear": "1",
        "actlimited": "false",
    },
}
# MuJoCo treats lighter moving bodies as massless, in kg and kg m².
LEAST_MASS = LEAST_INERTIA = 1e-14
# Share of a rod's mass and inertia that its socket has: none to notice, but Drake takes no zeros.
SPECK = 1e-12
# A force that no servo has, in N; MuJoCo takes no infinite limits.
NO_LIMIT = 1e10


def simulation_mjcf(
    design: Design | ImperfectMachine,
    density: float = DENSITY,
    masses: Mapping[str, Mass] | None = None,
) -> str:
    """Return the model as XML; arguments and errors are those of `SimulationModel`."""
    return SimulationModel(design, density, masses).text()


class SimulationModel:
    """The model of a design in its home pose, or of an imperfect machine of it.

    Args:
        given: The manipulator, or an imperfect machine of it.
        density: Density of the bodies, in kg/m³.
        masses: Masses of the bodies without the payload, in their own frames, in metres and
            kilograms, such as `explorer.prototype.assembly.Prototype.masses`; of bars if None.

    Raises:
        InputError: The density is not positive, a leg has no length at home, or a body no weight.
        NoAnswerError: The legs of the machine do not close near home, or its home is singular.
    """

    def __init__(
        self,
        given: Design | ImperfectMachine,
        density: float = DENSITY,
        masses: Mapping[str, Mass] | None = None,
    ) -> None:
        if not (math.isfinite(density) and density > 0.0):
            raise InputError(f"the density must be positive; got {density:g}")
        self.is_perfect = isinstance(given, Design)
        if isinstance(given, Design):
            given = ImperfectMachine(given, np.zeros(len(SOURCES)))
        self.machine = machine = given
        self.design = design = machine.design
        self.metres = 1e-3 * design.unit_mm
        home = design.home_pose
        joints = Chains.of(design).joints(home.position, home.rotation)
        for leg in LEGS:
            if not joints[3 * leg - 1] > 0.0:
                raise InputError(
                    f"leg {leg} has no length in the home pose, so that a model that starts "
                    "there has no direction for it; choose another home"
                )
        self.masses = masses or bar_masses(design, density)
        self._check_masses()
        self.radii = [radius * self.metres for radius in leg_radii(design)]
        # Joint values at home: those of the design, those of the machine that has them, and those
        # that its encoders read.
        self.nominal, true = joints, machine.home
        self.joints = machine.chain_joints(true.position, true.rotation)
        self.places = machine.places(self.joints, true.position, true.rotation)
        self.readings = self.joints.copy()
        self.readings[list(ACTUATED)] -= machine.encoder_offsets
        self.servos = servos_of(design, self.masses, elastic=not self.is_perfect)
        self.masses = with_payload(design, self.masses)
        self.strokes = strokes_of(design, joints[list(ACTUATED)])

    @property
    def left_out(self) -> tuple[str, ...]:
        """The properties of the design that the model lacks, in words."""
        limits, design = self.design.limits, self.design
        is_imprecise = bool(source_errors(design).any()) or is_elastic(design)
        words = {
            **dict.fromkeys(("friction", "contacts", "the mass of the base"), True),
            f"the force of the payload, {design.payload.force_n:g} N": design.payload.force_n > 0.0,
            "limits of struts": math.isfinite(design.struts.largest_moment),
            "limits of the guide": design.guide != Guide(),
            "swing limits of the ball joints": any(
                angle is not None for angle in msgspec.structs.astuple(limits.swing)[2:]
            ),
            "the box of positions": limits.box is not None,
            "the least margins": bool(limits.margin),
            "limits that the home pose exceeds": self.strokes.exceeded,
            "errors and stiffness": is_imprecise and self.is_perfect,
        }
        return tuple(each for each, is_left_out in words.items() if is_left_out)

    def _check_masses(self) -> None:
        least, name = min(
            (float(np.linalg.eigvalsh(mass.inertia)[0]), name) for name, mass in self.masses.items()
        )
        lightest = self.masses[name]
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
        droop = self.servos.droop(self.design)
        # Drake ends at a model without a name.
        root = ET.Element("mujoco", model=self.design.name)
        root.append(
            _comment(
                f"flagged-explorer {__version__}; metres, kilograms, radians",
                f"one design unit is {self.design.unit_mm:g} mm",
                "a servo has the force k (ctrl - q) + f, less damping: q is its joint's value in",
                "metres, k its stiffness (in gainprm), f its force at home (in biasprm)",
                "begin at the keyframe home, or set each ctrl to q of new data: a ctrl of zero",
                "asks for a leg of no length",
                droop_text(1e3 * self.metres * droop[:3], np.degrees(droop[3:])),
                f"left out: {'; '.join(self.left_out)}",
            )
        )
        if not self.is_perfect:
            root.append(_comment(*self.machine.remarks()))
        default = ET.SubElement(_add(root, "default"), "default", {"class": CLASS})
        for element, settings in DEFAULTS.items():
            _add(default, element, **settings)
        self._bodies(_add(root, "worldbody"))
        equality = _add(root, "equality")
        for leg, point in zip(LEGS[:3], self.machine.points * self.metres, strict=False):
            ends = {"body1": "platform", "body2": f"socket_{leg}"}
            _add_named(equality, "connect", f"ball_{leg}", **ends, anchor=point)
        self._limits(root)
        self._servos(_add(root, "actuator"))
        values = np.where(np.isin(CHAIN_JOINTS, JOINTS), self.metres * self.readings, 0.0)
        _add(
            _add(root, "keyframe"),
            "key",
            name="home",
            qpos=[*values, 1.0, 0.0, 0.0, 0.0],
            ctrl=self.metres * self.nominal[list(ACTUATED)],
        )
        ET.indent(root)
        return ET.tostring(root, encoding="unicode") + "\n"

    def _bodies(self, world: ET.Element) -> None:
        design, metres = self.design, self.metres
        base = _add(world, "body", name="base", childclass=CLASS)
        if design.gravity != DOWN:
            # The rotation that turns the direction of gravity downwards. Pinocchio and Drake do not
            # read frames, which could have it too.
            x, y, z = design.gravity
            turn = [1.0 - z, -y, x, 0.0] if (x, y) != (0.0, 0.0) else [0.0, 1.0, 0.0, 0.0]
            base.set("quat", _text(np.array(turn) / np.linalg.norm(turn)))
        low, high = design.limits.guide or (0.0, design.a2x)
        thin = min(self.radii[1:3])
        if high > low:
            ends = [self._base_point(2, (x, 0.0)) for x in (low, high)]
            _add(base, "geom", type="capsule", size=thin, fromto=np.concatenate(ends))
        for leg, place in ((1, (0.0, 0.0)), (4, design.a3)):
            _add(base, "geom", type="sphere", size=thin, pos=self._base_point(leg, place))
        rod = base
        for leg in LEGS:
            radius = self.radii[leg - 1]
            names = BODIES[3 * leg - 2 : 3 * leg + 1]
            length = self.metres * self.joints[3 * leg - 1]
            first = self._body(base, names[0], "base")
            _add(first, "geom", type="sphere", size=BALL * radius)
            cylinder = self._body(first, names[1], names[0])
            # Half of the leg at home, whatever the stroke, so that no gap shows.
            half = [0.0, 0.0, 0.0, 0.0, 0.0, 0.5 * length]
            _add(cylinder, "geom", type="capsule", size=radius, fromto=half)
            rod = self._body(cylinder, names[2], names[1])
            back = [0.0, 0.0, -length, 0.0, 0.0, 0.0]
            _add(rod, "geom", type="capsule", size=ROD * radius, fromto=back)
            if leg < LEGS[-1]:
                mass, inertia = SPECK * self.masses[names[2]].mass, self.masses[names[2]].inertia
                speck = [SPECK * float(np.trace(inertia))] * 3
                socket = _add(rod, "body", name=f"socket_{leg}")
                _add(socket, "inertial", pos=back[:3], mass=mass, diaginertia=speck)
        platform = self._body(rod, "platform", "rod 4")
        points = self.machine.points * metres
        hub = points.mean(axis=0)
        for radius, point in zip(self.radii, points, strict=True):
            _add(platform, "geom", type="sphere", size=BALL * radius, pos=point)
            if (point != hub).any():
                ends = np.concatenate([hub, point])
                _add(platform, "geom", type="capsule", size=radius, fromto=ends)
        tool = {"pos": metres * np.array(design.tool.position), "quat": design.tool.quaternion}
        _add(platform, "site", name="tool", size=self.radii[3], **tool)

    def _base_point(self, leg: int, place: tuple[float, float]) -> FloatArray:
        """Return where a point (x, y) of the base at a leg lies, shape (3,), in metres."""
        shift, turn = self.machine.shifts[leg - 1], self.machine.turns[leg - 1]
        return (shift + turn @ [*place, 0.0]) * self.metres

    def _body(self, parent: ET.Element, name: str, within: str) -> ET.Element:
        """Add a body with its joint and its mass, placed as in the home pose."""
        index = BODIES.index(name)
        offset, turn = self.places.within(index, BODIES.index(within))
        place = {"pos": offset * self.metres, "quat": turn}
        body = _add(parent, "body", name=SIMULATION_BODIES[index], **place)
        if name == "platform":
            at_b4 = self.machine.points[3] * self.metres
            _add(body, "joint", name=SIMULATION_JOINTS[-1], type="ball", pos=at_b4)
        else:
            self._joint(body, index - 1)
        mass = self.masses[name]
        inertia = mass.inertia[[0, 1, 2, 0, 0, 1], [0, 1, 2, 1, 2, 2]]
        _add(body, "inertial", pos=mass.centre, mass=mass.mass, fullinertia=inertia)
        return body

    def _joint(self, body: ET.Element, index: int) -> None:
        name = CHAIN_JOINTS[index]
        leg, place = divmod(index, 3)
        on_guide = leg + 1 in ON_GUIDE
        slides = place == 2 or (place == 0 and on_guide)
        axis = "0 0 1" if place == 2 else "0 1 0" if place == 1 and not on_guide else "1 0 0"
        kind = "slide" if slides else "hinge"
        joint = _add(body, "joint", name=SIMULATION_JOINTS[index], type=kind, axis=axis)
        if name in JOINTS:
            joint.set("ref", _text(self.metres * self.readings[index]))
            joint.set("armature", _text(self.servos.rotors[JOINTS.index(name)]))
            _limit(joint, "range", self.strokes.ranges.get(name))

    def _limits(self, root: ET.Element) -> None:
        """Limit the gap of the carriages, in the order that they have at home, and swings.

        The swing limit of a universal joint is a cone; its two hinges have the box around it.
        Ranges of hinges have the unit of the scene's angles, but those of tendons are in radians.
        """
        limits, tendon = self.design.limits, ET.Element("tendon")
        if self.strokes.gap > 0.0 or self.design.demanded_order:
            d1, d3 = (self.nominal[CHAIN_JOINTS.index(name)] for name in ("d1", "d3"))
            order = 1 if d1 > d3 else -1
            ends = self.strokes.gap, 1e3 * self.design.reach * self.metres
            gap = _add_named(tendon, "fixed", "gap", range=ends)
            for joint, sign in (("d1", order), ("d3", -order)):
                _add(gap, "joint", joint=joint, coef=str(sign))
        for leg, degrees in ((1, limits.swing.a1), (4, limits.swing.a3)):
            # A cone of 90° or more does not limit the joint's first angle.
            if degrees is None or degrees >= 90.0:
                continue
            for index in (3 * leg - 3, 3 * leg - 2):
                middle, half = (self.nominal - self.joints)[index], math.radians(degrees)
                joint, ends = SIMULATION_JOINTS[index], (middle - half, middle + half)
                _add(_add_named(tendon, "fixed", joint, range=ends), "joint", joint=joint, coef="1")
        if len(tendon):
            root.append(tendon)

    def _servos(self, parent: ET.Element) -> None:
        """Add the servos: forces k (ctrl − q) − c q̇ + f with the forces f that hold at home."""
        push, pull = self.design.actuators.limits
        forces = np.clip(np.stack([-pull, push], axis=1), -NO_LIMIT, NO_LIMIT)
        for index, name in enumerate(JOINTS):
            stiffness, damping, _, _, force = (float(each[index]) for each in self.servos)
            law = {"gainprm": stiffness, "biasprm": [force, -stiffness, -damping]}
            servo = _add_named(parent, "general", name, joint=name, **law)
            _limit(servo, "ctrlrange", self.strokes.ranges.get(name))
            limited = (np.abs(forces[index]) < NO_LIMIT).any()
            _limit(servo, "forcerange", tuple(forces[index]) if limited else None)


def _comment(*lines: str) -> ET.Element:
    return cast("ET.Element", ET.Comment("\n    ".join(["", *lines]) + "\n  "))


def _text(value: str | ArrayLike) -> str:
    """Return words as they are, and numbers with all their digits."""
    return value if isinstance(value, str) else " ".join(map(repr, np.ravel(value).tolist()))


def _add(parent: ET.Element, tag: str, **settings: str | ArrayLike) -> ET.Element:
    return ET.SubElement(parent, tag, {name: _text(each) for name, each in settings.items()})


def _add_named(parent: ET.Element, tag: str, name: str, **settings: str | ArrayLike) -> ET.Element:
    """Add an element outside the bodies, which takes no class from them."""
    element = _add(parent, tag, name=name, **settings)
    element.set("class", CLASS)
    return element


def _limit(element: ET.Element, name: str, ends: tuple[float, float] | None) -> None:
    """Set a range or its absence, whatever the scene holds for limited."""
    element.set(name.replace("range", "") + "limited", "false" if ends is None else "true")
    if ends is not None:
        element.set(name, _text(ends))
