"""The parts of the prototype: closed, of one piece, clear of each other wherever they move."""

from __future__ import annotations

import itertools
import json
import math
from collections.abc import Iterator
from functools import partial
from typing import Any

import msgspec
import numpy as np
import pytest
import trimesh
from hypothesis import given, strategies as st
from limited_designs import limited
from part_gaps import least_gap, overlaps, placed, touching
from reference import read_reference
from refusals import refusal
from scipy.spatial.transform import Rotation

from explorer import PRESETS, Design, InputError, Pose, leg_clearances
from explorer.mechanism.configuration import Configuration
from explorer.mechanism.design_file import decode_design
from explorer.motion.chains import BODIES, LEGS, ON_GUIDE, Places, joints_of_leg
from explorer.numerics.arrays import FloatArray
from explorer.prototype.assembly import Prototype, bill_of_materials, make_prototype
from explorer.prototype.fitting import THICKEST_SHARE, broken_joint_limits, buildability
from explorer.prototype.shapes import PrototypePart
from explorer.prototype.sizes import CLEARANCE, THINNEST_LEG, LegSizes, StrokeRange

OPTIMAL, INITIAL = PRESETS["paper-optimal"], PRESETS["paper-initial"]
HALF_TURN_X, HALF_TURN_Z = np.diag([1.0, -1.0, -1.0]), np.diag([-1.0, -1.0, 1.0])


def turned(design: Design, base: FloatArray, platform: FloatArray, name: str) -> Design:
    """Return the same mechanism with frames of base and platform that are turned in place."""
    home = design.home_pose
    a3, b1, b2, b3 = (
        turn @ [*point, 0.0]
        for turn, point in (
            (base, design.a3),
            (platform, design.b1),
            (platform, (design.b2, 0.0)),
            (platform, (design.b3, 0.0)),
        )
    )
    rotation = base @ home.rotation @ platform.T
    return msgspec.structs.replace(
        limited(design, box=None),
        name=name,
        a3=(float(a3[0]), float(a3[1])),
        b1=(float(b1[0]), float(b1[1])),
        b2=float(b2[0]),
        b3=float(b3[0]),
        home=Pose.of(base @ home.position, rotation),
    )


UNBOXED = turned(OPTIMAL, np.eye(3), np.eye(3), "unboxed")
BELOW = turned(OPTIMAL, HALF_TURN_X, np.eye(3), "below the base")
UPSIDE_DOWN = turned(OPTIMAL, np.eye(3), HALF_TURN_X, "platform upside down")
BACKWARDS = turned(OPTIMAL, HALF_TURN_Z, np.eye(3), "backwards along the guide")
LARGE = msgspec.structs.replace(
    limited(OPTIMAL, leg_radii=(0.3, 0.12, 0.2, 0.25), l1=(7.5, 12.0), l4=(9.0, 16.0)),
    name="large, each leg of its own",
    unit_mm=40.0,
)
DESIGNS = (OPTIMAL, INITIAL, BELOW, UPSIDE_DOWN, BACKWARDS, LARGE)
PROTOTYPES = {design.name: make_prototype(design) for design in (*DESIGNS, UNBOXED)}
NAMES = [design.name for design in DESIGNS]


def parts_named(prototype: Prototype, *names: str) -> list[PrototypePart]:
    return [part for part in prototype.parts if part.name in names]


def pose_of(prototype: Prototype) -> tuple[FloatArray, FloatArray]:
    home = prototype.design.home_pose
    return np.array(home.position), home.rotation


def at_home(prototype: Prototype) -> Places:
    return prototype.chains.places_at(*pose_of(prototype))


@pytest.mark.parametrize("name", NAMES)
def test_parts_are_closed_and_of_one_piece_and_have_their_masses(name: str) -> None:
    prototype = PROTOTYPES[name]
    parts, unit = prototype.parts, prototype.design.unit_mm
    assert [part.name for part in parts] == [*BODIES, "ball 1", "ball 2", "ball 3", "ball 4"]
    for part in parts:
        assert part.solid.is_watertight, part.name
        assert part.solid.volume > 0.0
        assert part.body in BODIES
        shape: Any = trimesh.Trimesh(1e-3 * unit * part.vertices, part.faces, process=False)
        assert shape.is_watertight
        assert shape.is_winding_consistent
        assert shape.body_count == 1, part.name
        mass = 2700.0 * float(shape.volume)
        assert part.mass(2700.0, unit).mass == pytest.approx(mass, rel=1e-9)
    bodies = prototype.masses(2700.0)
    assert list(bodies) == list(BODIES[1:])
    total = sum(part.mass(2700.0, unit).mass for part in parts[1:])
    assert sum(mass.mass for mass in bodies.values()) == pytest.approx(total, rel=1e-12)


