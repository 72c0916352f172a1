"""The scene: made once, then only assigned to, frame by frame.

All new values are computed first and assigned in one block, which the browsers apply
together; viser sends only what differs.
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import Protocol

import viser

from explorer.app.assigning import Update
from explorer.app.compare_feed import CompareFeed
from explorer.app.scene.bodies import Bodies
from explorer.app.scene.clearance import ClearanceScene
from explorer.app.scene.compared import ComparedScene
from explorer.app.scene.flags import Flags
from explorer.app.scene.jog import JogScene
from explorer.app.scene.legs import Legs, TwinLegs
from explorer.app.scene.marks import DragHandle, Ghosts, Labels
from explorer.app.scene.path import PathScene
from explorer.app.scene.placing import Placed
from explorer.app.scene.prototype import PrototypeScene
from explorer.app.scene.required_box import RequiredBox
from explorer.app.scene.singular import BallScene, EllipsoidScene, NearestGhost
from explorer.app.scene.swept import SweptTetrahedra
from explorer.app.scene.tetrahedra import Tetrahedra
from explorer.app.scene.workspace import WorkspaceScene
from explorer.app.workspace_feed import WorkspaceFeed


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
