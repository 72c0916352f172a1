"""The command line of a test module: its `COMMAND`, with captured streams."""

from __future__ import annotations

from typing import Any, cast

import pytest
from command_line import CommandLine


@pytest.fixture
def cli(
    request: pytest.FixtureRequest,
    capsys: pytest.CaptureFixture[str],
    tmp_path_factory: pytest.TempPathFactory,
) -> CommandLine:
    """The command of the test's module, or any command in a module without one."""
    module: Any = cast("Any", request).module
    command: tuple[str, ...] = getattr(module, "COMMAND", ())
    has_progress = bool({*command} & {"optimise", "sweep"})
    return CommandLine(capsys, command, has_progress, tmp_path_factory.mktemp("designs"))
