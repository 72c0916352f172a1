"""OpenCASCADE: its classes, imported on first use, exact shapes, and STEP files of documents.

OpenCASCADE comes with the extra `cad`; it has no types, hence `Any`.
"""

from __future__ import annotations

import math
import re
import tempfile
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from scipy.spatial.transform import Rotation

from explorer.errors import ExplorerError
from explorer.export.mesh import printable_name
from explorer.files.extras import load_extra
from explorer.mechanism.pose import Triple
from explorer.mechanism.rgb import Rgb, linear
from explorer.numerics.arrays import FloatArray
from explorer.prototype.shapes import Circle, ShapeMaker

SCHEMA = "AP242DIS"

# A string of a STEP file, which OpenCASCADE breaks into lines, even between two apostrophes.
_STRING = re.compile(rb"'(?:[^']|'\n?')*'")

# The directions in which the outline of a hull is sampled, to order its circles.
_DIRECTIONS = 3600


def occ(name: str) -> Any:
    """Return a class of OpenCASCADE; its package is the first word of its name.

    Raises:
        MissingExtraError: OpenCASCADE is not installed; the message says how to install it.
    """
    (package,) = load_extra("cad", f"OCP.{name.partition('_')[0]}")
    return getattr(package, name)


def point(position: FloatArray) -> Any:
    """Return a `gp_Pnt`."""
    return occ("gp_Pnt")(*map(float, position))


def direction(vector: FloatArray) -> Any:
    """Return a `gp_Dir`, of unit length whatever the vector has."""
    return occ("gp_Dir")(*map(float, vector))


def coordinates(of: Any) -> FloatArray:
    """Return the coordinates of a point or direction, shape (3,)."""
    return np.array([of.X(), of.Y(), of.Z()])


def transform(rotation: FloatArray, origin: FloatArray) -> Any:
    """Return a `gp_Trsf` that rotates and then translates."""
    result = occ("gp_Trsf")()
    rows = np.column_stack([rotation, origin])
    result.SetValues(*map(float, rows.ravel()))
    return result


def faces_of(shape: Any) -> Iterator[Any]:
    """Yield the faces of a shape."""
    walk = occ("TopExp_Explorer")(shape, occ("TopAbs_ShapeEnum").TopAbs_FACE)
    # Static functions had the suffix _s before OpenCASCADE 8.
    to_face = getattr(occ("TopoDS"), "Face", None) or occ("TopoDS").Face_s
    while walk.More():
        yield to_face(walk.Current())
        walk.Next()


def volume_of(shape: Any) -> float:
    """Return the volume of a shape, integrated over its exact faces."""
    properties = occ("GProp_GProps")()
    # With the default precision quadrature over curved faces stops at 1e-4.
    occ("BRepGProp").VolumeProperties_s(shape, properties, 1e-9)
    return float(properties.Mass())


@dataclass(frozen=True)
class ExactShape:
    """A body with exact faces; implements `explorer.prototype.shapes.Shape`."""

    shape: Any

    def __add__(self, other: ExactShape) -> ExactShape:
        return self._combine(other, "Fuse")

    def __sub__(self, other: ExactShape) -> ExactShape:
        return self._combine(other, "Cut")

    def __xor__(self, other: ExactShape) -> ExactShape:
        return self._combine(other, "Common")

    def translate(self, offset: Triple) -> ExactShape:
        """Return the shape translated."""
        return self._move(transform(np.eye(3), np.array(offset)))

    def rotate(self, degrees: Triple) -> ExactShape:
        """Return the shape rotated about x, then y, then z, in degrees."""
        turn = Rotation.from_euler("xyz", degrees, degrees=True).as_matrix()
        return self._move(transform(turn, np.zeros(3)))

    def transform(self, matrix: FloatArray) -> ExactShape:
        """Return the shape rotated and translated by a matrix, shape (3, 4)."""
        return self._move(transform(matrix[:, :3], matrix[:, 3]))

    def mirror(self, normal: Triple) -> ExactShape:
        """Return the mirror image in a plane through the origin."""
        reflection = occ("gp_Trsf")()
        reflection.SetMirror(occ("gp_Ax2")(point(np.zeros(3)), direction(np.array(normal))))
        return self._move(reflection)

    def _move(self, transformation: Any) -> ExactShape:
        return ExactShape(occ("BRepBuilderAPI_Transform")(self.shape, transformation, True).Shape())

    def _combine(self, other: ExactShape, operation: str) -> ExactShape:
        work = occ(f"BRepAlgoAPI_{operation}")(self.shape, other.shape)
        if not work.IsDone():
            raise ExplorerError(f"OpenCASCADE cannot combine two shapes ({operation})")
        return ExactShape(work.Shape())


def primitive(kind: str, *arguments: Any) -> ExactShape:
    """Return a primitive of OpenCASCADE, such as a "Box"."""
    return ExactShape(occ(f"BRepPrimAPI_Make{kind}")(*arguments).Shape())