@pytest.mark.parametrize("design", [BELOW, UPSIDE_DOWN, BACKWARDS])
def test_parts_of_turned_frames_are_those_of_the_same_mechanism(design: Design) -> None:
    plain, other = PROTOTYPES[UNBOXED.name], PROTOTYPES[design.name]
    assert other.sizes.radii == pytest.approx(plain.sizes.radii, rel=1e-9)
    for one, two in zip(plain.parts, other.parts, strict=True):
        assert two.solid.volume == pytest.approx(one.solid.volume, rel=1e-6), one.name
    turn = {BELOW: HALF_TURN_X, UPSIDE_DOWN: np.eye(3), BACKWARDS: HALF_TURN_Z}[design]
    one, two = (np.array(placed(p.parts, p.places(*pose_of(p)))[1]) for p in (plain, other))
    np.testing.assert_allclose(np.sort(one @ turn.T, axis=1), np.sort(two, axis=1), atol=0.02)


def motion(prototype: Prototype, many: int) -> Iterator[tuple[FloatArray, FloatArray]]:
    """Yield poses along a closed way about home, as wide as actuators and joints take it."""
    position, rotation = pose_of(prototype)
    reach = prototype.design.reach

    def pose(phase: float, width: float) -> tuple[FloatArray, FloatArray]:
        shift = np.sin(phase * np.array([1.0, 2.0, 3.0]) + [0.0, 0.4, 0.8])
        # Yaw goes the way in which the carriages part.
        angles = np.sin(phase * np.array([2.0, 3.0, 1.0]) + [0.1, 0.2, 0.3]) * [0.2, 0.4, 0.4]
        turn = Rotation.from_euler("ZYX", width * angles).as_matrix()
        return position + width * 0.5 * reach * shift, rotation @ turn

    for phase in np.linspace(0.0, 2.0 * math.pi, many, endpoint=False).tolist():
        for width in np.geomspace(1.0, 0.01, 29).tolist():
            found = pose(phase, width)
            if not broken_joint_limits(prototype.sizes, *found):
                yield found
                break
        else:
            pytest.fail("no pose in this direction is clear")


@pytest.mark.parametrize("name", NAMES)
def test_parts_keep_their_clearance_at_home_and_stay_clear_along_a_motion(name: str) -> None:
    prototype = PROTOTYPES[name]
    unit, places = prototype.design.unit_mm, at_home(prototype)
    assert broken_joint_limits(prototype.sizes, *pose_of(prototype)) == ()
    gap, one, two = least_gap(prototype.parts, places, 2.0 * CLEARANCE / unit)
    assert 0.99 * CLEARANCE < gap * unit < 1.1 * CLEARANCE, (one, two)
    far = 0.0
    for position, rotation in motion(prototype, 5):
        places = prototype.chains.places_at(position, rotation)
        assert list(overlaps(prototype.parts, places)) == []
        far = max(far, float(np.linalg.norm(position - pose_of(prototype)[0])))
    assert far > 0.03 * prototype.design.reach


def close_legs() -> tuple[Design, FloatArray, FloatArray]:
    """Return a design, and a pose in which a cup meets another leg: position and rotation."""
    row = read_reference("defects_prototype")
    design = decode_design(json.dumps(row["design"]).encode(), "defects_prototype.json")
    return design, np.array(row["position"]), np.array(row["rotation"])


def leg_gap(prototype: Prototype, position: FloatArray, rotation: FloatArray) -> float:
    """Return the least distance of parts of different legs in millimetres, at most 2 mm."""
    unit, places = prototype.design.unit_mm, prototype.chains.places_at(position, rotation)
    kinds = ("cross", "carriage", "cylinder", "rod")
    moving = [part for part in prototype.parts if part.kind in kinds]
    solids, boxes = placed(moving, places)
    gap = 2.0 / unit
    for i, j in itertools.combinations(range(len(moving)), 2):
        low, high = boxes[i]
        if moving[i].name[-1] != moving[j].name[-1] and touching((low - gap, high + gap), boxes[j]):
            gap = min(gap, float(solids[i].min_gap(solids[j], gap)))
    return gap * unit


