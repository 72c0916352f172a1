"""Whether the machine can be built with its parts: the verdict, and the presses that mend it.

The worker finds it for each design. The tabs Prototype and Optimise and the dialog Export show it,
and the bar while it is negative.
"""

from __future__ import annotations

from functools import partial
from html import escape

from explorer.app.features.feature import Services, html_of
from explorer.app.session.feed import FeedOf
from explorer.app.state.actions import Set
from explorer.app.state.frame import Frame
from explorer.app.state.geometry import with_machine
from explorer.app.state.state import State
from explorer.app.widgets.buttons import figure, press_button
from explorer.app.widgets.chips import Chips, StateCommand
from explorer.app.widgets.markup import dim, row, sentence, status, table
from explorer.measures.blocks.block import Look
from explorer.mechanism.design import LENGTHS, Design
from explorer.motion.chains import LEGS
from explorer.numerics.number_text import format_decimals
from explorer.prototype.fitting import Buildability, buildability
from explorer.prototype.sizes import StrokeRange

MEND = "prototype.mend"
FITTING, STROKES = "fitting", "strokes"
"""The kinds of repair: unit and home for parts that do not fit, or limits beyond the strokes."""
STROKES_WORDS = "Limit the lengths to the strokes"
VERDICTS = {
    "Buildable": "The parts fit into one another, and each leg makes all lengths of its limits.",
    "Not buildable": "Some parts do not fit into one another, or into the room at a joint.",
    "Strokes too short": "A leg cannot make all lengths that its limits allow: a rod in its "
    "cylinder at most doubles the length.",
}
"""The verdicts, each with its meaning."""
STROKES_HINT = (
    "Set the limits of the lengths to what a rod in its cylinder reaches; the workspace may shrink."
)


def _request_for(frame: Frame) -> Design | None:
    return None if frame.state.busy else frame.state.design


BUILD_FEED = FeedOf(buildability, _request_for)


class BuildVerdict:
    """The verdict as HTML, the same wherever it stands."""

    def __init__(self, services: Services) -> None:
        self._feed = services.get(BUILD_FEED)
        commands = {
            what: StateCommand(f"Prototype › {words}", hint, partial(self._mend, what))
            for what, words, hint in (
                (FITTING, "Make the parts fit", "Set the least unit with which the parts fit."),
                (STROKES, STROKES_WORDS, STROKES_HINT),
            )
        }
        Chips(services.buttons, services.session, MEND, "", commands)

    def html(self) -> str:
        """Return whether the machine can be built, with the press that mends it."""
        if not (self._feed.is_current or self._feed.problem):
            return f'<div class="ex-status">{dim("Checking …")}</div>'
        return html_of(self._feed, verdict_words, "The parts could not be sized")

    def in_bar(self, _: Frame) -> str:
        """Return why the machine cannot be built as a figure of the bar; "" if it can."""
        built = self._feed.drawing
        if built is None or not (built.problems or built.short_legs):
            return ""
        words = "no" if built.problems else "strokes too short"
        if not self._feed.is_current:
            return figure("Prototype", "Buildable", "…", hint="The new design is being checked.")
        clauses = (*built.problems, built.advice) if built.problems else (strokes_problem(built),)
        hint = sentence(*clauses)
        return figure("Prototype", "Buildable", words, hint=hint, look="ex-beyond")

    def _mend(self, what: str, state: State) -> Set | None:
        built = self._feed.drawing
        # What was found for another design would bring that one back.
        if built is None or not self._feed.is_current or self._feed.request != state.design:
            return None
        remedy = built.remedy if what == FITTING else built.within_strokes
        words = mend_words(built) if what == FITTING else STROKES_WORDS
        if remedy is None:
            return None
        # The parts fit with radii of the legs that grow with the unit.
        kept = with_machine(remedy, state.design, state.view)
        design = kept.with_limits(leg_radii=remedy.limits.leg_radii)
        return Set("design", design, "Design", words)


def mend_words(built: Buildability) -> str:
    """Return the words of the press that makes the parts fit."""
    remedy, design, words = built.remedy, built.sizes.design, list[str]()
    if remedy is not None and remedy.unit_mm != design.unit_mm:
        words.append(f"set the unit to {remedy.unit_mm:.6g} mm")
    if remedy is not None and remedy.home != design.home:
        words.append("move home")
    return " and ".join(words).capitalize()


def verdict_words(built: Buildability) -> str:
    """Return whether a machine can be built, what is wrong, and the press that mends it."""
    if not built.problems and not built.short_legs:
        return _status("Buildable", "within")
    if built.problems:
        head, problems, press = "Not buildable", [*built.problems], ""
        if built.remedy is None:
            problems.append(built.advice)
        else:
            press = _button(FITTING, mend_words(built), sentence(built.advice))
    else:
        head, problems = "Strokes too short", [strokes_problem(built)]
        can_limit = built.within_strokes is not None
        press = _button(STROKES, STROKES_WORDS, STROKES_HINT) if can_limit else ""
    words = escape(sentence(*problems))
    return f"{_status(head, 'beyond')}<div>{words}</div>{press}"


def _status(verdict: str, look: Look) -> str:
    return status(verdict, look, VERDICTS[verdict])


def strokes_problem(built: Buildability) -> str:
    """Return the clause on the legs whose strokes are too short."""
    return (
        f"the rods of legs {', '.join(map(str, built.short_legs))} cannot make all lengths that "
        "the limits allow: a rod in its cylinder at most doubles the length of a leg"
    )


def _button(value: str, words: str, hint: str) -> str:
    button = press_button(MEND, value, words, hint=hint, class_name="ex-button")
    return f'<div class="ex-flow ex-after ex-before">{button}</div>'


def strokes_table(built: Buildability) -> str:
    """Return the stroke of each actuator beside what its limits ask for, as HTML, in mm."""
    sizes = built.sizes
    rows = (
        row(
            f"{LENGTHS[leg - 1]}, leg {leg}",
            _span(stroke),
            _span(sizes.required_stroke(leg)),
            look="ex-beyond" * (leg in built.short_legs),
        )
        for leg, stroke in zip(LEGS, sizes.strokes, strict=True)
    )
    return table(rows, ("actuator", "stroke, mm", "limits, mm"))


def _span(stroke: StrokeRange) -> str:
    return " to ".join(format_decimals(end, 1) for end in stroke)
