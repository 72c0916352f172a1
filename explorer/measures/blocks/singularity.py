"""How near a pose is to a singularity, what a singular pose allows, and the gains of a pose."""

from __future__ import annotations

import math
from collections.abc import Iterator

import numpy as np

from explorer.measures.blocks import block
from explorer.measures.snapshot import Snapshot
from explorer.measures.verdict import Kind, Warnings
from explorer.mechanism.design import JOINTS
from explorer.mechanism.margins import INCIDENCES, MARGIN_KINDS, TETRAHEDRA
from explorer.numerics.arrays import FloatArray
from explorer.numerics.number_text import UNITS, Unit, format_number
from explorer.singularity.ellipsoids import Performance, SingularityFreeBall
from explorer.singularity.freedoms import FreeTurn
from explorer.singularity.strata import GENERIC, Stratum, describe_stratum, incidences, inversions

VERDICT_HINT = (
    "The motion is the root-mean-square displacement of b1 to b4 (Nawratil's metric) to the "
    "nearest singular pose, of any position and orientation"
)
LOOKS: dict[Kind, block.Look] = {"clear": "within", "near": "close", "singular": "beyond"}
LARGEST_GAIN = 1e9
"""Gain beyond which a pose counts as singular in a direction: J is known to fewer digits."""


def colour_words(warn: Warnings, unit: Unit) -> str:
    """Return the meaning of an incidence's colour, given the warning values."""
    return (
        "The colour of an incidence: the least of its measures over their warning values, which "
        f"are {unit.text(warn.margin, 3)} of the margin, "
        f"{unit.text(warn.distance, 3)} of motion, "
        f"{format_number(math.degrees(warn.turn), 3)}° of turning, and "
        f"{format_number(warn.condition, 3)} of 1/cond J"
    )


def margin_table(snapshot: Snapshot, unit: Unit | None = None) -> block.Table:
    """Return the three margins, with the motion and the least turn to where each is zero.

    Lengths are in mm unless another unit is given; where there is room, in design units too.
    """
    unit, reach = unit or snapshot.design.millimetres, snapshot.design.reach
    name, size = f" {unit.name}", unit.factor * reach
    motions = [unit.factor * each.distance for each in snapshot.nearest]
    turns = [
        math.degrees(turn) if motion > 0.0 else 0.0
        for turn, motion in zip(snapshot.least_turns, motions, strict=True)
    ]
    margins = snapshot.margins
    return block.Table(
        "Margins",
        (
            block.Names("", [f"δ{number}" for number in (1, 2, 3)]),
            block.Column("margin", margins.tolist(), " units", size=reach, span=reach, wide=True),
            block.Column("margin", (unit.factor * margins).tolist(), name, size=size, span=size,
                         hint="How far the two flags are from meeting; zero where the mechanism is "
                         f"singular. {MARGIN_KINDS}. Its sign is that of the mode."),
            block.Column("motion", motions, name, 5, span=size,
                         hint="To the nearest pose with δ = 0: the root-mean-square displacement "
                         "of b1 to b4 (Nawratil's metric)."),
            block.Column("turn", turns, "°", 3, span=90.0,
                         hint="The least turn about b4 or a1 that leads to δ = 0."),
        ),
        f"{MARGIN_KINDS}; the signs of the three name the assembly mode. Motions are the "
        "root-mean-square displacement of b1 to b4 (Nawratil's metric), turns the least about b4 "
        "or a1.",
    )  # fmt: skip


def tetrahedra(snapshot: Snapshot) -> block.Table:
    """Return the tetrahedra that are flat where a margin is zero, and their volumes."""
    return block.Table(
        "Tetrahedra",
        (
            block.Names("margin", [f"δ{number}" for number in (1, 2, 3)]),
            block.Names("zero when", INCIDENCES),
            block.Names("tetrahedron", [" ".join(points) for points in TETRAHEDRA]),
            block.Column(
                "volume", snapshot.volumes.tolist(), " units³", size=snapshot.design.reach**3
            ),
        ),
        "A margin is zero where its tetrahedron is flat.",
    )


