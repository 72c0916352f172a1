"""The worker's tasks for loads: the weights of the parts, and the nearest position that holds."""

from __future__ import annotations

from dataclasses import dataclass

from explorer.app.state.state import State
from explorer.mechanism.design import Design
from explorer.mechanism.machine import Six
from explorer.mechanism.pose import Pose
from explorer.statics.loaded import LoadedPose
from explorer.statics.weights import Weights
from explorer.workspace.nearest_carrying import nearest_carrying_pose


@dataclass(frozen=True)
class WeightsRequest:
    """A request for the weights of platform and legs.

    Attributes:
        design: The manipulator.
        density: Density of all parts, in kg/m³.
    """

    design: Design
    density: float


def weights_of_parts(request: WeightsRequest) -> Weights:
    """Return the weights of the prototype's parts, without the payload.

    Raises:
        ExplorerError: The design has no prototype.
    """
    from explorer.prototype.assembly import make_prototype
    from explorer.prototype.weights import machine_weights

    masses = make_prototype(request.design).masses(request.density)
    return machine_weights(request.design, masses, payload=False)


@dataclass(frozen=True)
class NearestDrawing:
    """The nearest position that holds a load.

    Attributes:
        pose: The pose there; None if none was found.
    """

    pose: Pose | None


def nearest_position(request: LoadedPose) -> NearestDrawing:
    """Return the nearest position that holds the load of a pose."""
    return NearestDrawing(nearest_carrying_pose(request))


def load_of(state: State) -> Six:
    """Return the load at the tool as (F; M), base axes, in N and N × unit."""
    forces, units = state.view.forces, 1e3 / state.design.unit_mm
    fx, fy, fz = forces.force
    mx, my, mz = (units * each for each in forces.moment)
    return fx, fy, fz, mx, my, mz
