"""A limit that one row adds to the table is kept, told, drawn, edited and listed everywhere."""

from __future__ import annotations

from collections.abc import Generator, Iterator
from typing import Any

import msgspec
import numpy as np
import pytest
import viser
from desk import Desk
from limited_designs import limited
from report_page import read, table_of
from scipy.spatial.transform import Rotation

from explorer import PRESETS, Design, Limits, Pose, evaluate
from explorer.app.features.feature import Services
from explorer.app.features.mechanism.feature import DesignPanel
from explorer.app.features.optimise.words import limit_rows
from explorer.app.features.sharing.reporting import make_report
from explorer.app.state.actions import open_design
from explorer.app.state.frame import Frame
from explorer.numerics.number_text import UNITS
from explorer.workspace.limits.constraints import angle_between
from explorer.workspace.limits.quantities import ANGLE, Bound, Demand
from explorer.workspace.limits.table import LIMITS, Limit, LimitCase, LimitSlider, angle_from_home
from explorer.workspace.limits.valid_moves import moves_are_valid
from explorer.workspace.limits.valid_poses import poses_are_valid
from explorer.workspace.solids.solids import workspace_solid
from explorer.workspace.workspace import Workspace

OPTIMAL = PRESETS["paper-optimal"]
NAME, HALF_ANGLE = "lean of leg 4", 12.0


class LeaningLimits(Limits, frozen=True, forbid_unknown_fields=True):
    """Limits with one more, on the angle of leg 4 from its direction at home, in degrees."""

    lean: float | None = None


def demands(case: LimitCase) -> Iterator[Demand]:
    if case.value is not None:
        angle = angle_from_home(case.design, 3, in_platform=False)
        yield Demand(NAME, ANGLE, high=Bound(case.value), has_ends=False, angle=angle)


LEAN = Limit(
    "lean",
    {"": "The lean of leg 4"},
    demands,
    (
        LimitSlider(
            NAME,
            "Maximum angle of leg 4 from its direction at home.",
            lambda _: (1.0, 180.0),
            is_number=True,
            is_angle=True,
            free=180.0,
        ),
    ),
)


@pytest.fixture
def leaning() -> Generator[Design]:
    """A design with the limit, while the table has its row."""
    LIMITS.append(LEAN)
    limits = LeaningLimits(**msgspec.structs.asdict(OPTIMAL.limits), lean=HALF_ANGLE)
    yield msgspec.structs.replace(OPTIMAL, limits=limits)
    LIMITS.remove(LEAN)


def leans(position: Any) -> Any:
    """Return the angles of leg 4 from its direction at home, in degrees."""
    a3 = np.array([*OPTIMAL.a3, 0.0])
    at_home = np.array(OPTIMAL.home_pose.position) - a3
    return np.degrees(angle_between(position - a3, at_home / np.linalg.norm(at_home)))


def test_limit_added_to_the_table_is_kept_by_poses_moves_and_solids(leaning: Design) -> None:
    home, free = OPTIMAL.home_pose, limited(leaning, lean=None)
    rng = np.random.default_rng(0)
    p = np.array(home.position) + rng.uniform(-6.0, 6.0, (60, 3))
    r = Rotation.from_rotvec(0.1 * rng.normal(size=(60, 3))).as_matrix() @ home.rotation
    within = leans(p) <= HALF_ANGLE
    expected = poses_are_valid(free, p, r) & within
    assert (poses_are_valid(leaning, p, r) == expected).all()
    assert 0 < expected.sum() < poses_are_valid(free, p, r).sum()
    for position, rotation, is_within in zip(p, r, within.tolist(), strict=True):
        broken = evaluate(leaning, Pose.of(position, rotation)).violations
        assert (NAME in [each.limit for each in broken]) == (not is_within)
    ends = p[expected], r[expected], p[expected][::-1], r[expected][::-1]
    for share in np.linspace(0.0, 1.0, 30):
        along = (1.0 - share) * ends[0] + share * ends[2]
        assert (leans(along)[moves_are_valid(leaning, *ends)] < HALF_ANGLE + 0.01).all()
    assert NAME in [limit.name for limit in Workspace(leaning, home.rotation).limits]
    solid, whole = (workspace_solid(each, home.rotation) for each in (leaning, free))
    assert NAME in solid.limits
    assert solid.volume < 0.9 * whole.volume
    assert leans(solid.vertices).max() < HALF_ANGLE + 0.1


def test_limit_added_to_the_table_is_told_and_listed(leaning: Design) -> None:
    x, y, z = OPTIMAL.home_pose.position
    beyond = Pose((x - 6.0, y, z), OPTIMAL.home_pose.quaternion)
    told = [str(each) for each in evaluate(leaning, beyond).violations]
    angle = leans(np.array(beyond.position))
    assert f"{NAME} = {angle:.4g}° is above its maximum 12°" in told
    assert (NAME, "at most 12°") in list(limit_rows(leaning, UNITS))
    page = read(make_report(leaning).decode())
    assert "at most 12°" in table_of(page, "Limits in force")[NAME].text


def test_limit_added_to_the_table_has_a_slider(
    leaning: Design, services: Services, desk: Desk
) -> None:
    desk.session.do(open_design(leaning))
    panel = DesignPanel(services)
    sliders: dict[str, Any] = {}
    for handle, name, value in panel.updates(Frame(desk.state)):
        setattr(handle, name, value)
        if isinstance(handle, viser.GuiSliderHandle):
            sliders[handle.label] = handle
    assert sliders[NAME].value == HALF_ANGLE
    for value, kept in ((30.0, 30.0), (180.0, None)):
        desk.use(sliders[NAME], value)
        limits: Any = desk.state.design.limits
        assert limits.lean == kept
    assert desk.complaints == []
