"""The scene: made once, then only assigned to, frame by frame.

All new values are computed first and assigned in one block, which the browsers apply
together; viser sends only what differs.
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import Protocol

import viser

from explorer.app.features.compare.feed import CompareFeed
from explorer.app.features.compare.scene import ComparedScene
from explorer.app.features.legs.clearance import ClearanceScene
from explorer.app.features.legs.swept import SweptTetrahedra
from explorer.app.features.mechanism.flags import Flags
from explorer.app.features.mechanism.legs import Legs, TwinLegs
from explorer.app.features.mechanism.marks import DragHandle, Ghosts, Labels
from explorer.app.features.mechanism.tetrahedra import Tetrahedra
from explorer.app.features.optimise.scene import RequiredBox
from explorer.app.features.paths.scene import PathScene
from explorer.app.features.prototype.scene import PrototypeScene
from explorer.app.features.singularity.jog_scene import JogScene
from explorer.app.features.singularity.scene import BallScene, EllipsoidScene, NearestGhost
from explorer.app.features.workspace.feed import WorkspaceFeed
from explorer.app.features.workspace.scene import WorkspaceScene
from explorer.app.scene.bodies import Bodies
from explorer.app.scene.placing import Placed
from explorer.app.widgets.assigning import Update


class Part(Protocol):
    """A part of the scene."""

    def updates(self, placed: Placed) -> Iterator[Update]:
        """Yield what draws it in this frame."""
        ...


class Scene:
    """All that is drawn in three dimensions."""

    def __init__(
        self, server: viser.ViserServer, feed: WorkspaceFeed, compare_feed: CompareFeed
    ) -> None:
        scene = server.scene
        scene.set_up_direction("+z")
        self.drag_handle = DragHandle(scene)
        # Bodies come first: they make the platform's frame, to which others attach.
        self._parts: tuple[Part, ...] = (
            Bodies(scene),
            Flags(scene),
            Legs(scene),
            TwinLegs(scene),
            PrototypeScene(scene),
            Tetrahedra(scene),
            Labels(scene),
            Ghosts(scene),
            ClearanceScene(scene),
            SweptTetrahedra(scene),
            WorkspaceScene(scene, feed),
            ComparedScene(scene, compare_feed),
            RequiredBox(scene),
            NearestGhost(scene),
            EllipsoidScene(scene),
            BallScene(scene),
            JogScene(scene),
            PathScene(scene),
            self.drag_handle,
        )

    def updates(self, placed: Placed) -> list[Update]:
        """Return what draws this frame, all of it computed."""
        return [update for part in self._parts for update in part.updates(placed)]
