"""Tasks of a newcomer at the page: what is found by its words, and in how many presses."""

from __future__ import annotations

import csv
import io
import re
import zipfile
from pathlib import Path

import numpy as np
import pytest
from limited_designs import scaled_design
from newcomer import Newcomer, hue, numbers
from playwright.sync_api import expect
from tab import Tab

from explorer.app.features.paths.state import journey_of
from explorer.app.features.paths.stops import stops_of
from explorer.app.features.prototype.work import export_simulation
from explorer.app.features.requirement.state import Required
from explorer.app.scene.placing import Placed
from explorer.app.screenshot import SCENE_CANVAS
from explorer.app.state.actions import Set
from explorer.app.state.frame import Frame
from explorer.app.state.view import View
from explorer.find.check import check_requirement
from explorer.find.requirement import RequiredLegs, RequiredLoad
from explorer.mechanism.design import Design
from explorer.mechanism.design_file import PRESETS, decode_design, encode_design
from explorer.numerics.number_text import format_number
from explorer.optimise.outcome import decode_record
from explorer.workspace.slices.volume import workspace_volume

OPTIMAL, INITIAL = PRESETS["paper-optimal"], PRESETS["paper-initial"]
SIZE, LARGER = (1280, 720), (1440, 900)
# A value of a3x other than that of the paper's optimum, and the design with it.
A3X = 18.0
CHANGED = OPTIMAL.with_variables((A3X, *OPTIMAL.variables[1:]))
# Pixels below the words of an axis at which it is pressed and released.


@pytest.fixture
def newcomer(data_tab: Tab) -> Newcomer:
    """A newcomer at the start page in a window of a small laptop."""
    data_tab.running.page.session.do(Set("view", View()))
    data_tab.resize(SIZE)
    return Newcomer(data_tab)


def volume_of(design: Design) -> str:
    """Return the volume of a design as the page writes it."""
    return format_number(workspace_volume(design).volume)


def model_in(data: bytes) -> str:
    """Return the model in a 3MF file."""
    with zipfile.ZipFile(io.BytesIO(data)) as archive:
        return archive.read("3D/3dmodel.model").decode()


def test_pose_near_a_singularity_is_named_in_amber_with_its_distance(newcomer: Newcomer) -> None:
    assert 90.0 < hue(newcomer.sees("Clear of singularities")) < 150.0
    newcomer.type("z", "5")
    assert 25.0 < hue(newcomer.sees("Near a singularity")) < 50.0
    newcomer.wait()
    words = newcomer.sees(
        re.compile("mm of motion to the nearest singular pose, a1 on the platform plane")
    ).inner_text()
    assert 0.0 < numbers(words)[0] < 1.0
    nearest = newcomer.figure("Nearest singular pose")
    expect(nearest).to_contain_text("mm of motion")
    assert numbers(nearest.inner_text())[0] == numbers(words)[0]
    assert newcomer.presses_for() == 2
    newcomer.press("Go to δ1 = 0")
    newcomer.sees(re.compile("^Singular$"))
    newcomer.sees("Boundary of modes 1 and 5")
    assert newcomer.presses_for() == 1


def test_volume_after_a_change_of_the_design_is_in_sight(newcomer: Newcomer) -> None:
    volume = newcomer.figure("Volume")
    expect(volume).to_contain_text(volume_of(OPTIMAL))
    newcomer.open("Design")
    newcomer.type("a3x", f"{10.0 * A3X:g}")
    assert newcomer.presses_for() == 3
    expect(volume).to_contain_text(volume_of(CHANGED))
    expect(volume).to_be_in_viewport(ratio=1.0)
    assert newcomer.presses_for() == 0


