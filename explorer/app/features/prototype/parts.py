"""The parts of the prototype and their meshes, made in the worker."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

from explorer.app.features.prototype.parts_list import PartsList, parts_list
from explorer.app.scene.creases import Drawn, creased
from explorer.errors import ExplorerError, TooTightError
from explorer.mechanism.design import Design
from explorer.prototype.assembly import Prototype, make_prototype


@dataclass(frozen=True)
class PartsRequest:
    """Request to make the parts of a design; its name does not count."""

    design: Design


@dataclass(frozen=True)
class Parts:
    """The parts of a design.

    Attributes:
        prototype: Parts with their places in a pose.
        meshes: Meshes of the parts, in their order and frames, in design units.
        listed: List of the parts for the workshop.
    """

    prototype: Prototype
    meshes: tuple[Drawn, ...]
    listed: PartsList

    @cached_property
    def floor(self) -> float:
        """Height of the lowest point of the base, in design units."""
        return float(self.meshes[0][0][:, 2].min())


@dataclass(frozen=True)
class PartsDrawing:
    """The parts of a design, or why there are none.

    Attributes:
        request: Request that it answers.
        parts: Parts; None if the design is too tight for them.
        refusal: Why there are none, and what would fit; None if there are parts.
    """

    request: PartsRequest
    parts: Parts | None
    refusal: ExplorerError | None

    @property
    def fitting_unit_mm(self) -> float | None:
        """Millimetres in one design unit with which the parts fit; None if no unit helps."""
        return self.refusal.fitting_unit_mm if isinstance(self.refusal, TooTightError) else None


def parts_drawing(request: PartsRequest) -> PartsDrawing:
    """Return the parts of a design, ready to be drawn."""
    try:
        prototype = make_prototype(request.design)
    except ExplorerError as error:
        return PartsDrawing(request, None, error)
    meshes = tuple(creased(part.vertices, part.faces) for part in prototype.parts)
    return PartsDrawing(request, Parts(prototype, meshes, parts_list(prototype)), None)
