"""Lines of the scene are created with the kind of colours that they get later."""

from __future__ import annotations

from typing import Any

import numpy as np
import viser

from explorer.app.features.feature import Services
from explorer.app.page import FEATURES
from explorer.app.scene.placing import Placed
from explorer.app.state.frame import Frame
from explorer.app.state.state import open_state
from explorer.mechanism.design_file import PRESETS

DESIGN = PRESETS["paper-optimal"]


def test_line_of_the_scene_has_the_kind_of_colours_that_it_gets_later(
    server: viser.ViserServer, services: Services
) -> None:
    # A line made with one colour and then given many is white if it was drawn in between.
    shapes: dict[int, tuple[int, ...]] = {}

    class Recorder(viser.SceneApi):
        def add_line_segments(self, *args: Any, **kwargs: Any) -> viser.LineSegmentsHandle:
            handle = super().add_line_segments(*args, **kwargs)
            shapes[id(handle)] = np.shape(handle.colors)
            return handle

    server.scene.__class__ = Recorder
    placed = Placed(Frame(open_state(DESIGN)))
    parts = [part(services) for feature in FEATURES for part in feature.scene]
    updates = [update for part in parts for update in part.updates(placed)]
    given = {id(h): np.shape(np.asarray(v)) for h, name, v in updates if name == "colors"}
    assert len(given) > 3
    assert given == {number: shapes[number] for number in given}
