"""Features of viser's scene and controls without a public name."""

from __future__ import annotations

import time
from collections.abc import Callable, Generator, Mapping
from typing import Any, cast

import numpy as np
import viser
from numpy.typing import ArrayLike

from explorer.numerics.arrays import FloatArray

SceneMessage = dict[str, Any]
"""A message that makes or changes a part of the scene: its type, its fields by name."""

# Properties that place a node of the scene.
PLACE = ("position", "wxyz")


class SliderMarks:
    """The marks below a slider: its constructor takes them, its handle does not."""

    def __init__(self, slider: viser.GuiSliderHandle[float]) -> None:
        self._slider: Any = slider

    @property
    def marks(self) -> tuple[float, ...]:
        """Position of each mark."""
        return tuple(mark.value for mark in self._slider._marks)

    @marks.setter
    def marks(self, marks: tuple[float, ...]) -> None:
        from viser import _messages

        self._slider._marks = tuple(_messages.GuiSliderMark(value, "") for value in marks)


def place(node: viser.SceneNodeHandle, name: str, value: ArrayLike) -> None:
    """Assign `position` or `wxyz` of a node of the scene to the last bit.

    viser's own assignment leaves out what `np.allclose` calls unchanged, so that a node
    lags behind by up to 1e-5 of its place, and small steps never add up.
    """
    held: Any = getattr(node, name)
    numbers = tuple(np.asarray(value, dtype=np.float64).tolist())
    if tuple(held.tolist()) == numbers:
        return
    held[:] = numbers
    _send_place(node, name)


def _send_place(node: viser.SceneNodeHandle, name: str) -> None:
    from viser import _messages

    internals: Any = node
    kind = _messages.SetPositionMessage if name == "position" else _messages.SetOrientationMessage
    internals._impl.api._queue_scene_message(kind(node.name, tuple(getattr(node, name).tolist())))


def assign_properties(node: viser.SceneNodeHandle, values: Mapping[str, object]) -> None:
    """Assign properties of a node of the scene, in one message.

    viser's own assignment resolves the type of each property anew and sends a message for each,
    which takes longer than all that is computed for it.
    """
    from viser import _messages

    internals: Any = node
    properties = internals._impl.props
    updates = dict(values)
    for name, value in values.items():
        dtype = getattr(getattr(properties, name), "dtype", None)
        if dtype is not None:
            # A copy, since the message is sent later.
            updates[name] = np.array(value, dtype=dtype)
        setattr(properties, name, updates[name])
    message = _messages.SceneNodeUpdateMessage(node.name, updates)
    internals._impl.api._queue_scene_message(message)


def put_camera(
    client: viser.ClientHandle, eye: FloatArray, target: FloatArray, field_of_view: float
) -> None:
    """Put a browser's camera at an eye, upright, looking at a target; the browser then reports it.

    viser's own handle never sends the same place twice, although a browser that is still loading
    returns to its first camera after all messages.
    """
    from viser import _messages

    def triple(vector: FloatArray) -> tuple[float, float, float]:
        x, y, z = vector.tolist()
        return (x, y, z)

    internals: Any = client
    connection = internals._websock_connection
    with client.atomic():
        connection.queue_message(_messages.SetCameraUpDirectionMessage((0.0, 0.0, 1.0)))
        connection.queue_message(_messages.SetCameraPositionMessage(triple(eye)))
        connection.queue_message(_messages.SetCameraLookAtMessage(triple(target)))
        # A browser answers this one, whatever its camera did.
        connection.queue_message(_messages.SetCameraFovMessage(field_of_view))


def show_value(control: Any, value: object) -> None:
    """Assign the value of a control, and send it to the browsers.

    viser's own assignment calls the callbacks too, which are for what users do.
    """
    from viser import _messages

    state = control._impl
    value = type(state.value)(value)
    if state.value == value:
        return
    message = _messages.GuiUpdateMessage(state.uuid, {"value": value})
    state.gui_api._websock_interface.queue_message(message)
    state.value = value
    state.update_timestamp = time.time()


