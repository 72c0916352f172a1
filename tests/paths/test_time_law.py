"""Time laws: trapezoids of the dense travel, moves that add up, limits that are kept and used."""

from __future__ import annotations

import math
import re
from collections.abc import Callable, Iterator
from itertools import pairwise

import msgspec
import numpy as np
import pytest
from machines import same_for_all, six
from numpy.testing import assert_allclose
from refusals import refusal
from tool_moves import tool_move

from explorer import (
    PRESETS,
    Actuators,
    Configuration,
    Design,
    NoAnswerError,
    Payload,
    Pose,
    inverse,
    joint_accelerations,
    joint_rates,
)
from explorer.legs.moves import StraightMoves
from explorer.mechanism.folds import from_folds, to_folds
from explorer.mechanism.pose import Triple
from explorer.motion.inverse_jacobian import forces_of
from explorer.motion.masses import bar_masses, moving_bodies
from explorer.motion.weights import MovingBodies, carry
from explorer.numerics.arrays import FloatArray
from explorer.paths import shortest_time, time_law
from explorer.paths.time_law import PLATFORM, TimeLaw, law_at_speed
from explorer.paths.trajectory import trajectory

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
    return shortest_time.law_of_shortest_time(design, moves, bodies_of(design))


def laws_of(design: Design) -> Iterator[Callable[[list[Pose]], TimeLaw]]:
    """Yield laws of paths: with and without ramps, without a largest speed, the shortest time."""
    for speed, acceleration in ((5.0, 200.0), (5.0, math.inf), (math.inf, 1.0)):
        yield lambda path, v=speed, a=acceleration: law_at_speed(
            design, StraightMoves.along(path), v, a
        )
    yield lambda path: law_of_shortest_time(design, path)


def bodies_of(design: Design) -> MovingBodies:
    return moving_bodies(design, bar_masses(design, DENSITY))


def shares_of_limits(design: Design, law: TimeLaw) -> np.ndarray:
    """Return shares of speeds, accelerations and forces within the intervals, (n, 3, 6)."""
    _, number, share, rate, change, *_ = law.within_intervals(np.linspace(0.0, 1.0, 37).tolist())
    moves = law.travel.moves
    poses = moves.poses(number, share)
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


def travels(path: list[Pose], tool: Triple = (0.0, 0.0, 0.0)) -> list[float]:
    """Return how far the fastest actuator travels in each move, from many small steps."""
    shares = np.linspace(0.0, 1.0, 40_001, dtype=np.float64)
    moves = (tool_move(*ends, shares, np.array(tool)) for ends in pairwise(path))
    steps = (np.abs(np.diff(inverse(OPTIMAL, *poses), axis=0)) for poses in moves)
    return [float(each.max(axis=1).sum()) for each in steps]


def time_of(way: float, speed: float, acceleration: float) -> float:
    """Return the time of a trapezoid, or of a triangle if the speed is not reached."""
    if way * acceleration < speed**2:
        return 2.0 * math.sqrt(way / acceleration)
    return way / speed + (0.0 if math.isinf(acceleration) else speed / acceleration)


def speed_at(time: float, way: float, speed: float, acceleration: float) -> float:
    """Return the speed of a trapezoid at a time since its start."""
    left = time_of(way, speed, acceleration) - time
    return min(speed, acceleration * time, acceleration * left)


def joints_at(law: TimeLaw, time: FloatArray) -> FloatArray:
    motion = law.at(time)
    return inverse(OPTIMAL, *law.travel.moves.poses(motion.number, motion.share))


CASES = [
    (1.5, 3.0),
    (10.0, 10.0),
    (6.0, 100.0),
    (math.sqrt(30.0), 10.0),
    (0.01, 1e6),
    (math.inf, 2.0),
    (2.0, math.inf),
]


@pytest.mark.parametrize(("speed", "acceleration"), CASES)
@pytest.mark.parametrize("seed", [0, 4, 7])
def test_law_at_speed_takes_the_time_of_a_trapezoid_over_the_dense_travel_of_each_move(
    seed: int, speed: float, acceleration: float
) -> None:
    _, path = random_case(seed)
    law = law_at_speed(OPTIMAL, StraightMoves.along(path, TOOL), speed, acceleration)
    times = [time_of(way, speed, acceleration) for way in travels(path, TOOL)]
    assert law.duration == pytest.approx(sum(times), rel=1e-8)


