"""The named scenes that the README shows, and the script that makes their pictures again.

From the checkout, all of them or only some: python tests/pictures.py [names]
"""

from __future__ import annotations

import sys
from dataclasses import dataclass, replace
from pathlib import Path

from playwright.sync_api import Browser

from explorer.app.actions import Action, Open, SetJoint, SetLimits, SetView
from explorer.app.optimisation import Wish
from explorer.app.optimising import SetWish, StartRun
from explorer.app.prototype_view import PrototypeView
from explorer.app.scene.camera import ViewName
from explorer.app.screenshot import headless_browser, picture
from explorer.app.server import Running
from explorer.app.singular_actions import Jog
from explorer.app.singular_view import SingularView
from explorer.app.state import View, WorkspaceView
from explorer.design import JOINTS
from explorer.design_file import PRESETS
from explorer.optimise.findings import CLEARANCE, PAPER_VOLUME, paper_start
from explorer.pose import Pose
from explorer.radii import with_radius

FOLDER = Path(__file__).resolve().parents[1] / "assets" / "pictures"
DESIGN = PRESETS["paper-optimal"]

# The mechanism without what would hide the workspace, or hide in it.
BARE = View(handle=False, tetrahedra=(False, False, False))


@dataclass(frozen=True)
class Scene:
    """What a picture shows: the paper's optimum, and what was done to it.

    Attributes:
        pose: Of the platform; the home pose if None.
        actions: Done before the picture is taken.
        view: From where to look.
        panels: Whether the panels are in the picture.
        tab: To which they are turned; the first one if None.
        size: Width and height in pixels.
    """

    pose: Pose | None = None
    actions: tuple[Action, ...] = ()
    view: ViewName = "isometric"
    panels: bool = False
    tab: str | None = None
    size: tuple[int, int] = (1280, 800)


SCENES = {
    "home": Scene(),
    "page": Scene(panels=True),
    # κ2 is small, the other two are not: both lines are orange and all else is blue.
    "near-singular": Scene(
        pose=Pose.of_yaw_pitch_roll((9, 8, 7.5), (-38, 24, 8)),
        actions=(SetView(View(handle=False)),),
        panels=True,
    ),
    # From the side no two of the eight names lie on one another.
    "modes": Scene(
        actions=(
            SetView(
                View(
                    handle=False,
                    ghosts=True,
                    flags=False,
                    grid=False,
                    tetrahedra=(False, False, False),
                )
            ),
        ),
        view="side",
        size=(900, 800),
    ),
    "unclosed": Scene(actions=(SetJoint(JOINTS.index("l1"), 20.0),), panels=True),
    # Tall, so that the whole diagram is in it.
    "strata": Scene(
        pose=Pose.of_yaw_pitch_roll((10, 5, 9), (-73.1, 12, 0)),
        actions=(
            SetView(View(handle=False, singular=SingularView(strata=True, ghost="nearest"))),
            Jog(0, 20.0),
        ),
        panels=True,
        size=(1280, 1300),
    ),
    "twin": Scene(actions=(SetView(View(handle=False, twin=True)),)),
    "workspace": Scene(
        actions=(SetView(replace(BARE, workspace=WorkspaceView(solid=True))),),
    ),
    "workspace-cut": Scene(
        actions=(
            SetView(
                replace(
                    BARE,
                    workspace=WorkspaceView(solid=True, colour="margin", cut="y", level=5.0),
                )
            ),
        ),
    ),
    # Where legs 2 and 4 collide, low on both sides, shows through the solid.
    "reachable": Scene(
        actions=(
            SetLimits(with_radius(DESIGN, 0.2).limits),
            SetView(replace(BARE, workspace=WorkspaceView(solid=True, region="reachable"))),
        ),
    ),
    # Half apart, so that each part is seen and where it belongs too.
    "prototype": Scene(
        actions=(
            SetView(
                replace(
                    BARE,
                    flags=False,
                    labels=False,
                    prototype=PrototypeView(shown=True, exploded=0.5),
                )
            ),
        ),
        panels=True,
        tab="View",
        size=(1280, 1000),
    ),
    # The paper's problem; a search is the same each time, so that its end can be shown.
    "optimise": Scene(
        actions=(
            Open(paper_start()),
            SetView(BARE),
            SetWish(Wish(volume=PAPER_VOLUME, clearance=CLEARANCE)),
            StartRun(),
        ),
        panels=True,
        tab="Optimise",
        size=(1280, 1190),
    ),
}


def draw(browser: Browser, scene: Scene) -> bytes:
    """Return the picture of a scene as PNG."""

    def prepare(running: Running) -> None:
        for action in scene.actions:
            running.page.session.do(action)

    return picture(
        browser,
        DESIGN,
        scene.pose,
        view=scene.view,
        size=scene.size,
        panels=scene.panels,
        tab=scene.tab,
        prepare=prepare,
    )


def main(names: list[str]) -> None:
    """Make the pictures with these names, or all."""
    unknown = sorted(set(names) - set(SCENES))
    if unknown:
        sys.exit(f"no scene {', '.join(unknown)}; there are {', '.join(SCENES)}")
    FOLDER.mkdir(exist_ok=True)
    with headless_browser() as browser:
        for name in names or SCENES:
            out = FOLDER / f"{name}.png"
            out.write_bytes(draw(browser, SCENES[name]))
            print(out)


if __name__ == "__main__":
    main(sys.argv[1:])
