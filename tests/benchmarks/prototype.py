"""The prototype: its parts, their places, its files; beside making the parts anew."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

from benchmarks.samples import DESIGN
from benchmarks.table import NOTHING, Row, per_second, seconds, times
from benchmarks.timing import best_of
from explorer import home_pose, workspace_solid, workspace_volume
from explorer.export.assembly import FORMATS, assembly_bytes
from explorer.export.simulation import simulation_mjcf
from explorer.export.step import exact_workspace, workspace_step
from explorer.prototype.assembly import make_prototype

ROUNDS, POSES = 5, 200


def run() -> Iterator[Row]:
    """Yield the rows."""
    prototype = make_prototype(DESIGN)
    home = home_pose(DESIGN)
    made = best_of(ROUNDS, lambda: make_prototype(DESIGN))
    triangles = sum(len(part.faces) for part in prototype.parts)
    yield Row(
        f"all {len(prototype.parts)} parts of the prototype, {triangles} triangles",
        seconds(made),
        "300 ms",
    )
    places = best_of(
        ROUNDS,
        lambda: [prototype.places(home.position, home.rotation) for _ in range(POSES)],
    )
    yield Row(
        "places of all parts in a pose",
        seconds(places / POSES),
        "1 ms",
        f"making the parts anew: {seconds(made)}; {times(made * POSES / places)}",
    )
    for file_format in FORMATS:
        duration = best_of(ROUNDS, lambda name=file_format: assembly_bytes(prototype, name))
        size = len(assembly_bytes(prototype, file_format))
        target = "2 MB" if file_format == "3mf" else NOTHING
        yield Row(
            f"assembly of the parts as {file_format}",
            f"{seconds(duration)}, {size / 1000:.0f} kB",
            target,
        )
    step = best_of(ROUNDS, lambda: workspace_step(DESIGN))
    error = (
        exact_workspace(DESIGN).volume / DESIGN.unit_mm**3 / workspace_volume(DESIGN).volume - 1.0
    )
    size, faces = len(workspace_step(DESIGN)), len(workspace_solid(DESIGN).faces)
    yield Row(
        "the workspace as STEP with exact faces",
        f"{seconds(step)}, {size / 1000:.0f} kB, volume off {abs(error):.0e}",
        "1 s",
        f"the mesh has {faces} faces",
    )
    model = best_of(ROUNDS, lambda: simulation_mjcf(DESIGN))
    yield Row("model for simulation (MJCF)", seconds(model))
    yield Row("steps of MuJoCo with that model", per_second(_steps_per_second()))


def _steps_per_second() -> float:
    import mujoco  # pyright: ignore[reportMissingTypeStubs]

    engine: Any = mujoco
    model = engine.MjModel.from_xml_string(simulation_mjcf(DESIGN))
    data = engine.MjData(model)
    engine.mj_resetDataKeyframe(model, data, 0)
    many = 2000
    return many / best_of(ROUNDS, lambda: engine.mj_step(model, data, nstep=many))
