"""Assembly files are read back by other programs' readers: units, names, colours, places."""

from __future__ import annotations

import io
import json
import zipfile
from typing import Any

import msgspec
import numpy as np
import pytest
import trimesh
from mesh_files import glb_json, mesh_of, metadata_of, read_3mf

from explorer import PRESETS, InputError, decode_design, home_pose
from explorer.export.assembly import COLOURS, FORMATS, assembly_bytes
from explorer.numerics.arrays import FloatArray
from explorer.prototype.assembly import make_prototype
from explorer.prototype.chains import CHAIN_JOINTS

untyped: Any = trimesh
transformations: Any = trimesh.transformations

DESIGN = msgspec.structs.replace(PRESETS["paper-optimal"], unit_mm=12.5)
PROTOTYPE = make_prototype(DESIGN)
HOME = home_pose(DESIGN)
NAMES = [part.name for part in PROTOTYPE.parts]
AT_HOME = dict(zip(NAMES, PROTOTYPE.at(HOME.position, HOME.rotation), strict=True))
DATA = {file_format: assembly_bytes(PROTOTYPE, file_format) for file_format in FORMATS}
SINGLE_PRECISION = 1e-5


def matrix_of(transform: Any) -> FloatArray:
    return np.array([list(row) for row in transform.Fields])


def test_3mf_reads_back_unit_names_colours_and_tree() -> None:
    model = read_3mf(DATA["3mf"])
    items = model.GetBuildItems()
    assert items.MoveNext()
    whole = items.GetCurrent().GetObjectResource()
    assert not items.MoveNext()
    assert whole.GetName() == "mechanism"
    groups: dict[str, list[str]] = {}
    for i in range(whole.GetComponentCount()):
        group = model.GetComponentsObjectByID(whole.GetComponent(i).GetObjectResourceID())
        for j in range(group.GetComponentCount()):
            component = group.GetComponent(j)
            mesh = model.GetMeshObjectByID(component.GetObjectResourceID())
            check_3mf_part(model, mesh, matrix_of(component.GetTransform()))
            groups.setdefault(group.GetName(), []).append(mesh.GetName())
    assert groups == {
        "base": ["base"],
        "leg 1": ["cross 1", "cylinder 1", "rod 1"],
        "leg 2": ["carriage 2", "cylinder 2", "rod 2"],
        "leg 3": ["carriage 3", "cylinder 3", "rod 3"],
        "leg 4": ["cross 4", "cylinder 4", "rod 4"],
        "platform with balls": ["platform", "ball 1", "ball 2", "ball 3", "ball 4"],
    }
    entries = metadata_of(model)
    assert entries["Title"] == "mechanism of paper-optimal"
    assert decode_design(entries["design"].encode(), "3mf") == PROTOTYPE.design


def check_3mf_part(model: Any, mesh: Any, placed: FloatArray) -> None:
    part = PROTOTYPE.parts[NAMES.index(mesh.GetName())]
    shape = mesh_of(mesh)
    corners = np.asarray(shape.vertices)
    assert shape.is_watertight
    volume = part.unit_mass.mass * DESIGN.unit_mm**3
    assert float(shape.volume) == pytest.approx(volume, rel=SINGLE_PRECISION)
    expected = AT_HOME[part.name] * DESIGN.unit_mm
    # lib3mf writes six digits of where things are.
    np.testing.assert_allclose(corners @ placed[:3] + placed[3], expected, atol=1e-3)
    resource, own, _ = mesh.GetObjectLevelProperty()
    materials = model.GetBaseMaterialGroupByID(resource)
    colour = materials.GetDisplayColor(own)
    assert materials.GetName(own) == part.kind
    assert (colour.Red, colour.Green, colour.Blue) == COLOURS[part.kind]


SCENE = glb_json(DATA["glb"])


def test_glb_parts_lie_at_their_home_places() -> None:
    scene = untyped.load(io.BytesIO(DATA["glb"]), file_type="glb", process=False)
    assert set(scene.graph.nodes_geometry) == set(NAMES)
    for name in NAMES:
        transform, geometry = scene.graph[name]
        shape = scene.geometry[geometry]
        assert shape.is_watertight
        points = np.asarray(shape.vertices) @ transform[:3, :3].T + transform[:3, 3]
        # Up is y; the base frame's z is up.
        expected = AT_HOME[name][:, [0, 2, 1]] * [1.0, 1.0, -1.0] * 1e-3 * DESIGN.unit_mm
        np.testing.assert_allclose(points, expected, atol=1e-7)


