"""What a measurement does not show of a machine, by name.

Some deviations change no pose, or none in the frames of a measurement: the guide moved along itself
with the zeros of d1 and d3, all of the base moved together, and all of the platform. Others that
are unseen, since the poses are few, are named by sources that would have to be known.
"""

from __future__ import annotations

import numpy as np
from scipy import linalg

from explorer.calibration.measurement import Measurement
from explorer.mechanism.design import Design
from explorer.mechanism.machine import A1, A3, GUIDE, PLATFORM, TILT
from explorer.numerics.arrays import FloatArray
from explorer.statics.accuracy import SOURCES

SEEN, ROUNDING = 1.0, 1e-12
"""Least information on a combination of deviations that shows it, over that of the tolerances, and
over the largest information."""


def frame_motions(design: Design, measured: Measurement) -> dict[str, FloatArray]:
    """Return the deviations by name, each (31,), that to first order move frames or nothing.

    The platform turns about the first point that is measured of it.
    """
    # The carriages read less by as much as the guide starts further on.
    along = np.array([{"guide x": 1.0, "d1": -1.0, "d3": -1.0}.get(name, 0.0) for name in SOURCES])
    motions, points = {"guide x with d1 and d3": along}, design.platform_points - measured.points[0]
    for axis, unit in zip("xyz", np.eye(3), strict=True):
        for name in ("base", "base turn", "platform", "platform turn"):
            motion = motions[f"{name} {axis}"] = np.zeros(len(SOURCES))
            off = motion[6:]
            if name == "base":
                off[A1] = off[A3] = off[GUIDE] = unit
            elif name == "base turn":
                off[A3], off[TILT] = np.cross(unit, [*design.a3, 0.0]), unit[1:]
            else:
                moved = np.cross(unit, points) if "turn" in name else np.tile(unit, 4)
                off[PLATFORM] = moved.ravel()
    return motions


def unseen_of(
    design: Design, measured: Measurement, spread: FloatArray, information: FloatArray
) -> tuple[tuple[str, ...], FloatArray]:
    """Return the names of what is unseen, and a basis (31, j) of those that move frames.

    The spread (31,) has the standard deviations of the sources before the measurement, in design
    units; information (31, 31) and basis are over these.
    """
    free = np.flatnonzero(spread > 0.0)
    sizes, vectors = np.linalg.eigh(information[np.ix_(free, free)])
    least = max(SEEN, ROUNDING * float(sizes[-1]))
    dark, frames = np.zeros((len(spread), int((sizes < least).sum()))), dict[str, FloatArray]()
    dark[free] = vectors[:, sizes < least]
    for name, motion in frame_motions(design, measured).items():
        if spread[motion != 0.0].all():
            along = np.divide(motion, spread, out=np.zeros_like(motion), where=spread > 0.0)
            along /= np.linalg.norm(along)
            if along @ information @ along < least:
                frames[name] = along
    basis = np.linalg.qr(np.array([*frames.values()]).reshape(-1, len(spread)).T)[0]
    more = max(0, dark.shape[1] - len(frames))
    rest = np.linalg.svd(dark - basis @ (basis.T @ dark))[0][:, :more]
    pivots: list[int] = linalg.qr(rest.T, pivoting=True)[2][:more].tolist() if more else []
    return (*frames, *(SOURCES[k] for k in pivots)), basis