@pytest.mark.parametrize("seed", [0, 4, 7])
def test_fastest_actuator_has_the_speed_of_the_trapezoid_at_any_time(seed: int) -> None:
    _, path = random_case(seed)
    speed, acceleration = 4.0, 20.0
    law = law_at_speed(OPTIMAL, StraightMoves.along(path, TOOL), speed, acceleration)
    begin, step = 0.0, 1e-6
    for way in travels(path, TOOL):
        duration = time_of(way, speed, acceleration)
        times = np.random.default_rng(seed).uniform(0.01, 0.99, 200) * duration
        expected = [speed_at(time, way, speed, acceleration) for time in times.tolist()]
        before, after = (joints_at(law, begin + times + sign * step) for sign in (-1.0, 1.0))
        rates = (after - before) / (2.0 * step)
        assert_allclose(np.abs(rates).max(axis=1), expected, rtol=1e-4)
        motion = law.at(begin + times)
        assert_allclose(motion.rate[:, None] * motion.slope, rates, atol=1e-4)
        begin += duration


def test_accelerations_of_a_law_are_the_differences_of_its_speeds() -> None:
    design, path = random_case(3)
    moves = StraightMoves.along(path, TOOL)
    slow = law_at_speed(OPTIMAL, moves, 4.0, 20.0)
    for law in (slow, slow.lasting(0.4), law_of_shortest_time(design, path, TOOL)):
        inside = law.within_intervals([0.3, 0.7])
        change = inside.change[:, None] * inside.slope
        change += inside.rate[:, None] ** 2 * inside.curvature
        rates = (inside.rate[:, None] * inside.slope).reshape(-1, 2, 6)
        steps = 0.4 * np.diff(law.time)[:, None]
        mean = change.reshape(-1, 2, 6).mean(axis=1)
        assert_allclose(np.diff(rates, axis=1)[:, 0] / steps, mean, atol=2e-3 * np.abs(mean).max())
        leads = law.intervals.leader < PLATFORM
        row, leader = np.flatnonzero(leads), law.intervals.leader[leads]
        of_leaders = np.abs(change.reshape(-1, 2, 6)[row, :, leader]).T
        assert_allclose(of_leaders, [np.abs(law.acceleration[row])] * 2, rtol=1e-6, atol=1e-12)


def test_law_with_a_short_ramp_reaches_its_acceleration_and_never_exceeds_its_speed() -> None:
    path = [Pose(p, HOME.quaternion) for p in ((5.0, -2.0, 5.0), (14.0, 9.0, 11.0))]
    law = law_at_speed(OPTIMAL, StraightMoves.along(path), 2.0, 200.0)
    ends = law.within_intervals([0.0, 1.0])
    change = ends.change[:, None] * ends.slope + ends.rate[:, None] ** 2 * ends.curvature
    assert np.abs(change).max() == pytest.approx(200.0, rel=1e-6)
    speeds = np.abs(ends.rate[:, None] * ends.slope).max(axis=1)
    assert speeds.max() == pytest.approx(2.0, rel=1e-9)


def test_law_of_a_duration_has_one_acceleration_and_the_top_speeds_of_its_moves() -> None:
    corners = ((10.0, 5.0, 9.0), (10.0, 5.0, 11.0), (14.0, 3.0, 11.0), (14.0, 3.0, 9.0))
    path, duration = [Pose(p, HOME.quaternion) for p in corners], 0.5
    law = law_at_speed(OPTIMAL, StraightMoves.along(path), acceleration=1.0).lasting(duration)
    ways = travels(path)
    acceleration = (2.0 * sum(map(math.sqrt, ways)) / duration) ** 2
    assert law.duration == pytest.approx(duration, rel=1e-12)
    assert_allclose(np.unique(np.abs(law.acceleration).round(6)), [acceleration], rtol=1e-8)
    top = max(math.sqrt(way * acceleration) for way in ways)
    assert law.speed.max() == pytest.approx(top, rel=1e-8)
    assert 10.0 * top == pytest.approx(386.175, abs=5e-4)


def test_laws_of_a_path_are_the_sequence_of_the_laws_of_its_moves() -> None:
    design, path = random_case(9)
    there_and_back = [path[0], path[1]] * 13 + [path[0]]
    for law_of in laws_of(design):
        pairs = pairwise(path)
        parts = [law_of(list(ends)) for ends in pairs]
        whole, back = law_of(path), law_of([path[1], path[0]])
        assert whole.duration == pytest.approx(sum(each.duration for each in parts), rel=1e-9)
        speeds = np.concatenate([each.speed for each in parts])
        assert_allclose(whole.speed, speeds, rtol=1e-6, atol=1e-9)
        expected = 13.0 * (parts[0].duration + back.duration)
        assert law_of(there_and_back).duration == pytest.approx(expected, rel=1e-9)


