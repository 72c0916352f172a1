"""Command lines run in this process, and what each kind of answer has in common."""

from __future__ import annotations

import json
import re
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import pytest

from explorer import Design, encode_design
from explorer.cli import run


@dataclass
class CommandLine:
    """Runs a command and checks its streams.

    Attributes:
        capsys: Capture of both streams.
        command: Arguments that every command line begins with.
        has_progress: Whether the command writes progress to standard error.
        folder: Where a design among the arguments is written, which its file stands for.
    """

    capsys: pytest.CaptureFixture[str]
    command: tuple[str, ...] = ()
    has_progress: bool = False
    folder: Path = Path()

    def run(self, *argv: object, status: int = 0) -> tuple[str, str]:
        """Return standard output and standard error of a command that ends with a status."""
        file = self.folder / "design.json"
        for design in (word for word in argv if isinstance(word, Design)):
            file.write_bytes(encode_design(design))
        words = [str(file if isinstance(word, Design) else word) for word in argv]
        assert run([*self.command, *words]) == status
        captured = self.capsys.readouterr()
        assert "\x1b" not in captured.out
        assert "Traceback" not in captured.err
        if not self.has_progress:
            assert captured.err.count("\n") == bool(status)
        return captured.out, captured.err

    def answer(self, *argv: object, status: int = 0) -> dict[str, Any]:
        """Return the one JSON object on standard output, where nothing else is."""
        out, _ = self.run(*argv, "--json", status=status)
        assert out.endswith("}\n")
        assert out.count("\n") == 1
        found: dict[str, Any] = json.loads(out)
        return found

    def text(self, *argv: object, status: int = 0) -> str:
        """Return the text on standard output, whose lines have no trailing spaces."""
        out, _ = self.run(*argv, status=status)
        assert all(line == line.rstrip() for line in out.splitlines())
        return out

    def refusal(self, *argv: object, status: int = 2) -> str:
        """Return the one line on standard error of a command without output."""
        out, err = self.run(*argv, status=status)
        assert out == ""
        assert err.endswith("\n")
        assert err.count("\n") == 1
        assert not re.search("[│╭╰─]|--- ", err)
        return err.strip()
