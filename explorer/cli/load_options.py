"""The options of the load that the commands of statics share."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Annotated

import msgspec
import numpy as np

from explorer.cli.options import DesignOptions, JsonOptions, PoseOptions
from explorer.cli.values import OF_DESIGN, hint, load_numbers, not_negative
from explorer.errors import InputError, NoAnswerError
from explorer.mechanism.design import Design
from explorer.mechanism.machine import Six
from explorer.mechanism.margins import INCIDENCES, margins
from explorer.mechanism.pose import Pose
from explorer.numerics.arrays import FloatArray
from explorer.statics.forces import SINGULAR
from explorer.statics.reactions import has_limits

if TYPE_CHECKING:
    from explorer.workspace.carried_region import CarriedRegion


@dataclass(frozen=True, kw_only=True)
class LoadOptions(JsonOptions, PoseOptions, DesignOptions):
    """The options for a load on the platform in a pose."""

    load: Annotated[Six, load_numbers("--load"), hint("default: none")] = (
        *(0.0, 0.0, 0.0),
        *(0.0, 0.0, 0.0),
    )
    """Force in N and moment in N × unit on the platform, along the axes of the base."""

    payload: Annotated[float | None, not_negative("--payload"), OF_DESIGN] = None
    """Mass of the payload, in kg; its weight is added to the load."""

    def read_loaded_design(self) -> Design:
        """Return the design with the given mass of the payload."""
        design = self.read_design()
        if self.payload is None:
            return design
        payload = msgspec.structs.replace(design.payload, mass_kg=self.payload)
        return msgspec.structs.replace(design, payload=payload)


def held_by(
    design: Design, rotation: FloatArray, load: Six, tolerance: float | None
) -> CarriedRegion:
    """Return the part of the workspace of a design with limits that holds a load.

    The load is (F; M) at the tool besides the payload, base axes, in N and N × unit.
    """
    from explorer.workspace.carried_region import carried_region

    check_has_limits(design)
    return carried_region(design, rotation, load, tolerance=tolerance)


def check_has_limits(design: Design) -> None:
    """Check that a part of a design has a limit."""
    if not has_limits(design):
        raise InputError(
            "the design limits neither its actuators nor its struts nor its guide, so that it "
            "holds any load: give its file a limit, such as actuators.push_n"
        )


def check_regular(pose: Pose, values: FloatArray, infinite: str) -> None:
    """Check that results of a pose are finite, and name what is infinite in a singular one."""
    if np.isfinite(values).all():
        return
    least = SINGULAR * float(np.linalg.norm(pose.position))
    margin = np.abs(margins(pose.position, pose.rotation))
    zero = [f"δ{k + 1} = 0: {INCIDENCES[k]}" for k in np.flatnonzero(margin <= least)]
    named = "; ".join(zero) or "a margin vanishes to rounding"
    raise NoAnswerError(f"the pose is singular ({named}): {infinite} are infinite")
