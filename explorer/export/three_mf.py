"""3MF files by lib3mf, in millimetres: named meshes with colours, and the design as JSON."""

from __future__ import annotations

import contextlib
from collections.abc import Generator, Mapping
from typing import Any

import numpy as np
from numpy.typing import NDArray

from explorer.errors import ExplorerError, InputError
from explorer.export.metadata import APPLICATION, Rgb, design_json
from explorer.mechanism.design import Design
from explorer.numerics.arrays import FloatArray

LARGEST = 1e9
"""The largest coordinate that lib3mf takes, in millimetres."""

NAMESPACE = "urn:flagged-explorer"
"""The XML namespace of the design in a file's metadata."""


def check_size(points: FloatArray) -> float:
    """Return the largest magnitude of a coordinate of points (n, 3), in millimetres.

    Raises:
        InputError: lib3mf does not accept the coordinate.
    """
    largest = float(np.abs(points).max())
    if largest > LARGEST:
        raise InputError(
            f"lib3mf takes coordinates up to {LARGEST:g} mm; these reach {largest:.3g} mm: use "
            "another format, or a smaller unit"
        )
    return largest


@contextlib.contextmanager
def refusals_of_lib3mf(what: str) -> Generator[None]:
    """Raise an error of lib3mf as an `ExplorerError` that names what it refuses."""
    import lib3mf  # pyright: ignore[reportMissingTypeStubs]

    library: Any = lib3mf
    try:
        yield
    except library.ELib3MFException as error:
        raise ExplorerError(f"lib3mf refuses the {what}: {error}") from None


class Model:
    """A model of lib3mf with one group of materials.

    Args:
        name: Title of the file.
        design: The design that the file is of.
        colours: Colours of the materials by their names, one at least.
    """

    def __init__(self, name: str, design: Design, colours: Mapping[str, Rgb]) -> None:
        import lib3mf  # pyright: ignore[reportMissingTypeStubs]

        self._library: Any = lib3mf
        wrapper = self._library.get_wrapper()
        self.untransformed: Any = wrapper.GetIdentityTransform()
        self._model: Any = wrapper.CreateModel()
        self._model.SetUnit(self._library.ModelUnit.MilliMeter)
        about = self._model.GetMetaDataGroup()
        for key, value in (
            ("Title", name),
            ("Application", APPLICATION),
            ("Description", f"{name}; one design unit is {design.unit_mm:g} mm"),
        ):
            about.AddMetaData("", key, value, "xs:string", True)
        about.AddMetaData(NAMESPACE, "design", design_json(design), "xs:string", True)
        group = self._model.AddBaseMaterialGroup()
        self._materials: int = group.GetResourceID()
        self._ids = [
            group.AddMaterial(material, wrapper.RGBAToColor(*rgb, 255))
            for material, rgb in colours.items()
        ]

    def add_mesh(
        self, name: str, points: FloatArray, faces: NDArray[np.integer], material: int
    ) -> Any:
        """Add a mesh of one material and return it.

        Args:
            name: Name of the mesh.
            points: Corners in millimetres, shape (n, 3).
            faces: Indices of the corners of each triangle, shape (m, 3).
            material: Index of its material.
        """
        mesh = self._model.AddMeshObject()
        mesh.SetName(name)
        corners = np.ascontiguousarray(points, dtype="<f4")
        triangles = np.ascontiguousarray(faces, dtype="<u4")
        mesh.SetGeometry(
            (self._library.Position * len(corners)).from_buffer_copy(corners),
            (self._library.Triangle * len(triangles)).from_buffer_copy(triangles),
        )
        mesh.SetObjectLevelProperty(self._materials, self._ids[material])
        return mesh

    def colour_faces(self, mesh: Any, material_of_face: NDArray[np.integer]) -> None:
        """Give each triangle of a mesh the material of an index, shape (m,)."""
        properties = np.empty((len(material_of_face), 4), dtype="<u4")
        properties[:, 0] = self._materials
        properties[:, 1:] = np.array(self._ids)[material_of_face][:, None]
        mesh.SetAllTriangleProperties(
            (self._library.TriangleProperties * len(properties)).from_buffer_copy(properties)
        )

    def add_group(self, name: str) -> Any:
        """Add an object that holds others as components and return it."""
        group = self._model.AddComponentsObject()
        group.SetName(name)
        return group

    def transform(self, rotation: FloatArray, origin: FloatArray) -> Any:
        """Return a rotation and a translation in millimetres: its columns, then the origin."""
        transform = self._library.Transform()
        for i, row in enumerate([*rotation.T.tolist(), origin.tolist()]):
            for j, value in enumerate(row):
                transform.Fields[i][j] = value
        return transform

    def encode(self, item: Any, decimals: int) -> bytes:
        """Return the file that shows one object.

        Args:
            item: The object.
            decimals: Decimals of the coordinates, which lib3mf writes with a fixed number.
        """
        self._model.AddBuildItem(item, self.untransformed)
        writer = self._model.QueryWriter("3mf")
        writer.SetDecimalPrecision(decimals)
        return bytes(writer.WriteToBuffer())
