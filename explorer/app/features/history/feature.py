"""The steps of the session: undo, redo, a list to go to any of them, and the last change."""

from __future__ import annotations

import viser

from explorer.app.features.feature import Feature, InBar, Services, Tab
from explorer.app.features.history.change import ChangeCard, ChangeScene, DesignChange
from explorer.app.features.history.panel import HistoryPanel
from explorer.app.session.history import History
from explorer.app.session.session import REDO, UNDO
from explorer.app.state.frame import Frame
from explorer.app.widgets.buttons import open_button, press_button
from explorer.app.widgets.commands import Key, with_keys

PRESS = "history.move"
KEYS = {
    "Undo": (Key("Z", "cmd/ctrl"),),
    "Redo": (Key("Z", "cmd/ctrl+shift"), Key("Y", "cmd/ctrl")),
}
MOVES = {"Undo": UNDO, "Redo": REDO}
ARROWS = {"Undo": "↶", "Redo": "↷"}


class UndoButtons:
    """Undo, redo, and the button that opens the list of all steps."""

    def __init__(self, services: Services) -> None:
        self._session = services.session
        services.buttons.on(PRESS, self._move, values=MOVES)
        for name in MOVES:
            # Always ready: a key that is pressed before the page knows of the last step counts.
            hint = f"{name} the last step."
            services.buttons.offer(f"Edit › {name}", hint, PRESS, name, keys=KEYS[name])

    def __call__(self, frame: Frame) -> str:
        """Return the buttons for a frame, as HTML."""
        history, is_busy = self._session.history, frame.state.optimisation.is_on
        buttons = "".join(self._button(name, history, is_busy=is_busy) for name in MOVES)
        steps = open_button(
            "History",
            "History",
            hint="List all steps, and go to any of them.",
            class_name="ex-tool",
        )
        return f'<span class="ex-undo">{buttons}{steps}</span>'

    def _button(self, name: str, history: History, *, is_busy: bool) -> str:
        # The step that "Undo" or "Redo" goes over.
        at = history.at if name == "Undo" else history.at + 1
        words = history.steps[at].words if 0 < at < len(history.steps) else None
        hint = f"{name}: {words}." if words is not None else f"Nothing to {name.lower()}."
        return press_button(
            PRESS,
            name,
            ARROWS[name],
            hint=with_keys(hint, KEYS[name]),
            label=name if words is None else f"{name} {words}",
            class_name="ex-tool ex-arrow",
            is_disabled=words is None or is_busy,
        )

    def _move(self, name: str, client: viser.ClientHandle) -> None:
        self._session.travel(MOVES[name], who=client.client_id)


HISTORY = Feature(
    "history",
    tabs=(Tab("dialog", "History", HistoryPanel),),
    bar=(InBar("left", UndoButtons), InBar("left", ChangeCard)),
    scene=(ChangeScene,),
    feeds=(DesignChange,),
)
