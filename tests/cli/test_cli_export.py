"""`explorer export` writes the whole file, or none and says why."""

from __future__ import annotations

import json
import math
import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any

import msgspec
import pytest
import trimesh
from command_line import CommandLine

import explorer
from explorer.cli import run
from explorer.export.controller import kernel_files
from explorer.export.linuxcnc import linuxcnc_files
from explorer.export.mesh import FORMATS
from explorer.export.moving_page import moving_page
from explorer.export.simulation import simulation_mjcf
from explorer.mechanism.design_file import STIFFNESS
from explorer.mechanism.machine import Actuators, Payload
from explorer.prototype.imperfect import ImperfectMachine
from explorer.statics.accuracy import SOURCES
from explorer.workspace.carried_region import carried_region
from explorer.workspace.solids.solid import convex_hull
from explorer.workspace.solids.solids import workspace_solid
from explorer.workspace.workspace import Workspace

COMMAND = ("export",)
OPTIMAL = explorer.PRESETS["paper-optimal"]
untyped: Any = trimesh


@pytest.mark.parametrize("file_format", FORMATS)
def test_export_suffix_selects_the_format(
    cli: CommandLine, tmp_path: Path, file_format: str
) -> None:
    out = tmp_path / f"workspace.{file_format.upper()}"
    solid = workspace_solid(OPTIMAL)
    assert cli.answer("workspace", "--out", out) == {
        "file": str(out),
        "format": file_format,
        "volume": pytest.approx(solid.volume, rel=1e-12),
        "triangles": len(solid.faces),
    }
    assert out.stat().st_size > 1000
    assert [each.name for each in tmp_path.iterdir()] == [out.name]


def test_export_hull_has_format_and_orientation_of_options(
    cli: CommandLine, tmp_path: Path
) -> None:
    out = tmp_path / "hull"
    words = ["--format", "ply", "--tolerance", "0.5", "--yaw-pitch-roll", "-60", "5", "0"]
    assert cli.text("hull", "--out", out, *words) == f"{out}\n"
    rotation = explorer.rotation_from_yaw_pitch_roll([-60.0, 5.0, 0.0])
    expected = convex_hull(workspace_solid(OPTIMAL, rotation, 0.5)).volume
    found = untyped.load(out, file_type="ply", process=False)
    assert found.is_watertight
    assert found.volume == pytest.approx(expected * OPTIMAL.unit_mm**3, rel=1e-9)


LIMITED = msgspec.structs.replace(
    OPTIMAL, actuators=Actuators(push_n=(60, 50, 40, 50, 45, 70)), payload=Payload(0.5)
)


def test_export_with_a_load_writes_the_part_that_holds_it(cli: CommandLine, tmp_path: Path) -> None:
    load = (0.0, 0.0, -20.0, 0.0, 5.0, 0.0)
    solid = carried_region(Workspace(LIMITED), load=load).solid
    assert solid.is_watertight
    for what, expected in (("workspace", solid), ("hull", convex_hull(solid))):
        out = tmp_path / f"{what}.stl"
        assert cli.answer(what, "--design", LIMITED, "--out", out, "--load", *load) == {
            "file": str(out),
            "format": "stl",
            "volume": pytest.approx(expected.volume, rel=1e-12),
            "triangles": len(expected.faces),
        }
        assert out.stat().st_size > 1000


@pytest.mark.parametrize(
    ("words", "status", "reason"),
    [
        (("workspace", "--out", "a.step", "--load", 0, 0, -20), 2, "takes its limit consists of"),
        (("workspace", "--out", "a.stl", "--load", 0, 0, -1e6), 1, "no position holds the load"),
        (("workspace", "--out", "a.stl", "--load", 0, 0), 2, "needs a force fx fy fz"),
        (("scene", "--out", "a.html", "--load", 0, 0, -1), 2, "--load is not for scene"),
        (("workspace",), 2, "missing --out"),
    ],
)
def test_export_with_a_load_that_cannot_be_written_says_why(
    cli: CommandLine, tmp_path: Path, words: tuple[Any, ...], status: int, reason: str
) -> None:
    argv = [tmp_path / word if str(word).startswith("a.") else word for word in words]
    assert reason in cli.refusal(*argv, "--design", LIMITED, status=status)
    assert list(tmp_path.iterdir()) == []