def test_glb_node_tree_is_that_of_the_joints() -> None:
    scene = untyped.load(io.BytesIO(DATA["glb"]), file_type="glb", process=False)
    parents = scene.graph.transforms.parents
    for leg, first in ((1, "cross"), (2, "carriage"), (3, "carriage"), (4, "cross")):
        assert parents[f"rod {leg}"] == f"cylinder {leg}"
        assert parents[f"cylinder {leg}"] == f"{first} {leg}"
        assert parents[f"{first} {leg}"] == "base"
        assert parents[f"ball {leg}"] == "platform"
    joints = [node["extras"]["joint"] for node in SCENE["nodes"] if "extras" in node]
    assert joints == list(CHAIN_JOINTS)


def test_glb_moved_joints_move_the_mechanism() -> None:
    scene = untyped.load(io.BytesIO(DATA["glb"]), file_type="glb", process=False)
    nodes = {node["name"]: node for node in SCENE["nodes"]}
    position = np.array(HOME.position) + [0.5, -0.4, 0.3]
    joints = PROTOTYPE.chains.joints(position, HOME.rotation)
    at_home = PROTOTYPE.chains.joints(HOME.position, HOME.rotation)
    metres = 1e-3 * DESIGN.unit_mm
    # Each joint turns about, or slides along, one axis of its own node.
    for node in nodes.values():
        if "extras" not in node:
            continue
        index = CHAIN_JOINTS.index(node["extras"]["joint"])
        step = joints[index] - at_home[index]
        if "second" in CHAIN_JOINTS[index]:
            move = transformations.rotation_matrix(step, [0, 1, 0])
        elif CHAIN_JOINTS[index] in ("l1", "d2", "d4", "l4"):
            move = transformations.translation_matrix([0, 0, step * metres])
        elif CHAIN_JOINTS[index] in ("d1", "d3"):
            move = transformations.translation_matrix([step * metres, 0, 0])
        else:
            move = transformations.rotation_matrix(step, [1, 0, 0])
        parent = scene.graph.transforms.parents[node["name"]]
        before = scene.graph.get(node["name"], parent)[0]
        scene.graph.update(node["name"], parent, matrix=before @ move)
    moved = dict(zip(NAMES, PROTOTYPE.at(position, HOME.rotation), strict=True))
    for leg in (1, 2, 3, 4):
        transform, geometry = scene.graph[f"rod {leg}"]
        points = np.asarray(scene.geometry[geometry].vertices) @ transform[:3, :3].T
        points += transform[:3, 3]
        expected = moved[f"rod {leg}"][:, [0, 2, 1]] * [1.0, 1.0, -1.0] * metres
        np.testing.assert_allclose(points, expected, atol=1e-6)


def test_glb_reads_back_colours_and_design() -> None:
    assert [material["name"] for material in SCENE["materials"]] == list(COLOURS)
    extras = SCENE["asset"]["extras"]
    assert decode_design(json.dumps(extras["design"]).encode(), "glb") == PROTOTYPE.design
    for mesh in SCENE["meshes"]:
        (primitive,) = mesh["primitives"]
        kind = SCENE["materials"][primitive["material"]]["name"]
        assert mesh["name"].partition(" ")[0] == kind


def test_stl_zip_holds_a_closed_mesh_per_part() -> None:
    with zipfile.ZipFile(io.BytesIO(DATA["stl-zip"])) as archive:
        assert archive.testzip() is None
        assert archive.namelist() == [f"{name.replace(' ', '-')}.stl" for name in NAMES]
        for part, name in zip(PROTOTYPE.parts, archive.namelist(), strict=True):
            shape = untyped.load(io.BytesIO(archive.read(name)), file_type="stl")
            assert shape.is_watertight
            volume = part.unit_mass.mass * DESIGN.unit_mm**3
            assert float(shape.volume) == pytest.approx(volume, rel=SINGLE_PRECISION)


@pytest.mark.parametrize("file_format", FORMATS)
def test_assembly_bytes_equal_designs_give_equal_files(file_format: str) -> None:
    again = assembly_bytes(make_prototype(DESIGN), file_format)
    if file_format == "3mf":
        # lib3mf gives each file ids of its own.
        assert len(again) == pytest.approx(len(DATA[file_format]), rel=0.01)
    else:
        assert again == DATA[file_format]
    assert len(again) < 2_000_000


def test_assembly_bytes_huge_parts_and_unknown_formats_are_refused() -> None:
    huge = make_prototype(msgspec.structs.replace(DESIGN, unit_mm=1e9))
    with pytest.raises(InputError, match="smaller unit"):
        assembly_bytes(huge, "3mf")
    with pytest.raises(InputError, match="3mf, glb, stl-zip"):
        assembly_bytes(PROTOTYPE, "dwg")
