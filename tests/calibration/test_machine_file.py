"""Files of machines: read back as written, refused in words."""

from __future__ import annotations

import json
from typing import Any

import msgspec
import numpy as np
import pytest
from measured_machines import TYPICAL, design_itself, true_machine
from numpy.testing import assert_allclose
from refusals import refusal

from explorer import PRESETS
from explorer.calibration.machine_file import decode_machine, encode_machine

UNSEEN = ("guide x with d1 and d3",)


def fields_of(seed: int) -> dict[str, Any]:
    machine = true_machine(np.random.default_rng(seed))
    return json.loads(encode_machine(machine, UNSEEN))


def test_machine_is_read_back_as_it_was_written() -> None:
    for seed in range(20):
        machine = true_machine(np.random.default_rng(seed))
        data = encode_machine(machine, UNSEEN)
        read = decode_machine(data, "m.json", TYPICAL)
        assert read.design is TYPICAL
        assert_allclose(read.deviations, machine.deviations, rtol=1e-14, atol=0.0)
        assert json.loads(data)["unseen"] == [*UNSEEN]
    assert not decode_machine(encode_machine(design_itself(), ()), "", TYPICAL).deviations.any()


def test_file_is_in_millimetres_and_degrees_of_named_sources() -> None:
    from explorer.statics.accuracy import SOURCES, drawing_values

    machine, fields = true_machine(np.random.default_rng(3)), fields_of(3)
    values = dict(zip(SOURCES, drawing_values(TYPICAL, machine.deviations), strict=True))
    assert fields["zeros_mm"] == [values[name] for name in ("l1", "d1", "d2", "d3", "d4", "l4")]
    for point, three in fields["deviations_mm"].items():
        space = " " if point == "guide" else ""
        assert three == [values[f"{point}{space}{axis}"] for axis in "xyz"]
    assert fields["guide_tilt_deg"] == [values["guide tilt y"], values["guide tilt z"]]
    assert fields["square_deg"] == [values[name] for name in SOURCES[-2:]]


def test_limits_and_names_may_change_but_not_the_variables() -> None:
    data = json.dumps(fields_of(0)).encode()
    renamed = msgspec.structs.replace(TYPICAL.with_limits(l1=(3.0, 30.0)), name="later")
    assert decode_machine(data, "m.json", renamed).design is renamed
    for other in (PRESETS["paper-initial"], msgspec.structs.replace(TYPICAL, unit_mm=11.0)):
        words = refusal(decode_machine, data, "m.json", other)
        assert words.startswith("m.json is of a machine of the design 'paper-optimal'")
        assert repr(other.name) in words


@pytest.mark.parametrize(
    ("field", "value", "words"),
    [
        ("schema", 2, "schema"),
        ("kind", "design", "kind"),
        ("zeros_mm", [0.0] * 5, "zeros_mm"),
        ("zeros_mm", [0.0, 0.0, 0.0, 0.0, 0.0, "1"], "zeros_mm[5]: expected a number"),
        ("deviations_mm", {"a1": [0.0, 0.0, 0.0]}, "the field `a3` of deviations_mm is missing"),
        ("zeros_mm", [0.0] * 5 + [30.0], "lengths by up to 20.4 mm"),
        ("square_deg", [0.0, -15.0], "angles by up to 10°"),
        ("zero_mm", [0.0], "zero_mm is unknown, did you mean zeros_mm?"),
    ],
)
def test_faulty_fields_are_refused_by_name(field: str, value: object, words: str) -> None:
    data = json.dumps(fields_of(0) | {field: value}).encode()
    assert words in refusal(decode_machine, data, "m.json", TYPICAL)
