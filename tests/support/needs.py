"""The needs of the reference file as requirements."""

from __future__ import annotations

from typing import Any

from reference import read_reference

from explorer.find.requirement import RequiredLegs, RequiredLoad, Requirement

REFERENCE = read_reference("needs")
NEEDS: list[dict[str, Any]] = REFERENCE["needs"]


def requirement_of(need: dict[str, Any], **changes: Any) -> Requirement:
    """Return a need as a requirement, with other values of some fields."""
    common = REFERENCE["common"]
    legs = RequiredLegs(
        ratio=need["ratio"],
        push_n=common["push_n"],
        pull_n=common["pull_n"],
        diameter_mm=common["diameter_mm"],
        apart_mm=need["apart_mm"],
    )
    fields: dict[str, Any] = {
        "name": need["name"],
        "box_mm": tuple(need["box_mm"]),
        "tilt_deg": need["tilt_deg"],
        "swing_deg": need["swing_deg"],
        "payload": RequiredLoad(
            need["mass_kg"], tuple(common["payload_centre_mm"]), need["force_n"]
        ),
        "legs": legs,
    }
    return Requirement(**fields | changes)
