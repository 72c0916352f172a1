"""The eight assembly modes: a table, whose rows go there, and ghosts of the others in the scene."""

from __future__ import annotations

from collections.abc import Iterator
from html import escape

import numpy as np
import viser

from explorer.app.features.feature import Services
from explorer.app.features.mechanism.bodies import platform_plate
from explorer.app.features.mechanism.incidences import HoveredRow
from explorer.app.scene.placing import NO_POINTS, Placed, ScenePart, around
from explorer.app.scene.shapes import NO_MESH, add_label, add_lines, add_translucent
from explorer.app.state.actions import SetMode
from explorer.app.state.frame import Frame
from explorer.app.widgets.assigning import Update
from explorer.app.widgets.buttons import press_button
from explorer.app.widgets.chips import Chip, Chips, turn
from explorer.app.widgets.colours import GHOST
from explorer.app.widgets.commands import Key
from explorer.app.widgets.markup import box
from explorer.mechanism.margins import mode_name
from explorer.mechanism.pose import quaternion_from_rotation
from explorer.numerics.arrays import FloatArray
from explorer.numerics.number_text import format_fitted
from explorer.workspace.limits.valid_poses import Violation

MODES = tuple(f"{mode}:  {mode_name(mode)}" for mode in range(8))
"""The modes by number and sign triple, as in lists and beside ghosts."""

VALUES = frozenset(str(mode) for mode in range(len(MODES)))
GO, HOVER = "modes.go", "modes.hover"
GHOSTS_LABEL = "Other modes as ghosts"
# First words of limits whose whole names are too long for a row.
SHORT = {"gap |d1 − d3|": "gap", "carriage order": "order"}


def mode_hover(services: Services) -> HoveredRow:
    """Make the record of the mode on whose row a pointer rests; the scene shows its ghost."""
    return HoveredRow(services, HOVER, range(len(MODES)))


class ModesPanel:
    """The table of the modes, with the switch for the ghosts of all in its head."""

    def __init__(self, services: Services) -> None:
        self._session, buttons = services.session, services.buttons
        services.get(mode_hover)
        self._table = services.gui.add_html("")
        buttons.on(GO, self._go, values=VALUES)
        ghosts = Chip(
            "Ghosts",
            f"Pose › {GHOSTS_LABEL}",
            "Draw the seven other ways to assemble the same leg lengths.",
            turn("view.ghosts", GHOSTS_LABEL),
            keys=(Key("M"),),
            label=GHOSTS_LABEL,
        )
        self._ghosts = Chips(buttons, services.session, "modes.ghosts", "", {"": ghosts})
        for mode, name in enumerate(MODES):
            hint = f"Assemble the same leg lengths with the signs {mode_name(mode)} of δ1, δ2, δ3."
            words = " ".join(name.split())
            buttons.offer(f"Pose › Assembly mode › {words}", hint, GO, str(mode))

    def updates(self, frame: Frame) -> Iterator[Update]:
        """Yield the updates that make the panel show the frame."""
        yield self._table, "content", modes_table(frame, self._ghosts.buttons(frame.state))

    def _go(self, value: str, client: viser.ClientHandle) -> None:
        self._session.do(SetMode(int(value)), who=client.client_id)


def modes_table(frame: Frame, switch: str) -> str:
    """Return the table as HTML.

    Args:
        frame: The frame that is shown.
        switch: The switch for the ghosts, HTML.
    """
    state, snapshot = frame.state, frame.snapshot
    names = "".join(f"<span>{name}</span>" for name in ("", "δ1 δ2 δ3", "x", "y", "z", "limits"))
    of_last = (
        '<div class="ex-close">These lengths close in no mode; the modes below are those of the '
        "last lengths that did.</div>"
        if state.unclosed is not None
        else ""
    )
    return box(
        f'<div class="ex-line"><b>{snapshot.mode_words.capitalize()}</b>{switch}</div>',
        of_last,
        f'<div class="ex-modes"><div class="ex-mode ex-dim">{names}</div>',
        *(_row(frame, mode) for mode in range(len(MODES))),
        "</div>",
    )


