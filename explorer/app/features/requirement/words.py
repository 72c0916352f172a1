"""The machines that were found and the checklist of the design, as HTML."""

from __future__ import annotations

import math
from collections.abc import Iterator
from functools import lru_cache
from html import escape

import numpy as np

from explorer.app.features.requirement.scene import EDGES, box_corners
from explorer.app.widgets import markup
from explorer.app.widgets.buttons import open_button, press_button
from explorer.export.drawings.markup import element, line, page_picture
from explorer.export.drawings.mechanism import fit_view, mechanism, points_to_show
from explorer.find.answers import DemandCheck, FoundDesign, FoundDesigns, RequirementCheck
from explorer.find.bound import round_down
from explorer.measures.snapshot import evaluate
from explorer.mechanism.design import Design
from explorer.numerics.number_text import format_number

TITLE = "What must it do?"
OPEN, RELAX, GO, DROP = "required.open", "required.relax", "required.go", "required.drop"
# Width and height of the picture of a machine, and the room at its edges, in its own units.
WIDTH, HEIGHT, ROOM = 300.0, 220.0, 14.0


KEPT, IMPOSSIBLE = "Requirement kept", "No machine can do this"
NOT_FOUND = "No machine was found"
VERDICTS = {
    KEPT: "The design does all that the requirement asks for, over its whole box.",
    "Demands missed": "The design does not do some of what the requirement asks for.",
    IMPOSSIBLE: "It is proven that no machine of this kind keeps the requirement.",
    NOT_FOUND: "The search ended without a machine that keeps the requirement.",
}
"""The verdicts, each with its meaning."""


@lru_cache(maxsize=16)
def picture(design: Design) -> str:
    """Return a machine at home with its required box, as SVG."""
    snapshot, corners = evaluate(design, design.home_pose), box_corners(design)
    points = points_to_show(snapshot)
    shown = points if corners is None else np.concatenate([points, corners])
    view = fit_view("isometric", shown, (ROOM, ROOM, WIDTH - ROOM, HEIGHT - ROOM))
    edges = [] if corners is None else [line(view.to(corners[edge]), "box") for edge in EDGES]
    machine = element("g", *mechanism(snapshot, view, None))
    name, size = f"{design.name} with its box", f"0 0 {WIDTH:g} {HEIGHT:g}"
    return page_picture("ex-machine", name, machine, *edges, viewBox=size)


def result(found: FoundDesigns | None, *, is_searching: bool) -> Iterator[str]:
    """Yield what a search has found: machines, the bound, and what can be had instead."""
    if is_searching:
        yield '<div class="ex-dim">Searching …</div>'
    if found is None:
        return
    if found.designs:
        cards = "".join(_card(i, one) for i, one in enumerate(found.designs))
        yield f'<div class="ex-machines" data-closes>{cards}</div>'
    if found.impossible:
        yield markup.alert(IMPOSSIBLE, markup.sentence(*found.impossible))
    elif not found.designs and not is_searching:
        yield markup.alert(NOT_FOUND, markup.sentence("relax a demand"))
    elif found.bound_mm > 0.0:
        least = round_down(found.bound_mm)
        yield f'<div class="ex-dim">No machine has legs below {least} mm.</div>'
    hint = "Demand this instead, and search again."
    chips = "".join(
        press_button(RELAX, index, escape(each.words), hint=hint, class_name="ex-chip")
        for index, each in enumerate(found.nearest)
    )
    yield f'<div class="ex-chips">{chips}</div>'


def _card(index: int, one: FoundDesign) -> str:
    rows = (
        ("Longest leg", f"{one.longest_mm:.0f} mm"),
        ("Force for 1 N", f"{format_number(one.force_per_newton, 2)} N"),
        ("Clearance", f"{format_number(one.clearance_mm, 3)} mm"),
        ("Transmission", format_number(one.transmission, 2)),
        ("Error", f"{format_number(one.error_mm, 2)} mm" if one.error_mm else ""),
    )
    name, check = one.kind.replace("-", " ").capitalize(), one.check
    proof = "Proven" if check.proven else f"No violation in {format_number(check.poses)} poses"
    if check.missed:
        proof = f'<span class="ex-beyond">Misses {escape(check.missed[0].words)}</span>'
    numbers = markup.table(markup.row(markup.dim(label), text) for label, text in rows if text)
    main = " is-main" * (index == 0)
    content = (
        f"{picture(one.design)}<b>{escape(name)}</b>{numbers}"
        f'<div class="ex-dim ex-small">{proof}</div><span class="ex-button{main}">Open</span>'
    )
    hint = "Make this machine the design, with the requirement beside it."
    return press_button(OPEN, index, content, hint=hint, label=f"Open {name}")


def checklist(check: RequirementCheck | None, problem: str, look: str) -> str:
    """Return the demands of a requirement, each kept or missed, over the scene.

    Without a check it says why there is none, or that it is under way.
    """
    head, rows = markup.dim(escape(problem) or "Checking …"), ""
    if check is not None:
        missed = f"{len(check.missed)} of {len(check.demands)} demands missed"
        words, level = (KEPT, "within") if check.kept else (missed, "beyond")
        head = f'<b class="ex-{level}">{words}</b>'
        rows = "".join(map(_demand_row, check.demands))
    title = open_button(TITLE, head, hint="Open the requirement.")
    drop = press_button(DROP, "", "×", hint="Check no longer.", label="Drop the requirement")
    return (
        f'<div class="ex-checklist" role="status"><div class="ex-ends">{title}{drop}</div>'
        f'<div class="{look}">{rows}</div></div>'
    )


def _demand_row(demand: DemandCheck) -> str:
    unit = demand.unit if demand.unit in ("", "°") else f" {demand.unit}"
    worst, limit, short = (
        format_number(value, 3, infinite="∞")
        for value in (demand.worst, demand.limit, -demand.spare)
    )
    signs = "≥≤" if demand.kept else "><"
    sign = signs[demand.worst <= demand.limit]
    values = f"{worst} {sign} {limit}{unit}" if demand.limit or demand.worst else ""
    missed = f"by {short}{unit}" if demand.spare and math.isfinite(demand.spare) else "no"
    level, mark = ("within", "✓") if demand.kept else ("beyond", missed)
    name = escape(f"{demand.words[:1].upper()}{demand.words[1:]}")
    content = f'<span>{name}</span><span>{values}</span><span class="ex-{level}">{mark}</span>'
    hint = "Proven." if demand.proven else markup.sentence(demand.remark or "checked in poses")
    if demand.pose is not None:
        hint += " A press goes to the worst pose."
    return press_button(GO, demand.name, content, hint=hint, is_disabled=demand.pose is None)
