"""The eight assembly modes: a table, whose rows go there, and ghosts of the others in the scene."""

from __future__ import annotations

from html import escape

import numpy as np

from explorer.app.features.feature import Services, show
from explorer.app.features.mechanism import bodies
from explorer.app.features.mechanism.incidences import HoveredRow
from explorer.app.inputs.controls import Controls
from explorer.app.scene import shapes
from explorer.app.scene.placing import NO_POINTS, Placed, ScenePart, around
from explorer.app.state.frame import Frame
from explorer.app.state.moves import set_mode
from explorer.app.widgets.buttons import press_button
from explorer.app.widgets.chips import Chips, StateCommand, turn
from explorer.app.widgets.markup import box
from explorer.mechanism.margins import mode_name
from explorer.mechanism.pose import quaternion_from_rotation
from explorer.numerics.arrays import FloatArray
from explorer.numerics.number_text import Unit, format_fitted
from explorer.page.widgets.assigning import Updates
from explorer.page.widgets.palette import Key
from explorer.workspace.limits.valid_poses import Collision, Violation

MODES = tuple(f"{mode}:  {mode_name(mode)}" for mode in range(8))
"""The modes by number and sign triple, as in lists and beside ghosts."""

GO, HOVER = "modes.go", "modes.hover"
GHOSTS_LABEL = "Other modes as ghosts"
# First words of limits whose whole names are too long for a row.
SHORT = {"gap |d1 − d3|": "gap", "carriage order": "order"}


def mode_hover(services: Services) -> HoveredRow:
    """Make the record of the mode on whose row a pointer rests; the scene shows its ghost."""
    return HoveredRow(services, HOVER, range(len(MODES)))


class ModesPanel(Controls):
    """The present mode; the table of all, with the switch for their ghosts in its head."""

    def __init__(self, services: Services) -> None:
        super().__init__(services)
        buttons = services.buttons
        services.get(mode_hover)
        self.markup(present_mode)
        with services.gui.add_folder("8 modes", expand_by_default=False):
            self.markup(lambda frame: modes_table(frame, chips.buttons(frame.state)))
        services.do_on_press(GO, lambda mode: set_mode(int(mode)), set("01234567"))
        ghosts = StateCommand(
            f"Pose › {GHOSTS_LABEL}",
            "Draw the seven other ways to assemble the same leg lengths.",
            *turn("view.ghosts", GHOSTS_LABEL),
            keys=(Key("M"),),
            words="Ghosts",
            spoken=GHOSTS_LABEL,
        )
        chips = Chips(buttons, services.session, "modes.ghosts", "", {"": ghosts})
        for mode in range(len(MODES)):
            hint = f"Assemble the same leg lengths with the signs {mode_name(mode)} of δ1, δ2, δ3."
            label = f"Pose › Assembly mode › {mode}: {mode_name(mode)}"
            buttons.offer(label, hint, GO, str(mode))


def present_mode(frame: Frame) -> str:
    """Return the present mode, and the limits that the pose breaks, as HTML."""
    broken = (each.words(frame.state.unit) for each in frame.snapshot.violations)
    alerts = (f'<div class="ex-beyond">{escape(words)}</div>' for words in broken)
    return box(f"<b>{frame.snapshot.mode_words.capitalize()}</b>", *alerts)


def modes_table(frame: Frame, switch: str) -> str:
    """Return the table of a frame, with the switch for the ghosts in its head, as HTML."""
    names = "".join(f"<span>{name}</span>" for name in ("", "δ1 δ2 δ3", "x", "y", "z", "limits"))
    head = f"{frame.state.point} in {frame.state.unit.name}"
    if frame.state.unclosed is not None:
        head = "These lengths close in no mode; below are those of the last lengths that did."
    return box(
        f'<div class="ex-line"><span class="ex-dim">{head}</span>{switch}</div>',
        f'<div class="ex-modes"><div class="ex-mode ex-dim">{names}</div>',
        *(_row(frame, mode) for mode in range(len(MODES))),
        "</div>",
    )


