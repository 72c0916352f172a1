"""The load as an arrow to drag, the forces of the legs, and the bending of the struts.

The arrow of the load is as long as its force asks by a fixed scale. Those of weights and reactions
become ever shorter beside theirs, since they have no bound near singular poses; a label tells each
force.
"""

from __future__ import annotations

import math

import numpy as np

from explorer.app.features.feature import Services, follow_drags, show
from explorer.app.features.loads.load import Loads, fitting_scale, round_force, set_force
from explorer.app.scene import shapes
from explorer.app.scene.placing import NO_POINTS, Placed, ScenePart, scene_scale
from explorer.app.state.actions import Action
from explorer.app.state.state import State
from explorer.app.widgets.blocks import share_colour
from explorer.measures.blocks.block import Share
from explorer.measures.blocks.forces import utilisations
from explorer.mechanism.configuration import position_of
from explorer.mechanism.design import GUIDE_ROWS, JOINTS, LENGTH_ROWS
from explorer.mechanism.pose import Triple
from explorer.mechanism.rgb import Rgb
from explorer.numerics.arrays import FloatArray
from explorer.numerics.number_text import drop_rounding, format_number
from explorer.page.widgets.assigning import Updates
from explorer.statics.loaded import LoadedPose

LOAD: Rgb = (150, 40, 160)
# Largest lengths of the arrows of weight and reactions and of a bending moment, over the reach.
LONGEST_REACTION, LONGEST_BENDING = 0.4, 0.3
# Moment over the force of the scale and the reach at which a drawn moment is half its largest.
HALF_MOMENT = 0.25
SLEEVE_RADIUS, SLEEVE_OPACITY = 0.3, 0.45
# Number of ordinates of a drawn bending moment, and their places along the strut.
ORDINATES = 9
ALONG = np.linspace(0.0, 1.0, ORDINATES)[:, None]
HANDLE_NAME, HANDLE_SCALE = "/forces/handle", 0.8
# Radii of shaft and head over a length, and length of the head, in scene units.
SHAFT, HEAD, HEAD_LENGTH = 0.08, 0.21, 0.55
# Share of a short arrow that its head takes.
MOST_HEAD = 0.6
# Size of what is not drawn, since a copy of no size has no normals.
NOTHING = 1e-6
# Difference of forces that rounding makes, over the scale.
SAME_FORCE = 1e-3


