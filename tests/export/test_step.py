"""The workspace as STEP: exact faces and volume, and a file that OpenCASCADE reads back."""

from __future__ import annotations

import re
from pathlib import Path
from typing import Any

import msgspec
import numpy as np
import pytest
from limited_designs import limited, reference_case
from part_gaps import placed

from explorer import (
    PRESETS,
    Design,
    ExplorerError,
    NoAnswerError,
    Pose,
    make_prototype,
    workspace_volume,
)
from explorer.export.assembly import assembly_bytes
from explorer.export.mesh import colour_of
from explorer.export.opencascade import ExactShapeMaker, coordinates, faces_of, occ, volume_of
from explorer.export.step import exact_workspace, step_bytes
from explorer.mechanism.design import Swing
from explorer.prototype.shapes import forms_of
from explorer.workspace.workspace import Workspace

OPTIMAL, INITIAL = PRESETS["paper-optimal"], PRESETS["paper-initial"]
SOLID = exact_workspace(Workspace(OPTIMAL))


def cubic_mm(design: Design, volume: float) -> float:
    return volume * design.unit_mm**3


@pytest.mark.parametrize("design", [OPTIMAL, INITIAL])
def test_step_workspace_volume_is_exact(design: Design) -> None:
    for unit in (1.0, 250.0):
        scaled = msgspec.structs.replace(design, unit_mm=unit)
        expected = cubic_mm(scaled, workspace_volume(design).volume)
        assert exact_workspace(Workspace(scaled)).volume == pytest.approx(expected, rel=1e-6)


@pytest.mark.parametrize("index", [0, 5, 9, 17, 19, 21])
def test_step_shells_slabs_and_tilted_planes_have_exact_volume(index: int) -> None:
    design, rotation, _ = reference_case(index)
    solid = exact_workspace(Workspace(design, rotation))
    expected = cubic_mm(design, workspace_volume(design, rotation).volume)
    assert solid.volume == pytest.approx(expected, rel=1e-5)


@pytest.mark.parametrize(
    "swing", [Swing(a3=90.0), Swing(b1=50.0, b4=70.0), Swing(b2=20.0), Swing(a1=100.0, b3=30.0)]
)
def test_step_cones_and_wedges_have_exact_volume(swing: Swing) -> None:
    design = limited(OPTIMAL, swing=swing)
    solid, expected = exact_workspace(Workspace(design)), workspace_volume(design)
    off = abs(solid.volume - cubic_mm(design, expected.volume))
    assert off <= cubic_mm(design, 1e-6 * expected.volume + expected.error)


def face_kinds(shape: Any) -> list[str]:
    kinds = (str(occ("BRepAdaptor_Surface")(face).GetType()) for face in faces_of(shape))
    return [kind.rpartition("_")[2] for kind in kinds]


def test_step_faces_are_surfaces_of_their_limits() -> None:
    solid = exact_workspace(Workspace(OPTIMAL))
    kinds = dict(zip(solid.limit_of_face, face_kinds(solid.shape), strict=True))
    assert kinds["l1 maximum"] == kinds["l4 maximum"] == "Sphere"
    assert kinds["d2 maximum"] == "Cylinder"
    assert {kind for limit, kind in kinds.items() if limit.startswith("box")} == {"Plane"}
    assert len(kinds) >= 9
    cone = exact_workspace(Workspace(limited(OPTIMAL, swing=Swing(a1=30.0))))
    kinds = dict(zip(cone.limit_of_face, face_kinds(cone.shape), strict=True))
    assert kinds["swing a1"] == "Cone"


def read(path: Path) -> Any:
    reader = occ("STEPControl_Reader")()
    assert int(reader.ReadFile(str(path))) == 1
    reader.TransferRoots()
    return reader.OneShape()


def test_step_file_reads_back_names_colours_and_volume(tmp_path: Path) -> None:
    design = msgspec.structs.replace(OPTIMAL, unit_mm=12.5, name="Räume")
    solid = exact_workspace(Workspace(design))
    data = step_bytes(solid, f"workspace of {design.name}")
    assert b"AP242" in data[:600]
    assert b"SI_UNIT(.MILLI.,.METRE.)" in data
    assert len(data) < 200_000
    path = tmp_path / "a.step"
    path.write_bytes(data)
    shape = read(path)
    assert occ("BRepCheck_Analyzer")(shape).IsValid()
    expected = cubic_mm(design, workspace_volume(design).volume)
    assert volume_of(shape) == pytest.approx(expected, rel=1e-6)
    for limit in set(solid.limit_of_face):
        assert f"ADVANCED_FACE('{limit}'".encode() in data
    reds = {colour_of(limit)[0] for limit in solid.limit_of_face}
    written = {
        round(255 * float(line.partition("COLOUR_RGB('',")[2].split(",")[0]))
        for line in data.decode("latin-1").splitlines()
        if "COLOUR_RGB('',0." in line
    }
    assert reds <= written | {0, 255}


def strings(data: bytes) -> list[str]:
    """Return the strings of a STEP file, decoded as ISO 10303-21 says, each of one line."""
    text = data.decode("ascii")

    def letters(match: re.Match[str]) -> str:
        digits = 4 if match[1] == "X2" else 8
        return "".join(chr(int(each, 16)) for each in re.findall(f".{{{digits}}}", match[2]))

    found: list[str] = []
    for literal in re.findall(r"'((?:[^']|'')*)'", text):
        assert literal.isprintable(), literal
        plain = re.sub(r"\\(X2|X4)\\([0-9A-F]+)\\X0\\", "", literal)
        assert "\\" not in plain, literal
        found.append(re.sub(r"\\(X2|X4)\\([0-9A-F]+)\\X0\\", letters, literal.replace("''", "'")))
    return found


