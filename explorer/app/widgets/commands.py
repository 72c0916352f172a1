"""The names of the commands in the palette, and their keys.

The palette offers every button, switch and list of the page under its name there; features add
commands that have no control, and keys. Keys are those of other 3D programs: 0, 1, 3 and 7 for the
views, F to fit, H for home, letters for visible parts. None is a key of the browser, and W, A, S,
D, Q, E and the arrows move the camera.
"""

from __future__ import annotations

from collections.abc import Container
from dataclasses import dataclass
from typing import Protocol

# Separator of the parts of a command's name, from the tab to the option.
STEP = " › "


@dataclass(frozen=True)
class Key:
    """A key with its modifiers.

    Attributes:
        key: Name of the key in viser.
        modifier: Keys that are held down with it, such as "cmd/ctrl+shift"; None without any.
    """

    key: str
    modifier: str | None = None

    def __str__(self) -> str:
        parts = [] if self.modifier is None else self.modifier.split("+")
        modifiers = [MODIFIER_NAMES.get(part, part.capitalize()) for part in parts]
        return "+".join([*modifiers, self.key if len(self.key) == 1 else self.key.capitalize()])


MODIFIER_NAMES = {"cmd/ctrl": "Ctrl"}
"""Names of modifiers on the page; on a Mac the Command key does the same as Ctrl."""

PALETTE_KEY = Key("K", "cmd/ctrl")
"""The key that opens the palette, in viser."""

CAMERA_KEYS = frozenset("WASDQE")
"""Letters by which viser moves the camera, with any modifier."""


def shift(key: str) -> Key:
    """Return a key with Shift held down."""
    return Key(key, "shift")


PAGE = "Page"
"""First part of the names of commands of the whole page."""

NAMED_WITH_FOLDER = frozenset({"Free variables", "Tetrahedra"})
"""Folders whose title is part of the names of their switches."""

NO_OPTION = "—"
"""The text of a list when none of its options applies."""


class Offering(Protocol):
    """A control that may be offered in the palette."""

    @property
    def kind(self) -> str:
        """The kind of control, such as "button"."""
        ...

    @property
    def label(self) -> str:
        """The words beside the control."""
        ...

    @property
    def path(self) -> tuple[str, ...]:
        """The titles of its tab and folders, the outermost first."""
        ...

    @property
    def options(self) -> tuple[str, ...]:
        """The options to choose from."""
        ...


def offers(control: Offering, lists: Container[str] = ()) -> dict[str, str | None]:
    """Return the options that the commands of a control choose, by the names of the commands.

    Args:
        control: The control.
        lists: Labels of the lists whose every option is a command.
    """
    if control.kind in ("value", "upload"):
        return {}
    label = " ".join(control.label.split())
    folders = [title for title in control.path[1:] if title in NAMED_WITH_FOLDER]
    tab = control.path[0] if control.path else PAGE
    # The label of a row of buttons above the tabs takes the place of a tab.
    parts = [label] if control.kind == "choice" and not control.path else [tab, *folders, label]
    if control.kind in ("button", "switch"):
        return {STEP.join(parts): None}
    if control.kind == "list" and control.label not in lists:
        return {}
    return {
        STEP.join([*parts, " ".join(option.split())]): option
        for option in control.options
        if option != NO_OPTION
    }


def with_keys(hint: str, keys: tuple[Key, ...]) -> str:
    """Return the hint of a control with its keys at the end."""
    if not keys:
        return hint
    return f"{hint} {'Key' if len(keys) == 1 else 'Keys'}: {', '.join(map(str, keys))}."
