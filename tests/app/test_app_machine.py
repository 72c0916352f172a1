"""The machine on the page: values that are set, refused and told, and what the scene has of it."""

from __future__ import annotations

import itertools
import math
from collections.abc import Callable
from dataclasses import replace
from typing import Any

import msgspec
import numpy as np
import pytest
from desk import Desk, by_name, controls_of, markup_of, viewed
from hypothesis import given, strategies as st
from scipy.spatial.transform import Rotation

from explorer.app.features.feature import Services
from explorer.app.features.machine.feature import MachinePanel, set_tool_angle
from explorer.app.features.machine.scene import PayloadScene, ToolScene
from explorer.app.scene.placing import HALF_JOINT, Placed
from explorer.app.session.session import UNDO
from explorer.app.state.actions import Set, open_design
from explorer.app.state.frame import Frame
from explorer.app.state.state import open_state
from explorer.app.state.view import PrototypeView
from explorer.errors import InputError
from explorer.mechanism.design import Design
from explorer.mechanism.design_file import PRESETS, decode_design, encode_design
from explorer.mechanism.machine import Actuators, Guide, Payload, Six, Struts, Tool
from explorer.mechanism.pose import Pose, rotation_from_quaternion
from explorer.numerics.arrays import FloatArray

OPTIMAL = PRESETS["paper-optimal"]
TURNED = Tool((1.0, -0.5, 2.5), (0.5, 0.5, -0.5, 0.5))
PRESS = msgspec.structs.replace(
    OPTIMAL,
    tool=TURNED,
    payload=Payload(2.0, (1.0, 0.5, 1.5), 20.0),
    actuators=Actuators((150.0, 200.0, 150.0, 200.0, 150.0, 150.0)),
    struts=Struts(8.0, 6.0, stress_mpa=200.0),
    guide=Guide(200.0, 6.0),
)
ANGLE = st.floats(-180.0, 180.0)


class Hand:
    """A hand that uses the controls of the panel by their labels."""

    def __init__(self, services: Services, desk: Desk) -> None:
        self._desk, self._services, self._panel = desk, services, MachinePanel(services)
        self.controls: dict[str, Any] = {}
        self.show()

    def show(self) -> str:
        """Show the state, and return the markup of the panel."""
        state = self._desk.state
        self.controls = controls_of(self._services, self._panel, state)
        return markup_of(self._panel, state)

    def set(self, label: str, value: object) -> Design:
        """Set a control, and return the design after it is shown."""
        self._desk.use(self.controls[label], value)
        self.show()
        return self._desk.state.design


@pytest.fixture
def hand(services: Services, desk: Desk) -> Hand:
    return Hand(services, desk)


def six(value: float) -> Six:
    return (value, value, value, value, value, value)


def design_with(**machine: Any) -> Design:
    return msgspec.structs.replace(OPTIMAL, **machine)


# Controls


PLAIN: list[tuple[str, object, Callable[[Design], object]]] = [
    ("tool z", 3.25, lambda design: design.tool.position[2]),
    ("Mass (kg)", 2.5, lambda design: design.payload.mass_kg),
    ("centre y", -1.5, lambda design: design.payload.centre[1]),
    ("Force on the tool (N)", 20.0, lambda design: design.payload.force_n),
    ("Gravity", "along −y", lambda design: design.gravity[1] == -1.0),
    ("Limited forces", True, lambda design: design.actuators.push_n),
    ("Tubes", True, lambda design: design.struts.outer_mm),
    ("Moment given directly", True, lambda design: design.struts.moment_nm),
    ("Limited guide force", True, lambda design: design.guide.force_n),
    ("Limited guide moment", True, lambda design: design.guide.moment_nm),
    ("Error (mm)", 0.02, lambda design: design.actuators.error_mm[3]),
    ("Limited continuous force", True, lambda design: design.actuators.continuous_n),
    ("Limited speed", True, lambda design: design.actuators.speed_mm_s),
    ("Limited acceleration", True, lambda design: design.actuators.acceleration_mm_s2),
    ("Elastic", True, lambda design: design.actuators.stiffness_n_mm),
    ("a3 (± mm)", (0.1, 0.2, 0.0), lambda design: design.tolerances.a3),
    ("guide tilt z (± °)", 0.05, lambda design: design.tolerances.guide_tilt_deg[1]),
    ("Every length (± mm)", 0.04, lambda design: design.tolerances.b4[2]),
    ("Both tilts (± °)", 0.03, lambda design: design.tolerances.guide_tilt_deg[0]),
]


