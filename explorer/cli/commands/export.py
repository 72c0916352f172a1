"""`explorer export`: the workspace, the mechanism, its models, pages or figure as files."""

from __future__ import annotations

import dataclasses
import datetime as dt
import math
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Any, Literal

import numpy as np
import tyro

from explorer.cli import options, output, values
from explorer.errors import InputError, NoAnswerError
from explorer.export import assembly, mesh, simulation, step
from explorer.export.controller import kernel_files
from explorer.export.drawings.figure import COLUMN, figure_svg
from explorer.export.drawings.mechanism import Projection, ViewName, points_to_show
from explorer.export.linuxcnc import linuxcnc_files
from explorer.export.moving_page import moving_page
from explorer.export.servos import droop_text
from explorer.files.extras import check_extra
from explorer.files.writing import check_writable, make_folder, write_whole
from explorer.measures.snapshot import evaluate
from explorer.mechanism.design import JOINTS, Design
from explorer.motion.masses import DENSITY
from explorer.numerics.arrays import FloatArray
from explorer.numerics.number_text import format_apart
from explorer.prototype.assembly import bill_of_materials, make_prototype
from explorer.prototype.imperfect import ImperfectMachine
from explorer.statics import accuracy
from explorer.workspace.solids.solid import convex_hull
from explorer.workspace.solids.solids import whole_solid
from explorer.workspace.workspace import Workspace

What = Literal[
    "workspace", "hull", "mechanism", "simulation", "scene", "page", "figure", "kernel", "linuxcnc"
]

# Typical width of a browser window over its height.
ASPECT = 1.6
COMMON = ("what", "out", "format", "design", "json")


@dataclass(frozen=True, kw_only=True)
class ExportCommand(
    options.JsonOptions, options.TypicalOptions, options.MachineOptions, options.PoseOptions
):
    """Write workspace, parts, models, pages, a figure or code for controllers as files.

    Meshes have the coordinates of the base frame in millimetres; GLB is in metres, as its
    specification requires. The mechanism consists of its parts, assembled in the home pose; in
    `stl-zip` a part is a file of its own. The simulation is an MJCF model in metres, to include in
    a scene: every joint, closed loops, payload, tool, six servos within the limits of their forces;
    with `--errors` the machine deviates from its design. The scene is one HTML file for any
    browser, the figure an SVG for a paper with letters and lines of a fixed size, both in the home
    pose unless a pose is given. The page is a smaller file whose mechanism moves, with sliders for
    pose, joints and folds. The kernel is a folder with the kinematics of the design as C99 source,
    for controllers; linuxcnc is a folder with it as a configuration that runs in LinuxCNC's
    simulation. With `--at tool` the workspace and the hull are those of the tool point, with
    `--load` those of the positions that hold the load.
    """

    what: Annotated[What, tyro.conf.Positional]
    """Object to write."""

    out: Path
    """File to write, of kernel and linuxcnc the folder; an existing one is replaced."""

    format: Annotated[
        str | None,
        values.hint(
            "default: the suffix of the file",
            "3mf|stl|glb|obj|ply|step|stl-zip|mjcf|html|svg|c|ini",
        ),
    ] = None
    """Format; 3mf has unit, names, colours, ply and obj doubles, step (extra `cad`) exact faces."""

    tolerance: Annotated[
        values.Positive, values.hint("workspace and hull; default: a 500th of the reach")
    ] = None
    """Largest distance of the mesh from the true surface, in design units."""

    load: Annotated[values.Load, values.OPTIONAL] = None
    """Force in N and moment in N × unit at the tool, besides the payload: write the part of the
    workspace where it is held within the limits of actuators, struts and guide."""

    density: Annotated[
        values.Positive, values.hint("mechanism, simulation; default: 1240, printed PLA")
    ] = None
    """Density of the bodies, in kg/m³."""

    masses: Annotated[Literal["bars", "parts"], values.hint("simulation; default: bars")] = "bars"
    """Masses of the bodies: of bars as thick as the legs, or of the parts of `export mechanism`."""

    errors: Annotated[
        int | None,
        values.whole_number(0, 2**31 - 1),
        values.hint("simulation; default: a perfect machine", "SEED"),
    ] = None
    """Seed of a machine whose dimensions and encoders are off within the tolerances and errors of
    the design, and whose actuators and struts give way as the design states."""

    view: Annotated[ViewName, values.hint("figure; default: isometric")] = "isometric"
    """View of the figure; all but the isometric one are without perspective."""

    width: Annotated[values.Positive, values.hint("figure; default: 85, a column")] = None
    """Width of the figure in mm; that of a page is 170."""

    black: values.Flag = False
    """Draw the figure in black, white and grey."""

    tetrahedra: Annotated[bool, values.hint("figure; default: with them")] = True
    """Draw the edges of the three tetrahedra in the figure."""

    def run(self) -> None:
        """Write the file, and its measures to standard output."""
        is_folder = self.what in _FOLDERS
        default = _FOLDERS[self.what][1] if is_folder else self.out.suffix.lower()[1:]
        file_format = self.format or default
        if not file_format:
            raise InputError(
                f"--out {str(self.out)!r} has no suffix that names the format: give --format"
            )
        write, options = _WRITERS[self.what]
        self.refuse_all_but(*options)
        if not is_folder:
            check_writable(self.out)
        data, facts = write(self, file_format)
        if isinstance(data, bytes):
            write_whole(self.out, data)
        else:
            make_folder(self.out, 0o777)
            for name, each in data.items():
                write_whole(self.out / name, each)
        self.write(lambda: {"file": self.out, **facts}, (str(self.out), *_as_lines(facts)))

    def refuse_all_but(self, *names: str) -> None:
        """Refuse options that do not apply to the object to write."""
        for field in dataclasses.fields(self):
            if field.name not in (*COMMON, *names) and getattr(self, field.name) != field.default:
                raise InputError(f"--{field.name.replace('_', '-')} is not for {self.what}")


