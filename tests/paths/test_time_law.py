"""Time laws: from rest to rest, as short as in closed form, and within all limits in between."""

from __future__ import annotations

import math

import msgspec
import numpy as np
import pytest
from machines import same_for_all, six
from numpy.testing import assert_allclose
from refusals import refusal

from explorer import (
    PRESETS,
    Actuators,
    Configuration,
    Design,
    NoAnswerError,
    Payload,
    Pose,
    joint_accelerations,
    joint_rates,
)
from explorer.legs.moves import StraightMoves
from explorer.mechanism.pose import Triple
from explorer.paths import time_law
from explorer.paths.time_law import TimeLaw, law_at_speed
from explorer.paths.trajectory import trajectory
from explorer.prototype.weights import bar_masses, moving_bodies
from explorer.statics.forces import forces_of
from explorer.statics.weights import MovingBodies, carry

OPTIMAL = PRESETS["paper-optimal"]
HOME = OPTIMAL.home_pose
X, Y, Z = HOME.position
# Along the guide both carriages go as far as the platform, and no leg goes farther.
WAY = 3.0
ALONG_GUIDE = [HOME, Pose((X + WAY, Y, Z), HOME.quaternion)]
DENSITY, TOOL = 2700.0, (0.5, 1.0, -2.0)


def limited(speed: float, acceleration: float, force: float | None = None) -> Design:
    """Return a design with a payload and limits in units/s, units/s² and N."""
    push = None if force is None else same_for_all(force)
    actuators = Actuators(
        push_n=push,
        speed_mm_s=same_for_all(10.0 * speed),
        acceleration_mm_s2=same_for_all(10.0 * acceleration),
    )
    return msgspec.structs.replace(OPTIMAL, actuators=actuators, payload=Payload(2.0, (1, 0, 1)))


def random_case(seed: int) -> tuple[Design, list[Pose]]:
    """Return limits of which each binds somewhere, and a path of two moves about home."""
    rng = np.random.default_rng(seed)
    design = limited(1.0, 1.0)
    actuators = Actuators(
        push_n=six(rng.uniform(50.0, 90.0, 6)),
        speed_mm_s=six(rng.uniform(60.0, 400.0, 6)),
        acceleration_mm_s2=six(rng.uniform(1000.0, 9000.0, 6)),
    )
    poses = [
        Pose.of_yaw_pitch_roll(
            tuple(np.array(HOME.position) + rng.uniform(-2.0, 2.0, 3)),
            tuple(np.array([-73.1, 0.0, 0.0]) + rng.uniform(-15.0, 15.0, 3)),
        )
        for _ in range(2)
    ]
    return msgspec.structs.replace(design, actuators=actuators), [HOME, *poses]


def law_of_shortest_time(design: Design, path: list[Pose], tool: Triple | None = None) -> TimeLaw:
    moves = StraightMoves.along(path, tool)
    return time_law.law_of_shortest_time(design, moves, bodies_of(design))


def bodies_of(design: Design) -> MovingBodies:
    return moving_bodies(design, bar_masses(design, DENSITY))


def shares_of_limits(design: Design, path: list[Pose], law: TimeLaw) -> np.ndarray:
    """Return shares of speeds, accelerations and forces between those of the law, (n, 3, 6)."""
    parts = np.linspace(0.0, 1.0, 37, endpoint=False, dtype=np.float64)
    times = (law.time[:-1, None] + np.diff(law.time)[:, None] * parts).ravel()
    at, rate, change = law.places(times)
    moves, number = StraightMoves.along(path, TOOL), np.minimum(at.astype(int), len(path) - 2)
    poses = moves.poses(number, at - number)
    twist, bend = moves.slopes(number, poses[1])
    motion = rate[:, None] * twist, change[:, None] * twist + rate[:, None] ** 2 * bend
    c = Configuration(design, *poses)
    forces = forces_of(c, carry(c, bodies_of(design), *motion).wrench)
    limits = design.actuators
    assert limits.speed_mm_s
    assert limits.acceleration_mm_s2
    assert limits.push_n
    return np.stack(
        [
            np.abs(10.0 * joint_rates(design, *poses, motion[0]) / limits.speed_mm_s),
            np.abs(10.0 * joint_accelerations(design, *poses, *motion) / limits.acceleration_mm_s2),
            np.abs(forces / limits.push_n),
        ],
        axis=1,
    )


@pytest.mark.parametrize(
    ("speed", "acceleration"), [(1.5, 3.0), (10.0, 10.0), (6.0, 100.0), (math.sqrt(30.0), 10.0)]
)
def test_laws_along_the_guide_have_the_time_of_a_bang_bang_motion(
    speed: float, acceleration: float
) -> None:
    reaches_speed = speed**2 / acceleration < WAY
    trapezoid, triangle = WAY / speed + speed / acceleration, 2.0 * math.sqrt(WAY / acceleration)
    expected = trapezoid if reaches_speed else triangle
    steady = law_at_speed(OPTIMAL, StraightMoves.along(ALONG_GUIDE), speed, acceleration)
    shortest = law_of_shortest_time(limited(speed, acceleration), ALONG_GUIDE)
    assert steady.duration == pytest.approx(expected, rel=1e-3)
    assert shortest.duration == pytest.approx(expected, rel=1e-3)