def _row(frame: Frame, mode: int) -> str:
    solution, reach = frame.snapshot.modes, frame.state.design.reach
    is_here = mode in frame.snapshot.bordering_modes
    if solution.feasible:
        there = solution.position[mode] + frame.state.offset(solution.rotation[mode])
        place = "".join(
            f"<span>{format_fitted(value, reach, 3)}</span>" for value in there.tolist()
        )
        # The modes of a singular pose are all singular, so that none of them looks safe.
        look = "" if frame.snapshot.is_singular else "ex-within"
        limits, hint = _limits(frame.snapshot.mode_violations[mode], look)
    else:
        place, hint = '<span class="ex-dim is-wide">does not close</span>', ""
        limits = ""
    name = f"Mode {mode}, {mode_name(mode)}"
    return press_button(
        GO,
        mode,
        f"<b>{mode}</b><span>{mode_name(mode)}</span>{place}{limits}",
        hint=f"{name}. {hint}",
        label=name,
        class_name="ex-mode",
        hover=HOVER,
        is_on=is_here,
        is_disabled=not solution.feasible,
    )


def _limits(broken: tuple[Violation, ...], look: str) -> tuple[str, str]:
    """Return the cell that says which limits are broken, and the sentence on them.

    Args:
        broken: The limits that are broken.
        look: Class of the cell where none is.
    """
    if not broken:
        return f'<span class="{look}">within</span>', "It is within all limits."
    first = broken[0].limit
    words = SHORT.get(first, first.removeprefix("margin ").removeprefix("swing "))
    more = f" +{len(broken) - 1}" if len(broken) > 1 else ""
    sentences = "; ".join(map(str, broken))
    return f'<span class="ex-beyond">{escape(words)}{more}</span>', f"{sentences}."


def ghost_modes(frame: Frame, hovered: int | None) -> list[int]:
    """Return the modes that are drawn as ghosts: all others, the one that is pointed at, or none.

    Args:
        frame: The frame that is shown.
        hovered: The mode on whose row a pointer rests, if any.
    """
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
            add_translucent(scene, f"/ghosts/platform/{i}", NO_MESH, 0.35, colour=GHOST)
            for i in range(7)
        ]
        self._legs = add_lines(scene, "/ghosts/legs", 28, GHOST, 1.2)
        self._names = [
            add_label(scene, f"/ghosts/name/{i}", MODES[i], visible=False) for i in range(7)
        ]

    def updates(self, placed: Placed) -> Iterator[Update]:
        """Yield the updates that draw the ghosts of this frame."""
        modes = ghost_modes(placed.frame, self._hovered.row)
        for index, (plate, label) in enumerate(zip(self._plates, self._names, strict=True)):
            for handle in (plate, label):
                yield handle, "visible", index < len(modes)
        yield self._legs, "visible", bool(modes)
        if not modes:
            return
        solution = placed.frame.snapshot.modes
        positions = placed.scale * solution.position[modes]
        vertices, faces = platform_plate(placed)
        wxyzs = quaternion_from_rotation(solution.rotation[modes])
        for plate, position, wxyz in zip(self._plates, positions, wxyzs, strict=False):
            yield plate, "vertices", vertices.astype(np.float32)
            yield plate, "faces", faces.astype(np.uint32)
            yield plate, "position", tuple(position.tolist())
            yield plate, "wxyz", tuple(wxyz.tolist())
        tips = ghost_points(placed, modes)
        # Legs that are not shown have no length.
        lines = np.zeros((len(self._plates) * 4, 2, 3))
        lines[: 4 * len(modes)] = self._leg_lines(placed, tips)
        yield self._legs, "points", lines.astype(np.float32)
        for label, mode, tip in zip(self._names, modes, tips[:, 0], strict=False):
            yield label, "text", MODES[mode]
            yield label, "position", tuple(tip.tolist())

    def corners(self, placed: Placed) -> FloatArray:
        """Return the corners of cubes about the joints of the ghosts."""
        # A ghost that a pointer brings up does not move the camera.
        modes = ghost_modes(placed.frame, None)
        return around(ghost_points(placed, modes).reshape(-1, 3)) if modes else NO_POINTS

    @staticmethod
    def _leg_lines(placed: Placed, tips: FloatArray) -> FloatArray:
        bases = np.zeros_like(tips)
        bases[:, 1:3, 0] = tips[:, 1:3, 0]
        bases[:, 3] = placed.points["a3"]
        return np.stack([bases, tips], axis=2).reshape(-1, 2, 3)


def ghost_points(placed: Placed, modes: list[int]) -> FloatArray:
    """Return b1 … b4 of n assembly modes in the scene, shape (n, 4, 3)."""
    solution = placed.frame.snapshot.modes
    local = np.array(list(placed.platform_points.values()))
    turned = np.einsum("mij,nj->mni", solution.rotation[modes], local)
    return placed.scale * solution.position[modes][:, None] + turned
