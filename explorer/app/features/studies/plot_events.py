"""Events in the plots of a study, as the page reports them.

viser's plots report nothing to the server. The script `plots` sends each of their events as a press
whose value is a line of JSON. The server draws brushes and picks, for every browser.
"""

from __future__ import annotations

from typing import Annotated

import msgspec

from explorer.app.browser.browser_facts import decode_text
from explorer.app.features.studies.actions import MOST_RANGES
from explorer.app.state.studies import Range

Word = Annotated[str, msgspec.Meta(max_length=200)]
Ranges = Annotated[tuple[Range, ...], msgspec.Meta(max_length=MOST_RANGES)]
Index = Annotated[int, msgspec.Meta(ge=0, le=2**31)]


class Event(msgspec.Struct, frozen=True, forbid_unknown_fields=True, kw_only=True, tag_field="do"):
    """An event in a plot.

    Attributes:
        study: Name of the study of the plot.
    """

    study: Word


class Picked(Event, frozen=True, tag="pick"):
    """A click on a design."""

    index: Index


class Brushed(Event, frozen=True, tag="brush"):
    """A brush along an axis of the parallel lines; no ranges free it."""

    axis: Word
    ranges: Ranges


class Boxed(Event, frozen=True, tag="box"):
    """A box drawn in the scatter plot; None frees both axes."""

    axes: tuple[Word, Word]
    box: tuple[Range, Range] | None


_DECODER = msgspec.json.Decoder(Picked | Brushed | Boxed)


def event_of(line: str) -> Picked | Brushed | Boxed | None:
    """Return the event in a line of JSON; None if the script did not write it."""
    return decode_text(line, _DECODER)
