"""The claims of the paper: their verdicts follow from the values, and the values are true."""

from __future__ import annotations

import re
from collections.abc import Callable
from typing import Any, get_args

import claims_page
import numpy as np
import pytest
from command_line import CommandLine
from numpy.typing import ArrayLike
from scipy.spatial.transform import Rotation

from explorer import PRESETS, InputError, from_folds, to_folds, workspace_volume
from explorer.files.packaged import read_page
from explorer.legs.clearance import write_closest
from explorer.mechanism.configuration import Configuration
from explorer.mechanism.folds import FOLDS
from explorer.mechanism.kinematics import inverse
from explorer.mechanism.margins import margins
from explorer.mechanism.pose import Pose
from explorer.numerics.arrays import FloatArray
from explorer.reproduce import comparison, flags, interference
from explorer.reproduce.claim import Result, Verdict, random_poses
from explorer.reproduce.claims import CLAIMS, measure_claims
from explorer.reproduce.kinematics import conditions_at_crossings, paths_at, random_paths
from explorer.singularity.freedoms import UNCOUPLED
from explorer.six_legged.case import TableCase
from explorer.six_legged.files import TABLES, six_four_twin
from explorer.six_legged.table import TablePoses
from explorer.workspace.accessible.radii import with_radius
from explorer.workspace.limits.valid_poses import poses_are_valid
from explorer.workspace.orientations.share import orientation_share

OPTIMAL = PRESETS["paper-optimal"]


# Claims whose measurement searches long.
LONG = ("search", "orientations")


@pytest.fixture(scope="module")
def results() -> dict[str, Result]:
    """Return the claims but those that search long, measured once."""
    names = (name for name in CLAIMS if name not in LONG)
    return {result.claim.name: result for result in measure_claims(names)}


def test_manual_has_each_claim_as_it_is_measured(results: dict[str, Result]) -> None:
    manual = read_page("claims.md")
    for result in results.values():
        text = claims_page.page([result]).removeprefix(claims_page.HEAD)
        row, section = text.removesuffix(claims_page.TAIL).split("\n", 1)
        assert row in manual
        assert section in manual


@pytest.mark.long
def test_manual_is_made_of_all_claims_and_conditions_stand_where_needed() -> None:
    measured = list(measure_claims())
    assert claims_page.page(measured) == read_page("claims.md")
    for result in measured:
        measurement = result.measurement
        assert measurement.verdict in get_args(Verdict)
        assert bool(measurement.condition) == (measurement.verdict == "confirmed within")


def test_single_actuators_of_uncoupled_motions_are_l1_and_l4(results: dict[str, Result]) -> None:
    values: Any = results["uncoupled-motions"].measurement.values
    moves = values["margins_of_actuators"]
    assert moves.pop("l1") == ("δ1",)
    assert moves.pop("l4") == ("δ3",)
    assert all(len(which) > 1 for which in moves.values())


# A pose within all limits of the optimum and off all singularities, in general position.
DEPENDENT = Pose((3.36818, 9.35633, 4.83913), (0.835148, -0.486356, -0.178114, -0.185095))


@pytest.mark.parametrize(("pose", "least"), [(OPTIMAL.home_pose, 1e-9), (DEPENDENT, 1e-4)])
def test_folds_are_regular_where_the_six_motions_made_once_are_no_chart(
    pose: Pose, least: float
) -> None:
    assert np.abs(margins(pose.position, pose.rotation)).min() > 0.1 * OPTIMAL.reach

    def singular_values(points_at: Callable[[int, float], FloatArray]) -> FloatArray:
        """Return the singular values of the directions in which points of the platform move."""
        step = 1e-5
        moves = [points_at(k, step) - points_at(k, -step) for k in range(6)]
        directions = np.array([move / np.linalg.norm(move) for move in moves])
        return np.asarray(np.linalg.svd(directions, compute_uv=False), dtype=np.float64)

    def points(position: ArrayLike, rotation: FloatArray) -> FloatArray:
        corners = np.vstack([np.eye(3), np.zeros((1, 3))]) * OPTIMAL.reach
        return (np.asarray(position) + corners @ rotation.T).ravel()

    def by_motion(k: int, amount: float) -> FloatArray:
        after = UNCOUPLED[k].move(pose, amount)
        return points(after.position, after.rotation)

    def by_fold(k: int, amount: float) -> FloatArray:
        folds = to_folds(pose.position, pose.rotation)
        folds[k] += amount
        return points(*from_folds(folds))

    *_, fifth, sixth = singular_values(by_motion)
    assert sixth < least < 1e-2 < fifth
    assert singular_values(by_fold).min() > 0.05


