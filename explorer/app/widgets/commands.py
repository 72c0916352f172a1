"""What the command palette offers, by which names, and the keys that do the same.

Every button, switch and list of the page is offered under the names that it has there, so
that a new control is found without more ado; what has no control of its own is added by
the page. Keys are those of other programs that show things in space: 0, 1, 3 and 7 for the
views, as on their number pads, F to fit, H for home, letters for what is shown. None is one
of the browser's, and W, A, S, D, Q, E and the arrows move the camera.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Protocol

# Between the parts of a command's name, from the tab to the option.
STEP = " › "

Modifier = str


@dataclass(frozen=True)
class Key:
    """A key with those that are held down with it.

    Attributes:
        key: The key, as viser calls it.
        modifier: Such as "cmd/ctrl+shift", None without any.
    """

    key: str
    modifier: Modifier | None = None

    def __str__(self) -> str:
        parts = [] if self.modifier is None else self.modifier.split("+")
        held = [WORDS.get(part, part.capitalize()) for part in parts]
        return "+".join([*held, self.key if len(self.key) == 1 else self.key.capitalize()])


WORDS = {"cmd/ctrl": "Ctrl"}
"""What modifiers are called; on a Mac the Command key does the same."""

PALETTE_KEY = Key("K", "cmd/ctrl")
"""By which viser opens the palette."""

CAMERA_KEYS = frozenset("WASDQE")
"""Letters by which viser moves the camera, whatever is held down with them."""


def _shift(key: str) -> Key:
    return Key(key, "shift")


KEYS: dict[str, tuple[Key, ...]] = {
    "Edit › Undo": (Key("Z", "cmd/ctrl"),),
    "Edit › Redo": (Key("Z", "cmd/ctrl+shift"), Key("Y", "cmd/ctrl")),
    "View › Isometric": (Key("0"),),
    "View › Front": (Key("1"),),
    "View › Side": (Key("3"),),
    "View › Top": (Key("7"),),
    "View › Fit": (Key("F"),),
    "Move › Home pose": (Key("H"),),
    "Move › Next assembly mode": (Key("N"),),
    "Move › Previous assembly mode": (_shift("N"),),
    "Move › Use the nearest length": (Key("U"),),
    "Move › Other modes as ghosts": (Key("M"),),
    "View › Flags": (_shift("F"),),
    "View › Bodies": (Key("B"),),
    "View › Legs": (_shift("B"),),
    "View › Labels": (Key("L"),),
    "View › Grid": (Key("G"),),
    "View › Drag handle": (_shift("H"),),
    "View › All tetrahedra": (Key("T"),),
    "View › 6-4 twin": (_shift("T"),),
    "View › Closest pair": (_shift("C"),),
    "View › Prototype": (Key("R"),),
    "Workspace › Solid": (Key("V"),),
    "Workspace › Convex hull": (_shift("V"),),
    "Workspace › Singular planes": (_shift("P"),),
    "Workspace › Cut open › across x": (Key("X"),),
    "Workspace › Cut open › across y": (Key("Y"),),
    "Workspace › Cut open › across z": (Key("Z"),),
    "Workspace › Cut open › no cut": (Key("C"),),
    "Singularity › Go to the nearest one": (_shift("G"),),
    "Optimise › Optimise": (Key("O"),),
    "Optimise › Cancel": (_shift("O"),),
    "Paths › Watch": (_shift("M"),),
    "Paths › Plan": (Key("J"),),
    "Paths › Play or pause": (Key("P"),),
    "Page › Theme": (_shift("L"),),
    "Page › Keys": (Key("K"),),
}
"""Keys by the names of commands."""

NAMES = {"δ1 δ2 δ3": "Assembly mode"}
"""Of controls whose label alone would not be searched for."""

PAGE = "Page"
"""The place of what stands above all tabs."""

TOLD_WITH_FOLDER = frozenset({"What may change", "Tetrahedra"})
"""Folders whose title is part of what their switches mean."""

OPEN_LISTS = frozenset(
    {
        "δ1 δ2 δ3",
        "Arrows",
        "Preset",
        "On a change",
        "Region",
        "Reached from",
        "Orientation",
        "Colour by",
        "Cut open",
        "Objective",
        "Drawn as",
        "Ghost",
        "Ellipsoid",
    }
)
"""Lists of which every option is a command; what is chosen in the others alone does nothing."""

NO_OPTION = "—"
"""What a list shows when none of its options is the case."""

ALWAYS = ("Go to (",)
"""Beginnings of buttons that are hidden from the eye, and do what they say at any time."""

NEVER = (
    "Step ",
    "Front row ",
    "Vary ",
    "Measure ",
    "Open design ",
    "Duplicate design ",
    "Delete design ",
)
"""Beginnings of buttons that mean something only where they are shown."""


class Offering(Protocol):
    """A control that may be offered in the palette."""

    @property
    def kind(self) -> str:
        """Such as "button"."""
        ...

    @property
    def label(self) -> str:
        """The words beside it."""
        ...

    @property
    def path(self) -> tuple[str, ...]:
        """The titles of what it stands in."""
        ...

    @property
    def options(self) -> tuple[str, ...]:
        """Of which it offers one."""
        ...


def offers(control: Offering) -> dict[str, str | None]:
    """Return the names of the commands of a control, each with the option that it chooses."""
    if control.label.startswith(NEVER) or control.kind in ("value", "upload"):
        return {}
    label = NAMES.get(control.label, " ".join(control.label.split()))
    folders = [title for title in control.path[1:] if title in TOLD_WITH_FOLDER]
    tab = control.path[0] if control.path else PAGE
    # A row of buttons above the tabs is a place of its own.
    parts = [label] if control.kind == "choice" and not control.path else [tab, *folders, label]
    if control.kind in ("button", "switch"):
        return {STEP.join(parts): None}
    if control.kind == "list" and control.label not in OPEN_LISTS:
        return {}
    return {
        STEP.join([*parts, " ".join(option.split())]): option
        for option in control.options
        if option != NO_OPTION
    }


def with_keys(hint: str, keys: tuple[Key, ...]) -> str:
    """Return what is told of a control, and after it the keys that do the same."""
    if not keys:
        return hint
    return f"{hint} {'Key' if len(keys) == 1 else 'Keys'}: {', '.join(map(str, keys))}."