def test_problem_of_the_paper_is_solved_in_three_presses(newcomer: Newcomer, data_tab: Tab) -> None:
    newcomer.open("Optimise")
    newcomer.press("The paper's problem")
    newcomer.button("Undo The paper's problem").wait_for()
    expect(newcomer.field("Demanded clearance (mm)")).to_have_value("2")
    newcomer.press("Optimise")
    # A search takes minutes on a busy machine.
    newcomer.page.get_by_text("Converged", exact=True).first.wait_for(timeout=300_000)
    newcomer.sees(re.compile("^Converged$"))
    newcomer.wait()
    assert newcomer.presses_for() == 3
    assert newcomer.filled() == ["Accept"]
    expect(newcomer.button("Accept")).to_be_in_viewport(ratio=1.0)
    rows = newcomer.page.get_by_role("row")
    volume = rows.filter(has_text=re.compile("^volume")).inner_text()
    clearance = rows.filter(has_text=re.compile("^clearance")).inner_text()
    assert numbers(volume)[1] >= 8000.0
    assert numbers(clearance)[1] >= 0.2
    expect(newcomer.figure("Volume")).to_contain_text("8,000 cm³")
    found = data_tab.state.design
    expect(newcomer.page.locator(".ex-course:visible")).to_have_count(3)
    for words, decode in (("Design", decode_design), ("Record of the search", decode_record)):
        read = decode(newcomer.export(words, "JSON"), words)
        assert (read if isinstance(read, Design) else read.design).variables == found.variables
    newcomer.presses_for()
    newcomer.press("Accept")
    newcomer.sees("accepted")
    expect(newcomer.button("Accept")).to_have_count(0)
    assert data_tab.state.design == found
    assert newcomer.presses_for() == 1
    # What was found cannot be built yet: its carriages are too close together.
    newcomer.sees("Not buildable")
    newcomer.presses_for()
    newcomer.press(re.compile("^Set the unit to "))
    newcomer.sees("Strokes too short")
    expect(newcomer.figure("Buildable")).to_contain_text("strokes too short")
    assert newcomer.presses_for() == 1


def test_three_designs_are_compared_by_volume_and_overlay(newcomer: Newcomer) -> None:
    newcomer.open("Compare")
    newcomer.press("Pin paper-initial")
    newcomer.press("Pin this design")
    newcomer.open("Design")
    newcomer.type("a3x", f"{10.0 * A3X:g}")
    volumes = [workspace_volume(each).volume for each in (CHANGED, INITIAL, OPTIMAL)]
    row = newcomer.page.get_by_role("row").filter(has_text=re.compile("^volume cm³"))
    newcomer.wait_for_numbers(row, volumes)
    newcomer.press("Overlay workspaces")
    overlay = newcomer.button("Overlay workspaces")
    expect(overlay).to_have_attribute("aria-pressed", "true")
    assert newcomer.presses_for() == 7


def test_path_is_planned_and_played(newcomer: Newcomer, monkeypatch: pytest.MonkeyPatch) -> None:
    # So long that even a slow browser can stop it on the way.
    monkeypatch.setattr("explorer.app.features.paths.state.WATCH_SECONDS", 600.0)
    newcomer.open("Paths")
    newcomer.press("Pose 2")
    newcomer.choose("Pose", "Mode 7: + + +")
    newcomer.press("Go")
    newcomer.button(re.compile("^Playing ")).wait_for()
    # The first of the time may read 0.
    expect(newcomer.field("Time (s)")).not_to_have_value(re.compile(r"^0(\.0*)?$"))
    newcomer.press_running("Pause")
    newcomer.sees("Singular 2 times")
    newcomer.button("Play").wait_for()
    newcomer.wait()
    words = newcomer.page.locator(".ex-course text").all_text_contents()
    assert {"0", "200", "400", "flat"} <= {*words}
    assert 0.0 < float(newcomer.field("Time (s)").input_value()) < 600.0
    assert newcomer.presses_for() == 6
    monkeypatch.undo()
    newcomer.press("Home pose")
    expect(newcomer.field("roll (°)")).to_have_value("0")
    newcomer.press("Pose 2")
    newcomer.choose("Pose", "Present pose")
    newcomer.type("Pose x, y, z (mm) z", "80")
    newcomer.press("Without singularity")
    newcomer.press("Go")
    newcomer.sees(re.compile("^Planned path of"))
    newcomer.sees(re.compile("^No singular pose;"))
    expect(newcomer.field("z")).to_have_value(re.compile(r"^80(\.0+)?$"))
    assert newcomer.presses_for() == 8


