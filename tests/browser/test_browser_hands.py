"""Hands in a real page: the palette and keys, both themes, the tour, and room on small screens."""

from __future__ import annotations

import re
from collections.abc import Callable, Generator, Iterator
from contextlib import closing, contextmanager

import numpy as np
import pytest
from playwright.sync_api import Browser, FloatRect, Locator
from tab import Tab

from explorer.app.features.help.lessons import TOUR, list_courses
from explorer.app.features.optimise.state import Optimisation
from explorer.app.layout import DRAWER_HEIGHT, NARROW
from explorer.app.scene.camera import framing
from explorer.app.screenshot import SCENE_CANVAS
from explorer.app.server import start
from explorer.app.state.moves import set_position
from explorer.app.state.state import State, open_state
from explorer.mechanism.design_file import PRESETS

OpenWindow = Callable[[tuple[int, int]], Tab]

# A small laptop's screen, and a tablet either way up.
SIZES = ((1280, 720), (1024, 768), (768, 1024))
LEAST_SHARE = 0.4
TABS = {
    *("Pose", "Design", "Machine"),
    *("Singularity", "Workspace", "Tilt", "Loads", "Prototype"),
    *("Optimise", "Compare", "Paths"),
}
DIALOGS = ("Overlays", "History", "Export", "Help")

# Controls that stick out of what holds them, or of the page, to the left or to the right.
CUT_OFF = """() => {
  const found = [];
  for (const each of document.querySelectorAll('button, input, [role=slider], [role=tab]')) {
    const box = each.getBoundingClientRect();
    const isSeen = each.checkVisibility({visibilityProperty: true});
    if (box.width < 2 || box.height < 2 || !isSeen) continue;
    let left = 0, right = innerWidth;
    const frame = each.closest('.mantine-ScrollArea-viewport');
    if (frame) { const f = frame.getBoundingClientRect(); left = f.left; right = f.right; }
    if (box.left < left - 1 || box.right > right + 1)
      found.push(`${each.tagName} ${each.textContent} from ${box.left} to ${box.right}`);
  }
  return found;
}"""

# Names and widths of the panels at the sides.
WIDTHS = """() => [...document.querySelectorAll("[data-dock-region]")].map((each) =>
    [each.dataset.dockRegion, Math.round(each.getBoundingClientRect().width)])"""


@contextmanager
def page_with(browser: Browser, *, tour: bool = False, dark: bool = False) -> Generator[Tab]:
    """Open the page of an explorer of its own."""
    running = start(PRESETS["paper-optimal"], port=0, tour=tour)
    try:
        with closing(Tab(browser, running, size=SIZES[0], dark=dark)) as tab:
            yield tab
            assert tab.complaints() == []
    finally:
        running.stop()


@pytest.fixture
def open_window(tab: Tab, browser: Browser) -> Iterator[OpenWindow]:
    """Open windows of a size on the explorer of the tab; none may have complained in the end."""
    windows: list[Tab] = []

    def open_one(size: tuple[int, int]) -> Tab:
        windows.append(Tab(browser, tab.running, size=size))
        return windows[-1]

    yield open_one
    for window in windows:
        assert window.complaints() == []
        window.close()


def press(tab: Tab, key: str) -> None:
    tab.page.keyboard.press(key)


