"""Features and commands as the page takes them: controls set values, keys are nobody else's."""

from __future__ import annotations

import contextlib
import importlib
import inspect
import itertools
import pkgutil
import re
import threading
from collections.abc import Generator, Iterator, Mapping
from contextlib import contextmanager
from typing import Any, NamedTuple, cast

import msgspec
import numpy as np
import pytest
from desk import CLIENT
from page_widgets import Widget, widgets
from server_clock import wait_until_drawn

import explorer.app
from explorer.app.features.designs.feature import SavedDesigns
from explorer.app.features.feature import Feature, Services, Tab
from explorer.app.features.help.guide import end_course
from explorer.app.features.help.lessons import arrange
from explorer.app.features.help.manual import list_entries
from explorer.app.features.help.search import RUN, SearchDialog
from explorer.app.features.history.feature import take_session
from explorer.app.features.loads.load import WEIGHTS_FEED, set_force
from explorer.app.features.machine.feature import set_tool_angle
from explorer.app.features.optimise.actions import add_iterates, compare, end_run
from explorer.app.features.orientation.work import TILTS_FEED, go_to_tilt, set_tilt_torsion
from explorer.app.features.paths.actions import SetLaw, advance_journey, set_path_time, take_plan
from explorer.app.features.paths.stops import choose_stop
from explorer.app.features.requirement.state import open_found
from explorer.app.features.sharing.links import open_link
from explorer.app.features.studies.folders import StudyFolders
from explorer.app.features.studies.state import pick_design
from explorer.app.features.view.feature import CAMERA_HINTS
from explorer.app.features.workspace.words import CLAIM
from explorer.app.inputs.bindings import At, Control, ControlBinding
from explorer.app.inputs.controls import Controls
from explorer.app.page import FEATURES, Page
from explorer.app.scene.placing import Placed, ScenePart
from explorer.app.server import Running, start
from explorer.app.session.feed import Feed
from explorer.app.session.history import UserAction
from explorer.app.session.session import UNDO, Session
from explorer.app.state.actions import Act, Set, mark_saved, set_name
from explorer.app.state.frame import Frame
from explorer.app.state.geometry import set_variable
from explorer.app.state.moves import (
    set_angle,
    set_fold,
    set_joint,
    set_pose,
    set_position,
    start_there,
)
from explorer.app.state.parts import value_at, with_value
from explorer.app.storage.user_data import open_user_data
from explorer.app.widgets.chips import StateCommand
from explorer.errors import ExplorerError
from explorer.files.packaged import read_page
from explorer.mechanism.design_file import PRESETS
from explorer.numerics.arrays import FloatArray
from explorer.page.widgets.assigning import Update
from explorer.page.widgets.palette import PALETTE_KEY, Command, Key, Palette

pytestmark = pytest.mark.usefixtures("idle_jobs")

OPTIMAL = PRESETS["paper-optimal"]


class BoundControl(NamedTuple):
    """A control that shows and sets the value at a path; a list has values by its words."""

    handle: Any
    at: At
    options: Mapping[str, object] | None


def other_value(widget: Widget) -> Any:
    """Return a value that a browser could send, another than the one that is shown."""
    handle = widget.handle
    if widget.kind == "switch":
        return not handle.value
    if widget.kind == "list":
        return next(each for each in handle.options if each != handle.value)
    if isinstance(cast("object", handle.value), tuple):
        return tuple(value + handle.step for value in cast("tuple[float, ...]", handle.value))
    is_below = handle.max is None or handle.value < handle.max
    return handle.value + (handle.step if is_below else -handle.step)


