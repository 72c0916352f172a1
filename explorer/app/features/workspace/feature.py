"""The workspace: its volume, what is shown of it, its cut with a map, its numbers, its files."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import replace
from typing import Annotated, Literal

import msgspec
import viser

from explorer.app.features.feature import Feature, FileExport, Services, Tab, look_of
from explorer.app.features.workspace import feeds, words as texts, work
from explorer.app.features.workspace.scene import WorkspaceScene
from explorer.app.features.workspace.slice_map import Axis, SliceMap, level_within, map_picture
from explorer.app.inputs.bindings import At, ControlBinding
from explorer.app.inputs.controls import Controls
from explorer.app.inputs.ranges import Span, coordinate_span, fine_step, round_up
from explorer.app.scene.surfaces import Measure
from explorer.app.session.session import Change
from explorer.app.state.actions import Action, Set
from explorer.app.state.frame import Frame
from explorer.app.state.moves import set_pose, start_there
from explorer.app.state.state import State
from explorer.app.state.view import WorkspaceView
from explorer.app.widgets.buttons import figure
from explorer.app.widgets.chips import Chips, StateCommand, turn
from explorer.app.widgets.markup import alert, box, note, sentence
from explorer.measures.position_bands import LOAD_MEASURES, MEASURE_WORDS
from explorer.measures.verdict import warnings
from explorer.mechanism.margins import MARGIN_KINDS
from explorer.mechanism.pose import Pose, Triple
from explorer.page.browser.browser_facts import decode_text
from explorer.page.browser.viser_gaps import run_script_in
from explorer.page.look import call_script
from explorer.page.widgets.assigning import Updates
from explorer.page.widgets.palette import Key, shift

SHOWN = {
    "solid": ("Solid", "Draw the positions within all limits at one orientation.", Key("V")),
    "hull": ("Convex hull", "Draw the convex hull of the workspace.", shift("V")),
    "planes": (
        "Singular planes",
        "Draw the planes of singular positions, up to three, at the present orientation.",
        shift("P"),
    ),
}
"""Words, hint and key of each part that can be shown."""

REGIONS: dict[str, tuple[work.Region, Literal["home", "pose"]]] = {
    "within the limits": ("limits", "home"),
    "accessible from home": ("accessible", "home"),
    "accessible from the present position": ("accessible", "pose"),
    "holds the load": ("held", "home"),
}
"""Region and start of the paths."""

COLOURINGS: dict[str, Measure] = {
    "one colour": "plain",
    "smallest margin": "margin",
    "1 / cond J": "condition",
    **{words: measure for measure, (words, _, _) in MEASURE_WORDS.items()},
}
ORIENTATIONS = {"of the present pose": "pose", "of the home pose": "home"}
CUTS: dict[str, Axis | None] = {"none": None, "x": "x", "y": "y", "z": "z"}
"""Axis of the cut by the words on its button."""

_Coordinate = Annotated[float, msgspec.Meta(ge=-1e12, le=1e12)]
_POSITION = msgspec.json.Decoder(tuple[_Coordinate, _Coordinate, _Coordinate])


class WorkspacePanel(Controls):
    """The panel of the workspace."""

    def __init__(self, services: Services) -> None:
        super().__init__(services)
        self._feed = services.get(feeds.WORKSPACE_FEED)
        self._volumes = services.get(feeds.VOLUME_FEED)
        # The drawing whose solid is cut, and its map where the page shows it.
        self._drawing: work.WorkspaceDrawing | None = None
        self._mapped: SliceMap | None = None
        self._show, cuts = _part_chips(services), _cut_chips(services)
        self.markup(self._top)
        self.dropdown(
            "Region",
            "All positions within the limits, those that a path without a collision of legs leads "
            "to, from home or from the present position, or those at which the load of the tab "
            "Loads is held.",
            REGIONS,
            ControlBinding(_region, _set_region),
            is_in_palette=True,
        )
        self.under_way("workspace", self._feed)
        self.markup(lambda _: self._trouble_words())
        self._start = services.link(
            "workspace.start",
            "Workspace › Go there",
            "Move the platform to that position and let the paths start from it.",
            self._start_there,
        )
        self.dropdown(
            "Orientation",
            "The orientation of the platform all over the workspace.",
            ORIENTATIONS,
            "view.workspace.orientation",
            is_in_palette=True,
        )
        self.dropdown(
            "Colour by",
            f"One colour, the smallest margin |δ| ({MARGIN_KINDS}), 1 / cond J, what the load of "
            "Loads asks of actuators and struts, or how far errors of actuators or that load move "
            "the tool.",
            COLOURINGS,
            "view.workspace.colour",
            is_in_palette=True,
        )
        self.markup(self._legend)
        self.markup(lambda frame: box(cuts.html(frame.state)))
        self.slider(
            "Cut at ({unit})",
            "Position of the cutting plane on its axis.",
            ControlBinding(
                lambda frame: self._level(frame.state),
                lambda _, value: Set("view.workspace.level", value, "Cut at"),
            ),
            self._cut_span,
            power=1,
            disabled=lambda state: state.view.workspace.cut is None,
        )
        self.markup(self._map)
        with services.gui.add_folder("Details", expand_by_default=False):
            self.markup(lambda frame: texts.workspace_details(frame, self._feed))
            self.slider(
                "Mesh tolerance ({unit})",
                "Largest distance of a facet from the true surface.",
                At("view.workspace.tolerance", default=feeds.tolerance_of),
                _tolerance_span,
                power=1,
            )
        services.do_on_press("workspace.go", _go_to)
        services.buttons.on("workspace.read", self._read)

    def updates(self, frame: Frame) -> Updates:
        """Yield the updates that show a frame."""
        self._drawing = self._feed.drawing
        yield from super().updates(frame)

    def _top(self, frame: Frame) -> str:
        volume, drawn = texts.volume_headline(frame, self._volumes), self._feed
        return box(volume, texts.drawing_words(frame, drawn), self._show.html(frame.state))

    def _slice(self, state: State) -> SliceMap | None:
        """Return the map of the drawing that is shown; None without a cut."""
        is_cut = state.view.workspace.cut is not None
        return self._drawing.slice_map if self._drawing is not None and is_cut else None

    def _legend(self, frame: Frame) -> str:
        state, view = frame.state, frame.state.view.workspace
        colour = feeds.measure_of_colour(state)
        words = texts.missing_input(view.colour) if colour != view.colour else ""
        if colour != "plain" or self._slice(state) is not None:
            measure = work.map_measure(state.design, colour, holds=view.region == "held")
            warn = warnings(state.design.reach, state.warn_below)
            warn_below = warn.condition if measure == "condition" else warn.margin
            words += texts.legend(measure, warn_below, self._drawing, state.unit)
        if colour in LOAD_MEASURES and view.region != "held":
            any_direction = colour != "deflection"
            words += note(f"{texts.load_words(state, any_direction=any_direction)}.")
        return words

    def _map(self, frame: Frame) -> str:
        state, mapped = frame.state, self._slice(frame.state)
        if mapped is not None:
            mapped = mapped.shift(state.offset(mapped.colouring.workspace.rotation))
        self._mapped = mapped
        if mapped is None:
            return ""
        return box(map_picture(mapped, state.position, state.design.reach, state.unit))

    def _level(self, state: State) -> float:
        """Return the level of the cut, or the level that a cut would have."""
        level, ends = state.view.workspace.level, self._ends(state)
        return (level or 0.0) if ends is None else level_within(*ends, level)

    def _cut_span(self, state: State) -> Span:
        """Return the extent of the workspace on the axis across which it is cut."""
        span, ends = coordinate_span(state), self._ends(state)
        if ends is None:
            return span
        low, high = math.ceil(ends[0] / span.step), math.floor(ends[1] / span.step)
        return Span(low * span.step, high * span.step, span.step) if low < high else span

    def _ends(self, state: State) -> tuple[float, float] | None:
        """Return the extent of the drawn workspace on the axis of the cut; None without either."""
        axis = state.view.workspace.cut
        if axis is None or self._drawing is None or self._drawing.extent is None:
            return None
        index = "xyz".index(axis)
        offset = float(state.offset(self._drawing.request.rotation)[index])
        low, high = (float(end[index]) + offset for end in self._drawing.extent)
        return low, high

    def _trouble_words(self) -> str:
        """Return why nothing is accessible, and the nearest position to start from, as HTML."""
        if self._drawing is None or self._drawing.trouble is None:
            return ""
        trouble = self._drawing.trouble
        words = alert(texts.nothing_words(self._drawing), sentence(trouble.reason))
        return words if trouble.nearest is None else words + self._start

    def _start_there(self, _: State) -> Action | None:
        trouble = None if self._drawing is None else self._drawing.trouble
        if self._drawing is None or trouble is None or trouble.nearest is None:
            return None
        return start_there(Pose.of(trouble.nearest, self._drawing.request.rotation))

    def _read(self, text: str, client: viser.ClientHandle) -> None:
        """Answer a browser that asks for the words at a position on the map."""
        position: Triple | None = decode_text(text, _POSITION)
        mapped = self._mapped
        if position is not None and mapped is not None:
            words = mapped.words_at(position, self._session.state.unit)
            run_script_in(client, call_script("map", text, words))


def _go_to(text: str) -> Change | None:
    """Return the move of the point to a position that a page sent, in the map's orientation."""
    position: Triple | None = decode_text(text, _POSITION)
    if position is None:
        return None
    return lambda state: set_pose(state.pose_at(position, feeds.workspace_pose(Frame(state))))


