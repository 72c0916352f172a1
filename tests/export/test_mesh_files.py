"""Mesh files of workspaces and assemblies are read back by the readers of other programs."""

from __future__ import annotations

import io
import json
import re
import struct
import zipfile
from dataclasses import replace
from typing import Any

import msgspec
import numpy as np
import pytest
import trimesh
from mesh_files import glb_json, mesh_of, metadata_of, read_3mf
from part_gaps import vertices_at

from explorer import PRESETS, Design, ExplorerError, InputError, NoAnswerError, decode_design
from explorer.export.assembly import COLOURS, assembly_bytes
from explorer.export.mesh import FORMATS, colour_of, mesh_bytes
from explorer.motion.chains import CHAIN_JOINTS
from explorer.numerics.arrays import FloatArray
from explorer.prototype.assembly import make_prototype
from explorer.workspace.solids.solid import Solid, convex_hull
from explorer.workspace.solids.solids import workspace_solid

OPTIMAL = msgspec.structs.replace(PRESETS["paper-optimal"], unit_mm=7.5)
SOLID = workspace_solid(OPTIMAL)
NAME = "Räume of κ\n2"
PRINTED = "Räume of κ 2"
SINGLE_PRECISION = 1e-5

untyped: Any = trimesh


def cubic_mm(solid: Solid, design: Design) -> float:
    return solid.volume * design.unit_mm**3


def limits_of_faces(solid: Solid) -> list[str]:
    return [solid.limits[index] for index in solid.limit_of_face.tolist()]


def read(data: bytes, file_format: str) -> Any:
    """Return the one mesh in a file as trimesh reads it, in the file's own unit."""
    found = untyped.load(io.BytesIO(data), file_type=file_format, process=False)
    if isinstance(found, trimesh.Scene):
        (found,) = found.dump()  # pyright: ignore
    return found


def only_mesh(model: Any) -> tuple[Any, Any]:
    """Return the only mesh of a 3MF model, as lib3mf and as trimesh have it."""
    objects = model.GetMeshObjects()
    assert objects.MoveNext()
    mesh = objects.GetCurrentMeshObject()
    assert not objects.MoveNext()
    return mesh, mesh_of(mesh)