def test_legs_whose_parts_meet_are_named_though_their_capsules_are_clear() -> None:
    design, position, rotation = close_legs()
    prototype = make_prototype(design)
    assert leg_gap(prototype, position, rotation) == 0.0
    assert (
        leg_clearances(Configuration(prototype.design, position, rotation)).clearance > 0.0
    ).all()
    (problem,) = broken_joint_limits(prototype.sizes, position, rotation)
    assert "the axes of legs 3 and 4 are 8.817 mm apart and need" in problem


@pytest.mark.parametrize("seed", range(2))
def test_legs_keep_the_clearance_of_parts_up_to_the_first_broken_limit(seed: int) -> None:
    rng = np.random.default_rng(seed)
    design, position, rotation = close_legs()
    radii = np.array(design.limits.leg_radii) * rng.uniform(0.7, 1.1, 4)
    prototype = make_prototype(limited(design, leg_radii=tuple(radii.tolist())))

    def pose(away: FloatArray) -> tuple[FloatArray, FloatArray]:
        turn = Rotation.from_rotvec(0.15 * away[3:]).as_matrix()
        return position + 0.06 * design.reach * away[:3], rotation @ turn

    def broken(away: FloatArray) -> tuple[str, ...]:
        return broken_joint_limits(prototype.sizes, *pose(away))

    found = rng.normal(size=(60, 6))
    kept = [away for away in found if not broken(away)]
    close = [away for away in found if "the axes of legs" in "".join(broken(away))]
    assert min(len(kept), len(close)) > 2
    gaps: list[float] = []
    for inner, outer in zip(kept[:6], itertools.cycle(close)):
        # The last pose on the way from one to the other that breaks no limit.
        good, bad = inner, outer
        for _ in range(40):
            middle = 0.5 * (good + bad)
            good, bad = (good, middle) if broken(middle) else (middle, bad)
        gaps.append(leg_gap(prototype, *pose(good)))
    assert min(gaps) >= CLEARANCE * (1.0 - 1e-6)
    assert min(gaps) < 2.0


@pytest.mark.parametrize("name", NAMES)
def test_parts_of_legs_lie_within_their_capsules(name: str) -> None:
    """Each vertex is near the axis of its leg, as the distances of legs take it."""
    prototype = PROTOTYPES[name]
    unit = prototype.design.unit_mm
    for part in prototype.parts:
        if part.kind not in ("cross", "carriage", "cylinder", "rod"):
            continue
        leg = int(part.name[-1])
        own, points = prototype.sizes.legs[leg - 1], part.vertices * unit
        joint = np.hypot(prototype.sizes.guide.eye, own.radius) if leg in ON_GUIDE else own.swing
        top = 0.0 if leg in ON_GUIDE else own.floor
        # A rod's origin is its ball, from which it extends down; others' is the base joint.
        spans = (
            [(-own.end, -own.rim, own.cup), (-math.inf, 0.0, own.radius)]
            if part.kind == "rod"
            else [(0.0, top, joint), (0.0, math.inf, own.radius)]
        )
        excess = [
            np.hypot(np.hypot(*points.T[:2]), points[:, 2] - np.clip(points[:, 2], low, high))
            - radius
            for low, high, radius in spans
        ]
        assert np.min(excess, axis=0).max() <= 1e-9 * unit, part.name


@pytest.mark.parametrize("name", [UPSIDE_DOWN.name, LARGE.name])
def test_ball_joints_up_to_nearly_a_right_angle_are_clear(name: str) -> None:
    prototype = PROTOTYPES[name]
    places = at_home(prototype)
    for leg in LEGS:
        own = parts_named(prototype, f"rod {leg}", "platform", f"ball {leg}")
        index = BODIES.index(f"rod {leg}")
        normal = -prototype.chains.platform_side * places.rotation[-1][:, 2]
        for azimuth in np.linspace(0.0, 2.0 * math.pi, 4):
            tangent = places.rotation[-1] @ [math.cos(azimuth), math.sin(azimuth), 0.0]
            for lean, fits in ((math.radians(85.0), True), (math.radians(130.0), False)):
                along = math.cos(lean) * normal + math.sin(lean) * tangent
                turn = places.rotation.copy()
                turn[index] = Rotation.align_vectors([along], [[0.0, 0.0, 1.0]])[0].as_matrix()
                found = list(overlaps(own, Places(places.origin, turn)))
                assert (found == []) is fits