@pytest.mark.parametrize("seed", range(6))
def test_law_of_shortest_time_exceeds_no_limit_and_uses_one_everywhere(
    seed: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    design, path = random_case(seed)
    law = law_of_shortest_time(design, path, TOOL)
    shares = shares_of_limits(design, path, law)
    assert shares.max() <= 1.0 + 1e-6
    assert (shares.max(axis=(1, 2)) > 0.98).mean() > 0.98
    monkeypatch.setattr(time_law, "POINTS", 10 * time_law.POINTS)
    finer = law_of_shortest_time(design, path, TOOL)
    assert law.duration == pytest.approx(finer.duration, rel=5e-3)


@pytest.mark.parametrize("slower", [1e-1, 1e2, 1e4])
def test_law_of_shortest_time_takes_longer_by_as_much_as_its_limits_are_slower(
    slower: float,
) -> None:
    design, path = random_case(2)
    limits = design.actuators
    assert limits.speed_mm_s
    assert limits.acceleration_mm_s2
    law, longer = (
        law_of_shortest_time(
            msgspec.structs.replace(
                design,
                actuators=Actuators(
                    speed_mm_s=six(np.array(limits.speed_mm_s) / factor),
                    acceleration_mm_s2=six(np.array(limits.acceleration_mm_s2) / factor**2),
                ),
            ),
            path,
        )
        for factor in (1.0, slower)
    )
    assert longer.duration == pytest.approx(slower * law.duration, rel=1e-6)


def test_laws_rest_at_every_corner_and_lie_on_the_path() -> None:
    design, path = random_case(9)
    path.insert(1, path[1])
    for still in ([HOME, HOME], [HOME]):
        assert "no length" in refusal(law_of_shortest_time, design, still)
    for law in (
        law_at_speed(design, StraightMoves.along(path), 5.0, 20.0),
        law_of_shortest_time(design, path),
    ):
        assert np.isfinite(law.time).all()
        assert_allclose(law.rate[np.isin(law.at, [0.0, 1.0, 2.0, 3.0])], 0.0, atol=1e-12)
        found = trajectory(design, path, law=law, samples=2001)
        assert found.duration == law.duration
        assert (np.diff(found.at) >= 0.0).all()
        assert (found.at[0], found.at[-1]) == (0.0, 3.0)
        rates = np.diff(found.joints, axis=0) / np.diff(found.time)[:, None]
        assert np.abs(rates[[0, -1]]).max() < 0.01 * np.abs(rates).max()


def test_law_at_speed_has_the_speed_and_the_acceleration() -> None:
    _, path = random_case(4)
    law = law_at_speed(OPTIMAL, StraightMoves.along(path, TOOL), 4.0, 20.0)
    found = trajectory(OPTIMAL, path, law=law, samples=4001, tool=TOOL)
    speeds = np.abs(np.diff(found.joints, axis=0)).max(axis=1) / np.diff(found.time)
    changes = np.abs(np.diff(speeds)) / np.diff(found.time)[1:]
    assert speeds.max() == pytest.approx(4.0, rel=1e-3)
    assert np.percentile(changes, 98) == pytest.approx(20.0, rel=0.01)
    # Either the one or the other all along, but where another actuator becomes the fastest.
    is_even = np.isclose(speeds[1:], 4.0, rtol=1e-3)
    assert (is_even | np.isclose(changes, 20.0, rtol=0.02)).mean() > 0.98


def test_law_without_a_limit_or_a_mass_is_refused_in_a_sentence() -> None:
    assert "acceleration_mm_s2" in refusal(lambda: law_of_shortest_time(OPTIMAL, ALONG_GUIDE))
    fast = msgspec.structs.replace(OPTIMAL, actuators=Actuators(speed_mm_s=same_for_all(10.0)))
    assert "nothing limits" in refusal(lambda: law_of_shortest_time(fast, ALONG_GUIDE))
    strong = msgspec.structs.replace(OPTIMAL, actuators=Actuators(push_n=same_for_all(10.0)))
    moves = StraightMoves.along(ALONG_GUIDE)
    words = refusal(time_law.law_of_shortest_time, strong, moves, MovingBodies())
    assert "masses to move" in words
    for speed, acceleration in ((0.0, 1.0), (1.0, -1.0), (1.0, math.nan)):
        words = refusal(law_at_speed, OPTIMAL, moves, speed, acceleration)
        assert "above zero" in words
    assert "no length" in refusal(law_at_speed, OPTIMAL, StraightMoves.along([HOME]), 1.0, 1.0)


def test_shortest_time_of_a_move_that_barely_needs_some_actuators_is_found(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setattr(time_law, "POINTS", 16)
    # The struts of legs 2 and 3 move by millionths of the travel of the carriages.
    design = limited(1.0, 10.0, force=100.0)
    actuators = msgspec.structs.replace(design.actuators, speed_mm_s=None)
    ends = [(X + 0.5 * math.cos(t), Y + 0.5 * math.sin(t), Z) for t in (4.6811, 4.6811 + 0.0628)]
    path = [Pose(end, HOME.quaternion) for end in ends]
    law = law_of_shortest_time(msgspec.structs.replace(design, actuators=actuators), path)
    assert law.duration == pytest.approx(2.0 * math.sqrt(0.0314 / 10.0), rel=1e-3)


def test_law_of_a_path_that_cannot_be_held_or_is_singular_is_refused() -> None:
    weak = limited(1.0, 1.0, force=5.0)
    with pytest.raises(NoAnswerError, match=r"at rest the actuator of .* its limit is 5 N"):
        law_of_shortest_time(weak, ALONG_GUIDE)
    through = [HOME, Pose((X, Y, 0.0), HOME.quaternion)]
    strong = limited(1.0, 1.0, force=1e6)
    with pytest.raises(NoAnswerError, match="singular"):
        law_of_shortest_time(strong, through)
