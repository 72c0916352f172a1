"""Bad input ends with status 2 and one line that says what to do, never a traceback."""

from __future__ import annotations

import dataclasses
from pathlib import Path

import pytest
from command_line import CommandLine

from explorer.cli import COMMANDS
from explorer.cli.parsing import condense, load_command

SIX = ["1", "2", "3", "4", "5", "6"]


@pytest.mark.parametrize("count", [0, 1, 5, 7])
def test_joints_wrong_count_names_the_order(cli: CommandLine, count: int) -> None:
    message = cli.refusal("forward", "--joints", *(["2"] * count))
    assert "six numbers in the order l1 d1 d2 d3 d4 l4" in message
    assert f"got {count}" in message


@pytest.mark.parametrize(
    ("option", "words", "order"),
    [
        ("--position", ["1", "2"], "three numbers in the order x y z"),
        ("--quaternion", ["1", "0", "0"], "four numbers in the order w x y z"),
        ("--yaw-pitch-roll", ["1"], "three numbers in the order yaw pitch roll"),
    ],
)
def test_pose_wrong_count_names_the_order(
    cli: CommandLine, option: str, words: list[str], order: str
) -> None:
    assert f"{option} needs {order}; got {len(words)}" in cli.refusal("inverse", option, *words)


@pytest.mark.parametrize("word", ["nan", "inf", "-inf", "1e999"])
def test_numbers_not_finite_are_refused(cli: CommandLine, word: str) -> None:
    assert "y must be a finite number" in cli.refusal("inverse", "--position", "1", word, "2")
    joints = [*SIX[:3], word, *SIX[4:]]
    assert "d3 must be a finite number" in cli.refusal("forward", "--joints", *joints)


def test_numbers_too_large_are_refused(cli: CommandLine) -> None:
    assert "±1e+30" in cli.refusal("singularity", "--position", "1e200", "1", "1")


@pytest.mark.parametrize("word", ["x", "1,2,3", "--5", "1e", "0x10", ""])
def test_numbers_other_words_are_quoted(cli: CommandLine, word: str) -> None:
    assert word in cli.refusal("inverse", "--position", "1", "2", word)


def test_numbers_negative_and_scientific_are_values(cli: CommandLine) -> None:
    words = ["-1", "-2.5e-3", "+.5E1"]
    assert cli.text("inverse", "--position", *words, "--yaw-pitch-roll", "-1e2", "-.5", "-0")


def test_joints_negative_lengths_are_refused(cli: CommandLine) -> None:
    message = cli.refusal("forward", "--joints", "-1", *SIX[1:])
    assert message.startswith("explorer: l1 ")
    assert "negative" in message


def test_quaternion_of_zeros_is_refused(cli: CommandLine) -> None:
    assert "quaternion" in cli.refusal("inverse", "--quaternion", "0", "0", "0", "0")


def test_pose_two_orientations_are_refused(cli: CommandLine) -> None:
    options = ["--quaternion", "1", "0", "0", "0", "--yaw-pitch-roll", "1", "2", "3"]
    for command in ("inverse", "singularity", "screenshot"):
        message = cli.refusal(command, *options)
        assert "--quaternion" in message
        assert "--yaw-pitch-roll" in message


def test_missing_option_is_named(cli: CommandLine) -> None:
    assert cli.refusal("forward").startswith("explorer forward: missing --joints; see ")


def test_option_without_value_is_named(cli: CommandLine) -> None:
    assert "--design needs a value" in cli.refusal("inverse", "--design")


def test_misspelt_option_gets_a_suggestion(cli: CommandLine) -> None:
    message = cli.refusal("forward", "--joint", *SIX)
    assert message == (
        "explorer forward: no option --joint (did you mean --joints?); see explorer forward --help"
    )


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


def test_flag_and_its_opposite_are_refused(cli: CommandLine) -> None:
    message = cli.refusal("screenshot", "--panels", "--no-panels")
    assert "--panels and --no-panels contradict each other" in message


def test_misspelt_command_gets_a_suggestion(cli: CommandLine) -> None:
    assert "did you mean forward?" in cli.refusal("foward")
    for command in COMMANDS:
        assert command in cli.refusal("xyzzy")


