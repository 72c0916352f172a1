"""`explorer export` writes the whole file, or none and says why."""

from __future__ import annotations

import json
import sys
from pathlib import Path
from typing import Any

import msgspec
import pytest
import trimesh

import explorer
from explorer.cli import run
from explorer.export.mesh import FORMATS
from explorer.workspace.solids.solids import convex_hull, workspace_solid

OPTIMAL = explorer.PRESETS["paper-optimal"]
untyped: Any = trimesh


@pytest.mark.parametrize("file_format", FORMATS)
def test_export_suffix_selects_the_format(
    capsys: pytest.CaptureFixture[str], tmp_path: Path, file_format: str
) -> None:
    out = tmp_path / f"workspace.{file_format.upper()}"
    assert run(["export", "workspace", "--out", str(out), "--json"]) == 0
    captured = capsys.readouterr()
    assert captured.err == ""
    solid = workspace_solid(OPTIMAL)
    assert json.loads(captured.out) == {
        "file": str(out),
        "format": file_format,
        "volume": pytest.approx(solid.volume, rel=1e-12),
        "triangles": len(solid.faces),
    }
    assert out.stat().st_size > 1000
    assert [each.name for each in tmp_path.iterdir()] == [out.name]


def test_export_hull_has_format_and_orientation_of_options(
    capsys: pytest.CaptureFixture[str], tmp_path: Path
) -> None:
    out = tmp_path / "hull"
    words = ["--format", "ply", "--tolerance", "0.5", "--yaw-pitch-roll", "-60", "5", "0"]
    assert run(["export", "hull", "--out", str(out), *words]) == 0
    assert capsys.readouterr().out == f"{out}\n"
    rotation = explorer.rotation_from_yaw_pitch_roll([-60.0, 5.0, 0.0])
    expected = convex_hull(workspace_solid(OPTIMAL, rotation, 0.5)).volume
    found = untyped.load(out, file_type="ply", process=False)
    assert found.is_watertight
    assert found.volume == pytest.approx(expected * OPTIMAL.unit_mm**3, rel=1e-9)


def test_export_empty_workspace_writes_no_file(
    capsys: pytest.CaptureFixture[str], tmp_path: Path
) -> None:
    out = tmp_path / "empty.stl"
    argv = ["export", "workspace", "--out", str(out), "--yaw-pitch-roll", "0", "0", "0"]
    assert run(argv) == 1
    captured = capsys.readouterr()
    assert captured.out == ""
    assert "empty: margin δ2" in captured.err
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize(
    ("name", "options", "words"),
    [
        ("file.dwg", [], "no mesh format 'dwg'; there are 3mf, stl, glb, obj, ply"),
        ("file.step", ["--tolerance", "1"], "--tolerance is not for workspace"),
        ("missing/file.step", [], "no folder"),
        ("file.stl", ["--format", "iges"], "no mesh format 'iges'"),
        ("file", [], "give --format"),
        ("missing/file.stl", [], "no folder"),
        (".", ["--format", "stl"], "it is a folder"),
        ("file.stl", ["--tolerance", "0"], "--tolerance must be a positive number"),
        ("file.stl", ["--tolerance", "1e-9"], "at most 2,000,000 are made"),
        ("file.stl", ["--design", "no-such"], "no preset and no file"),
    ],
)
def test_export_unusable_options_are_one_line(
    capsys: pytest.CaptureFixture[str], tmp_path: Path, name: str, options: list[str], words: str
) -> None:
    assert run(["export", "workspace", "--out", str(tmp_path / name), *options]) == 2
    captured = capsys.readouterr()
    assert captured.out == ""
    assert captured.err.count("\n") == 1
    assert words in captured.err
    assert list(tmp_path.iterdir()) == []


def test_export_refusal_keeps_an_existing_file(
    capsys: pytest.CaptureFixture[str], tmp_path: Path
) -> None:
    out = tmp_path / "file.stl"
    out.write_bytes(b"old")
    assert run(["export", "hull", "--out", str(out), "--tolerance", "1e-9"]) == 2
    assert out.read_bytes() == b"old"
    assert capsys.readouterr().out == ""