@pytest.mark.parametrize(("label", "value", "read"), PLAIN, ids=[label for label, *_ in PLAIN])
def test_control_changes_the_design_in_one_step_that_is_undone_and_saved(
    hand: Hand, desk: Desk, label: str, value: object, read: Callable[[Design], object]
) -> None:
    start = desk.state
    design = hand.set(label, value)
    assert read(design)
    assert read(design) == value or value is True or isinstance(value, str)
    assert hand.controls[label].value == value
    assert decode_design(encode_design(design), "mine.json") == design
    assert (desk.session.history.at, desk.complaints) == (1, [])
    desk.session.do(UNDO)
    assert desk.state == start


def test_inertia_is_taken_once_the_payload_can_have_it(hand: Hand, desk: Desk) -> None:
    label = "Inertia (kg mm²)"
    hand.set(label, (9.0, 8.0, 7.0))
    assert "the inertia must be zero without a mass" in hand.show()
    hand.set("Mass (kg)", 2.5)
    assert hand.controls[label].value == (0.0, 0.0, 0.0)
    # The fields are typed one after the other.
    for typed, taken in (
        ((9.0, 0.0, 0.0), (0.0, 0.0, 0.0)),
        ((9.0, 8.0, 0.0), (0.0, 0.0, 0.0)),
        ((9.0, 8.0, 7.0), (9.0, 8.0, 7.0)),
        ((9.0, 8.0, 18.0), (9.0, 8.0, 7.0)),
    ):
        assert hand.set(label, typed).payload.inertia_kg_mm2 == taken
        assert hand.controls[label].value == typed
        assert ("has a moment above the sum of the other two" in hand.show()) == (typed != taken)
    assert (desk.session.history.at, desk.complaints) == (2, [])
    # What is not taken goes with the next payload.
    hand.set("Force on the tool (N)", 1.0)
    assert hand.controls[label].value == (9.0, 8.0, 7.0)
    hand.set("Mass (kg)", 0.0)
    (complaint,) = desk.complaints
    assert "The inertia of the payload must be zero without a mass" in str(complaint)
    assert hand.set(label, (0.0, 0.0, 0.0)).payload.inertia_kg_mm2 == (0.0, 0.0, 0.0)
    assert hand.set("Mass (kg)", 0.0).payload.mass_kg == 0.0


def test_limits_are_switched_on_set_and_switched_off(hand: Hand) -> None:
    hand.set("Limited forces", True)
    hand.set("Push (N)", 400.0)
    assert hand.set("Pull of its own", True).actuators.pull_n == six(400.0)
    design = hand.set("Pull (N)", 300.0)
    assert design.actuators == Actuators(six(400.0), six(300.0))
    assert hand.set("Pull of its own", False).actuators == Actuators(six(400.0))
    assert hand.set("Limited forces", False).actuators == Actuators()
    for label, value in (
        ("Tubes", True),
        ("Inner diameter (mm)", 6.0),
        ("Outer diameter (mm)", 8.0),
        ("Young's modulus (GPa)", 210.0),
        ("Limited stress", True),
        ("Largest stress (MPa)", 150.0),
    ):
        design = hand.set(label, value)
    assert design.struts == Struts(8.0, 6.0, 210.0, 150.0)
    # The moment begins with that of the tube.
    moment = design.struts.largest_moment
    assert hand.set("Moment given directly", True).struts.moment_nm == moment
    assert hand.set("Largest moment (N m)", 5.0).struts.largest_moment == 5.0
    assert hand.set("Moment given directly", False).struts == design.struts
    assert hand.set("Tubes", False).struts == Struts(modulus_gpa=210.0, stress_mpa=150.0)
    hand.set("Limited guide force", True)
    hand.set("Limited guide moment", True)
    hand.set("Largest force (N)", 7.0)
    assert hand.set("Largest moment on it (N m)", 6.0).guide == Guide(7.0, 6.0)
    hand.set("Limited guide force", False)
    assert hand.set("Limited guide moment", False).guide == Guide()


