"""The dialog Export: every file that the page offers, by what it holds and in which format."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from functools import partial
from html import escape

import viser

from explorer.app.features.feature import Export, Services
from explorer.app.features.sharing.files import SharedFiles
from explorer.app.features.sharing.view_picture import LEAST, MOST
from explorer.app.session.session import Who
from explorer.app.state.frame import Frame
from explorer.app.widgets.assigning import Update
from explorer.app.widgets.buttons import open_button, press_button
from explorer.app.widgets.markup import box

PRESS = "export"


def export_button(_: Frame) -> str:
    """Return the button of the bar that opens the dialog, as HTML."""
    hint = "Download the workspace, the mechanism, pictures, reports and more."
    return open_button("Export", "Export", hint=hint, class_name="ex-tool ex-outlined")


class ExportDialog:
    """A row for each thing, with a button for each format; then pictures of any size."""

    def __init__(self, services: Services) -> None:
        gui, buttons = services.gui, services.buttons
        sends: dict[str, Callable[[Who], None]] = {}
        for each in services.exports:
            send = each.sender(services)
            for name in each.formats:
                value = _value(each, name)
                sends[value] = partial(send, name)
                buttons.offer(f"Export › {each.title} › {name}", each.hint, PRESS, value)
        buttons.on(PRESS, lambda value, client: sends[value](client.client_id), values=sends)
        gui.add_html(box("".join(_row(each) for each in services.exports)))
        with gui.add_folder("Picture of another size", expand_by_default=False):
            _add_picture(gui, services.get(SharedFiles))

    def updates(self, _: Frame) -> Iterator[Update]:
        """Yield nothing: the dialog stays as it is."""
        return iter(())


def _value(export: Export, name: str) -> str:
    """Return the value of the button for a format."""
    return f"{export.title} as {name}"


def _row(export: Export) -> str:
    buttons = "".join(
        press_button(
            PRESS,
            _value(export, name),
            escape(name),
            label=f"Export {_value(export, name)}",
            class_name="ex-button",
        )
        for name in export.formats
    )
    return (
        f'<div class="ex-export"><div><b>{escape(export.title)}</b>'
        f'<div class="ex-dim">{escape(export.hint)}</div></div>'
        f'<div class="ex-flow">{buttons}</div></div>'
    )


def _add_picture(gui: viser.GuiApi, files: SharedFiles) -> None:
    width = gui.add_number(
        "Width (px)", 1600, min=LEAST, max=MOST, step=1, hint=f"{LEAST} to {MOST} pixels."
    )
    height = gui.add_number(
        "Height (px)", 1200, min=LEAST, max=MOST, step=1, hint=f"{LEAST} to {MOST} pixels."
    )
    transparent = gui.add_checkbox(
        "Transparent", initial_value=False, hint="Leave out the background."
    )
    button = gui.add_button(
        "Download picture",
        icon=viser.Icon.PHOTO,
        hint="PNG of the scene with its labels, from your camera.",
    )

    @button.on_click
    def _(event: viser.GuiEvent[viser.GuiButtonHandle]) -> None:
        sides = (width.value, height.value)
        files.picture(sides, transparent=transparent.value, client_id=event.client_id)
