"""`explorer forces`: what holds a load in a pose, and the shares of the limits that it uses."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace
from typing import Annotated

import numpy as np

from explorer.cli.blocks import lines
from explorer.cli.load_options import LoadOptions, check_regular
from explorer.cli.output import finite, heading, pose_json, pose_table
from explorer.cli.values import OF_DESIGN, hint, numbers, positive
from explorer.errors import InputError
from explorer.measures.blocks import forces as blocks
from explorer.mechanism.configuration import Configuration
from explorer.mechanism.design import JOINTS, Design
from explorer.mechanism.machine import Six
from explorer.mechanism.pose import Pose, Triple
from explorer.statics.forces import WorstDirection, twists_of_actuators, worst_direction
from explorer.statics.loaded import LoadedPose, WorstForce
from explorer.statics.reactions import LIMITED
from explorer.statics.weights import Weights


@dataclass(frozen=True, kw_only=True)
class Forces(LoadOptions):
    """Compute the forces of actuators and struts under a load, and their limits.

    Positive forces push a joint's value up. Legs 2 and 3 carry a force along the guide too, which
    bends their struts. Limits, payload and gravity are those of the design; without limits there
    is no largest force.
    """

    most: Annotated[Six | None, numbers("--most", "l1 d1 d2 d3 d4 l4", or_one=True), OF_DESIGN] = (
        None
    )
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
            from explorer.workspace.nearest_carrying import nearest_carrying_pose

            nearest = nearest_carrying_pose(loaded)
        worst = worst_direction(configuration, most)
        added = None if self.force is None else loaded.worst_force(self.force)
        self.write(
            lambda: {
                **_as_json(loaded, worst, added),
                "nearest_held": None if nearest is None else pose_json(nearest, tool),
            },
            lambda: _as_lines(loaded, worst, added, nearest, tool),
        )

    def _own_weights(self, design: Design) -> Weights:
        """Return the weights of legs and platform."""
        if self.density is None:
            return Weights()
        from explorer.prototype.weights import bar_masses, machine_weights

        if self.parts:
            from explorer.prototype.assembly import make_prototype

            masses = make_prototype(design).masses(self.density)
        else:
            masses = bar_masses(design, self.density)
        return machine_weights(design, masses, payload=False)


def _as_json(
    loaded: LoadedPose, worst: WorstDirection, added: WorstForce | None
) -> dict[str, object]:
    held, share = loaded.held, float(worst.share)
    return {
        "actuator_forces": held.actuators,
        "strut_bending": held.bending,
        "largest_force": 1.0 / share if share else None,
        "worst_direction": worst.direction if share else None,
        "worst_actuator": JOINTS[int(worst.actuator)] if share else None,
        "joint_forces": held.joints,
        "guide_force": held.guide_force,
        "guide_moment": held.guide_moment,
        # What the payload's force of any direction may add either way.
        "process": dict(zip(LIMITED, held.spread.tolist(), strict=True)),
        "shares": dict(zip(LIMITED, loaded.shares.tolist(), strict=True)),
        "largest_payload": finite(loaded.largest_payload),
        "largest_force_by_all_parts": 1.0 / loaded.newton.share if loaded.newton.share else None,
        "worst_force": None
        if added is None
        else {
            "direction": added.direction if added.share > 0.0 else None,
            "part": LIMITED[added.part] if added.share > 0.0 else None,
            "share": added.share,
        },
    }


def _as_lines(
    loaded: LoadedPose,
    worst: WorstDirection,
    added: WorstForce | None,
    nearest: Pose | None,
    tool: Triple | None,
) -> Iterator[str]:
    yield from (heading(loaded.design), pose_table(loaded.design, loaded.pose, tool))
    yield f"load acts at          {'b4' if tool is None else 'the tool'}"
    facts = blocks.most_held(loaded)
    if added is not None:
        more = blocks.worst_force(added, "the added force")
        facts = replace(facts, facts=(*facts.facts, *more))
    refused = (blocks.nearest_held(loaded, nearest, tool),) if loaded.share > 1.0 else ()
    yield from lines((blocks.verdict(loaded), *refused, *blocks.reaction_tables(loaded)))
    yield from lines((blocks.most_of_actuators(worst), facts))
