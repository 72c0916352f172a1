"""The command `budget`, the totals of `accuracy`, and the typical values of both."""

from __future__ import annotations

from pathlib import Path

import msgspec
import pytest
from command_line import CommandLine
from numpy.testing import assert_allclose

import explorer
from explorer.measures.positions import positions_over
from explorer.mechanism.typical import typical_machine
from explorer.statics.budget.costs import stated_tolerances

OPTIMAL = explorer.PRESETS["paper-optimal"]
HOME = explorer.home_pose(OPTIMAL)
BOX = (8.0, 3.0, 7.0, 12.0, 7.0, 11.0)
OVER_BOX = ("--required-box", *BOX)
POSITIONS = positions_over(OPTIMAL, "box", HOME, (BOX[:3], BOX[3:]))
EACH = (0.1, 0.2, 0.15)
STATED = msgspec.structs.replace(
    OPTIMAL,
    tool=explorer.Tool((0.5, 0.25, 1.0)),
    actuators=explorer.Actuators(error_mm=(0.01, 0.02, 0.01, 0.02, 0.01, 0.03)),
    tolerances=explorer.Tolerances(a3=EACH, b1=EACH, guide_tilt_deg=(0.1, 0.0)),
)


@pytest.fixture
def stated(tmp_path: Path) -> Path:
    """Return the file of a design with errors and some tolerances."""
    path = tmp_path / "stated.json"
    path.write_bytes(explorer.encode_design(STATED))
    return path


def test_budget_without_wanted_precision_ranks_the_costs(cli: CommandLine, stated: Path) -> None:
    found = cli.answer("budget", "--design", stated, *OVER_BOX, "--at", "tool")
    costs = explorer.source_costs(STATED, POSITIONS, HOME.rotation, STATED.tool.position)
    assert found["count"] == 729
    assert found["ranking"] == [explorer.SOURCES[k] for k in costs.ranking]
    assert_allclose(found["displacement"], costs.displacement)
    assert_allclose(found["turn_within"], costs.turn_within)
    assert_allclose(found["stated"], stated_tolerances(STATED))
    assert found["worst_displacement"] == pytest.approx(costs.worst_displacement)
    assert found["tolerances"] is found["effort"] is found["out"] is None
    assert found["assumed"] == []
    text = cli.text("budget", "--design", stated, *OVER_BOX)
    assert "worst over 729 nodes of a grid over the box" in text
    rows = [line for line in text.splitlines() if line.split(" ")[0] in explorer.SOURCES]
    rows += [line for line in text.splitlines() if line.startswith("guide ")]
    assert len(rows) == 29
    assert "found" not in text


def test_budget_of_a_pose_is_that_of_the_pose(cli: CommandLine) -> None:
    found = cli.answer(
        "budget", "--position", "8", "-2.5", "11", "--yaw-pitch-roll", "-60", "9", "-7"
    )
    rotation = explorer.rotation_from_yaw_pitch_roll((-60.0, 9.0, -7.0))
    costs = explorer.source_costs(OPTIMAL, [8.0, -2.5, 11.0], rotation)
    assert (found["over"], found["count"]) == ("pose", 1)
    assert_allclose(found["displacement"], costs.displacement)
    assert cli.answer("budget")["position"] == list(HOME.position)


def test_budget_writes_the_design_that_keeps_what_is_wanted(
    cli: CommandLine, stated: Path, tmp_path: Path
) -> None:
    out = tmp_path / "better.json"
    wanted = ["--wanted", "0.05", "--wanted-turn", "0.04"]
    found = cli.answer("budget", "--design", stated, *OVER_BOX, *wanted, "--out", out)
    better = explorer.load_design(str(out))
    assert found["out"] == str(out)
    assert_allclose(stated_tolerances(better), found["tolerances"])
    costs = explorer.source_costs(better, POSITIONS, HOME.rotation)
    assert found["worst_displacement"] == costs.worst_displacement <= 0.05
    assert found["worst_turn"] == costs.worst_turn <= 0.04
    assert found["effort"] >= found["least_effort"] > 0.0
    # The command ranks what it wrote.
    again = cli.answer("budget", "--design", out, *OVER_BOX)
    assert again["ranking"] == found["ranking"]
    assert better.name == STATED.name
    text = cli.text("budget", "--design", stated, *OVER_BOX, *wanted, "--out", out)
    for words in ("of the wanted 0.05 mm", "of the wanted 0.04°", "above the least", str(out)):
        assert words in text


def test_budget_tells_any_where_a_source_moves_nothing(
    cli: CommandLine, stated: Path, tmp_path: Path
) -> None:
    out = tmp_path / "better.json"
    found = cli.answer("budget", "--design", stated, "--wanted", "0.05", "--out", out)
    tolerances = dict(zip(found["sources"], found["tolerances"], strict=True))
    assert tolerances["l1"] is tolerances["b1x"] is None
    assert explorer.load_design(str(out)).tolerances.b1 == EACH
    line = next(
        line for line in cli.text("budget", "--wanted", "1").splitlines() if line.startswith("b1x")
    )
    assert " any " in line


