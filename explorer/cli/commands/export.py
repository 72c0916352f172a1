"""`explorer export`: the workspace, the mechanism or the scene as a file."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from pathlib import Path
from types import MappingProxyType
from typing import Annotated, Any, Literal

import tyro

from explorer.cli.options import DesignOptions, JsonOptions, PoseOptions
from explorer.cli.output import write_json, write_lines
from explorer.cli.values import positive
from explorer.errors import InputError

What = Literal["workspace", "hull", "mechanism", "simulation", "scene"]

_OF_MESHES = "(workspace and hull; default: a 500th of the reach)"
# The typical width over height of a browser window.
ASPECT = 1.6
_OF_BODIES = "(mechanism, simulation; default: 1240, printed PLA)"


@dataclass(frozen=True, kw_only=True)
class Export(JsonOptions, PoseOptions, DesignOptions):
    """Write the workspace as a mesh, the mechanism as parts or simulation, or the scene.

    Meshes have the coordinates of the base frame in millimetres; GLB is in metres, as its
    specification requires. The mechanism consists of its parts, assembled in the home pose; in
    `stl-zip` a part is a file of its own. The simulation is an MJCF model in metres: every joint,
    closed loops, six servos. The scene is one HTML file for any browser, in the home pose unless
    a pose is given.
    """

    what: Annotated[
        Literal["workspace", "hull", "mechanism", "simulation", "scene"], tyro.conf.Positional
    ]
    """Object to write."""

    out: Path
    """File to write; an existing one is replaced."""

    format: Annotated[
        str | None,
        tyro.conf.arg(
            metavar="3mf|stl|glb|obj|ply|step|stl-zip|mjcf|html",
            help_behavior_hint="(default: the suffix of the file)",
        ),
    ] = None
    """Format; 3mf has unit, names, colours, ply and obj doubles, step (extra `cad`) exact faces."""

    tolerance: Annotated[
        float | None, positive("--tolerance"), tyro.conf.arg(help_behavior_hint=_OF_MESHES)
    ] = None
    """Largest distance of the mesh from the true surface, in design units."""

    density: Annotated[
        float | None, positive("--density"), tyro.conf.arg(help_behavior_hint=_OF_BODIES)
    ] = None
    """Density of the bodies, in kg/m³."""

    masses: Annotated[
        Literal["bars", "parts"],
        tyro.conf.arg(help_behavior_hint="(simulation; default: bars)"),
    ] = "bars"
    """Masses of the bodies: of bars as thick as the legs, or of the parts of `export mechanism`."""

    def run(self) -> None:
        """Write the file, and its measures to standard output.

        Raises:
            InputError: a design, option, format or file that cannot be used.
            NoAnswerError: the workspace is empty.
            MissingExtraError: STEP without OpenCASCADE.
        """
        from explorer.files.writing import check_writable

        file_format = self.format or self.out.suffix.lower().removeprefix(".")
        if not file_format:
            raise InputError(
                f"--out {str(self.out)!r} has no suffix that names the format: give --format"
            )
        facts = _WRITERS[self.what](self, file_format, lambda: check_writable(self.out))
        if self.json:
            write_json({"file": str(self.out), **facts})
        else:
            write_lines(str(self.out), *_as_lines(facts))

    def refuse(self, *options: str) -> None:
        """Refuse options that do not apply to the object to write.

        Raises:
            InputError: one of the options is given.
        """
        for option in options:
            if getattr(self, option) != getattr(type(self), option):
                raise InputError(f"--{option.replace('_', '-')} is not for {self.what}")


Facts = dict[str, Any]


def _as_lines(facts: Facts) -> list[str]:
    """Return remarks on the file: a mesh that is off, and strokes below the limits."""
    from explorer.cli.output import DISAGREES

    off = [f"This differs from the workspace: {DISAGREES}."] if facts.get("agrees") is False else []
    return off + [
        f"leg {each['leg']}: stroke {_range(each['stroke_mm'])} mm"
        f" (the limits require {_range(each['asked_mm'])} mm)"
        for each in facts.get("actuators", [])
    ]


def _range(ends: tuple[float, float]) -> str:
    return f"{ends[0]:.1f} to {ends[1]:.1f}"


def _mesh(command: Export, file_format: str, check: Callable[[], None]) -> Facts:
    from explorer.export.mesh import check_format, write_mesh

    if command.what == "workspace" and file_format in ("step", "stp"):
        return _step(command, check)
    command.refuse("density", "masses", "position")
    check_format(file_format)
    check()
    design = command.load()
    rotation = command.oriented_home(design).rotation
    from explorer.workspace.solids.solids import convex_hull, workspace_solid

    solid = workspace_solid(design, rotation, command.tolerance)
    if command.what == "hull":
        solid = convex_hull(solid)
    write_mesh(solid, command.out, file_format, design, f"{command.what} of {design.name}")
    facts: Facts = {"format": file_format, "volume": solid.volume, "triangles": len(solid.faces)}
    return {**facts, "agrees": False} if solid.agrees is False else facts


def _step(command: Export, check: Callable[[], None]) -> Facts:
    from explorer.export.step import check_extra, write_workspace_step

    command.refuse("tolerance", "density", "masses", "position")
    check_extra()
    check()
    design = command.load()
    solid = write_workspace_step(design, command.out, command.oriented_home(design).rotation)
    volume = solid.volume / design.unit_mm**3
    return {"format": "step", "volume": volume, "faces": len(solid.limit_of_face)}


def _mechanism(command: Export, file_format: str, check: Callable[[], None]) -> Facts:
    from explorer.export.assembly import check_format, write_assembly
    from explorer.export.simulation import DENSITY
    from explorer.prototype.assembly import make_prototype
    from explorer.prototype.bill import bill_of_materials

    command.refuse("tolerance", "masses", "position", "quaternion", "yaw_pitch_roll")
    file_format = {"zip": "stl-zip", "stp": "step"}.get(file_format, file_format)
    if file_format == "step":
        from explorer.export.step import check_extra

        check_extra()
    else:
        check_format(file_format)
    check()
    prototype = make_prototype(command.load())
    if file_format == "step":
        from explorer.export.step_assembly import write_assembly_step

        write_assembly_step(prototype.sizes, command.out)
    else:
        write_assembly(prototype, command.out, file_format)
    bill = bill_of_materials(prototype, command.density or DENSITY)
    parts = [
        {"name": item.name, "size_mm": item.size, "volume_mm3": item.volume, "mass_kg": item.mass}
        for item in bill.items
    ]
    actuators = [
        {
            "leg": each.leg,
            "stroke_mm": each.stroke,
            "asked_mm": each.asked,
            "diameter_mm": each.diameter,
            "mass_kg": each.mass,
        }
        for each in bill.actuators
    ]
    return {"format": file_format, "parts": parts, "actuators": actuators, "mass_kg": bill.mass}


def _simulation(command: Export, file_format: str, check: Callable[[], None]) -> Facts:
    from explorer.export.simulation import DENSITY, write_simulation
    from explorer.prototype.chains import BODIES, CHAIN_JOINTS

    command.refuse("tolerance", "position", "quaternion", "yaw_pitch_roll")
    if file_format not in ("mjcf", "xml"):
        raise InputError(f"no simulation format {file_format!r}; there is mjcf")
    check()
    design, density = command.load(), command.density or DENSITY
    masses = None
    if command.masses == "parts":
        from explorer.prototype.assembly import make_prototype

        masses = make_prototype(design).masses(density)
    write_simulation(design, command.out, density, masses)
    return {"format": "mjcf", "bodies": list(BODIES[1:]), "joints": [*CHAIN_JOINTS, "platform"]}


def _scene(command: Export, file_format: str, check: Callable[[], None]) -> Facts:
    command.refuse("tolerance", "density", "masses")
    if file_format not in ("html", "htm"):
        raise InputError(f"no format {file_format!r} of the scene; there is html")
    check()
    design = command.load()
    pose = command.pose(design)
    import datetime as dt

    from explorer.app.features.sharing.scene_html import Eye, scene_html
    from explorer.app.scene.camera import FIELD_OF_VIEW, framing
    from explorer.app.scene.placing import Placed
    from explorer.app.server import start
    from explorer.app.state.frame import Frame
    from explorer.files.writing import write_whole

    running = start(design, pose, port=0)
    try:
        state = running.page.session.state
        eye = Eye(*framing(Placed(Frame(state)), "isometric", ASPECT), FIELD_OF_VIEW)
        date = dt.datetime.now().astimezone().date()
        data = scene_html(running.viser, state, eye, date=date)
    finally:
        running.stop()
    write_whole(command.out, data)
    return {"format": "html", "bytes": len(data)}


_WRITERS: Mapping[str, Callable[[Export, str, Callable[[], None]], Facts]] = MappingProxyType(
    {
        "workspace": _mesh,
        "hull": _mesh,
        "mechanism": _mechanism,
        "simulation": _simulation,
        "scene": _scene,
    }
)
