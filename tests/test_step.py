"""The workspace as STEP: exact faces and volume, and a file that OpenCASCADE reads back."""

from __future__ import annotations

import importlib
from pathlib import Path
from typing import Any

import msgspec
import numpy as np
import pytest
from limited_designs import limited, reference_case

from explorer import PRESETS, Design, ExplorerError, InputError, NoAnswerError, workspace_volume
from explorer.design import Swing
from explorer.export.mesh import colour_of
from explorer.export.step import exact_workspace, step_bytes, to_face, workspace_step

OPTIMAL, INITIAL = PRESETS["paper-optimal"], PRESETS["paper-initial"]


def occ(name: str) -> Any:
    return getattr(importlib.import_module(f"OCP.{name.partition('_')[0]}"), name)


def cubic_mm(design: Design, volume: float) -> float:
    return volume * design.unit_mm**3


@pytest.mark.parametrize("design", [OPTIMAL, INITIAL])
def test_the_volume_is_the_exact_one(design: Design) -> None:
    for unit in (1.0, 10.0, 250.0):
        scaled = msgspec.structs.replace(design, unit_mm=unit)
        expected = cubic_mm(scaled, workspace_volume(design).volume)
        assert exact_workspace(scaled).volume == pytest.approx(expected, rel=1e-6)


@pytest.mark.parametrize("index", range(24))
def test_shells_slabs_and_tilted_planes_have_their_exact_volume(index: int) -> None:
    design, rotation, _ = reference_case(index)
    solid = exact_workspace(design, rotation)
    expected = cubic_mm(design, workspace_volume(design, rotation).volume)
    assert solid.volume == pytest.approx(expected, rel=1e-5)


@pytest.mark.parametrize(
    "swing",
    [
        Swing(a1=30.0),
        Swing(a3=90.0),
        Swing(b1=50.0, b4=70.0),
        Swing(b2=20.0),
        Swing(b2=120.0),
        Swing(a1=100.0, b3=30.0),
    ],
)
def test_cones_and_wedges_are_cut_exactly(swing: Swing) -> None:
    design = limited(OPTIMAL, swing=swing)
    solid, expected = exact_workspace(design), workspace_volume(design)
    off = abs(solid.volume - cubic_mm(design, expected.volume))
    assert off <= cubic_mm(design, 1e-6 * expected.volume + expected.error)


def face_kinds(shape: Any) -> list[str]:
    walk = occ("TopExp_Explorer")(shape, occ("TopAbs_ShapeEnum").TopAbs_FACE)
    found: list[str] = []
    while walk.More():
        surface = occ("BRepAdaptor_Surface")(to_face(walk.Current()))
        found.append(str(surface.GetType()).rpartition("_")[2])
        walk.Next()
    return found


def test_faces_are_spheres_cylinders_and_planes_of_their_limits() -> None:
    solid = exact_workspace(OPTIMAL)
    kinds = dict(zip(solid.limit_of_face, face_kinds(solid.shape), strict=True))
    assert kinds["l1 maximum"] == kinds["l4 maximum"] == "Sphere"
    assert kinds["d2 maximum"] == "Cylinder"
    assert {kind for limit, kind in kinds.items() if limit.startswith("box")} == {"Plane"}
    assert len(kinds) >= 9
    cone = exact_workspace(limited(OPTIMAL, swing=Swing(a1=30.0)))
    kinds = dict(zip(cone.limit_of_face, face_kinds(cone.shape), strict=True))
    assert kinds["swing a1"] == "Cone"


def test_the_file_is_read_back_with_names_colours_and_volume(tmp_path: Path) -> None:
    design = msgspec.structs.replace(OPTIMAL, unit_mm=12.5, name="Räume")
    solid = exact_workspace(design)
    data = step_bytes(solid, f"workspace of {design.name}")
    assert b"AP242" in data[:600]
    assert b"SI_UNIT(.MILLI.,.METRE.)" in data
    assert len(data) < 200_000
    path = tmp_path / "a.step"
    path.write_bytes(data)
    document = occ("TDocStd_Document")(occ("TCollection_ExtendedString")("XmlOcaf"))
    reader = occ("STEPCAFControl_Reader")()
    reader.SetNameMode(True)
    reader.SetColorMode(True)
    assert int(reader.ReadFile(str(path))) == 1
    assert reader.Transfer(document)
    shape = reader.Reader().OneShape()
    assert occ("BRepCheck_Analyzer")(shape).IsValid()
    mass = occ("GProp_GProps")()
    occ("BRepGProp").VolumeProperties_s(shape, mass, 1e-9)
    expected = cubic_mm(design, workspace_volume(design).volume)
    assert float(mass.Mass()) == pytest.approx(expected, rel=1e-6)
    for limit in set(solid.limit_of_face):
        assert f"ADVANCED_FACE('{limit}'".encode() in data
    reds = {colour_of(limit)[0] for limit in solid.limit_of_face}
    written = {
        round(255 * float(line.partition("COLOUR_RGB('',")[2].split(",")[0]))
        for line in data.decode("latin-1").splitlines()
        if "COLOUR_RGB('',0." in line
    }
    assert reds <= written | {0, 255}


def test_an_empty_workspace_or_one_beyond_the_tolerance_is_refused() -> None:
    with pytest.raises(NoAnswerError, match="empty: margin κ2"):
        workspace_step(OPTIMAL, np.eye(3))
    for unit in (1e-4, 1e7):
        with pytest.raises(InputError, match="choose another unit_mm"):
            workspace_step(msgspec.structs.replace(OPTIMAL, unit_mm=unit))
    thin: Any = {"box": ((0.0, -12.0, 5.0), (20.0, 22.0, 5.0 + 1e-7))}
    with pytest.raises(ExplorerError, match=r"too thin|cannot combine"):
        workspace_step(limited(OPTIMAL, **thin))