@pytest.mark.parametrize("name", [OPTIMAL.name, LARGE.name])
def test_rods_over_their_stroke_stay_within_their_cylinders(name: str) -> None:
    prototype = PROTOTYPES[name]
    chains, (position, rotation) = prototype.chains, pose_of(prototype)
    unit = prototype.design.unit_mm
    for leg, (low, high) in zip(LEGS, prototype.sizes.strokes, strict=True):
        cylinder, rod = parts_named(prototype, f"cylinder {leg}", f"rod {leg}")
        radius = prototype.sizes.radii[leg - 1]

        def placed(length: float, leg: int = leg) -> Places:
            joints = chains.joints(position, rotation)
            joints_of_leg(joints, leg)[-1] = length / unit
            return chains.places(joints, position, rotation)

        for length in (low, 0.5 * (low + high), high):
            assert list(overlaps([cylinder, rod], placed(length))) == []
            # What of the rod is still in the bore guides it.
            top, foot = cylinder.vertices[:, 2].max(), length / unit + rod.vertices[:, 2].min()
            assert (top - foot) * unit > 2.9 * radius
        shorter = list(overlaps([cylinder, rod], placed(low - 2.0 * CLEARANCE)))
        assert len(shorter) == 1


@given(
    radius=st.floats(1.2, 100.0),
    floor=st.floats(0.5, 8.0),
    home=st.floats(1.1, 50.0),
    ends=st.tuples(st.floats(0.0, 1.0), st.floats(1.0, 5.0)),
)
def test_strokes_of_random_legs_hold_home_and_fit_one_rod(
    radius: float, floor: float, home: float, ends: tuple[float, float]
) -> None:
    own = LegSizes(radius, floor * radius)
    at_home = home * own.dead
    required = StrokeRange(ends[0] * at_home, ends[1] * at_home)
    found = own.stroke(required, at_home)
    slack = 1e-9 * at_home
    assert required.shortest - slack <= found.shortest <= at_home + slack
    assert at_home - slack <= found.longest <= required.longest + slack
    assert found.longest <= 2.0 * found.shortest - own.dead + slack
    # A stroke that fits one rod is that of the limits.
    if required.longest <= 2.0 * required.shortest - own.dead:
        assert found == pytest.approx(required, rel=1e-9)


def test_carriages_too_close_overlap_and_are_named() -> None:
    prototype = PROTOTYPES[OPTIMAL.name]
    position, rotation = pose_of(prototype)
    # At a yaw of −90° both legs are at the same place of the guide.
    turn = Rotation.from_euler("Z", -15.0, degrees=True).as_matrix() @ rotation
    assert "carriages 2 and 3 are" in " ".join(broken_joint_limits(prototype.sizes, position, turn))
    places = prototype.chains.places_at(position, turn)
    pairs = {frozenset(pair[:2]) for pair in overlaps(prototype.parts, places)}
    assert frozenset(("carriage 2", "carriage 3")) in pairs


@pytest.mark.parametrize(
    ("shift", "words"),
    [
        ((0.0, 0.0, 8.0), "mm long, its stroke is"),
        ((-9.5, 0.0, 0.0), "its rail is"),
        ((-8.0, 12.0, -7.0), "the universal joint at a3 leans"),
        ((9.0, 9.0, -8.5), "the ball joint at b4 leans"),
        ((0.0, 0.0, -12.0), "about the guide"),
    ],
)
def test_broken_joint_limits_are_named(shift: tuple[float, float, float], words: str) -> None:
    prototype = PROTOTYPES[OPTIMAL.name]
    position, rotation = pose_of(prototype)
    assert words in " ".join(
        broken_joint_limits(prototype.sizes, position + np.array(shift), rotation)
    )