def test_limits_of_motion_start_with_typical_values(hand: Hand) -> None:
    for label in ("Limited forces", "Limited continuous force", "Limited speed"):
        hand.set(label, True)
    design = hand.set("acceleration of l4 (mm/s²)", 500.0)
    limits = Actuators(
        push_n=six(100.0),
        continuous_n=six(100.0),
        speed_mm_s=six(200.0),
        acceleration_mm_s2=(*six(2000.0)[:5], 500.0),
    )
    assert design.actuators == limits


def test_field_of_a_limit_is_visible_only_while_the_limit_is_on(hand: Hand) -> None:
    fields = {
        "Push (N)": "Limited forces",
        "Pull (N)": "Pull of its own",
        "Outer diameter (mm)": "Tubes",
        "Largest stress (MPa)": "Limited stress",
        "Largest moment (N m)": "Moment given directly",
        "Largest force (N)": "Limited guide force",
        "Largest moment on it (N m)": "Limited guide moment",
    }
    for field, switch in fields.items():
        assert not hand.controls[field].visible
        assert not hand.controls[switch].value
    for switch in fields.values():
        hand.set(switch, True)
    assert all(hand.controls[field].visible for field in fields)
    # A rigid strut has no stress.
    hand.set("Tubes", False)
    assert hand.controls["Limited stress"].disabled
    assert not hand.controls["Largest stress (MPa)"].visible


def test_field_of_all_actuators_shows_what_counts_of_single_ones_and_sets_all(hand: Hand) -> None:
    hand.set("Limited forces", True)
    for label, value in (
        ("push of d1 (N)", 250.0),
        ("push of l4 (N)", 80.0),
        ("Elastic", True),
        ("Stiffness (N/mm)", 500.0),
        ("stiffness of l4 (N/mm)", 400.0),
        ("error of l1 (mm)", 0.03),
    ):
        design = hand.set(label, value)
    assert design.actuators == Actuators(
        (100.0, 250.0, 100.0, 100.0, 100.0, 80.0),
        error_mm=(0.03, 0.0, 0.0, 0.0, 0.0, 0.0),
        stiffness_n_mm=(500.0, 500.0, 500.0, 500.0, 500.0, 400.0),
    )
    for label, value in (
        ("Push (N)", 80.0),
        ("Error (mm)", 0.03),
        ("Stiffness (N/mm)", 400.0),
    ):
        assert hand.controls[label].value == value
    assert hand.set("Push (N)", 90.0).actuators.push_n == six(90.0)
    assert hand.set("Elastic", False).actuators.stiffness_n_mm is None


def test_fields_of_all_tolerances_show_the_largest(hand: Hand) -> None:
    hand.set("b2 (± mm)", (0.0, 0.3, 0.0))
    hand.set("guide tilt y (± °)", 0.2)
    assert hand.controls["Every length (± mm)"].value == 0.3
    assert hand.controls["Both tilts (± °)"].value == 0.2
    design = hand.set("Every length (± mm)", 0.1)
    assert (design.tolerances.stated[0], design.tolerances.stated[15]) == (0.1, 0.1)
    assert design.tolerances.guide_tilt_deg == (0.2, 0.0)


