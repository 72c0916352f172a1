"""Commands that no control of the page has: steps to the next, and switches of several things."""

from __future__ import annotations

import itertools
from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace

import viser

from explorer.app.features.designs.shelf import Shelf
from explorer.app.features.paths.actions import Play
from explorer.app.features.singularity.actions import GoToSingularity
from explorer.app.session.session import Session
from explorer.app.state.action import Action
from explorer.app.state.actions import SetMode, SetView
from explorer.app.state.state import State
from explorer.app.widgets.palette import Command

# Sign triples of three margins.
MODE_COUNT = 8
# Saved designs that the palette offers; the list of them has more.
MOST_SAVED = 200


@dataclass(frozen=True)
class Deed:
    """A change of the state by its name.

    Attributes:
        label: Of the command.
        does: In a sentence.
        change: The action that a state asks for.
        is_ready: Whether a state allows it.
    """

    label: str
    does: str
    change: Callable[[State], Action]
    is_ready: Callable[[State], bool] = lambda _: True


def _to_mode(step: int) -> Callable[[State], Action]:
    return lambda state: SetMode((state.mode + step) % MODE_COUNT)


def _all_tetrahedra(state: State) -> Action:
    on = not all(state.view.tetrahedra)
    return SetView(replace(state.view, tetrahedra=(on, on, on)))


def _prototype(state: State) -> Action:
    prototype = replace(state.view.prototype, shown=not state.view.prototype.shown)
    return SetView(replace(state.view, prototype=prototype))


def _play(state: State) -> Action:
    return Play(state.journey is None or not state.journey.is_playing)


DEEDS = (
    Deed(
        "Move › Next assembly mode",
        "Take the same leg lengths to the next of the eight ways to assemble them.",
        _to_mode(1),
    ),
    Deed(
        "Move › Previous assembly mode",
        "Take the same leg lengths to the previous of the eight ways to assemble them.",
        _to_mode(-1),
    ),
    Deed(
        "View › All tetrahedra",
        "Show or hide the three tetrahedra that are flat where the mechanism is singular.",
        _all_tetrahedra,
    ),
    Deed(
        "View › Prototype",
        "Draw the mechanism as parts that can be made, or schematically again.",
        _prototype,
        lambda state: not state.view.twin,
    ),
    Deed(
        "Singularity › Go to the nearest one",
        "Move the mechanism to the closest of the nearest poses of δ1, δ2 and δ3.",
        lambda _: GoToSingularity(None),
    ),
    Deed(
        "Paths › Play or pause",
        "Move along the path at hand, or stay here.",
        _play,
        lambda state: state.journey is not None,
    ),
)


def session_commands(session: Session) -> tuple[Command, ...]:
    """Return the commands that change the state of a session."""
    return tuple(_command(session, deed) for deed in DEEDS)


def _command(session: Session, deed: Deed) -> Command:
    def run(client: viser.ClientHandle) -> None:
        session.post(object(), deed.change, who=client.client_id)

    return Command(deed.label, deed.does, run, lambda: deed.is_ready(session.state))


def saved_commands(shelf: Shelf) -> Iterator[Command]:
    """Yield the commands that open the saved designs, the last saved first."""
    useful = (entry for entry in shelf.entries if entry.design is not None)
    for entry in itertools.islice(useful, MOST_SAVED):

        def run(client: viser.ClientHandle, name: str = entry.name) -> None:
            shelf.open(name, client.client_id)

        yield Command(f"Designs › Open {entry.name}", "Open this saved design.", run)
