"""`explorer forces`: what holds a load in a pose, and the shares of the limits that it uses."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace
from typing import Annotated

import numpy as np

from explorer.cli.load_options import LoadOptions, check_regular
from explorer.cli.output import finite, heading, lines, pose_json, pose_table
from explorer.cli.values import hint, numbers, positive
from explorer.errors import InputError
from explorer.measures.blocks.block import Statement
from explorer.measures.blocks.forces import (
    most_held,
    most_of_actuators,
    nearest_held,
    reaction_tables,
    verdict,
    worst_force,
)
from explorer.mechanism.configuration import Configuration
from explorer.mechanism.design import JOINTS, Design
from explorer.mechanism.machine import Six
from explorer.mechanism.pose import Pose, Triple
from explorer.statics.equilibrium import twists_of_actuators
from explorer.statics.forces import WorstDirection, worst_direction
from explorer.statics.loaded import LoadedPose, WorstForce
from explorer.statics.reactions import LIMITED
from explorer.statics.weights import Weights


@dataclass(frozen=True)
class Answer:
    """What the command computes of a pose.

    Attributes:
        loaded: The pose under the load and all weights.
        tool: Point that positions are of; None for b4.
        worst: Direction in which a force alone loads an actuator most.
        added: An added force in its worst direction; None if none is asked for.
        nearest: The nearest pose that holds the load; None if this one does, or none was found.
    """

    loaded: LoadedPose
    tool: Triple | None
    worst: WorstDirection
    added: WorstForce | None
    nearest: Pose | None

    @property
    def largest_force(self) -> float:
        """The largest force in every direction, in N; infinite without a limit."""
        share = float(self.worst.share)
        return 1.0 / share if share else np.inf


@dataclass(frozen=True, kw_only=True)
class Forces(LoadOptions):
    """Compute the forces of actuators and struts under a load, and their limits.

    Positive forces push a joint's value up. Legs 2 and 3 carry a force along the guide too, which
    bends their struts. Limits, payload and gravity are those of the design; without limits there
    is no largest force.
    """

    most: Annotated[
        Six | None,
        numbers("--most", "l1 d1 d2 d3 d4 l4", or_one=True),
        hint("default: those of the design"),
    ] = None
    """Largest forces of the actuators in N for the largest force in every direction, or one for
    all."""

    force: Annotated[float | None, positive("--force"), hint("default: none")] = None
    """Size of an added force in N, of which the worst direction is told."""

    density: Annotated[float | None, positive("--density"), hint("default: no weight")] = None
    """Density of the legs and the platform in kg/m³, as bars with the legs' radii."""

    parts: bool = False
    """Whether the parts of the prototype have this density, in place of bars."""

    def run(self) -> None:
        """Write the forces, the bending and the shares of the limits."""
        if self.parts and self.density is None:
            raise InputError("--parts needs the density of the parts: add --density KG_PER_M3")
        design = self.read_loaded_design()
        pose, tool = self.pose(design), self.tool(design)
        configuration = Configuration.at(design, pose, tool)
        check_regular(pose, twists_of_actuators(configuration), "the forces that hold a load")
        point = tool or (0.0, 0.0, 0.0)
        loaded = LoadedPose(design, pose, self.load, self._own_weights(design), point=point)
        most = np.minimum(*design.actuators.limits) if self.most is None else self.most
        nearest = None
        if loaded.share > 1.0:
            from explorer.workspace.nearest_held import nearest_held

            nearest = nearest_held(loaded)
        answer = Answer(
            loaded,
            tool,
            worst_direction(configuration, most),
            None if self.force is None else loaded.worst_force(self.force),
            nearest,
        )
        self.write(lambda: _as_json(answer), lambda: _as_lines(answer))

    def _own_weights(self, design: Design) -> Weights:
        """Return the weights of legs and platform.

        Raises:
            ExplorerError: The design has no prototype.
        """
        if self.density is None:
            return Weights()
        from explorer.prototype.weights import bar_masses, machine_weights

        if self.parts:
            from explorer.prototype.assembly import make_prototype

            masses = make_prototype(design).masses(self.density)
        else:
            masses = bar_masses(design, self.density)
        return machine_weights(design, masses, payload=False)


def _as_json(answer: Answer) -> dict[str, object]:
    loaded, worst, added = answer.loaded, answer.worst, answer.added
    held, is_limited = loaded.held, bool(worst.share)
    nearest = answer.nearest
    return {
        "actuator_forces": held.actuators,
        "strut_bending": held.bending,
        "largest_force": finite(answer.largest_force),
        "worst_direction": worst.direction if is_limited else None,
        "worst_actuator": JOINTS[int(worst.actuator)] if is_limited else None,
        "joint_forces": held.joints,
        "guide_force": held.guide_force,
        "guide_moment": held.guide_moment,
        # What the payload's force of any direction may add either way.
        "process": dict(zip(LIMITED, held.spread.tolist(), strict=True)),
        "shares": dict(zip(LIMITED, loaded.shares.tolist(), strict=True)),
        "largest_payload": finite(loaded.largest_payload),
        "largest_force_by_all_parts": 1.0 / loaded.newton.share if loaded.newton.share else None,
        "worst_force": None if added is None else _force_json(added),
        "nearest_held": None if nearest is None else pose_json(nearest, answer.tool),
    }


def _force_json(added: WorstForce) -> dict[str, object]:
    is_limited = added.share > 0.0
    return {
        "direction": added.direction if is_limited else None,
        "part": LIMITED[added.part] if is_limited else None,
        "share": added.share,
    }


def _as_lines(answer: Answer) -> Iterator[str]:
    loaded = answer.loaded
    design = loaded.design
    yield from (heading(design), pose_table(design, loaded.pose, answer.tool))
    yield f"load acts at          {'b4' if answer.tool is None else 'the tool'}"
    facts = most_held(loaded)
    if answer.added is not None:
        worst = worst_force(answer.added, "the added force")
        facts = replace(facts, facts=(*facts.facts, *worst))
    yield from lines((verdict(loaded), *_nearest(answer), *reaction_tables(loaded)))
    yield from lines((most_of_actuators(answer.worst), facts))


def _nearest(answer: Answer) -> Iterator[Statement]:
    if answer.loaded.share > 1.0:
        yield nearest_held(answer.loaded, answer.nearest, answer.tool)