def test_export_refusal_keeps_an_existing_file(cli: CommandLine, tmp_path: Path) -> None:
    out = tmp_path / "file.stl"
    out.write_bytes(b"old")
    assert cli.refusal("hull", "--out", out, "--tolerance", "1e-9")
    assert out.read_bytes() == b"old"


def test_export_simulation_is_an_mjcf_model(cli: CommandLine, tmp_path: Path) -> None:
    from explorer.export.simulation import SimulationModel, simulation_mjcf
    from explorer.prototype.assembly import make_prototype

    out = tmp_path / "model.xml"
    answer = cli.answer("simulation", "--out", out)
    assert (answer["file"], answer["format"]) == (str(out), "mjcf")
    assert (len(answer["bodies"]), len(answer["joints"])) == (13, 13)
    assert out.read_text(encoding="utf-8") == simulation_mjcf(OPTIMAL)
    servos = SimulationModel(OPTIMAL).servos
    assert answer["servo_stiffness_n_mm"] == pytest.approx((1e-3 * servos.stiffness).tolist())
    assert answer["servo_forces_n"] == pytest.approx(servos.weights.tolist())
    assert answer["servo_rotors_kg"] == pytest.approx(servos.rotors.tolist())
    assert not any(answer["droop"]["displacement_mm"] + answer["droop"]["turn_degrees"])
    assert answer["left_out"] == [
        "friction",
        "contacts",
        "the mass of the base",
        "the box of positions",
    ]
    words = ["--format", "mjcf", "--density", "2700"]
    path, _, *lines = cli.text("simulation", "--out", out, *words).splitlines()
    assert path == str(out)
    assert [line.split()[0] for line in lines[:6]] == list(explorer.JOINTS)
    assert lines[6] == "at home the weights move the tool by 0 mm and 0°"
    assert lines[7] == f"left out: {', '.join(answer['left_out'])}"
    assert out.read_text(encoding="utf-8") == simulation_mjcf(OPTIMAL, 2700.0)
    cli.text("simulation", "--out", out, "--masses", "parts")
    masses = make_prototype(OPTIMAL).masses(1240.0)
    assert out.read_text(encoding="utf-8") == simulation_mjcf(OPTIMAL, masses=masses)


def test_export_simulation_with_errors_tells_what_deviates_and_where_the_tool_is(
    cli: CommandLine, tmp_path: Path
) -> None:
    tolerances = explorer.Tolerances(a3=(0.1, 0.2, 0.0), guide_tilt_deg=(0.0, 0.3))
    s = STIFFNESS
    stiff = Actuators(error_mm=(0.05, 0, 0, 0, 0, 0), stiffness_n_mm=(s, s, s, s, s, s))
    design = msgspec.structs.replace(
        OPTIMAL,
        tool=explorer.Tool((0.5, 1.0, -2.0)),
        actuators=stiff,
        tolerances=tolerances,
    )
    out = tmp_path / "model.xml"
    words = ("simulation", "--design", design, "--out", out, "--errors", 7)
    answer = cli.answer(*words)
    machine = ImperfectMachine.draw(design, 7)
    assert out.read_text(encoding="utf-8") == simulation_mjcf(machine)
    assert (answer["seed"], len(answer["bodies"])) == (7, 13)
    rows = {row["name"]: row for row in answer["deviations"]}
    assert list(rows) == list(SOURCES)
    assert {name for name, row in rows.items() if row["deviation"]} == {
        *("l1", "a3x", "a3y", "guide tilt z")
    }
    error, found = machine.tool_error(), answer["tool_error"]
    assert found["displacement_mm"] == pytest.approx(error[:3] * 10.0)
    assert found["turn_degrees"] == pytest.approx([math.degrees(v) for v in error[3:]])
    assert answer["servo_stiffness_n_mm"] == pytest.approx([1000.0] * 6)
    moved = math.hypot(*answer["droop"]["displacement_mm"])
    assert moved > 0.0
    text = cli.text(*words)
    for line in ("seed 7", "tool at home off by", f"weights move the tool by {moved:.3g} mm and "):
        assert line in text
    assert f"the tool by {moved:.3g} mm" in out.read_text(encoding="utf-8")


