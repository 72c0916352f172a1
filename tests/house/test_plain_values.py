"""Values that take the numbers of NumPy hold plain ones: they compare, and are written to files."""

from __future__ import annotations

import contextlib
from typing import Any, cast

import msgspec
import numpy as np
import pytest
from drawn_designs import complete_designs, poses
from hypothesis import given, strategies as st

from explorer import PRESETS, Design, InputError, Pose
from explorer.mechanism.design import Swing
from explorer.mechanism.design_file import decode_design, encode_design
from explorer.optimise.problem import Demands, Problem, Variable
from explorer.sweep.study import Objective, Sampling, Study, decode_study, encode_study

OPTIMAL = PRESETS["paper-optimal"]
BOX = ((8.0, 3.0, 6.0), (12.0, 7.0, 10.0))
LIMITED = OPTIMAL.with_limits(swing=Swing(*[30.0] * 6))
PROBLEM = Problem(
    start=OPTIMAL,
    objective="smallest-reach",
    variables=(Variable("b2", 1.0, 3.0), Variable("yaw", -90.0, 90.0)),
    demands=Demands(volume=7000.0, clearance=0.5, clearance_margin=1.0, least=0.5),
)
STUDY = Study(
    name="of NumPy",
    design=OPTIMAL,
    variables={"b2": (1.0, 3.0), "b3": (4.0, 5.0)},
    sampling=Sampling(method="grid", count={"b2": 3, "b3": 2}),
    measures=("volume", "reach"),
    nodes=9,
    clearance_margin=0.5,
    objectives=(Objective("volume", "max"),),
    chunk=4,
)
SAMPLING = Sampling(method="latin-hypercube", count=16, seed=3)


def of_numpy(value: Any, *, arrays: bool) -> Any:
    """Return a value made anew from numbers and words of NumPy.

    Args:
        value: A value of structs, tuples, mappings, numbers and words.
        arrays: Whether rows of numbers are arrays, rather than tuples of numbers of NumPy.
    """
    if isinstance(value, msgspec.Struct):
        fields = msgspec.structs.asdict(value)
        return type(value)(**{n: of_numpy(v, arrays=arrays) for n, v in fields.items()})
    if isinstance(value, tuple):
        entries = cast("tuple[Any, ...]", value)
        with contextlib.suppress(TypeError, ValueError):
            numbers = np.array(entries)
            if arrays and numbers.dtype == np.float64:
                return numbers
        return [of_numpy(entry, arrays=arrays) for entry in entries]
    if isinstance(value, dict):
        fields = cast("dict[str, Any]", value)
        return {np.str_(n): of_numpy(v, arrays=arrays) for n, v in fields.items()}
    kinds = {bool: np.bool_, int: np.int64, float: np.float64, str: np.str_}
    return kinds[type(value)](value) if type(value) in kinds else value


def check_plain(value: Any) -> None:
    """Check that a value made anew from numbers of NumPy is the value in every way."""
    for arrays in (False, True):
        made = of_numpy(value, arrays=arrays)
        assert made == value
        assert repr(made) == repr(value)
        assert msgspec.json.encode(made) == msgspec.json.encode(value)
        with contextlib.suppress(TypeError):
            assert hash(made) == hash(value)


@given(complete_designs())
def test_design_of_numpy_numbers_is_that_of_plain_ones(design: Design) -> None:
    check_plain(design)
    made = of_numpy(design, arrays=True)
    assert decode_design(encode_design(made), "file") == design
    assert made.home_pose == design.home_pose


@given(poses, st.sampled_from([np.float32, np.float64]))
def test_pose_of_numpy_numbers_is_that_of_plain_ones(pose: Pose, kind: Any) -> None:
    check_plain(pose)
    made = Pose(kind(pose.position), kind(pose.quaternion))
    assert made.position == tuple(float(kind(each)) for each in pose.position)
    assert {*map(type, (*made.position, *made.quaternion))} == {float}
    assert {made: 1}[msgspec.json.decode(msgspec.json.encode(made), type=Pose)] == 1


@pytest.mark.parametrize("position", [(10, 5, 9), [10, 5, 9], np.array([10, 5, 9])], ids=type)
def test_pose_of_whole_numbers_is_that_of_floats(position: Any) -> None:
    assert repr(Pose(position, (1, 0, 0, 0))) == repr(Pose((10.0, 5.0, 9.0), (1.0, 0.0, 0.0, 0.0)))


@pytest.mark.parametrize(
    "value", [LIMITED, PROBLEM, STUDY, SAMPLING], ids=lambda v: type(v).__name__
)
def test_value_of_numpy_numbers_is_that_of_plain_ones(value: Any) -> None:
    check_plain(value)


def test_study_of_numpy_numbers_is_read_back_from_its_file() -> None:
    assert decode_study(encode_study(of_numpy(STUDY, arrays=True)), "file") == STUDY


def test_pose_of_whole_numbers_beyond_floats_is_refused() -> None:
    for position in ((10**400, 5, 9), (0, -(10**309), 0)):
        with pytest.raises(InputError, match="position must be"):
            Pose(position, (1, 0, 0, 0))
