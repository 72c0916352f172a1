"""The parts of the names of the commands in the palette, and their keys.

Keys are those of other 3D programs: 0, 1, 3 and 7 for the
views, F to fit, H for home, letters for visible parts. None is a key of the browser, and W, A, S,
D, Q, E and the arrows move the camera.
"""

from __future__ import annotations

from dataclasses import dataclass

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


def with_keys(hint: str, keys: tuple[Key, ...]) -> str:
    """Return the hint of a control with its keys at the end."""
    if not keys:
        return hint
    return f"{hint} {'Key' if len(keys) == 1 else 'Keys'}: {', '.join(map(str, keys))}."