@pytest.mark.parametrize(
    ("what", "file_format", "make"),
    [("kernel", "c", kernel_files), ("linuxcnc", "ini", linuxcnc_files)],
)
def test_export_of_software_writes_a_folder(
    cli: CommandLine, tmp_path: Path, what: str, file_format: str, make: Callable[..., Any]
) -> None:
    folder, files = tmp_path / "new" / what, make(OPTIMAL)
    for _ in range(2):
        answer = cli.answer(what, "--out", folder)
        assert answer == {"file": str(folder), "format": file_format, "files": list(files)}
        assert {each.name: each.read_bytes() for each in folder.iterdir()} == files
    reason = f"there is {file_format}"
    assert reason in cli.refusal(what, "--out", folder, "--format", "zip")


def test_export_page_writes_a_file(cli: CommandLine, tmp_path: Path) -> None:
    page = tmp_path / "page.html"
    assert cli.answer("page", "--out", page)["bytes"] == len(page.read_bytes())
    assert page.read_bytes() == moving_page(OPTIMAL)
    assert "folder" in cli.refusal("kernel", "--out", page)


@pytest.mark.parametrize(("name", "expected"), [("a.3mf", "3mf"), ("a.zip", "stl-zip")])
def test_export_mechanism_writes_its_parts(
    cli: CommandLine, tmp_path: Path, name: str, expected: str
) -> None:
    out = tmp_path / name
    answer = cli.answer("mechanism", "--out", out)
    assert (answer["file"], answer["format"]) == (str(out), expected)
    assert len(answer["parts"]) == 18
    assert min(part["volume_mm3"] for part in answer["parts"]) > 1.0
    assert answer["mass_kg"] == pytest.approx(sum(part["mass_kg"] for part in answer["parts"]))
    for actuator in answer["actuators"]:
        low, high = actuator["stroke_mm"]
        assert 0.0 < low < high
    assert 10_000 < out.stat().st_size < 2_000_000
    lines = cli.text("mechanism", "--out", out).splitlines()
    assert lines[0] == str(out)
    assert len(lines) == 5
    assert all("the limits require 0.0 to 204.2 mm" in line for line in lines[1:])


def test_export_mechanism_too_tight_writes_no_file(cli: CommandLine, tmp_path: Path) -> None:
    design = OPTIMAL.with_limits(leg_radii=(0.5, 0.5, 0.5, 0.5))
    out = tmp_path / "parts.glb"
    refused = cli.refusal("mechanism", "--out", out, "--design", design)
    assert "carriages 2 and 3 at home are 6.69 mm apart and need 10.2 mm" in refused
    assert "radius at most" in refused
    assert not out.exists()


def test_export_workspace_as_step(capfd: pytest.CaptureFixture[str], tmp_path: Path) -> None:
    out = tmp_path / "workspace.stp"
    words = ["--yaw-pitch-roll", "-60", "5", "0", "--json"]
    assert run([*COMMAND, "workspace", "--out", str(out), *words]) == 0
    # OpenCASCADE writes to the same standard output, beneath Python's.
    captured = capfd.readouterr()
    answer = json.loads(captured.out)
    assert captured.err == ""
    rotation = explorer.rotation_from_yaw_pitch_roll([-60.0, 5.0, 0.0])
    exact = explorer.workspace_volume(OPTIMAL, rotation).volume
    assert answer["format"] == "step"
    assert answer["volume"] == pytest.approx(exact, rel=1e-6)
    assert answer["faces"] >= 6
    assert out.read_bytes().startswith(b"ISO-10303-21;")


