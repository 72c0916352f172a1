"""A machine that deviates from its design: other dimensions, and encoders with offsets.

Nothing is linear here. Each leg is the one of the design, moved as a whole: legs 1 and 4 with a1
and a3, legs 2 and 3 with the guide, whose tilt is the rotation by the vector (0, y, z) about a1.
The ends b1 to b4 lie elsewhere on the platform.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import ArrayLike
from scipy.spatial.transform import Rotation

from explorer.errors import InputError, NoAnswerError
from explorer.mechanism.configuration import tool_offset
from explorer.mechanism.design import Design
from explorer.mechanism.kinematics import inverse, joint_array
from explorer.mechanism.margins import margins, mode_of
from explorer.mechanism.pose import Pose, rotation_array
from explorer.motion.chains import ACTUATED, Chains, Places
from explorer.numerics.arrays import FloatArray, finite_array, position_array
from explorer.statics import accuracy
from explorer.statics.accuracy import SOURCES
from explorer.statics.compliance import is_elastic

# Largest error of the joints of a solved pose, as a share of the reach.
CLOSED = 1e-12


@dataclass(frozen=True, eq=False)
class ImperfectMachine:
    """A machine of a design, with its deviations.

    Attributes:
        design: The manipulator.
        deviations: Deviations of the sources of errors, shape (29,), in the order of
            `explorer.statics.accuracy.SOURCES`: the offsets of the encoders of the six actuators,
            then the 23 dimensions. Lengths are in design units, tilts in radians.
        seed: Seed with which they were drawn; None if they were not.

    Raises:
        InputError: The deviations are not 29 finite numbers.
    """

    design: Design
    deviations: FloatArray
    seed: int | None = None

    def __post_init__(self) -> None:
        given = finite_array("deviations", self.deviations, (len(SOURCES),))
        if given.ndim != 1:
            raise InputError("a machine has one set of deviations, not a batch")

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

    @property
    def encoder_offsets(self) -> FloatArray:
        """True joint values less those that the encoders read, shape (6,), in design units."""
        return self.deviations[:6]

    @cached_property
    def points(self) -> FloatArray:
        """True b1, b2, b3 and b4 in the platform frame, shape (4, 3), in design units."""
        return self.design.platform_points + self.deviations[6 + accuracy.B_COLUMN :].reshape(4, 3)

    @cached_property
    def shifts(self) -> FloatArray:
        """Displacements of the four legs' bases, shape (4, 3), in design units."""
        guide = accuracy.GUIDE_COLUMN
        starts = np.array([accuracy.A1_COLUMN, guide, guide, accuracy.A3_COLUMN])
        return self.deviations[6 + starts[:, None] + np.arange(3)]

    @cached_property
    def turns(self) -> FloatArray:
        """Rotations of the four legs' bases about a1, shape (4, 3, 3)."""
        tilt = [0.0, *self.deviations[6 + accuracy.TILT_COLUMN : 8 + accuracy.TILT_COLUMN]]
        guide = Rotation.from_rotvec(tilt).as_matrix()
        return np.stack([np.eye(3), guide, guide, np.eye(3)])

    @cached_property
    def _chains(self) -> Chains:
        return Chains.of(self.design)

    def chain_joints(self, position: ArrayLike, rotation: ArrayLike) -> FloatArray:
        """Return the true joint values of all chains in a pose, shape (12,), as `CHAIN_JOINTS`.

        The position (3,) is that of the platform's frame, the rotation (3, 3) platform to base.
        """
        p, r = position_array("position", position), rotation_array(rotation)
        ends = p + self.points @ r.T
        # Seen from its base, a leg is that of the design at another position of the platform.
        seen = np.einsum("kji,kj->ki", self.turns, ends - self.shifts)
        positions = seen - self.design.platform_points @ r.T
        values = self._chains.joints(positions, r).reshape(4, 4, 3)
        return values[range(4), range(4)].ravel()

    def places(self, joints: FloatArray, position: ArrayLike, rotation: ArrayLike) -> Places:
        """Return the placements of all bodies in a pose with these true joint values (12,)."""
        origin, turn = self._chains.places(joints, position, rotation)
        legs = slice(1, 13)
        turns, shifts = np.repeat(self.turns, 3, axis=0), np.repeat(self.shifts, 3, axis=0)
        origin[legs] = shifts + np.einsum("kij,kj->ki", turns, origin[legs])
        turn[legs] = turns @ turn[legs]
        return Places(origin, turn)

    def pose(self, joints: ArrayLike, near: Pose) -> Pose:
        """Return the true pose in which the encoders read the joints, shape (6,), in design units.

        A pose close to it, such as the one in which the design has these joints, is known.

        Raises:
            InputError: The joints are not usable.
            NoAnswerError: There is no such pose in the assembly mode of the pose nearby.
        """
        from scipy.optimize import least_squares

        true = joint_array(joints) + self.encoder_offsets
        size, position, rotation = self.design.reach, np.array(near.position), near.rotation

        def pose_at(twist: FloatArray) -> tuple[FloatArray, FloatArray]:
            turn = Rotation.from_rotvec(twist[3:]).as_matrix()
            return position + size * twist[:3], turn @ rotation

        def unmet(twist: FloatArray) -> FloatArray:
            return (self.chain_joints(*pose_at(twist))[list(ACTUATED)] - true) / size

        solution = least_squares(
            unmet, np.zeros(6), method="lm", xtol=1e-15, ftol=1e-15, gtol=1e-15
        )
        pose = Pose.of(*pose_at(solution.x))
        scale = max(1.0, float(np.abs(true).max()) / size)
        modes = [mode_of(margins(each.position, each.rotation)) for each in (near, pose)]
        if np.abs(unmet(solution.x)).max() > CLOSED * scale or modes[0] != modes[1]:
            raise NoAnswerError(
                "the legs of the machine that deviates do not close near the pose of the design: "
                "the errors are too large so close to singular poses; make them smaller, or "
                "choose another home"
            )
        return pose

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
        there, expected = (
            np.array(pose.position) + tool_offset(pose.rotation, tool) for pose in (true, meant)
        )
        turn = Rotation.from_matrix(true.rotation @ meant.rotation.T)
        return np.concatenate([there - expected, turn.as_rotvec()])