def nearest_poses(snapshot: Snapshot) -> block.Table:
    """Return the nearest singular pose of each margin."""
    poses = [nearest.pose for nearest in snapshot.nearest]
    places = np.array([pose.position for pose in poses]).T.tolist()
    angles = np.array([pose.yaw_pitch_roll for pose in poses]).T.tolist()
    return block.Table(
        "Nearest singular poses",
        (
            block.Names("with", [f"δ{nearest.incidence} = 0" for nearest in snapshot.nearest]),
            *(
                block.Column(axis, values, " units", 5, size=snapshot.design.reach)
                for axis, values in zip("xyz", places, strict=True)
            ),
            *(
                block.Column(name, values, "°", 5, size=180.0)
                for name, values in zip(("yaw", "pitch", "roll"), angles, strict=True)
            ),
        ),
    )


def conditioning(snapshot: Snapshot, unit: Unit = UNITS) -> block.Facts:
    """Return the measures of the actuator Jacobian J, the mode and the stratum."""
    worst = int(snapshot.transmissions.argmin())
    size = snapshot.design.reach**3
    determinant = block.quantity(snapshot.determinant, unit.to_power(3, size), size=size)
    return block.Facts(
        "Conditioning",
        (
            block.Fact("det J", (determinant,), hint="Determinant of the actuator Jacobian"),
            block.Fact(
                "1/cond J",
                _ratio(snapshot.inverse_condition),
                hint="Inverse condition number of J, with lengths divided by the reach; 0 is "
                "singular, 1 is best",
            ),
            block.Fact(
                "least σ of J",
                _ratio(snapshot.smallest_singular_value),
                hint="Smallest singular value of J, with lengths divided by the reach: errors of "
                "actuators and loads grow at most 1/σ times to those of the platform and of the "
                "actuators",
            ),
            block.Fact(
                "manipulability",
                _ratio(snapshot.manipulability),
                hint="|det J| with lengths divided by the reach (Yoshikawa)",
            ),
            block.Fact(
                "transmission index",
                (*_ratio(snapshot.transmission_index), f" ({JOINTS[worst]})"),
                hint="Local transmission index: of the worst actuator, the cosine between its "
                "force and the motion that it causes; 0 is singular, good above 0.64 to 0.7",
            ),
            block.Fact(
                "min |δ| / reach",
                _ratio(snapshot.proximity),
                hint=f"Smallest margin over the reach |a3|; {MARGIN_KINDS}",
            ),
            block.Fact("assembly mode", snapshot.mode_words, wide=True),
            block.Fact("stratum", stratum_words(snapshot.stratum), wide=True),
        ),
    )


def stratum_words(stratum: Stratum) -> str:
    """Return a stratum in words, such as "(4, 3, 2, 1), dimension 6: generic"."""
    numbers = ", ".join(map(str, stratum))
    return f"({numbers}), dimension {inversions(stratum)}: {stratum_sentence(stratum)}"


def stratum_sentence(stratum: Stratum) -> str:
    """Return the incidences of a stratum in words, such as "δ1 = 0: a1 on the platform plane"."""
    if stratum == GENERIC:
        return "no incidence, not singular"
    zero = ", ".join(f"δ{index}" for index in incidences(stratum))
    return f"{zero} = 0: {describe_stratum(stratum)}"


def freedoms(snapshot: Snapshot, unit: Unit = UNITS) -> Iterator[block.Statement]:
    """Yield the freedoms that locked actuators leave the platform; none in a regular pose."""
    if not snapshot.is_singular:
        return
    found = snapshot.freedoms
    if found.count == 0:
        words = "A leg has length zero and holds its end: with all actuators locked the platform"
        yield block.Statement("", f"{words} cannot move.")
        return
    can = "can still move" if found.count == 1 else f"still has {found.count} freedoms"
    among = ", among them" if len(found.turns) < found.count else ""
    ends = f"{among}:" if found.turns else "."
    yield block.Statement("", f"With all actuators locked the platform {can}{ends}")
    yield from (_free_turn(snapshot, turn, unit) for turn in found.turns)