def test_pick_and_place_with_a_lift_is_played_and_exported_as_it_is_timed_in_20_presses(
    newcomer: Newcomer, data_tab: Tab
) -> None:
    newcomer.open("Paths")
    expect(newcomer.page.locator(".ex-course:visible")).to_have_count(0)
    newcomer.press("Add the present pose")
    for number, axis, value in ((1, "z", "110"), (2, "x", "140"), (3, "z", "90")):
        newcomer.press(f"Copy pose {number}, to change the copy")
        newcomer.type(f"Pose x, y, z (mm) {axis}", value)
    newcomer.choose("Time law", "In a given time")
    newcomer.type("Duration (s)", "0.5")
    newcomer.press("Go")
    newcomer.sees("Takes 0.5 s.")
    newcomer.sees("Actuators along the path, 0.5 s")
    expect(newcomer.field("Time (s)")).to_have_value("0.5")
    with newcomer.page.expect_download() as download:
        newcomer.press("Export CSV")
    assert newcomer.presses_for() <= 20
    rows = [*csv.DictReader(io.StringIO(Path(download.value.path()).read_text("utf-8")))]
    assert float(rows[-1]["time_s"]) == pytest.approx(0.5)
    places = np.array([[float(row[f"{axis} [mm]"]) for axis in "xyz"] for row in rows])
    for corner in ((100, 50, 90), (100, 50, 110), (140, 50, 110), (140, 50, 90)):
        assert np.abs(places - corner).max(axis=1).min() < 0.1
    journey = journey_of(data_tab.state)
    assert journey is not None
    assert (journey.at, journey.is_playing) == (pytest.approx(0.5), False)


def test_poses_of_a_path_are_taken_from_a_file(
    newcomer: Newcomer, data_tab: Tab, tmp_path: Path
) -> None:
    table = tmp_path / "pick.csv"
    newcomer.open("Paths")
    for lines, words in (
        (("x_mm,y_mm,pause_s", "100,50,0"), "pick.csv has no column z"),
        (("x_mm,y_mm,z_mm,dwell_s", "100,50,90,0.2"), "without its columns dwell_s"),
        (("x_mm,y_mm,z_mm,pause_s", "100,50,90,0.2", "100,50,110,0"), "path from pick.csv: 2"),
    ):
        table.write_text("\n".join(lines), encoding="utf-8")
        with newcomer.page.expect_file_chooser() as chooser:
            newcomer.press("Poses from a file …")
        chooser.value.set_files(table)
        # It closes by itself.
        expect(newcomer.notices(words)).to_have_count(1)
        newcomer.wait()
    newcomer.sees(re.compile(r"^2\. 100\.0, 50\.0, 110\.0"))
    assert [stop.pause for stop in stops_of(data_tab.state)] == [0.2, 0.0]


def test_prototype_is_shown_and_exported(newcomer: Newcomer, data_tab: Tab) -> None:
    newcomer.open("Prototype")
    newcomer.press("Show the parts", "checkbox")
    newcomer.sees("mass, g")
    assert newcomer.presses_for() == 2
    assert model_in(newcomer.export("Mechanism", "3MF")).count("<object ") > 5
    assert newcomer.presses_for() <= 3
    density = data_tab.state.view.prototype.density
    assert newcomer.export("Simulation", "MJCF") == export_simulation(OPTIMAL, density)


