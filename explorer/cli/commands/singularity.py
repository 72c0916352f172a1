"""`explorer singularity`: the margins of a pose and the other measures of singularity."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

from explorer.cli.options import DesignOptions, JsonOptions, PoseOptions
from explorer.cli.output import (
    attributes,
    degrees,
    figure,
    figures,
    heading,
    lengths,
    pose_json,
    pose_table,
    table,
)
from explorer.measures.snapshot import Snapshot, evaluate
from explorer.measures.verdict import verdict
from explorer.mechanism.margins import INCIDENCES, TETRAHEDRA, describe_modes
from explorer.mechanism.pose import yaw_pitch_roll_from_rotation
from explorer.singularity.bruhat import describe_stratum, incidences


@dataclass(frozen=True, kw_only=True)
class Singularity(JsonOptions, PoseOptions, DesignOptions):
    """Measure how near a pose is to a singularity, and to which.

    A margin is zero where its tetrahedron is flat; the signs of the three margins name the
    assembly mode. The nearest singular poses minimise the root-mean-square displacement of the
    platform's points b1 to b4.
    """

    def run(self) -> None:
        """Write the margins of the pose and the measures of singularity."""
        design = self.read_design()
        snapshot = evaluate(design, self.pose(design))
        self.write(lambda: _as_json(snapshot), lambda: _as_lines(snapshot))


def _as_json(snapshot: Snapshot) -> dict[str, object]:
    names = "margins volumes determinant inverse_condition stratum stratum_dimension mode signs"
    return {
        **attributes(snapshot, f"{names} proximity"),
        "incidences": incidences(snapshot.stratum),
        "nearest": [
            {
                **attributes(nearest, "incidence distance"),
                **pose_json(nearest.pose),
            }
            for nearest in snapshot.nearest
        ],
    }


def _as_lines(snapshot: Snapshot) -> Iterator[str]:
    design = snapshot.design
    yield from (heading(design), pose_table(design, snapshot.pose), "")
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


def _measures(snapshot: Snapshot) -> str:
    numbers = " ".join(map(str, snapshot.stratum))
    stratum = f"{numbers}, dimension {snapshot.stratum_dimension}"
    names = [INCIDENCES[index - 1] for index in incidences(snapshot.stratum)]
    here = verdict(snapshot)
    condition = figure(snapshot.inverse_condition, 1.0)
    rows = [
        ("verdict", f"{here.title.lower()}: {here.reason(snapshot.design.unit_mm)}"),
        ("singular", " and ".join(names) or "no"),
        ("assembly mode", f"{describe_modes(snapshot.bordering_modes)} ({snapshot.sign_words})"),
        ("stratum", f"{stratum}: {describe_stratum(snapshot.stratum)}"),
        ("det J", figure(snapshot.determinant, snapshot.determinant_size)),
        ("inverse condition", f"{condition} (0 singular, 1 best)"),
        ("proximity", f"{figure(snapshot.proximity, 1.0)} (least |δ| over the reach)"),
    ]
    return table(rows, "<<")