class ForcesScene(ScenePart):
    """The load and the weight of the payload, forces of legs and carriages, and bending."""

    def __init__(self, services: Services) -> None:
        scene, self._loads = services.scene, services.get(Loads)
        self._shafts = shapes.Rods(scene, "/forces/arrows/shafts", [LOAD] * 8)
        self._heads = shapes.Instances(scene, "/forces/arrows/heads", shapes.cone(), [LOAD] * 8)
        self._sleeves = shapes.Rods(
            scene, "/forces/sleeves", [shapes.GHOST] * 4, opacity=SLEEVE_OPACITY
        )
        self._bending = [
            shapes.add_translucent(scene, f"/forces/bending/{leg}", shapes.NO_MESH, 0.35)
            for leg in (2, 3)
        ]
        self._ordinates = [
            shapes.add_lines(scene, f"/forces/ordinates/{leg}", ORDINATES + 1, None, 1.5)
            for leg in (2, 3)
        ]
        self._labels = {
            name: shapes.add_label(scene, f"/forces/label/{name}", name)
            for name in ("load", "weight", *JOINTS, "strut 2", "strut 3")
        }

    def updates(self, placed: Placed) -> Updates:
        """Yield the updates that draw the forces of this frame."""
        loaded = self._loads.of(placed.frame)
        visible = is_visible(placed)
        holds = visible and loaded.is_regular
        yield from show(visible, self._shafts, self._heads)
        yield from show(holds, self._sleeves, *self._bending, *self._ordinates)
        for name, label in self._labels.items():
            force = {"load": has_force(placed), "weight": weight_of(loaded) > 0.0}
            yield label, "visible", visible and force.get(name, holds)
        if not visible:
            return
        shares = utilisations(loaded)
        yield from self._draw_arrows(placed, loaded, shares)
        if not holds:
            return
        feet, tips = placed.struts
        radius = np.full(4, SLEEVE_RADIUS * placed.thickness)
        yield from self._sleeves.between(feet, tips, radius)
        yield from self._sleeves.colour(
            [shapes.linear_colour(share_colour(shares[i])) for i in LENGTH_ROWS]
        )
        for index in (0, 1):
            share = _larger(shares[6 + index], shares[10 + index])
            yield from self._draw_bending(placed, loaded, index, share)
        middles = 0.5 * (feet + tips)
        places = (middles[0], feet[1], middles[1], feet[2], middles[2], middles[3])
        forces, spread = loaded.reactions.actuators, loaded.reactions.spread
        size = float(np.abs(forces).max())
        for index, joint in enumerate(JOINTS):
            words = _newtons(drop_rounding(float(forces[index]), size), 3)
            if spread[index]:
                words += f" ± {_newtons(float(spread[index]), 2)}"
            words = f"{joint} {words}{_share_suffix(shares[index])}"
            yield from shapes.write_label(self._labels[joint], words, places[index])

    def corners(self, placed: Placed) -> FloatArray:
        """Return the tip of the load's arrow."""
        if not (is_visible(placed) and has_force(placed)):
            return NO_POINTS
        return load_tip(placed)[None]

    def _draw_arrows(
        self, placed: Placed, loaded: LoadedPose, shares: list[float | None]
    ) -> Updates:
        state = placed.frame.state
        tails, vectors = np.zeros((8, 3)), np.zeros((8, 3))
        colours: list[Rgb] = [LOAD] * 8
        tool = tool_point(placed)
        tails[0], vectors[0] = tool, load_tip(placed) - tool
        force = math.hypot(*state.view.forces.force)
        yield from shapes.write_label(self._labels["load"], _newtons(force, 3), load_tip(placed))
        weight = weight_of(loaded)
        if weight > 0.0:
            tails[1] = placed.on_platform(state.design.payload.centre)
            vectors[1] = reaction_vectors(placed, weight * np.array([state.design.gravity]))[0]
            words, tip = f"weight {_newtons(weight, 3)}", tails[1] + vectors[1]
            yield from shapes.write_label(self._labels["weight"], words, tip)
        if loaded.is_regular:
            feet, tips = placed.struts
            tails[2:6], tails[6:8] = tips, feet[1:3]
            forces = np.zeros((6, 3))
            forces[:4] = loaded.reactions.joints
            forces[4:, 0] = loaded.reactions.actuators[GUIDE_ROWS]
            vectors[2:] = reaction_vectors(placed, forces)
            l1, d1, d2, d3, d4, l4, *_ = shares
            colours[2:] = [
                share_colour(e) for e in (l1, _larger(d1, d2), _larger(d3, d4), l4, d1, d3)
            ]
        size, lengths = placed.thickness, np.linalg.norm(vectors, axis=1, keepdims=True)
        units = vectors / np.maximum(lengths, 1e-12)
        heads = np.minimum(HEAD_LENGTH * size, MOST_HEAD * lengths)
        necks = tails + units * (lengths - heads)
        radius = np.where(lengths[:, 0] > NOTHING, SHAFT * size, NOTHING)
        yield from self._shafts.between(tails, necks, radius)
        radii = np.minimum(HEAD * size, heads * HEAD / HEAD_LENGTH)
        scales = np.maximum(np.concatenate([radii, radii, heads], axis=1), NOTHING)
        yield from self._heads.place(necks, shapes.turn_z_to(vectors), scales)
        linear = [shapes.linear_colour(each) for each in colours]
        yield from self._shafts.colour(linear)
        yield from self._heads.colour(linear)

    def _draw_bending(
        self, placed: Placed, loaded: LoadedPose, index: int, share: float | None
    ) -> Updates:
        """Yield the updates that draw the bending moment of strut 2 or 3 beside it."""
        design, leg = placed.frame.state.design, index + 2
        foot, tip = (ends[leg - 1] for ends in placed.struts)
        # With what the payload's force of any direction adds.
        moment = float(loaded.reactions.bending[index] + loaded.reactions.spread[6 + index])
        half = HALF_MOMENT * scale_of(placed) * design.reach
        height = LONGEST_BENDING * placed.reach * moment / (moment + half)
        towards = math.copysign(1.0, float(loaded.reactions.actuators[1 + 2 * index]))
        top = foot + np.array([towards * height, 0.0, 0.0])
        colour = share_colour(share)
        yield self._bending[index], "vertices", np.array([foot, tip, top], dtype=np.float32)
        yield self._bending[index], "color", colour
        # The moment falls from the carriage to nothing at the platform's joint.
        lines = np.empty((ORDINATES + 1, 2, 3), dtype=np.float32)
        lines[:-1, 0] = foot + ALONG * (tip - foot)
        lines[:-1, 1] = top + ALONG * (tip - top)
        lines[-1] = top, tip
        yield self._ordinates[index], "points", lines
        yield self._ordinates[index], "colors", shapes.of_one_colour(colour, ORDINATES + 1)
        words = f"strut {leg} {format_number(moment * 1e-3 * design.unit_mm, 3)} N m"
        words += _share_suffix(share)
        yield from shapes.write_label(self._labels[f"strut {leg}"], words, top)