def test_command_is_run_by_the_palette_and_by_its_key_but_not_while_one_types(tab: Tab) -> None:
    # In a smaller window the drawer lies over the end of the right panel.
    tab.resize(SIZES[0])
    press(tab, "g")
    tab.wait_for(lambda: not tab.state.view.grid, "no grid")
    press(tab, "n")
    tab.wait_for(lambda: tab.state.mode == 2, "the next mode")
    press(tab, "ControlOrMeta+z")
    tab.wait_for(lambda: tab.state.mode == 1, "undone")
    for key in ("ControlOrMeta+Shift+z", "ControlOrMeta+y"):
        press(tab, key)
        tab.wait_for(lambda: tab.state.mode == 2, "redone")
        press(tab, "ControlOrMeta+z")
        tab.wait_for(lambda: tab.state.mode == 1, "undone again")
    before = tab.state.view
    tab.unfold("More")
    field = tab.field("x")
    field.click()
    field.press_sequentially("glb")
    # Whatever is done by the next key is done after it would have been by these.
    ball = tab.row("Singularity-free ball").locator("input[type=checkbox]")
    ball.click()
    tab.wait_for(lambda: tab.state.view.singular.ball, "the ball")
    assert tab.state.view.grid == before.grid
    assert tab.state.view.labels == before.labels
    # A ticked box and a chosen option let go of the keys.
    tab.wait_for(lambda: not ball.evaluate("e => e === document.activeElement"), "let go")
    press(tab, "g")
    tab.wait_for(lambda: tab.state.view.grid, "the grid")
    tab.choose("Ellipsoid", "speed")
    tab.wait_for(lambda: tab.state.view.singular.ellipsoid == "speed", "the ellipsoid")
    active = "document.activeElement.tagName"
    tab.wait_for(lambda: tab.page.evaluate(active) != "INPUT", "let go")
    press(tab, "g")
    tab.wait_for(lambda: not tab.state.view.grid, "no grid")
    # The search finds commands by their words.
    tab.page.get_by_role("button", name="Search").click()
    search = tab.page.get_by_placeholder("Search commands")
    search.fill("convex hull")
    tab.page.get_by_text("Workspace › Convex hull").wait_for()
    press(tab, "Enter")
    tab.wait_for(lambda: tab.state.view.workspace.hull, "the hull")
    search.wait_for(state="hidden")
    press(tab, "ControlOrMeta+k")
    search.fill("show the parts")
    tab.page.get_by_text("Prototype › Show the parts").first.click()
    tab.wait_for(lambda: tab.state.view.drawn_as == "prototype", "the prototype")
    # A text is found in its tab, which the arrows and Enter open.
    press(tab, "ControlOrMeta+k")
    search.fill("strokes too short")
    # What is found for the text before has that tab, too.
    tab.settle()
    tab.page.get_by_text("in Prototype", exact=True).first.wait_for()
    press(tab, "ArrowUp")
    press(tab, "ArrowDown")
    press(tab, "Enter")
    search.wait_for(state="hidden")
    assert tab.page.get_by_role("tab", name="Prototype").get_attribute("aria-selected") == "true"


def test_dialog_and_card_of_keys_close_by_a_key_by_a_click_beside_and_by_their_buttons(
    tab: Tab,
) -> None:
    for name in DIALOGS:
        dialog = tab.page.get_by_role("dialog", name=name)
        closes = (
            lambda: press(tab, "Escape"),
            lambda: tab.page.mouse.click(5, 300),
            lambda: tab.page.get_by_role("button", name="Close the dialog").click(),
            # The same button of the bar.
            lambda name=name: tab.page.locator(f"[data-opens='{name}']").click(),
        )
        for close in closes:
            tab.open_dialog(name)
            close()
            dialog.wait_for(state="hidden")
    # Only one is open.
    tab.open_dialog("Help")
    tab.open_dialog("Export")
    tab.page.get_by_role("dialog", name="Help").wait_for(state="hidden")
    press(tab, "Escape")
    card = tab.page.get_by_role("dialog")
    for close in (
        lambda: press(tab, "k"),
        lambda: press(tab, "Escape"),
        lambda: tab.page.mouse.click(5, 240),
    ):
        press(tab, "k")
        card.get_by_text("Ctrl+Shift+Z").click()
        assert card.locator("kbd").count() > 40
        # A text that is marked from the dialog outwards leaves it open.
        tab.page.mouse.down()
        tab.page.mouse.move(5, 240)
        tab.page.mouse.up()
        tab.settle()
        assert card.is_visible()
        close()
        card.wait_for(state="hidden")


def open_drawer(tab: Tab) -> Locator:
    """Open the drawer and return it."""
    tab.turn_to("Compare")
    drawer = tab.page.locator("[data-ex=drawer]")
    tab.wait_for(lambda: abs(height_of(drawer) - DRAWER_HEIGHT) < 2, "an open drawer")
    return drawer


def box_of(each: Locator) -> FloatRect:
    found = each.bounding_box()
    assert found is not None
    return found


def height_of(each: Locator) -> float:
    return box_of(each)["height"]


def test_drawer_is_as_wide_as_the_scene_which_ends_above_it(tab: Tab) -> None:
    width, height = SIZES[0]
    tab.resize(SIZES[0])
    drawer, scene = open_drawer(tab), tab.page.locator(SCENE_CANVAS)

    def is_below_the_scene() -> bool:
        low, high = box_of(drawer), box_of(scene)
        beside = (low["x"], low["width"]) == (high["x"], high["width"])
        touches = abs(high["y"] + high["height"] - low["y"]) < 2
        foot = tab.page.viewport_size or {"height": 0}
        at_the_foot = abs(low["y"] + low["height"] - foot["height"]) < 2
        return beside and touches and at_the_foot and low["y"] > 100

    tab.wait_for(is_below_the_scene, "the drawer below the scene")
    for pull in (-150, 200, -400):
        tab.settle()
        before = height_of(drawer)
        x, y = tab.grab(drawer.locator("[data-dock-resize=top]"))
        tab.page.mouse.move(x, y + pull, steps=4)
        tab.page.mouse.up()
        tab.wait_for(lambda before=before: height_of(drawer) != before, "another height")
        tab.wait_for(is_below_the_scene, "the drawer below the scene")
    for less in (150, 250):
        tab.page.set_viewport_size({"width": width, "height": height - less})
        tab.wait_for(is_below_the_scene, "the drawer in a smaller window")
    tab.page.get_by_role("button", name="Minimize panel").click()
    tab.wait_for(lambda: height_of(drawer) < 50, "a closed drawer")
    tab.wait_for(
        lambda: abs(box_of(scene)["y"] + height_of(scene) - box_of(drawer)["y"]) < 2,
        "the scene",
    )


