"""Bad input ends with status 2 and one line that says what to do, never a traceback."""

from __future__ import annotations

import dataclasses
from pathlib import Path

import pytest
from command_line import CommandLine

from explorer.cli import COMMANDS
from explorer.cli.parsing import condense, load_command

SIX = ["1", "2", "3", "4", "5", "6"]


REFUSALS = """
forward --joints | six numbers in the order l1 d1 d2 d3 d4 l4; got 0
forward --joints 1 2 3 4 5 6 7 | six numbers in the order l1 d1 d2 d3 d4 l4; got 7
forward --joints -1 2 3 4 5 6 | explorer: the length l1 must not be negative
forward --joint 1 2 3 4 5 6 | no option --joint (did you mean --joints?); see
forward | give either --joints or --joints-file
foward | did you mean forward?
inverse --quaternion 1 | four numbers in the order w x y z; got 1
inverse --quaternion 0 0 0 0 | quaternion
inverse --design | --design needs a value
inverse --design / | directory
inverse --at b3 | 'b4', 'tool'
inverse --json stray | 'stray'
inverse --json -x | '-x'
inverse --folds 1 2 3 4 5 6 --position 1 2 3 --quaternion 1 2 3 4 | --folds is a whole pose; leave
inverse --folds 1 | six numbers in the order r beta epsilon phi1 phi2 phi3
inverse --folds -1 2 3 4 5 6 | r is a distance, 0 or more; got -1.0
inverse --folds 1 -2 3 4 5 6 | beta must lie within 0° to 180°; got -2.0°
inverse --folds 1 2 181 4 5 6 | epsilon must lie within 0° to 180°
inverse --folds 1 2 3 4 5 -190 | --folds: phi3 must lie within -180° to 180°
singularity --position 1e200 1 1 | must not exceed 1e+12 in size
singularity --design no-such | buildable, paper-initial, paper-optimal
serve --port 65536 | explorer serve: --port must
serve --port http | explorer serve: --port must
--port x | explorer serve: --port
--design no-such | no-such
screenshot --panels --no-panels | --panels and --no-panels contradict
screenshot --quaternion 1 2 3 4 --yaw-pitch-roll 1 2 3 | not both
screenshot --size 1280*800 | --size
screenshot --size 800x8193 | --size
screenshot --view below | isometric
forces --load 1 2 | --load needs a force fx fy fz
forces --payload 1000000.0000001 | exceed 1e+06 in size; got 1000000.0000001
forces --payload -1 | --payload must be a number of at least 0; got -1
forces --most 0 | 6 positive numbers
accuracy --errors -1 | actuators.error_mm must not be negative; got -1
accuracy --stiffness 0 | actuators.stiffness_n_mm must be positive; got 0
budget --wanted 0 | --wanted must be a positive number; got 0
budget --wanted-turn 0.1 | need a displacement with --wanted
budget --keep-actuators | need a displacement with --wanted
budget --out some.json | need a displacement with --wanted
budget --required-box 1 1 1 2 2 2 --over pose | --required-box needs --over box; got --over pose
budget --required-box 1 1 1 2 2 2 --position 1 2 3 | --position is one position
budget --required-box 1 1 1 2 2 2 --folds 1 2 3 4 5 6 | --folds is one position
budget --required-box 1 1 1 2 2 0 | three lows, then highs above them
budget --over everywhere | --over
interference --to 10 5 9 | a move needs two poses that differ
interference --steps 4 | --to
interference --steps 0 --to 8 4 8 | --steps must lie within 1
interference --to 1e6 2 3 | give their number with --steps
interference --to 8 4 8 --to-quaternion 1 0 0 0 --to-yaw-pitch-roll 1 2 3 | not both
interference --radii -0.5 | leg_radii must not be negative; got -0.5
interference --radii 1 2 | --radii needs four numbers in the order r1 r2 r3 r4, or one
path | say where the path ends with --to
path --to 1 2 | --to needs a position x y z
path --to 40 8 7 | the goal is outside the limits:
path --from 40 8 7 --to 12 8 7 | the start is outside the limits
path --to 12 8 0 | the goal is singular (a1 on the platform plane and
path --to 12 8 7 0 0 0 --to-quaternion 1 0 0 0 | already
path --to 12 8 7 0 0 0 --to-folds 1 2 3 4 5 6 | leave --to-folds out
path --to 12 8 7 --to-folds 1 2 3 4 5 6 | whole pose; leave the position out
path --to 12 8 7 --out /nowhere/path.csv | there is no folder
path --to 12 8 7 --load 1 2 | and may go on with a moment
path --to 12 8 7 --load 0 0 -1 | limits neither its actuators
orientation --torsion nan | --torsion must be a finite number; got nan
workspace --yaw-range 5 -5 | yaw: the low end 5° exceeds the high end -5°
workspace --yaw-range 5.0000001 5 | yaw: the low end 5.0000001° exceeds the high end 5°
workspace --tilt 180.0000001 | within 0° to 180°; got 180.0000001°
workspace --step 0.01 | at most 50,000,000 are counted
workspace --tolerance 1e-6 | at most 2,000,000 are made
workspace --tilt 200 | within 0° to 180°; got 200°
workspace --tilt 5 --yaw-range 1 2 | not both
workspace --samples 3 | --samples needs
workspace --interference --radii 0.5 | legs 2 and 3 overlap by 0.3306
optimise | --target-volume
optimise --target-volume 9 --bounds a3x=5:3 | bounds of a3x cross
optimise --target-volume 9 --bounds a3x=5:nan | must be a finite number; got nan
optimise --target-volume 9 --bounds a3x=20:30 | outside its bounds 20 to 30
optimise --target-volume 9 --bounds a3x=19.1829001:30 | 19.1829, outside its bounds 19.1829001
optimise --target-volume 9 --bounds yaw=-80:0 yaw=-90:0 | bounded twice, from -80 to 0 and from -90
optimise --target-volume 9 --bounds a3x | NAME=LOW:HIGH
optimise --target-volume 9 --bounds | needs at least one value
optimise --target-volume 9 --free width | no variable 'width'
optimise --target-volume 9 --box 1 2 3 0 4 5 | box x
optimise --target-volume 9 --out /nowhere/design.json | there is no folder
optimise --repeat /nowhere/run.json | cannot read
"""
"""Command lines, each with words of the message."""