@pytest.mark.parametrize(
    ("speed", "acceleration"), [(1.5, 3.0), (10.0, 10.0), (6.0, 100.0), (math.sqrt(30.0), 10.0)]
)
def test_laws_along_the_guide_have_the_time_of_a_bang_bang_motion(
    speed: float, acceleration: float
) -> None:
    expected = time_of(WAY, speed, acceleration)
    steady = law_at_speed(OPTIMAL, StraightMoves.along(ALONG_GUIDE), speed, acceleration)
    shortest = law_of_shortest_time(limited(speed, acceleration), ALONG_GUIDE)
    assert steady.duration == pytest.approx(expected, rel=1e-9)
    assert shortest.duration == pytest.approx(expected, rel=1e-3)


@pytest.mark.parametrize("seed", range(6))
def test_law_of_shortest_time_exceeds_no_limit_and_uses_one_everywhere(
    seed: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    design, path = random_case(seed)
    law = law_of_shortest_time(design, path, TOOL)
    shares = shares_of_limits(design, law)
    assert shares.max() <= 1.0 + 1e-5
    assert (shares.max(axis=(1, 2)) > 0.98).mean() > 0.95
    monkeypatch.setattr(time_law, "INTERVALS", 10 * time_law.INTERVALS)
    monkeypatch.setattr(time_law, "MOST_INTERVALS", 2000)
    finer = law_of_shortest_time(design, path, TOOL)
    assert law.duration == pytest.approx(finer.duration, rel=3e-3)


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
        corners = np.isin(law.intervals.share, [0.0, 1.0])
        assert corners.sum() == 4
        assert_allclose(law.speed[corners], 0.0, atol=1e-12)
        found = trajectory(design, path, law=law, samples=2001)
        assert found.duration == law.duration
        assert (np.diff(found.at) >= 0.0).all()
        assert (found.at[0], found.at[-1]) == (0.0, 3.0)
        rates = np.diff(found.joints, axis=0) / np.diff(found.time)[:, None]
        assert np.abs(rates[[0, -1]]).max() < 0.01 * np.abs(rates).max()


def test_law_with_pauses_is_that_without_them_and_rests_at_its_corners() -> None:
    design, path = random_case(9)
    path.insert(1, path[1])
    pauses = [0.2, 0.0, 0.5, 0.3]
    for law_of in laws_of(design):
        law = law_of(path)
        paused = law.with_pauses(pauses)
        assert paused.duration == pytest.approx(law.duration + 1.0, rel=1e-12)
        time = np.linspace(0.0, law.duration, 101)[1:-1]
        before = law.at(time)
        # The second move has no length, so that both of its pauses stand before the third one.
        later = pauses[0] + np.where(before.number == 0, 0.0, pauses[2])
        moved = paused.at(time + later)
        assert_allclose(moved.number + moved.share, before.number + before.share, atol=1e-9)
        assert_allclose(moved.rate, before.rate, rtol=1e-6, atol=1e-9)
        found = trajectory(design, path, law=paused, samples=4001)
        assert (found.at[0], found.at[-1]) == (0.0, 3.0)
        assert (np.diff(found.at) >= 0.0).all()
        resting = paused.within_intervals([0.5])
        still = paused.pause > 0.0
        assert paused.pause[still].tolist() == [0.2, 0.5, 0.3]
        assert not resting.rate[still].any()
        assert not resting.change[still].any()
        assert np.isfinite(resting.change).all()
    slower = law_at_speed(design, StraightMoves.along(path), acceleration=1.0).with_pauses(pauses)
    assert slower.lasting(3.0).duration == pytest.approx(3.0, rel=1e-12)
    assert_allclose(slower.lasting(3.0).steps[slower.pause > 0.0], [0.2, 0.5, 0.3])
    assert "the pauses take 1 s of the 0.9 s" in refusal(slower.lasting, 0.9)
    for wrong in ([0.1], [0.0, 0.0, -0.1, 0.0]):
        assert "as many pauses" in refusal(slower.with_pauses, wrong)


@pytest.mark.parametrize("seed", range(6))
def test_times_of_places_are_those_at_which_the_law_is_there(seed: int) -> None:
    design, path = random_case(seed)
    pauses = np.random.default_rng(seed).uniform(0.0, 9.0, len(path)) * (np.arange(len(path)) % 2)
    for law_of in laws_of(design):
        for law in (law_of(path), law_of(path).with_pauses(pauses.tolist())):
            time = np.linspace(0.0, law.duration, 301)
            place, motion = law.places_at(time), law.at(time)
            assert np.array_equal(place, motion.number + motion.share)
            assert (np.diff(place) >= 0.0).all()
            arrival = law.times_at(place)
            assert_allclose(law.places_at(arrival), place, atol=1e-9)
            assert (arrival <= time + 1e-9 * law.duration).all()
            is_moving = motion.rate > 0.0
            assert_allclose(arrival[is_moving], time[is_moving], atol=1e-9 * law.duration)
            sampled = law.sample_times(20)
            assert (np.diff(sampled) > 0.0).all()
            assert (sampled[0], sampled[-1]) == (0.0, law.duration)
            assert len(sampled) == 20 * (len(path) - 1) + np.count_nonzero(law.pause) + 1


def test_moves_below_the_rounding_of_a_table_take_no_time() -> None:
    design, path = random_case(9)
    x, y, z = path[-1].position
    rounded = [HOME, *path, Pose((x, y + 1e-11, z), path[-1].quaternion)]
    for law_of in laws_of(design):
        law, same = law_of(path), law_of(rounded)
        assert_allclose(same.time, law.time, rtol=1e-12)
        assert_allclose(same.speed, law.speed, rtol=1e-12)
        found = trajectory(design, rounded, law=same)
        assert (found.at[0], found.at[-1]) == (0.0, 4.0)
        assert (np.diff(found.at) >= 0.0).all()


def test_law_passes_a_pose_in_which_all_actuators_rest() -> None:
    # A turn about the line b2b3 moves l1 alone, and l1 is the longest where the fold is flat.
    flat, turn = 0.0, 0.3
    r, beta, epsilon, _, phi2, phi3 = to_folds(HOME.position, HOME.rotation)
    ends = [from_folds((r, beta, epsilon, flat + sign * turn, phi2, phi3)) for sign in (-1.0, 1.0)]
    path = [Pose.of(*each) for each in ends]
    (way,) = travels(path)
    law = law_at_speed(OPTIMAL, StraightMoves.along(path), 1.0)
    assert law.duration == pytest.approx(way, rel=1e-3)
    times = np.linspace(0.0, law.duration, 1001, dtype=np.float64)
    motion = law.at(times)
    assert np.isfinite(motion.share).all()
    assert (np.diff(motion.share) > 0.0).all()
    rates = np.abs(np.diff(joints_at(law, times), axis=0)).max(axis=1) / np.diff(times)
    assert_allclose(np.sort(rates)[2:], 1.0, rtol=1e-3)


def test_force_at_rest_just_beyond_its_limit_is_told_with_digits_that_differ() -> None:
    def words(force: float) -> str:
        try:
            law_of_shortest_time(limited(1.0, 1.0, force), ALONG_GUIDE)
        except NoAnswerError as error:
            return str(error)
        return ""

    needed = float(words(1.0).partition("needs ")[2].split()[0])
    weak, strong = 0.999 * needed, 1.001 * needed
    assert words(weak)
    assert not words(strong)
    while strong - weak > 1e-7 * needed:
        middle = 0.5 * (weak + strong)
        weak, strong = (middle, strong) if words(middle) else (weak, middle)
    force, limit = re.findall(r"([\d.]+) N", words(weak))
    assert force != limit


def test_law_without_a_limit_or_a_mass_is_refused_in_a_sentence() -> None:
    assert "acceleration_mm_s2" in refusal(lambda: law_of_shortest_time(OPTIMAL, ALONG_GUIDE))
    fast = msgspec.structs.replace(OPTIMAL, actuators=Actuators(speed_mm_s=same_for_all(10.0)))
    assert "nothing limits" in refusal(lambda: law_of_shortest_time(fast, ALONG_GUIDE))
    strong = msgspec.structs.replace(OPTIMAL, actuators=Actuators(push_n=same_for_all(10.0)))
    moves = StraightMoves.along(ALONG_GUIDE)
    words = refusal(shortest_time.law_of_shortest_time, strong, moves, MovingBodies())
    assert "masses to move" in words
    for speed, acceleration in ((0.0, 1.0), (1.0, -1.0), (1.0, math.nan)):
        words = refusal(law_at_speed, OPTIMAL, moves, speed, acceleration)
        assert "above zero" in words
    assert "no length" in refusal(law_at_speed, OPTIMAL, StraightMoves.along([HOME]), 1.0, 1.0)


def test_shortest_time_of_a_move_that_barely_needs_some_actuators_is_found() -> None:
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