def _row(frame: Frame, mode: int) -> str:
    modes, reach, unit = frame.snapshot.modes, frame.state.design.reach, frame.state.unit
    there = unit.factor * (modes.position[mode] + frame.state.offset(modes.rotation[mode]))
    size = unit.factor * reach
    place = "".join(f"<span>{format_fitted(x, size, 3)}</span>" for x in there.tolist())
    # The modes of a singular pose are all singular, so that none of them looks safe.
    look = "" if frame.snapshot.is_singular else "ex-within"
    limits, hint = _limits(frame.snapshot.mode_violations[mode], look, unit)
    name = f"Mode {mode}, {mode_name(mode)}"
    return press_button(
        GO,
        mode,
        f"<b>{mode}</b><span>{mode_name(mode)}</span>{place}{limits}",
        hint=f"{name}. {hint}",
        label=name,
        class_name="ex-mode",
        hover=HOVER,
        is_on=mode in frame.snapshot.bordering_modes,
    )


def _limits(broken: tuple[Violation | Collision, ...], look: str, unit: Unit) -> tuple[str, str]:
    """Return the cell and the sentence on limits that are broken; `look` if none is."""
    if not broken:
        return f'<span class="{look}">within</span>', "It is within all limits."
    first = broken[0].limit
    words = SHORT.get(first, first.removeprefix("margin ").removeprefix("swing "))
    more = f" +{len(broken) - 1}" if len(broken) > 1 else ""
    sentences = "; ".join(each.words(unit) for each in broken)
    return f'<span class="ex-beyond">{escape(words)}{more}</span>', f"{sentences}."


def ghost_modes(frame: Frame, hovered: int | None) -> list[int]:
    """Return the modes drawn as ghosts: all others, that of the row pointed at, or none."""
    here = frame.state.mode
    if frame.state.view.ghosts:
        return [mode for mode in range(len(MODES)) if mode != here]
    return [] if hovered is None or hovered == here else [hovered]


class Ghosts(ScenePart):
    """The other assembly modes of the same joints, each with its number and sign triple.

    All seven are drawn, or the one on whose row in the table a pointer rests.
    """

    def __init__(self, services: Services) -> None:
        scene, self._hovered = services.scene, services.get(mode_hover)
        # Instanced meshes cannot change their shape, and these follow the design.
        self._plates = [
            shapes.add_translucent(
                scene, f"/ghosts/platform/{i}", shapes.NO_MESH, 0.35, colour=shapes.GHOST
            )
            for i in range(7)
        ]
        self._legs = shapes.add_lines(scene, "/ghosts/legs", 28, shapes.GHOST, 1.2)
        self._names = [shapes.add_label(scene, f"/ghosts/name/{i}", MODES[i]) for i in range(7)]

    def updates(self, placed: Placed) -> Updates:
        """Yield the updates that draw the ghosts of this frame."""
        modes = ghost_modes(placed.frame, self._hovered.row)
        for index, nodes in enumerate(zip(self._plates, self._names, strict=True)):
            yield from show(index < len(modes), *nodes)
        yield self._legs, "visible", bool(modes)
        if not modes:
            return
        each = placed.frame.snapshot.modes
        plate_mesh = bodies.platform_plate(placed)
        positions = placed.scale * each.position[modes]
        wxyzs = quaternion_from_rotation(each.rotation[modes])
        for plate, position, wxyz in zip(self._plates, positions, wxyzs, strict=False):
            yield from shapes.draw_mesh(plate, plate_mesh)
            yield plate, "position", tuple(position.tolist())
            yield plate, "wxyz", tuple(wxyz.tolist())
        tips = ghost_points(placed, modes)
        # Legs that are not shown have no length.
        lines = np.zeros((len(self._plates) * 4, 2, 3))
        lines[: 4 * len(modes)] = bodies.leg_lines(placed, tips)
        yield self._legs, "points", lines.astype(np.float32)
        for label, mode, tip in zip(self._names, modes, tips[:, 0], strict=False):
            yield from shapes.write_label(label, MODES[mode], tip)

    def corners(self, placed: Placed) -> FloatArray:
        """Return the corners of cubes about the joints of the ghosts."""
        # A ghost that a pointer brings up does not move the camera.
        modes = ghost_modes(placed.frame, None)
        return around(ghost_points(placed, modes).reshape(-1, 3)) if modes else NO_POINTS


def ghost_points(placed: Placed, modes: list[int]) -> FloatArray:
    """Return b1 … b4 of n assembly modes in the scene, shape (n, 4, 3)."""
    each = placed.frame.snapshot.modes
    return bodies.platform_joints(placed, each.position[modes], each.rotation[modes])
