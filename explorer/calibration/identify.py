"""Identification of the machine that was built, by least squares from what is measured of it.

The deviations are a priori independent, with the standard deviations of errors that are uniform
within the tolerances: what is unseen stays nominal, and what has no tolerance is exact. Steps of
Gauss and Newton take poses from the forward kinematics of the present machine, and slopes from the
linear model of `explorer.statics.accuracy`. A Cauchy loss finds the lines that are wrong (Holland
and Welsch, Robust Regression Using Iteratively Reweighted Least-Squares, 1977); least squares of
the others are as exact as the Cramér–Rao bound allows. A machine is kept only if it tells lines
better that were held out than the design does.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from typing import Any, Literal

import numpy as np
from numpy.typing import ArrayLike
from scipy import special

from explorer.calibration.measured import Measured, mean_squares
from explorer.calibration.poses import sample_poses
from explorer.calibration.unseen import unseen_of
from explorer.errors import InputError, NoAnswerError
from explorer.mechanism.built_machine import COUNT, BuiltMachine
from explorer.mechanism.configuration import Configuration, tool_offset
from explorer.mechanism.design import Design
from explorer.mechanism.kinematics import joint_array
from explorer.numerics.arrays import BoolArray, FloatArray, IntArray
from explorer.numerics.search import one_thread
from explorer.statics.accuracy import SOURCES, UNIFORM, error_by_source, source_errors

Loss = Literal["cauchy", "linear"]
Weighting = Literal["cauchy", "linear", "trimmed"]

TUNING, OUTLIER = 2.385, 2e-9
"""Residual over its scale at which the Cauchy loss halves a weight, and the probability, that of
6σ, of a residual as large as that of a wrong line."""

ROUGH, SETTLED, MOST_STEPS = 1e-2, 1e-10, 60
"""Steps, as shares of the tolerances' standard deviations, at which the search for wrong lines and
the last one end, and the most of them."""

CHECKED, FOLDS, MOST_EXCESS = 200, 5, 3.0
"""Number of poses over which the errors of the tool are told, number of parts of the lines of which
each is held out once, and largest excess of the sum of squares that is no fault."""

# Share of the largest singular value, and size of a step, up to which they may be rounding.
LOST, ROUNDING = 1e-8, 1e-5


@dataclass(frozen=True, eq=False)
class Calibration:
    """A machine that was identified.

    Attributes:
        machine: The design with its most likely deviations; with none if that gains nothing.
        covariance: Their covariance, shape (31, 31), in design units and radians.
        unknowns: Unknowns of the setup, shape (k,).
        seen: Number of independent combinations of deviations that the measurement shows.
        unseen: Names of the others.
        residuals: Residuals over their standard deviations, shape (n, m); NaN where there are none.
        outliers: Lines that are left out, from 0: they are wrong, or their legs do not close.
        chi_square: Sum of squares of the residuals, and of the deviations over those of tolerances.
        degrees: Its expectation.
        tool_before, tool_after: Root mean square errors of the tool over other poses, by the design
            and by the machine, but for the frames of the measurement, in design units.
        held_out: Root mean squares of lines that were held out, by the design and by machines of
            the other lines, shape (2, 2): of all residuals, in standard deviations, and of
            distances, in design units.
    """

    machine: BuiltMachine
    covariance: FloatArray
    unknowns: FloatArray
    seen: int
    unseen: tuple[str, ...]
    residuals: FloatArray
    outliers: IntArray
    chi_square: float
    degrees: int
    tool_before: float
    tool_after: float
    held_out: FloatArray

    @property
    def excess(self) -> float:
        """Sum of squares above its expectation, over its standard deviation."""
        return (self.chi_square - self.degrees) / math.sqrt(2.0 * max(1, self.degrees))

    @property
    def worst(self) -> list[int]:
        """The three lines of the largest residuals that are not left out, from 0."""
        squares = np.nansum(self.residuals**2, axis=1)
        squares[self.outliers] = 0.0
        return np.sort(np.argsort(-squares)[:3]).tolist()

    @property
    def gains(self) -> bool:
        """Whether the machine tells lines that were held out better than the design does."""
        return bool(self.held_out[1, 0] < self.held_out[0, 0])

    @property
    def faults(self) -> list[str]:
        """What is wrong with the measurement, as sentences; none if the machine may be used."""
        few = ", ".join(name for name in self.unseen if name in SOURCES)
        worst = ", ".join(str(1 + k) for k in self.worst)
        words = {
            "nothing gained: the design predicts poses held out better": not self.gains,
            f"too few poses, or too coarse, to see {few}": few,
            f"χ² is {self.excess:.1f}σ above its expectation, most in poses {worst}": (
                self.excess > MOST_EXCESS
            ),
        }
        return [each for each, holds in words.items() if holds]


def calibrate(
    design: Design,
    readings: ArrayLike,
    measured: Measured,
    tolerances: ArrayLike | None = None,
    loss: Loss = "cauchy",
) -> Calibration:
    """Return the machine that was built, from what its encoders read and what was measured.

    Args:
        design: The manipulator; the poses are of the assembly mode of its home.
        readings: Joints that the encoders read in the poses, shape (n, 6), in design units.
        measured: What was measured in the same poses.
        tolerances: Largest deviations, shape (31,), in mm and degrees; those of the design if None.
        loss: "cauchy" finds lines that are wrong and leaves them out, "linear" takes all.

    Raises:
        InputError: Readings or tolerances are not usable, or not as many as what was measured.
        NoAnswerError: The legs close in no pose, or the steps do not become small.
    """
    joints = joint_array(readings)
    if joints.shape != (len(measured.values), 6):
        raise InputError(
            f"{len(measured.values)} measured poses need as many readings of six joints; got "
            f"the shape {joints.shape}"
        )
    spread = UNIFORM * source_errors(design, tolerances)
    if not spread.any():
        raise InputError(
            "no deviation has a tolerance, so that the machine is the design: give its file "
            "tolerances or actuators.error_mm, or assume --typical ones"
        )
    start = BuiltMachine(design, np.zeros(COUNT)).forward(joints)
    if not start.closes.any():
        raise NoAnswerError(
            "the legs close in none of the poses: check the order and the unit of the readings"
        )
    places = np.where(start.closes[:, None], start.position, np.nan)
    problem = _Problem(design, joints, measured.align(places, start.rotation), spread)
    state = problem.settle(np.zeros(COUNT + measured.unknowns), "linear", ROUGH)
    last: Weighting = "linear" if loss == "linear" else "trimmed"
    if loss == "cauchy":
        state = problem.settle(state, "cauchy", ROUGH)
    state = problem.settle(state, last, SETTLED)
    residuals, slopes = problem.lines(state)
    used = weights_of(residuals, last) > 0.0
    rows = slopes[used].reshape(-1, len(state))
    # What the unknowns of the setup can explain says nothing on the machine.
    left, sizes, _ = np.linalg.svd(rows[:, COUNT:], full_matrices=False)
    setup = left[:, sizes > LOST * sizes.max(initial=0.0)]
    own = rows[:, :COUNT] - setup @ (setup.T @ rows[:, :COUNT])
    information = own.T @ own
    covariance = np.linalg.inv(np.eye(COUNT) + information)
    names, frames = unseen_of(design, spread, information)
    poses = sample_poses(design, CHECKED, tolerances, seed=1).with_tool(design.tool.position)
    tool = error_by_source(poses)[:, :3] * spread @ (np.eye(COUNT) - frames @ frames.T)
    machine, squares = BuiltMachine(design, state[:COUNT] * spread), residuals[used] ** 2
    held_out = problem.held_out(state, used)
    gains = held_out[1, 0] < held_out[0, 0]
    reached = machine.forward(poses.joints)
    before = (
        reached.position - poses.position + tool_offset(reached.rotation, poses.tool) - poses.arm
    )
    return Calibration(
        machine=machine if gains else BuiltMachine(design, np.zeros(COUNT)),
        covariance=covariance * np.outer(spread, spread),
        unknowns=state[COUNT:],
        seen=int((spread > 0.0).sum()) - len(names),
        unseen=names,
        residuals=residuals,
        outliers=np.flatnonzero(~used & np.isfinite(measured.values).any(axis=1)),
        chi_square=float(np.nansum(squares) + (state[:COUNT] ** 2).sum()),
        degrees=int(np.isfinite(squares).sum()) - setup.shape[1],
        tool_before=float(np.sqrt((before[reached.closes] ** 2).sum(axis=1).mean())),
        tool_after=float(np.sqrt(np.einsum("kij,jl,kil->k", tool, covariance, tool).mean())),
        held_out=held_out,
    )


@dataclass(frozen=True, eq=False)
class _Problem:
    """Joints that were read and what was measured, with standard deviations of the sources (31,).

    A state has the deviations over their standard deviations, then the unknowns of the setup.
    """

    design: Design
    joints: FloatArray
    measured: Measured
    spread: FloatArray

    def lines(self, state: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Return residuals (n, m) over their deviations, and slopes of the model (n, m, 31 + k).

        Residuals are NaN, and slopes zero, where nothing was read or the legs do not close.
        """
        pose = BuiltMachine(self.design, state[:COUNT] * self.spread).forward(self.joints)
        measured, at = self.measured, (pose.position, pose.rotation, state[COUNT:])
        by_source = error_by_source(Configuration(self.design, pose.position, pose.rotation))
        closes = pose.closes & np.isfinite(by_source).all(axis=(1, 2))
        by_source = np.where(closes[:, None, None], by_source, 0.0) * self.spread
        off = measured.differences(measured.values, measured.model(*at)) / measured.sigma
        residuals, slopes = np.where(closes[:, None], off, np.nan), measured.slopes(*at)
        slopes = np.concatenate([slopes[..., :6] @ by_source, slopes[..., 6:]], axis=-1)
        slopes /= np.broadcast_to(measured.sigma, off.shape)[..., None]
        return residuals, np.where(np.isfinite(residuals)[..., None], slopes, 0.0)

    def settle(self, state: FloatArray, kind: Weighting, end: float) -> FloatArray:
        """Return the most likely state, by steps from another one until they are small."""
        scale, last = np.where(np.arange(len(state)) < COUNT, 1.0, self.design.reach), math.inf
        # The deviations have a prior, the unknowns a little damping.
        prior, drawn = np.diag(1.0 / scale), np.eye(len(state), COUNT)
        for _ in range(MOST_STEPS):
            residuals, slopes = self.lines(state)
            root = np.sqrt(weights_of(residuals, kind))[:, None]
            rows = np.concatenate([(root[..., None] * slopes).reshape(-1, len(state)), prior])
            misses = np.concatenate(
                [np.nan_to_num(root * residuals).ravel(), -drawn @ state[:COUNT]]
            )
            with one_thread():
                step = np.linalg.lstsq(rows, misses, rcond=None)[0]
            state, size = state + step, float(np.abs(step / scale).max())
            # Steps that are small and no longer shrink are rounding.
            if size <= end or ROUNDING > size >= last:
                return state
            last = size
        raise NoAnswerError(
            f"no machine settles in {MOST_STEPS} steps: measure in more poses, farther from "
            "singular ones, and state the setup closer to what it is"
        )

    def held_out(self, state: FloatArray, used: BoolArray) -> FloatArray:
        """Return the root mean squares of used lines that are held out, as in `Calibration`.

        They are by the design, whose setup alone is fitted to the other lines, and by the machine.
        """
        part, squares = np.cumsum(used) % FOLDS, np.full((2, 2, len(used)), np.nan)
        sigma = np.broadcast_to(self.measured.sigma, self.measured.values.shape)
        for out in (used & (part == k) for k in range(min(FOLDS, int(used.sum())))):
            values = np.where((used & ~out)[:, None], self.measured.values, np.nan)
            rest = replace(self.measured, values=values)
            for row, spread in zip(squares, (0.0 * self.spread, self.spread), strict=True):
                found = replace(self, spread=spread)
                there = replace(found, measured=rest).settle(state, "linear", SETTLED)
                off = found.lines(there)[0][out]
                row[0, out] = mean_squares(off)
                row[1, out] = self.measured.square_distances(off * sigma[out])
        told = np.isfinite(squares).all(axis=(0, 1))
        return np.sqrt(squares[..., told].sum(axis=-1) / max(1, int(told.sum())))


def weights_of(residuals: FloatArray, kind: Weighting) -> FloatArray:
    """Return the weights of lines, shape (n,), by their residuals (n, m); 0 for none.

    A residual counts over the scale within which half of the lines lie, if that exceeds 1.
    """
    counts, squares = np.isfinite(residuals).sum(axis=1), np.nansum(residuals**2, axis=1)
    used, many = counts > 0, np.maximum(counts, 1)
    if kind == "linear" or not used.any():
        return np.where(used, 1.0, 0.0)
    untyped: Any = special
    middles, ends = untyped.chdtri(many, 0.5), untyped.chdtri(many, OUTLIER)
    scale = max(1.0, float(np.median((squares / middles)[used])))
    if kind == "cauchy":
        return used / (1.0 + squares / (scale * many * TUNING**2))
    return np.where(used & (squares <= scale * ends), 1.0, 0.0)
