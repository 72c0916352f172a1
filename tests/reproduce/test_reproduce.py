"""The claims of the paper: their verdicts follow from the values, and the values are true."""

from __future__ import annotations

import itertools
import json
import re
from typing import Any

import numpy as np
import pytest
from command_line import CommandLine
from scipy.optimize import minimize
from scipy.spatial.transform import Rotation

from explorer import PRESETS, InputError
from explorer.files.manual import read_page
from explorer.files.packaged import packaged_file
from explorer.mechanism.home import home_pose
from explorer.mechanism.kinematics import attachment_points, inverse
from explorer.mechanism.margins import margins
from explorer.mechanism.pose import Pose
from explorer.numerics.arrays import FloatArray
from explorer.reproduce import comparison
from explorer.reproduce.claim import VERDICTS, Result
from explorer.reproduce.claims import CLAIMS, measure_claims
from explorer.reproduce.mode_paths import Paths, least_condition_on, random_paths
from explorer.reproduce.six_legs import SixLegs, octahedral, six_four_twin
from explorer.singularity.uncoupled import UNCOUPLED
from explorer.workspace.orientations.share import orientation_share

OPTIMAL = PRESETS["paper-optimal"]
NUMBER = re.compile(r"[-−+]?\d[\d.,]*(?:e[-+]?\d+)?")


@pytest.fixture(scope="module")
def results() -> dict[str, Result]:
    """Return all claims, measured once."""
    return {result.claim.name: result for result in measure_claims()}


def test_verdicts_are_those_of_the_manual(results: dict[str, Result]) -> None:
    page = read_page("claims.md")
    listed = json.loads(packaged_file("claims", "claims.json").read_text("utf-8"))
    for result, row in zip(results.values(), listed, strict=True):
        assert result.measured.verdict in VERDICTS
        assert f"| {result.claim.title} | {result.measured.verdict} |" in page
        assert row["claim"] == result.claim.title
        assert row["verdict"] == result.measured.verdict
        words = NUMBER.sub("#", result.measured.text)
        assert NUMBER.sub("#", row["measured"]) == words
        assert result.claim.command in page
        assert result.claim.paper in page


def test_values_are_the_same_each_time(results: dict[str, Result]) -> None:
    again = {result.claim.name: result for result in measure_claims()}
    assert {name: result.measured for name, result in again.items()} == {
        name: result.measured for name, result in results.items()
    }


def test_every_mode_is_found_and_nothing_else(results: dict[str, Result]) -> None:
    figures: Any = results["closed-form"].measured.figures
    assert figures["modes_missed"] == figures["other_solutions"] == 0
    assert figures["modes_found"] == 256
    assert figures["converged"] > 0.9 * figures["starts"]


def test_single_actuators_of_uncoupled_motions_are_l1_and_l4(results: dict[str, Result]) -> None:
    figures: Any = results["uncoupled-motions"].measured.figures
    moves = figures["margins_of_actuators"]
    assert moves.pop("l1") == ("δ1",)
    assert moves.pop("l4") == ("δ3",)
    assert all(len(which) > 1 for which in moves.values())


def test_counterexample_of_the_charts_is_one(results: dict[str, Result]) -> None:
    figures: Any = results["charts"].measured.figures
    rotation = Rotation.from_quat(figures["quaternion"], scalar_first=True).as_matrix()
    position = np.array(figures["position"])
    assert np.abs(margins(position, rotation)).min() > 0.01 * OPTIMAL.reach
    # Points of the platform, moved a little along each motion, span one dimension too few.
    step = 1e-6
    here = Pose.of(tuple(figures["position"]), rotation)

    def moved(k: int, amount: float) -> FloatArray:
        other = UNCOUPLED[k].moved(here, amount)
        points = np.vstack([np.eye(3), np.zeros((1, 3))]) * OPTIMAL.reach
        return (np.array(other.position) + points @ other.rotation.T).ravel()

    columns = [(moved(k, step) - moved(k, -step)) / (2.0 * step) for k in range(6)]
    scaled = np.column_stack([c / np.linalg.norm(c) for c in columns])
    values = np.linalg.svd(scaled, compute_uv=False)
    assert values[5] < 1e-6 * values[0]
    assert values[4] > 1e-4 * values[0]


def test_table_one_is_the_printed_one(results: dict[str, Result]) -> None:
    figures: Any = results["table-1"].measured.figures
    initial, optimal = figures["table1"]
    assert (initial["node_count"], optimal["node_count"]) == (2468, 999)
    assert optimal["node_volume"] == 7992.0
    assert optimal["volume"] == pytest.approx(7053.044, abs=1e-3)
    assert initial["volume"] == pytest.approx(845.414, abs=1e-3)
    assert figures["nodes_by_yaw"]["-73.6"] == 1002
    assert figures["nodes_by_yaw"]["-90"] == 1067


def least_distance(one: FloatArray, two: FloatArray) -> float:
    """Return the distance of two segments by a bounded search over both."""

    def square(shares: FloatArray) -> float:
        a = one[0] + shares[0] * (one[1] - one[0])
        b = two[0] + shares[1] * (two[1] - two[0])
        return float(((a - b) ** 2).sum())

    found = [
        minimize(square, start, bounds=[(0, 1), (0, 1)], options={"ftol": 1e-15}).fun
        for start in itertools.product((0.1, 0.9), repeat=2)
    ]
    return float(np.sqrt(min(found)))