class ExactShapeMaker(ShapeMaker):
    """A maker of bodies with exact faces."""

    def disc(self, circle: Circle, low: float, high: float) -> ExactShape:
        """Return a cylinder along z between two heights."""
        frame = occ("gp_Ax2")(point(np.array([circle.x, circle.y, low])), direction(np.eye(3)[2]))
        return primitive("Cylinder", frame, circle.radius, high - low)

    def ball(self, radius: float) -> ExactShape:
        """Return a ball about the origin."""
        return primitive("Sphere", radius)

    # Nothing is to be corrected for facets.
    hole, cavity = disc, ball

    def box(self, low: Triple, high: Triple) -> ExactShape:
        """Return a box between two corners."""
        corners = point(np.array(low)), point(np.array(high))
        return primitive("Box", *corners)

    def hull(self, circles: Sequence[Circle], low: float, high: float) -> ExactShape:
        """Return a plate between two heights, whose outline is the convex hull of circles."""
        around = [circles[index] for index in _outline(circles)]
        if len(around) < 2:
            return self.disc(around[0], low, high)
        # Angle of the outward normal of the tangent from each circle to the next.
        normals = [
            math.atan2(b.y - a.y, b.x - a.x)
            - math.acos((a.radius - b.radius) / math.hypot(b.x - a.x, b.y - a.y))
            for a, b in zip(around, [*around[1:], around[0]], strict=True)
        ]

        def on(circle: Circle, angle: float) -> Any:
            x = circle.x + circle.radius * math.cos(angle)
            y = circle.y + circle.radius * math.sin(angle)
            return point(np.array([x, y, low]))

        wire, edge = occ("BRepBuilderAPI_MakeWire")(), occ("BRepBuilderAPI_MakeEdge")
        for index, circle in enumerate(around):
            start, end = normals[index - 1], normals[index]
            end += 2.0 * math.pi * math.ceil((start - end) / (2.0 * math.pi))
            middle = on(circle, 0.5 * (start + end))
            arc = occ("GC_MakeArcOfCircle")(on(circle, start), middle, on(circle, end)).Value()
            wire.Add(edge(arc).Edge())
            following = around[(index + 1) % len(around)]
            wire.Add(edge(on(circle, end), on(following, end)).Edge())
        face = occ("BRepBuilderAPI_MakeFace")(wire.Wire()).Face()
        up = occ("gp_Vec")(0.0, 0.0, high - low)
        return primitive("Prism", face, up)


def _outline(circles: Sequence[Circle]) -> list[int]:
    """Return the indices of the circles on the convex hull, counter-clockwise, with repeats."""
    angles = np.linspace(0.0, 2.0 * math.pi, _DIRECTIONS, endpoint=False)
    reach = np.array([c.x * np.cos(angles) + c.y * np.sin(angles) + c.radius for c in circles])
    farthest = reach.argmax(axis=0).tolist()
    outline = [b for a, b in zip([farthest[-1], *farthest[:-1]], farthest, strict=True) if a != b]
    return outline or farthest[:1]


class Document:
    """A document of shapes with names and colours, for a STEP file."""

    def __init__(self) -> None:
        self._document = occ("TDocStd_Document")(_text("XmlOcaf"))
        tools = occ("XCAFDoc_DocumentTool")
        self.shapes = tools.ShapeTool_s(self._document.Main())
        self.colours = tools.ColorTool_s(self._document.Main())

    def set_name(self, label: Any, name: str) -> None:
        """Set the name of a label, any text."""
        occ("TDataStd_Name").Set_s(label, _text(step_text(printable_name(name))))

    def set_colour(self, label: Any, rgb: Rgb) -> None:
        """Set the surface colour of a label."""
        red, green, blue = (linear(channel) for channel in rgb)
        space = occ("Quantity_TypeOfColor").Quantity_TOC_RGB
        colour = occ("Quantity_Color")(red, green, blue, space)
        self.colours.SetColor(label, colour, occ("XCAFDoc_ColorType").XCAFDoc_ColorSurf)

    def step(self) -> bytes:
        """Return the document as a STEP file, in millimetres.

        Raises:
            ExplorerError: OpenCASCADE cannot write it.
        """
        # OpenCASCADE would write its progress to standard output.
        for printer in occ("Message").DefaultMessenger_s().Printers():
            printer.SetTraceLevel(occ("Message_Gravity").Message_Alarm)
        occ("STEPCAFControl_Controller").Init_s()
        static = occ("Interface_Static")
        static.SetCVal_s("write.step.schema", SCHEMA)
        static.SetCVal_s("write.step.unit", "MM")
        static.SetIVal_s("write.stepcaf.subshapes.name", 1)
        writer = occ("STEPCAFControl_Writer")()
        writer.SetNameMode(True)
        writer.SetColorMode(True)
        mode = occ("STEPControl_StepModelType").STEPControl_AsIs
        with tempfile.TemporaryDirectory() as folder:
            path = Path(folder) / "document.step"
            if not writer.Transfer(self._document, mode) or int(writer.Write(str(path))) != 1:
                raise ExplorerError("OpenCASCADE cannot write the STEP file")
            return _STRING.sub(lambda match: match[0].replace(b"\n", b""), path.read_bytes())


def step_text(text: str) -> str:
    """Return a printable text as a string of ISO 10303-21 holds it, except for its apostrophes.

    OpenCASCADE doubles apostrophes, but writes other letters than those of ASCII as UTF-8, and
    takes a backslash for the start of a directive.
    """

    def directive(match: re.Match[str]) -> str:
        plane, digits = ("X4", 8) if max(match[0]) > "\uffff" else ("X2", 4)
        return f"\\{plane}\\{''.join(f'{ord(each):0{digits}X}' for each in match[0])}\\X0\\"

    return re.sub(r"[^ -\[\]-~]+", directive, text)


def _text(text: str) -> Any:
    return occ("TCollection_ExtendedString")(text, True)