def test_export_missing_object_or_file_is_named(capsys: pytest.CaptureFixture[str]) -> None:
    assert run(["export", "workspace"]) == 2
    assert "missing --out" in capsys.readouterr().err
    assert run(["export", "manual", "--out", "x.stl"]) == 2
    assert "mechanism" in capsys.readouterr().err


def test_export_simulation_is_an_mjcf_model(
    capsys: pytest.CaptureFixture[str], tmp_path: Path
) -> None:
    from explorer.export.simulation import simulation_mjcf
    from explorer.prototype.assembly import make_prototype

    out = tmp_path / "model.xml"
    assert run(["export", "simulation", "--out", str(out), "--json"]) == 0
    answer = json.loads(capsys.readouterr().out)
    assert (answer["file"], answer["format"]) == (str(out), "mjcf")
    assert (len(answer["bodies"]), len(answer["joints"])) == (13, 13)
    assert out.read_text(encoding="utf-8") == simulation_mjcf(OPTIMAL)
    words = ["--format", "mjcf", "--density", "2700"]
    assert run(["export", "simulation", "--out", str(out), *words]) == 0
    assert out.read_text(encoding="utf-8") == simulation_mjcf(OPTIMAL, 2700.0)
    assert capsys.readouterr().out == f"{out}\n"
    assert run(["export", "simulation", "--out", str(out), "--masses", "parts"]) == 0
    masses = make_prototype(OPTIMAL).masses(1240.0)
    assert out.read_text(encoding="utf-8") == simulation_mjcf(OPTIMAL, masses=masses)


@pytest.mark.parametrize(
    ("what", "name", "options", "words"),
    [
        ("simulation", "model.urdf", [], "no simulation format 'urdf'; there is mjcf"),
        ("simulation", "model.xml", ["--tolerance", "1"], "--tolerance is not for simulation"),
        ("simulation", "model.xml", ["--quaternion", "1", "0", "0", "0"], "--quaternion is not"),
        ("simulation", "model.xml", ["--density", "-1"], "--density must be a positive number"),
        ("simulation", "missing/model.xml", [], "no folder"),
        ("mechanism", "parts.stl", [], "there are 3mf, glb, stl-zip, step"),
        ("mechanism", "parts.3mf", ["--tolerance", "1"], "--tolerance is not for mechanism"),
        ("mechanism", "parts.3mf", ["--yaw-pitch-roll", "1", "2", "3"], "--yaw-pitch-roll is not"),
        ("mechanism", "parts.3mf", ["--masses", "parts"], "--masses is not for mechanism"),
        ("mechanism", "missing/parts.3mf", [], "no folder"),
        ("hull", "hull.stl", ["--density", "1000"], "--density is not for hull"),
        ("hull", "hull.step", [], "no mesh format 'step'"),
        ("hull", "hull.mjcf", [], "no mesh format 'mjcf'"),
    ],
)
def test_export_foreign_options_and_formats_are_refused(
    capsys: pytest.CaptureFixture[str],
    tmp_path: Path,
    what: str,
    name: str,
    options: list[str],
    words: str,
) -> None:
    assert run(["export", what, "--out", str(tmp_path / name), *options]) == 2
    captured = capsys.readouterr()
    assert captured.out == ""
    assert captured.err.count("\n") == 1
    assert words in captured.err
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize(
    ("name", "expected"), [("a.3mf", "3mf"), ("a.zip", "stl-zip"), ("a.step", "step")]
)
def test_export_mechanism_writes_its_parts(
    capsys: pytest.CaptureFixture[str], tmp_path: Path, name: str, expected: str
) -> None:
    out = tmp_path / name
    assert run(["export", "mechanism", "--out", str(out), "--json"]) == 0
    answer = json.loads(capsys.readouterr().out)
    assert (answer["file"], answer["format"]) == (str(out), expected)
    assert len(answer["parts"]) == 18
    assert min(part["volume_mm3"] for part in answer["parts"]) > 1.0
    assert answer["mass_kg"] == pytest.approx(sum(part["mass_kg"] for part in answer["parts"]))
    for actuator in answer["actuators"]:
        low, high = actuator["stroke_mm"]
        assert 0.0 < low < high
    assert 10_000 < out.stat().st_size < 2_000_000
    assert run(["export", "mechanism", "--out", str(out)]) == 0
    lines = capsys.readouterr().out.splitlines()
    assert lines[0] == str(out)
    assert len(lines) == 5
    assert all("the limits require 0.0 to 204.2 mm" in line for line in lines[1:])


