"""Shares of orientations and greatest tilts, beside vectorised NumPy with SciPy's rotations."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
from scipy.spatial.transform import Rotation

from benchmarks.samples import DESIGN
from benchmarks.table import Row, seconds, times
from benchmarks.timing import best_of
from explorer import inverse, margins
from explorer.numerics.arrays import FloatArray
from explorer.numerics.compiled import warm
from explorer.workspace.orientations.share import orientation_share
from explorer.workspace.orientations.tilts import greatest_tilts, tilt_map

ORIENTATIONS, NODES = 100_000, 20
# Samples in each azimuth that give a tilt to 0.1°.
TILTS = 1_801
SHORT = {"ORIENTATIONS": 1_000, "NODES": 4, "TILTS": 19}


def allowed(position: FloatArray, rotations: FloatArray) -> FloatArray:
    """Return which orientations are within lengths, box, sign triple and order of the preset."""
    home = DESIGN.home_pose
    q, here = inverse(DESIGN, position, rotations), inverse(DESIGN, home.position, home.rotation)
    signs = np.sign(margins(home.position, home.rotation))
    lengths = (q[:, [0, 2, 4, 5]] <= DESIGN.reach).all(axis=1)
    mode = (np.sign(margins(position, rotations)) == signs).all(axis=1)
    return lengths & mode & ((q[:, 3] - q[:, 1]) * (here[3] - here[1]) > 0.0)


def run() -> Iterator[Row]:
    """Yield the rows."""
    warm()
    position = np.array(DESIGN.home_pose.position)
    rng = np.random.default_rng(1)

    def sample() -> None:
        allowed(position, Rotation.random(ORIENTATIONS, random_state=rng).as_matrix()).mean()

    duration = best_of(10, lambda: orientation_share(DESIGN, position, ORIENTATIONS))
    sampled = best_of(3, sample)
    yield Row(
        f"share of {ORIENTATIONS:,} orientations, with its standard error",
        seconds(duration),
        "35 ms",
        f"NumPy and SciPy's Rotation: {seconds(sampled)}; {times(sampled / duration)}",
    )
    azimuths = np.arange(72) * 5.0
    torsion = float(tilt_map(DESIGN, position).torsion)
    angles = np.array([(a, t, torsion - a) for a in azimuths for t in np.linspace(0, 180, TILTS)])

    def step() -> None:
        allowed(position, Rotation.from_euler("ZYZ", angles, degrees=True).as_matrix())

    duration = best_of(10, lambda: tilt_map(DESIGN, position))
    stepped = best_of(2, step)
    yield Row(
        "greatest tilt in 72 azimuths, exact",
        seconds(duration),
        "20 ms",
        f"NumPy and SciPy's Rotation to 0.1°: {seconds(stepped)}; {times(stepped / duration)}",
    )
    axes = [np.linspace(*ends, NODES) for ends in ((0.0, 20.0), (-12.0, 22.0), (0.0, 18.0))]
    nodes = np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1)
    duration = best_of(3, lambda: greatest_tilts(DESIGN, nodes))
    yield Row(f"greatest tilt in every azimuth at {NODES**3:,} nodes", seconds(duration), "300 ms")
