"""`explorer export`: the workspace, the mechanism or the scene as a file."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from pathlib import Path
from types import MappingProxyType
from typing import Annotated, Any, Literal

import tyro

from explorer.cli.load_options import held_by
from explorer.cli.options import DesignOptions, JsonOptions, PoseOptions, TypicalOptions
from explorer.cli.values import OPTIONAL, hint, load_numbers, positive, whole_number
from explorer.errors import InputError, NoAnswerError
from explorer.mechanism.design import Design
from explorer.mechanism.machine import Six

What = Literal["workspace", "hull", "mechanism", "simulation", "scene"]

# Typical width of a browser window over its height.
ASPECT = 1.6
# Options of an imperfect machine, which the simulation alone has.
ERRORS = ("errors", "typical")


@dataclass(frozen=True, kw_only=True)
class Export(JsonOptions, TypicalOptions, PoseOptions, DesignOptions):
    """Write the workspace as a mesh, the mechanism as parts or simulation, or the scene.

    Meshes have the coordinates of the base frame in millimetres; GLB is in metres, as its
    specification requires. The mechanism consists of its parts, assembled in the home pose; in
    `stl-zip` a part is a file of its own. The simulation is an MJCF model in metres, to include in
    a scene: every joint, closed loops, payload, tool, six servos within the limits of their forces;
    with `--errors` the machine deviates from its design. The scene is one HTML file for any
    browser, in the home pose unless a pose is given. With `--at tool` the
    workspace and the hull are those of the tool point, with `--load` those of the positions that
    hold the load.
    """

    what: Annotated[What, tyro.conf.Positional]
    """Object to write."""

    out: Path
    """File to write; an existing one is replaced."""

    format: Annotated[
        str | None,
        hint("default: the suffix of the file", "3mf|stl|glb|obj|ply|step|stl-zip|mjcf|html"),
    ] = None
    """Format; 3mf has unit, names, colours, ply and obj doubles, step (extra `cad`) exact faces."""

    tolerance: Annotated[
        float | None,
        positive("--tolerance"),
        hint("workspace and hull; default: a 500th of the reach"),
    ] = None
    """Largest distance of the mesh from the true surface, in design units."""

    load: Annotated[Six | None, load_numbers("--load"), OPTIONAL] = None
    """Force in N and moment in N × unit at the tool, besides the payload: write the part of the
    workspace where it is held within the limits of actuators, struts and guide."""

    density: Annotated[
        float | None,
        positive("--density"),
        hint("mechanism, simulation; default: 1240, printed PLA"),
    ] = None
    """Density of the bodies, in kg/m³."""

    masses: Annotated[Literal["bars", "parts"], hint("simulation; default: bars")] = "bars"
    """Masses of the bodies: of bars as thick as the legs, or of the parts of `export mechanism`."""

    errors: Annotated[
        int | None,
        whole_number("--errors", 0, 2**31 - 1),
        hint("simulation; default: a perfect machine", "SEED"),
    ] = None
    """Seed of a machine whose dimensions and encoders are off within the tolerances and errors of
    the design, and whose actuators and struts give way as the design states."""

    def run(self) -> None:
        """Write the file, and its measures to standard output.

        Raises:
            NoAnswerError: The workspace is empty, or nothing holds the load.
            MissingExtraError: STEP needs OpenCASCADE, which is not installed.
        """
        from explorer.files.writing import check_writable, write_whole

        file_format = self.format or self.out.suffix.lower().removeprefix(".")
        if not file_format:
            raise InputError(
                f"--out {str(self.out)!r} has no suffix that names the format: give --format"
            )
        check_writable(self.out)
        data, facts = _WRITERS[self.what](self, file_format)
        write_whole(self.out, data)
        self.write(lambda: {"file": self.out, **facts}, lambda: (str(self.out), *_as_lines(facts)))

    def refuse(self, *options: str) -> None:
        """Refuse options that do not apply to the object to write.

        Raises:
            InputError: One of the options is given.
        """
        for option in options:
            if getattr(self, option) != getattr(type(self), option):
                raise InputError(f"--{option.replace('_', '-')} is not for {self.what}")


Facts = dict[str, Any]


def _as_lines(facts: Facts) -> list[str]:
    """Return remarks on the file: a mesh that is off, a model, strokes below the limits."""
    from explorer.cli.output import DISAGREES

    remarks: list[str] = []
    if "left_out" in facts:
        from explorer.cli.answers.simulation import simulation_lines

        remarks += simulation_lines(facts)
    if facts.get("agrees") is False:
        remarks.append(f"This differs from the workspace: {DISAGREES}.")
    return remarks + [
        f"leg {actuator['leg']}: stroke {_range(actuator['stroke_mm'])} mm"
        f" (the limits require {_range(actuator['asked_mm'])} mm)"
        for actuator in facts.get("actuators", [])
    ]


def _range(ends: tuple[float, float]) -> str:
    return f"{ends[0]:.1f} to {ends[1]:.1f}"


def _mesh(command: Export, file_format: str) -> tuple[bytes, Facts]:
    from explorer.export.mesh import check_format, mesh_bytes

    if command.what == "workspace" and file_format in ("step", "stp"):
        return _step(command)
    command.refuse("density", "masses", *ERRORS, "position", "folds")
    check_format(file_format)
    design = command.read_design()
    from explorer.workspace.solids.solids import convex_hull, workspace_solid

    home = command.oriented_home(design)
    if command.load is None:
        solid = workspace_solid(design, home.rotation, command.tolerance)
    else:
        held = held_by(design, home.rotation, command.load, command.tolerance)
        if held.factor is not None:
            (part,) = held.solid.empty_because
            raise NoAnswerError(
                f"no position holds the load; the best one found holds {held.factor:.3g} of load "
                f"and payload, up to the {part}"
            )
        solid = held.solid
    shift = command.shift(design, home)
    if shift is not None:
        solid = solid.shifted(shift)
    if command.what == "hull":
        solid = convex_hull(solid)
    data = mesh_bytes(solid, file_format, design, _name(command, design))
    facts: Facts = {"format": file_format, "volume": solid.volume, "triangles": len(solid.faces)}
    return data, {**facts, "agrees": False} if solid.agrees is False else facts


def _name(command: Export, design: Design) -> str:
    whose = "" if command.at == "b4" else "the tool of "
    holding = "" if command.load is None else " that holds the load"
    return f"{command.what}{holding} of {whose}{design.name}"


def _step(command: Export) -> tuple[bytes, Facts]:
    from explorer.export.step import check_extra, exact_workspace, step_bytes

    if command.load is not None:
        raise InputError(
            "STEP takes exact faces, and the surface along which a part takes its limit consists "
            "of facets: write 3mf, stl, glb, obj or ply"
        )
    command.refuse("tolerance", "density", "masses", *ERRORS, "position", "folds")
    check_extra()
    design = command.read_design()
    home = command.oriented_home(design)
    solid = exact_workspace(design, home.rotation)
    shift = command.shift(design, home)
    if shift is not None:
        solid = solid.shifted(shift * design.unit_mm)
    volume = solid.volume / design.unit_mm**3
    facts = {"format": "step", "volume": volume, "faces": len(solid.limit_of_face)}
    return step_bytes(solid, _name(command, design)), facts


def _mechanism(command: Export, file_format: str) -> tuple[bytes, Facts]:
    from explorer.export.assembly import assembly_bytes, check_format
    from explorer.export.simulation import DENSITY
    from explorer.prototype.assembly import bill_of_materials, make_prototype

    command.refuse(
        *("tolerance", "masses", *ERRORS, "position", "quaternion"),
        *("yaw_pitch_roll", "tilt_torsion", "folds", "at", "load"),
    )
    file_format = {"zip": "stl-zip", "stp": "step"}.get(file_format, file_format)
    if file_format == "step":
        from explorer.export.step import assembly_step, check_extra

        check_extra()
        prototype = make_prototype(command.read_design())
        data = assembly_step(prototype.sizes)
    else:
        check_format(file_format)
        prototype = make_prototype(command.read_design())
        data = assembly_bytes(prototype, file_format)
    bill = bill_of_materials(prototype, command.density or DENSITY)
    parts = [
        {"name": item.name, "size_mm": item.size, "volume_mm3": item.volume, "mass_kg": item.mass}
        for item in bill.items
    ]
    actuators = [
        {
            "leg": actuator.leg,
            "stroke_mm": actuator.stroke,
            "asked_mm": actuator.required,
            "diameter_mm": actuator.diameter,
            "mass_kg": actuator.mass,
        }
        for actuator in bill.actuators
    ]
    facts = {"parts": parts, "actuators": actuators, "mass_kg": bill.mass}
    return data, {"format": file_format, **facts}


def _simulation(command: Export, file_format: str) -> tuple[bytes, Facts]:
    from explorer.export.simulation import DENSITY, SimulationModel

    command.refuse(
        *("tolerance", "position", "quaternion"),
        *("yaw_pitch_roll", "tilt_torsion", "folds", "at", "load"),
    )
    if file_format not in ("mjcf", "xml"):
        raise InputError(f"no simulation format {file_format!r}; there is mjcf")
    design, density = command.read_design(), command.density or DENSITY
    masses = None
    if command.masses == "parts":
        from explorer.prototype.assembly import make_prototype

        masses = make_prototype(design).masses(density)
    from explorer.cli.answers.simulation import imperfect_json, simulation_json

    if command.errors is None:
        if command.typical:
            raise InputError("--typical is for the errors of a machine: give --errors SEED")
        model = SimulationModel(design, density, masses)
        return model.text().encode(), simulation_json(model)
    from explorer.export.imperfect import ImperfectMachine

    design, assumed = command.with_typical(design)
    machine = ImperfectMachine.draw(design, command.errors)
    model = SimulationModel(machine, density, masses)
    facts = {**simulation_json(model), "assumed": assumed, **imperfect_json(machine)}
    return model.text().encode(), facts


def _scene(command: Export, file_format: str) -> tuple[bytes, Facts]:
    command.refuse("tolerance", "density", "masses", *ERRORS, "load")
    if file_format not in ("html", "htm"):
        raise InputError(f"no format {file_format!r} of the scene; there is html")
    design = command.read_design()
    pose = command.pose(design)
    import datetime as dt

    from explorer.app.features.sharing.scene_html import FileCamera, scene_html
    from explorer.app.scene.camera import FIELD_OF_VIEW, framing
    from explorer.app.server import start

    running = start(design, pose, port=0)
    try:
        state = running.page.session.state
        camera = FileCamera(*framing(running.page.corners(), "isometric", ASPECT), FIELD_OF_VIEW)
        date = dt.datetime.now().astimezone().date()
        data = scene_html(running.viser, state, camera, date=date)
    finally:
        running.stop()
    return data, {"format": "html", "bytes": len(data)}


_WRITERS: Mapping[What, Callable[[Export, str], tuple[bytes, Facts]]] = MappingProxyType(
    {
        "workspace": _mesh,
        "hull": _mesh,
        "mechanism": _mechanism,
        "simulation": _simulation,
        "scene": _scene,
    }
)