Facts = dict[str, Any]
Data = bytes | dict[str, bytes]
"""The contents of a file, or of a folder's files by their names."""


def _as_lines(facts: Facts) -> Iterator[str]:
    """Yield remarks on the file: a mesh that is off, a model, strokes below the limits."""
    if "left_out" in facts:
        yield from _simulation_lines(facts)
    if facts.get("agrees") is False:
        yield f"This differs from the workspace: {output.DISAGREES}."
    for actuator in facts.get("actuators", []):
        ends = (actuator["stroke_mm"], actuator["asked_mm"])
        stroke, asked = (f"{low:.1f} to {high:.1f}" for low, high in ends)
        yield f"leg {actuator['leg']}: stroke {stroke} mm (the limits require {asked} mm)"


def _mesh(command: ExportCommand, file_format: str) -> tuple[bytes, Facts]:
    if command.what == "workspace" and file_format in ("step", "stp"):
        return _step(command)
    mesh.check_format(file_format, mesh.FORMATS, "mesh")
    design = command.read_design()
    home = command.oriented_home(design)
    workspace = Workspace(design, home.rotation)
    if command.load is None:
        solid = whole_solid(workspace, command.tolerance)
    else:
        part = options.carrying_part(workspace, command.load, command.tolerance)
        solid = part.solid
        if part.factor is not None:
            share, _ = format_apart((part.factor, 1.0), 3)
            raise NoAnswerError(
                f"no position holds the load; the best one found holds {share} of load and "
                f"payload, up to the {solid.empty_because[0]}"
            )
    solid = solid.shift(command.shift(design, home))
    if command.what == "hull":
        solid = convex_hull(solid)
    data = mesh.mesh_bytes(solid, file_format, design, _name(command, design))
    facts: Facts = {"format": file_format, "volume": solid.volume, "triangles": len(solid.faces)}
    return data, {**facts, "agrees": False} if solid.agrees is False else facts


def _name(command: ExportCommand, design: Design) -> str:
    whose = "" if command.at == "b4" else "the tool of "
    holding = "" if command.load is None else " that holds the load"
    return f"{command.what}{holding} of {whose}{design.name}"


def _step(command: ExportCommand) -> tuple[bytes, Facts]:
    if command.load is not None:
        raise InputError(
            "STEP takes exact faces, and the surface along which a part takes its limit consists "
            "of facets: write 3mf, stl, glb, obj or ply"
        )
    command.refuse_all_but(*_ORIENTATION)
    check_extra("cad")
    design = command.read_design()
    home = command.oriented_home(design)
    solid = step.exact_workspace(Workspace(design, home.rotation))
    if command.at == "tool":
        solid = solid.shift(command.shift(design, home) * design.unit_mm)
    volume = solid.volume / design.unit_mm**3
    facts = {"format": "step", "volume": volume, "faces": len(solid.limit_of_face)}
    return step.step_bytes(solid, _name(command, design)), facts


