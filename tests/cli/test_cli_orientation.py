"""`explorer orientation` and `--tilt-torsion` against the Python functions."""

from __future__ import annotations

import numpy as np
import pytest
from command_line import CommandLine

import explorer

PRESET = explorer.PRESETS["paper-optimal"]
POSITION = (10.0, 5.0, 9.0)
AT = ("orientation", "--position", "10", "5", "9")


def test_orientation_json_has_share_tilts_and_torsions(cli: CommandLine) -> None:
    found = cli.answer(*AT, "--torsion", "-60", "--samples", "5000")
    share = explorer.orientation_share(PRESET, POSITION, 5000)
    assert (found["share"], found["standard_error"]) == (share.share, share.standard_error)
    assert found["orientations"] == 5000
    least = explorer.greatest_tilt(PRESET, POSITION, -60.0)
    assert (found["greatest_tilt"], found["azimuth"]) == (least.tilt, least.azimuth)
    assert (found["torsion"], found["limit"]) == (-60.0, least.limit)
    tilts = explorer.tilt_map(PRESET, POSITION, -60.0)
    assert found["tilts"] == tilts.tilts.tolist()
    assert found["limits"] == list(tilts.limits)
    torsions = explorer.torsion_range(PRESET, POSITION, -60.0)
    assert found["torsion_range"] == [torsions.low, torsions.high]
    assert found["torsion_limits"] == [torsions.low_limit, torsions.high_limit]
    by_torsion = explorer.tilt_by_torsion(PRESET, POSITION)
    assert found["torsions"] == by_torsion.torsions.tolist()
    assert found["tilts_by_torsion"] == [
        None if np.isnan(tilt) else tilt for tilt in by_torsion.tilts.tolist()
    ]
    assert found["best_tilt"] == by_torsion.best.tilt >= found["greatest_tilt"]
    assert found["best_torsion"] == by_torsion.best.torsion
    assert found["home_connected"] is True


def test_orientation_text_has_a_line_for_each_azimuth(cli: CommandLine) -> None:
    text = cli.text(*AT)
    assert "share of all orientations" in text
    assert "ended by margin δ1" in text
    assert (
        len(
            [
                line
                for line in text.splitlines()
                if line.endswith(("δ1", "δ2", "order")) and not line.startswith("greatest")
            ]
        )
        == 72
    )


def test_orientation_where_tilt_zero_violates_a_limit_says_so(cli: CommandLine) -> None:
    outside = ("orientation", "--position", "30", "5", "9", "--samples", "100")
    found = cli.answer(*outside)
    assert found["share"] == 0.0
    assert found["greatest_tilt"] is None
    assert found["torsion_range"] == [None, None]
    assert found["home_connected"] is False
    assert "none: tilt zero violates" in cli.text(*outside)


def test_tilt_torsion_gives_the_orientation(cli: CommandLine) -> None:
    found = cli.answer("inverse", "--position", "10", "5", "9", "--tilt-torsion", "30", "15", "-70")
    rotation = explorer.rotation_from_tilt_torsion([30.0, 15.0, -70.0])
    np.testing.assert_allclose(
        found["joints"], explorer.inverse(PRESET, POSITION, rotation), rtol=1e-12
    )


@pytest.mark.parametrize(
    ("words", "reason"),
    [
        (["--torsion", "nan"], "--torsion must be a finite number"),
        (["--samples", "1"], "--samples must lie within 2"),
        (["--position", "1", "2"], "three numbers"),
    ],
)
def test_orientation_unusable_options_are_refused(
    cli: CommandLine, words: list[str], reason: str
) -> None:
    assert reason in cli.refusal("orientation", *words)