def test_export_step_without_extra_is_one_line(
    cli: CommandLine, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setitem(sys.modules, "OCP.gp", None)
    for what in ("workspace", "mechanism"):
        refused = cli.refusal(what, "--out", str(tmp_path / "file.step"))
        assert 'pip install ".[cad]"' in refused
    assert list(tmp_path.iterdir()) == []


def test_export_scene_is_one_page_with_its_title(cli: CommandLine, tmp_path: Path) -> None:
    out = tmp_path / "scene.html"
    words = ["--position", "9", "5", "8", "--yaw-pitch-roll", "-60", "10", "0"]
    answer = cli.answer("scene", "--out", out, *words)
    page = out.read_bytes()
    assert answer == {"file": str(out), "format": "html", "bytes": len(page)}
    text = page.decode()
    assert text.startswith("<!doctype html>")
    assert "b4 at (9.000, 5.000, 8.000) · yaw −60.00° · pitch 10.00° · roll 0.00°" in text
    assert "1 unit = 10 mm" in text
    # The page may load nothing from elsewhere.
    assert "default-src 'none'" in text
    assert [each.name for each in tmp_path.iterdir()] == [out.name]


def test_export_figure_is_an_svg_of_the_view_and_width(cli: CommandLine, tmp_path: Path) -> None:
    out = tmp_path / "figure.svg"
    words = ["--view", "side", "--width", "170", "--black", "--no-tetrahedra"]
    answer = cli.answer("figure", "--out", out, *words)
    text = out.read_text(encoding="utf-8")
    assert answer == {"file": str(out), "format": "svg", "bytes": len(text.encode())}
    assert 'width="170mm"' in text
    assert 'class="figure black"' in text
    assert 'class="tetrahedron' not in text
    # From the right y goes to the right, so the guide, along x, is a point.
    assert text.count(">y</text>") == text.count(">z</text>") == 1
    assert ">x</text>" not in text


FOLDS = ["--folds", "14", "45", "98", "-140", "-120", "60"]


@pytest.mark.parametrize(
    ("what", "name", "options", "words"),
    [
        ("workspace", "file.dwg", [], "no mesh format 'dwg'; there are 3mf, stl, glb, obj, ply"),
        ("workspace", "file.step", ["--tolerance", "1"], "--tolerance is not for workspace"),
        ("workspace", "file", [], "give --format"),
        ("workspace", "missing/file.stl", [], "no folder"),
        ("workspace", ".", ["--format", "stl"], "it is a folder"),
        ("workspace", "/dev/null", ["--format", "stl"], "no plain file"),
        ("workspace", "file.stl", ["--tolerance", "1e-6"], "at most 2,000,000 are made"),
        ("workspace", "file.stl", ["--design", "no-such"], "no preset and no file"),
        ("simulation", "model.urdf", [], "no simulation format 'urdf'; there is mjcf"),
        ("simulation", "model.xml", ["--errors", "x"], "--errors must be a whole number; got 'x'"),
        ("simulation", "model.xml", ["--typical"], "give --errors SEED"),
        ("simulation", "model.xml", FOLDS, "--folds is not"),
        ("hull", "hull.stl", FOLDS, "--folds is not"),
        ("hull", "hull.stl", ["--typical"], "--typical is not for hull"),
        ("mechanism", "parts.stl", [], "there are 3mf, glb, stl-zip, step"),
        ("mechanism", "parts.3mf", ["--yaw-pitch-roll", "1", "2", "3"], "--yaw-pitch-roll is not"),
        ("hull", "hull.step", [], "no mesh format 'step'"),
        ("scene", "out.html", ["--format", "png"], "no format 'png' of the scene; there is html"),
        ("scene", "out.html", ["--density", "3"], "--density is not for scene"),
        ("scene", "out.html", ["--black"], "--black is not for scene"),
        ("figure", "out.png", [], "no format 'png' of the figure; there is svg"),
        ("figure", "out.svg", ["--width", "9"], "a figure is 40 to 400 mm wide, 85 for a column"),
        ("figure", "out.svg", ["--view", "back"], "'isometric', 'front', 'side', 'top'"),
    ],
)
def test_export_unusable_options_are_refused_without_a_file(
    cli: CommandLine, tmp_path: Path, what: str, name: str, options: list[str], words: str
) -> None:
    assert words in cli.refusal(what, "--out", tmp_path / name, *options)
    assert list(tmp_path.iterdir()) == []
