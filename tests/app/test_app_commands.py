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
from collections.abc import Generator
from contextlib import contextmanager
from typing import Any

import msgspec
import pytest
import viser
from desk import CLIENT
from page_props import shown_by

import explorer.app
from explorer.app.browser.viser_server import start_viser, stop_viser
from explorer.app.features.designs.saved_designs import SavedDesigns
from explorer.app.features.forces.actions import SetForce
from explorer.app.features.listed import FEATURES
from explorer.app.features.machine.actions import SetToolAngle
from explorer.app.features.optimise.actions import Advance as ShowIterates, Compare, EndRun, GiveUp
from explorer.app.features.orientation.actions import GoToTilt, SetTiltTorsion
from explorer.app.features.paths.actions import Advance as PlayOn, SetPathTime, TakePlan
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
from explorer.app.widgets.commands import CAMERA_KEYS, PALETTE_KEY, Key, offers
from explorer.app.widgets.palette import Command, Palette
from explorer.app.widgets.pieces import widgets
from explorer.errors import ExplorerError
from explorer.files.manual import read_page
from explorer.mechanism.design_file import PRESETS

pytestmark = pytest.mark.usefixtures("idle_workers")

OF_VALUES = (
    SetJoint, SetPosition, SetAngle, SetPose, Jog, SetTiltTorsion, SetToolAngle, GoToTilt, SetForce,
    SetVariable, SetName, SetPathTime, PickDesign, BrushAxis, BrushBox,
)  # fmt: skip
"""Actions that take a value, which a slider, a field, a map or a handle gives."""

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
    "Start", "Goal", "Format", "Size (px)", "Pin another design", "Study", "Across", "Up",
    "Coloured by",
}  # fmt: skip
"""Lists of which an option alone does nothing, or whose options come and go."""

CONTROL_KEYS = {label: keys for feature in FEATURES for label, keys in feature.keys.items()}
OPEN_LISTS = {label for feature in FEATURES for label in feature.lists}

# What browsers do with keys; undo and redo are theirs too, and meant for pages.
BROWSER_KEYS = {f"Ctrl+{key}" for key in "ACDEFGHIJLNOPQRSTUVWX0123456789"} | {
    f"Ctrl+Shift+{key}" for key in "ABCDEIJKMNOPQRTVW"
}


@pytest.fixture(scope="module")
def palette(running: Running) -> Palette:
    return running.page.palette


@pytest.fixture
def bare() -> Generator[viser.ViserServer]:
    server = start_viser("127.0.0.1", 0)
    yield server
    stop_viser(server)


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
            if label in OF_BROWSERS or label.startswith(("Page › ", "Export › ")):
                continue
            command.run(CLIENT)
        saved = running.page.services.get(SavedDesigns)
        assert saved.wait_until_idle()
        commands = {type(each) for each in requests}
    conditional = {each for each, label in WHERE_IT_IS_SHOWN.items() if label in labelled(palette)}
    others = set(OF_VALUES) | set(OF_NOBODY)
    assert actions() - commands - conditional - others == set(), "no command, and no reason why"
    assert commands & others == set(), "a command after all"


def commands_on(server: viser.ViserServer) -> dict[str, Any]:
    """Return viser's handles of the commands that a page has, by their labels."""
    gui: Any = server.gui
    return {each.label: each for each in gui._command_handle_from_uuid.values()}


def test_saved_design_is_opened_by_a_command_of_its_name(running: Running) -> None:
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


def test_names_and_keys_of_commands_are_unique(palette: Palette) -> None:
    labels = [command.label for command in palette.commands]
    assert len(labels) > 100
    assert len(set(labels)) == len(labels)
    keys = [str(key) for command in palette.commands for key in command.keys]
    assert len(set(keys)) == len(keys)
    with pytest.raises(ValueError, match="two commands"):
        palette.add(Command(labels[0], "Nothing.", lambda _: None))