def test_machine_for_a_task_is_found_and_taken_along_in_25_presses(
    newcomer: Newcomer, data_tab: Tab
) -> None:
    newcomer.press("What must it do?")
    newcomer.type_all("Box (mm) x", "160", "120", "80", "10", "1.5", "4")
    newcomer.type_all("Length ratio", "1.9", "0", "250", "0", "14", "4", "50")
    assert newcomer.presses == 16
    newcomer.press("Find machines")
    # A search takes a minute on a busy machine.
    newcomer.button("Open Balanced").wait_for(timeout=300_000)
    newcomer.button("Find machines").wait_for(timeout=300_000)
    newcomer.press("Open Balanced")
    newcomer.sees("Requirement kept")
    required = Required.of(data_tab.state).requirement
    assert required is not None
    assert (required.box_mm, required.tilt_deg) == ((160.0, 120.0, 80.0), 10.0)
    assert required.payload == RequiredLoad(1.5, (0.0, 0.0, 30.0), 4.0)
    assert required.legs == RequiredLegs(ratio=1.9, push_n=250.0, diameter_mm=14.0, apart_mm=4.0)
    assert required.swing_deg == 50.0
    assert check_requirement(data_tab.state.design, required).kept
    assert newcomer.export("Mechanism", "STEP").startswith(b"ISO-10303-21")
    report = newcomer.export("Report", "HTML")
    assert data_tab.state.design.name.encode() in report
    assert newcomer.presses_for() <= 25


def test_mechanism_ten_thousand_times_larger_is_in_sight_and_again_after_undo(
    newcomer: Newcomer, data_tab: Tab, tmp_path: Path
) -> None:
    def is_in_sight() -> bool:
        box = data_tab.page.locator(SCENE_CANVAS).bounding_box()
        points = Placed(Frame(data_tab.state)).points
        ends = np.array([data_tab.on_screen(points[name]) for name in ("a1", "a3", "b4")])
        assert box is not None
        size = np.array([box["width"], box["height"]])
        inside = (ends > [box["x"], box["y"]]) & (ends < size + [box["x"], box["y"]])
        # A mechanism as small as a dot is not seen.
        return bool(inside.all() and np.ptp(ends, axis=0).max() > 0.2 * size.min())

    file = tmp_path / "larger.json"
    file.write_bytes(encode_design(scaled_design(OPTIMAL, 1e4)))
    newcomer.upload(file)
    # The one before is in sight, too, until the file is open.
    data_tab.wait_for(lambda: data_tab.state.design != OPTIMAL, "the larger design")
    data_tab.wait_for(is_in_sight, "the larger mechanism in sight")
    newcomer.presses_for()
    newcomer.press(re.compile("^Undo"))
    data_tab.wait_for(lambda: data_tab.state.design == OPTIMAL, "the design of before")
    data_tab.wait_for(is_in_sight, "the mechanism in sight again")
    assert newcomer.presses_for() == 1


def test_design_scene_and_report_are_shared(newcomer: Newcomer, tmp_path: Path) -> None:
    newcomer.open("Design")
    newcomer.type("a3x", f"{10.0 * A3X:g}")
    newcomer.presses_for()
    scene = newcomer.export("Scene", "HTML")
    assert newcomer.presses_for() <= 3
    report = newcomer.export("Report", "HTML")
    assert newcomer.presses_for() <= 3
    for page in (scene, report):
        assert page.lstrip().lower().startswith(b"<!doctype html>")
        assert b"paper-optimal" in page
    assert format_number(workspace_volume(CHANGED).volume, 6).encode() in report
    data = newcomer.export("Design", "JSON")
    assert newcomer.presses_for() <= 3
    assert decode_design(data, "shared").variables == CHANGED.variables
    # Somebody else opens the file.
    newcomer.press(re.compile("^Undo a3x"))
    expect(newcomer.figure("Volume")).to_contain_text(volume_of(OPTIMAL))
    shared = tmp_path / "shared.json"
    shared.write_bytes(data)
    newcomer.upload(shared)
    expect(newcomer.notices("shared.json")).to_contain_text("The design paper-optimal.")
    expect(newcomer.figure("Volume")).to_contain_text(volume_of(CHANGED))