@pytest.mark.parametrize("name", NAMES)
def test_places_of_random_poses_lie_along_the_legs(name: str) -> None:
    prototype = PROTOTYPES[name]
    design = prototype.design
    rng = np.random.default_rng(4)
    positions = rng.uniform(-1.0, 1.0, (50, 3)) * design.reach
    rotations = Rotation.random(50, random_state=rng).as_matrix()
    places = prototype.places(positions, rotations)
    assert places.origin.shape == (50, len(prototype.parts), 3)
    turns = places.rotation
    np.testing.assert_allclose(
        turns @ np.swapaxes(turns, -1, -2), np.broadcast_to(np.eye(3), turns.shape), atol=1e-12
    )
    np.testing.assert_allclose(np.linalg.det(turns), 1.0, rtol=1e-12)
    by_name = {part.name: k for k, part in enumerate(prototype.parts)}
    points = np.array([[*design.b1, 0], [design.b2, 0, 0], [design.b3, 0, 0], [0, 0, 0]])
    for leg, point in zip(LEGS, points, strict=True):
        rod, cylinder = by_name[f"rod {leg}"], by_name[f"cylinder {leg}"]
        end = positions + rotations @ point
        np.testing.assert_allclose(places.origin[:, rod], end, atol=1e-12 * design.reach)
        along = places.origin[:, rod] - places.origin[:, cylinder]
        across = np.cross(along, turns[:, cylinder, :, 2])
        np.testing.assert_allclose(across, 0.0, atol=1e-12 * design.reach)
        if leg in ON_GUIDE:
            np.testing.assert_allclose(along[:, 0], 0.0, atol=1e-12 * design.reach)


TIGHT = (
    (limited(OPTIMAL, leg_radii=(0.4,) * 4), "carriages 2 and 3 at home are 6.69 mm apart"),
    (
        msgspec.structs.replace(OPTIMAL, unit_mm=2.0),
        "carriages 2 and 3 at home are 1.34 mm apart and need 2.6 mm",
    ),
    (limited(OPTIMAL, leg_radii=(0.03, 0.0, 0.2, 0.0)), "the radius of leg 1 is 0.3 mm"),
    # Limits at round numbers: 12 mm and 1.2 mm fit.
    (limited(OPTIMAL, leg_radii=(0.1, 0.1, 0.1, 0.1)), "unit of at least 12 mm or legs of"),
    (limited(OPTIMAL, leg_radii=(0.1, 0.12, 0.14, 0.16)), "legs of radius at least 1.2 mm"),
    (limited(OPTIMAL, leg_radii=(0.1, 0.4, 0.4, 0.3)), "at least 1.2 mm and at most 3.24 mm"),
    (
        msgspec.structs.replace(
            limited(UNBOXED, leg_radii=(0.15,) * 4), b1=(0.2, -0.25), b2=1.0, b3=4.9
        ),
        "the ball joints at b1 and b4 are 3.2 mm apart",
    ),
    (
        limited(turned(OPTIMAL, np.eye(3), np.eye(3), "low"), leg_radii=(0.2, 0.2, 0.2, 3.0)),
        "too tight",
    ),
)


@pytest.mark.parametrize(("design", "words"), TIGHT)
def test_design_too_tight_for_parts_names_what_would_fit(design: Design, words: str) -> None:
    message = refusal(make_prototype, design)
    assert words in message
    built = buildability(design)
    unit, at_least, at_most = "a unit of at least", "legs of radius at least", "at most"
    offered = {
        phrase: float(message.partition(f"{phrase} ")[2].split()[0])
        for phrase in (unit, at_least, at_most)
        if phrase in message
    }
    assert offered or "no unit makes that fit" in message
    assert (built.remedy and built.remedy.unit_mm) == offered.get(unit)
    if unit in offered:
        make_prototype(msgspec.structs.replace(design, unit_mm=offered[unit]))
        refusal(make_prototype, msgspec.structs.replace(design, unit_mm=0.98 * offered[unit]))
    assert offered.get(at_least, THINNEST_LEG) == THINNEST_LEG
    for share, makes in ((1.0, make_prototype), (1.01, partial(refusal, make_prototype))):
        if offered.keys() & {at_most, at_least}:
            most = share * offered.get(at_most, math.inf)
            least = offered.get(at_least, 0.0) / share
            radii = (design.unit_mm * radius for radius in design.limits.leg_radii)
            each = [radius and min(max(radius, least), most) / design.unit_mm for radius in radii]
            makes(limited(design, leg_radii=tuple(each)))