def test_limit_of_the_pull_alone_is_shown_and_kept(services: Services, desk: Desk) -> None:
    desk.session.do(open_design(design_with(actuators=Actuators(pull_n=six(90.0)))))
    hand = Hand(services, desk)
    assert hand.controls["Limited forces"].value
    assert not hand.controls["Push (N)"].visible
    assert hand.controls["Pull (N)"].value == 90.0
    assert hand.set("Limited forces", False).actuators == Actuators()


def test_direction_of_gravity_keeps_length_one(hand: Hand) -> None:
    assert hand.controls["Gravity"].value == "down, −z"
    assert hand.set("Gravity", "along +x").gravity == (1.0, 0.0, 0.0)
    design = hand.set("Direction", (3.0, 0.0, -4.0))
    assert design.gravity == pytest.approx((0.6, 0.0, -0.8))
    assert hand.controls["Gravity"].value == "—"
    assert hand.controls["Direction"].value == design.gravity
    # The empty option of the list changes nothing.
    assert hand.set("Gravity", "—") == design
    assert hand.set("Direction", (0.0, 0.0, -2.0)) == OPTIMAL
    assert hand.controls["Gravity"].value == "down, −z"


# What is refused


@pytest.mark.parametrize(
    ("label", "value", "message"),
    [
        ("Mass (kg)", -1.0, "The mass of the payload must not be negative; got -1"),
        (
            "tool x",
            20422.3,
            "The tool point must lie within 100 reaches (2042.23) of b4; got a distance of 20422.3",
        ),
        ("Direction", (0.0, 0.0, 0.0), "The direction of gravity must not be all zeros"),
        ("push of d1 (N)", 0.0, "The push of an actuator must be positive; got 0"),
        ("b1 (± mm)", (0.0, -0.1, 0.0), "A tolerance must not be negative; got -0.1"),
        (
            "Inner diameter (mm)",
            9.0,
            "The inner diameter of the struts must be below the outer diameter 8; got 9",
        ),
        ("Largest moment (N m)", 0.0, "The largest moment of the struts must be positive; got 0"),
    ],
)
def test_impossible_value_gets_one_line_and_changes_nothing(
    services: Services, desk: Desk, label: str, value: object, message: str
) -> None:
    desk.session.do(open_design(PRESS))
    hand = Hand(services, desk)
    before, shown, steps = desk.state, hand.controls[label].value, desk.session.history.at
    hand.set(label, value)
    assert (desk.state, desk.session.history.at) == (before, steps)
    assert desk.complaints == [message]
    assert hand.controls[label].value == shown


# The angles of the tool


@given(st.lists(st.tuples(st.integers(0, 2), st.one_of(ANGLE, st.sampled_from((90.0, -90.0))))))
def test_tool_angles_are_kept_as_set_and_turn_as_the_pose_does(
    turns: list[tuple[int, float]],
) -> None:
    state, angles = open_state(OPTIMAL), [0.0, 0.0, 0.0]
    for axis, angle in turns:
        state = set_tool_angle(axis, angle).apply(state)
        angles[axis] = angle
        # Also at a pitch of 90°, where yaw and roll turn about one axis.
        assert state.tool_angles == tuple(angles)
    turned = Rotation.from_euler("ZYX", angles, degrees=True).as_matrix()
    rotation = rotation_from_quaternion(state.design.tool.quaternion)
    assert np.allclose(rotation, turned, rtol=0.0, atol=1e-14)


def test_tool_angles_of_a_design_that_is_opened_are_its_own(desk: Desk) -> None:
    desk.session.do(set_tool_angle(0, 30.0))
    desk.session.do(set_tool_angle(1, 120.0))
    assert desk.state.tool_angles == (30.0, 120.0, 0.0)
    # The same orientation with a pitch within 90°.
    reopened = open_state(desk.state.design)
    assert reopened.tool_angles == pytest.approx((-150.0, 60.0, 180.0))
    # Angles of another orientation do not count.
    other = replace(reopened, set_tool_angles=(1.0, 2.0, 3.0))
    assert other.tool_angles == reopened.tool_angles
    with pytest.raises(InputError, match="finite"):
        set_tool_angle(2, math.inf).apply(reopened)


