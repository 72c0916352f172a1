"""The moving page: its numbers are Python's, it needs nothing but its file, and it can be used."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import Any

import msgspec
import numpy as np
import pytest
from exported_designs import in_mm, limited_design, poses_about_home, random_poses, size_of
from legibility import mark_contrasts
from likeness import decoded
from numpy.testing import assert_allclose
from playwright.sync_api import Browser, Page, expect

from explorer import PRESETS, Design, forward, from_folds, inverse, margins, to_folds
from explorer.app.features.sharing.links import encode_link
from explorer.app.state.state import open_state
from explorer.app.state.view import View
from explorer.export.controller import limit_rows, pair_rows
from explorer.export.moving_page import NAMES, moving_page
from explorer.mechanism.configuration import Configuration
from explorer.mechanism.design import Limits
from explorer.mechanism.feasible_intervals import possible_ranges
from explorer.mechanism.margins import mode_of
from explorer.numerics.arrays import FloatArray
from explorer.workspace.limits.valid_poses import COLLISIONS, violations

OPTIMAL = PRESETS["paper-optimal"]
SHARE, COUNT = 1e-12, 500
LARGEST = 300_000


@pytest.fixture
def page(browser: Browser) -> Iterator[Page]:
    """A page without network in which nothing fails, that moves at once."""
    context = browser.new_context(
        viewport={"width": 1440, "height": 900}, reduced_motion="reduce", offline=True
    )
    page, faults, requests = context.new_page(), list[str](), list[str]()
    page.on("console", lambda message: faults.append(message.text))
    page.on("pageerror", lambda error: faults.append(str(error)))
    page.on("request", lambda request: requests.append(request.url))
    yield page
    context.close()
    assert faults == []
    assert all(url.startswith(("file:", "data:")) for url in requests)


def open_page(page: Page, design: Design, folder: Path) -> None:
    """Write the page of a design and open it from the disk."""
    data = moving_page(design)
    assert len(data) <= LARGEST
    (folder / "page.html").write_bytes(data)
    page.goto((folder / "page.html").as_uri())


def call(page: Page, function: str, rows: FloatArray) -> Any:
    """Return the results of a JavaScript function of `m`, the mechanism, and a row."""
    return page.evaluate(f"rows => {{ const m = window.page; return rows.map({function}); }}", rows)


def limits_in_python(design: Design, position: FloatArray, rotation: FloatArray) -> list[set[str]]:
    """Return what each pose breaks, in the words of the page."""
    words = {f"margin δ{k}": f"δ{k}" for k in (1, 2, 3)} | {f"box {x}": f"{x} of b4" for x in "xyz"}
    words |= {"gap |d1 − d3|": "|d1 − d3|", "carriage order": "d3 − d1"}
    words |= dict.fromkeys(COLLISIONS, "collision")
    return [
        {words.get(each.limit, each.limit.replace("swing", "Swing at")) for each in broken}
        for broken in violations(Configuration(design, position, rotation))
    ]


@pytest.mark.parametrize("seed", range(3))
def test_moving_page_has_the_numbers_of_python(page: Page, tmp_path: Path, seed: int) -> None:
    design = limited_design(seed)
    if seed == 0:
        design = design.with_limits(leg_radii=(0.0, 0.0, 0.0, 0.0))
    open_page(page, design, tmp_path)
    design = in_mm(design)
    size = size_of(design)
    position, rotation = random_poses(design, COUNT, seed)
    rows = np.concatenate([position, rotation.reshape(-1, 9)], axis=1).tolist()
    pose = "({ position: row.slice(0, 3), rotation: row.slice(3) })"
    for function, expected, error in (
        ("inverse", inverse(design, position, rotation), SHARE * size),
        ("margins", margins(position, rotation), SHARE * size),
        ("toFolds", to_folds(position, rotation), SHARE * np.array([size, 1, 1, 1, 1, 1])),
    ):
        found = np.array(call(page, f"row => m.{function}({pose})", rows))
        assert (np.abs(found - expected) <= error).all()

    folds = to_folds(position, rotation)
    poses = call(page, "row => m.fromFolds(row)", folds.tolist())
    positions, rotations = from_folds(folds)
    assert_allclose([each["position"] for each in poses], positions, rtol=0, atol=SHARE * size)
    turns = np.reshape([each["rotation"] for each in poses], (-1, 3, 3))
    assert_allclose(turns, rotations, rtol=0, atol=SHARE)

    half_turns = from_folds(folds * [1, 1, 1, 0, 0, 0] + [0, 0, 0, -np.pi, -np.pi, -np.pi])
    flat_rows = np.concatenate([half_turns[0], half_turns[1].reshape(-1, 9)], axis=1).tolist()
    assert (np.array(call(page, f"row => m.toFolds({pose})", flat_rows)) > -np.pi).all()

    # Of flat poses all legs are in one plane; axes that cross are apart by rounding.
    flat = from_folds(folds[:50] * [1, 1, 1, 0, 0, 0])
    near = poses_about_home(design, COUNT, seed)
    position, rotation = (np.concatenate(pair) for pair in zip(near, flat, strict=True))
    rows = np.concatenate([position, rotation.reshape(-1, 9)], axis=1).tolist()
    names = f"({{ limits, collisions }}) => [...limits.map(({{ index }}) => {list(NAMES)}[index])"
    names += ", ...(collisions.length ? ['collision'] : [])]"
    broken = call(page, f"row => ({names})(m.violations({pose}))", rows)
    assert [set(each) for each in broken] == limits_in_python(design, position, rotation)


@pytest.mark.parametrize(
    "design",
    [
        OPTIMAL,
        PRESETS["paper-initial"],
        # Dimensions that lose digits: b2 and b3 nearly coincide, a3 is nearly on the guide.
        msgspec.structs.replace(OPTIMAL, b2=2.6, b3=2.6 + 1e-6, unit_mm=1e-3),
        msgspec.structs.replace(OPTIMAL, a3=(1e3, 1e-3)),
    ],
)
def test_moving_page_finds_the_modes_of_python(page: Page, tmp_path: Path, design: Design) -> None:
    open_page(page, design, tmp_path)
    design = in_mm(design)
    joints = inverse(design, *random_poses(design, COUNT, 1))
    joints[::7] *= np.random.default_rng(1).uniform(0.5, 1.5, (len(joints[::7]), 6))
    positions, rotations, feasible = forward(design, joints)
    assert 0.03 < 1.0 - feasible.mean() < 0.3
    found = call(page, "row => m.forward(row)", joints.tolist())
    assert [each is not None for each in found] == feasible.tolist()
    # Both take the same steps, so that flat folds do not double the digits that are lost.
    position, rotation = from_folds([each for each in found if each is not None])
    assert_allclose(position, positions[feasible, 7], rtol=0, atol=SHARE * size_of(design))
    assert_allclose(rotation, rotations[feasible, 7], rtol=0, atol=SHARE)


def test_moving_page_moves_by_fields_sliders_modes_and_keys(page: Page, tmp_path: Path) -> None:
    name = "</script><b>*/ & “A”"
    open_page(page, msgspec.structs.replace(OPTIMAL, name=name), tmp_path)
    expect(page.locator("h1")).to_have_text(name)
    expect(page.locator("#limits-brief")).to_have_text("kept")

    # A value beyond a limit is taken, and the limit told.
    page.get_by_label("x (mm)").fill("23,5 cm")
    page.keyboard.press("Enter")
    expect(page.locator("#broken")).to_contain_text("x of b4 is 235.0 mm, above its maximum of 200")
    page.get_by_label("x (mm)").fill("200.0004")
    page.keyboard.press("Enter")
    told = "x of b4 is 200.0004 mm, above its maximum of 200.0000 mm"
    expect(page.locator("#broken")).to_contain_text(told)
    page.get_by_label("x (mm)").fill("235")
    page.keyboard.press("Enter")
    page.get_by_label("x (mm)").fill("1,234.5")
    page.keyboard.press("Enter")
    expect(page.locator("#message")).to_contain_text("“1,234.5” is no length")
    expect(page.get_by_label("x (mm)")).to_have_value("235")
    page.locator("#home").click()
    expect(page.locator("#broken")).to_have_text("All kept.")

    # A leg goes as far as the loops close.
    page.locator("#tabs").get_by_text("Leg lengths").click()
    page.get_by_label("l1 (mm)").fill("900")
    page.keyboard.press("Enter")
    expect(page.locator("#message")).to_contain_text("l1 is at most")
    expect(page.locator("#verdict")).to_have_text("Singular pose")
    expect(page.get_by_label("l1 (mm)")).not_to_have_value("900")
    page.locator("#home").click()

    # Each mode has the same joints.
    joints = inverse(in_mm(OPTIMAL), *state_of(page))
    for mode in range(8):
        page.get_by_role("button", name=f"mode {mode}").click()
        expect(page.locator("#modes [aria-pressed=true]")).to_contain_text(f"mode {mode}")
        position, rotation = state_of(page)
        assert mode_of(margins(position, rotation)) == mode
        assert_allclose(inverse(in_mm(OPTIMAL), position, rotation), joints, rtol=0, atol=1e-9)

    page.locator("#tabs").get_by_text("Folds").click()
    slider = page.locator("#sliders input[type=range]").nth(3)
    slider.focus()
    before = page.evaluate("window.page.state.folds[3]")
    page.keyboard.press("ArrowLeft")
    assert page.evaluate("window.page.state.folds[3]") < before


@pytest.mark.parametrize("seed", range(4))
def test_moving_page_opens_the_design_and_the_pose_of_a_link(
    page: Page, tmp_path: Path, seed: int
) -> None:
    design = limited_design(seed)
    if seed > 1:
        limits = Limits(margin=(None, 0.0)[seed - 2], carriage_order="any", gap=1 / 3)
        design = msgspec.structs.replace(design, limits=limits, home=None, b3=0.0)
    pose = design.home_pose.turn(np.zeros(3), np.array([0.1, 0.2, 0.3]))
    view = View(coordinates="lengths", flags=False, leaves=True)
    (tmp_path / "page.html").write_bytes(moving_page(OPTIMAL))
    fragment = encode_link(open_state(design, pose, view), (0.6, -0.48, 0.64))
    page.goto(f"{(tmp_path / 'page.html').as_uri()}#{fragment}")
    expect(page.locator("h1")).to_have_text(design.name)
    expect(page).to_have_title(f"{design.name} – flagged 4-4 manipulator")
    shown = [page.locator(f"#show-{name}").is_checked() for name in ("bodies", "flags", "folds")]
    assert shown == [True, False, True]
    expect(page.locator("#tabs :checked")).to_have_value("joints")
    position, rotation = state_of(page)
    assert_allclose(position, design.unit_mm * np.array(pose.position), rtol=SHARE)
    assert_allclose(rotation, pose.rotation, rtol=0, atol=SHARE)
    back = page.evaluate("window.page.scene.axesOf().back")
    assert_allclose(back, [0.6, -0.48, 0.64], rtol=0, atol=1e-9)
    # The words and the ranges of Python.
    words = [*limit_rows(design)[2], *pair_rows(design)[1]]
    found = page.locator("#limits td:nth-child(2)").all_text_contents()
    assert found == [each for each in words if each]
    joints = np.array(possible_ranges(design).joints) * design.unit_mm
    extra = 0.1 * np.array([[-1.0, 1.0]]) * np.ptp(joints, axis=1, keepdims=True)
    spans = page.evaluate(
        "[...document.querySelectorAll('#sliders [type=range]')].map(e => [+e.min, +e.max])"
    )
    now = inverse(in_mm(design), position, rotation)[:, None]
    wanted = np.clip(joints + extra, [-np.inf, -np.inf], now * [1, 0] + [0, np.inf])
    wanted[:, 1] = np.maximum(wanted[:, 1], now[:, 0])
    assert_allclose(spans, wanted, rtol=1e-9, atol=1e-9)

    # A damaged link is refused in words, and the page has its own design.
    page.goto("about:blank")
    page.goto(f"{(tmp_path / 'page.html').as_uri()}#{fragment[:-9]}{fragment[-8:]}")
    expect(page.locator("#message")).to_contain_text("The link is damaged")
    expect(page.locator("h1")).to_have_text(OPTIMAL.name)
    page.evaluate("location.hash = 'buildable'")
    expect(page.locator("h1")).to_have_text("buildable")


def state_of(page: Page) -> tuple[FloatArray, FloatArray]:
    pose = page.evaluate("window.page.state.pose")
    return np.array(pose["position"]), np.reshape(pose["rotation"], (3, 3))


@pytest.mark.draws
def test_moving_page_draws_and_turns_and_fits_a_telephone(page: Page, tmp_path: Path) -> None:
    page.set_viewport_size({"width": 390, "height": 844})
    open_page(page, OPTIMAL, tmp_path)
    canvas = page.locator("#canvas")
    expect(page.locator("#labels span").first).to_be_visible()
    assert page.evaluate("document.documentElement.scrollWidth") == 390
    pictures = [canvas.screenshot()]
    for key in ("ArrowLeft", "+", "f"):
        canvas.press(key)
        pictures.append(canvas.screenshot())
    # On a Russian keyboard another letter stands where F does.
    canvas.press("+")
    canvas.dispatch_event("keydown", {"key": "а", "code": "KeyF"})
    assert canvas.screenshot() == pictures[-1]
    box = canvas.bounding_box()
    assert box
    page.mouse.move(box["x"] + 50, box["y"] + 50)
    page.mouse.down()
    page.mouse.move(box["x"] + 150, box["y"] + 90)
    page.mouse.up()
    pictures.append(canvas.screenshot())
    page.mouse.wheel(0, 200)
    pictures.append(canvas.screenshot())
    assert len(set(pictures)) == len(pictures)
    # A picture that is not kept is black on paper.
    assert len(canvas.evaluate("canvas => canvas.toDataURL()")) > 10_000
    # On paper nothing is behind a scroll bar.
    page.set_viewport_size({"width": 1440, "height": 600})
    page.emulate_media(media="print")
    foot, body = (page.locator(each).bounding_box() for each in ("#origin", "body"))
    assert foot
    assert body
    assert foot["y"] + foot["height"] <= body["height"]


def test_moving_page_without_webgl_says_so_and_has_its_numbers(page: Page, tmp_path: Path) -> None:
    page.add_init_script("HTMLCanvasElement.prototype.getContext = () => null")
    open_page(page, OPTIMAL, tmp_path)
    page.get_by_label("z (mm)").fill("120")
    page.keyboard.press("Enter")
    expect(page.locator("#margin-brief")).to_have_text("δ2 = −114.8 mm")
    expect(page.locator("#scale")).to_contain_text("no WebGL 2")


def test_forced_colours_leave_sliders_and_choices_of_the_moving_page_to_be_seen(
    page: Page, tmp_path: Path
) -> None:
    open_page(page, OPTIMAL, tmp_path)
    for scheme in ("light", "dark"):
        page.emulate_media(forced_colors="active", color_scheme=scheme)
        for chosen in (":checked + span", "#modes [aria-pressed=true]"):
            assert min(mark_contrasts(page, chosen)) >= 3.0, (scheme, chosen)
        slider = decoded(page.locator("#sliders input[type=range]").first.screenshot())
        # Page, track, the part within the limits, and thumb.
        assert len(np.unique(slider.reshape(-1, slider.shape[-1]), axis=0)) > 3
