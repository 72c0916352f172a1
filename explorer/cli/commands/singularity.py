"""`explorer singularity`: the margins of a pose and the other measures of singularity."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass

from explorer.cli.options import DesignOptions, JsonOptions, PoseOptions
from explorer.cli.output import (
    attributes,
    degrees,
    figure,
    figures,
    finite,
    folds_in_degrees,
    heading,
    lengths,
    pose_json,
    pose_table,
    table,
    tool_json,
)
from explorer.measures.snapshot import Snapshot, evaluate
from explorer.measures.verdict import verdict
from explorer.mechanism.design import JOINTS
from explorer.mechanism.margins import INCIDENCES, TETRAHEDRA, describe_modes
from explorer.mechanism.pose import Triple, yaw_pitch_roll_from_rotation
from explorer.singularity.bruhat import describe_stratum, incidences
from explorer.singularity.ellipsoids import performance
from explorer.singularity.jacobian import inverse_condition, jacobian


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
        **attributes(snapshot, f"{names} stratum stratum_dimension mode signs"),
        "folds": folds_in_degrees(snapshot.pose.position, snapshot.rotation),
        "incidences": incidences(snapshot.stratum),
        "nearest": [
            {
                **attributes(nearest, "incidence distance"),
                **pose_json(nearest.pose, tool),
            }
            for nearest in snapshot.nearest
        ],
        **({} if tool is None else _tool_json(snapshot, tool)),
    }


def _tool_json(snapshot: Snapshot, tool: Triple) -> dict[str, object]:
    """Return the tool's position, and the condition of J and the ellipsoids at the tool."""
    found = performance(snapshot.design, snapshot.pose, tool)
    return {
        **tool_json(snapshot.pose, tool),
        "tool_inverse_condition": _condition_at(snapshot, tool),
        "tool_ellipsoids": {
            name: {
                "gain": [finite(gain) for gain in ellipsoid.gain.tolist()],
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
    design = snapshot.design
    yield from (heading(design), pose_table(design, snapshot.pose, tool), "")
    rows = [("margin", "units", "mm", "zero when", "tetrahedron", "volume")]
    for index, margin in enumerate(snapshot.margins.tolist()):
        volume = figure(float(snapshot.volumes[index]), float(snapshot.volume_sizes[index]))
        meaning = INCIDENCES[index], " ".join(TETRAHEDRA[index]), volume
        rows.append((f"δ{index + 1}", *lengths(design, margin, design.reach), *meaning))
    yield from (table(rows, "<>><<>"), "", _measures(snapshot), "")
    rows = [("nearest with", "units", "mm", "at x", "y", "z", "yaw", "pitch", "roll")]
    for nearest in snapshot.nearest:
        x, y, z = figures(nearest.pose.position)
        yaw, pitch, roll = degrees(yaw_pitch_roll_from_rotation(nearest.pose.rotation).tolist())
        distance = lengths(design, nearest.distance)
        rows.append((f"δ{nearest.incidence} = 0", *distance, x, y, z, yaw, pitch, roll))
    yield table(rows, "<>>>>>>>>")
    if tool is not None:
        yield from ("", _tool_lines(snapshot, tool))


def _tool_lines(snapshot: Snapshot, tool: Triple) -> str:
    """Return the axes of the ellipsoids at the tool."""
    found = performance(snapshot.design, snapshot.pose, tool)
    rows = [("of the tool per actuator speed", "gain", "x", "y", "z")]
    for name, ellipsoid in (("speed", found.translation), ("turn times reach", found.rotation)):
        for gain, axis in zip(ellipsoid.gain.tolist(), ellipsoid.axes.T.tolist(), strict=True):
            shown = figure(gain) if math.isfinite(gain) else "infinite"
            x, y, z = figures(axis)
            rows.append((name, shown, x, y, z))
    condition = figure(_condition_at(snapshot, tool), 1.0)
    return f"{table(rows, '<>>>>')}\ninverse condition at the tool  {condition}"


def _measures(snapshot: Snapshot) -> str:
    numbers = " ".join(map(str, snapshot.stratum))
    stratum = f"{numbers}, dimension {snapshot.stratum_dimension}"
    names = [INCIDENCES[index - 1] for index in incidences(snapshot.stratum)]
    here = verdict(snapshot)
    condition, least, manipulability, transmission = (
        figure(value, 1.0)
        for value in (
            snapshot.inverse_condition,
            snapshot.smallest_singular_value,
            snapshot.manipulability,
            snapshot.transmission_index,
        )
    )
    worst = JOINTS[snapshot.transmissions.argmin()]
    rows = [
        ("verdict", f"{here.title.lower()}: {here.reason(snapshot.design.unit_mm)}"),
        ("singular", " and ".join(names) or "no"),
        ("assembly mode", f"{describe_modes(snapshot.bordering_modes)} ({snapshot.sign_words})"),
        ("stratum", f"{stratum}: {describe_stratum(snapshot.stratum)}"),
        ("det J", figure(snapshot.determinant, snapshot.determinant_size)),
        ("inverse condition", f"{condition} (0 singular, 1 best)"),
        ("least σ of J", f"{least} (errors and loads grow at most 1/σ times)"),
        ("manipulability", f"{manipulability} (|det J| over the cubed reach)"),
        ("transmission index", f"{transmission}, of {worst} (good above 0.64 to 0.7)"),
        ("proximity", f"{figure(snapshot.proximity, 1.0)} (least |δ| over the reach)"),
    ]
    return table(rows, "<<")
