"""*What must it do?* on the page: the form, the search, its answers, the checklist and the box."""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Callable, Generator
from pathlib import Path
from typing import Any

import msgspec
import numpy as np
import pytest
import viser
from desk import Desk, controls_of, markup_of
from services import StubJobs, services_for

from explorer.app.features.designs.feature import SavedDesigns
from explorer.app.features.feature import Services
from explorer.app.features.requirement import words
from explorer.app.features.requirement.feature import (
    PREPARE,
    REQUIREMENT,
    Checklist,
    Finder,
    RequirementPanel,
)
from explorer.app.features.requirement.scene import EDGES, box_corners
from explorer.app.features.requirement.state import CHECK_FEED, EXAMPLE, Required
from explorer.app.server import FIRST_DESIGN
from explorer.app.session.session import UNDO
from explorer.app.state.actions import Set, open_design
from explorer.app.state.frame import Frame
from explorer.app.state.geometry import set_unit
from explorer.app.storage.library import Library
from explorer.app.storage.session_file import SessionFile
from explorer.app.storage.user_data import UserData
from explorer.app.widgets.buttons import Buttons
from explorer.find.answers import (
    DemandCheck,
    FoundDesign,
    FoundDesigns,
    Relaxation,
    RequirementCheck,
)
from explorer.find.check import check_requirement
from explorer.find.requirement import Requirement, decode_requirement, encode_requirement
from explorer.jobs.jobs import LongJob, do_nothing
from explorer.jobs.process import CANCELLED, Call
from explorer.measures.catalogue import measure_design
from explorer.measures.measure import Case
from explorer.mechanism.design import Design
from explorer.mechanism.design_file import PRESETS
from explorer.mechanism.pose import Pose
from explorer.prototype.fitting import buildability

OPTIMAL = PRESETS["paper-optimal"]
FOUND = msgspec.structs.replace(
    PRESETS["paper-initial"],
    name="need balanced",
    required_box=((1.0, 2.0, 3.0), (21.0, 17.0, 13.0)),
    required_yaw=30.0,
)
WORST = Pose.of_yaw_pitch_roll((9.0, 4.0, 8.0), (-70.0, 5.0, 10.0))
KEPT = DemandCheck("ratio", "l1", True, 1.77, 1.8, 0.03, "", WORST, True)
CLEAR = DemandCheck(
    *("clearance", "legs 1–4", True, 6.2, 5.0, 1.2, "mm", WORST, False),
    "no violation in 50000 poses",
)
MISSED = DemandCheck("swing", "b1", False, 47.3, 45.0, -2.3, "°", WORST, False)
BUILT = DemandCheck("buildable", "", False, 0.0, 0.0, 0.0, "", None, False, "carriages meet")


def answer(design: Design = FOUND, kind: str = "balanced", **more: Any) -> FoundDesign:
    """Return a machine that was found, with numbers of its own."""
    check = RequirementCheck((KEPT, CLEAR), 50000)
    return FoundDesign(design, check, kind, 361.4, 0.5, 1.6, 6.2, 0.52, more.pop("error_mm", 0.0))


class HeldJobs(StubJobs):
    """Jobs that keep what a search is answered by, and whether it was cancelled."""

    def __init__(self) -> None:
        super().__init__()
        self.searches: list[tuple[Requirement, dict[str, Callable[[Any], None]], LongJob]] = []

    def start(
        self,
        task: Callable[..., Any],
        arguments: tuple[Any, ...],
        done: Callable[[Any], None] = lambda _: None,
        failed: Callable[[str], None] = lambda _: None,
        receive: Callable[[Any], None] | None = None,
        **more: Any,
    ) -> LongJob:
        if receive is None:
            return super().start(task, arguments, done, failed, receive, **more)
        job = LongJob(Call(task, arguments, {}, is_sending=True), receive, None)
        job.set_running_or_notify_cancel()
        answers = {"done": done, "failed": failed, "receive": receive}
        self.searches.append((arguments[0], answers, job))
        return job

    def answer(self, kind: str, value: object, search: int = -1) -> None:
        """Answer a search, the last one by default."""
        self.searches[search][1][kind](value)


@pytest.fixture
def jobs() -> Generator[HeldJobs]:
    made = HeldJobs()
    yield made
    made.stop()


@pytest.fixture
def panel(services: Services) -> RequirementPanel:
    return RequirementPanel(services)