@pytest.mark.parametrize("stray", ["stray", "-x", "a" * 200])
def test_stray_argument_is_quoted(cli: CommandLine, stray: str) -> None:
    assert repr(stray) in cli.refusal("inverse", "--json", stray)


def test_unknown_preset_lists_the_presets(cli: CommandLine) -> None:
    for command in ("inverse", "singularity", "screenshot", "serve"):
        message = cli.refusal(command, "--design", "no-such")
        assert "paper-initial, paper-optimal" in message


@pytest.mark.parametrize(
    ("text", "word"),
    [
        ("", "truncated"),
        ("{\n\n]", "malformed"),
        ('{"a3": [1, 2]}', "b1"),
        ('{"a3": [1, 2], "b1": [1, 2], "b2": 1, "b3": 2, "b5": 3}', "b5"),
        ('{"a3": [1, 0], "b1": [1, 2], "b2": 1, "b3": 2}', "a3y"),
        ('{"a3": [1, 2], "b1": [1, 2], "b2": 1, "b3": 1}', "b3 - b2"),
        ('{"a3": [1, 2], "b1": [1, 2], "b2": 1, "b3": "2"}', "b3"),
    ],
)
def test_invalid_design_file_gives_reason(
    cli: CommandLine, tmp_path: Path, text: str, word: str
) -> None:
    file = tmp_path / "design.json"
    file.write_text(text)
    assert word in cli.refusal("inverse", "--design", file)


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


def test_design_folder_is_refused(cli: CommandLine, tmp_path: Path) -> None:
    assert "directory" in cli.refusal("inverse", "--design", str(tmp_path)).lower()


@pytest.mark.parametrize("port", ["-1", "65536", "http", "80.5", ""])
def test_port_outside_range_is_refused(cli: CommandLine, port: str) -> None:
    message = cli.refusal("serve", "--port", port)
    assert message.startswith("explorer serve: --port must ")


def test_no_command_is_serve(cli: CommandLine) -> None:
    assert cli.refusal("--port", "x").startswith("explorer serve: --port")
    assert "no-such" in cli.refusal("--design", "no-such")


@pytest.mark.parametrize("size", ["1280", "1280*800", "63x800", "800x8193", "-1x5", "1e3x800"])
def test_size_outside_range_is_refused(cli: CommandLine, size: str) -> None:
    assert "--size" in cli.refusal("screenshot", "--size", size)


def test_unknown_view_lists_the_views(cli: CommandLine) -> None:
    message = cli.refusal("screenshot", "--view", "below")
    for view in ("isometric", "front", "side", "top"):
        assert view in message


def test_screenshot_unwritable_file_is_refused_first(cli: CommandLine, tmp_path: Path) -> None:
    def out(path: str) -> str:
        return cli.refusal("screenshot", "--out", path)

    assert "must end in .png" in out(str(tmp_path / "shot.jpg"))
    assert "must end in .png" in out("shot")
    assert "no folder" in out(str(tmp_path / "missing" / "shot.png"))
    (tmp_path / "folder.png").mkdir()
    assert "is a folder" in out(str(tmp_path / "folder.png"))
    (tmp_path / "file").touch()
    assert "no folder" in out(str(tmp_path / "file" / "shot.png"))


@pytest.mark.skipif(not Path("/proc/self").is_dir(), reason="needs a folder that takes no file")
def test_screenshot_unwritable_folder_is_refused(cli: CommandLine) -> None:
    assert "cannot write" in cli.refusal("screenshot", "--out", "/proc/self/shot.png")


@pytest.mark.parametrize(
    ("complaint", "line"),
    [
        ("", "the arguments cannot be read"),
        ("Something is wrong.\n", "something is wrong"),
        ("╭─ Oh ───╮\n│ Some-  │\n│ thing. │\n│ ────── │\n│ More.  │\n╰────────╯", "some- thing"),
        (" Oh\n ------\n Something.\n ------\n More.\n", "something"),
        ("\x1b[31m╭─ Oh ╮\x1b[0m\n\x1b[1m│ It\x1b[0m │\n╰──╯\n", "it"),
        (" Oh\n --\n Missing from x:\n     --one A B\n         One.\n --\n Run", "missing --one"),
    ],
)
def test_condense_framed_message_is_one_line(complaint: str, line: str) -> None:
    assert condense(complaint) == line