def _part_chips(services: Services) -> Chips:
    """Return the switches of what is shown."""
    chips = {
        name: StateCommand(
            f"Workspace › {words}", hint, *turn(f"view.workspace.{name}", words), keys=(key,)
        )
        for name, (words, hint, key) in SHOWN.items()
    }
    return Chips(services.buttons, services.session, "workspace.show", "Show", chips)


def _cut_chips(services: Services) -> Chips:
    """Return the options of the cut, and the switch of the side that it keeps."""

    def chip(words: str, axis: Axis | None) -> StateCommand:
        option, hint, key = "no cut", "Show the whole solid.", Key("C")
        if axis is not None:
            option, key = f"across {axis}", Key(axis.upper())
            hint = f"Cut the workspace open {option}, in its middle, and show the map of the slice."
        return StateCommand(
            f"Workspace › Cut open › {option}",
            hint,
            lambda state: _set_cut(state.view.workspace, axis, option),
            lambda state: state.view.workspace.cut == axis,
            keys=(key,),
            words=words,
        )

    chips = {words: chip(words, axis) for words, axis in CUTS.items()}
    chips["flip"] = StateCommand(
        "Workspace › Cut open › other side",
        "Keep the other side of the cut.",
        *turn("view.workspace.flipped", "Other side of the cut"),
        lambda state: state.view.workspace.cut is not None,
    )
    return Chips(services.buttons, services.session, "workspace.cut", "Cut", chips)