def start(services: Services, desk: Desk, panel: RequirementPanel) -> dict[str, Any]:
    """Press the button that finds machines; return the controls."""
    controls = controls_of(services, panel, desk.state)
    desk.session.wait_until_idle()
    press(controls["Find machines"])
    return controls


def press(handle: Any) -> None:
    """Press a button of viser."""
    event = viser.GuiEvent(client=None, client_id=1, target=handle)
    for callback in handle._impl.update_cb:
        callback(event)


def test_zero_in_the_form_demands_nothing_and_numbers_are_millimetres_in_every_unit(
    services: Services, desk: Desk, panel: RequirementPanel
) -> None:
    controls = controls_of(services, panel, desk.state)
    assert (controls["Box (mm)"].value, controls["Longest (mm)"].value) == (EXAMPLE.box_mm, 0.0)
    desk.use(controls["Longest (mm)"], 400.0)
    desk.use(controls["Swing (°)"], 0.0)
    desk.use(controls["Prefer"], "easy to build")
    form = Required.of(desk.state).form
    assert (form.legs.longest_mm, form.swing_deg, form.prefer) == (400.0, None, "easy-to-build")
    desk.session.do(lambda state: set_unit(state, 25.0))
    desk.session.do(open_design(FOUND))
    assert Required.of(desk.state).form == form
    assert controls_of(services, panel, desk.state)["Longest (mm)"].value == 400.0
    desk.use(controls["Length ratio"], 1.0)
    assert Required.of(desk.state).form == form
    (complaint,) = desk.complaints
    assert "above 1" in complaint


def test_gravity_and_data_sheet_are_taken_into_the_form(
    services: Services, desk: Desk, panel: RequirementPanel
) -> None:
    controls = controls_of(services, panel, desk.state)
    desk.use(controls["Hanging"], True)
    controls["Data sheet"].value = "stroke 150 retracted 250 push 400 N"
    press(controls["Read the row"])
    form = Required.of(desk.state).form
    assert form.gravity == (0.0, 0.0, 1.0)
    assert (form.legs.ratio, form.legs.longest_mm, form.legs.push_n) == (1.6, 400.0, 400.0)
    assert form.legs.diameter_mm == EXAMPLE.legs.diameter_mm
    controls["Data sheet"].value = "nothing"
    press(controls["Read the row"])
    assert Required.of(desk.state).form == form
    assert desk.complaints[-1].startswith("no value in the row: name each")


def test_search_shows_machines_as_they_are_found_and_drops_those_of_an_earlier_one(
    services: Services, desk: Desk, panel: RequirementPanel, jobs: HeldJobs, buttons: Buttons
) -> None:
    # The press that opens the form starts the processes that will be needed.
    desk.press(buttons, PREPARE)
    assert [order.task for order in jobs.orders] == [do_nothing, do_nothing]
    controls = start(services, desk, panel)
    assert jobs.searches[0][0] == EXAMPLE
    assert "Searching …" in markup_of(panel, desk.state)
    assert controls_of(services, panel, desk.state)["Cancel"].visible
    assert not controls["Find machines"].visible
    jobs.answer("receive", FoundDesigns((answer(),), 342.0))
    content = markup_of(panel, desk.state)
    for text in ("Balanced", "361 mm", "1.6 N", "6.2 mm", "0.52", "No violation in 50,000 poses"):
        assert text in content
    assert "No machine has legs below 342 mm." in content
    assert "is-outdated" not in content
    # The form has changed since.
    desk.use(controls["Largest tilt (°)"], 20.0)
    assert "is-outdated" in markup_of(panel, desk.state)
    press(controls["Cancel"])
    assert jobs.searches[0][2].is_to_end
    press(controls["Find machines"])
    assert jobs.searches[1][0] == Required.of(desk.state).form
    jobs.answer("receive", FoundDesigns((answer(kind="stiff"),), 0.0))
    jobs.answer("done", FoundDesigns((), 0.0, status="cancelled"), 0)
    finder = services.get(Finder)
    assert finder.job is not None
    assert finder.found is not None
    assert [each.kind for each in finder.found.designs] == ["stiff"]
    jobs.answer("done", FoundDesigns((answer(kind="stiff"), answer(kind="small")), 0.0))
    assert finder.job is None
    assert "Open Small" in markup_of(panel, desk.state)
    # Until a search ends, a machine may miss what is checked last.
    nearly = dataclasses.replace(answer(), check=RequirementCheck((KEPT, BUILT), 0))
    press(controls["Find machines"])
    jobs.answer("receive", FoundDesigns((nearly,), 0.0))
    assert "Misses buildable" in markup_of(panel, desk.state)