class LoadHandle(ScenePart):
    """The gizmo at the tip of the load's arrow, which moves it."""

    def __init__(self, services: Services) -> None:
        self.handle = services.scene.add_transform_controls(
            HANDLE_NAME,
            scale=HANDLE_SCALE,
            line_width=2.0,
            disable_rotations=True,
            depth_test=False,
            visible=False,
        )
        follow_drags(services, self.handle, "pull", self._pull)

    def force(self, state: State) -> Triple:
        """Return the force whose arrow ends where the gizmo is."""
        tool = scene_scale(state) * np.array(position_of(state.design, state.pose, "tool"))
        scale = state.view.forces.scale
        per_length = scale / (scene_scale(state) * state.design.reach)
        return round_force(per_length * (np.asarray(self.handle.position) - tool), scale)

    def _pull(self, state: State) -> Action:
        return set_force(self.force(state), keeps_scale=True)

    def updates(self, placed: Placed) -> Updates:
        """Yield the updates that keep the gizmo at the tip of the arrow."""
        state = placed.frame.state
        visible = is_visible(placed) and state.view.handle and has_force(placed)
        yield self.handle, "visible", visible
        # It has no arcs to turn it, and no turn.
        yield self.handle, "wxyz", (1.0, 0.0, 0.0, 0.0)
        # A place that was written back during a drag would move the gizmo under the pointer.
        same = SAME_FORCE * state.view.forces.scale
        if not visible or np.allclose(self.force(state), state.view.forces.force, 0.0, same):
            return
        yield self.handle, "position", tuple(load_tip(placed).tolist())


def is_visible(placed: Placed) -> bool:
    """Whether forces are drawn: of the mechanism itself, whose parts are in place."""
    view = placed.frame.state.view
    return view.forces.shown and not view.is_twin and not placed.is_apart


def has_force(placed: Placed) -> bool:
    """Whether there is a force at the tool to draw."""
    return any(placed.frame.state.view.forces.force)


def tool_point(placed: Placed) -> FloatArray:
    """Return the tool point in the scene, shape (3,)."""
    return placed.on_platform(placed.frame.state.design.tool.position)


def load_tip(placed: Placed) -> FloatArray:
    """Return the tip of the load's arrow in the scene, shape (3,)."""
    forces = placed.frame.state.view.forces
    return tool_point(placed) + placed.reach / forces.scale * np.array(forces.force)


def weight_of(loaded: LoadedPose) -> float:
    """Return the weight of the payload, in N, that counts."""
    return loaded.design.payload.weight_n if loaded.weighs_payload else 0.0


def reaction_vectors(placed: Placed, forces: FloatArray) -> FloatArray:
    """Return the arrows of forces (n, 3) in N, shape (n, 3), none longer than the largest."""
    sizes = np.linalg.norm(forces, axis=1, keepdims=True)
    longest = LONGEST_REACTION * placed.reach
    return np.asarray(longest * forces / (sizes + scale_of(placed)))


def scale_of(placed: Placed) -> float:
    """Return the force, in N, whose arrow is half as long as the longest."""
    state = placed.frame.state
    if has_force(placed):
        return state.view.forces.scale
    # Without a force the payload's weight tells how large forces are.
    return fitting_scale(state.design.payload.weight_n, state.view.forces.scale)


def _share_suffix(share: float | None) -> str:
    """Return a share of a limit beside a force, "" without a limit."""
    return "" if share is None else f" · {Share(share).text()}"


def _larger(*shares: float | None) -> float | None:
    """Return the largest of some shares."""
    return max((each for each in shares if each is not None), default=None)


def _newtons(value: float, digits: int) -> str:
    return f"{format_number(value, digits, infinite='∞')}{' N' if math.isfinite(value) else ''}"
