"""The nearest singular poses beside SLSQP from many starts, all strata, and crossings."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
from multistart import searched_distance
from scipy.spatial.transform import Rotation

from benchmarks.samples import DESIGN, SIZE, around_home
from benchmarks.table import Row, seconds, times
from benchmarks.timing import best_of
from explorer import Pose, nearest_singularities
from explorer.mechanism.configuration import Configuration
from explorer.numerics.compiled import warm
from explorer.paths.crossings import path_margins
from explorer.singularity.nearest import nearest_singular_poses
from explorer.singularity.nearest_stratum import nearest_in_strata

CALLS, POSES, SEARCHES, MOVES = 200, 5_000, 10, 100
# So many that the search, too, finds the nearest for nearly all poses.
STARTS = 12
SHORT = {"CALLS": 5, "POSES": 50, "SEARCHES": 1, "MOVES": 3, "STARTS": 3}


def run() -> Iterator[Row]:
    """Yield the rows."""
    positions, rotations, _ = around_home(POSES)
    poses = [Pose.of(p, r) for p, r in zip(positions[:CALLS], rotations[:CALLS], strict=True)]
    warm()

    def calls() -> None:
        for pose in poses:
            nearest_singularities(DESIGN, pose)

    duration = best_of(5, calls) / CALLS
    exact = nearest_singular_poses(
        Configuration(DESIGN, positions[:SEARCHES], rotations[:SEARCHES])
    ).distance
    searched = np.empty((SEARCHES, 3))

    def search() -> None:
        for index in range(SEARCHES):
            for incidence in (1, 2, 3):
                searched[index, incidence - 1] = searched_distance(
                    DESIGN, positions[index], rotations[index], incidence, STARTS
                )

    search_time = best_of(1, search) / SEARCHES
    yield Row(
        "nearest singular pose, all three incidences",
        seconds(duration),
        "1 ms",
        f"SLSQP from {STARTS} starts: {seconds(search_time)}, "
        f"apart by {np.abs(searched - exact).max():.1g} at the most; "
        f"{times(search_time / duration)}",
    )
    batch = (
        best_of(3, lambda: nearest_singular_poses(Configuration(DESIGN, positions, rotations)))
        / POSES
    )
    yield Row(f"the same in a batch of {POSES:,}, each, one core", seconds(batch))
    strata = best_of(3, lambda: nearest_in_strata(DESIGN, poses[0]))
    yield Row("nearest pose in each of the 24 strata", seconds(strata))
    rng = np.random.default_rng(1)
    turns = Rotation.random(2 * MOVES, random_state=rng).as_matrix()
    places = SIZE * rng.uniform(-1.0, 1.0, (2 * MOVES, 3))
    ends = [Pose.of(p, r) for p, r in zip(places, turns, strict=True)]

    def cross() -> None:
        for start, end in zip(ends[::2], ends[1::2], strict=True):
            path_margins([start, end])

    yield Row(
        "a straight move to anywhere: least margins, all crossings",
        seconds(best_of(3, cross) / MOVES),
    )
