"""`explorer singularity`: the margins of a pose and the other measures of singularity."""

from __future__ import annotations

from dataclasses import dataclass

from explorer.cli.options import DesignOptions, JsonOptions, PoseOptions
from explorer.cli.output import (
    degrees,
    figure,
    figures,
    heading,
    pose_table,
    table,
    write_json,
    write_lines,
)
from explorer.measures.snapshot import Snapshot, evaluate
from explorer.measures.verdict import verdict
from explorer.mechanism.margins import INCIDENCES, TETRAHEDRA, describe_modes
from explorer.mechanism.pose import yaw_pitch_roll_from_rotation
from explorer.singularity.bruhat import describe_stratum, incidences
from explorer.singularity.colours import WARN_SHARE


@dataclass(frozen=True, kw_only=True)
class Singularity(JsonOptions, PoseOptions, DesignOptions):
    """Measure how near a pose is to a singularity, and to which.

    A margin is zero where its tetrahedron is flat; the signs of the three margins name the
    assembly mode. The nearest singular poses minimise the root-mean-square displacement of the
    platform's points b1 to b4.
    """

    def run(self) -> None:
        """Write the margins of the pose and the measures of singularity.

        Raises:
            InputError: a design or pose that cannot be used.
        """
        design = self.load()
        snapshot = evaluate(design, self.pose(design))
        if self.json:
            write_json(
                {
                    "margins": snapshot.margins.tolist(),
                    "volumes": snapshot.volumes.tolist(),
                    "determinant": snapshot.determinant,
                    "inverse_condition": snapshot.inverse_condition,
                    "stratum": list(snapshot.stratum),
                    "stratum_dimension": snapshot.stratum_dimension,
                    "mode": snapshot.mode,
                    "signs": list(snapshot.signs),
                    "proximity": snapshot.proximity,
                    "incidences": list(incidences(snapshot.stratum)),
                    "nearest": [
                        {
                            "incidence": each.incidence,
                            "distance": each.distance,
                            "position": list(each.pose.position),
                            "quaternion": list(each.pose.quaternion),
                        }
                        for each in snapshot.nearest
                    ],
                }
            )
        else:
            write_lines(
                heading(design),
                pose_table(design, snapshot.pose),
                "",
                _margin_table(snapshot),
                "",
                _measures(snapshot),
                "",
                _nearest_table(snapshot),
            )


def _margin_table(snapshot: Snapshot) -> str:
    rows = [("margin", "units", "mm", "zero when", "tetrahedron", "volume")]
    for index in range(3):
        margin, reach = float(snapshot.margins[index]), snapshot.design.reach
        unit = snapshot.design.unit_mm
        rows.append(
            (
                f"δ{index + 1}",
                figure(margin, reach),
                figure(margin * unit, reach * unit),
                INCIDENCES[index],
                " ".join(TETRAHEDRA[index]),
                figure(float(snapshot.volumes[index]), float(snapshot.volume_sizes[index])),
            )
        )
    return table(rows, "<>><<>")


def _measures(snapshot: Snapshot) -> str:
    stratum = " ".join(map(str, snapshot.stratum))
    names = [INCIDENCES[index - 1] for index in incidences(snapshot.stratum)]
    found = verdict(snapshot, WARN_SHARE * snapshot.design.reach)
    away = f"{figure(found.distance * snapshot.design.unit_mm)} mm"
    return table(
        [
            ("verdict", f"{found.title.lower()}: {found.reason(away)}"),
            ("singular", " and ".join(names) or "no"),
            (
                "assembly mode",
                f"{describe_modes(snapshot.bordering_modes)} ({snapshot.sign_words})",
            ),
            (
                "stratum",
                (
                    f"{stratum}, dimension {snapshot.stratum_dimension}: "
                    f"{describe_stratum(snapshot.stratum)}"
                ),
            ),
            ("det J", figure(snapshot.determinant, snapshot.determinant_size)),
            (
                "inverse condition",
                f"{figure(snapshot.inverse_condition, 1.0)} (0 singular, 1 best)",
            ),
            ("proximity", f"{figure(snapshot.proximity, 1.0)} (least |δ| over the reach)"),
        ],
        "<<",
    )


def _nearest_table(snapshot: Snapshot) -> str:
    rows = [("nearest with", "units", "mm", "at x", "y", "z", "yaw", "pitch", "roll")]
    for each in snapshot.nearest:
        x, y, z = figures(each.pose.position)
        angles = yaw_pitch_roll_from_rotation(each.pose.rotation).tolist()
        yaw, pitch, roll = degrees(angles)
        distance = (figure(each.distance), figure(each.distance * snapshot.design.unit_mm))
        rows.append((f"δ{each.incidence} = 0", *distance, x, y, z, yaw, pitch, roll))
    return table(rows, "<>>>>>>>>")
