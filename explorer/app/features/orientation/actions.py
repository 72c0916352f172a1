"""Actions on the orientation in azimuth, tilt and torsion.

The platform turns about the point whose position is shown, which stays in its place.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

from explorer.app.state.action import Action
from explorer.app.state.actions import moved
from explorer.app.state.state import State
from explorer.mechanism.tilt_torsion import TiltTorsion, pose_of_tilt_torsion
from explorer.numerics.number_text import format_number

ANGLES = ("azimuth", "tilt", "torsion")
FULL_TURN = 360.0


@dataclass(frozen=True)
class SetTiltTorsion(Action):
    """Set azimuth, tilt or torsion, 0 to 2, in degrees."""

    axis: int
    value: float

    def apply(self, state: State) -> State:
        """Return the next state."""
        angles = list(state.tilt_torsion)
        angles[self.axis] = self.value
        return _tilted(state, TiltTorsion(*angles))

    def words(self) -> str:
        """Return what the action does."""
        return f"{ANGLES[self.axis]} = {format_number(self.value, 6, size=FULL_TURN)}°"


@dataclass(frozen=True)
class GoToTilt(Action):
    """Tilt the platform in an azimuth at its present torsion; angles in degrees."""

    azimuth: float
    tilt: float

    def apply(self, state: State) -> State:
        """Return the next state."""
        return _tilted(state, TiltTorsion(self.azimuth, self.tilt, state.tilt_torsion.torsion))

    def words(self) -> str:
        """Return what the action does."""
        tilt, azimuth = (format_number(angle, 4) for angle in (self.tilt, self.azimuth))
        return f"Tilt {tilt}° towards {azimuth}°"


def _tilted(state: State, angles: TiltTorsion) -> State:
    """Return the state with azimuth, tilt and torsion in degrees, which it keeps as they are."""
    orientation = pose_of_tilt_torsion(state.pose.position, angles)
    pose = state.pose_at(state.position, orientation)
    return replace(moved(state, pose), set_tilt_torsion=angles)
