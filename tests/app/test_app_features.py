"""Features as the page takes them: each may be missing, a new one appears, controls set values."""

from __future__ import annotations

from collections.abc import Generator, Iterator, Mapping
from contextlib import contextmanager
from typing import Any, NamedTuple, cast

import numpy as np
import pytest
from desk import CLIENT

from explorer.app.features.feature import Feature, Services, StateCommand, Tab
from explorer.app.features.forces.loads import WeightsFeed
from explorer.app.features.listed import FEATURES
from explorer.app.features.orientation.feeds import RangeFeed, TiltsFeed
from explorer.app.inputs.bindings import At, Bound
from explorer.app.inputs.control import Control
from explorer.app.inputs.controls import Controls
from explorer.app.page import Page
from explorer.app.scene.part import ScenePart
from explorer.app.scene.placing import Placed
from explorer.app.server import Running, start
from explorer.app.session.feed import Feed
from explorer.app.session.session import UNDO
from explorer.app.state.actions import Set
from explorer.app.state.frame import Frame
from explorer.app.state.values import value_at, with_value
from explorer.app.state.view import OrientationView
from explorer.app.storage.study_folders import StudyFolders
from explorer.app.storage.user_data import open_user_data
from explorer.app.widgets.assigning import Update
from explorer.app.widgets.commands import Key
from explorer.app.widgets.pieces import Widget, widgets
from explorer.mechanism.design_file import PRESETS
from explorer.numerics.arrays import FloatArray

pytestmark = pytest.mark.usefixtures("idle_workers")

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
    bind, initialise = At.bound, control_type.__init__

    def bind_and_record(at: At, name: str, options: Any = None) -> Bound[Any]:
        bound = bind(at, name, options)
        sources[id(bound.write)] = at, options
        return bound

    def record(control: Any, session: Any, handle: Any, bound: Any, **more: Any) -> None:
        initialise(control, session, handle, bound, **more)
        if id(bound.write) in sources:
            controls.append(BoundControl(handle, *sources[id(bound.write)]))

    patch.setattr(At, "bound", bind_and_record)
    patch.setattr(Control, "__init__", record)


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
            session.travel(UNDO)
        assert page.wait_until_drawn()
        assert session.state == before, name
        assert handle.value == shown, name


@pytest.mark.parametrize("feature", FEATURES, ids=lambda feature: feature.name)
def test_page_with_the_mechanism_and_one_feature_starts_and_draws(feature: Feature) -> None:
    """Without the mechanism there is nothing to look at; no feature needs another one."""
    features = tuple(each for each in FEATURES if each.name in ("mechanism", feature.name))
    with start_with(features) as page:
        page.session.do(Set("view.labels", False))
        assert page.wait_until_drawn()
        assert np.isfinite(page.corners()).all()
        titles = {tab.title for each in features for tab in each.tabs}
        folders = {each.path[0] for each in widgets(page.services.server) if each.path}
        assert folders <= titles


class MarkerPanel:
    """A panel with one switch."""

    def __init__(self, services: Services) -> None:
        self._controls = Controls(services.gui, services.session)
        self._controls.checkbox("Ghost platforms", "Draw the other modes.", "view.ghosts")

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
    keys={"Marker › Ghost platforms": (Key("6"),)},
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
        assert page.wait_until_drawn()
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
        page.session.do(Set("view.orientation", OrientationView(tilts=True, over="inclusive")))
        page.session.do(Set("view.forces.weighed", "payload and legs"))
        assert page.session.wait_until_idle()
        kinds: tuple[type[Feed[Any, Any]], ...] = (TiltsFeed, RangeFeed, WeightsFeed)
        assert all(page.services.get(kind).request is not None for kind in kinds)
    finally:
        running.stop()
