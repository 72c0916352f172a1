"""What is shown and from where, in a real page: every switch, every view."""

from __future__ import annotations

import itertools
from collections.abc import Callable

from likeness import decoded, likeness
from playwright.sync_api import expect
from tab import Tab

from explorer.app.features.view.panel import FORMS, LAYERS
from explorer.app.scene.camera import VIEWS
from explorer.app.state.view import View
from explorer.mechanism.margins import TETRAHEDRA


def shows(name: str) -> Callable[[View], bool]:
    return lambda view: getattr(view, name)


def shows_tetrahedron(index: int) -> Callable[[View], bool]:
    return lambda view: view.tetrahedra[index]


def test_every_switch_of_the_view_switches_its_part_and_no_other(tab: Tab) -> None:
    tab.turn_to("Show")
    switches = {label: shows(name) for name, label, _ in LAYERS}
    for index, points in enumerate(TETRAHEDRA):
        switches[f"δ{index + 1}: {' '.join(points)}"] = shows_tetrahedron(index)
    before = tab.state.view
    for label, part in switches.items():
        was = part(before)
        tab.switch(label, on=not was)
        tab.wait_for(lambda part=part, was=was: part(tab.state.view) != was, label)
        changed = [other for other, p in switches.items() if p(tab.state.view) != p(before)]
        assert changed == [label]
        tab.switch(label, on=was)
        tab.wait_for(lambda: tab.state.view == before, f"{label} as before")


def test_the_mechanism_is_drawn_in_one_form_at_a_time(tab: Tab) -> None:
    tab.turn_to("Show")
    for form in (*FORMS, "schematic"):
        tab.push(form.capitalize())
        tab.wait_for(lambda form=form: tab.state.view.drawn_as == form, form)
        on = tab.page.get_by_role("group", name="Drawn as").locator("[aria-pressed=true]")
        expect(on).to_have_text(form.capitalize())
    tab.push("6-4 twin")
    tab.push("6-4 twin")
    tab.wait_for(lambda: tab.state.view.drawn_as == "schematic", "the schematic again")


def test_ghosts_are_switched_beside_the_modes(tab: Tab) -> None:
    before = tab.picture()
    tab.page.get_by_role("button", name="Other modes as ghosts").click()
    tab.wait_for(lambda: tab.state.view.ghosts, "the ghosts")
    # They hang below the base too, where there was nothing.
    spot = likeness(decoded(before), decoded(tab.picture())).spot
    assert spot > 5.0


def test_the_warning_length_turns_the_word_of_the_panel(tab: Tab) -> None:
    assert tab.page.get_by_text("Clear of singularities").is_visible()
    tab.type("Warn below", "30")
    tab.page.get_by_text("Near a singularity").wait_for()
    assert tab.state.view.warn_below == 30.0


def test_each_view_frames_the_mechanism_from_its_side(tab: Tab) -> None:
    pictures: list[bytes] = []
    for view in VIEWS:
        tab.look_from(view)
        pictures.append(tab.picture())
    for one, other in itertools.combinations(map(decoded, pictures), 2):
        spot = likeness(one, other).spot
        assert spot > 10.0


def test_a_page_that_is_loaded_again_draws_the_same_scene(tab: Tab) -> None:
    # Of a mesh that has got another shape, three.js may keep drawing the first one.
    before = decoded(tab.picture())
    for _ in range(3):
        tab.reload()
        assert likeness(before, decoded(tab.picture())).spot < 2.0