# Words


def test_panel_tells_the_weight_and_the_moment(hand: Hand, desk: Desk) -> None:
    assert "Their moment has no limit." in hand.show()
    desk.session.do(open_design(PRESS))
    shown = hand.show()
    assert "19.61 N" in shown
    # Of a tube of 8 and 6 mm at 200 MPa: σ π (D⁴ − d⁴) / (32 D).
    moment = 200e6 * math.pi * (0.008**4 - 0.006**4) / (32.0 * 0.008)
    assert f"{moment:.3f} N m, that of the tube" in shown
    desk.session.do(Set("design.struts.moment_nm", 5.0))
    assert "5 N m, as given" in hand.show()


# The scene


def placed(design: Design, pose: Pose | None = None, **view: Any) -> Placed:
    return Placed(Frame(viewed(open_state(design, pose), **view)))


def visible(nodes: dict[str, dict[str, Any]]) -> set[str]:
    return {name for name, node in nodes.items() if node.get("visible")}


def in_base(scene: Placed, point: tuple[float, ...]) -> FloatArray:
    """Return a point of the platform in the base, in scene units, by another way."""
    pose = scene.frame.state.pose
    turned = Rotation.from_quat(pose.quaternion, scalar_first=True).apply(point)
    return scene.scale * (np.array(pose.position) + turned)


@pytest.mark.parametrize(
    ("design", "view"),
    [
        (OPTIMAL, {}),
        (PRESS, {"machine": False}),
        (PRESS, {"prototype": PrototypeView(exploded=0.5)}),
    ],
)
def test_tool_and_payload_are_not_drawn_where_there_are_none_or_they_are_hidden(
    services: Services, design: Design, view: dict[str, Any]
) -> None:
    scene = replace(placed(design, **view), floor=0.0)
    tool, payload = ToolScene(services), PayloadScene(services)
    assert visible(by_name(itertools.chain(tool.updates(scene), payload.updates(scene)))) == set()
    assert len(tool.corners(scene)) == len(payload.corners(scene)) == 0


def test_tool_and_payload_hang_on_the_platform_and_are_in_the_picture(services: Services) -> None:
    tool, payload = ToolScene(services), PayloadScene(services)
    for pose in (None, Pose.of_yaw_pitch_roll((9.0, 8.0, 7.5), (-38.0, 24.0, 8.0))):
        scene = placed(PRESS, pose)
        nodes = by_name(itertools.chain(tool.updates(scene), payload.updates(scene)))
        assert len(visible(nodes)) == 6
        # All are children of the platform's frame, and so move with it.
        assert all(name.startswith("/platform/") for name in nodes)
        tip = scene.scale * np.array(TURNED.position)
        frame = nodes["/platform/tool"]
        assert frame["position"] == pytest.approx(tip.tolist())
        assert frame["wxyz"] == TURNED.quaternion
        assert np.allclose(
            nodes["/platform/tool-line"]["points"], np.stack([np.zeros(3), tip])[None]
        )
        assert nodes["/platform/payload-label"]["text"] == "2 kg"
        corners = tool.corners(scene)
        middle = in_base(scene, TURNED.position)
        assert np.allclose(0.5 * (corners.min(axis=0) + corners.max(axis=0)), middle)
        assert np.allclose(np.ptp(corners, axis=0), 2.0 * HALF_JOINT)
        ball = payload.corners(scene)
        assert np.allclose(ball.mean(axis=0), in_base(scene, PRESS.payload.centre))
        assert np.allclose(np.ptp(ball, axis=0), 2.0 * nodes["/platform/payload"]["scale"])
