"""The moves to singular poses, and the distances to all strata, which the worker computes."""

from __future__ import annotations

from typing import TypeAlias

from explorer.app.session.feed import Feed, FeedOf
from explorer.app.state.actions import action
from explorer.app.state.frame import Frame
from explorer.app.state.moves import move_to
from explorer.app.state.state import State
from explorer.errors import InputError
from explorer.mechanism.configuration import Configuration
from explorer.mechanism.design import Design
from explorer.mechanism.margins import INCIDENCES
from explorer.mechanism.pose import Pose
from explorer.singularity.nearest import nearest_singularities
from explorer.singularity.nearest_stratum import nearest_in_strata, nearest_in_stratum
from explorer.singularity.strata import Stratum, codimension, describe_stratum, stratum_of


def _stratum_words(_: State, stratum: Stratum) -> str:
    return f"Go to stratum {stratum_name(stratum)}"


@action(_stratum_words)
def go_to_stratum(state: State, stratum: Stratum) -> State:
    """Move to the nearest pose in a stratum of codimension one or more.

    Raises:
        InputError: There is no such stratum, or none of its poses is the nearest: it is the
            generic one, or the pose lies in it or in its boundary.
    """
    goal = tuple(stratum)
    nearest = nearest_in_stratum(state.design, state.pose, goal)
    if codimension(goal) == 0:
        raise InputError(
            "generic poses lie arbitrarily close to every pose; choose a singular stratum, or "
            "move any margin off zero"
        )
    here = stratum_of(Configuration.at(state.design, state.pose))
    if here == goal:
        raise InputError(f"the pose lies in {stratum_name(goal)} already: {describe_stratum(goal)}")
    if nearest.distance == 0.0:
        raise InputError(
            f"the pose lies in {stratum_name(here)}, which {stratum_name(goal)} borders on, "
            "so none of its poses is the nearest; move a margin off zero"
        )
    return move_to(state, nearest.pose)


def _singularity_words(_: State, incidence: int | None) -> str:
    return f"Go to the nearest {f'pose with δ{incidence} = 0' if incidence else 'singular pose'}"


@action(_singularity_words)
def go_to_singularity(state: State, incidence: int | None) -> State:
    """Move to the nearest pose with an incidence, 1 to 3, or with any for None.

    Raises:
        InputError: The pose has that incidence already.
    """
    poses = nearest_singularities(state.design, state.pose)
    nearest = min(poses, key=lambda pose: pose.distance)
    if incidence is not None:
        nearest = poses[incidence - 1]
    if nearest.distance == 0.0:
        index = nearest.incidence
        raise InputError(f"the pose has δ{index} = 0 already: {INCIDENCES[index - 1]}")
    return move_to(state, nearest.pose)


def stratum_name(stratum: Stratum) -> str:
    """Return the name of a stratum, such as "(3, 4, 2, 1)"."""
    return f"({', '.join(map(str, stratum))})"


def strata_distances(request: tuple[Design, Pose]) -> dict[Stratum, float]:
    """Return the root-mean-square displacements of b1 to b4 to all strata, in design units."""
    return {stratum: pose.distance for stratum, pose in nearest_in_strata(*request).items()}


def _request_for(frame: Frame) -> tuple[Design, Pose] | None:
    if not frame.state.view.singular.strata and not frame.snapshot.is_singular:
        return None
    return frame.state.design, frame.state.pose


StrataFeed: TypeAlias = Feed[tuple[Design, Pose], dict[Stratum, float]]
STRATA_FEED = FeedOf(strata_distances, _request_for)
"""The distances to the strata, for the diagram; at a singular pose the list needs some too."""