def test_search_that_fails_or_is_cancelled_keeps_what_it_has_found(
    server: viser.ViserServer, desk: Desk, buttons: Buttons, jobs: HeldJobs
) -> None:
    services = services_for(server, desk.session, jobs, buttons=buttons, complain=desk.complain)
    panel = RequirementPanel(services)
    # A search that is cancelled in vain is ended with its process.
    for problem, told in ((CANCELLED, []), ("it died", ["it died"])):
        start(services, desk, panel)
        jobs.answer("receive", FoundDesigns((answer(),), 0.0))
        jobs.answer("failed", problem)
        assert desk.complaints == told
        assert services.get(Finder).job is None
        assert "Open Balanced" in markup_of(panel, desk.state)


def test_machine_that_is_opened_has_its_requirement_beside_it_and_one_undo_takes_both_back(
    services: Services, desk: Desk, panel: RequirementPanel, jobs: HeldJobs, buttons: Buttons
) -> None:
    controls = start(services, desk, panel)
    jobs.answer("done", FoundDesigns((answer(),), 342.0))
    desk.use(controls["Largest tilt (°)"], 20.0)
    desk.press(buttons, words.OPEN, 1)
    assert desk.state.design == OPTIMAL
    desk.press(buttons, words.OPEN, 0)
    assert desk.state.design == FOUND
    assert Required.of(desk.state).requirement == EXAMPLE
    desk.session.do(UNDO)
    assert desk.state.design == OPTIMAL
    assert Required.of(desk.state).requirement is None
    assert Required.of(desk.state).form.tilt_deg == 20.0


def test_relaxation_is_taken_into_the_form_and_searched_for(
    services: Services, desk: Desk, panel: RequirementPanel, jobs: HeldJobs, buttons: Buttons
) -> None:
    start(services, desk, panel)
    less = msgspec.structs.replace(EXAMPLE, tilt_deg=12.8)
    smaller = msgspec.structs.replace(EXAMPLE, box_mm=(100.0, 75.0, 50.0))
    nearest = (
        Relaxation("tilt_deg", 12.8, "°", "tilt 12.8°", less),
        Relaxation("box_mm", 0.5, "", "box 100 × 75 × 50 mm", smaller),
    )
    impossible = FoundDesigns((), 900.0, ("no leg can do it",), (), nearest, "impossible")
    jobs.answer("done", impossible)
    content = markup_of(panel, desk.state)
    assert "No leg can do it." in content
    assert all(each.words in content for each in nearest)
    desk.press(buttons, words.RELAX, 0)
    assert Required.of(desk.state).form == jobs.searches[-1][0] == less
    # The new search has no answer yet.
    desk.press(buttons, words.RELAX, 1)
    assert len(jobs.searches) == 2
    jobs.answer("done", FoundDesigns((), 0.0, status="none"))
    assert "No machine was found" in markup_of(panel, desk.state)


def test_checklist_says_what_is_missed_by_how_much_and_a_press_goes_there(
    services: Services, desk: Desk, panel: RequirementPanel, jobs: HeldJobs, buttons: Buttons
) -> None:
    checklist, feed = Checklist(services), services.get(CHECK_FEED)
    assert checklist(Frame(desk.state)) == ""
    press(controls_of(services, panel, desk.state)["Check this design"])
    feed.follow(Frame(desk.state))
    assert feed.request == (OPTIMAL, EXAMPLE)
    assert "Checking …" in checklist(Frame(desk.state))
    check = RequirementCheck((KEPT, CLEAR, MISSED, BUILT), 50000)
    (order,) = [order for order in jobs.orders if order.request == feed.request]
    order.done(check)
    content = checklist(Frame(desk.state))
    for text in (
        "2 of 4 demands missed",
        "Clearance (legs 1–4)",
        "1.77 ≤ 1.8",
        "6.2 ≥ 5 mm",
        "No violation in 50000 poses.",
        "47.3 > 45°",
        "by 2.3°",
        "Carriages meet.",
    ):
        assert text in content
    desk.press(buttons, words.GO, MISSED.name)
    assert desk.state.pose == WORST
    desk.press(buttons, words.GO, BUILT.name)
    assert desk.state.pose == WORST
    # Every change of the design is checked again, and the last check is pale until then.
    desk.session.do(Set("design.b2", 3.0))
    feed.follow(Frame(desk.state))
    assert "is-outdated" in checklist(Frame(desk.state))
    order.done(RequirementCheck((KEPT,), 0))
    assert "Requirement kept" in checklist(Frame(desk.state))
    desk.press(buttons, words.DROP)
    assert checklist(Frame(desk.state)) == ""
    assert Required.of(desk.state).requirement is None