def _mechanism(command: ExportCommand, file_format: str) -> tuple[bytes, Facts]:
    file_format = {"zip": "stl-zip", "stp": "step"}.get(file_format, file_format)
    mesh.check_format(file_format, assembly.FORMATS, "assembly")
    if file_format == "step":
        check_extra("cad")
    prototype = make_prototype(command.read_design())
    data = assembly.assembly_bytes(prototype, file_format)
    bill = bill_of_materials(prototype, command.density or DENSITY)
    part_keys = ("name", "size_mm", "volume_mm3", "mass_kg")
    parts = [(each.name, each.size, each.volume, each.mass) for each in bill.items]
    actuator_keys = ("leg", "stroke_mm", "asked_mm", "diameter_mm", "mass_kg")
    actuators = [(a.leg, a.stroke, a.required, a.diameter, a.mass) for a in bill.actuators]
    return data, {
        "format": file_format,
        "parts": _as_dicts(part_keys, parts),
        "actuators": _as_dicts(actuator_keys, actuators),
        "mass_kg": bill.mass,
    }


def _as_dicts(keys: Sequence[str], rows: Iterable[Sequence[object]]) -> list[dict[str, object]]:
    return [dict(zip(keys, row, strict=True)) for row in rows]


def _simulation(command: ExportCommand, file_format: str) -> tuple[bytes, Facts]:
    if file_format not in ("mjcf", "xml"):
        raise InputError(f"no simulation format {file_format!r}; there is mjcf")
    design, density = command.read_design(), command.density or DENSITY
    masses = make_prototype(design).masses(density) if command.masses == "parts" else None
    given: Design | ImperfectMachine = design
    facts: Facts = {}
    if (machine := command.read_machine(design)) is not None:
        if command.errors is not None:
            raise InputError("give either --errors SEED or --machine FILE.json")
        given = ImperfectMachine(design, machine.deviations)
    elif command.errors is not None:
        design, assumed = command.with_typical(design)
        given = ImperfectMachine.draw(design, command.errors)
        facts = {"assumed": assumed, **_imperfect_json(given)}
    elif command.typical:
        raise InputError("--typical is for the errors of a machine: give --errors SEED")
    model = simulation.SimulationModel(given, density, masses)
    return model.text().encode(), {**_simulation_json(model), **facts}


def _scene(command: ExportCommand, file_format: str) -> tuple[bytes, Facts]:
    _check_format(file_format, "scene", "html", "htm")
    design = command.read_design()
    pose = command.pose(design)
    from explorer.app.features.sharing.scene_files import camera_messages, scene_html
    from explorer.app.scene.camera import FIELD_OF_VIEW, framing
    from explorer.app.server import start

    running = start(design, pose, port=0)
    try:
        state = running.page.session.state
        view = framing(running.page.corners(), "isometric", ASPECT)
        camera = camera_messages(*view, FIELD_OF_VIEW)
        date = dt.datetime.now().astimezone().date()
        data = scene_html(running.viser, state, camera, date=date)
    finally:
        running.stop()
    return data, {"format": "html", "bytes": len(data)}


def _page(command: ExportCommand, file_format: str) -> tuple[bytes, Facts]:
    _check_format(file_format, "page", "html", "htm")
    data = moving_page(command.read_design())
    return data, {"format": "html", "bytes": len(data)}


def _figure(command: ExportCommand, file_format: str) -> tuple[bytes, Facts]:
    _check_format(file_format, "figure", "svg")
    design = command.read_design()
    snapshot = evaluate(design, command.pose(design))
    from explorer.app.scene.camera import framing, has_perspective

    eye, target = framing(points_to_show(snapshot), command.view, ASPECT)
    view = Projection.of_camera(eye, target, perspective=has_perspective(target - eye))
    width, tetrahedra = command.width or COLUMN, [command.tetrahedra] * 3
    data = figure_svg(snapshot, view, width, black=command.black, tetrahedra=tetrahedra)
    return data, {"format": "svg", "bytes": len(data)}


def _folder(command: ExportCommand, file_format: str) -> tuple[dict[str, bytes], Facts]:
    name, only, files_of = _FOLDERS[command.what]
    _check_format(file_format, name, only)
    design = command.read_design()
    files = files_of(design, command.read_machine(design))
    return files, {"format": only, "files": list(files)}


