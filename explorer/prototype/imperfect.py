"""A machine that deviates from its design, as a chain of bodies: drawn at random, at home.

A leg is the one of the design, moved as a whole. A strut that leans along the guide turns the rod
in its cylinder, whose axis is the guide's.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import ArrayLike
from scipy.spatial.transform import Rotation

from explorer.errors import InputError, NoAnswerError
from explorer.mechanism.built_machine import BuiltMachine
from explorer.mechanism.configuration import tool_position
from explorer.mechanism.design import Design
from explorer.mechanism.kinematics import inverse
from explorer.mechanism.margins import margins, mode_of, signs_of
from explorer.mechanism.pose import Pose, rotation_array
from explorer.motion.chains import Chains, Places
from explorer.numerics.arrays import FloatArray, position_array
from explorer.statics import accuracy
from explorer.statics.accuracy import SOURCES
from explorer.statics.compliance import is_elastic


@dataclass(frozen=True, eq=False)
class ImperfectMachine(BuiltMachine):
    """A machine of a design, with its deviations, whose bodies can be placed.

    Attributes:
        seed: Seed with which the deviations were drawn; None if they were not.
    """

    seed: int | None = None

    @staticmethod
    def draw(design: Design, seed: int) -> ImperfectMachine:
        """Return a random machine of a design with errors of its actuators and tolerances.

        Each deviation is drawn uniformly within ± its largest error, by NumPy's
        `default_rng(seed)`, as the RMS errors of `explorer.statics.accuracy` take them.

        Raises:
            InputError: The design states neither errors nor tolerances
                nor any stiffness, so that no machine differs from it.
        """
        errors = accuracy.source_errors(design)
        if not (errors.any() or is_elastic(design)):
            raise InputError(
                "the design states no errors, so that no machine differs from it: give its file "
                "tolerances, actuators.error_mm, actuators.stiffness_n_mm or struts.outer_mm"
            )
        drawn = errors * np.random.default_rng(seed).uniform(-1.0, 1.0, len(SOURCES))
        return ImperfectMachine(design, drawn, seed)

    @cached_property
    def _chains(self) -> Chains:
        return Chains.of(self.design)

    def chain_joints(self, position: ArrayLike, rotation: ArrayLike) -> FloatArray:
        """Return the true joint values of all chains in a pose, shape (12,), as `CHAIN_JOINTS`.

        The position (3,) is that of the platform's frame, the rotation (3, 3) platform to base.
        """
        p, r = position_array("position", position), rotation_array(rotation)
        # Seen from its base, a leg is that of the design at another position of the platform.
        positions = self.leg_ends(p[None], r[None])[0] - self.design.platform_points @ r.T
        values = self._chains.joints(positions, r).reshape(4, 4, 3)[range(4), range(4)]
        values[1:3, 0] -= values[1:3, 2] * np.tan(self.strut_tilts)
        values[1:3, 2] /= np.cos(self.strut_tilts)
        return values.ravel()

    def places(self, joints: FloatArray, position: ArrayLike, rotation: ArrayLike) -> Places:
        """Return the placements of all bodies in a pose with these true joint values (12,)."""
        origin, turn = self._chains.places(joints, position, rotation)
        for leg, rod, tilt in zip((2, 3), (6, 9), self.strut_tilts.tolist(), strict=True):
            turn[rod] = turn[rod] @ Rotation.from_rotvec([0.0, tilt, 0.0]).as_matrix()
            origin[rod] = origin[rod - 1] + turn[rod, :, 2] * joints[3 * leg - 1]
        legs = slice(1, 13)
        turns, shifts = np.repeat(self.turns, 3, axis=0), np.repeat(self.shifts, 3, axis=0)
        origin[legs] = shifts + np.einsum("kij,kj->ki", turns, origin[legs])
        turn[legs] = turns @ turn[legs]
        return Places(origin, turn)

    def pose(self, joints: ArrayLike, near: Pose) -> Pose:
        """Return the true pose in which the encoders read the joints, shape (6,), in design units.

        A pose of the same assembly mode, such as the one of the design, is known.

        Raises:
            InputError: The joints are not usable.
            NoAnswerError: There is no such pose in the assembly mode of the pose nearby.
        """
        mode = mode_of(margins(near.position, near.rotation))
        pose = self.forward(joints, signs_of(int(mode)))
        if not pose.closes or mode_of(margins(pose.position, pose.rotation)) != mode:
            raise NoAnswerError(
                "the legs of the machine that deviates do not close near the pose of the design: "
                "the errors are too large so close to singular poses; make them smaller, or "
                "choose another home"
            )
        return Pose.of(pose.position, pose.rotation)

    @cached_property
    def home(self) -> Pose:
        """True pose in which the encoders read the joints of the design's home pose.

        Raises:
            NoAnswerError: There is no such pose close to home.
        """
        home = self.design.home_pose
        if not self.deviations.any():
            return home
        return self.pose(inverse(self.design, home.position, home.rotation), home)

    def remarks(self) -> list[str]:
        """Return the differences from the perfect machine, as lines of text."""
        seed = "" if self.seed is None else f", drawn with seed {self.seed}"
        values = accuracy.drawing_values(self.design, self.deviations)
        rows = zip(SOURCES, values.tolist(), accuracy.UNITS, strict=True)
        return [
            f"An imperfect machine{seed}.",
            "Values of the six actuated joints are what their encoders read: the true ones less",
            "the deviation of the zero. The keyframe commands the joints of the perfect machine.",
            *(f"{name}: {value:+.6g} {unit}" for name, value, unit in rows if value),
        ]

    def tool_error(self) -> FloatArray:
        """Return displacement and turn of the tool from its place at home, shape (6,).

        They are exact, in design units and radians, along the axes of the base.

        Raises:
            NoAnswerError: The loops do not close near home.
        """
        meant, true, tool = self.design.home_pose, self.home, self.design.tool.position
        there, expected = (np.array(tool_position(pose, tool)) for pose in (true, meant))
        turn = Rotation.from_matrix(true.rotation @ meant.rotation.T)
        return np.concatenate([there - expected, turn.as_rotvec()])