def _free_turn(snapshot: Snapshot, turn: FreeTurn, unit: Unit) -> block.Statement:
    place, span = (unit.factor * turn.point).tolist(), unit.factor * snapshot.design.reach
    point = block.Vector(place, span=span), f") {unit.name}"
    through: block.Words = ("b4 (", *point) if turn.incidence == 1 else ("a1",)
    along = block.Vector(turn.direction.tolist(), span=1.0)
    at_all = "; no joint changes at any angle" if turn.is_finite else ""
    return block.Statement(
        "",
        (
            f"it turns about {turn.line_name}, pitch 0, through ",
            *through,
            ", along (",
            along,
            ")",
            at_all,
        ),
        hint="Along the axes of the base. Pitch 0: the platform does not slide along the line. "
        "Joints change with the square of the angle only, so that play lets it turn a little; or "
        "not at all where a point of one flag lies on the line of the other.",
        act=f"show {turn.incidence}",
    )


def gains(performance: Performance, point: str) -> block.Table:
    """Return the least and the largest gain of speed and of force, by the reach for turning.

    They are those of a point of the platform, such as "b4".
    """
    moves, turns = performance.translation, performance.rotation
    axes = moves.gain, moves.force, turns.gain, turns.force
    return block.Table(
        "Gains",
        (
            block.Names(
                "per unit of the actuators",
                (f"speed of {point}", f"force at {point}", "angular velocity", "moment"),
            ),
            block.Column("min", [finite_gain(float(each.min())) for each in axes], digits=3),
            block.Column("max", [finite_gain(float(each.max())) for each in axes], digits=3),
        ),
        "Per unit of actuator speed or force; angular velocity times the reach, moment over the "
        "reach.",
    )


def finite_gain(value: float) -> float:
    """Return a gain; one that only rounding keeps finite is infinite."""
    return math.inf if value > LARGEST_GAIN else value


def tool_condition(condition: float) -> block.Facts:
    """Return the inverse condition number of J at the tool."""
    return block.Facts("At the tool", (block.Fact("1/cond J", _ratio(condition)),))


def _ratio(value: float | FloatArray) -> tuple[block.Number]:
    return (block.Number(float(value), digits=5, size=1.0, span=1.0),)


def ellipsoids(performance: Performance, point: str) -> Iterator[block.Table]:
    """Yield the gains of a pose and their axes, as for `gains`."""
    for found, title, hint in (
        (
            performance.translation,
            f"Speed of {point} per actuator speed",
            "The actuator force per force along it too: where the platform is fast, it is weak.",
        ),
        (
            performance.rotation,
            "Angular velocity per actuator speed",
            "Angular velocity times the reach; the actuator force per moment over the reach too.",
        ),
    ):
        yield block.Table(
            title,
            (
                block.Names(
                    "along x, y, z", [(block.direction(axis),) for axis in found.axes.T.tolist()]
                ),
                block.Column(
                    "gain", [finite_gain(value) for value in found.gain.tolist()], digits=6
                ),
            ),
            hint,
        )


def free_ball(
    snapshot: Snapshot, ball: SingularityFreeBall, point: str, unit: Unit | None = None
) -> block.Fact:
    """Return the radius of the largest ball of positions without a singular one.

    They are the positions of a point of the platform, such as "b4". Lengths are in mm unless
    another unit is given.
    """
    hint = f"No position of {point} within this radius is singular at this orientation"
    if snapshot.is_singular:
        return block.Fact("singularity-free radius", f"none: δ{ball.incidence} = 0 here", hint=hint)
    return block.Fact(
        "singularity-free radius",
        (block.quantity(ball.radius, unit or snapshot.design.millimetres),),
        f"to δ{ball.incidence} = 0",
        hint,
    )


def regular_distance(motion: float, unit: Unit) -> block.Fact:
    """Return the motion within which no pose is singular."""
    return block.Fact(
        "regular within",
        (block.quantity(motion, unit),),
        "of motion",
        "No pose is singular whose b1 to b4 are displaced by less, root mean square",
    )
