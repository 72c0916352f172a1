"""Fixtures for the tests of workspaces."""

from __future__ import annotations

import pytest

from explorer.numerics.compiled import warm


@pytest.fixture(scope="session")
def warm_kernels() -> None:
    """Compile all kernels before the first test that asks for it."""
    warm()
