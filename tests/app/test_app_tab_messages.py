"""What a tab sends and is sent: switches of the view, and notices."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from client import Client, client_of, press_update, wait_for

from explorer.app.features.sharing.feature import send_picture
from explorer.app.features.view.feature import FORMS, LAYERS
from explorer.app.server import Running
from explorer.app.state.view import View
from explorer.mechanism.margins import TETRAHEDRA

PATIENCE_SECONDS = 60.0


def notices(messages: list[dict[str, Any]]) -> list[tuple[str, str]]:
    """Return the type and the text of the messages that show, change or remove a notice."""
    return [
        (message["type"], message.get("props", {}).get("body", ""))
        for message in messages
        if "Notification" in message["type"]
    ]


def find_control(client: Client, label: str) -> str:
    """Return the id of the control with this label, whatever blanks are in it."""
    (uuid,) = (
        uuid
        for uuid, props in client.controls.items()
        if str(props.get("label", "")).split() == label.split()
    )
    return uuid


def test_switch_of_the_view_switches_its_part_and_no_other(running: Running) -> None:
    def part_of(name: str) -> Callable[[View], bool]:
        return lambda view: bool(getattr(view, name))

    def tetrahedron_of(index: int) -> Callable[[View], bool]:
        return lambda view: view.tetrahedra[index]

    parts = {label: part_of(name) for label, (name, _) in LAYERS.items()}
    for index, points in enumerate(TETRAHEDRA):
        parts[f"δ{index + 1}: {' '.join(points)}"] = tetrahedron_of(index)
    session = running.page.session
    before = session.state.view
    with client_of(running) as client:
        for label, part in parts.items():
            switch, was = find_control(client, label), part(before)
            client.update(switch, not was)
            wait_for(lambda part=part, was=was: part(session.state.view) != was)
            view = session.state.view
            assert [o for o, p in parts.items() if p(view) != p(before)] == [label]
            client.update(switch, was)
            wait_for(lambda: session.state.view == before)


def test_form_of_the_mechanism_is_chosen_by_a_press_and_given_up_by_another(
    running: Running,
) -> None:
    session = running.page.session
    # A press on the form that is drawn goes back to the schematic.
    presses = [*((form, form) for form in FORMS), ("6-4 twin", "schematic")]
    with client_of(running) as client:
        for form, drawn in presses:
            client.update(*press_update(running, "view.form", form))
            wait_for(lambda drawn=drawn: session.state.view.drawn_as == drawn)


def test_picture_of_an_impossible_size_is_refused_to_the_tab_that_asks_alone(
    running: Running,
) -> None:
    with client_of(running) as client, client_of(running) as other:
        send_picture(running.page.services, (9, 100), client.client_id)
        messages: list[dict[str, Any]] = []
        while not any("pixels; got 9" in text for _, text in notices(messages)):
            messages += client.read()
        (text,) = (text for _, text in notices(messages) if "got 9" in text)
        assert "the width of a picture is 16 to 4,096 pixels; got 9" in text
        assert not any("got 9" in text for _, text in notices(other.read_all_sent(running)))
