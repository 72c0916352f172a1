"""Identification of the machine that was built, by least squares from what is measured of it.

The deviations are a priori independent, with the standard deviations of errors that are uniform
within the tolerances: what is unseen stays nominal, and what has no tolerance is exact. Steps of
Gauss and Newton take poses from the forward kinematics of the present machine, and slopes from the
linear model of `explorer.statics.accuracy`. A Cauchy loss finds the lines that are wrong (Holland
and Welsch, Robust Regression Using Iteratively Reweighted Least-Squares, 1977); least squares of
the others are as exact as the Cramér–Rao bound allows. A machine is kept only if machines of some
poses tell the others better than the design does.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from typing import Any, Literal, NamedTuple

import numpy as np
from numpy.typing import ArrayLike
from scipy import special

from explorer.calibration.measurement import Measurement, mean_squares
from explorer.calibration.poses import sample_poses
from explorer.calibration.unseen import unseen_of
from explorer.errors import InputError, NoAnswerError
from explorer.mechanism.built_machine import COUNT, BuiltMachine
from explorer.mechanism.configuration import Configuration
from explorer.mechanism.design import Design
from explorer.mechanism.kinematics import joint_array
from explorer.numerics.arrays import BoolArray, FloatArray, IntArray, finite_array
from explorer.numerics.search import one_thread
from explorer.statics.accuracy import SOURCES, UNIFORM, error_by_source, source_errors
from explorer.statics.budget import with_tolerances

Loss = Literal["cauchy", "linear"]
Weighting = Literal["cauchy", "linear", "trimmed"]

HALVED = 2.385
"""Residual over its scale at which the Cauchy loss halves a weight."""

OUTLIER = 2e-9
"""Probability, that of 6σ, of a residual as large as that of a wrong pose."""

CHECKED_POSES = 200
"""Number of random poses over which the errors of the tool are averaged."""

FOLDS = 5
"""Number of parts of the poses, each of which is held out once."""

MOST_EXCESS = 3.0
"""Largest excess of the sum of squares, in standard deviations, that is no fault."""

CLEARLY = 2.0
"""Least displacement of the tool by what was identified, over the error that is left."""

# Sizes of the last steps of the search for wrong poses and of the last search, as shares of the
# standard deviations of the tolerances; the most steps; a size below which they may be rounding.
ROUGH, SETTLED, MOST_STEPS, STALLED = 1e-2, 1e-10, 60, 1e-5
# Share of the largest singular value up to which another one may be rounding.
NEGLIGIBLE = 1e-8


class HeldOut(NamedTuple):
    """Root mean squares over poses that were held out, by a machine of the others.

    Attributes:
        residual: Of all residuals, in standard deviations of what was measured.
        distance: Of distances, in design units.
    """

    residual: float
    distance: float


@dataclass(frozen=True, eq=False)
class Calibration:
    """A machine that was identified.

    Poses are those of the measurement, from 0.

    Attributes:
        machine: The design with its most likely deviations; with none if that gains nothing.
        covariance: Covariance of the most likely ones, shape (31, 31), in design units and radians.
        unknowns: Unknowns of the setup, shape (k,).
        seen: Number of independent combinations of deviations that the measurement shows.
        unseen: Names of the others.
        residuals: Residuals over their standard deviations, shape (n, m); NaN where there are none.
        outliers: Poses that are left out: they are wrong, or their legs do not close.
        chi_square: Sum of squares of the residuals of poses that are not left out.
        degrees_of_freedom: Its expectation: their number less that of what was fitted.
        tool_moved: Root mean square displacement of the tool by the most likely deviations, in
            random poses and but for the frames of the measurement, in design units.
        tool_after: Root mean square error of the tool that is left there, by the covariance.
        by_design: What the design tells of poses that were held out; the setup alone is fitted.
        by_machine: What machines of the other poses tell of them.
    """

    machine: BuiltMachine
    covariance: FloatArray
    unknowns: FloatArray
    seen: int
    unseen: tuple[str, ...]
    residuals: FloatArray
    outliers: IntArray
    chi_square: float
    degrees_of_freedom: int
    tool_moved: float
    tool_after: float
    by_design: HeldOut
    by_machine: HeldOut

    @property
    def excess(self) -> float:
        """Sum of squares as a deviation of the normal distribution (Wilson and Hilferty, 1931)."""
        freedom = max(1, self.degrees_of_freedom)
        spread = 2.0 / (9.0 * freedom)
        return (math.cbrt(self.chi_square / freedom) - 1.0 + spread) / math.sqrt(spread)

    @property
    def worst_poses(self) -> list[int]:
        """The three poses of the largest residuals that are not left out."""
        squares = np.nansum(self.residuals**2, axis=1)
        squares[self.outliers] = 0.0
        return np.sort(np.argsort(-squares)[:3]).tolist()

    @property
    def tool_before(self) -> float:
        """Root mean square error of the tool of the design over the same poses, in units."""
        return math.hypot(self.tool_moved, self.tool_after)

    @property
    def gains(self) -> bool:
        """Whether machines tell poses that were held out better than the design does.

        What the tool moves must also be well above its error, lest chance decides.
        """
        is_better = self.by_machine.residual < self.by_design.residual
        return is_better and self.tool_moved > CLEARLY * self.tool_after

    @property
    def beyond(self) -> list[str]:
        """The sources whose deviations are beyond their tolerances by three standard errors."""
        errors = np.sqrt(self.covariance.diagonal())
        most = source_errors(self.machine.design) + 3.0 * errors
        return [SOURCES[k] for k in np.flatnonzero(np.abs(self.machine.deviations) > most)]

    @property
    def faults(self) -> list[str]:
        """What is wrong with the measurement, as sentences; none if the machine may be used."""
        hidden = ", ".join(name for name in self.unseen if name in SOURCES)
        worst = ", ".join(str(1 + k) for k in self.worst_poses)
        words = {
            "nothing gained: where it was not measured, the machine is not clearly better than the "
            "design": not self.gains,
            f"too few poses, or too coarse, to see {hidden}": hidden,
            f"χ² is {self.excess:.1f}σ above its expectation, most in poses {worst}": (
                self.excess > MOST_EXCESS
            ),
        }
        return [each for each, holds in words.items() if holds]


def calibrate(
    design: Design,
    readings: ArrayLike,
    measured: Measurement,
    tolerances: ArrayLike | None = None,
    loss: Loss = "cauchy",
) -> Calibration:
    """Identify the machine that was built, from what its encoders read and what was measured.

    The readings, joints of shape (n, 6) in design units, and what was measured are of the same
    poses, of the assembly mode of home. The tolerances are the largest deviations, shape (31,), in
    mm and degrees; those of the design if None. The loss "cauchy" finds poses that are wrong and
    leaves them out, "linear" takes all.

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
    if tolerances is not None:
        given = finite_array("tolerances", tolerances, (COUNT,), signed=False)
        design = with_tolerances(design, given)
    spread = UNIFORM * source_errors(design)
    if not spread.any():
        raise InputError(
            "no deviation has a tolerance, so that the machine is the design: give its file "
            "tolerances or actuators.error_mm, or assume --typical ones"
        )
    start = BuiltMachine(design).forward(joints)
    if not start.closes.any():
        raise NoAnswerError(
            "the legs close in none of the poses: check the order and the unit of the readings"
        )
    places = np.where(start.closes[:, None], start.position, np.nan)
    problem = _Problem(design, joints, measured.align(places, start.rotation), spread)
    last: Weighting = "linear" if loss == "linear" else "trimmed"
    state = problem.settle(np.zeros(COUNT + measured.unknowns), loss, ROUGH)
    state = problem.settle(state, last, SETTLED)
    residuals, slopes = problem.linearise(state)
    used = weights_of(residuals, last) > 0.0
    squares = residuals[used] ** 2
    # What the unknowns of the setup can explain says nothing on the machine.
    rows = slopes[used].reshape(-1, len(state))
    left, sizes, _ = np.linalg.svd(rows[:, COUNT:], full_matrices=False)
    setup = left[:, sizes > NEGLIGIBLE * sizes.max(initial=0.0)]
    own = rows[:, :COUNT] - setup @ (setup.T @ rows[:, :COUNT])
    information = own.T @ own
    covariance = np.asarray(np.linalg.inv(np.eye(COUNT) + information), dtype=np.float64)
    fitted = setup.shape[1] + float(np.trace(information @ covariance))
    chi_square = float(np.nansum(squares))
    degrees_of_freedom = round(float(np.isfinite(squares).sum()) - fitted)
    # Errors of measurement that are larger than was stated.
    covariance *= max(1.0, chi_square / max(1, degrees_of_freedom))
    names, frames = unseen_of(design, measured, spread, information)
    moves = _tool_slopes(design) * spread @ (np.eye(COUNT) - frames @ frames.T)
    by_design, by_machine = problem.hold_out(state, used)
    found = Calibration(
        machine=BuiltMachine(design, state[:COUNT] * spread),
        covariance=covariance * np.outer(spread, spread),
        unknowns=state[COUNT:],
        seen=int((spread > 0.0).sum()) - len(names),
        unseen=names,
        residuals=residuals,
        outliers=np.flatnonzero(~used & np.isfinite(measured.values).any(axis=1)),
        chi_square=chi_square,
        degrees_of_freedom=degrees_of_freedom,
        tool_moved=math.sqrt(((moves @ state[:COUNT]) ** 2).sum(axis=1).mean()),
        tool_after=math.sqrt(np.einsum("kij,jl,kil->k", moves, covariance, moves).mean()),
        by_design=by_design,
        by_machine=by_machine,
    )
    return found if found.gains else replace(found, machine=BuiltMachine(design))


