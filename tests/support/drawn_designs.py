"""Random designs with all the fields of a design file."""

from __future__ import annotations

from typing import Any

import msgspec
from hypothesis import strategies as st
from strategies import designs

from explorer import Actuators, Design, Guide, Limits, Payload, Pose, Struts, Tolerances, Tool
from explorer.numerics.checks import tidy_name

finite = st.floats(-1e3, 1e3)
lengths = st.floats(0.0, 1e3)
triples = st.tuples(finite, finite, finite)
ordered_pairs = st.tuples(finite, finite).map(lambda pair: (min(pair), max(pair)))
ranges = ordered_pairs.map(lambda pair: (abs(pair[0]), abs(pair[0]) + pair[1] - pair[0])) | (
    lengths.map(lambda low: (low, None))
)
boxes = st.tuples(triples, st.tuples(lengths, lengths, lengths)).map(
    lambda box: (box[0], (box[0][0] + box[1][0], box[0][1] + box[1][1], box[0][2] + box[1][2]))
)
poses = st.builds(
    Pose,
    triples,
    st.tuples(finite, finite, finite, finite).filter(lambda q: max(map(abs, q)) > 1e-6),
)
titles = st.text(max_size=100).filter(
    lambda text: text.isprintable() and text.strip(" .") != "" and len(tidy_name(text)) <= 100
)


def limits() -> st.SearchStrategy[Limits]:
    """Draw limits of every kind but cones."""
    return st.builds(
        Limits,
        **dict.fromkeys(("l1", "d2", "d4", "l4"), ranges),
        guide=st.none() | ordered_pairs,
        gap=lengths,
        box=st.none() | boxes,
        margin=st.none() | lengths,
        leg_radii=st.tuples(lengths, lengths, lengths, lengths),
    )


def machines() -> st.SearchStrategy[dict[str, Any]]:
    """Draw the fields of the machine around a mechanism, with the tool at b4."""
    some, angles = st.floats(1e-3, 1e3), st.tuples(lengths, lengths)
    six, errors = st.tuples(*[some] * 6), st.tuples(*[lengths] * 6)
    offsets = st.tuples(lengths, lengths, lengths)
    names = ("a1", "a3", "guide", "b1", "b2", "b3", "b4")
    turns = st.tuples(finite, finite, finite, finite)
    return st.fixed_dictionaries(
        {
            "tool": st.builds(
                Tool, quaternion=turns.filter(lambda turn: max(map(abs, turn)) > 1e-6)
            ),
            "payload": st.builds(Payload, lengths),
            "gravity": triples.filter(lambda way: max(map(abs, way)) > 1e-6),
            "actuators": st.builds(Actuators, st.none() | six, st.none() | six, errors, six),
            "struts": st.builds(Struts, st.floats(2.0, 9.0), st.floats(0.0, 1.0), some, some),
            "guide": st.builds(Guide, st.none() | some, st.none() | some),
            "tolerances": st.builds(
                Tolerances, **dict.fromkeys(names, offsets), guide_tilt_deg=angles
            ),
        }
    )


@st.composite
def complete_designs(draw: st.DrawFn) -> Design:
    """Draw a design with every field given or left to its default."""
    ideal: dict[str, Any] = {}
    return msgspec.structs.replace(
        draw(designs()),
        name=draw(titles),
        unit_mm=draw(st.floats(1e-3, 1e3)),
        node_step=draw(st.none() | st.floats(1e-3, 1e3)),
        limits=draw(limits()),
        home=draw(st.none() | poses),
        required_box=draw(st.none() | boxes),
        **draw(st.just(ideal) | machines()),
    )
