"""`explorer forces`, `accuracy` and `budget`: what loads, errors and tolerances do in a pose."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from itertools import chain
from pathlib import Path
from typing import Annotated

import numpy as np

from explorer.cli import options, output, values
from explorer.cli.output import block_lines
from explorer.errors import InputError, NoAnswerError
from explorer.files.writing import check_writable
from explorer.measures.blocks import forces as blocks, precision
from explorer.measures.box import PositionSet, positions_over
from explorer.mechanism.configuration import Configuration
from explorer.mechanism.design import JOINTS, Design
from explorer.mechanism.design_file import encode_design
from explorer.mechanism.machine import DIMENSIONS, STRUTS, Six
from explorer.mechanism.margins import INCIDENCES, SINGULAR, margins
from explorer.mechanism.pose import Pose, Triple
from explorer.motion.inverse_jacobian import twists_of_actuators
from explorer.motion.masses import bar_masses, moving_bodies
from explorer.motion.weights import MovingBodies
from explorer.prototype.assembly import make_prototype
from explorer.statics import accuracy, budget as budgets, forces, loaded
from explorer.statics.reactions import LIMITED
from explorer.workspace.nearest_carrying import nearest_carrying_pose

B4: Triple = (0.0, 0.0, 0.0)


@dataclass(frozen=True, kw_only=True)
class LoadOptions(options.JsonOptions, options.PoseOptions):
    """The options for a load on the platform in a pose."""

    load: Annotated[Six, values.LOAD, values.hint("default: none")] = (*B4, *B4)
    """Force in N and moment in N × unit on the platform, along the axes of the base."""

    payload: Annotated[values.NotNegative, values.OF_DESIGN] = None
    """Mass of the payload, in kg; its weight is added to the load."""

    def read_loaded_design(self) -> Design:
        """Return the design with the given mass of the payload."""
        return options.with_payload(self.read_design(), self.payload)


def singular_error(pose: Pose, words: str) -> NoAnswerError:
    """Return the error of a singular pose, given words on what that means."""
    least = SINGULAR * float(np.linalg.norm(pose.position))
    margin = np.abs(margins(pose.position, pose.rotation))
    zero = [f"δ{k + 1} = 0: {INCIDENCES[k]}" for k in np.flatnonzero(margin <= least)]
    named = "; ".join(zero) or "a margin vanishes to rounding"
    return NoAnswerError(f"the pose is singular ({named}): {words}")


@dataclass(frozen=True, kw_only=True)
class ForcesCommand(LoadOptions):
    """Compute the forces of actuators and struts under a load, and their limits.

    Positive forces push a joint's value up. Legs 2 and 3 carry a force along the guide too, which
    bends their struts. Limits, payload and gravity are those of the design; without limits there
    is no largest force.
    """

    most: Annotated[values.OfActuators, values.OF_DESIGN] = None
    """Largest forces of the actuators in N for the largest force in every direction, or one for
    all."""

    force: Annotated[values.Positive, values.hint("default: none")] = None
    """Size of an added force in N, of which the worst direction is told."""

    density: Annotated[values.Positive, values.hint("default: no weight")] = None
    """Density of the legs and the platform in kg/m³, as bars with the legs' radii."""

    parts: bool = False
    """Whether the parts of the prototype have this density, in place of bars."""

    def run(self) -> None:
        """Write the forces, the bending and the shares of the limits."""
        if self.parts and self.density is None:
            raise InputError("--parts needs the density of the parts: add --density KG_PER_M3")
        design = self.read_loaded_design()
        pose, tool = self.pose(design), self.tool(design)
        weights = self._own_weights(design)
        found = loaded.LoadedPose(design, pose, self.load, weights, point=tool or B4)
        if not np.isfinite(twists_of_actuators(found)).all():
            raise singular_error(pose, f"the {blocks.in_singular_pose(found)}")
        most = np.minimum(*design.actuators.limits) if self.most is None else self.most
        nearest = nearest_carrying_pose(found) if found.share > 1.0 else None
        worst = forces.worst_direction(found, most)
        added = None if self.force is None else found.worst_force(self.force)
        self.write(
            lambda: {
                **_forces_json(found, worst, added),
                "nearest_held": None if nearest is None else output.pose_json(nearest, tool),
            },
            _force_lines(found, worst, added, nearest, tool),
        )

    def _own_weights(self, design: Design) -> MovingBodies:
        """Return the weights of legs and platform."""
        if self.density is None:
            return MovingBodies()
        by_parts = self.parts and make_prototype(design).masses(self.density)
        masses = by_parts or bar_masses(design, self.density)
        return moving_bodies(design, masses, payload=False)