def _check_format(file_format: str, name: str, only: str, suffix: str | None = None) -> None:
    """Refuse another format of an object than its only one, which may have a second suffix."""
    if file_format not in (only, suffix):
        raise InputError(f"no format {file_format!r} of the {name}; there is {only}")


_ORIENTATION = ("quaternion", "yaw_pitch_roll", "tilt_torsion", "at")
_POSE = ("position", "folds", *_ORIENTATION)
_FOLDERS: dict[What, tuple[str, str, Callable[..., dict[str, bytes]]]] = {
    "kernel": ("kernel", "c", kernel_files),
    "linuxcnc": ("configuration", "ini", linuxcnc_files),
}
"""Of each object that is a folder: its name in words, its format, and what gives its files."""
_WRITERS: dict[What, tuple[Callable[[ExportCommand, str], tuple[Data, Facts]], tuple[str, ...]]] = {
    "workspace": (_mesh, ("tolerance", "load", *_ORIENTATION)),
    "hull": (_mesh, ("tolerance", "load", *_ORIENTATION)),
    "mechanism": (_mechanism, ("density",)),
    "simulation": (_simulation, ("density", "masses", "errors", "typical", "machine")),
    "scene": (_scene, _POSE),
    "page": (_page, ()),
    "figure": (_figure, (*_POSE, "view", "width", "black", "tetrahedra")),
    "kernel": (_folder, ("machine",)),
    "linuxcnc": (_folder, ("machine",)),
}
"""The function that writes each object, and its options besides those of all."""


def _simulation_json(model: simulation.SimulationModel) -> Facts:
    servos = model.servos
    return {
        "format": "mjcf",
        "bodies": simulation.SIMULATION_BODIES[1:],
        "joints": simulation.SIMULATION_JOINTS,
        "servo_stiffness_n_mm": (1e-3 * servos.stiffness).tolist(),
        "servo_forces_n": servos.forces.tolist(),
        "servo_rotors_kg": servos.rotors.tolist(),
        "droop": _tool_json(model.design, servos.droop(model.design)),
        "left_out": model.left_out,
    }


def _imperfect_json(machine: ImperfectMachine) -> Facts:
    """Return deviations and errors of the tool at home as plain values."""
    design = machine.design
    off, most = (
        accuracy.drawing_values(design, each)
        for each in (machine.deviations, accuracy.source_errors(design))
    )
    rows = zip(accuracy.SOURCES, off.tolist(), most.tolist(), accuracy.UNITS, strict=True)
    return {
        "seed": machine.seed,
        "deviations": _as_dicts(("name", "deviation", "largest", "unit"), rows),
        "tool_error": _tool_json(design, machine.tool_error()),
    }


def _tool_json(design: Design, error: FloatArray) -> dict[str, list[float]]:
    return {
        "displacement_mm": (design.unit_mm * error[:3]).tolist(),
        "turn_degrees": np.degrees(error[3:]).tolist(),
    }


def _simulation_lines(facts: Mapping[str, Any]) -> Iterator[str]:
    if "deviations" in facts:
        yield from (*_imperfect_lines(facts), "")
    keys = ("servo_stiffness_n_mm", "servo_forces_n", "servo_rotors_kg")
    columns = (output.figures(facts[key]) for key in keys)
    head = ("servo", "stiffness, N/mm", "force at home, N", "rotor, kg")
    yield output.table([head, *zip(JOINTS, *columns, strict=True)], "<>>>")
    yield droop_text(*facts["droop"].values())
    yield f"left out: {', '.join(facts['left_out'])}"


def _imperfect_lines(facts: Mapping[str, Any]) -> Iterator[str]:
    yield from output.assumed_lines(facts["assumed"])
    rows = [
        (row["name"], output.figure(row["deviation"]), f"{row['largest']:g}", row["unit"])
        for row in facts["deviations"]
        if row["largest"] > 0.0
    ]
    if not rows:
        yield "the design states neither errors nor tolerances: only its servos give way"
        return
    rows.insert(0, (f"seed {facts['seed']}", "deviation", "within ±", ""))
    yield from (output.table(rows, "<>><"), "")
    rows = [("tool at home off by", "size", *"xyz", "")]
    for key, vector in facts["tool_error"].items():
        part, unit = key.split("_")
        rows.append((part, output.figure(math.hypot(*vector)), *output.figures(vector), unit))
    yield output.table(rows, "<>>>><")