def keys_of(palette: Palette) -> dict[str, tuple[Key, ...]]:
    """Return the keys of the commands that have any."""
    return {command.label: command.keys for command in palette.commands if command.keys}


def test_every_key_belongs_to_a_command_and_not_to_browser_camera_or_palette(
    palette: Palette,
) -> None:
    owned = keys_of(palette)
    assert len(CONTROL_KEYS) == sum(len(feature.keys) for feature in FEATURES)
    assert CONTROL_KEYS.items() <= owned.items()
    assert set(CHIP_KEYS) <= set(owned)
    for key in itertools.chain.from_iterable(owned.values()):
        assert str(key) not in BROWSER_KEYS
        # viser's camera looks at the letter, whatever else is held down.
        assert key.key not in CAMERA_KEYS
        assert key != PALETTE_KEY


def test_manual_lists_every_key_and_no_other(palette: Palette) -> None:
    section = read_page("page.md").partition("## Keys")[2].partition("\n## ")[0]
    _, *rows = re.findall(r"^\|.*\| (.+) \|$", section, flags=re.MULTILINE)
    listed = {key for row in rows for key in re.split(r", | or ", row)}
    keys = keys_of(palette)
    card = {str(key) for key in keys["Page › Keys"]}
    assert listed | card == {str(key) for key in itertools.chain.from_iterable(keys.values())}


def test_every_list_is_offered_or_chosen_in_its_panel(running: Running) -> None:
    lists = {widget.label for widget in widgets(running.viser) if widget.kind == "list"}
    assert lists - OPEN_LISTS - CHOSEN_IN_THE_PANEL == set()


def test_hint_names_the_keys_that_do_the_same(running: Running, palette: Palette) -> None:
    found = 0
    for widget in widgets(running.viser):
        for label in offers(widget, OPEN_LISTS):
            for key in CONTROL_KEYS.get(label, ()):
                assert f" {key}" in widget.hint
                found += 1
    # The keys of buttons in markup stand in hints there.
    markup = " ".join(
        str(value) for name, value in shown_by(running).items() if name.endswith(" content")
    )
    for label, keys in keys_of(palette).items():
        if label.startswith(("View ›", "Edit ›", "Optimise ›", "Show › Dr")) or label in CHIP_KEYS:
            found += sum(f" {key}" in markup for key in keys)
    assert found > 20


def test_command_is_ready_only_if_it_can_be_done(running: Running, palette: Palette) -> None:
    commands, session = labelled(palette), running.page.session
    other_side = commands["Workspace › Cut open › other side"]
    assert not other_side.is_ready()
    commands["Workspace › Cut open › across x"].run(CLIENT)
    assert session.wait_until_idle()
    assert session.state.view.workspace.cut == "x"
    assert other_side.is_ready()
    disabled = {label: each.disabled for label, each in commands_on(running.viser).items()}
    assert disabled["Workspace › Cut open › other side"] is False
    assert disabled["Optimise › Cancel"] is True
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


def test_control_used_from_the_palette_has_its_new_value(bare: viser.ViserServer) -> None:
    events: list[tuple[object, object]] = []
    folder = bare.gui.add_folder("Around")
    with folder:
        box = bare.gui.add_checkbox("On", initial_value=False)
    box.on_update(lambda event: events.append((event.client_id, event.target.value)))
    (widget,) = widgets(bare)
    before = time.time()
    widget.use(CLIENT, True)
    assert events == [(CLIENT.client_id, True)]
    assert box.value is True
    assert box.update_timestamp >= before
    # What lies hidden in a folder is not in use.
    assert widget.path == ("Around",)
    assert widget.is_in_use
    folder.visible = False
    assert not widget.is_in_use


def test_control_of_a_value_or_a_file_is_no_command(bare: viser.ViserServer) -> None:
    bare.gui.add_slider("Long", 0.0, 1.0, 0.1, 0.5)
    bare.gui.add_upload_button("File")
    assert [offers(widget) for widget in widgets(bare)] == [{}, {}]
