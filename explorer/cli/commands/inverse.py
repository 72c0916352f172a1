"""`explorer inverse`: the joints of a pose, and the limits that they violate."""

from __future__ import annotations

from dataclasses import dataclass

from explorer.cli.options import DesignOptions, JsonOptions, PoseOptions
from explorer.cli.output import figure, heading, pose_table, table, write_json, write_lines
from explorer.measures.snapshot import Snapshot, evaluate
from explorer.mechanism.design import JOINTS, LENGTHS


@dataclass(frozen=True, kw_only=True)
class Inverse(JsonOptions, PoseOptions, DesignOptions):
    """Compute the joints of a pose.

    Their order is l1 d1 d2 d3 d4 l4. The violated limits of the design are listed.
    """

    def run(self) -> None:
        """Write the joints of the pose.

        Raises:
            InputError: a design or pose that cannot be used.
        """
        design = self.load()
        snapshot = evaluate(design, self.pose(design))
        if self.json:
            write_json(
                {
                    "joints": snapshot.joints.tolist(),
                    "within_limits": not snapshot.violations,
                    "violations": [str(violation) for violation in snapshot.violations],
                }
            )
        else:
            write_lines(
                heading(design),
                pose_table(design, snapshot.pose),
                "",
                _joint_table(snapshot),
                "",
                *_verdict(snapshot),
            )


def _joint_table(snapshot: Snapshot) -> str:
    design = snapshot.design
    rows = [("joint", "units", "mm", "limits")]
    for name, value in zip(JOINTS, snapshot.joints.tolist(), strict=True):
        bounds = design.length_range(name) if name in LENGTHS else design.limits.guide
        allowed = f"{bounds[0]:.6g} to {bounds[1]:.6g}" if bounds else "none"
        unit, reach = design.unit_mm, design.reach
        rows.append((name, figure(value, reach), figure(value * unit, reach * unit), allowed))
    return table(rows, "<>><")


def _verdict(snapshot: Snapshot) -> list[str]:
    if not snapshot.violations:
        return ["within the limits"]
    return ["outside the limits:", *(f"  {violation}" for violation in snapshot.violations)]