@contextmanager
def start_with(features: tuple[Feature, ...]) -> Generator[Page]:
    """Start an explorer with some features."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr("explorer.app.page.FEATURES", features)
        running = start(OPTIMAL, port=0)
    try:
        yield running.page
    finally:
        running.stop()


@pytest.fixture(scope="module")
def controls() -> list[BoundControl]:
    return []


@pytest.fixture(scope="module")
def running(
    tmp_path_factory: pytest.TempPathFactory, controls: list[BoundControl]
) -> Generator[Running]:
    studies = StudyFolders(tmp_path_factory.mktemp("studies"))
    with pytest.MonkeyPatch.context() as patch:
        record_controls(patch, controls)
        running = start(OPTIMAL, port=0, user_data=open_user_data(resume=False), studies=studies)
    yield running
    running.stop()


# Controls by the time of their making, as long as the page is made.
def record_controls(patch: pytest.MonkeyPatch, controls: list[BoundControl]) -> None:
    """Record each control that is made with a path from here on."""
    sources: dict[int, tuple[At, Mapping[str, object] | None]] = {}
    control_type: Any = Control
    bind, initialise = At.bound, control_type.__post_init__

    def bind_and_record(at: At, name: str, options: Any = None) -> ControlBinding[Any]:
        bound = bind(at, name, options)
        sources[id(bound.write)] = at, options
        return bound

    def record(control: Control[Any]) -> None:
        initialise(control)
        source = sources.get(id(control.bound.write))
        if source is not None:
            controls.append(BoundControl(control.handle, *source))

    patch.setattr(At, "bound", bind_and_record)
    patch.setattr(Control, "__post_init__", record)


def test_control_with_a_path_sets_the_value_there_and_no_other(
    running: Running, controls: list[BoundControl]
) -> None:
    page, session = running.page, running.page.session
    by_handle = {id(widget.handle): widget for widget in widgets(running.viser)}
    assert len(controls) > 35
    for handle, at, options in controls:
        widget = by_handle[id(handle)]
        name = f"{widget.label} at {at.path}"
        before, shown, given = session.state, handle.value, other_value(widget)
        widget.use(CLIENT, given)
        assert session.wait_until_idle()
        after, meant = session.state, at.convert(given) if options is None else options[given]
        assert value_at(after, at.path) == meant != value_at(before, at.path), name
        if at.action is Set:
            assert after == with_value(before, at.path, meant), name
        assert handle.value == given, name
        if at.path.startswith("view."):
            # What is shown is no step of the history.
            assert session.history.at == 0, name
            session.do(Set("view", before.view))
        else:
            session.do(UNDO)
        assert wait_until_drawn(page)
        assert session.state == before, name
        assert handle.value == shown, name


@pytest.mark.parametrize("feature", FEATURES, ids=lambda feature: feature.name)
def test_page_with_the_mechanism_and_one_feature_starts_and_draws(feature: Feature) -> None:
    """Without the mechanism there is nothing to look at; no feature needs another one."""
    features = tuple(each for each in FEATURES if each.name in ("mechanism", feature.name))
    with start_with(features) as page:
        page.session.do(Set("view.labels", False))
        assert wait_until_drawn(page)
        assert np.isfinite(page.corners()).all()
        titles = {tab.title for each in features for tab in each.tabs}
        folders = {each.path[0] for each in widgets(page.services.server) if each.path}
        assert folders <= titles


class MarkerPanel:
    """A panel with one switch."""

    def __init__(self, services: Services) -> None:
        self._controls = Controls(services)
        self._controls.checkbox(
            "Ghost platforms", "Draw the other modes.", "view.ghosts", keys=(Key("6"),)
        )

    def updates(self, frame: Frame) -> Iterator[Update]:
        """Yield what makes the panel show the frame."""
        yield from self._controls.updates(frame)


class Marker(ScenePart):
    """A ball high above b4."""

    def __init__(self, services: Services) -> None:
        self.ball = services.scene.add_icosphere("/marker", radius=0.1, visible=False)

    def updates(self, placed: Placed) -> Iterator[Update]:
        """Yield what draws the ball."""
        yield self.ball, "visible", True
        yield self.ball, "position", tuple(self.corners(placed)[0].tolist())

    def corners(self, placed: Placed) -> FloatArray:
        """Return the centre of the ball."""
        return (placed.points["b4"] + [0.0, 0.0, 70.0])[None]


MARKER = Feature(
    "marker",
    tabs=(Tab("analyse", "Marker", MarkerPanel),),
    scene=(Marker,),
    commands=(
        StateCommand(
            "Marker › Warn at three",
            "Warn early.",
            lambda _: Set("view.warn_below", 3.0),
            keys=(Key("5"),),
        ),
    ),
)


def test_new_feature_appears_on_the_page_in_the_palette_and_in_the_scene() -> None:
    with start_with((*FEATURES, MARKER)) as page:
        (widget,) = (each for each in widgets(page.services.server) if each.path == ("Marker",))
        assert widget.label == "Ghost platforms"
        assert widget.hint.endswith("Key: 6.")
        commands = {each.label: each for each in page.palette.commands}
        for label, key in (("Marker › Warn at three", "5"), ("Marker › Ghost platforms", "6")):
            assert commands[label].keys == (Key(key),)
            commands[label].run(CLIENT)
        assert wait_until_drawn(page)
        view = page.session.state.view
        assert (view.warn_below, view.ghosts) == (3.0, True)
        ball = page.services.get(Marker).ball
        assert ball.visible
        top = Placed(Frame(page.session.state)).points["b4"] + [0.0, 0.0, 70.0]
        assert tuple(ball.position) == pytest.approx(top.tolist())
        assert page.corners().max(axis=0)[2] == pytest.approx(top[2])


def test_scene_without_panels_has_the_feeds_that_it_draws() -> None:
    running = start(OPTIMAL, port=0, panels=False)
    try:
        page = running.page
        page.session.do(Set("view.tilts", True))
        page.session.do(Set("view.forces.weighed", "payload and legs"))
        assert page.session.wait_until_idle()
        get = page.services.get
        feeds: tuple[Feed[Any, Any], ...] = (get(TILTS_FEED), get(WEIGHTS_FEED))
        assert all(feed.request is not None for feed in feeds)
    finally:
        running.stop()


OF_VALUES = (
    set_joint, set_position, set_angle, set_pose, set_tilt_torsion, set_tool_angle, go_to_tilt,
    set_force, set_fold, set_variable, set_name, set_path_time, SetLaw, choose_stop, pick_design,
    open_found, open_link, take_session,
)  # fmt: skip
"""Actions that take a value, which a slider, a field, a map, a handle or a file gives."""

OF_NOBODY = (
    UserAction,
    mark_saved,
    add_iterates,
    advance_journey,
    end_run,
    compare,
    take_plan,
    end_course,
    arrange,
)
"""Actions that nobody asks for: they tell of what goes on, or stand for another."""

OF_BROWSERS = {f"View › {name}" for name in (*CAMERA_HINTS, "Reset layout")} | {
    f"{answer} › Copy the command line"
    for answer in ("Loads › Forces", "Loads › Precision", "Singularity", "Workspace › Clearance")
}
"""Commands that change the camera, the panels or the clipboard of one browser: none is there."""

WHERE_IT_IS_SHOWN = {start_there: "Workspace › Go there"}
"""Actions of commands that do nothing unless something is shown."""

# What browsers do with keys; undo and redo are theirs too, and meant for pages.
BROWSER_KEYS = {f"Ctrl+{key}" for key in "ACDEFGHIJLNOPQRSTUVWX0123456789"} | {
    f"Ctrl+Shift+{key}" for key in "ABCDEIJKMNOPQRTVW"
}


@pytest.fixture(scope="module")
def palette(running: Running) -> Palette:
    return running.page.palette


def labelled(palette: Palette) -> dict[str, Command]:
    return {command.label: command for command in palette.commands}


def actions() -> set[object]:
    """Return every action of the app: what its modules define and can be applied."""
    found: set[object] = {Set}
    for module in pkgutil.walk_packages(explorer.app.__path__, "explorer.app."):
        for name, each in vars(importlib.import_module(module.name)).items():
            is_kind = inspect.isclass(each) and issubclass(each, Set)
            is_made = getattr(each, "__code__", None) is set_joint.__code__
            if (is_kind or is_made) and not name.startswith("_"):
                found.add(each)
    return found


def kind_of(action: Any) -> object:
    """Return what makes an action: its class, or the function that was made one."""
    made_by = [made for made in actions() if inspect.isfunction(made)]
    changes = {inspect.getclosurevars(made).nonlocals["change"]: made for made in made_by}
    if isinstance(action, Act):
        return changes[action.change]
    return cast("object", type(action))


@contextmanager
def record_requests(session: Session) -> Generator[list[object]]:
    """Keep what this thread requests without doing it, and ignore other threads' requests."""
    requests: list[object] = []
    this_thread = threading.current_thread()

    def post(_key: object, change: Any, **_: object) -> None:
        if threading.current_thread() is not this_thread:
            return
        # What a state refuses is refused to whoever requests it.
        with contextlib.suppress(ExplorerError):
            requests.append(change(session.state) if callable(change) else change)

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(session, "post", post)
        yield requests
    # The controls that were used go back to the present values.
    session.redraw()
    assert session.wait_until_idle()