def _tool_slopes(design: Design) -> FloatArray:
    """Return displacements of the tool per deviation in random poses, shape (n, 3, 31)."""
    poses = sample_poses(design, CHECKED_POSES, seed=1)
    return error_by_source(poses.with_tool(design.tool.position))[:, :3]


@dataclass(frozen=True, eq=False)
class _Problem:
    """Joints that were read and what was measured, with standard deviations of the sources (31,).

    A state has the deviations over their standard deviations, then the unknowns of the setup.
    """

    design: Design
    joints: FloatArray
    measured: Measurement
    spread: FloatArray

    def linearise(self, state: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Return residuals (n, m) over their deviations, and slopes of the model (n, m, 31 + k).

        Residuals are NaN, and slopes zero, where nothing was read or the legs do not close.
        """
        pose = BuiltMachine(self.design, state[:COUNT] * self.spread).forward(self.joints)
        measured = self.measured
        at = pose.position, pose.rotation, state[COUNT:]
        by_source = error_by_source(Configuration(self.design, pose.position, pose.rotation))
        closes = pose.closes & np.isfinite(by_source).all(axis=(1, 2))
        by_source = np.where(closes[:, None, None], by_source, 0.0) * self.spread
        off = measured.differences(measured.values, measured.model(*at)) / measured.sigma
        residuals = np.where(closes[:, None], off, np.nan)
        slopes = measured.slopes(*at)
        slopes = np.concatenate([slopes[..., :6] @ by_source, slopes[..., 6:]], axis=-1)
        slopes /= np.broadcast_to(measured.sigma, off.shape)[..., None]
        return residuals, np.where(np.isfinite(residuals)[..., None], slopes, 0.0)

    def settle(self, state: FloatArray, weighting: Weighting, smallest: float) -> FloatArray:
        """Return the most likely state, by Gauss–Newton from another one until steps are small."""
        scale = np.where(np.arange(len(state)) < COUNT, 1.0, self.design.reach)
        # The deviations have a prior, the unknowns a little damping.
        prior, deviations = np.diag(1.0 / scale), np.eye(len(state), COUNT)
        last = math.inf
        for _ in range(MOST_STEPS):
            residuals, slopes = self.linearise(state)
            root = np.sqrt(weights_of(residuals, weighting))[:, None]
            rows = np.concatenate([(root[..., None] * slopes).reshape(-1, len(state)), prior])
            misses = np.concatenate(
                [np.nan_to_num(root * residuals).ravel(), -deviations @ state[:COUNT]]
            )
            with one_thread():
                step = np.linalg.lstsq(rows, misses, rcond=None)[0]
            state, size = state + step, float(np.abs(step / scale).max())
            # Steps that are small and no longer shrink are rounding.
            if size <= smallest or STALLED > size >= last:
                return state
            last = size
        raise NoAnswerError(
            "no machine settles: check the columns, their units and order, the frame, the design "
            "and its assembly mode; or measure in more poses, farther from singular ones"
        )

    def hold_out(self, state: FloatArray, used: BoolArray) -> list[HeldOut]:
        """Return what the design and machines tell of used poses that are held out."""
        sigma = np.broadcast_to(self.measured.sigma, self.measured.values.shape)
        squares = np.full((2, len(used), 2), np.nan)
        part = np.cumsum(used) % FOLDS
        for out in (used & (part == k) for k in range(min(FOLDS, int(used.sum())))):
            values = np.where((used & ~out)[:, None], self.measured.values, np.nan)
            rest = replace(self.measured, values=values)
            for row, spread in zip(squares, (0.0 * self.spread, self.spread), strict=True):
                model = replace(self, spread=spread)
                there = replace(model, measured=rest).settle(state, "linear", SETTLED)
                off = model.linearise(there)[0][out]
                row[out, 0] = mean_squares(off)
                row[out, 1] = self.measured.square_distances(off * sigma[out])
        is_told = np.isfinite(squares).all(axis=(0, 2))
        sums = np.sqrt(squares[:, is_told].sum(axis=1) / max(1, int(is_told.sum())))
        return [HeldOut(*row) for row in sums.tolist()]


def weights_of(residuals: FloatArray, kind: Weighting) -> FloatArray:
    """Return the weights of poses, shape (n,), by their residuals (n, m); 0 for none.

    Residuals are divided by a robust scale, the median of χ² over the expected one, of at least 1.
    """
    counts = np.isfinite(residuals).sum(axis=1)
    squares = np.nansum(residuals**2, axis=1)
    used, many = counts > 0, np.maximum(counts, 1)
    if kind == "linear" or not used.any():
        return np.where(used, 1.0, 0.0)
    untyped: Any = special
    middles, ends = untyped.chdtri(many, 0.5), untyped.chdtri(many, OUTLIER)
    scale = max(1.0, float(np.median((squares / middles)[used])))
    if kind == "cauchy":
        return used / (1.0 + squares / (scale * many * HALVED**2))
    return np.where(used & (squares <= scale * ends), 1.0, 0.0)
