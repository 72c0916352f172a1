"""A tilt that the required box must allow: it lies in the workspace of each tilted orientation.

The azimuths turn with the yaw of home, so that a change of the yaw turns every orientation about
the base's z-axis, and its limits have the derivatives that they have at home.
"""

from __future__ import annotations

import numpy as np

from explorer.mechanism.tilt_torsion import rotation_from_tilt_torsion
from explorer.numerics.arrays import FloatArray
from explorer.optimise.demands import AZIMUTHS
from explorer.optimise.search.demands.geometry import BoxDemand, GapDemand, Measured
from explorer.optimise.search.state import State


class TiltDemand:
    """The required box within the workspace of one tilted orientation.

    Args:
        start: The problem where a run starts.
        azimuth: Azimuth of the tilt from home's yaw, in degrees.
        tilt: The tilt, in degrees.
    """

    is_equality = False
    is_limit = True

    def __init__(self, start: State, azimuth: float, tilt: float) -> None:
        self.turn: FloatArray = rotation_from_tilt_torsion((azimuth, tilt, 0.0))
        tilted = start.turned(self.turn)
        self.box, self.gap = BoxDemand(tilted), GapDemand(start)
        where = f", tilted by {tilt:g}° towards {azimuth:g}° from home's yaw"
        self.names = tuple(f"{name}{where}" for name in (*self.box.names, *self.gap.names))

    def measure(self, state: State) -> Measured:
        """Return the slacks of the box and of the gap of the carriages."""
        tilted = state.turned(self.turn)
        box, gap = self.box.measure(tilted), self.gap.measure(tilted)
        return Measured(
            np.concatenate([box.values, gap.values]), np.vstack([box.gradients, gap.gradients])
        )


def tilt_demands(start: State, tilt: float) -> list[TiltDemand]:
    """Return the demands of a tilt in every azimuth of `AZIMUTHS`."""
    azimuths = np.linspace(0.0, 360.0, AZIMUTHS, endpoint=False)
    return [TiltDemand(start, azimuth, tilt) for azimuth in azimuths.tolist()]
