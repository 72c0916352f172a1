"""The value of a workspace: what is asked of it, what is kept with it, and what leaves it."""

from __future__ import annotations

import pickle
from collections.abc import Callable
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from limited_designs import limited
from strategies import rotations

from explorer import PRESETS, InputError, accessible_workspace, workspace_solid, workspace_volume
from explorer.numerics.arrays import FloatArray
from explorer.numerics.computed_once import KEPT, computed_once
from explorer.workspace.accessible.workspace import accessible_part
from explorer.workspace.carried_region import carried_region
from explorer.workspace.slices.volume import volume_of
from explorer.workspace.solids import solids
from explorer.workspace.solids.solids import whole_solid
from explorer.workspace.workspace import Workspace

OPTIMAL = PRESETS["paper-optimal"]
THICK = limited(OPTIMAL, leg_radii=(0.1, 0.1, 0.1, 0.1), margin=0.0)


class Counted:
    """A value, and how often a function of it was computed."""

    def __init__(self) -> None:
        self.count = 0


@computed_once
def power(value: Counted, exponent: int = 1, *, watch: Callable[[str], object] = str) -> int:
    """Count the calls, and refuse a negative exponent."""
    value.count += 1
    if exponent < 0:
        raise InputError("negative")
    return 2**exponent


def test_result_is_computed_once_for_each_argument_but_the_watch() -> None:
    value, other = Counted(), Counted()
    assert [power(value, 3, watch=watch) for watch in (str, repr)] == [8, 8]
    assert power(other, 3) == 8
    assert (value.count, other.count) == (1, 1)
    for _ in range(2):
        with pytest.raises(InputError):
            power(value, -1)
    assert value.count == 3


def test_results_of_the_last_arguments_are_kept() -> None:
    value = Counted()
    for exponent in (*range(KEPT + 1), *range(1, KEPT + 1), 0):
        assert power(value, exponent) == 2**exponent
    assert value.count == KEPT + 2


@given(rotations())
def test_workspace_leaves_the_process_without_what_was_computed(rotation: FloatArray) -> None:
    workspace = Workspace(OPTIMAL, rotation, signs=(1, -1, 1))
    volume = volume_of(workspace)
    copy: Workspace = pickle.loads(pickle.dumps(workspace))
    assert vars(copy).keys() == {"design", "rotation", "signs"}
    assert repr(copy) == repr(workspace)
    assert volume_of(copy) == volume


def test_functions_of_a_design_are_those_of_its_workspace() -> None:
    workspace = Workspace(THICK)
    assert workspace_volume(THICK) == volume_of(workspace)
    assert workspace_solid(THICK, None, 0.1).volume == whole_solid(workspace, 0.1).volume
    part = accessible_workspace(THICK, tolerance=0.1)
    assert part.accessible_volume == accessible_part(workspace, tolerance=0.1).accessible_volume


@pytest.mark.parametrize("part_of", [accessible_part, carried_region])
def test_whole_and_part_share_one_solid(
    part_of: Callable[..., Any], monkeypatch: pytest.MonkeyPatch
) -> None:
    made: list[object] = []
    make = solids._make_agreeing_solid  # pyright: ignore[reportPrivateUsage]

    def count(*args: Any) -> object:
        made.append(args)
        return make(*args)

    monkeypatch.setattr(solids, "_make_agreeing_solid", count)
    workspace = Workspace(THICK)
    whole_solid(workspace, 0.1)
    part_of(workspace, tolerance=0.1)
    whole_solid(workspace, 0.1)
    assert len(made) == 1


def test_several_rotations_are_no_workspace() -> None:
    with pytest.raises(InputError, match="one rotation"):
        Workspace(OPTIMAL, np.stack([np.eye(3)] * 2))
