"""Commands: all that can be done is offered once, by a key that is nobody else's, and does it."""

from __future__ import annotations

import contextlib
import importlib
import inspect
import itertools
import pkgutil
import re
import threading
import time
from collections.abc import Callable, Generator, Iterator
from contextlib import contextmanager
from typing import Any

import msgspec
import pytest
import viser
from page_props import shown_by

import explorer.app
from explorer.app.browser.viser_server import start_viser, stop_viser
from explorer.app.features.designs.saved_designs import SavedDesigns
from explorer.app.features.forces.actions import SetForce
from explorer.app.features.listed import FEATURES
from explorer.app.features.machine.actions import SetToolAngle
from explorer.app.features.optimise.actions import (
    Advance as ShowIterates,
    Compare,
    EndRun,
    GiveUp,
)
from explorer.app.features.orientation.actions import GoToTilt, SetTiltTorsion
from explorer.app.features.paths.actions import (
    Advance as PlayOn,
    SetPathTime,
    TakePlan,
)
from explorer.app.features.precision.actions import SetTolerances
from explorer.app.features.singularity.actions import Jog
from explorer.app.features.studies.actions import BrushAxis, BrushBox, PickDesign
from explorer.app.features.view.camera_buttons import HINTS as CAMERA_HINTS
from explorer.app.features.workspace.panel import KEYS as CHIP_KEYS
from explorer.app.server import Running
from explorer.app.session.gestures import UserAction
from explorer.app.session.session import UNDO, Session
from explorer.app.state.actions import (
    MarkSaved,
    SetAngle,
    SetJoint,
    SetName,
    SetPose,
    SetPosition,
    SetVariable,
    StartThere,
)
from explorer.app.state.state import State
from explorer.app.widgets.commands import (
    CAMERA_KEYS,
    PALETTE_KEY,
    Key,
    offers,
    with_keys,
)
from explorer.app.widgets.palette import Command, Palette
from explorer.app.widgets.pieces import Widget, widgets
from explorer.errors import ExplorerError
from explorer.files.manual import read_page
from explorer.mechanism.design_file import PRESETS

OF_VALUES = {
    SetJoint: "sliders of the legs",
    SetPosition: "sliders of the pose",
    SetAngle: "sliders of the pose",
    SetPose: "the handle at b4",
    Jog: "sliders of one margin",
    SetTiltTorsion: "sliders of tilt and torsion",
    SetToolAngle: "sliders of the tool",
    GoToTilt: "the map of tilts",
    SetForce: "fields and arrow of the load",
    SetVariable: "sliders of the design",
    SetName: "the name of a design",
    SetPathTime: "slider of the time",
    PickDesign: "points of a study's plots",
    BrushAxis: "brushes of a study's plots",
    BrushBox: "brushes of a study's plots",
}
"""Actions that ask for a value, each with the control that gives it."""

OF_NOBODY = (UserAction, MarkSaved, ShowIterates, PlayOn, EndRun, GiveUp, Compare, TakePlan)
"""Actions that nobody asks for: they tell of what goes on, or stand for another."""

OF_BROWSERS = {f"View › {name}" for name in (*CAMERA_HINTS, "Reset layout")}
"""Commands that change the camera or the panels of one browser, which there is none of."""

WHERE_IT_IS_SHOWN = {
    StartThere: "Workspace › Go there",
    SetTolerances: "Precision › Set these tolerances",
}
"""Actions of commands that do nothing unless something is shown."""

CHOSEN_IN_THE_PANEL = {
    "Start",
    "Goal",
    "Format",
    "Size (px)",
    "Pin another design",
    "Study",
    "Across",
    "Up",
    "Coloured by",
}
"""Lists of which an option alone does nothing, or whose options come and go."""

CONTROL_KEYS = {label: keys for feature in FEATURES for label, keys in feature.keys.items()}
OPEN_LISTS = {label for feature in FEATURES for label in feature.lists}