def resend(handle: Any, name: str) -> None:
    """Send browsers a property that they have already: `value` of a control, or a node's place."""
    from viser import _messages

    if name in PLACE:
        _send_place(handle, name)
    else:
        state = handle._impl
        message = _messages.GuiUpdateMessage(state.uuid, {name: getattr(state, name)})
        state.gui_api._websock_interface.queue_message(message)


def is_stale(handle: Any, name: str) -> bool:
    """Whether browsers were last sent another `value` of a control than the one it holds.

    A value is sent first and stored after: one that a user sets in between is sent last, and then
    overwritten here.
    """
    from viser import _messages

    if name in PLACE:
        return False
    state = handle._impl
    held = getattr(state, name)
    message = _messages.GuiUpdateMessage(state.uuid, {name: held})
    buffer = state.gui_api._websock_interface.get_message_buffer()
    with buffer.buffer_lock:
        sent = buffer.message_from_id.get(
            buffer.id_from_redundancy_key.get(message.redundancy_key())
        )
    return sent is not None and sent.updates[name] != held


def element_id(control: viser.GuiInputHandle[Any] | viser.GuiButtonHandle) -> str:
    """Return the id of a control in the page: a label of HTML can be for the button with it."""
    internals: Any = control
    return str(internals._impl.uuid)


def run_script(server: viser.ViserServer, source: str) -> None:
    """Run a script of ours in every browser, also in those that come later."""
    internals: Any = server
    internals._websock_server.queue_message(_script(source))


def run_script_in(client: viser.ClientHandle, source: str) -> None:
    """Run a script of ours in one browser."""
    internals: Any = client
    internals._websock_connection.queue_message(_script(source))


def mark_broadcasts(client: viser.ClientHandle, number: int) -> None:
    """Give all browsers a number, after all that was sent to all of them so far.

    A browser has received those messages when its `window.explorer.mark` is the number. What is
    sent to one browser alone takes a way of its own and may arrive earlier.
    """
    from viser import _messages

    # The type of a message is the name of its class.
    class RunJavascriptMessage(_messages.RunJavascriptMessage):
        def redundancy_key(self) -> str:
            return "mark"

    internals: Any = client
    source = f"(window.explorer ??= {{}}).mark = {number};"
    internals._viser_server._websock_server.queue_message(RunJavascriptMessage(source=source))


def _script(source: str) -> Any:
    """Return the message that runs a script, whose errors a browser logs.

    An error that viser's page meets at a message takes all messages that wait with it.
    """
    from viser import _messages

    guarded = f"try {{\n{source}\n}} catch (error) {{ console.error(error); }}"
    return _messages.RunJavascriptMessage(source=guarded)


def scene_as_html(
    server: viser.ViserServer,
    select: Callable[[list[SceneMessage]], list[SceneMessage]],
) -> str:
    """Return viser's page with a scene in it that it plays by itself.

    Args:
        server: Server of the scene.
        select: Returns the messages for the page from all messages that make the scene.
    """
    serializer: Any = server.get_scene_serializer()
    # Otherwise it would go on recording.
    serializer._filter = _nothing
    messages = select([message for _, message in serializer._messages])
    serializer._messages = [(0.0, message) for message in messages]
    used = set(_arrays_in(messages))
    serializer._binary_buffers = [
        data if index in used else memoryview(b"")
        for index, data in enumerate(serializer._binary_buffers)
    ]
    return str(serializer.as_html())


def _nothing(_: object) -> bool:
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


def panel_in(client: viser.ClientHandle, panel: viser.PanelHandle) -> viser.PanelHandle:
    """Return a handle that places a panel, which all browsers share, in one browser alone."""
    own = viser.PanelHandle.__new__(viser.PanelHandle)
    own.__dict__.update({**panel.__dict__, "_placement_gui_api": client.gui})
    return own


def dock_above_in(
    client: viser.ClientHandle, panel: viser.PanelHandle, anchor: viser.PanelHandle
) -> None:
    """Dock a panel above another one in one browser alone; all browsers share both.

    viser's own handle refuses an anchor that was not made for that browser.
    """
    internals: Any = anchor
    own: Any = panel_in(client, panel)
    own._set_position({"kind": "split", "anchor_uuid": internals._impl.uuid, "side": "above"})
