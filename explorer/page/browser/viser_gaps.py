"""Features of viser's scene and controls without a public name, each beside the gap it fills."""

from __future__ import annotations

from collections.abc import Callable, Generator, Iterable, Iterator, Mapping
from typing import Any, TypeVar, cast

import numpy as np
import viser
import viser._gui_api
import viser._gui_handles
import viser._messages as protocol
from numpy.typing import ArrayLike

from explorer.numerics.arrays import FloatArray

Made = TypeVar("Made")
SceneMessage = dict[str, Any]
"""A message that makes or changes a part of the scene: its type, its fields by name."""

# Properties that place a node of the scene.
PLACE = ("position", "wxyz")
# Nearest and farthest distance that a camera draws, over the distance of its target.
NEAR, FAR = 1e-3, 30.0

MARKS = "_marks"
"""The property of a slider that holds its marks. Gap: only its constructor takes them."""


def slider_marks(values: Iterable[float]) -> tuple[object, ...]:
    """Return marks without words at positions of a slider."""
    return tuple(protocol.GuiSliderMark(value, "") for value in values)


def place(node: viser.SceneNodeHandle, name: str, value: ArrayLike) -> None:
    """Assign `position` or `wxyz` of a node of the scene to the last bit.

    Gap: viser's own assignment leaves out what `np.allclose` calls unchanged, so that a node
    lags behind by up to 1e-5 of its place, and small steps never add up.
    """
    held: Any = getattr(node, name)
    numbers = tuple(np.asarray(value, dtype=np.float64).tolist())
    if tuple(held.tolist()) != numbers:
        held[:] = numbers
        resend(node, name)


def assign_properties(node: viser.SceneNodeHandle, values: Mapping[str, object]) -> None:
    """Assign properties of a node of the scene, in one message.

    Gap: viser's own assignment resolves the type of each property anew and sends a message for
    each, which takes longer than all that is computed for it.
    """
    internals: Any = node
    properties = internals._impl.props
    updates = dict(values)
    for name, value in values.items():
        dtype = getattr(getattr(properties, name), "dtype", None)
        if dtype is not None:
            # A copy, since the message is sent later.
            updates[name] = np.array(value, dtype=dtype)
        setattr(properties, name, updates[name])
    internals._impl.api._queue_scene_message(protocol.SceneNodeUpdateMessage(node.name, updates))


def assign_in(
    client: viser.ClientHandle, node: viser.SceneNodeHandle, values: Mapping[str, object]
) -> None:
    """Assign properties of a node, which all browsers share, in one browser alone.

    Gap: viser's own assignment is for all of them.
    """
    _send_to(client, protocol.SceneNodeUpdateMessage(node.name, dict(values)))


def put_camera(
    client: viser.ClientHandle, eye: FloatArray, target: FloatArray, field_of_view: float
) -> None:
    """Put a browser's camera at an eye, upright, looking at a target; the browser then reports it.

    Gap: viser's own handle never sends the same place twice, although a browser that is still
    loading returns to its first camera after all messages.
    """
    distance = float(np.linalg.norm(eye - target))
    messages = (
        # What is drawn for a large design lies beyond viser's usual 1000 units.
        protocol.SetCameraNearMessage(NEAR * distance),
        protocol.SetCameraFarMessage(FAR * distance),
        protocol.SetCameraUpDirectionMessage((0.0, 0.0, 1.0)),
        protocol.SetCameraPositionMessage(cast("Any", tuple(eye.tolist()))),
        protocol.SetCameraLookAtMessage(cast("Any", tuple(target.tolist()))),
        # A browser answers this one, whatever its camera did.
        protocol.SetCameraFovMessage(field_of_view),
    )
    with client.atomic():
        for message in messages:
            _send_to(client, message)


def show_value(control: Any, value: object) -> None:
    """Assign the value of a control, and send it to the browsers.

    Gap: viser's own assignment calls the callbacks too, which are for what users do.
    """
    state = control._impl
    value = type(state.value)(value)
    if state.value != value:
        state.value = value
        resend(control, "value")


def resend(handle: Any, name: str) -> None:
    """Send browsers a property of a control, or a node's place. Gap: viser sends none twice."""
    state = handle._impl
    if name in PLACE:
        kind = protocol.SetPositionMessage if name == "position" else protocol.SetOrientationMessage
        state.api._queue_scene_message(kind(handle.name, tuple(getattr(handle, name).tolist())))
    else:
        message = protocol.GuiUpdateMessage(state.uuid, {name: getattr(state, name)})
        state.gui_api._websock_interface.queue_message(message)


def element_id(
    control: viser.GuiInputHandle[Any] | viser.GuiButtonHandle | viser.GuiUploadButtonHandle,
) -> str:
    """Return the id of a control in the page. Gap: scripts and labels of HTML cannot name it."""
    internals: Any = control
    return str(internals._impl.uuid)


def run_script(server: viser.ViserServer, source: str) -> None:
    """Run a script of ours in every browser, also in those that come later."""
    _send_to_all(server, _script(source))


def run_script_in(client: viser.ClientHandle, source: str) -> None:
    """Run a script of ours in one browser."""
    _send_to(client, _script(source))