@pytest.mark.parametrize("seed", range(4))
def test_clearances_of_the_twin_are_distances_of_its_legs(seed: int) -> None:
    random = np.random.default_rng(seed)
    twin = six_four_twin(OPTIMAL, float(random.uniform(4.0, 20.0)))
    position = random.uniform((2.0, 0.0, 3.0), (18.0, 12.0, 15.0), (1, 3))
    rotation = np.asarray(Rotation.random(rng=random).as_matrix())
    axes = twin.axes(position, rotation)[0]
    found = twin.clearances(position, rotation)[0]
    assert len(twin.pairs) == 15 - 6
    for (i, j), distance in zip(twin.pairs.tolist(), found.tolist(), strict=True):
        assert distance == pytest.approx(least_distance(axes[i], axes[j]), abs=1e-5)


def test_legs_of_the_twin_join_the_points_of_the_design() -> None:
    home = home_pose(OPTIMAL)
    twin = six_four_twin(OPTIMAL, 12.0)
    points = attachment_points(OPTIMAL, home.position, home.rotation)
    axes = twin.axes(np.array(home.position)[None], home.rotation)[0]
    for leg, tip in zip(axes, ("b1", "b2", "b3", "b2", "b3", "b4"), strict=True):
        np.testing.assert_allclose(leg[1], getattr(points, tip), atol=1e-12)


@pytest.mark.parametrize("mechanism", [six_four_twin(OPTIMAL, 12.0), octahedral(OPTIMAL)])
def test_determinant_is_that_of_the_rates_of_the_lengths(mechanism: SixLegs) -> None:
    random = np.random.default_rng(1)
    position = random.uniform(2.0, 15.0, 3)
    rotation = np.asarray(Rotation.random(rng=random).as_matrix())

    def lengths(twist: FloatArray) -> FloatArray:
        turned = Rotation.from_rotvec(twist[3:]).as_matrix() @ rotation
        axes = mechanism.axes((position + twist[:3])[None], turned)[0]
        return np.linalg.norm(axes[:, 1] - axes[:, 0], axis=-1)

    step = 1e-6
    rates = [(lengths(step * unit) - lengths(-step * unit)) / (2 * step) for unit in np.eye(6)]
    expected = np.linalg.det(np.column_stack(rates))
    found = mechanism.determinant(position[None], rotation[None])[0]
    assert found == pytest.approx(expected, rel=1e-5, abs=1e-6)


def test_octahedral_platform_has_the_areas_of_the_design() -> None:
    other = octahedral(OPTIMAL)
    area = 0.5 * np.linalg.norm(
        np.cross(other.base[1] - other.base[0], other.base[3] - other.base[0])
    )
    assert area == pytest.approx(0.5 * OPTIMAL.a2x * OPTIMAL.a3[1], rel=1e-12)


def test_share_of_the_four_four_is_that_of_its_own_measure() -> None:
    design = OPTIMAL
    position = np.array([10.0, 5.0, 9.0])
    turns = np.asarray(Rotation.random(40_000, rng=np.random.default_rng(2)).as_matrix())
    share = comparison.four_four(np.tile(position, (len(turns), 1)), turns).mean()
    assert share == pytest.approx(orientation_share(design, (10.0, 5.0, 9.0)).share, abs=6e-3)


def test_mobility_of_all_mechanisms_is_six() -> None:
    figures: Any = comparison.simplicity().figures
    for parts in figures["mechanisms"]:
        assert 6 * (parts["bodies"] - parts["joints"]) + parts["freedoms"] == 6


def test_paths_join_two_modes_of_the_same_joints() -> None:
    count = 200
    found = random_paths(np.random.default_rng(3), count)
    which = np.arange(count)
    (p, r), (q, s) = (found.poses(which, np.full(count, share)) for share in (0.0, 1.0))
    np.testing.assert_allclose(inverse(OPTIMAL, p, r), inverse(OPTIMAL, q, s), atol=1e-6)
    assert (np.sign(margins(p, r)) != np.sign(margins(q, s))).any(axis=1).all()


def test_path_that_stays_in_a_mode_has_no_singular_pose() -> None:
    home = home_pose(OPTIMAL)
    points = np.tile(home.position, (1, 3, 1)) + [[[0.0] * 3, [0.5] * 3, [1.0, 0.0, 0.0]]]
    still = np.zeros((1, 3))
    path = Paths(points, home.rotation[None], still, still)
    assert least_condition_on(path).tolist() == [np.inf]


def test_unknown_claim_is_refused() -> None:
    with pytest.raises(InputError, match="no claim 'nothing'; there are closed-form"):
        list(measure_claims(["nothing"]))


def test_command_writes_the_keys_of_the_contract(capsys: pytest.CaptureFixture[str]) -> None:
    cli = CommandLine(capsys, has_progress=True)
    found = cli.answer("reproduce", "--claim", "simpler", "cheaper")
    keys = {"claim", "reading", "paper", "measured", "verdict", "command"}
    assert [keys <= claim.keys() for claim in found["claims"]] == [True, True]
    text = cli.text("reproduce", "--claim", "cheaper")
    assert text.startswith("NOT TESTABLE FROM THE PAPER: It is cheaper")


def test_page_names_every_claim_once() -> None:
    page = read_page("claims.md")
    for claim in CLAIMS.values():
        assert page.count(f"\n## {claim.title}\n") == 1