def test_offer_is_the_least_unit_at_which_any_open_radius_fits() -> None:
    # The paper's problem leads to a design like this one, with carriages close together.
    found = msgspec.structs.replace(
        INITIAL, a3=(19.0561, 9.5175), b1=(2.027, -4.7727), b2=5.5619, b3=4.7706
    )
    built = buildability(limited(found, box=OPTIMAL.limits.box))
    assert "carriages 2 and 3 at home are 2.3 mm apart and need 2.6 mm" in built.problems
    assert "the universal joint at a3 leans 72.1°" in " ".join(built.problems)
    remedy = built.remedy
    assert remedy is not None
    assert remedy.home_pose.quaternion == found.home_pose.quaternion
    assert remedy.home_signs == found.home_signs
    assert buildability(remedy).problems == ()
    smaller = msgspec.structs.replace(remedy, unit_mm=0.99 * remedy.unit_mm)
    for share in np.geomspace(1e-3, 1.0, 60):
        each = THICKEST_SHARE * share * smaller.reach
        assert buildability(limited(smaller, leg_radii=(each,) * 4)).problems


def test_cylinders_too_long_for_their_rods_have_no_strokes_as_limits() -> None:
    # So thick are the legs that the least length of a rod in its cylinder exceeds the greatest.
    built = buildability(limited(OPTIMAL, leg_radii=(2.0,) * 4))
    assert any(stroke.shortest > stroke.longest for stroke in built.sizes.strokes)
    assert built.within_strokes is None


@pytest.mark.parametrize("design", [OPTIMAL, INITIAL, limited(OPTIMAL, leg_radii=(0.2,) * 4)])
def test_limits_at_the_strokes_are_covered_by_the_rods(design: Design) -> None:
    assert buildability(design).short_legs == (1, 2, 3, 4)
    limited = buildability(design).within_strokes
    assert limited is not None
    covered = buildability(limited)
    assert covered.short_legs == covered.problems == ()
    assert covered.within_strokes is None


def test_homes_beyond_joint_limits_are_refused() -> None:
    with pytest.raises(InputError, match=r"leg 1 is 117\.4 mm .* its limits.* its home at \("):
        make_prototype(limited(OPTIMAL, l1=(0.0, 11.0)))
    leaning = msgspec.structs.replace(
        OPTIMAL, home=Pose((12.0, 5.0, 4.0), OPTIMAL.home_pose.quaternion)
    )
    leans = r"at home the universal joint at a\d leans .* fits with its home at \("
    with pytest.raises(InputError, match=leans):
        make_prototype(leaning)
    parallel = msgspec.structs.replace(OPTIMAL, home=Pose.of_yaw_pitch_roll((10, 5, 9), (90, 0, 0)))
    with pytest.raises(InputError, match="no unit makes that fit"):
        make_prototype(parallel)


@pytest.mark.parametrize("name", [OPTIMAL.name, LARGE.name])
def test_bill_of_materials_has_every_part_and_actuator(name: str) -> None:
    prototype = PROTOTYPES[name]
    bill = bill_of_materials(prototype, 2700.0)
    assert [item.name for item in bill.items] == [part.name for part in prototype.parts]
    for item in bill.items:
        # Grams of aluminium, 2.7 to the cubic centimetre.
        assert item.mass * 1e3 == pytest.approx(2.7e-3 * item.volume, rel=1e-9)
        assert 0.0 < item.volume < math.prod(item.size)
    assert bill.mass == pytest.approx(sum(item.mass for item in bill.items), rel=1e-12)
    by_name = {item.name: item for item in bill.items}
    for actuator in bill.actuators:
        low, high = actuator.stroke
        cylinder, rod = (by_name[f"{kind} {actuator.leg}"] for kind in ("cylinder", "rod"))
        assert actuator.mass == pytest.approx(cylinder.mass + rod.mass, rel=1e-12)
        # Together they span the longest length, and neither exceeds the shortest.
        assert rod.size[2] < low < high < cylinder.size[2] + rod.size[2]
        assert actuator.required.shortest <= low
        assert high <= actuator.required.longest
        assert actuator.diameter == pytest.approx(2.0 * prototype.sizes.radii[actuator.leg - 1])
