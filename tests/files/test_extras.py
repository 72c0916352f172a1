"""Extras: what is missing is told, and what Python says of their sources is not."""

from __future__ import annotations

import sys
from pathlib import Path

import pytest

from explorer.errors import MissingExtraError
from explorer.files.extras import load_extra


def test_extra_with_an_odd_escape_in_its_source_loads_without_a_warning(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    (tmp_path / "odd_escape.py").write_text('TEXT = "\\d"\n', encoding="utf-8")
    monkeypatch.setattr(sys, "path", [str(tmp_path), *sys.path])
    # Warnings are errors in all tests.
    (module,) = load_extra("timing", "odd_escape")
    assert module.TEXT == r"\d"


def test_missing_module_of_an_extra_is_told_with_the_extra() -> None:
    with pytest.raises(MissingExtraError, match="timing"):
        load_extra("timing", "no_such_module_of_toppra")