def test_kept_errors_of_actuators_stay_or_are_refused(cli: CommandLine, stated: Path) -> None:
    given = ["budget", "--design", stated, *OVER_BOX, "--keep-actuators"]
    found = cli.answer(*given, "--wanted", "1")
    assert_allclose(found["tolerances"][:6], STATED.actuators.error_mm)
    message = cli.refusal(*given, "--wanted", "0.05", status=1)
    assert "the errors of the actuators alone move the tool by up to" in message


def test_budget_over_the_workspace_tells_what_margins_allow(
    cli: CommandLine, tmp_path: Path
) -> None:
    text = cli.text("budget", "--over", "workspace", "--typical")
    assert "nodes of a grid in the workspace" in text
    assert "nearer to singular poses errors are larger" in text
    limits = msgspec.structs.replace(OPTIMAL.limits, margin=1.0)
    path = tmp_path / "apart.json"
    path.write_bytes(explorer.encode_design(msgspec.structs.replace(OPTIMAL, limits=limits)))
    apart = cli.text("budget", "--over", "workspace", "--typical", "--design", path)
    assert "nearer to singular" not in apart


def test_typical_values_are_told(cli: CommandLine, stated: Path) -> None:
    typical, words = typical_machine(OPTIMAL)
    for command in ("budget", "accuracy"):
        found = cli.answer(command, "--typical")
        assert found["assumed"] == list(words)
        line = cli.text(command, "--typical").splitlines()[1]
        assert line == f"assumed, since the design states none: {'; '.join(words)}"
        assert "assumed" not in cli.text(command)
        # Stated values stay.
        own = cli.answer(command, "--typical", "--design", stated)["assumed"]
        assert len(own) == 2
    costs = explorer.source_costs(typical, [HOME.position], HOME.rotation)
    found = cli.answer("budget", "--typical")
    assert found["worst_displacement"] == pytest.approx(costs.worst_displacement)
    # Given errors are not assumed.
    given = cli.answer("accuracy", "--typical", "--errors", "0.2")
    assert not any("errors" in words for words in given["assumed"])


def test_accuracy_has_totals_of_dimensions_and_of_all_sources(
    cli: CommandLine, stated: Path
) -> None:
    found = cli.answer("accuracy", "--design", stated)
    by_source = explorer.pose_error_by_source(STATED, HOME.position, HOME.rotation)
    bounds = explorer.source_errors(STATED)
    for name, sources in (("dimensions", slice(6, 29)), ("all", slice(0, 29))):
        worst = explorer.largest_error(by_source[:, sources], bounds[sources])
        rms = explorer.rms_of_sources(by_source[:, sources], bounds[sources])
        for kind in ("displacement", "turn"):
            assert found[f"worst_{kind}_of_{name}"] == pytest.approx(float(getattr(worst, kind)))
            assert found[f"rms_{kind}_of_{name}"] == pytest.approx(float(getattr(rms, kind)))
    # The first keys are those of the actuators.
    actuators = explorer.worst_error(STATED, HOME.position, HOME.rotation, bounds[:6])
    assert found["worst_displacement"] == pytest.approx(float(actuators.displacement))
    text = cli.text("accuracy", "--design", stated)
    assert "all, worst" in text
    assert "all, worst" not in cli.text("accuracy", "--errors", "0.1")


@pytest.mark.parametrize(
    ("argv", "words"),
    [
        (["--wanted", "0"], "--wanted must be a positive number; got 0"),
        (["--wanted-turn", "0.1"], "need a displacement with --wanted"),
        (["--keep-actuators"], "need a displacement with --wanted"),
        (["--out", "some.json"], "need a displacement with --wanted"),
        ([*OVER_BOX, "--over", "pose"], "--required-box needs --over box; got --over pose"),
        ([*OVER_BOX, "--position", "1", "2", "3"], "--position is one position"),
        (["--required-box", "1", "1", "1", "2", "2", "0"], "three lows, then highs above them"),
        (["--required-box", "1", "1"], "--required-box needs six numbers"),
        (["--over", "everywhere"], "--over"),
    ],
)
def test_budget_unusable_options_are_refused(
    cli: CommandLine, argv: list[object], words: str
) -> None:
    assert words in cli.refusal("budget", *argv)


def test_budget_about_singular_positions_has_no_answer(cli: CommandLine, tmp_path: Path) -> None:
    message = cli.refusal("budget", "--over", "box", status=1)
    assert "δ3 = 0: b4 on the base plane" in message
    assert "the pose is singular" in cli.refusal("budget", "--position", "3", "4", "0", status=1)
    path = tmp_path / "no_box.json"
    limits = msgspec.structs.replace(OPTIMAL.limits, box=None)
    path.write_bytes(explorer.encode_design(msgspec.structs.replace(OPTIMAL, limits=limits)))
    assert "need a box" in cli.refusal("budget", "--over", "box", "--design", path)