def test_scene_and_camera_recover_from_what_a_loading_page_does_late(tab: Tab) -> None:
    tab.resize(SIZES[0])
    scene = tab.page.locator(SCENE_CANVAS)
    beside = scene.bounding_box()
    assert beside is not None
    assert beside["width"] < SIZES[0][0] - 500
    # Some pages measure the scene before their panels are there.
    tab.page.evaluate("size => window.__viserMutable.syncCanvasSize(...size)", [*SIZES[0]])
    tab.wait_for(lambda: scene.bounding_box() == beside, "the scene beside the panels")
    tab.wait_for(lambda: is_framed(tab), "all in the picture")
    # They move the camera back once they have drawn, after all that they were sent.
    tab.page.evaluate("window.__viserMutable.resetCameraPose(false)")
    tab.settle()
    tab.wait_for(lambda: is_framed(tab), "all in the picture again")


def is_framed(tab: Tab) -> bool:
    """Whether a browser's camera, as it is in the page, frames the mechanism in its picture."""
    x, y, z, aspect = tab.page.evaluate(
        "(({camera: {position: p, aspect}}) => [p.x, p.y, p.z, aspect])(window.__viserMutable)"
    )
    eye, _ = framing(tab.running.page.corners(), "isometric", aspect)
    # In the page, y is up.
    return bool(np.allclose((-z, -x, y), eye, rtol=0.01))


def test_page_in_a_small_window_has_room_and_cuts_nothing_off(tab: Tab) -> None:
    tab.resize(SIZES[0])
    assert_has_room_and_cuts_nothing_off(tab, SIZES[0])


@pytest.mark.parametrize(
    "size", [pytest.param(SIZES[1], marks=pytest.mark.long), SIZES[2]], ids=str
)
def test_page_that_opens_on_a_small_screen_has_room_and_cuts_nothing_off(
    open_window: OpenWindow, size: tuple[int, int]
) -> None:
    assert_has_room_and_cuts_nothing_off(open_window(size), size)


def assert_has_room_and_cuts_nothing_off(tab: Tab, size: tuple[int, int]) -> None:
    def share() -> float:
        box = tab.page.locator(SCENE_CANVAS).bounding_box()
        assert box is not None
        return box["width"] * box["height"] / (size[0] * size[1])

    # In a narrow window the panels are laid out once the browser has told its size.
    tab.wait_for(lambda: LEAST_SHARE <= share() < 1.0, "room for the scene")
    if size[0] < NARROW:
        tab.wait_for(lambda: abs(left_of(tab, "Singularity") - left_of(tab, "Pose")) < 8, "a stack")
    tabs = tab.page.get_by_role("tab")
    names = tabs.all_inner_texts()
    assert {name.strip() for name in names} == TABS
    for name in names:
        tab.turn_to(name.strip())
        tab.wait_for(lambda: tab.page.evaluate(CUT_OFF) == [], f"nothing cut off in {name}")
    for name in DIALOGS:
        tab.open_dialog(name)
        tab.wait_for(lambda: tab.page.evaluate(CUT_OFF) == [], f"nothing cut off in {name}")


def left_of(tab: Tab, name: str) -> float:
    box = tab.page.get_by_role("tab", name=name, exact=True).bounding_box()
    assert box is not None
    return box["x"]


def test_page_is_as_dark_as_the_system_until_a_theme_is_chosen(browser: Browser) -> None:
    with page_with(browser, dark=True) as tab:
        tab.wait_for(lambda: scheme_of(tab) == "dark", "a dark page")
        tab.page.emulate_media(color_scheme="light")
        tab.wait_for(lambda: scheme_of(tab) == "light", "a light page, as the system is now")
        tab.push("Theme")
        tab.wait_for(lambda: scheme_of(tab) == "dark", "what was chosen")
        tab.reload()
        tab.wait_for(lambda: scheme_of(tab) == "dark", "what was chosen in this browser")
        # Its own theme, then again that of the system.
        for dark in (False, True):
            tab.push("Theme")
            # The page may be a light one already.
            tab.settle()
            tab.wait_for(lambda: scheme_of(tab) == "light", "a light page")
            tab.page.emulate_media(color_scheme="dark")
            tab.wait_for(lambda dark=dark: is_dark(tab) is dark, "the theme that counts")
            tab.page.emulate_media(color_scheme="light")