def test_export_mechanism_too_tight_writes_no_file(
    capsys: pytest.CaptureFixture[str], tmp_path: Path
) -> None:
    design = tmp_path / "thick.json"
    limits = explorer.Limits(leg_radii=(0.5, 0.5, 0.5, 0.5))
    design.write_bytes(explorer.encode_design(msgspec.structs.replace(OPTIMAL, limits=limits)))
    out = tmp_path / "parts.glb"
    assert run(["export", "mechanism", "--out", str(out), "--design", str(design)]) == 2
    captured = capsys.readouterr()
    assert "carriages 2 and 3 at home are 6.69 mm apart and need 10.2 mm" in captured.err
    assert "radius at most" in captured.err
    assert captured.err.count("\n") == 1
    assert not out.exists()


def test_export_workspace_as_step(capfd: pytest.CaptureFixture[str], tmp_path: Path) -> None:
    out = tmp_path / "workspace.stp"
    words = ["--yaw-pitch-roll", "-60", "5", "0", "--json"]
    assert run(["export", "workspace", "--out", str(out), *words]) == 0
    # OpenCASCADE has a tongue of its own, on the same standard output.
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
    capsys: pytest.CaptureFixture[str], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setitem(sys.modules, "OCP.gp", None)
    for what in ("workspace", "mechanism"):
        assert run(["export", what, "--out", str(tmp_path / "file.step")]) == 2
        captured = capsys.readouterr()
        assert 'pip install "flagged-explorer[cad]"' in captured.err
        assert captured.err.count("\n") == 1
    assert list(tmp_path.iterdir()) == []


def test_export_scene_is_one_page_with_its_title(
    capsys: pytest.CaptureFixture[str], tmp_path: Path
) -> None:
    out = tmp_path / "scene.html"
    words = ["--position", "9", "5", "8", "--yaw-pitch-roll", "-60", "10", "0", "--json"]
    assert run(["export", "scene", "--out", str(out), *words]) == 0
    captured = capsys.readouterr()
    assert captured.err == ""
    page = out.read_bytes()
    assert json.loads(captured.out) == {
        "file": str(out),
        "format": "html",
        "bytes": len(page),
    }
    text = page.decode()
    assert text.startswith("<!doctype html>")
    assert "b4 at (9.000, 5.000, 8.000) · yaw −60.00° · pitch 10.00° · roll 0.00°" in text
    assert "1 unit = 10 mm" in text
    # Only what is asked for from within the page itself.
    assert "default-src 'none'" in text
    assert [each.name for each in tmp_path.iterdir()] == [out.name]


@pytest.mark.parametrize(
    ("argv", "reason"),
    [
        (["scene", "--format", "png"], "no format 'png' of the scene; there is html"),
        (["scene", "--density", "3"], "--density is not for scene"),
        (["hull", "--format", "stl", "--position", "1", "2", "3"], "--position is not for hull"),
        (["simulation", "--format", "mjcf", "--position", "1", "2", "3"], "--position is not for"),
    ],
)
def test_export_scene_foreign_options_are_refused(
    capsys: pytest.CaptureFixture[str], tmp_path: Path, argv: list[str], reason: str
) -> None:
    out = tmp_path / "out.html"
    assert run(["export", *argv, "--out", str(out)]) == 2
    assert reason in capsys.readouterr().err
    assert not out.exists()
