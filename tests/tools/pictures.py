"""The named scenes that the README shows, and the script that makes their pictures again.

From the checkout, all of them or only some: python tests/tools/pictures.py [names]
"""

from __future__ import annotations

import base64
import datetime as dt
import io
import sys
from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

sys.path.insert(0, str(Path(__file__).resolve().parents[1] / "support"))

import msgspec
import numpy as np
from machines import PRESS
from PIL import Image
from playwright.sync_api import Browser, FloatRect, Page
from server_clock import wait_until_drawn

from explorer.app.features.compare.feature import pin
from explorer.app.features.compare.work import CompareView
from explorer.app.features.optimise.actions import start_run
from explorer.app.features.optimise.state import OptimisationRequest
from explorer.app.features.requirement.state import EXAMPLE, open_found
from explorer.app.features.sharing.reporting import make_report
from explorer.app.features.studies.folders import StudyFolders
from explorer.app.features.studies.state import Brush, brush_axes, open_study, pick_design, within
from explorer.app.scene.camera import ViewName
from explorer.app.screenshot import draw_page, open_page, settle, stable_picture
from explorer.app.server import FIRST_DESIGN, Running, start
from explorer.app.state.actions import Action, Set, open_design
from explorer.app.state.geometry import set_variable
from explorer.app.state.moves import set_joint, set_pose, set_position
from explorer.app.state.view import (
    ForcesView,
    PrecisionView,
    PrototypeView,
    SingularView,
    View,
    WorkspaceView,
)
from explorer.export.moving_page import moving_page
from explorer.mechanism.design import JOINTS
from explorer.mechanism.design_file import PRESETS, typical_machine
from explorer.mechanism.folds import pose_of_folds
from explorer.mechanism.pose import Pose
from explorer.optimise.defaults import CLEARANCE, PAPER_VOLUME, paper_start
from explorer.page.browser.headless import headless_browser
from explorer.six_legged.files import TABLES
from explorer.sweep.results import load_results
from explorer.sweep.run import run_study
from explorer.sweep.study import STUDIES, Sampling
from explorer.sweep.workers import LocalWorkers
from explorer.workspace.accessible.radii import with_radius

FOLDER = Path(__file__).resolve().parents[2] / "assets" / "pictures"
DESIGN = PRESETS["paper-optimal"]

REPORT_DATE = dt.date(2026, 1, 1)
REPORT_SHEETS = ("header", "section:nth-of-type(2)", "section:nth-of-type(3)")
REPORT_STYLE = (
    "body{margin:0;padding:20px;display:flex;gap:20px;background:#dfe3e8}"
    "img{width:400px;box-shadow:0 1px 6px rgb(28 37 48/.25)}"
)

# The moving picture: the folds at its start, the last φ2, which is flat at -180°, the frames from
# one to the other, their times in milliseconds, at its ends and between, and what it shows of the
# window: scene and verdict, without the panel on the left, the bar and the drawer.
FOLDS, LAST_FOLD, FRAMES = (14.4, 46.0, 98.0, -141.0, -122.5, 61.0), -205.0, 18
REST_TIME, FRAME_TIME = 900, 90
MOVING_SIZE, SHOWN = (1280, 720), (300, 46, 1280, 676)

