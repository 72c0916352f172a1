"""Random designs with random limits (ordinary, thin-walled, extreme) and reference workspaces."""

from __future__ import annotations

import json
import math
from typing import Any, cast

import msgspec
import numpy as np
from reference import read_reference
from scipy.spatial.transform import Rotation

from explorer import Design, Limits, Pose, inverse
from explorer.mechanism.design import LENGTHS, Swing
from explorer.mechanism.design_file import decode_design
from explorer.numerics.arrays import FloatArray

REFERENCE: dict[str, Any] = read_reference("workspace")
DEFECTS: dict[str, Any] = read_reference("defects_solid")

SIZES = (10.0, 1e-3, 1e4)
NEARNESS = (1.0, 1e-3, 1e-6)
HALF_ANGLES = (1e-3, 30.0, 60.0, 89.999, 90.0, 90.0001, 120.0, 179.0, 180.0)
# Minima as shares of the maximum; the last ones make shells far thinner than a chord.
MINIMA = (0.1, 0.5, 0.9, 0.999, 1.0 - 1e-6)


def limited(design: Design, **limits: Any) -> Design:
    """Return a design with some of its limits changed."""
    return design.with_limits(**limits)


def scaled_design(design: Design, factor: float) -> Design:
    """Return a design with every length, its limits and its home, times a factor."""

    def times(value: Any) -> Any:
        if isinstance(value, tuple):
            return tuple(times(each) for each in cast("tuple[Any, ...]", value))
        return value * factor if isinstance(value, float) else value

    names = [name for name in Limits.__struct_fields__ if name != "swing"]
    home = design.home_pose
    return msgspec.structs.replace(
        limited(design, **{name: times(getattr(design.limits, name)) for name in names}),
        **{name: times(getattr(design, name)) for name in ("a3", "b1", "b2", "b3", "node_step")},
        home=Pose(times(home.position), home.quaternion),
    )


def reference_case(index: int) -> tuple[Design, FloatArray, float]:
    """Return one of the 24 workspaces: design, rotation and its volume (good to 1e-4)."""
    row = REFERENCE["workspaces"][index]
    x = row["design"]
    lengths: dict[str, Any] = {
        name: (row["minimum"][name], row["maximum"][name]) for name in LENGTHS
    }
    low, high = row["box"]
    limits = Limits(
        **lengths,
        guide=tuple(row["rail"]),
        carriage_order="any",
        box=(tuple(low), tuple(high)),
        margin=None,
    )
    design = Design(a3=tuple(x["a3"]), b1=tuple(x["b1"]), b2=x["b2"], b3=x["b3"], limits=limits)
    return design, np.array(row["rotation"]), float(row["volume"])


def defect_case(index: int) -> tuple[Design, FloatArray, float]:
    """Return a workspace that is hard to mesh: design, rotation and its exact volume."""
    row = DEFECTS["solids"][index]
    design = decode_design(json.dumps(row["design"]).encode(), "defects_solid.json")
    return design, np.array(row["rotation"]), float(row["volume"])


def ordinary_case(seed: int) -> tuple[Design, FloatArray]:
    """Return a design with every kind of limit but cones, its home within them, and a rotation.

    Limits are independent of each other, so each can be varied alone.
    """
    rng = np.random.default_rng(seed)
    x = rng.uniform(0.3, 1.0, 6) * rng.choice([-1.0, 1.0], 6) * 10.0
    a3x, a3y, b1x, b1y, b2, b3 = x.tolist()
    rotation = Rotation.random(random_state=rng).as_matrix()
    pose = Pose.of(rng.uniform(-6.0, 6.0, 3), rotation)
    free = Design(a3=(a3x, a3y), b1=(b1x, b1y), b2=b2, b3=b3 + (1.0 if b3 > b2 else -1.0))
    joints = inverse(free, pose.position, rotation).tolist()
    lengths: dict[str, Any] = {
        name: (value * float(rng.uniform(0.3, 0.7)), value * float(rng.uniform(1.3, 1.8)))
        for name, value in zip(LENGTHS, [joints[k] for k in (0, 2, 4, 5)], strict=True)
    }
    carriages = joints[1], joints[3]
    low = np.array(pose.position) - rng.uniform(2.0, 6.0, 3)
    high = np.array(pose.position) + rng.uniform(2.0, 6.0, 3)
    limits = Limits(
        **lengths,
        guide=(
            min(carriages) - float(rng.uniform(2, 5)),
            max(carriages) + float(rng.uniform(2, 5)),
        ),
        box=(tuple(low.tolist()), tuple(high.tolist())),
        margin=1e-3,
    )
    return msgspec.structs.replace(free, limits=limits, home=pose), rotation


