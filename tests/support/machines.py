"""The paper's optimum with a machine around it, for tests, pictures and benchmarks of loads."""

from __future__ import annotations

import msgspec
import numpy as np
from numpy.typing import ArrayLike

from explorer import PRESETS, Actuators, Guide, Payload, Struts, Tool
from explorer.mechanism.machine import Six


def six(values: ArrayLike) -> Six:
    """Return six numbers as a tuple."""
    a, b, c, d, e, f = np.asarray(values, dtype=np.float64).tolist()
    return a, b, c, d, e, f


def same_for_all(value: float) -> Six:
    """Return one value for each actuator."""
    return value, value, value, value, value, value


OPTIMAL = PRESETS["paper-optimal"]

PRESS = msgspec.structs.replace(
    OPTIMAL,
    tool=Tool((1.0, 0.0, 2.0)),
    payload=Payload(0.5, (1.0, 0.0, 1.0)),
    actuators=Actuators(
        push_n=(150.0, 200.0, 150.0, 200.0, 150.0, 150.0),
        pull_n=(120.0, 200.0, 120.0, 200.0, 120.0, 120.0),
    ),
    struts=Struts(outer_mm=8.0, inner_mm=6.0, stress_mpa=200.0),
    guide=Guide(force_n=200.0, moment_nm=6.0),
)
"""That of the manual's page on loads."""

PRECISE = msgspec.structs.replace(
    OPTIMAL,
    tool=Tool(position=(0.5, 0.25, 1.0)),
    payload=Payload(0.6, (0.0, 0.5, 1.0)),
    actuators=Actuators(
        push_n=(90.0, 80.0, 70.0, 60.0, 50.0, 40.0),
        error_mm=(0.1, 0.2, 0.1, 0.2, 0.1, 0.1),
        stiffness_n_mm=(50.0, 60.0, 50.0, 60.0, 50.0, 40.0),
    ),
    struts=Struts(outer_mm=8.0, inner_mm=6.0, stress_mpa=200.0),
)
"""Limits, errors and stiffness of the actuators and the struts; a payload without a force."""

FULL = msgspec.structs.replace(
    OPTIMAL,
    tool=Tool((1.0, -1.0, 2.0)),
    payload=Payload(2.0, (1.0, 2.0, 3.0), 4.0),
    actuators=Actuators(push_n=(60, 50, 40, 50, 45, 70), pull_n=(30, 40, 50, 60, 70, 80)),
    struts=Struts(moment_nm=4.0),
    guide=Guide(force_n=70.0, moment_nm=5.0),
)
"""A payload with a mass and a force, and limits of all parts, of which none are alike."""