def test_requirement_file_that_is_dropped_opens_in_the_form_and_is_saved_again(
    server: viser.ViserServer, desk: Desk, buttons: Buttons, tmp_path: Path
) -> None:
    services = services_for(
        server,
        desk.session,
        buttons=buttons,
        complain=desk.complain,
        user_data=UserData(Library(tmp_path / "designs"), SessionFile()),
        declared=(REQUIREMENT,),
    )
    saved = services.get(SavedDesigns)
    lid = msgspec.structs.replace(EXAMPLE, name="lid", tilt_deg=3.0)
    for content in (encode_requirement(lid), b'{"box_mm": [1, 2, 3], "tilt": 4}'):
        saved.take(content, "lid.json")
        assert saved.wait_until_idle()
        assert Required.of(desk.state).form == lid
    assert desk.state.design == OPTIMAL
    (complaint,) = desk.complaints
    assert "lid.json" in complaint
    assert "tilt" in complaint
    press(controls_of(services, RequirementPanel(services), desk.state)["Save as a file"])
    downloads: Any = services.downloads
    assert downloads.sent == [(1, "lid.json")]
    assert decode_requirement(downloads.data, "it") == lid
    services.stop()


def test_box_is_that_of_the_requirement_about_home_else_of_the_design_turned_by_its_yaw() -> None:
    assert box_corners(OPTIMAL) is None
    for corners, edges, middle in (
        (box_corners(FOUND), (20.0, 15.0, 10.0), (11.0, 9.5, 8.0)),
        (box_corners(FOUND, EXAMPLE), (20.0, 15.0, 10.0), FOUND.home_pose.position),
    ):
        assert corners is not None
        assert corners.mean(axis=0) == pytest.approx(middle)
        sides = np.diff(corners[EDGES], axis=1)[:, 0]
        assert np.sort(np.linalg.norm(sides, axis=1)) == pytest.approx(np.repeat(np.sort(edges), 4))
        along = sides[np.isclose(np.linalg.norm(sides, axis=1), 20.0)]
        assert np.degrees(np.arctan2(along[:, 1], along[:, 0])) == pytest.approx(30.0)


def test_first_design_can_be_built_and_keeps_the_requirement_of_the_form() -> None:
    design = PRESETS[FIRST_DESIGN]
    check = check_requirement(design, EXAMPLE)
    assert check.kept, [demand.words for demand in check.missed]
    assert check.proven
    numbers = [n for each in check.demands for n in (each.worst, each.limit, each.spare)]
    assert {*map(type, numbers)} == {float}
    assert {type(each.kept) for each in check.demands} == {bool}
    rows = words.checklist(check, "", "")
    assert "Requirement kept" in rows
    assert "is-beyond" not in rows
    # In a singular pose a force is infinite, and misses its limit by no number.
    endless = check.demands[0]._replace(kept=False, worst=math.inf, limit=5.0, spare=-math.inf)
    rows = words.checklist(dataclasses.replace(check, demands=(endless,)), "", "")
    assert "∞ &gt; 5" in rows or "∞ > 5" in rows
    assert ">no<" in rows
    built = buildability(design)
    assert not built.problems
    assert not built.short_legs
    names = ("volume", "accessible_volume", "mean_transmission_index")
    both = [measure_design(Case(each), names) for each in (design, OPTIMAL)]
    (_, clear, own), (most, _, paper) = (
        [float(row[name] or 0.0) for name in names] for row in both
    )
    assert own >= 0.5 > paper
    # Also the part that home reaches without a collision of the legs is larger for the reach.
    assert clear / design.reach**3 >= most / OPTIMAL.reach**3