def _forces_json(
    found: loaded.LoadedPose, worst: forces.WorstDirection, added: loaded.WorstForce | None
) -> dict[str, object]:
    reactions, by_unit = found.reactions, found.unit_force.utilisation
    share = float(worst.utilisation)
    is_limiting = added is not None and added.utilisation > 0.0
    return {
        "actuator_forces": reactions.actuators,
        "strut_bending": reactions.bending,
        "largest_force": 1.0 / share if share else None,
        "worst_direction": worst.direction if share else None,
        "worst_actuator": JOINTS[int(worst.actuator)] if share else None,
        "joint_forces": reactions.joints,
        "guide_force": reactions.guide_force,
        "guide_moment": reactions.guide_moment,
        # What the payload's force of any direction may add either way.
        "process": dict(zip(LIMITED, reactions.spread.tolist(), strict=True)),
        "shares": dict(zip(LIMITED, found.shares.tolist(), strict=True)),
        "largest_payload": found.largest_payload,
        "largest_force_by_all_parts": 1.0 / by_unit if by_unit else None,
        "worst_force": added
        and {
            "direction": added.direction if is_limiting else None,
            "part": LIMITED[added.part] if is_limiting else None,
            "share": added.utilisation,
        },
    }


def _force_lines(
    found: loaded.LoadedPose,
    worst: forces.WorstDirection,
    added: loaded.WorstForce | None,
    nearest: Pose | None,
    tool: Triple | None,
) -> Iterator[str]:
    yield from (output.heading(found.design), output.pose_table(found.design, found.pose, tool))
    yield f"load acts at          {'b4' if tool is None else 'the tool'}"
    facts = blocks.largest_loads(found)
    if added is not None:
        facts = facts.add(*blocks.worst_force(added, "the added force"))
    refused = (blocks.nearest_carrying(found, nearest, tool),) if found.share > 1.0 else ()
    yield from block_lines((blocks.verdict(found), *refused, *blocks.reaction_tables(found)))
    yield from block_lines((blocks.most_of_actuators(worst), facts))


@dataclass(frozen=True, kw_only=True)
class AccuracyCommand(options.TypicalOptions, LoadOptions):
    """Compute the errors and the deflection of the tool in a pose.

    Errors, stiffness, struts and tolerances are those of the design; a design without them is
    exact and rigid. The model is linear, without preload, and joints, carriages, guide, platform
    and base are rigid. Play and straightness of the guide are no errors of it. RMS errors are those
    of independent errors, each uniform within its bounds.
    """

    errors: Annotated[values.OfActuators, values.OF_DESIGN] = None
    """Largest errors of the actuators in mm, or one for all."""

    stiffness: Annotated[values.OfActuators, values.OF_DESIGN] = None
    """Stiffness of the actuators in N/mm, or one for all."""

    def run(self) -> None:
        """Write the errors, the compliance and the deflection."""
        design = self.read_loaded_design()
        given = {"error_mm": self.errors, "stiffness_n_mm": self.stiffness}
        actuators = options.replace_given(design.actuators, **given)
        design = options.replace_given(design, actuators=actuators)
        design, assumed = self.with_typical(design)
        pose, tool = self.pose(design), self.tool(design)
        found = loaded.ToolPrecision(loaded.LoadedPose(design, pose, self.load, point=tool or B4))
        if not np.isfinite(found.by_source).all():
            raise singular_error(pose, "errors and compliance are infinite")
        self.write(
            lambda: {**_accuracy_json(found), "assumed": assumed},
            chain(
                [output.heading(design)],
                output.assumed_lines(assumed),
                [output.pose_table(design, pose, tool)],
                block_lines(precision.tool_errors(found, listed=None)),
                block_lines(precision.deflections(found, "the load and the payload's weight")),
            ),
        )