def test_table_of_the_charts_states_the_margins_that_each_coordinate_changes() -> None:
    random = np.random.default_rng(4)
    folds = to_folds(*random_poses(random, 100, 1.0))
    before = margins(*from_folds(folds))
    for line in flags.TABLE[1:]:
        name, *_ = line.removeprefix("−").split()
        other = folds.copy()
        column = FOLDS.index(name)
        # Within the range of its box, so that no sign changes.
        other[:, column] *= 0.9
        after = margins(*from_folds(other))
        changes = np.abs(after - before).max(axis=0) > 1e-9
        assert [f"δ{k + 1}" in line for k in range(3)] == changes.tolist()
        assert (np.sign(after) == np.sign(before)).all()
        if column >= 3:
            other[:, column] = -folds[:, column]
            flipped = (np.sign(margins(*from_folds(other))) != np.sign(before)).all(axis=0)
            assert flipped.tolist() == [f"δ{k + 1}" in line for k in range(3)]


def test_table_one_is_the_printed_one(results: dict[str, Result]) -> None:
    values: Any = results["table-1"].measurement.values
    initial, optimal = values["table1"]
    assert (initial["node_count"], optimal["node_count"]) == (2468, 999)
    assert optimal["node_volume"] == 7992.0
    assert optimal["volume"] == pytest.approx(7053.044, abs=1e-3)
    assert initial["volume"] == pytest.approx(845.414, abs=1e-3)
    assert values["nodes_by_yaw"]["-73.6"] == 1002
    assert values["nodes_by_yaw"]["-90"] == 1067


@pytest.mark.parametrize("a2x", [5.0, 18.0])
def test_clearances_of_the_twin_are_distances_of_its_legs_from_point_to_point(a2x: float) -> None:
    twin, rotation = six_four_twin(interference.OPTIMAL, a2x), OPTIMAL.home_pose.rotation
    position = np.random.default_rng(1).uniform((2.0, 0.0, 3.0), (18.0, 12.0, 15.0), (1, 3))
    axes = TablePoses(twin, position, rotation).ends[0]
    found = interference.clearances(twin, position)[0]
    pairs = interference.pairs_of(twin)
    assert len(pairs) == 15 - 6
    work = np.empty((2, 3))
    expected = [write_closest(axes[i], axes[j], work) for i, j in pairs]
    np.testing.assert_allclose(found, expected, atol=1e-12)
    home = OPTIMAL.home_pose
    points = Configuration(OPTIMAL, home.position, home.rotation).points
    for leg, tip in zip(twin.home_poses.ends, ("b1", "b2", "b3", "b2", "b3", "b4"), strict=True):
        np.testing.assert_allclose(leg[1], getattr(points, tip), atol=1e-12)


def test_compared_mechanisms_have_actuators_of_one_stroke() -> None:
    reach, random = OPTIMAL.reach, np.random.default_rng(3)
    position = random.uniform(-2.0 * reach, 2.0 * reach, (100_000, 3))
    for rotation in (
        OPTIMAL.home_pose.rotation,
        np.asarray(Rotation.random(rng=random).as_matrix()),
    ):
        turned = np.broadcast_to(rotation, (len(position), 3, 3))
        kept = inverse(OPTIMAL, position, rotation)[comparison.four_four(position, turned)]
        assert (np.ptp(kept, axis=0) <= reach).all()
    for table in (*comparison.TWINS, comparison.two_circles(0.4, 0.6, 15.0)):
        assert table.shortest_mm == (0.0,) * 6
        assert table.longest_mm == (reach,) * 6


def test_share_of_the_four_four_is_that_of_its_own_measure() -> None:
    turns = np.asarray(Rotation.random(40_000, rng=np.random.default_rng(2)).as_matrix())
    share = comparison.four_four(np.tile([10.0, 5.0, 9.0], (len(turns), 1)), turns).mean()
    assert share == pytest.approx(orientation_share(OPTIMAL, (10.0, 5.0, 9.0)).share, abs=6e-3)


def test_volumes_are_those_of_a_plain_count(results: dict[str, Result]) -> None:
    values: Any = results["workspace"].measurement.values
    told = {each["name"]: each["volume"] for each in values["mechanisms"]}
    reach, home = OPTIMAL.reach, OPTIMAL.home_pose
    axis = np.arange(-1.1 * reach, 1.1 * reach, 0.5)
    grid = np.stack(np.meshgrid(axis, axis, axis, indexing="ij"), axis=-1).reshape(-1, 3)
    signs = np.sign(margins(home.position, home.rotation))
    of_mode = (np.sign(margins(grid, home.rotation)) == signs).all(axis=1)
    twin, table = comparison.TWINS[1], comparison.two_circles(0.4, 0.6, 15.0)
    for mechanism, rotation, kept in (
        (twin, home.rotation, of_mode),
        (table, np.eye(3), grid[:, 2] > 0.0),
    ):
        count = int((TableCase(mechanism).holds(grid, rotation) & kept).sum())
        expected = count * 0.5**3 / reach**3
        assert told[mechanism.name] == pytest.approx(expected, rel=0.02)