def test_every_action_is_a_command_or_takes_a_value(running: Running, palette: Palette) -> None:
    with record_requests(running.page.session) as requests:
        for label, command in labelled(palette).items():
            # The others do something to one browser, or send it a file.
            if label in OF_BROWSERS or label.startswith(("Page › ", "Export › ", "Lessons › ")):
                continue
            command.run(CLIENT)
        saved = running.page.services.get(SavedDesigns)
        assert saved.wait_until_idle()
        commands = set(map(kind_of, requests))
    conditional = {each for each, label in WHERE_IT_IS_SHOWN.items() if label in labelled(palette)}
    others = set(OF_VALUES) | set(OF_NOBODY)
    assert actions() - commands - conditional - others == set(), "no command, and no reason why"
    assert commands & others == set(), "a command after all"


def test_switch_that_is_used_again_before_it_is_drawn_is_back(
    running: Running, palette: Palette
) -> None:
    session = running.page.session
    (switch,) = (each for each in palette.commands if each.keys == (Key("G"),))
    before = session.state.view.grid
    for times in (2, 3):
        for _ in range(times):
            switch.run(CLIENT)
        assert session.wait_until_idle()
        assert (session.state.view.grid == before) == (times == 2)


def test_saved_design_is_opened_by_a_command_of_its_name(running: Running) -> None:
    session, saved = running.page.session, running.page.services.get(SavedDesigns)

    def offered() -> dict[str, Command]:
        assert saved.wait_until_idle()
        assert session.wait_until_idle()
        return {each.label: each for each in running.page.services.get(SearchDialog).commands}

    design = msgspec.structs.replace(PRESETS["paper-initial"], name="mine")
    saved.save(design)
    assert "Designs › Open mine" in offered()
    running.page.buttons.press(RUN, "Designs › Open mine", CLIENT)
    offered()
    assert session.state.design == design
    session.do(UNDO)
    saved.delete("mine")
    assert "Designs › Open mine" not in offered()


