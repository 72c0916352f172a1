"""`explorer inverse`: the joints of a pose, and the limits that they violate."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

from explorer.cli import output
from explorer.cli.options import DesignOptions, JsonOptions, PoseOptions
from explorer.measures.snapshot import Snapshot, evaluate
from explorer.mechanism.design import JOINTS
from explorer.mechanism.pose import Triple
from explorer.workspace.limits.table import joint_ranges


@dataclass(frozen=True, kw_only=True)
class Inverse(JsonOptions, PoseOptions, DesignOptions):
    """Compute the joints of a pose.

    Their order is l1 d1 d2 d3 d4 l4. The violated limits of the design are listed.
    """

    def run(self) -> None:
        """Write the joints of the pose."""
        design = self.read_design()
        snapshot, tool = evaluate(design, self.pose(design)), self.tool(design)
        self.write(lambda: _as_json(snapshot, tool), lambda: _lines(snapshot, tool))


def _as_json(snapshot: Snapshot, tool: Triple | None) -> dict[str, object]:
    folds = output.folds_in_degrees(snapshot.pose.position, snapshot.rotation)
    answer = {"joints": snapshot.joints, "folds": folds, **output.limits_json(snapshot)}
    return answer if tool is None else {**answer, **output.pose_json(snapshot.pose, tool)}


def _lines(snapshot: Snapshot, tool: Triple | None) -> Iterator[str]:
    design, ranges = snapshot.design, joint_ranges(snapshot.design)
    rows = [("joint", "units", "mm", "limits")]
    for name, value in zip(JOINTS, snapshot.joints.tolist(), strict=True):
        bounds = ranges.get(name)
        allowed = f"{bounds[0]:.6g} to {bounds[1]:.6g}" if bounds else "none"
        rows.append((name, *output.lengths(design, value, design.reach), allowed))
    pose = output.pose_table(design, snapshot.pose, tool)
    yield from (output.heading(design), pose, "", output.table(rows, "<>><"), "")
    yield from output.limits_lines(snapshot)