def mark_broadcasts(client: viser.ClientHandle, number: int) -> None:
    """Give all browsers a number, after all that was sent to all of them so far.

    A browser has received those messages when its `window.explorer.mark` is the number. What is
    sent to one browser alone takes a way of its own and may arrive earlier.
    """

    # Gap: viser has no such mark. The type of a message is the name of its class.
    class Mark(protocol.RunJavascriptMessage):
        def redundancy_key(self) -> str:
            return "mark"

    Mark.__name__ = protocol.RunJavascriptMessage.__name__
    internals: Any = client
    source = f"(window.explorer ??= {{}}).mark = {number};"
    _send_to_all(internals._viser_server, Mark(source=source))


def _script(source: str) -> object:
    """Return the message that runs a script, whose errors a browser logs.

    Gap: an error that viser's page meets at a message takes all messages that wait with it.
    """
    guarded = f"try {{\n{source}\n}} catch (error) {{ console.error(error); }}"
    return protocol.RunJavascriptMessage(source=guarded)


def _send_to_all(server: Any, message: object) -> None:
    # Gap: viser has no public way to run a script.
    server._websock_server.queue_message(message)


def _send_to(client: Any, message: object) -> None:
    # Gap: nor one for a single browser.
    client._websock_connection.queue_message(message)


def scene_as_html(
    server: viser.ViserServer,
    select: Callable[[list[SceneMessage]], list[SceneMessage]],
    *,
    dark: bool,
) -> str:
    """Return viser's page with a scene in it that it plays by itself.

    `select` chooses the messages for the page from all messages that make the scene.
    """
    # Gap: a recording of viser can neither be ended nor be filtered.
    serializer: Any = server.get_scene_serializer()
    serializer._filter = _refuse
    recorded, arrays = serializer._messages, serializer._binary_buffers
    messages = select([message for _, message in recorded])
    recorded[:] = [(0.0, message) for message in messages]
    used = set(_arrays_in(messages))
    arrays[:] = [data if i in used else memoryview(b"") for i, data in enumerate(arrays)]
    return str(serializer.as_html(dark))


def _refuse(_: object) -> bool:
    return False


def _arrays_in(value: object) -> Generator[int]:
    """Yield the numbers of the arrays that messages hold."""
    if isinstance(value, dict):
        fields = cast("dict[str, Any]", value)
        if "__binary_index" in fields:
            yield fields["__binary_index"]
        else:
            for each in fields.values():
                yield from _arrays_in(each)
    elif isinstance(value, list | tuple):
        for each in cast("list[object]", value):
            yield from _arrays_in(each)


def make_with_id(make: Callable[[], Made], name: str) -> Made:
    """Make a panel or a tab with an id that stays the same when the explorer starts again.

    Gap: viser draws ids at random. A page that connects to an explorer that was started again would
    take its panels for others, lay them out beside those that it has, in half of the room, and
    forget how its user arranged them.
    """
    modules: tuple[Any, ...] = (viser._gui_api, viser._gui_handles)
    draw_id = modules[0]._make_uuid
    for module in modules:
        module._make_uuid = lambda: name
    try:
        return make()
    finally:
        for module in modules:
            module._make_uuid = draw_id


def keep_arrangement(gui: viser.GuiApi) -> None:
    """Have pages keep the arrangement of their panels when the explorer starts again.

    Gap: to viser the first arrangement of each run is a new one.
    """
    internals: Any = gui
    internals._layout_run_id = "explorer"


def panel_in(client: viser.ClientHandle, panel: viser.PanelHandle) -> viser.PanelHandle:
    """Return a handle that places a panel, which all browsers share, in one browser alone.

    Gap: viser's own handle places a panel in all of them.
    """
    own = viser.PanelHandle.__new__(viser.PanelHandle)
    own.__dict__.update({**panel.__dict__, "_placement_gui_api": client.gui})
    return own


def dock_above_in(
    client: viser.ClientHandle, panel: viser.PanelHandle, anchor: viser.PanelHandle
) -> None:
    """Dock a panel above another one in one browser alone; all browsers share both.

    Gap: viser's own handle refuses an anchor that was not made for that browser.
    """
    internals: Any = anchor
    own: Any = panel_in(client, panel)
    own._set_position({"kind": "split", "anchor_uuid": internals._impl.uuid, "side": "above"})


def contents_of(gui: viser.GuiApi) -> Iterator[tuple[tuple[str, ...], Any]]:
    """Yield what stands on a page, each with the titles of its tab and folders, the tab first.

    What is hidden, and what stands in a hidden folder, is left out. Gap: viser lists nothing.
    """
    internals: Any = gui
    containers = internals._container_handle_from_uuid
    for container in tuple(containers.values()):
        titles, outer, is_shown = list[str](), container, True
        while outer is not None:
            # A tab stands in nothing that hides it, and folders in a tab or in other folders.
            state = getattr(outer, "_impl", None)
            title = getattr(outer, "_label", None) if state is None else outer.label
            titles += [] if title is None else [str(title)]
            is_shown = is_shown and (state is None or outer.visible)
            outer = None if state is None else containers.get(state.parent_container_id)
        for handle in tuple(container._children.values()) if is_shown else ():
            if getattr(handle, "visible", True):
                yield tuple(titles[::-1]), handle