LOAD = ForcesView(force=(0.0, 0.0, -40.0))

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
        tab: Title of the tab to which they are turned, or of the folder that is opened; the first
            tab if None.
        size: Width and height in pixels.
    """

    pose: Pose | None = None
    actions: tuple[Action, ...] = ()
    view: ViewName = "isometric"
    panels: bool = False
    tab: str | None = None
    size: tuple[int, int] = (1280, 800)


def bare(**changes: Any) -> Action:
    """Return the action that shows the bare mechanism and what the changes add."""
    return Set("view", replace(BARE, **changes))


SCENES = {
    "home": Scene(),
    "page": Scene(panels=True, actions=(open_found(PRESETS[FIRST_DESIGN], EXAMPLE),)),
    # δ2 is small, the other two are not: both lines are orange and all else is blue.
    "near-singular": Scene(
        pose=Pose.of_yaw_pitch_roll((9, 8, 7.5), (-38, 24, 8)),
        actions=(Set("view", View(handle=False)),),
        panels=True,
    ),
    # From the side no two of the eight names lie on one another.
    "modes": Scene(
        actions=(bare(ghosts=True, flags=False, grid=False),), view="side", size=(900, 800)
    ),
    # All four leaves are seen from their faces, and no arc lies on another.
    "strip": Scene(
        pose=pose_of_folds([14.4, 46, 88, -60, -70, 70]),
        actions=(bare(leaves=True, bodies=False, legs=False, grid=False),),
        size=(960, 600),
    ),
    "unclosed": Scene(
        actions=(Set("view.coordinates", "lengths"), set_joint(JOINTS.index("l1"), 20.0)),
        panels=True,
    ),
    # Tall, so that the whole diagram is in it.
    "strata": Scene(
        pose=Pose.of_yaw_pitch_roll((10, 5, 9), (-73.1, 12, 0)),
        actions=(
            Set("view", View(handle=False, singular=SingularView(strata=True, ghost="nearest"))),
        ),
        panels=True,
        tab="More",
        size=(1280, 1200),
    ),
    "twin": Scene(actions=(Set("view", View(handle=False, drawn_as="6-4 twin")),)),
    "workspace": Scene(actions=(bare(workspace=WorkspaceView(solid=True)),)),
    "workspace-cut": Scene(
        actions=(bare(workspace=WorkspaceView(solid=True, colour="margin", cut="y", level=5.0)),)
    ),
    # Cut open as above, so that the tilts inside are seen.
    "tilt": Scene(
        actions=(bare(tilts=True, workspace=WorkspaceView(cut="y", level=5.0)),),
        panels=True,
        tab="Tilt",
        size=(1280, 900),
    ),
    # Where legs 2 and 4 collide, low on both sides, shows through the solid.
    "accessible": Scene(
        actions=(
            Set("design.limits", with_radius(DESIGN, 0.2).limits),
            bare(workspace=WorkspaceView(solid=True, region="accessible")),
        )
    ),
    "forces": Scene(
        actions=(
            open_design(PRESS),
            set_position(2, 6.0),
            bare(
                flags=False,
                grid=False,
                forces=ForcesView(shown=True, force=(-6.0, 14.0, -9.0), scale=30.0),
            ),
        ),
        panels=True,
        tab="Loads",
    ),
    "precision": Scene(
        actions=(
            open_design(typical_machine(PRESS)[0]),
            set_position(2, 7.0),
            bare(
                flags=False,
                grid=False,
                forces=ForcesView(force=(40.0, 10.0, -20.0)),
                precision=PrecisionView(deflected=True, ellipsoid=True),
            ),
        ),
        panels=True,
        tab="Loads",
        # Tall, so that the precision below the forces is in it.
        size=(1280, 1200),
    ),
    # Shares grow beyond all bounds towards the base plane.
    "load-share": Scene(
        actions=(
            open_design(PRESS),
            bare(
                forces=LOAD, workspace=WorkspaceView(solid=True, colour="share", cut="y", level=5.0)
            ),
        ),
        panels=True,
        tab="Workspace",
        size=(1280, 900),
    ),
    "held": Scene(
        actions=(
            open_design(PRESS),
            bare(forces=LOAD, workspace=WorkspaceView(solid=True, region="held")),
        ),
        panels=True,
        tab="Workspace",
    ),
    # Half apart, so that each part is seen and where it belongs too.
    "prototype": Scene(
        actions=(
            bare(
                flags=False,
                labels=False,
                drawn_as="prototype",
                prototype=PrototypeView(exploded=0.5),
            ),
        ),
        panels=True,
        tab="Prototype",
        size=(1280, 1000),
    ),
    "machine": Scene(
        actions=(open_design(PRESS), Set("view", View(handle=False))), panels=True, tab="Machine"
    ),
    # What is left of the paper's optimum when a3 comes nearer, beside both rows of Table 1 and a
    # table on six legs.
    "compare": Scene(
        actions=(
            bare(),
            pin(DESIGN),
            pin(PRESETS["paper-initial"]),
            pin(TABLES["octahedral"]),
            set_variable("a3x", 17.0),
            Set("compared.look", CompareView(overlay=True)),
        ),
        panels=True,
        tab="Compare",
        size=(1280, 800),
    ),
    # The paper's problem; a search is the same each time, so that its end can be shown.
    "optimise": Scene(
        actions=(
            open_design(paper_start()),
            bare(),
            Set(
                "optimisation.request",
                OptimisationRequest(volume=PAPER_VOLUME, clearance=CLEARANCE),
            ),
            start_run(),
        ),
        panels=True,
        tab="Optimise",
    ),
}


def draw(
    browser: Browser, scene: Scene, alter: Callable[[Running], None] = lambda _: None
) -> bytes:
    """Return the picture of a scene as PNG, of an explorer that is altered before."""
    running = start(DESIGN, scene.pose, view=View(handle=True), port=0, panels=scene.panels)
    try:
        alter(running)
        for action in scene.actions:
            running.page.session.do(action)
        assert wait_until_drawn(running.page, 60.0), "the explorer does not come to rest"
        return draw_page(
            browser,
            running,
            view=scene.view,
            size=scene.size,
            panels=scene.panels,
            tab=scene.tab,
        )
    finally:
        running.stop()


def draw_report(browser: Browser) -> bytes:
    """Return a picture of three sheets of the report."""
    html = make_report(DESIGN, date=REPORT_DATE).decode()
    # A sheet of A4 on the screen, beside which the page's ground is seen.
    width, height = 794, 1123
    page = browser.new_page(viewport={"width": 900, "height": height}, device_scale_factor=1.5)
    page.set_content(html)
    sheets: list[str] = []
    for selector in REPORT_SHEETS:
        top = page.locator(selector).evaluate("each => each.getBoundingClientRect().top + scrollY")
        clip = {"x": 53.0, "y": float(top) - 40.0, "width": width, "height": height}
        shot = page.screenshot(clip=FloatRect(**clip), full_page=True)
        sheets.append(base64.b64encode(shot).decode())
    images = "".join(f'<img src="data:image/png;base64,{each}">' for each in sheets)
    page.set_content(f"<style>{REPORT_STYLE}</style>{images}")
    page.set_viewport_size({"width": 1280, "height": 608})
    data = page.screenshot()
    page.close()
    return data


def pull_drawer(page: Page, pixels: int) -> None:
    """Drag the upper edge of the drawer up."""
    edge = page.locator("[data-ex=drawer] > [data-dock-resize=top]").bounding_box()
    assert edge is not None
    x, y = edge["x"] + 0.5 * edge["width"], edge["y"] + 0.5 * edge["height"]
    page.mouse.move(x, y)
    page.mouse.down()
    page.mouse.move(x, y - pixels, steps=5)
    page.mouse.up()


def draw_studies(browser: Browser) -> bytes:
    """Return a picture of a study: a brush, and a design of the front that was picked."""
    study = STUDIES["trade-off"]
    study = msgspec.structs.replace(study, sampling=Sampling(count=512, seed=1))
    with TemporaryDirectory() as home:
        folder = Path(home) / study.name
        with LocalWorkers() as workers:
            run_study(study, folder, workers)
        results = load_results(folder)
        # The largest clearance among the designs within the brush.
        brushes = (Brush("volume", ((4000.0, 7000.0),)),)
        inside = results.front() & within(results.columns, brushes)
        rows = np.flatnonzero(inside)
        row = int(rows[results.columns["clearance"][rows].argmax()])
        index = int(results.columns["index"][row])
        running = start(DESIGN, port=0, studies=StudyFolders(Path(home)))
        try:
            session, jobs = running.page.session, running.page.services.jobs
            session.do(bare())
            session.do(open_study(study.name))
            session.do(pick_design(results.design_of_row(row), index=index, study=study.name))
            session.do(brush_axes(brushes))
            session.wait_until_idle()
            assert jobs.wait_until_idle(60.0)
            session.wait_until_idle()
            page, client = open_page(browser, running, (1280, 1000))
            page.get_by_role("tab", name="Studies", exact=True).click()
            page.locator("[data-plot]").nth(1).wait_for()
            # The drawer moves until it is open.
            settle(page, client)
            pull_drawer(page, 300)
            settle(page, client)
            running.page.point_cameras("isometric")
            settle(page, client)
            return stable_picture(page)
        finally:
            running.stop()


def draw_motion(browser: Browser) -> bytes:
    """Return a moving picture: the platform goes through a flat fold and back."""
    r, beta, epsilon, first, second, third = FOLDS
    turn = 0.5 - 0.5 * np.cos(np.linspace(0.0, np.pi, FRAMES))
    frames: list[Image.Image] = []
    running = start(DESIGN, pose_of_folds(FOLDS), view=View(handle=False), port=0)
    try:
        page, client = open_page(browser, running, MOVING_SIZE, hold=True)
        settle(page, client)
        running.page.point_cameras("isometric")
        for fold in second + (LAST_FOLD - second) * turn:
            pose = pose_of_folds([r, beta, epsilon, first, fold, third])
            running.page.session.do(set_pose(pose))
            assert wait_until_drawn(running.page, 60.0)
            settle(page, client)
            page.evaluate("window.explorer.drawFrame()")
            frames.append(Image.open(io.BytesIO(stable_picture(page))).crop(SHOWN))
    finally:
        running.stop()
    rests = [REST_TIME, *[FRAME_TIME] * (FRAMES - 2)]
    data = io.BytesIO()
    frames[0].save(
        data,
        "WEBP",
        save_all=True,
        append_images=[*frames[1:], *frames[-2:0:-1]],
        duration=[*rests, *rests],
        loop=0,
        quality=70,
    )
    return data.getvalue()


def draw_moving_page(browser: Browser) -> bytes:
    """Return a picture of the page that moves by itself."""
    page = browser.new_page(viewport={"width": 1280, "height": 720})
    page.set_content(moving_page(DESIGN).decode())
    page.wait_for_timeout(1000)
    data = page.screenshot()
    page.close()
    return data


PICTURES: dict[str, Callable[[Browser], bytes]] = {
    **{name: partial(draw, scene=scene) for name, scene in SCENES.items()},
    "report": draw_report,
    "moving-page": draw_moving_page,
    "studies": draw_studies,
    "fold.webp": draw_motion,
}


def main(names: list[str]) -> None:
    """Make the pictures with these names, or all."""
    unknown = sorted(set(names) - set(PICTURES))
    if unknown:
        sys.exit(f"no picture {', '.join(unknown)}; there are {', '.join(PICTURES)}")
    FOLDER.mkdir(exist_ok=True)
    with headless_browser() as browser:
        for name in names or PICTURES:
            out = FOLDER / (name if "." in name else f"{name}.png")
            out.write_bytes(PICTURES[name](browser))
            print(out)


if __name__ == "__main__":
    main(sys.argv[1:])
