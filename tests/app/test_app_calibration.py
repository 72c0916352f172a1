"""*Calibration* on the page: a table that is dropped, the machine that it tells, and its file."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest
import viser
from desk import Desk, controls_of, markup_of
from measured_machines import PLACES, POSES, TARGETS, TYPICAL, Session, design_itself
from scipy.spatial.transform import Rotation
from services import StubJobs, services_for

from explorer import JOINTS, Measurement
from explorer.app.features.calibration.feature import (
    CALIBRATION,
    CALIBRATION_FEED,
    Calibrated,
    CalibrationPanel,
    calibrate_table,
    open_table,
)
from explorer.app.features.designs.feature import SavedDesigns
from explorer.app.features.feature import Services
from explorer.app.features.paths.feature import PATHS
from explorer.app.features.paths.state import Paths
from explorer.app.session.session import UNDO
from explorer.app.state.actions import open_design
from explorer.app.state.frame import Frame
from explorer.app.storage.library import Library
from explorer.app.storage.session_file import SessionFile
from explorer.app.storage.user_data import UserData
from explorer.app.widgets.buttons import Buttons
from explorer.calibration.machine_file import decode_machine
from explorer.calibration.poses import sample_poses
from explorer.mechanism.built_machine import BuiltMachine
from explorer.mechanism.design_file import PRESETS
from explorer.mechanism.pose import quaternion_from_rotation

OPTIMAL = PRESETS["paper-optimal"]
HEADS = [f"{name}_mm" for name in JOINTS]
TABLE_OF_TARGETS = "x,y,z\n" + "\n".join(",".join(map(repr, row)) for row in PLACES.tolist())


def table_of(kind: Measurement, machine: BuiltMachine | None = None) -> str:
    """Return what is measured of a machine in 30 poses, as a table."""
    session = Session.of(kind, sample_poses(TYPICAL, 30, seed=3), 3, machine)
    values, heads = session.measured.values, [f"t{k}_{a}_mm" for k in (1, 2, 3) for a in "xyz"]
    numbers = 10.0 * values
    if kind.kind == "poses":
        heads = ["x_mm", "y_mm", "z_mm", "qw", "qx", "qy", "qz"]
        turns = quaternion_from_rotation(Rotation.from_rotvec(values[:, 3:]).as_matrix())
        numbers = np.hstack([numbers[:, :3], turns])
    rows = np.hstack([10.0 * session.readings, numbers]).tolist()
    return "\n".join([",".join(HEADS + heads), *(",".join(map(repr, row)) for row in rows), ""])


@pytest.fixture
def page(
    server: viser.ViserServer, desk: Desk, buttons: Buttons, jobs: StubJobs, tmp_path: Path
) -> Services:
    """Return the services of a page on which files are dropped."""
    return services_for(
        server,
        desk.session,
        buttons=buttons,
        jobs=jobs,
        complain=desk.complain,
        user_data=UserData(Library(tmp_path / "designs"), SessionFile()),
        declared=(CALIBRATION, PATHS),
    )


def drop(services: Services, content: str, name: str) -> None:
    saved = services.get(SavedDesigns)
    saved.take(content.encode(), name)
    assert saved.wait_until_idle()


def test_table_that_is_dropped_is_measured_or_has_the_targets(page: Services, desk: Desk) -> None:
    table = table_of(POSES)
    drop(page, table, "m.csv")
    assert Calibrated.of(desk.state).measured == table
    drop(page, TABLE_OF_TARGETS, "t.CSV")
    assert Calibrated.of(desk.state).targets == TABLE_OF_TARGETS
    assert Calibrated.of(desk.state).measured == table
    # Who meant the poses of a path is told where these are opened.
    _, words = open_table("targets", page, TABLE_OF_TARGETS.encode(), "t.csv")
    assert "Target positions of the calibration" in words
    assert "tab Paths, by Poses from a file" in words
    desk.session.do(open_design(PRESETS["paper-initial"]))
    desk.session.wait_until_idle()
    assert Calibrated.of(desk.state) == Calibrated()
    assert desk.complaints == []
    drop(page, "nothing", "m.csv")
    drop(page, "time,x,y,z\n0,1,2,3\n", "path.csv")
    drop(page, table, "m.txt")
    first, second, third = desk.complaints
    assert "line of headings" in first
    assert "path.csv has a column time" in second
    assert "m.txt is no design, study or session" in third
    assert Calibrated.of(desk.state) == Calibrated()
    drop(page, "x,y,z,pause_s\n11,5,9,1\n12,5,9,0\n", "poses.csv")
    stops = Paths.of(desk.state).stops
    assert [stop.pause for stop in stops] == [1.0, 0.0]
    assert Calibrated.of(desk.state) == Calibrated()
    page.stop()


def test_panel_tells_the_machine_and_sends_its_file(
    page: Services, desk: Desk, jobs: StubJobs
) -> None:
    panel, feed = CalibrationPanel(page), page.get(CALIBRATION_FEED)
    controls = controls_of(page, panel, desk.state)
    assert not controls["Download machine"].visible
    assert not controls["Forget the table"].visible
    drop(page, table_of(POSES), "m.csv")
    feed.follow(Frame(desk.state))
    jobs.work()
    content = markup_of(panel, desk.state)
    for words in ("30 of 31 seen", "cannot be told from the guide", "Residuals by pose", "Assumed"):
        assert words in content
    controls = controls_of(page, panel, desk.state)
    assert controls["Download machine"].visible
    desk.click(controls["Download machine"])
    downloads: Any = page.downloads
    assert downloads.sent == [(1, "machine.json")]
    machine = decode_machine(downloads.data, "it", OPTIMAL)
    assert np.abs(machine.deviations).max() > 1e-3
    desk.click(controls["Forget the table"])
    assert Calibrated.of(desk.state) == Calibrated()
    feed.follow(Frame(desk.state))
    assert "Drop a table" in markup_of(panel, desk.state)
    assert not controls_of(page, panel, desk.state)["Download machine"].visible
    desk.session.do(UNDO)
    assert Calibrated.of(desk.state).measured
    page.stop()


def test_table_that_gives_no_machine_says_why(page: Services, desk: Desk, jobs: StubJobs) -> None:
    panel, feed = CalibrationPanel(page), page.get(CALIBRATION_FEED)
    for table, words in (
        (table_of(POSES, design_itself()), "nothing gained"),
        (table_of(TARGETS), "targets need a table of where they are"),
        ("l1,d1,d2,d3,d4,l4,bar\n1,1,1,1,1,1,1\n", "explorer calibrate takes the setup"),
    ):
        drop(page, table, "m.csv")
        feed.follow(Frame(desk.state))
        jobs.work()
        assert words in markup_of(panel, desk.state)
        assert not controls_of(page, panel, desk.state)["Download machine"].visible
    page.stop()


def test_request_is_that_of_the_tables_in_the_state() -> None:
    found = calibrate_table((OPTIMAL, Calibrated(table_of(POSES))))
    assert found.gains
    assert found.faults == []
    with_targets = Calibrated(table_of(TARGETS), TABLE_OF_TARGETS)
    assert calibrate_table((OPTIMAL, with_targets)).seen == 24
