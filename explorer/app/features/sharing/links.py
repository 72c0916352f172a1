"""Links: a state in the fragment of an address, which any explorer and any moving page opens."""

from __future__ import annotations

from dataclasses import replace

import msgspec

from explorer.app.features.requirement.state import Required
from explorer.app.state.actions import action
from explorer.app.state.parts import parts_kept_on_open, with_value
from explorer.app.state.state import State, open_state
from explorer.app.state.view import View
from explorer.errors import InputError
from explorer.files.fragments import decode_fragment, encode_fragment, sparse
from explorer.files.json_text import decode_strictly
from explorer.mechanism.design import Design
from explorer.mechanism.design_file import PRESETS
from explorer.mechanism.pose import Pose, Triple

LONGEST = 1900
"""Largest length of a fragment, which leaves 100 letters of 2,000 for the address before it."""


class Link(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """What a link holds of a state.

    Attributes:
        home: The home pose where the design states none, for pages that cannot choose it.
        towards: Direction from what is looked at to the eye; None for that of a new page.
    """

    design: Design
    pose: Pose
    view: View = View()
    required: Required = Required()
    home: Pose | None = None
    towards: Triple | None = None

    @staticmethod
    def of(state: State, towards: Triple | None = None) -> Link:
        """Return the link to a state, seen from a direction."""
        design = state.design
        home = None if design.home else design.home_pose
        return Link(design, state.pose, state.view, Required.of(state), home, towards)


def encode_link(state: State, towards: Triple | None = None) -> str:
    """Return the fragment of the link to a state, seen from a direction.

    Raises:
        InputError: It is longer than `LONGEST`.
    """
    fragment = encode_fragment(sparse(Link.of(state, towards)))
    if len(fragment) > LONGEST:
        raise InputError(
            f"the link would have {len(fragment):,} letters, and may have {LONGEST:,}: this design "
            "has many numbers with all digits; download the design instead"
        )
    return fragment


def decode_link(fragment: str) -> Link:
    """Return what a fragment holds; that of a preset, in its home pose, for the preset's name.

    Raises:
        InputError: The fragment is damaged, or of a later version of the explorer.
    """
    if fragment in PRESETS:
        return Link.of(open_state(PRESETS[fragment]))
    return decode_strictly(decode_fragment(fragment), Link, "the link")


@action("Open the link to {design}", is_jump=True)
def open_link(state: State, link: Link) -> State:
    """Open the design of a link with pose, view and requirement, unless one is being optimised.

    Other lengths, as those of the next path, stay in mm, unless both views are in design units.
    """
    state.check_free()
    view = state.view if state.view.lengths == "mm" else link.view
    scaled = replace(state, view=view).in_unit_of(link.design)
    kept = parts_kept_on_open(scaled) | {"view": link.view}
    opened = replace(open_state(link.design, link.pose), **kept)
    return with_value(opened, Required.in_state, link.required)
