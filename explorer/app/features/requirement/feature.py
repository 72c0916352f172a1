"""*What must it do?*: the form of the requirement, the search for machines, and the checklist."""

from __future__ import annotations

from collections.abc import Callable, Sequence

import viser

from explorer.app.features.feature import Feature, Services, Tab, look_of
from explorer.app.features.requirement import words
from explorer.app.features.requirement.scene import RequiredBox
from explorer.app.features.requirement.state import (
    CHECK_FEED,
    EXAMPLE,
    FORM,
    Required,
    find_machines,
    open_found,
)
from explorer.app.inputs.bindings import At, ControlBinding
from explorer.app.inputs.controls import MAIN, Controls
from explorer.app.session.session import Who
from explorer.app.state.actions import Action, Set
from explorer.app.state.frame import Frame
from explorer.app.state.moves import set_pose
from explorer.app.state.parts import value_at
from explorer.app.state.state import State
from explorer.app.widgets.buttons import open_button
from explorer.app.widgets.markup import beside, box
from explorer.find.answers import FoundDesigns
from explorer.find.requirement import (
    PREFERENCES,
    Requirement,
    decode_requirement,
    encode_requirement,
    legs_from_row,
)
from explorer.jobs.jobs import LongJob
from explorer.jobs.process import CANCELLED

Field = tuple[str, str, float, str]
"""A number of the form: its label, its field, its step, and what it means."""

TASK: Sequence[Field] = (
    ("Largest tilt (°)", "tilt_deg", 1.0, "Largest tilt from home, about any level axis."),
    ("Payload (kg)", "payload.mass_kg", 0.1, "Mass of tool and payload."),
    ("Force (N)", "payload.force_n", 1.0, "Force of the process, of any direction."),
)
LEGS: Sequence[Field] = (
    ("Length ratio", "legs.ratio", 0.05, "Longest over shortest length of a leg."),
    ("Longest (mm)", "legs.longest_mm", 1.0, "Longest leg; 0 for as short as possible."),
    ("Push (N)", "legs.push_n", 10.0, "Largest push of an actuator; 0 for no limit."),
    ("Pull (N)", "legs.pull_n", 10.0, "Largest pull; 0 for the same as the push."),
    ("Diameter (mm)", "legs.diameter_mm", 1.0, "Diameter of the legs."),
    ("Distance (mm)", "legs.apart_mm", 1.0, "Least distance between two legs."),
    ("Swing (°)", "swing_deg", 1.0, "How far a joint swings from home; 0 for no limit."),
)
MORE: Sequence[Field] = (
    ("Leg speed (mm/s)", "legs.speed_mm_s", 10.0, "Largest speed of an actuator."),
    ("Leg accel. (mm/s²)", "legs.acceleration_mm_s2", 100.0, "Largest acceleration of one."),
    ("Stiffness (N/mm)", "legs.stiffness_n_mm", 10.0, "Of an actuator; 0 for rigid ones."),
    ("Leg error (mm)", "legs.error_mm", 0.001, "Positioning error of an actuator, ±."),
    ("Tool error (mm)", "error_mm", 0.001, "Largest error of the tool by those of the legs."),
    ("Deflection (mm)", "deflection_mm", 0.01, "Largest deflection of the tool by the load."),
    ("Tool speed (mm/s)", "tool.speed_mm_s", 10.0, "Speed of the tool in every direction."),
    ("Turning (°/s)", "tool.turning_deg_s", 1.0, "Rate of turning about every axis."),
    ("Move (s)", "move_s", 0.1, "Time of a move along a diagonal of the box."),
    ("Margin (mm)", "margin_mm", 1.0, "Least |δ|; 0 for 2 % of the diagonal of the box."),
    ("Transmission", "transmission", 0.05, "Least transmission index, below 1."),
    ("Outer size (mm)", "hull_mm", 10.0, "Largest edge of a box about all joints."),
)
# A requirement that states no more than its box.
BLANK = Requirement(box_mm=(1.0, 1.0, 1.0))
PREFERRED = {kind.replace("-", " "): kind for kind in PREFERENCES}
FREE: dict[str, object] = {
    "nothing": (),
    "orientation": ("orientation",),
    "tool": ("tool",),
    "orientation and tool": ("orientation", "tool"),
}
FIND_HINT = "Search for machines that keep this requirement."
CANCEL_HINT = "End the search, and keep what it has found."
CHECK_HINT = "Check the present design against this requirement, on every change."
SAVE_HINT = "Download this requirement; its file opens again when it is dropped on the page."
ROW_HINT = "A row of a data sheet, such as: stroke 150 retracted 220 push 300 N speed 50 mm/s."