# What browsers do with keys; undo and redo are theirs too, and meant for pages.
BROWSER_KEYS = {f"Ctrl+{key}" for key in "ACDEFGHIJLNOPQRSTUVWX0123456789"} | {
    f"Ctrl+Shift+{key}" for key in "ABCDEIJKMNOPQRTVW"
}


class Browser:
    """A browser, as far as commands know one."""

    client_id = 7


CLIENT: Any = Browser()


@pytest.fixture(scope="module")
def palette(running: Running) -> Palette:
    return running.page.palette


@pytest.fixture
def bare() -> Generator[viser.ViserServer]:
    made = start_viser("127.0.0.1", 0)
    yield made
    stop_viser(made)


def labelled(palette: Palette) -> dict[str, Command]:
    return {command.label: command for command in palette.commands}


def actions() -> set[type]:
    """Return every action of the app: what its modules define and can be applied."""
    found: set[type] = set()
    for module in pkgutil.walk_packages(explorer.app.__path__, "explorer.app."):
        for name, each in inspect.getmembers(importlib.import_module(module.name), inspect.isclass):
            is_action = hasattr(each, "apply") and hasattr(each, "__dataclass_fields__")
            if is_action and each.__module__ == module.name and not name.startswith("_"):
                found.add(each)
    return found


@contextmanager
def heard(session: Session) -> Generator[list[object]]:
    """Keep what this thread asks for; neither that is done, nor what others tell of it later."""
    asked: list[object] = []
    asks = threading.current_thread()

    def post(_key: object, change: Any, **_: object) -> None:
        if threading.current_thread() is not asks:
            return
        # What a state refuses is refused to whoever asks.
        with contextlib.suppress(ExplorerError):
            asked.append(change(session.state) if callable(change) else change)

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(session, "post", post)
        yield asked
    # The controls that were used go back to what is.
    session.redraw()
    assert session.wait_until_idle()


def test_every_action_is_a_command_or_asks_for_a_value(running: Running, palette: Palette) -> None:
    with heard(running.page.session) as asked:
        for label, command in labelled(palette).items():
            # The others do something to one browser, or send it a file.
            if label in OF_BROWSERS or label.startswith(("Page › ", "Export › ")):
                continue
            command.run(CLIENT)
        saved = running.page.services.get(SavedDesigns)
        assert saved.wait_until_idle()
        reached = {type(each) for each in asked}
    shown = {action for action, label in WHERE_IT_IS_SHOWN.items() if label in labelled(palette)}
    told = set(OF_VALUES) | set(OF_NOBODY)
    assert actions() - reached - shown - told == set(), "no command, and no word on why"
    assert reached & told == set(), "a command after all"


def commands_on(server: viser.ViserServer) -> dict[str, Any]:
    """Return viser's handles of the commands that a page has, by their labels."""
    gui: Any = server.gui
    return {each.label: each for each in gui._command_handle_from_uuid.values()}


def test_saved_designs_are_opened_by_name(running: Running) -> None:
    session, saved = running.page.session, running.page.services.get(SavedDesigns)

    def offered() -> dict[str, Any]:
        assert saved.wait_until_idle()
        assert session.wait_until_idle()
        return commands_on(running.viser)

    design = msgspec.structs.replace(PRESETS["paper-initial"], name="mine")
    saved.save(design)
    command = offered()["Designs › Open mine"]
    for trigger in command._impl.trigger_cb:
        trigger(viser.CommandEvent(CLIENT, CLIENT.client_id, command))
    offered()
    assert session.state.design == design
    session.travel(UNDO)
    saved.delete("mine")
    assert "Designs › Open mine" not in offered()


def test_commands_that_stay_the_same_object_are_not_looked_at_again(
    bare: viser.ViserServer,
) -> None:
    class Watched(tuple[Command, ...]):
        looks = 0

        def __iter__(self) -> Iterator[Command]:
            self.looks += 1
            return super().__iter__()

    palette = Palette(bare)
    ours = Watched([Command("Ours", "Open this.", lambda _: None)])
    theirs = Watched([Command("Theirs", "Open that.", lambda _: None)])
    for _ in range(3):
        palette.offer("ours", ours)
        palette.offer("theirs", theirs)
        assert commands_on(bare).keys() == {"Ours", "Theirs"}
    assert (ours.looks, theirs.looks) == (1, 1)
    palette.offer("ours", ())
    assert commands_on(bare).keys() == {"Theirs"}


