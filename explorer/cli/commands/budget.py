"""`explorer budget`: what tolerances cost in precision, and which ones keep a wanted precision."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from itertools import chain
from pathlib import Path
from typing import Annotated

from explorer.cli import output, values
from explorer.cli.blocks import lines
from explorer.cli.options import JsonOptions, PoseOptions, TypicalOptions, write_files
from explorer.errors import InputError
from explorer.files.writing import check_writable
from explorer.measures.blocks import precision as blocks
from explorer.measures.box import PositionSet, positions_over
from explorer.mechanism.configuration import Configuration
from explorer.mechanism.design import Design
from explorer.mechanism.design_file import encode_design
from explorer.mechanism.pose import Triple
from explorer.statics import budget
from explorer.statics.accuracy import SOURCES, stated_tolerances
from explorer.statics.budget import PARTS, SourceCosts, ToleranceBudget

WORDS = {"box": "nodes of a grid over the box", "workspace": "nodes of a grid in the workspace"}


@dataclass(frozen=True, kw_only=True)
class Budget(JsonOptions, TypicalOptions, PoseOptions):
    """Rank what tolerances cost in precision; find those of a wanted precision.

    The sources of errors are the six actuators and the 23 dimensions. The worst error is exact for
    the linear model, over all combinations of signs, at the worst of the positions; the RMS error
    is that of independent errors, each uniform within its bounds. The tolerances that are found
    have the least sum of their reciprocals.
    """

    over: Annotated[
        PositionSet | None, values.hint("default: box with --required-box, otherwise pose")
    ] = None
    """Positions, at one orientation: that of the pose, nodes of a grid over a box, or nodes of a
    grid within the limits."""

    required_box: Annotated[values.Box, values.hint("default: the box of the design")] = None
    """Box of positions of b4 for `--over box`, in design units."""

    wanted: Annotated[values.Positive, values.OPTIONAL] = None
    """Largest displacement of the tool that is wanted, in mm; tolerances that keep it are found."""

    wanted_turn: Annotated[values.Positive, values.hint("default: any")] = None
    """Largest turn of the tool that is wanted besides, in degrees."""

    keep_actuators: values.Flag = False
    """Keep the errors of the actuators as the design states them."""

    out: Annotated[Path | None, values.FILE] = None
    """File for the design with the tolerances that are found."""

    def run(self) -> None:
        """Write the costs of the tolerances, and the tolerances that are found."""
        over, box = self._positions()
        if self.wanted is None and (self.wanted_turn or self.keep_actuators or self.out):
            raise InputError(
                "--wanted-turn, --keep-actuators and --out need a displacement with --wanted"
            )
        if self.out is not None:
            check_writable(self.out)
        design, assumed = self.with_typical(self.read_design())
        pose, tool = self.pose(design), self.tool(design)
        positions = positions_over(design, over, pose, box or design.limits.box)
        at, found = Configuration(design, positions, pose.rotation, tool), None
        if self.wanted is not None:
            found = budget.tolerance_budget(
                at, self.wanted, self.wanted_turn, keep_actuators=self.keep_actuators
            )
        costs = budget.source_costs(at) if found is None else found.costs
        files: dict[Path, bytes] = {}
        if found is not None and self.out is not None:
            files[self.out] = encode_design(budget.with_tolerances(design, found.tolerances))
        written, errors = write_files(files)
        table = [output.pose_table(design, pose, tool)] if over == "pose" else []
        self.write(
            lambda: {
                "over": over,
                "assumed": assumed,
                **_as_json(costs, found),
                "stated": stated_tolerances(design),
                "out": next(iter(written), None),
            },
            chain(
                [output.heading(design), *output.assumed_lines(assumed), *table],
                self._as_lines(design, over, costs, found),
                ("", str(written[0])) if written else (),
            ),
            errors,
        )

    def _positions(self) -> tuple[PositionSet, tuple[Triple, Triple] | None]:
        """Return the kind of the positions, and the given box."""
        given = self.required_box
        over = self.over or ("pose" if given is None else "box")
        if over != "box" and given is not None:
            raise InputError(f"--required-box needs --over box; got --over {over}")
        for option, value in (("--position", self.position), ("--folds", self.folds)):
            if over != "pose" and value is not None:
                raise InputError(f"{option} is one position; leave out --over {over}")
        if given is None:
            return over, None
        lows, highs = given[:3], given[3:]
        if any(low > high for low, high in zip(lows, highs, strict=True)):
            raise InputError("--required-box takes three lows, then highs above them")
        return over, (lows, highs)

    def _as_lines(
        self, design: Design, over: PositionSet, costs: SourceCosts, found: ToleranceBudget | None
    ) -> Iterator[str]:
        if over != "pose":
            yield f"worst over {costs.count:,} {WORDS[over]}, at one orientation"
        if over == "workspace" and not design.limits.margin:
            yield "the limits demand no margin: nearer to singular poses errors are larger"
        yield from lines(blocks.tolerance_budget(costs, found, self.wanted, self.wanted_turn))


def _as_json(costs: SourceCosts, found: ToleranceBudget | None) -> dict[str, object]:
    names = "count position turn displacement displacement_within turn_within shares turn_shares"
    totals = "worst_displacement worst_turn rms_displacement rms_turn"
    return {
        "sources": SOURCES,
        "parts": PARTS,
        "ranking": [SOURCES[k] for k in costs.ranking.tolist()],
        **output.attributes(costs, f"{names} {totals}"),
        "tolerances": found and [*map(output.finite, found.tolerances.tolist())],
        "effort": found and found.effort,
        "least_effort": found and found.least_effort,
    }