@pytest.mark.parametrize("case", REFUSALS.strip().splitlines())
def test_bad_words_are_refused_with_what_is_meant(cli: CommandLine, case: str) -> None:
    argv, words = case.split(" | ")
    assert words in cli.refusal(*argv.split())


@pytest.mark.parametrize("word", ["nan", "inf", "-inf", "1e999"])
def test_numbers_not_finite_are_refused(cli: CommandLine, word: str) -> None:
    assert "y must be a finite number" in cli.refusal("inverse", "--position", "1", word, "2")
    joints = [*SIX[:3], word, *SIX[4:]]
    assert "d3 must be a finite number" in cli.refusal("forward", "--joints", *joints)


@pytest.mark.parametrize("word", ["x", "1,2,3", "--5", "1e", "0x10", ""])
def test_numbers_other_words_are_quoted(cli: CommandLine, word: str) -> None:
    assert word in cli.refusal("inverse", "--position", "1", "2", word)


@pytest.mark.parametrize("word", ["", " "])
def test_blank_names_of_files_are_refused_before_anything_is_written(
    cli: CommandLine, word: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    for argv in (
        ("inverse", "--design", word),
        ("export", "kernel", "--out", word),
        ("path", "--to", "12", "4", "8", f"--out={word}"),
    ):
        assert f" needs a value; got {word!r}" in cli.refusal(*argv)
    assert [*tmp_path.iterdir()] == []


def test_option_given_twice_is_refused(cli: CommandLine) -> None:
    for command in COMMANDS:
        for field in dataclasses.fields(load_command(command, COMMANDS)):
            option = f"--{field.name.rstrip('_').replace('_', '-')}"
            for first, second in (
                ([option, "1", "2", "3"], [option, "4", "5", "6"]),
                ([f"{option}=a"], [option.replace("-", "_").replace("__", "--", 1)]),
            ):
                message = cli.refusal(command, *first, *second)
                assert message.startswith(f"explorer {command}: {option} is given twice; ")


def test_design_file_of_another_editor_opens_and_its_fault_is_reported_with_line_and_field(
    cli: CommandLine, tmp_path: Path
) -> None:
    text = '{\r\n"a3": [1, 2],\r\n"b1": [1, 2],\r\n"b2": 1,\r\n"b3": 2,\r\n"unit_mm": 5}'
    file = tmp_path / "mine.json"
    for encoding in ("utf-8-sig", "utf-16"):
        file.write_bytes(text.encode(encoding))
        assert "1 unit = 5 mm" in cli.text("inverse", "--design", file)
        file.write_bytes(text.replace("unit_mm", "unitmm").encode(encoding))
        assert cli.refusal("inverse", "--design", file) == (
            f"explorer: {file}: line 6: unitmm is unknown, did you mean unit_mm?"
        )


def test_screenshot_unwritable_file_is_refused_first(cli: CommandLine, tmp_path: Path) -> None:
    for name, words in (("shot.jpg", "must end in .png"), ("missing/shot.png", "no folder")):
        assert words in cli.refusal("screenshot", "--out", tmp_path / name)


@pytest.mark.parametrize(
    ("complaint", "line"),
    [
        ("", "the arguments cannot be read"),
        ("Something is wrong.\n", "something is wrong"),
        (" Oh\n ------\n Some-\n thing.\n  ------\n More.\n", "some- thing"),
        (" Oh\n ---\n Missing from x:\n     --one A B\n         One.\n ---\n Run", "missing --one"),
    ],
)
def test_condense_framed_message_is_one_line(complaint: str, line: str) -> None:
    assert condense(complaint) == line
