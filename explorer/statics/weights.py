"""The weights of the payload, the platform and the legs, as a load that the actuators hold.

By virtual work, the weight of a leg acts on the actuators like one force at its platform joint.
For a leg of length l with the direction û, whose cylinder (mass m, centre at a distance s from
its base joint) and rod (mass n, centre at a distance r back from its platform joint) have their
centres on the axis, that force is n g + (m s − n r) / l · P g, where P projects across û. A leg on
the guide turns about the guide only, so P projects across û and x̂, and the actuator d1 or d3 holds
the part along the guide of all its weights, its carriage included.
"""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from explorer.mechanism.configuration import Configuration
from explorer.mechanism.design import Design
from explorer.mechanism.machine import STANDARD_GRAVITY, Payload
from explorer.mechanism.pose import Quadruple
from explorer.numerics.arrays import FloatArray, dot, rotate
from explorer.numerics.checks import numbers

NOTHING: Quadruple = (0.0, 0.0, 0.0, 0.0)
ON_GUIDE = np.array([False, True, True, False])
X_AXIS = np.array([1.0, 0.0, 0.0])


@dataclass(frozen=True, kw_only=True)
class Weights:
    """Masses of the moving bodies, in kilograms, with distances in design units, by leg.

    Attributes:
        on_platform: Masses that move with the platform, such as the platform and its payload.
        carriages: Masses of the carriages of legs 2 and 3; those of legs 1 and 4 do not move.
        cylinders, rods: Masses of the cylinders and of the rods.
        cylinder_centres: Distances of their centres from the base joints, along the legs.
        rod_centres: Distances of their centres from the platform joints, back along the legs.

    Raises:
        DesignError: A field of the legs is not four finite numbers.
    """

    on_platform: tuple[Payload, ...] = ()
    carriages: Quadruple = NOTHING
    cylinders: Quadruple = NOTHING
    cylinder_centres: Quadruple = NOTHING
    rods: Quadruple = NOTHING
    rod_centres: Quadruple = NOTHING

    def __post_init__(self) -> None:
        # Plain numbers, whatever was given, so that weights can be compared.
        object.__setattr__(self, "on_platform", tuple(self.on_platform))
        for name in ("carriages", "cylinders", "cylinder_centres", "rods", "rod_centres"):
            object.__setattr__(self, name, tuple(numbers(name, getattr(self, name), 4)))

    @property
    def has_legs(self) -> bool:
        """Whether a carriage, a cylinder or a rod has a mass."""
        return any((*self.carriages, *self.cylinders, *self.rods))


NO_WEIGHTS = Weights()
"""The weights of bodies without masses."""


@dataclass(frozen=True)
class Carried:
    """What weights do in some poses, or weights and inertia in motions.

    Attributes:
        wrench: (F; M) on the platform at the tool point, base axes, that stands for all weights,
            shape (..., 6), in N and N × unit.
        at_joints: Parts of it that stand for the legs, at b1 to b4, shape (..., 4, 3), in N.
        along_guide: Moments by which the weights of legs 2 and 3 change those of the forces of d1
            and d3 at the carriages, shape (..., 2), in N × unit.
        legs: Weights of the legs, carriages included, shape (4, 3), or (..., 4, 3) in motions, in
            N.
    """

    wrench: FloatArray
    at_joints: FloatArray
    along_guide: FloatArray
    legs: FloatArray = field(repr=False)


def design_weights(design: Design) -> Weights:
    """Return the weights that a design states: its payload."""
    return Weights(on_platform=(design.payload,))


def payload_wrench(design: Design, rotation: FloatArray) -> FloatArray:
    """Return the weight of the design's payload as a wrench (F; M) at its tool, shape (6,)."""
    g, tool = STANDARD_GRAVITY * np.array(design.gravity), np.array(design.tool.position)
    return np.concatenate(_of_bodies(rotation, rotation @ tool, design_weights(design), g))


def carry(configuration: Configuration, weights: Weights) -> Carried:
    """Return what weights do in poses, in the design's direction of gravity."""
    c = configuration
    points, shift = c.points, c.arm
    g = STANDARD_GRAVITY * np.array(c.design.gravity)
    force, moment = _of_bodies(c.rotation, shift, weights, g)
    if not weights.has_legs:
        wrench = np.broadcast_to(np.concatenate([force, moment], axis=-1), (*c.batch, 6))
        return Carried(
            wrench, np.zeros((*c.batch, 4, 3)), np.zeros((*c.batch, 2)), np.zeros((4, 3))
        )
    at_joints = _legs_at_joints(c, weights, g)
    ends = np.stack([points.b1, points.b2, points.b3, points.b4], axis=-2)
    arms = ends - points.b4[..., None, :] - shift[..., None, :]
    moment = moment + np.cross(arms, at_joints).sum(axis=-2)
    force = force + at_joints.sum(axis=-2)
    wrench = np.concatenate(np.broadcast_arrays(force, moment), axis=-1)
    legs = np.outer(np.add(weights.cylinders, weights.rods), g)
    legs += np.outer(np.where(ON_GUIDE, weights.carriages, 0.0), g)
    return Carried(wrench, at_joints, _moments_along_guide(c, weights, g), legs)


def _of_bodies(
    r: FloatArray, shift: FloatArray, weights: Weights, g: FloatArray
) -> tuple[FloatArray, FloatArray]:
    """Return force and moment at the tool point of the weights on the platform, both (..., 3)."""
    force, moment = np.zeros(3), np.zeros(3)
    for body in weights.on_platform:
        weight = body.mass_kg * g
        arm = rotate(r, np.array(body.centre)) - shift
        force = force + weight
        moment = moment + np.cross(arm, weight)
    return np.broadcast_to(force, moment.shape), moment


def _legs_at_joints(c: Configuration, weights: Weights, g: FloatArray) -> FloatArray:
    axes, lengths = c.leg_directions, c.leg_lengths
    cylinders, rods = np.array(weights.cylinders), np.array(weights.rods)
    moments = cylinders * np.array(weights.cylinder_centres) - rods * np.array(weights.rod_centres)
    along = dot(axes, np.broadcast_to(g, axes.shape))[..., None] * axes
    across = g - along - np.where(ON_GUIDE[:, None], g[0] * X_AXIS, 0.0)
    ratio = np.divide(moments, lengths, out=np.zeros(lengths.shape), where=lengths > 0.0)
    carried = np.where(ON_GUIDE, cylinders + np.array(weights.carriages), 0.0)
    return np.asarray(
        rods[:, None] * g + ratio[..., None] * across + np.outer(carried, g[0] * X_AXIS)
    )


def _moments_along_guide(c: Configuration, weights: Weights, g: FloatArray) -> FloatArray:
    """Return g_x (m_carriage d + m_rod r + m_cylinder (d − s)) of legs 2 and 3."""
    lengths = c.leg_lengths[..., 1:3]
    carriages, cylinders = np.array(weights.carriages)[1:3], np.array(weights.cylinders)[1:3]
    of_rods = np.array(weights.rods)[1:3] * np.array(weights.rod_centres)[1:3]
    of_cylinders = cylinders * (lengths - np.array(weights.cylinder_centres)[1:3])
    return g[0] * (carriages * lengths + of_rods + of_cylinders)