CHECK = Set("required.is_checked", True, "Check the requirement")


FIND = "find"
"""Name of the process of the searches."""

DIED = "the process of the search died; “Find machines” starts it again"
# Seconds after which the process of a cancelled search is ended.
PATIENCE = 2.0


class Finder:
    """Starts and cancels searches.

    Attributes:
        found: What the last search has found; None before its first answer.
        job: The search that is under way; None if none is.
    """

    def __init__(self, services: Services) -> None:
        self._services = services
        self.requirement = EXAMPLE
        self.found: FoundDesigns | None = None
        self.job: LongJob | None = None
        self._count = 0

    def prepare(self) -> None:
        """Start the processes of searches and checks, before they are needed."""
        for process in (FIND, CHECK_FEED.process):
            self._services.jobs.prepare(process, [find_machines.__module__])

    def start(self, requirement: Requirement, who: Who = None) -> None:
        """Search for machines, in place of a search that is under way."""
        self.cancel()
        self._count += 1
        number, self.requirement, self.found = self._count, requirement, None

        def receive(found: FoundDesigns | None, *, is_last: bool = False) -> None:
            # What an earlier search still sends is dropped.
            if number == self._count:
                self.found, self.job = found or self.found, None if is_last else self.job
                self._services.session.redraw()

        def end(ending: FoundDesigns | str) -> None:
            if isinstance(ending, str) and ending != CANCELLED:
                self._services.complain(ending, who)
            receive(None if isinstance(ending, str) else ending, is_last=True)

        arguments, jobs = (requirement,), self._services.jobs
        self.job = jobs.start(find_machines, arguments, end, end, receive, process=FIND, died=DIED)
        self._services.session.redraw()

    def cancel(self) -> None:
        """End the search; what it has found is kept."""
        if self.job is not None:
            self.job.cancel(PATIENCE)


class RequirementPanel(Controls):
    """The form, the buttons that search and check, and the machines that were found."""

    def __init__(self, services: Services) -> None:
        super().__init__(services)
        gui, self._services, self._finder = services.gui, services, services.get(Finder)
        gui.add_html(beside(2))
        with gui.add_folder("The task"):
            hint = "Edges of the box that the tool must reach, with home in its middle."
            self.triple("Box (mm)", hint, f"{FORM}.box_mm", step=1.0)
            self._add_numbers(TASK)
            hint = "What is best among the machines that keep the requirement."
            self.dropdown("Prefer", hint, PREFERRED, f"{FORM}.prefer")
            hint = "Demand that the parts of the machine fit into each other."
            self.checkbox("Buildable", hint, f"{FORM}.buildable")
        with gui.add_folder("The legs"):
            self._add_numbers(LEGS)
        with gui.add_folder("More", expand_by_default=False), services.commands.within("More"):
            self._add_more(gui)
        gui.add_html(beside(3))
        find = self._button("Find machines", FIND_HINT, self._finder.start)
        find.color = MAIN
        cancel = self._button("Cancel", CANCEL_HINT, lambda _, __: self._finder.cancel())
        check = self.button("Check this design", CHECK_HINT, lambda: CHECK)
        self.follow(find, "visible", lambda _: self._finder.job is None)
        self.follow(cancel, "visible", lambda _: self._finder.job is not None)
        self.follow(check, "disabled", lambda frame: Required.of(frame.state).is_checked)
        self._button("Save as a file", SAVE_HINT, self._save)
        self.markup(self._result)
        services.buttons.on(PREPARE, lambda _, __: self._finder.prepare())
        services.buttons.on(words.RELAX, self._relax, values=INDICES)
        services.do_on_press(words.OPEN, self._open, INDICES)

    def _result(self, frame: Frame) -> str:
        finder = self._finder
        look = "" if finder.requirement == Required.of(frame.state).form else "is-outdated"
        content = "".join(words.result(finder.found, is_searching=finder.job is not None))
        return box(f'<div class="{look}">{content}</div>')

    def _add_numbers(self, fields: Sequence[Field]) -> None:
        """Add fields for numbers, whose zeros are no demands where these would be None."""
        for label, field, step, hint in fields:
            at = At(f"{FORM}.{field}")
            if value_at(BLANK, field) is None:
                at = At(at.path, default=lambda _: 0.0, convert=lambda value: value or None)
            self.number(label, hint, at, least=0.0, step=step)

    def _add_more(self, gui: viser.GuiApi) -> None:
        for first in range(0, len(MORE), 2):
            gui.add_html(beside(2))
            self._add_numbers(MORE[first : first + 2])
        hint = "Centre of mass of the payload from b4, in the platform frame."
        self.triple("Centre (mm)", hint, f"{FORM}.payload.centre_mm", step=1.0)
        gui.add_html(beside(2))
        hint = "What a search may choose besides the machine and the yaw of the box."
        self.dropdown("Free", hint, FREE, f"{FORM}.free")
        hint = "Gravity pulls from the base to the platform."
        hangs = ControlBinding(lambda frame: Required.of(frame.state).form.gravity[2] > 0.0, _hang)
        self.checkbox("Hanging", hint, hangs)
        gui.add_html(beside(2))
        self._row = gui.add_text("Data sheet", "", hint=ROW_HINT)
        self._button("Read the row", "Take the values of the row into the form.", self._read_row)

    def _button(
        self, label: str, hint: str, act: Callable[[Requirement, Who], None]
    ) -> viser.GuiButtonHandle:
        """Add a button, whose action takes the requirement of the form."""
        latest = self._session.latest_state
        return self.press(label, hint, lambda who: act(Required.of(latest()).form, who))

    def _save(self, form: Requirement, who: Who) -> None:
        self._services.downloads.send(who, f"{form.name}.json", encode_requirement(form))

    def _read_row(self, _: Requirement, who: Who) -> None:
        def change(state: State) -> Action:
            legs = legs_from_row(self._row.value, Required.of(state).form.legs)
            return Set(f"{FORM}.legs", legs, "Legs of a data sheet")

        self._services.session.do(change, who=who)

    def _open(self, index: str) -> Action | None:
        designs = () if self._finder.found is None else self._finder.found.designs
        machine = next((each.design for each in designs[int(index) :]), None)
        return None if machine is None else open_found(machine, self._finder.requirement)

    def _relax(self, index: str, client: viser.ClientHandle) -> None:
        nearest = () if self._finder.found is None else self._finder.found.nearest
        for each in nearest[int(index) :][:1]:
            change = Set(FORM, each.requirement, "Requirement", each.words)
            self._services.session.do(change, who=client.client_id)
            self._finder.start(each.requirement, client.client_id)