def is_dark(tab: Tab) -> bool:
    return tab.running.page.services.theme.is_dark_for(tab.client.client_id)


def scheme_of(tab: Tab) -> str:
    return str(tab.page.evaluate("document.documentElement.dataset.mantineColorScheme"))


STEPS = list_courses()[TOUR].steps


def test_tour_leads_through_five_steps_once(browser: Browser) -> None:
    with page_with(browser, tour=True) as tab:
        card = tab.page.get_by_text("step 1 of 5")
        card.wait_for()
        # What the user does by hand counts as well.
        tab.push("Home pose")
        tab.type("y", "6")
        tab.page.get_by_text("Done", exact=True).wait_for()
        for number, step in enumerate(STEPS, 1):
            tab.page.get_by_text(step.title, exact=True).last.wait_for()
            tab.page.get_by_text(f"step {number} of 5").wait_for()
            # The step has its tab in front, and its control ringed.
            tab.page.get_by_role("tab", name=step.tab, selected=True).wait_for()
            tab.page.locator("[data-ex-ring]:visible").wait_for()
            if number in (2, 4, 5):
                button_of(tab, "Show me").click()
                # The search of the last step takes minutes on a busy machine.
                tab.page.get_by_text("Done", exact=True).wait_for(timeout=300_000)
            if number < len(STEPS):
                button_of(tab, "Next").click()
        tab.page.get_by_text(re.compile(r"grew from 870\.7 to 8,000 cm³")).wait_for()
        button_of(tab, "Finish").click()
        tab.page.get_by_text("step 5 of 5").wait_for(state="detached")
        wait_until_back(tab)
        assert tab.page.locator("[data-ex-ring]").count() == 0
        # Nothing is lost: the step before the last one has what the search found.
        step = tab.running.page.session.history.steps[-2]
        assert step.words.startswith("Optimise")
        tab.reload()
        tab.settle()
        assert tab.page.get_by_text("of 5").count() == 0
        # By command it begins again, and can be skipped at once.
        tab.open_dialog("Help")
        tab.push("Tour")
        tab.page.get_by_text("step 1 of 5").wait_for()
        for _ in STEPS[1:]:
            button_of(tab, "Next").click()
        # A search that has just begun is cancelled.
        button_of(tab, "Show me").click()
        tab.wait_for(lambda: Optimisation.of(tab.state).is_on, "a search")
        button_of(tab, "Skip the tour").click()
        tab.page.get_by_text("step 5 of 5").wait_for(state="detached")
        wait_until_back(tab)


def wait_until_back(tab: Tab) -> None:
    """Wait until what the tour has changed is as at first, with its tabs and the drawer.

    What was typed in its first step stays.
    """
    first = set_position(1, 0.6).apply(open_state(PRESETS["paper-optimal"]))

    def parts(state: State) -> tuple[object, ...]:
        return state.design, state.pose, state.view

    tab.wait_for(lambda: parts(tab.state) == parts(first), "what was before the tour")
    assert not Optimisation.of(tab.state).is_on
    for name in ("Pose", "Singularity"):
        tab.page.get_by_role("tab", name=name, selected=True).wait_for()
    tab.page.locator("[data-ex=drawer] [data-dock-bar]").wait_for()


def button_of(tab: Tab, words: str) -> Locator:
    return tab.page.get_by_role("button", name=words, exact=True)


def test_lost_connection_is_told_and_leaves_the_layout_as_it_was(browser: Browser) -> None:
    first = start(PRESETS["paper-optimal"], port=0)
    with closing(Tab(browser, first, size=SIZES[0])) as tab:
        tab.turn_to("Workspace")
        tab.settle()
        widths = tab.page.evaluate(WIDTHS)
        first.stop()
        told = tab.page.get_by_text(re.compile(r"has not answered since \d\d:\d\d:\d\d"))
        told.wait_for()
        again = start(PRESETS["paper-optimal"], port=first.viser.get_port())
        try:
            told.wait_for(state="detached")
            tab.label("y").wait_for()
            tab.page.get_by_role("tab", name="Workspace", selected=True).wait_for()
            tab.wait_for(lambda: tab.page.evaluate(WIDTHS) == widths, "panels as wide as before")
        finally:
            again.stop()