def test_legs_2_and_3_are_as_far_apart_as_their_carriages(results: dict[str, Result]) -> None:
    values: Any = results["interference"].measurement.values
    home = OPTIMAL.home_pose
    joints = inverse(OPTIMAL, home.position, home.rotation)
    assert values["legs_2_and_3_apart"] == pytest.approx(abs(joints[3] - joints[1]), rel=1e-12)
    four = values["mechanisms"][0]
    # Longer steps along x sweep over the other leg, shorter ones do not.
    assert [shares[0] for shares in four["steps"]] == [0.0, 1.0, 1.0]


def test_share_of_free_nodes_is_that_of_legs_as_capsules(results: dict[str, Result]) -> None:
    values: Any = results["interference"].measurement.values
    told = values["mechanisms"][0]["free"][interference.RADII.index(0.3)]
    design = with_radius(OPTIMAL, 0.3)
    lows, highs = OPTIMAL.limits.box or ((), ())
    axes = [np.arange(low, high + 0.5) for low, high in zip(lows, highs, strict=True)]
    grid = np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1).reshape(-1, 3)
    grid = grid[grid[:, 2] >= interference.FROM]
    rotation = OPTIMAL.home_pose.rotation
    inside = grid[poses_are_valid(OPTIMAL, grid, rotation)]
    assert poses_are_valid(design, inside, rotation).mean() == pytest.approx(told, abs=1e-12)


def test_paths_join_two_modes_of_the_same_joints() -> None:
    count = 200
    paths = random_paths(np.random.default_rng(3), count)
    (p, r), (q, s) = (paths_at(np.full(count, share), *paths) for share in (0.0, 1.0))
    np.testing.assert_allclose(inverse(OPTIMAL, p, r), inverse(OPTIMAL, q, s), atol=1e-6)
    assert (np.sign(margins(p, r)) != np.sign(margins(q, s))).any(axis=1).all()


def test_path_that_stays_in_a_mode_has_no_singular_pose() -> None:
    home = OPTIMAL.home_pose
    way, detour = np.zeros((2, 1, 6))
    way[0, 0], detour[0, :3] = 1.0, 0.5
    path = np.array([home.position]), home.rotation[None], way, detour
    assert conditions_at_crossings(*path)[0] > 1e-3


def test_command_writes_the_keys_of_the_contract(
    capsys: pytest.CaptureFixture[str],
) -> None:
    cli = CommandLine(capsys, has_progress=True)
    found = cli.answer("reproduce", "--claim", "strata", "table-1")
    keys = {"claim", "reading", "paper", "measured", "verdict", "command"}
    assert [keys <= claim.keys() for claim in found["claims"]] == [True, True]
    assert cli.text("reproduce", "--claim", "strata").startswith("CONFIRMED")


def test_command_measures_tables_beside_the_optimum(capsys: pytest.CaptureFixture[str]) -> None:
    cli = CommandLine(capsys)
    found = cli.answer("reproduce", "--beside", "octahedral")
    case = TableCase(TABLES["octahedral"])
    assert found["claims"] == []
    assert found["beside"]["volume_mm3"] == pytest.approx(case.volume.volume, rel=1e-12)
    forces = float(case.home_indices.force_per_newton)
    assert found["beside"]["force_per_newton"] == pytest.approx(forces, rel=1e-12)
    assert found["beside"]["longest_leg_mm"] == 380.0
    volume = workspace_volume(PRESETS["paper-optimal"]).volume
    assert found["design"]["volume_mm3"] == pytest.approx(1e3 * volume, rel=1e-12)
    assert "give --beside TABLE_OR_FILE" in cli.refusal("reproduce", "--equal")
    names = ("octahedral", "LinuxCNC default")
    several = cli.answer("reproduce", "--beside", *names, "--equal")["beside"]
    assert [each["name"] for each in several] == [*names]
    text = cli.text("reproduce", "--beside", "octahedral")
    assert re.search(r"global transmission index +0\.16550\d +0\.90812\d", text)
    assert re.search(r"volume +mm\S+ +7\.05304e\+06  <= 8\.92169e\+06", text)
    assert "The sign of det J is no assembly mode of a table" in " ".join(text.split())
    assert "packaged tables are Dietmaier" in cli.refusal("reproduce", "--beside", "no-such-table")


def test_unknown_claim_is_refused() -> None:
    with pytest.raises(InputError, match="no claim 'nothing'; there are same-kinematics"):
        list(measure_claims(["nothing"]))