@pytest.mark.parametrize("solid", [SOLID, convex_hull(SOLID)], ids=["workspace", "hull"])
def test_3mf_reads_back_unit_names_colours_and_design(solid: Solid) -> None:
    model = read_3mf(mesh_bytes(solid, "3mf", OPTIMAL, NAME))
    mesh, shape = only_mesh(model)
    assert mesh.GetName() == PRINTED
    assert shape.is_watertight
    assert shape.volume == pytest.approx(cubic_mm(solid, OPTIMAL), rel=SINGLE_PRECISION)
    entries = metadata_of(model)
    assert entries["Title"] == PRINTED
    assert entries["Application"].startswith("flagged-explorer")
    assert decode_design(entries["design"].encode(), "3mf") == OPTIMAL
    groups = model.GetBaseMaterialGroups()
    assert groups.MoveNext()
    materials = groups.GetCurrentBaseMaterialGroup()
    names = [materials.GetName(each) for each in materials.GetAllPropertyIDs()]
    assert names == list(solid.limits)
    for index in (0, len(solid.faces) // 2, len(solid.faces) - 1):
        limit = limits_of_faces(solid)[index]
        own = mesh.GetTriangleProperties(index).PropertyIDs[0]
        colour = materials.GetDisplayColor(own)
        assert materials.GetName(own) == limit
        assert (colour.Red, colour.Green, colour.Blue, colour.Alpha) == (*colour_of(limit), 255)


def test_stl_is_binary_and_names_millimetres() -> None:
    data = mesh_bytes(SOLID, "stl", OPTIMAL, NAME)
    assert b"millimetres" in data[:80]
    assert not data.lower().startswith(b"solid")
    assert struct.unpack("<I", data[80:84]) == (len(SOLID.faces),)
    assert len(data) == 84 + 50 * len(SOLID.faces)
    shape = read(data, "stl")
    shape.merge_vertices()
    assert shape.is_watertight
    assert shape.volume == pytest.approx(cubic_mm(SOLID, OPTIMAL), rel=SINGLE_PRECISION)
    own = np.frombuffer(data[84:], dtype=[("normal", "<f4", 3), ("rest", "u1", 38)])["normal"]
    np.testing.assert_allclose(np.linalg.norm(own, axis=1), 1.0, atol=1e-5)


def test_glb_is_in_metres_with_y_up() -> None:
    data = mesh_bytes(SOLID, "glb", OPTIMAL, NAME)
    shape = read(data, "glb")
    assert shape.is_watertight
    assert shape.volume == pytest.approx(1e-9 * cubic_mm(SOLID, OPTIMAL), rel=SINGLE_PRECISION)
    lows, highs = 1e-3 * OPTIMAL.unit_mm * np.array([SOLID.vertices.min(0), SOLID.vertices.max(0)])
    # The base frame's z is up, and up is y.
    np.testing.assert_allclose(shape.bounds[:, 1], [lows[2], highs[2]], atol=1e-6)
    np.testing.assert_allclose(shape.bounds[:, 2], [-highs[1], -lows[1]], atol=1e-6)
    scene = glb_json(data)
    extras = scene["asset"]["extras"]
    assert extras["unit"].startswith("metre")
    assert decode_design(json.dumps(extras["design"]).encode(), "glb") == OPTIMAL
    assert scene["nodes"][0]["name"] == scene["meshes"][0]["name"] == PRINTED


def text_lines(data: bytes) -> list[str]:
    """Return the lines of an OBJ file or of the header of a PLY file, as strict readers want them.

    They take ASCII in lines of at most 200 characters, and trim blanks; a backslash at the end of
    a line of OBJ appends the next one.
    """
    head = data.partition(b"end_header\n")[0]
    assert head.endswith(b"\n")
    lines = head.decode("ascii").split("\n")[:-1]
    assert all(line.isprintable() and len(line) <= 200 for line in lines)
    assert not any(line.endswith((" ", "\\")) for line in lines)
    return lines


NAMES = [
    *("", "\n\t\0", "Räume 设计 😀", "a\nv 0 0 0\nend_header\nf 1 2 3", 'o\' "quoted" <&> ]]>'),
    *("\\" * 99, "# comment", "x  y" * 25, "😀" * 99, "long " * 2000, "\ud800", "solid é" * 9),
]


@pytest.mark.parametrize("name", NAMES)
def test_ply_and_obj_of_any_name_have_short_lines_in_ascii(name: str) -> None:
    for file_format in ("ply", "obj"):
        data = mesh_bytes(SOLID, file_format, OPTIMAL, name)
        shape = read(data, file_format)
        assert len(shape.vertices) == len(SOLID.vertices)
        assert len(shape.faces) == len(SOLID.faces)
        own = [line for line in text_lines(data) if line.startswith("o ")]
        assert len(own) == (file_format == "obj")
        assert all(re.fullmatch(r"o [!-~]+", line) and "?" not in line for line in own)


@pytest.mark.parametrize("name", NAMES)
def test_binary_formats_take_any_name(name: str) -> None:
    stl = mesh_bytes(SOLID, "stl", OPTIMAL, name)
    assert stl[:80].decode("ascii").isprintable()
    assert b"?" not in stl[:80]
    assert not stl.lower().startswith(b"solid")
    kept = " ".join("".join(c if c.isprintable() else " " for c in name).split()) or "workspace"
    kept = kept[:160].rstrip()
    assert glb_json(mesh_bytes(SOLID, "glb", OPTIMAL, name))["nodes"][0]["name"] == kept
    assert only_mesh(read_3mf(mesh_bytes(SOLID, "3mf", OPTIMAL, name)))[0].GetName() == kept


def test_ply_reads_back_corners_and_face_colours() -> None:
    data = mesh_bytes(SOLID, "ply", OPTIMAL, NAME)
    start = data.index(b"end_header\n") + len(b"end_header\n")
    corners = np.frombuffer(data[start:], "<f8", SOLID.vertices.size).reshape(-1, 3)
    np.testing.assert_array_equal(corners, SOLID.vertices * OPTIMAL.unit_mm)
    colours = read(data, "ply").visual.face_colors[:, :3]
    expected = [colour_of(limit) for limit in limits_of_faces(SOLID)]
    np.testing.assert_array_equal(colours, expected)


def test_obj_reads_back_corners_and_groups_of_limits() -> None:
    lines = mesh_bytes(SOLID, "obj", OPTIMAL, NAME).decode("ascii").splitlines()
    corners = [[float(x) for x in line.split()[1:]] for line in lines if line.startswith("v ")]
    np.testing.assert_array_equal(corners, SOLID.vertices * OPTIMAL.unit_mm)
    groups = [line[2:] for line in lines if line.startswith("g ")]
    used = {limit.replace(" ", "_") for limit in limits_of_faces(SOLID)}
    assert set(groups) == used
    assert len(groups) == len(used)


@pytest.mark.parametrize("file_format", FORMATS)
def test_mesh_bytes_empty_or_open_solid_is_refused_with_reason(file_format: str) -> None:
    empty = workspace_solid(OPTIMAL, np.eye(3))
    with pytest.raises(NoAnswerError, match="empty: margin δ2"):
        mesh_bytes(empty, file_format, OPTIMAL, NAME)
    with pytest.raises(ExplorerError, match="not watertight"):
        mesh_bytes(replace(SOLID, faces=SOLID.faces[1:]), file_format, OPTIMAL, NAME)


@pytest.mark.parametrize("file_format", ["stl", "glb", "3mf"])
def test_mesh_bytes_far_solid_is_refused_in_single_precision(file_format: str) -> None:
    far = replace(SOLID, vertices=SOLID.vertices + [1e7, 0.0, 0.0])
    with pytest.raises(InputError, match="ply and obj hold double"):
        mesh_bytes(far, file_format, OPTIMAL, NAME)
    shape = read(mesh_bytes(far, "ply", OPTIMAL, NAME), "ply")
    assert shape.is_watertight


def test_mesh_bytes_coarse_coordinates_are_refused() -> None:
    far = replace(SOLID, vertices=1e6 + 1e-2 * SOLID.vertices)
    with pytest.raises(InputError, match="double"):
        mesh_bytes(far, "stl", OPTIMAL, NAME)


transformations: Any = trimesh.transformations

ASSEMBLED = msgspec.structs.replace(PRESETS["paper-optimal"], unit_mm=12.5)
PROTOTYPE = make_prototype(ASSEMBLED)
HOME = ASSEMBLED.home_pose
MESH_FORMATS = ("3mf", "glb", "stl-zip")
PARTS = [part.name for part in PROTOTYPE.parts]
AT_HOME = dict(zip(PARTS, vertices_at(PROTOTYPE, HOME.position, HOME.rotation), strict=True))
DATA = {file_format: assembly_bytes(PROTOTYPE, file_format) for file_format in MESH_FORMATS}


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
    part = PROTOTYPE.parts[PARTS.index(mesh.GetName())]
    shape = mesh_of(mesh)
    corners = np.asarray(shape.vertices)
    assert shape.is_watertight
    volume = part.unit_mass.mass * ASSEMBLED.unit_mm**3
    assert float(shape.volume) == pytest.approx(volume, rel=SINGLE_PRECISION)
    expected = AT_HOME[part.name] * ASSEMBLED.unit_mm
    # lib3mf writes six digits of where things are.
    np.testing.assert_allclose(corners @ placed[:3] + placed[3], expected, atol=1e-3)
    resource, own, _ = mesh.GetObjectLevelProperty()
    materials = model.GetBaseMaterialGroupByID(resource)
    colour = materials.GetDisplayColor(own)
    assert materials.GetName(own) == part.kind
    assert (colour.Red, colour.Green, colour.Blue) == COLOURS[part.kind]


SCENE = glb_json(DATA["glb"])


def test_glb_parts_lie_at_their_home_places_in_the_tree_of_the_joints() -> None:
    scene = untyped.load(io.BytesIO(DATA["glb"]), file_type="glb", process=False)
    assert set(scene.graph.nodes_geometry) == set(PARTS)
    for name in PARTS:
        transform, geometry = scene.graph[name]
        shape = scene.geometry[geometry]
        assert shape.is_watertight
        points = np.asarray(shape.vertices) @ transform[:3, :3].T + transform[:3, 3]
        # Up is y; the base frame's z is up.
        expected = AT_HOME[name][:, [0, 2, 1]] * [1.0, 1.0, -1.0] * 1e-3 * ASSEMBLED.unit_mm
        np.testing.assert_allclose(points, expected, atol=1e-7)
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
    metres = 1e-3 * ASSEMBLED.unit_mm
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
    moved = dict(zip(PARTS, vertices_at(PROTOTYPE, position, HOME.rotation), strict=True))
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
        assert archive.namelist() == [f"{name.replace(' ', '-')}.stl" for name in PARTS]
        for part, name in zip(PROTOTYPE.parts, archive.namelist(), strict=True):
            shape = untyped.load(io.BytesIO(archive.read(name)), file_type="stl")
            assert shape.is_watertight
            volume = part.unit_mass.mass * ASSEMBLED.unit_mm**3
            assert float(shape.volume) == pytest.approx(volume, rel=SINGLE_PRECISION)


@pytest.mark.parametrize("file_format", MESH_FORMATS)
def test_assembly_bytes_equal_designs_give_equal_files(file_format: str) -> None:
    again = assembly_bytes(make_prototype(ASSEMBLED), file_format)
    if file_format == "3mf":
        # lib3mf gives each file ids of its own.
        assert len(again) == pytest.approx(len(DATA[file_format]), rel=0.01)
    else:
        assert again == DATA[file_format]
    assert len(again) < 2_000_000