def _hang(_: State, on: bool) -> Action:
    gravity = (0.0, 0.0, 1.0 if on else -1.0)
    return Set(f"{FORM}.gravity", gravity, "Hanging", "on" if on else "off")


class Checklist:
    """The checklist over the scene while the design is checked against a requirement."""

    def __init__(self, services: Services) -> None:
        self._feed = services.get(CHECK_FEED)
        services.do_on_press(words.DROP, lambda _: Set(CHECK.at, False, CHECK.name))
        services.do_on_press(words.GO, self._go)

    def __call__(self, frame: Frame) -> str:
        """Return the checklist for a frame, as HTML."""
        if Required.of(frame.state).requirement is None:
            return ""
        return words.checklist(self._feed.drawing, self._feed.problem or "", look_of(self._feed))

    def _go(self, name: str) -> Action | None:
        demands = () if self._feed.drawing is None else self._feed.drawing.demands
        pose = next((each.pose for each in demands if each.name == name), None)
        return None if pose is None else set_pose(pose)


def open_requirement(_: Services, data: bytes, name: str) -> tuple[Action, str]:
    """Return the action that takes the requirement in a file into the form; see `Opener`."""
    form = decode_requirement(data, name)
    action = Set(FORM, form, "Requirement", form.name)
    return action, f"The requirement {form.name}; “{words.TITLE}” has it."


PREPARE = "required.prepare"
INDICES = tuple(map(str, range(10)))
"""The values of buttons of machines and of relaxations."""

OPENS_HINT = "State what a machine must do, and find machines that do it."
LOOK = "ex-tool ex-outlined"
OPENS = open_button(words.TITLE, words.TITLE, press=PREPARE, hint=OPENS_HINT, class_name=LOOK)

REQUIREMENT = Feature(
    "requirement",
    manual="requirements.md",
    tabs=(Tab("dialog", words.TITLE, RequirementPanel),),
    verdicts=words.VERDICTS,
    bar=(("left", lambda _: lambda __: OPENS), ("left", Checklist)),
    scene=(RequiredBox,),
    later_feeds=(CHECK_FEED,),
    openers={"box_mm": open_requirement},
)