def _set_cut(view: WorkspaceView, axis: Axis | None, words: str) -> Action:
    """Return the action that cuts the workspace open; a new cut shows the solid, in its middle."""
    level = view.level if axis in (None, view.cut) else None
    new = replace(view, cut=axis, level=level, solid=view.solid or axis is not None)
    return Set("view.workspace", new, "Cut open", words)


def _region(frame: Frame) -> str:
    view = frame.state.view.workspace
    return next(
        words
        for words, (region, start) in REGIONS.items()
        if region == view.region and (region != "accessible" or start == view.start)
    )


def _set_region(state: State, words: str) -> Action:
    region, start = REGIONS[words]
    view = replace(state.view.workspace, region=region, start=start)
    return Set("view.workspace", view, "Region", words)


def _tolerance_span(state: State) -> Span:
    reach = state.base.reach
    step = fine_step(reach, 5e3)
    return Span(step, round_up(0.05 * reach), step)


def volume_figure(services: Services) -> Callable[[Frame], str]:
    """Return the figure of the volume within the limits, dim while a newer one is computed."""
    feed = services.get(feeds.VOLUME_FEED)

    def figure_of(frame: Frame) -> str:
        drawing, name = feed.drawing, "Volume"
        which = feeds.orientation_word(frame)
        hint = f"Volume of the workspace within the limits, in the {which} orientation."
        if drawing is not None:
            name += feeds.orientation_suffix(drawing.request.design, drawing.request.rotation)
            if drawing.measured.volume <= 0.0:
                hint += f" It is emptied by: {', '.join(drawing.measured.empty_because)}."
        text, look = texts.volume_text(drawing, frame.state.unit), look_of(feed)
        return figure("Workspace", name, text, hint=hint, look=look)

    return figure_of


WORKSPACE = Feature(
    "workspace",
    manual="workspace.md",
    tabs=(Tab("analyse", "Workspace", WorkspacePanel, viser.Icon.SPHERE),),
    bar=(("middle", volume_figure),),
    verdicts={
        "The workspace is empty": "No position keeps all limits in this orientation.",
        "No position holds the load": "At every position a part bears more than its limit.",
        "Nothing is accessible": "The position itself breaks a limit: no move begins there.",
    },
    exports=(
        FileExport(
            "Workspace",
            "All positions of b4, or of the tool point if the tab Pose shows it, in the region and "
            "orientation of the tab Workspace; STEP has exact faces.",
            tuple(map(str.upper, feeds.FORMATS)),
            lambda services, name, who: feeds.send_workspace(
                services, "workspace", name.lower(), who
            ),
        ),
        FileExport(
            "Convex hull",
            "The convex hull of that workspace.",
            tuple(map(str.upper, feeds.HULL_FORMATS)),
            lambda services, name, who: feeds.send_workspace(services, "hull", name.lower(), who),
        ),
    ),
    scene=(WorkspaceScene,),
    feeds=(feeds.VOLUME_FEED, feeds.WORKSPACE_FEED),
)
