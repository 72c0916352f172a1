"""The needs of the reference file as requirements, and random poses that try their answers."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
from reference import read_reference
from scipy.spatial.transform import Rotation

from explorer import actuator_forces, poses_are_valid
from explorer.find.requirement import RequiredLegs, RequiredLoad, Requirement
from explorer.legs.clearance import leg_clearances
from explorer.mechanism.configuration import Configuration
from explorer.mechanism.design import Design
from explorer.mechanism.machine import STANDARD_GRAVITY

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


def violations(design: Design, requirement: Requirement, count: int) -> int:
    """Return how many random poses over the box and the tilts break a limit, clearance or force.

    Half of them have the largest tilt. Nothing of the search takes part.
    """
    random, legs, payload = np.random.default_rng(7), requirement.legs, requirement.payload
    unit, tool = design.unit_mm, np.array(design.tool.position)
    home = design.home_pose.rotation
    around = random.uniform(-math.pi, math.pi, count)
    tilts = math.radians(requirement.tilt_deg) * np.sqrt(random.random(count))
    tilts[::2] = math.radians(requirement.tilt_deg)
    turns = np.column_stack([tilts * np.cos(around), tilts * np.sin(around), np.zeros(count)])
    rotation = Rotation.from_rotvec(turns).as_matrix() @ home
    half = 0.5 * np.array(requirement.box_mm) / unit
    box = Rotation.from_euler("z", design.required_yaw, degrees=True).as_matrix()
    middle = np.array(design.home_pose.position) + home @ tool
    at = middle + (half * random.uniform(-1.0, 1.0, (count, 3))) @ box.T
    position = at - rotation @ tool
    broken = ~poses_are_valid(design, position, rotation)
    apart = leg_clearances(Configuration(design, position, rotation)).distance.min(axis=1)
    broken |= apart < (legs.diameter_mm + legs.apart_mm) / unit - 1e-9
    if legs.push_n is not None:
        weight = payload.mass_kg * STANDARD_GRAVITY * np.array(requirement.gravity)
        arm = rotation @ (np.array(payload.centre_mm) / unit)
        load = np.column_stack([np.broadcast_to(weight, arm.shape), np.cross(arm, weight)])
        held = actuator_forces(design, position, rotation, load)
        any_way = [
            actuator_forces(design, position, rotation, [*axis, 0.0, 0.0, 0.0], tool)
            for axis in np.eye(3).tolist()
        ]
        most = payload.force_n * np.linalg.norm(any_way, axis=0)
        pull = legs.push_n if legs.pull_n is None else legs.pull_n
        broken |= ((held + most > legs.push_n) | (most - held > pull)).any(axis=1)
    return int(broken.sum())
