"""`explorer singularity`: the margins of a pose and the other measures of singularity."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

from explorer.cli import output
from explorer.cli.blocks import lines
from explorer.cli.options import DesignOptions, JsonOptions, PoseOptions
from explorer.measures.blocks.block import Statement
from explorer.measures.blocks.singularity import (
    conditioning,
    ellipsoids,
    freedoms,
    margin_table,
    nearest_poses,
    tetrahedra,
    tool_condition,
)
from explorer.measures.snapshot import Snapshot, evaluate
from explorer.measures.verdict import verdict
from explorer.mechanism.pose import Triple
from explorer.singularity.ellipsoids import inverse_condition, jacobian, performance
from explorer.singularity.strata import incidences


@dataclass(frozen=True, kw_only=True)
class Singularity(JsonOptions, PoseOptions, DesignOptions):
    """Measure how near a pose is to a singularity, and to which.

    A margin is zero where its tetrahedron is flat; δ1 and δ3 are distances, δ2 is a distance times
    a sine. The signs of the three margins name the assembly mode. The nearest singular poses
    minimise the root-mean-square displacement of the platform's points b1 to b4, Nawratil's metric.
    With `--at tool` the ellipsoids of speeds and forces at the tool
    follow; the singular poses themselves do not depend on the tool.
    """

    def run(self) -> None:
        """Write the margins of the pose and the measures of singularity."""
        design = self.read_design()
        snapshot, tool = evaluate(design, self.pose(design)), self.tool(design)
        self.write(lambda: _as_json(snapshot, tool), lambda: _as_lines(snapshot, tool))


def _as_json(snapshot: Snapshot, tool: Triple | None) -> dict[str, object]:
    indices = "inverse_condition smallest_singular_value manipulability transmissions"
    names = f"margins volumes determinant {indices} transmission_index proximity"
    return {
        **output.attributes(snapshot, f"{names} stratum stratum_dimension mode signs"),
        "folds": output.folds_in_degrees(snapshot.pose.position, snapshot.rotation),
        "incidences": incidences(snapshot.stratum),
        "nearest": [
            {
                **output.attributes(nearest, "incidence distance"),
                **output.pose_json(nearest.pose, tool),
            }
            for nearest in snapshot.nearest
        ],
        **({} if tool is None else _tool_json(snapshot, tool)),
    }


def _tool_json(snapshot: Snapshot, tool: Triple) -> dict[str, object]:
    """Return the tool's position, and the condition of J and the ellipsoids at the tool."""
    found = performance(snapshot.design, snapshot.pose, tool)
    return {
        **output.tool_json(snapshot.pose, tool),
        "tool_inverse_condition": _condition_at(snapshot, tool),
        "tool_ellipsoids": {
            name: {
                "gain": [output.finite(gain) for gain in ellipsoid.gain.tolist()],
                "axes": ellipsoid.axes.T,
            }
            for name, ellipsoid in (
                ("translation", found.translation),
                ("rotation", found.rotation),
            )
        },
    }


def _condition_at(snapshot: Snapshot, tool: Triple) -> float:
    pose, design = snapshot.pose, snapshot.design
    rates = jacobian(design, pose.position, pose.rotation, tool)
    return float(inverse_condition(rates, design.reach))


def _as_lines(snapshot: Snapshot, tool: Triple | None) -> Iterator[str]:
    design, here = snapshot.design, verdict(snapshot)
    yield from (output.heading(design), output.pose_table(design, snapshot.pose, tool))
    blocks = (
        Statement(here.title, here.reason(design.unit_mm)),
        *freedoms(snapshot),
        margin_table(snapshot),
        tetrahedra(snapshot),
        conditioning(snapshot),
        nearest_poses(snapshot),
    )
    yield from lines(blocks)
    if tool is not None:
        found = performance(design, snapshot.pose, tool)
        yield from lines(ellipsoids(found, "the tool"))
        yield from lines([tool_condition(_condition_at(snapshot, tool))])