def test_names_and_keys_of_commands_are_unique(running: Running, palette: Palette) -> None:
    labels = [command.label for command in palette.commands]
    assert len(labels) > 100
    assert len(set(labels)) == len(labels)
    keys = [str(key) for command in palette.commands for key in command.keys]
    assert len(set(keys)) == len(keys)
    with pytest.raises(ValueError, match="two commands"):
        Palette(running.viser, (Command("A › B", "Nothing.", lambda _: None),) * 2)


def keys_of(palette: Palette) -> dict[str, tuple[Key, ...]]:
    """Return the keys of the commands that have any."""
    return {command.label: command.keys for command in palette.commands if command.keys}


def test_every_key_belongs_to_a_command_and_not_to_browser_camera_or_palette(
    palette: Palette,
) -> None:
    owned = keys_of(palette)
    for key in itertools.chain.from_iterable(owned.values()):
        # A browser would save the page as a file, which shows nothing.
        assert str(key) not in BROWSER_KEYS - {"Ctrl+S"}
        # viser's camera looks at the letter, whatever else is held down; it is told of no Ctrl+S.
        assert key.key not in "WASDQE" or str(key) == "Ctrl+S"
        assert key != PALETTE_KEY


def test_manual_entries_have_names_of_their_own_and_each_tab_has_one() -> None:
    names, _, targets = zip(*list_entries(), strict=True)
    assert len(set(names)) == len(names)
    assert "δ2 (glossary)" in names
    assert CLAIM in targets
    assert {feature.manual for feature in FEATURES} <= {*targets, ""}
    # A tab that features share has the mark of the first.
    marked = dict[str, str]()
    for feature, tab in ((each, tab) for each in FEATURES for tab in each.tabs):
        marked.setdefault(tab.title, feature.manual)
        assert marked[tab.title] or tab.place == "dialog", tab.title


def test_question_mark_of_a_tab_opens_a_sentence_before_any_formula() -> None:
    for feature in (each for each in FEATURES if each.manual):
        file, _, heading = feature.manual.partition("#")
        text = read_page(file)
        section = text[text.index(f"# {heading}\n") :] if heading else text
        # Below the heading, and pictures.
        paragraphs = [each for each in section.split("\n\n")[1:] if not each.startswith("![")]
        assert re.match(r"[*`A-Z]", paragraphs[0]), feature.manual
        assert not re.search(r"^```|=|^\|", paragraphs[0], re.MULTILINE), feature.manual