@pytest.mark.parametrize(
    "name",
    [
        *("Räume 'κ'", "\\X2\\03B4\\X0\\", "设计" * 60, "a'" * 70, "\\" * 99, "😀" * 99),
        *("a\nb\tc\0", "; ENDSEC; /* ", "x" * 10_000),
    ],
)
def test_step_any_name_is_written_as_the_standard_says(name: str, tmp_path: Path) -> None:
    kept = " ".join("".join(c if c.isprintable() else " " for c in name).split())[:160].rstrip()
    data = step_bytes(SOLID, name)
    assert strings(data).count(kept) >= 2
    path = tmp_path / "a.step"
    path.write_bytes(data)
    reader = occ("STEPControl_Reader")()
    assert int(reader.ReadFile(str(path))) == 1
    model = reader.WS().Model()
    entities = [model.Value(i) for i in range(1, model.NbEntities() + 1)]
    products = [each for each in entities if isinstance(each, occ("StepBasic_Product"))]
    assert [each.Name().ToCString() for each in products] == [kept]


def test_step_workspace_shifted_to_the_tool_keeps_faces_and_volume() -> None:
    solid = exact_workspace(Workspace(OPTIMAL))
    offset = np.array([31.0, -17.5, 120.0])
    shifted = solid.shift(offset)
    assert shifted.limit_of_face == solid.limit_of_face
    assert face_kinds(shifted.shape) == face_kinds(solid.shape)
    assert shifted.volume == pytest.approx(solid.volume, rel=1e-9)
    assert occ("BRepCheck_Analyzer")(shifted.shape).IsValid()
    for face, moved in zip(faces_of(solid.shape), faces_of(shifted.shape), strict=True):
        before, after = occ("BRepAdaptor_Surface")(face), occ("BRepAdaptor_Surface")(moved)
        u, v = before.FirstUParameter(), before.FirstVParameter()
        assert (after.FirstUParameter(), after.FirstVParameter()) == (u, v)
        expected = coordinates(before.Value(u, v)) + offset
        np.testing.assert_allclose(coordinates(after.Value(u, v)), expected, atol=1e-9)


def test_step_empty_or_thin_workspace_is_refused() -> None:
    with pytest.raises(NoAnswerError, match=r"empty: margin δ2"):
        exact_workspace(Workspace(OPTIMAL, np.eye(3)))
    thin: Any = {"box": ((0.0, -12.0, 5.0), (20.0, 22.0, 5.0 + 1e-7))}
    with pytest.raises(ExplorerError, match=r"too thin|cannot combine"):
        exact_workspace(Workspace(limited(OPTIMAL, **thin)))


@pytest.mark.parametrize("below", [False, True])
def test_exact_parts_volumes_match_the_meshes(below: bool) -> None:
    design = OPTIMAL
    if below:
        home = OPTIMAL.home_pose
        x, y, z = home.position
        pose = Pose.of((x, -y, -z), np.diag([1.0, -1.0, -1.0]) @ home.rotation)
        a3 = (OPTIMAL.a3[0], -OPTIMAL.a3[1])
        design = msgspec.structs.replace(limited(OPTIMAL, box=None), a3=a3, home=pose)
    prototype = make_prototype(design)
    exact = {name: form for name, _, form in forms_of(prototype.sizes, ExactShapeMaker())}
    assert list(exact) == [part.name for part in prototype.parts]
    for part in prototype.parts:
        shape = exact[part.name].shape
        assert occ("BRepCheck_Analyzer")(shape).IsValid(), part.name
        # Chords take of what is round, outside and inside.
        mesh = cubic_mm(design, part.solid.volume)
        assert volume_of(shape) == pytest.approx(mesh, rel=1e-2), part.name


def test_step_assembly_reads_back_the_places_of_parts(tmp_path: Path) -> None:
    prototype = make_prototype(OPTIMAL)
    path = tmp_path / "mechanism.step"
    data = assembly_bytes(prototype, "step")
    path.write_bytes(data)
    assert b"AP242" in data[:600]
    for part in prototype.parts:
        assert f"PRODUCT('{part.name}'".encode() in data
    for group in ("base", "leg 1", "leg 4", "platform with balls"):
        assert f"PRODUCT('{group}'".encode() in data
    # Every part is in a group, every group in the whole.
    assert data.count(b"NEXT_ASSEMBLY_USAGE_OCCURRENCE(") == len(prototype.parts) + 6
    assert data.count(b"COLOUR_RGB") >= 7
    shape = read(path)
    home = OPTIMAL.home_pose
    places = prototype.places(home.position, home.rotation)
    points = np.concatenate(placed(prototype.parts, places)[1]) * OPTIMAL.unit_mm
    box = occ("Bnd_Box")()
    occ("BRepBndLib").AddOptimal_s(shape, box, False, False)
    for corner, expected in (
        (box.CornerMin(), points.min(axis=0)),
        (box.CornerMax(), points.max(axis=0)),
    ):
        np.testing.assert_allclose(coordinates(corner), expected, atol=0.05)
    total = sum(cubic_mm(OPTIMAL, part.solid.volume) for part in prototype.parts)
    assert volume_of(shape) == pytest.approx(total, rel=1e-2)
