"""Bad input ends with status 2 and one line that says what to do, never a traceback."""

from __future__ import annotations

import dataclasses
from pathlib import Path

import pytest
from command_line import CommandLine

from explorer.cli import COMMANDS
from explorer.cli.parsing import condense, load_command

SIX = ["1", "2", "3", "4", "5", "6"]


@pytest.mark.parametrize(
    ("argv", "words"),
    [
        (["forward", "--joints"], "six numbers in the order l1 d1 d2 d3 d4 l4; got 0"),
        (["forward", "--joints", *SIX, "7"], "six numbers in the order l1 d1 d2 d3 d4 l4; got 7"),
        (["inverse", "--position", "1", "2"], "three numbers in the order x y z; got 2"),
        (["inverse", "--quaternion", "1"], "four numbers in the order w x y z; got 1"),
        (["inverse", "--yaw-pitch-roll", "1"], "three numbers in the order yaw pitch roll; got 1"),
        (["singularity", "--position", "1e200", "1", "1"], "must not exceed 1e+12 in size"),
        (
            ["forward", "--joints", "-1", *SIX[1:]],
            "explorer: the length l1 must not be negative",
        ),
        (["inverse", "--quaternion", "0", "0", "0", "0"], "quaternion"),
        (["forward"], "explorer forward: missing --joints; see "),
        (["inverse", "--design"], "--design needs a value"),
        (["forward", "--joint", *SIX], "no option --joint (did you mean --joints?); see "),
        (["screenshot", "--panels", "--no-panels"], "--panels and --no-panels contradict"),
        (["foward"], "did you mean forward?"),
        (["inverse", "--json", "stray"], "'stray'"),
        (["inverse", "--json", "-x"], "'-x'"),
        (["serve", "--port", "65536"], "explorer serve: --port must "),
        (["serve", "--port", "http"], "explorer serve: --port must "),
        (["--port", "x"], "explorer serve: --port"),
        (["--design", "no-such"], "no-such"),
        (["singularity", "--design", "no-such"], "paper-initial, paper-optimal"),
        (["inverse", "--design", "/"], "directory"),
        (["screenshot", "--quaternion", *SIX[:4], "--yaw-pitch-roll", *SIX[:3]], "not both"),
        (
            ["inverse", "--folds", *SIX, "--position", *SIX[:3], "--quaternion", *SIX[:4]],
            "--folds is a whole pose; leave the position and --quaternion out",
        ),
        (["inverse", "--folds", "1"], "six numbers in the order r beta epsilon phi1 phi2 phi3"),
        (["inverse", "--folds", "-1", *SIX[1:]], "r is a distance, 0 or more; got -1.0"),
        (["inverse", "--folds", "1", "-2", *SIX[2:]], "beta must lie within 0° to 180°; got -2.0°"),
        (["inverse", "--folds", "1", "2", "181", *SIX[3:]], "epsilon must lie within 0° to 180°"),
        (["inverse", "--folds", *SIX[:5], "-190"], "--folds: phi3 must lie within -180° to 180°"),
        (["screenshot", "--size", "1280*800"], "--size"),
        (["screenshot", "--size", "800x8193"], "--size"),
        (["screenshot", "--view", "below"], "isometric"),
    ],
)
def test_bad_words_are_refused_with_what_is_meant(
    cli: CommandLine, argv: list[str], words: str
) -> None:
    assert words in cli.refusal(*argv)


@pytest.mark.parametrize("word", ["nan", "inf", "-inf", "1e999"])
def test_numbers_not_finite_are_refused(cli: CommandLine, word: str) -> None:
    assert "y must be a finite number" in cli.refusal("inverse", "--position", "1", word, "2")
    joints = [*SIX[:3], word, *SIX[4:]]
    assert "d3 must be a finite number" in cli.refusal("forward", "--joints", *joints)


@pytest.mark.parametrize("word", ["x", "1,2,3", "--5", "1e", "0x10", ""])
def test_numbers_other_words_are_quoted(cli: CommandLine, word: str) -> None:
    assert word in cli.refusal("inverse", "--position", "1", "2", word)


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
            f"explorer: {file}: line 6: unknown field `unitmm`; did you mean `unit_mm`?"
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