def _accuracy_json(found: loaded.ToolPrecision) -> dict[str, object]:
    principal, alone = found.principal, found.alone
    totals: dict[str, float] = {}
    for group, sources in loaded.GROUPS.items():
        suffix = "" if group == "actuators" else f"_of_{group}"
        for kind, error in (("worst", found.worst(sources)), ("rms", found.rms(sources))):
            totals[f"{kind}_displacement{suffix}"] = float(error.displacement)
            totals[f"{kind}_turn{suffix}"] = float(error.turn)
    names = "displacement force_directions turn moment_directions"
    return {
        "compliance": found.compliance,
        "deflection": found.deflection,
        "deflection_shares": found.shares._asdict(),
        "principal_compliances": output.attributes(principal, names),
        **totals,
        "displacement_by_actuator": alone.displacement[loaded.BY_ACTUATORS],
        "turn_by_actuator": alone.turn[loaded.BY_ACTUATORS],
        "dimensions": list(DIMENSIONS[: STRUTS.start]),
        "pose_error_by_geometry": accuracy.error_by_geometry(found.loaded)[:, : STRUTS.start],
        "displacement_by_geometry": alone.displacement[loaded.BY_DIMENSIONS][: STRUTS.start],
        "turn_by_geometry": alone.turn[loaded.BY_DIMENSIONS][: STRUTS.start],
        "displacement_by_square": alone.displacement[loaded.BY_DIMENSIONS][STRUTS],
        "turn_by_square": alone.turn[loaded.BY_DIMENSIONS][STRUTS],
    }


WORDS = {"box": "nodes of a grid over the box", "workspace": "nodes of a grid in the workspace"}


@dataclass(frozen=True, kw_only=True)
class BudgetCommand(options.JsonOptions, options.TypicalOptions, options.PoseOptions):
    """Rank what tolerances cost in precision; find those of a wanted precision.

    The sources of errors are the six actuators and the 25 dimensions. The worst error is exact for
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
            found = budgets.tolerance_budget(
                at, self.wanted, self.wanted_turn, keep_actuators=self.keep_actuators
            )
        costs = budgets.source_costs(at) if found is None else found.costs
        files: dict[Path, bytes] = {}
        if found is not None and self.out is not None:
            files[self.out] = encode_design(budgets.with_tolerances(design, found.tolerances))
        written, errors = options.write_files(files)
        head = [output.heading(design), *output.assumed_lines(assumed)]
        if over == "pose":
            head.append(output.pose_table(design, pose, tool))
        else:
            head.append(f"worst over {costs.count:,} {WORDS[over]}, at one orientation")
        if over == "workspace" and not design.limits.margin:
            head.append("the limits demand no margin: nearer to singular poses errors are larger")
        self.write(
            lambda: {
                "over": over,
                "assumed": assumed,
                **_budget_json(costs, found),
                "stated": accuracy.stated_tolerances(design),
                "out": next(iter(written), None),
            },
            chain(
                head,
                block_lines(
                    precision.tolerance_budget(costs, found, self.wanted, self.wanted_turn)
                ),
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


def _budget_json(
    costs: budgets.SourceCosts, found: budgets.ToleranceBudget | None
) -> dict[str, object]:
    names = "count position turn displacement displacement_within turn_within shares turn_shares"
    totals = "worst_displacement worst_turn rms_displacement rms_turn"
    return {
        "sources": accuracy.SOURCES,
        "parts": budgets.PARTS,
        "ranking": [accuracy.SOURCES[k] for k in costs.ranking.tolist()],
        **output.attributes(costs, f"{names} {totals}"),
        "tolerances": found and found.tolerances,
        "effort": found and found.effort,
        "least_effort": found and found.least_effort,
    }
