"""Kills between two writes, without a process: no write and no removal works after one."""

from __future__ import annotations

import os
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest


class Killed(BaseException):
    """Stands for a kill."""


def run_until_killed(act: Callable[[], object], writes: int) -> bool:
    """Do what writes files, killed after so many writes and removals; return whether it was."""
    left = writes

    def step(usual: Callable[..., Any]) -> Callable[..., Any]:
        def count_down(*arguments: Any, **named: Any) -> Any:
            nonlocal left
            left -= 1
            if left < 0:
                raise Killed
            return usual(*arguments, **named)

        return count_down

    with pytest.MonkeyPatch.context() as patch:
        for owner, name in ((os, "fsync"), (Path, "replace"), (Path, "unlink")):
            patch.setattr(owner, name, step(getattr(owner, name)))
        try:
            act()
        except Killed:
            return True
    return False