def test_term_is_found_by_the_search_and_page_by_the_question_mark(newcomer: Newcomer) -> None:
    page = newcomer.page
    newcomer.key("ControlOrMeta+k")
    page.get_by_placeholder("Search commands").fill("δ2")
    newcomer.key("Enter")
    term = page.get_by_text("Margin δ1, δ2, δ3.", exact=True)
    expect(term).to_be_in_viewport()
    assert newcomer.presses_for() == 2
    newcomer.key("Escape")
    expect(term).to_have_count(0)
    newcomer.key("ControlOrMeta+k")
    for words, found in {
        "delta2": "δ2 (glossary)",
        "d2": "δ2 (glossary)",
        "clearance": "Clearance (glossary)",
        "solidworks": "SolidWorks",
    }.items():
        page.get_by_placeholder("Search commands").fill(words)
        # What was found for the words before is shown until then.
        newcomer.wait()
        newcomer.sees(re.compile(re.escape(found)))
    newcomer.key("Escape")
    newcomer.presses_for()
    newcomer.press("Read about Singularity in the manual.")
    heading = page.get_by_role("heading", name="Verdict", exact=True)
    expect(heading).to_be_in_viewport()
    assert newcomer.presses_for() == 1
    newcomer.press("Close the manual")
    expect(heading).to_have_count(0)


def test_mistakes_are_refused_with_a_reason_and_lose_nothing(
    newcomer: Newcomer, tmp_path: Path
) -> None:
    x, volume = newcomer.field("x"), newcomer.figure("Volume")
    newcomer.type("x", "1e9")
    newcomer.sees(re.compile("too far to be drawn"))
    expect(x).to_have_value("100")
    newcomer.type("x", "ten")
    newcomer.sees(re.compile("“ten” is no length"))
    expect(x).to_have_value("100")
    expect(newcomer.button("Undo")).to_be_disabled()
    # A length that closes nothing stays to be seen, with the reason, until it is undone.
    newcomer.press("Leg lengths")
    newcomer.type("l1 leg 1", "3000")
    newcomer.sees("l1 = 3,000 mm cannot close the tetrahedron b1 b2 b3 a1")
    newcomer.press(re.compile("^Undo"))
    expect(newcomer.field("l1 leg 1")).to_have_value("117.4")
    newcomer.open("Design")
    newcomer.type("1 unit (mm)", "0")
    newcomer.sees("The unit must be positive; got 0")
    expect(newcomer.field("1 unit (mm)")).to_have_value("10")
    newcomer.open("Optimise")
    newcomer.type("Volume (cm³)", "99999")
    newcomer.sees("The box holds at most 12,240 of the 99,999 cm³ asked for.")
    expect(newcomer.button("Lift the box")).to_be_visible()
    expect(newcomer.button("Optimise")).to_be_disabled()
    broken = tmp_path / "broken.json"
    broken.write_text('{"schema": 2,\n"a3": [1, 2],\n"unitmm": 3}')
    newcomer.drop(broken)
    expect(newcomer.notices("broken.json")).to_contain_text(
        "broken.json: line 3: unitmm is unknown, did you mean unit_mm?"
    )
    expect(newcomer.notices("broken.json")).to_have_count(1)
    expect(volume).to_contain_text(volume_of(OPTIMAL))
    newcomer.presses_for()
    good = tmp_path / "good.json"
    good.write_bytes(encode_design(CHANGED))
    newcomer.drop(good)
    expect(newcomer.notices("good.json is open")).to_have_count(1)
    expect(volume).to_contain_text(volume_of(CHANGED))
    assert newcomer.presses_for() == 1


def test_bar_tabs_and_main_buttons_are_in_view_in_a_larger_window(
    newcomer: Newcomer, data_tab: Tab
) -> None:
    data_tab.resize(LARGER)
    for name in ("Volume", "Nearest singular pose"):
        expect(newcomer.figure(name)).to_be_in_viewport(ratio=1.0)
    for tab in newcomer.page.get_by_role("tab").all():
        expect(tab).to_be_in_viewport(ratio=0.95)
    newcomer.sees("Clear of singularities")
    newcomer.open("Optimise")
    newcomer.press("The paper's problem")
    newcomer.button("Undo The paper's problem").wait_for()
    expect(newcomer.button("Optimise")).to_be_in_viewport(ratio=1.0)
