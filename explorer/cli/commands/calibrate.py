"""`explorer calibrate`: the machine that was built, and the poses in which to measure it."""

from __future__ import annotations

import json
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Literal

import numpy as np
import tyro

from explorer.calibration.identify import Calibration, calibrate
from explorer.calibration.machine_file import encode_machine
from explorer.calibration.measurement import Kind, Measurement, setup_of
from explorer.calibration.poses import MOST_POSES, calibration_poses
from explorer.calibration.words import calibration_blocks
from explorer.cli import options, output, values
from explorer.errors import InputError, NoAnswerError
from explorer.export import pose_tables
from explorer.export.measured_tables import joints_table, kind_of, read_measured
from explorer.files.writing import write_whole
from explorer.mechanism.design import Design

What = Literal["machine", "poses"]
_MEASURED, _POSES = values.hint("to identify a machine", "FILE.csv"), values.hint("with poses")


@dataclass(frozen=True, kw_only=True)
class CalibrateCommand(options.JsonOptions, options.TypicalOptions, options.DesignOptions):
    """Identify the machine that was built, or choose the poses in which to measure it.

    `explorer calibrate poses` writes the joints of poses. Send the machine there, add the columns
    of what you measure, and give that table with `--measured`: bar_mm (distance of a point
    of the platform from a ball of the base), gauge_mm (from planes, in turn), t1_x_mm to t3_z_mm
    (targets of a tracker), or else x_mm, y_mm, z_mm, qw, qx, qy, qz of the platform itself; and
    sigma_mm if lines differ. The machine's file is for `--machine` of other commands. The exit
    status is 1 if poses are too few, if the sum of squares is too large, or if nothing is gained;
    then, as the design is as good, no file is written.
    """

    what: Annotated[What, tyro.conf.Positional, tyro.conf.arg(metavar="[WHAT]")] = "machine"
    """Answer: machine, or poses in which to measure it."""

    out: Path
    """File to write: the machine (JSON), or the poses (CSV)."""

    measured: Annotated[Path | None, _MEASURED] = None
    """Table of the joints that the encoders read, and of what was measured there."""

    measure: Annotated[Kind, _POSES] = "poses"
    """What will be measured."""

    count: Annotated[int, values.whole_number(1, MOST_POSES), _POSES] = 12
    """Number of poses."""

    targets: Annotated[Path | None, values.FILE] = None
    """Table of up to three measured points of the platform, with the columns x, y and z; of bar and
    gauge the tool by default."""

    known: values.Flag = False
    """Take the targets to be exactly there, rather than about there."""

    other_frame: values.Flag = False
    """Take poses or targets to be in a frame of their own, rather than in the base's."""

    ball: Annotated[values.Position, values.hint("bar")] = None
    """About where the ball of the base is, in design units."""

    planes: Annotated[values.Planes, values.hint("gauge; default: 0 0 1 0")] = None
    """About where the planes are, in the base frame: normals, and distances in design units."""

    sigma: Annotated[float, values.POSITIVE] = 0.01
    """Standard deviation of measured lengths, in millimetres."""

    sigma_deg: Annotated[float, values.POSITIVE] = 0.005
    """Standard deviation of measured turns, in degrees."""

    def run(self) -> None:
        """Write the machine or the poses."""
        options.check_out(self.out, self.measured)
        nominal = self.read_design()
        design, assumed = self.with_typical(nominal)
        if (self.measured is None) != (self.what == "poses"):
            raise InputError("give either --measured FILE.csv, or the word poses")
        if self.measured is None:
            setup = self._setup(design, self.measure)
            poses = calibration_poses(design, self.count, setup)
            write_whole(self.out, joints_table(poses, setup).encode())
            lines = [*output.assumed_lines(assumed), f"poses written to {self.out}: {self.count}"]
            self.write(lambda: {"file": self.out, "count": self.count, "assumed": assumed}, lines)
            return
        table = pose_tables.read_table(self.measured, design.unit_mm)
        found = calibrate(
            design, *read_measured(table, design, self._setup(design, kind_of(table)))
        )
        data = encode_machine(found.machine, found.unseen)
        if found.gains:
            write_whole(self.out, data)
        self.write(
            lambda: {
                "file": self.out if found.gains else None,
                "assumed": assumed,
                "machine": json.loads(data),
                **_json(found),
            },
            self._lines(nominal, assumed, found),
            [NoAnswerError(fault) for fault in found.faults],
        )

    def _setup(self, design: Design, kind: Kind) -> Measurement:
        """Return the setup of a kind of measurement, without values."""
        points = None
        if self.targets is not None:
            points = pose_tables.read_table(self.targets, design.unit_mm).numbers(*"xyz")
        base = None if self.planes is None else np.reshape(self.planes, (-1, 4))
        base = self.ball if kind == "bar" else base
        return setup_of(
            design,
            kind,
            points,
            self.sigma,
            self.sigma_deg,
            base,
            points_known=self.known,
            in_base=not self.other_frame,
        )

    def _lines(self, design: Design, assumed: tuple[str, ...], found: Calibration) -> Iterator[str]:
        yield from (output.heading(design), *output.assumed_lines(assumed))
        yield from output.block_lines(calibration_blocks(found))
        if found.gains:
            yield from ("", f"written to {self.out}")


def _json(found: Calibration) -> dict[str, object]:
    """Return the numbers of a calibration as plain values; poses count from 1."""
    unit = found.machine.design.unit_mm
    return {
        **output.attributes(found, "seen unseen chi_square"),
        "degrees": found.degrees_of_freedom,
        "outliers": 1 + found.outliers,
        "tool_before_mm": unit * found.tool_before,
        "tool_after_mm": unit * (found.tool_after if found.gains else found.tool_before),
        "beyond": found.beyond,
        "held_out_mm": unit * found.by_machine.distance,
        "held_out_by_design_mm": unit * found.by_design.distance,
        "faults": found.faults,
    }