def test_names_and_keys_are_told_apart(palette: Palette) -> None:
    labels = [command.label for command in palette.commands]
    assert len(labels) > 100
    assert len(set(labels)) == len(labels)
    keys = [str(key) for command in palette.commands for key in command.keys]
    assert len(set(keys)) == len(keys)


def keys_of(palette: Palette) -> dict[str, tuple[Key, ...]]:
    """Return the keys of the commands that have any."""
    return {command.label: command.keys for command in palette.commands if command.keys}


def test_every_key_belongs_to_a_command_and_to_one_owner(palette: Palette) -> None:
    assert len(CONTROL_KEYS) == sum(len(feature.keys) for feature in FEATURES)
    assert CONTROL_KEYS.items() <= keys_of(palette).items()
    assert set(CHIP_KEYS) <= set(keys_of(palette))


def test_no_key_is_taken_from_the_browser_the_camera_or_the_palette(palette: Palette) -> None:
    for key in itertools.chain.from_iterable(keys_of(palette).values()):
        assert str(key) not in BROWSER_KEYS
        # viser's camera looks at the letter, whatever else is held down.
        assert key.key not in CAMERA_KEYS
        assert key != PALETTE_KEY


def test_manual_lists_every_key_and_no_other(palette: Palette) -> None:
    section = read_page("page.md").partition("## Keys")[2].partition("\n## ")[0]
    _, *rows = re.findall(r"^\|.*\| (.+) \|$", section, flags=re.MULTILINE)
    told = {key for row in rows for key in re.split(r", | or ", row)}
    keys = keys_of(palette)
    card = {str(key) for key in keys["Page › Keys"]}
    assert told | card == {str(key) for key in itertools.chain.from_iterable(keys.values())}


def test_two_commands_of_one_name_are_refused(palette: Palette) -> None:
    twin = Command(palette.commands[0].label, "Nothing.", lambda _: None)
    with pytest.raises(ValueError, match="two commands"):
        palette.add(twin)


def test_every_list_is_offered_or_chosen_in_its_panel(running: Running) -> None:
    lists = {widget.label for widget in widgets(running.viser) if widget.kind == "list"}
    assert lists - OPEN_LISTS - CHOSEN_IN_THE_PANEL == set()


def test_a_hint_tells_the_keys_that_do_the_same(running: Running, palette: Palette) -> None:
    told = 0
    for widget in widgets(running.viser):
        for label in offers(widget, OPEN_LISTS):
            for key in CONTROL_KEYS.get(label, ()):
                assert f" {key}" in widget.hint
                told += 1
    # The keys of buttons in markup stand in hints there.
    markup = " ".join(
        str(value) for name, value in shown_by(running).items() if name.endswith(" content")
    )
    for label, keys in keys_of(palette).items():
        if label.startswith(("View ›", "Edit ›", "Optimise ›", "Show › Dr")) or label in CHIP_KEYS:
            told += sum(f" {key}" in markup for key in keys)
    assert told > 20


def test_keys_are_told_behind_the_hint() -> None:
    assert with_keys("Go.", ()) == "Go."
    assert with_keys("Go.", (Key("Z", "cmd/ctrl"),)) == "Go. Key: Ctrl+Z."
    redo = (Key("Z", "cmd/ctrl+shift"), Key("Y", "cmd/ctrl"))
    assert with_keys("Go.", redo) == "Go. Keys: Ctrl+Shift+Z, Ctrl+Y."