def shell_case(seed: int) -> tuple[Design, FloatArray]:
    """Return a design whose minimum lengths often make thin shells, and a rotation.

    Some designs have guides, boxes and margins; a quarter of the rotations are about z alone.
    """
    rng = np.random.default_rng([7, seed])
    size = float(rng.choice([1.0, 10.0, 1e-2, 1e3]))
    near = float(rng.choice([1.0, 1.0, 1.0, 1e-2])) * size

    def between(low: float, high: float) -> float:
        return float(rng.uniform(low, high))

    def away(high: float = 0.6) -> float:
        return float(rng.choice([-1.0, 1.0])) * between(0.05, high)

    limits: dict[str, Any] = {"margin": (None, None, 0.0, 0.02 * size)[int(rng.integers(4))]}
    for name in LENGTHS:
        high, kind = between(0.2, 2.2) * size, rng.random()
        low = high * (1.0 - 10.0 ** -between(0.0, 3.0)) if kind < 0.4 else 0.0
        limits[name] = (low, None if kind > 0.85 else high)
    if rng.random() < 0.35:
        limits["guide"] = (between(-1.5, 0.0) * size, between(0.0, 1.5) * size)
    if rng.random() < 0.4:
        lows = tuple(between(-1.5, 0.0) * size for _ in range(3))
        limits["box"] = (lows, tuple(between(0.05, 1.5) * size for _ in range(3)))
    b2 = between(-0.8, 0.8) * size
    design = Design(
        a3=(between(-1.0, 1.0) * size, away(1.0) * near),
        b1=(between(-0.6, 0.6) * size, away() * size),
        b2=b2,
        b3=b2 + away() * near,
        limits=Limits(**limits),
    )
    if rng.random() < 0.25:
        return design, Rotation.from_euler("Z", between(-3.0, 3.0)).as_matrix()
    return design, Rotation.random(random_state=rng).as_matrix()


def thin_case(seed: int) -> tuple[Design, FloatArray]:
    """Return a design whose lengths may differ little from those at home, and a rotation."""
    design, rotation = ordinary_case(seed)
    joints = inverse(design, design.home.position, rotation) if design.home else np.zeros(6)
    rng = np.random.default_rng(seed)
    lengths: dict[str, Any] = {
        name: (value * float(rng.uniform(0.9, 0.9999)), value * float(rng.uniform(1.0001, 1.1)))
        for name, value in zip(LENGTHS, joints[[0, 2, 4, 5]].tolist(), strict=True)
    }
    return limited(design, **lengths, box=None, guide=None, margin=None), rotation


def troubled_case(seed: int) -> tuple[Design, FloatArray | None]:
    """Return a design of any size, near a degenerate one or not, with any limits, and a rotation.

    Rotations are uniform, near the identity, quarter turns, or that of the home.
    """
    rng = np.random.default_rng(seed)
    size, near = float(rng.choice(SIZES)), float(rng.choice(NEARNESS))

    def between(low: float, high: float) -> float:
        return float(rng.uniform(low, high))

    def away() -> float:
        return float(rng.choice([-1.0, 1.0])) * between(0.1, 1.0) * float(rng.choice([near, 1.0]))

    b2 = between(-1.0, 1.0)
    limits: dict[str, Any] = {"margin": (None, 0.0, 0.05 * size)[int(rng.integers(3))]}
    for name in LENGTHS:
        kind = between(0.0, 1.0)
        high = between(0.5, 2.0) * size
        low = high * float(rng.choice(MINIMA)) if kind < 0.3 else 0.0
        limits[name] = (low, None if kind > 0.6 else high)
    if rng.random() < 0.3:
        limits["guide"] = (between(-1.5, 0.0) * size, between(0.0, 1.5) * size)
    if rng.random() < 0.4:
        z = 0.0 if rng.random() < 0.5 else between(-1.0, 0.0) * size
        lows = (between(-1.5, 0.0) * size, between(-1.5, 0.0) * size, z)
        highs = tuple(between(0.1, 1.5) * size for _ in range(3))
        limits["box"] = (lows, highs)
    if rng.random() < 0.2:
        joints = rng.choice(["a1", "a3", "b1", "b2", "b3", "b4"], 2, replace=False).tolist()
        limits["swing"] = Swing(**{name: float(rng.choice(HALF_ANGLES)) for name in joints})
    design = Design(
        a3=(float(rng.choice([-1.0, 1.0])) * size, away() * size),
        b1=(between(-1.0, 1.0) * size, away() * size),
        b2=b2 * size,
        b3=(b2 + away()) * size,
        limits=Limits(**limits),
    )
    kind = int(rng.integers(4))
    if kind == 0:
        return design, Rotation.random(random_state=rng).as_matrix()
    if kind == 1:
        angle = 10.0 ** -float(rng.integers(1, 13))
        return design, Rotation.from_rotvec(angle * rng.normal(size=3)).as_matrix()
    if kind == 2:
        turns = Rotation.from_euler("ZYX", 0.5 * math.pi * rng.integers(0, 4, 3))
        return design, np.round(turns.as_matrix()) + 0.0
    return design, None