def test_manual_lists_every_key_and_no_other(palette: Palette) -> None:
    section = read_page("page.md").partition("## Keys")[2].partition("\n## ")[0]
    _, *rows = re.findall(r"^\|.*\| (.+) \|$", section, flags=re.MULTILINE)
    listed = {key for row in rows for key in re.split(r", | or ", row)}
    keys = keys_of(palette)
    card = {str(key) for key in keys["Page › Keys"]}
    assert listed | card == {str(key) for key in itertools.chain.from_iterable(keys.values())}


def test_command_is_ready_only_if_it_can_be_done(running: Running, palette: Palette) -> None:
    commands, session = labelled(palette), running.page.session
    other_side = commands["Workspace › Cut open › other side"]
    assert not other_side.is_ready()
    commands["Workspace › Cut open › across x"].run(CLIENT)
    assert session.wait_until_idle()
    assert session.state.view.workspace.cut == "x"
    assert other_side.is_ready()
    assert not commands["Optimise › Cancel"].is_ready()
    # What the diagram leads to can be done whether or not it is shown.
    strata = [label for label in commands if label.startswith("Singularity › Go to (")]
    assert len(strata) == 23
    assert all(commands[label].is_ready() for label in strata)


def test_assembly_modes_follow_one_another_in_both_ways(running: Running, palette: Palette) -> None:
    session, commands = running.page.session, labelled(palette)
    modes = [session.state.mode]
    for way in (*["Next"] * 8, "Previous"):
        commands[f"Pose › {way} assembly mode"].run(CLIENT)
        assert session.wait_until_idle()
        modes.append(session.state.mode)
    assert sorted(modes[:8]) == list(range(8))
    assert modes[8] == modes[0]
    assert modes[9] == modes[7]


def test_undo_and_redo_are_those_of_the_session(running: Running, palette: Palette) -> None:
    session, commands = running.page.session, labelled(palette)
    for label, expected in (
        ("Design › Preset › paper-initial", "paper-initial"),
        ("Edit › Undo", "paper-optimal"),
        ("Edit › Redo", "paper-initial"),
        ("Edit › Undo", "paper-optimal"),
    ):
        commands[label].run(CLIENT)
        assert session.wait_until_idle()
        assert session.state.design.name == expected


UNITS = re.compile(
    r"design units|units³|cm³|\bunits\b|\bmm\b|millimetres|pixels|\(px\)|°|degrees|\(s\)|seconds"
    r"|kg/m³|m/s²|\bstep\b|\bkg\b|\bN( m)?\b|\bGPa\b|\bMPa\b"
)

WITHOUT_UNIT = {
    "Starts": "a count of designs",
    "Magnification (0: automatic)": "a ratio",
    "Exploded": "a share, from 0 to 1",
    "Go to step": "the number of a step",
    "Number of designs": "a count of designs",
    "Name": "a name",
    "Direction": "a direction, of length 1",
    "Length ratio": "a ratio",
    "Transmission": "an index, from 0 to 1",
}
"""Controls of values that have no unit, and what they are."""

OUT_OF_SIGHT = {"Presses on markup"}
"""What the page writes to and nobody reads."""


def test_control_has_a_hint_and_one_of_a_value_tells_its_unit(running: Running) -> None:
    session, titles = running.page.session, ("Limits (mm)", "Limits (units)")
    for lengths, title, other in (("design units", *titles[::-1]), ("mm", *titles)):
        session.do(Set("view.lengths", lengths))
        assert session.wait_until_idle()
        words = {words for each in widgets(running.viser) for words in (*each.path, each.label)}
        assert title in words
        assert other not in words
    assert not any(re.search(r"\b(?<!1 )units?\b", each) for each in words - {"1 unit (mm)"})
    found = [each for each in widgets(running.viser) if each.label not in OUT_OF_SIGHT]
    assert len(found) > 100
    for widget in found:
        words = " ".join((*widget.path, widget.label, widget.hint))
        assert widget.hint.endswith("."), f"{words} ends in no sentence"
        tells_unit = UNITS.search(words) or widget.label in WITHOUT_UNIT
        assert tells_unit or widget.kind != "value", words