def test_only_what_can_be_done_can_be_chosen(running: Running, palette: Palette) -> None:
    commands = labelled(palette)
    session = running.page.session
    assert not commands["Workspace › Cut open › other side"].is_ready()
    commands["Workspace › Cut open › across x"].run(CLIENT)
    assert running.page.wait_until_drawn()
    assert session.state.view.workspace.cut == "x"
    assert commands["Workspace › Cut open › other side"].is_ready()
    disabled = {label: each.disabled for label, each in commands_on(running.viser).items()}
    assert disabled["Workspace › Cut open › other side"] is False
    assert disabled["Optimise › Cancel"] is True
    # What the diagram leads to can be done whether or not it is shown.
    strata = [label for label in commands if label.startswith("Singularity › Go to (")]
    assert len(strata) == 23
    assert all(commands[label].is_ready() for label in strata)


SWITCHES: dict[str, Callable[[State], bool]] = {
    "Show › Grid": lambda state: state.view.grid,
    "Prototype › Show the parts": lambda state: state.view.drawn_as == "prototype",
    "Show › All tetrahedra": lambda state: state.view.tetrahedra == (True, True, True),
    "Workspace › Convex hull": lambda state: state.view.workspace.hull,
}


@pytest.mark.parametrize("label", SWITCHES)
def test_a_switch_switches_and_switches_back(
    running: Running, palette: Palette, label: str
) -> None:
    session = running.page.session
    command, read = labelled(palette)[label], SWITCHES[label]
    was = read(session.state)
    for expected in (not was, was):
        command.run(CLIENT)
        assert session.wait_until_idle()
        assert read(session.state) == expected


def test_modes_follow_one_another_in_both_ways(running: Running, palette: Palette) -> None:
    session, commands = running.page.session, labelled(palette)
    first = session.state.mode
    seen = [first]
    for _ in range(8):
        commands["Pose › Next assembly mode"].run(CLIENT)
        assert session.wait_until_idle()
        seen.append(session.state.mode)
    assert sorted(seen[:8]) == list(range(8))
    assert seen[8] == first
    commands["Pose › Previous assembly mode"].run(CLIENT)
    assert session.wait_until_idle()
    assert session.state.mode == seen[7]


def test_undo_and_redo_are_the_session_s(running: Running, palette: Palette) -> None:
    session, commands = running.page.session, labelled(palette)
    commands["Design › Preset › paper-initial"].run(CLIENT)
    assert session.wait_until_idle()
    moves = (("Undo", "paper-optimal"), ("Redo", "paper-initial"), ("Undo", "paper-optimal"))
    for label, expected in moves:
        commands[f"Edit › {label}"].run(CLIENT)
        assert session.wait_until_idle()
        assert session.state.design.name == expected


def test_a_control_used_from_the_palette_shows_its_new_value_everywhere(
    bare: viser.ViserServer,
) -> None:
    heard_of: list[tuple[object, object]] = []
    with bare.gui.add_folder("Around"):
        box = bare.gui.add_checkbox("On", initial_value=False)
    box.on_update(lambda event: heard_of.append((event.client_id, event.target.value)))
    (widget,) = widgets(bare)
    before = time.time()
    widget.use(CLIENT, True)
    assert heard_of == [(7, True)]
    assert box.value is True
    assert box.update_timestamp >= before
    # Late browsers get it too.
    sent = [m for m in _kept(bare) if getattr(m, "updates", None) == {"value": True}]
    assert len(sent) == 1


def _kept(server: viser.ViserServer) -> list[Any]:
    internals: Any = server
    return list(internals._websock_server._broadcast_buffer.message_from_id.values())


def test_what_lies_hidden_in_a_folder_is_not_in_use(bare: viser.ViserServer) -> None:
    folder = bare.gui.add_folder("Around")
    with folder:
        bare.gui.add_button("Push")
    (widget,) = widgets(bare)
    assert widget.path == ("Around",)
    assert widget.is_in_use
    folder.visible = False
    assert not widget.is_in_use


def test_nothing_is_offered_of_what_holds_a_value() -> None:
    server = start_viser("127.0.0.1", 0)
    try:
        server.gui.add_slider("Long", 0.0, 1.0, 0.1, 0.5)
        server.gui.add_upload_button("File")
        assert [offers(widget) for widget in widgets(server)] == [{}, {}]
        assert isinstance(next(widgets(server)), Widget)
    finally:
        stop_viser(server)
