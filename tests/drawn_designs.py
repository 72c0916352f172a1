"""Random designs with all the fields of a design file."""

from __future__ import annotations

import msgspec
from hypothesis import strategies as st
from strategies import designs

from explorer import Design, Limits, Pose

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


@st.composite
def complete_designs(draw: st.DrawFn) -> Design:
    """Draw a design with every field given or left to its default."""
    return msgspec.structs.replace(
        draw(designs()),
        name=draw(st.text(max_size=100).filter(str.isprintable)),
        unit_mm=draw(st.floats(1e-3, 1e3)),
        node_step=draw(st.none() | st.floats(1e-3, 1e3)),
        limits=draw(limits()),
        home=draw(st.none() | poses),
    )
