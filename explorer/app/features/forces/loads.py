"""The present pose under the load of the page, for the panel and the scene."""

from __future__ import annotations

import msgspec

from explorer.app.features.feature import Services
from explorer.app.features.forces.tasks import (
    NearestDrawing,
    WeightsDrawing,
    WeightsRequest,
    nearest_position,
    weights_of_parts,
)
from explorer.app.session.feed import Feed
from explorer.app.state.frame import Frame
from explorer.app.state.state import State
from explorer.mechanism.machine import Six
from explorer.statics.loaded import LoadedPose
from explorer.statics.reactions import has_limits
from explorer.statics.weights import Weights


class WeightsFeed(Feed[WeightsRequest, WeightsDrawing]):
    """The weights of platform and legs, while they count."""

    def __init__(self, services: Services) -> None:
        super().__init__(services.worker, weights_of_parts, _weights_of, services.session.redraw)

    @property
    def weights(self) -> Weights | None:
        """The weights; None while there are none or none count."""
        return None if self.drawing is None else self.drawing.weights


def _weights_of(frame: Frame) -> WeightsRequest | None:
    view = frame.state.view
    if view.forces.weighed != "payload and legs":
        return None
    design = msgspec.structs.replace(frame.state.design, name="")
    return WeightsRequest(design, view.prototype.density)


class Loads:
    """The loaded pose of the present frame, which the panel and the scene share."""

    def __init__(self, services: Services) -> None:
        self.weights = services.get(WeightsFeed)
        self._kept: tuple[tuple[State, Weights | None], LoadedPose] | None = None

    def of(self, frame: Frame) -> LoadedPose:
        """Return the pose of a frame under its load and the weights that count."""
        state, weights = frame.state, self.weights.weights
        if self._kept is not None:
            (kept_state, kept_weights), loaded = self._kept
            if kept_state is state and kept_weights is weights:
                return loaded
        weighs_payload = state.view.forces.weighed != "none"
        loaded = LoadedPose(state.design, state.pose, load_of(state), weights, weighs_payload)
        self._kept = (state, weights), loaded
        return loaded


class NearestFeed(Feed[LoadedPose, NearestDrawing]):
    """The nearest position that holds the load, while the present one does not."""

    def __init__(self, services: Services) -> None:
        loads = services.get(Loads)

        def request_of(frame: Frame) -> LoadedPose | None:
            loaded = loads.of(frame)
            return loaded if has_limits(loaded.design) and loaded.share > 1.0 else None

        super().__init__(services.worker, nearest_position, request_of, services.session.redraw)


def load_of(state: State) -> Six:
    """Return the load at the tool as (F; M), base axes, in N and N × unit."""
    forces, units = state.view.forces, 1e3 / state.design.unit_mm
    fx, fy, fz = forces.force
    mx, my, mz = (units * each for each in forces.moment)
    return fx, fy, fz, mx, my, mz
