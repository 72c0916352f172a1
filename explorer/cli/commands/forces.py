"""`explorer forces`: what holds a load in a pose, and the shares of the limits that it uses."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace
from typing import Annotated

import numpy as np

from explorer.cli.load_options import LoadOptions, check_regular
from explorer.cli.output import figure, figures, finite, heading, pose_table, table
from explorer.cli.values import hint, numbers, positive
from explorer.mechanism.design import JOINTS, Design
from explorer.mechanism.pose import Pose, Triple
from explorer.numerics.arrays import FloatArray
from explorer.statics.equilibrium import twists_of_actuators
from explorer.statics.forces import WorstDirection, worst_direction
from explorer.statics.reactions import (
    LIMITED,
    Reactions,
    largest_payload,
    limit_shares,
    reactions,
)
from explorer.statics.weights import Weights, design_weights

Six = tuple[float, float, float, float, float, float]


@dataclass(frozen=True)
class Answer:
    """What the command computes of a pose."""

    design: Design
    pose: Pose
    tool: Triple | None
    held: Reactions
    shares: FloatArray
    worst: WorstDirection
    payload: float

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

    density: Annotated[float | None, positive("--density"), hint("default: no weight")] = None
    """Density of the legs and the platform in kg/m³, as bars with the legs' radii."""

    def run(self) -> None:
        """Write the forces, the bending and the shares of the limits."""
        design = self.read_loaded_design()
        pose, tool = self.pose(design), self.tool(design)
        given = design, pose.position, pose.rotation
        check_regular(pose, twists_of_actuators(*given))
        own = self._own_weights(design)
        carried = (*own.on_platform, *design_weights(design).on_platform)
        weights = replace(own, on_platform=carried)
        held = reactions(*given, self.load, tool, weights)
        most = np.minimum(*design.actuators.limits) if self.most is None else self.most
        answer = Answer(
            design,
            pose,
            tool,
            held,
            limit_shares(design, held),
            worst_direction(*given, most, tool),
            float(largest_payload(*given, self.load, tool, own)),
        )
        self.write(lambda: _as_json(answer), lambda: _as_lines(answer))

    def _own_weights(self, design: Design) -> Weights:
        """Return the weights of legs and platform."""
        if self.density is None:
            return Weights()
        from explorer.prototype.weights import bar_masses, machine_weights

        return machine_weights(design, bar_masses(design, self.density), payload=False)


def _as_json(answer: Answer) -> dict[str, object]:
    held, worst = answer.held, answer.worst
    is_limited = bool(worst.share)
    return {
        "actuator_forces": held.actuators,
        "strut_bending": held.bending,
        "largest_force": finite(answer.largest_force),
        "worst_direction": worst.direction if is_limited else None,
        "worst_actuator": JOINTS[int(worst.actuator)] if is_limited else None,
        "joint_forces": held.joints,
        "guide_force": held.guide_force,
        "guide_moment": held.guide_moment,
        "shares": dict(zip(LIMITED, answer.shares.tolist(), strict=True)),
        "largest_payload": finite(answer.payload),
    }


def _as_lines(answer: Answer) -> Iterator[str]:
    design, held = answer.design, answer.held
    yield from (heading(design), pose_table(design, answer.pose, answer.tool), "")
    size = float(np.abs(held.actuators).max())
    forces = [figure(value, size) for value in held.actuators.tolist()]
    shares = [_share(value) for value in answer.shares.tolist()]
    rows = [("actuator", "force, N", "of its limit")]
    rows += zip(JOINTS, forces, shares[:6], strict=True)
    yield from (table(rows, "<>>"), "")
    newton_metre = design.unit_mm * 1e-3
    rows = [
        ("strut", "bending, N x unit", "N m", "of its limit", "on the guide, N", "of its limit")
    ]
    for index in range(2):
        moment = float(held.bending[index])
        share = max(answer.shares[6 + index], answer.shares[10 + index])
        rows.append(
            (
                f"leg {index + 2}",
                figure(moment),
                figure(moment * newton_metre),
                _share(float(share)),
                figure(float(held.guide_force[index])),
                shares[8 + index],
            )
        )
    yield from (table(rows, "<>>>>>"), "")
    rows = [("largest force in every direction", _newtons(answer.largest_force))]
    if answer.worst.share:
        actuator = JOINTS[int(answer.worst.actuator)]
        direction = "  ".join(figures(answer.worst.direction.tolist()))
        rows.append(("worst direction", f"{direction}, of {actuator}"))
    most = "no limit" if np.isinf(answer.payload) else f"{figure(answer.payload)} kg"
    rows.append(("largest payload", most))
    yield table(rows, "<<")


def _newtons(value: float) -> str:
    return "no limit" if np.isinf(value) else f"{figure(value)} N"


def _share(value: float) -> str:
    return f"{100.0 * value:.1f} %" if value else "-"
