"""Courses, the tour and the lessons: Markdown files whose steps name what they ask of the state.

A course has a title and a sentence. Each of its steps has a title, instructions, and lines
"- key: value", of which all but the first two may be there several times:

    tab         the tab of the controls that the step is about
    control     the control that is ringed: the name of a slider, or the press of a button
    first       a setting that is made when the step begins, such as "tetrahedra = on"
    asked       a condition, such as "smallest margin < 1 % of the reach"
    shown       a setting that "Show me" makes, such as "δ3 = 0.5 % of the reach"
    then        a setting that is made when the user goes on

Conditions and settings speak of the values of `explorer.app.features.help.values`.
"""

from __future__ import annotations

import operator
import re
from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise
from typing import Any
from xml.etree.ElementTree import Element

from explorer.app.features.help.values import VALUES
from explorer.app.state.actions import Act, action
from explorer.app.state.frame import Frame
from explorer.app.state.state import State
from explorer.errors import ExplorerError, InputError
from explorer.export.drawings.markup import element, paragraph
from explorer.files.packaged import packaged_files
from explorer.measures.verdict import TITLES
from explorer.numerics.number_text import format_number

TOUR = "tour.md"
"""The file of the tour; the others are lessons."""
RELATIONS = ("asked", "first", "shown", "then")
KEYS = ("tab", "control", *RELATIONS)
TABS = (
    *("Pose", "Design", "Machine", "Singularity", "Workspace", "Tilt", "Loads", "Prototype"),
    *("Optimise", "Studies", "Compare", "Paths"),
)
"""Titles of the tabs that a step may be about."""
SIGNS = {
    "<": ("below ", operator.lt),
    ">": ("above ", operator.gt),
    "=": ("", operator.eq),
    "≠": ("not ", operator.ne),
}
LINE, RELATION = re.compile(r"- (\w+): +(.*)"), re.compile(r"(.+?) ([<>=≠]) (.+)")
OF_REACH = " % of the reach"
NUMBER, LENGTH = (re.compile(rf"(\d+(?:\.\d+)?){unit}") for unit in ("", OF_REACH))


@dataclass(frozen=True)
class Relation:
    """A condition on a named value, or a setting of it; a length is bounded in % of the reach."""

    name: str
    sign: str
    bound: float | str

    def holds(self, now: Frame, start: Frame) -> bool:
        """Whether a frame meets the condition, in a step that began in another."""
        value = VALUES[self.name].read(now, start)
        return value is not None and SIGNS[self.sign][1](value, self.bound)

    def reading(self, now: Frame, start: Frame) -> str:
        """Return what there is and is asked, such as "δ2: 7 % of the reach; asked: below 1 %"."""
        of = VALUES[self.name]
        there, bound = (
            f"{format_number(value, 3)}{unit if of.is_length else ''}"
            if isinstance(value, float)
            else value or "undetermined"
            for value, unit in ((of.read(now, start), OF_REACH), (self.bound, " %"))
        )
        name = f"{self.name[:1].upper()}{self.name[1:]}" if self.name.isascii() else self.name
        return f"{name}: {there}; asked: {SIGNS[self.sign][0]}{bound}"


def title_words(_: State, title: str, __: object) -> str:
    """Return the title of an action, which is the first of its two arguments."""
    return title


@action(title_words, is_jump=True)
def arrange(state: State, title: str, settings: tuple[Relation, ...]) -> State:
    """Make settings of the step with a title, one after the other; errors are those of each."""
    del title
    for each in settings:
        change = VALUES[each.name].set
        state = state if change is None else change(state, each.bound)
    return state


@dataclass(frozen=True)
class Step:
    """A step of a course: a task of the user, at a tab of the controls.

    Attributes:
        text: Instructions, with words between asterisks to be emphasised.
        control: CSS selector of the control that the text names; "" for none.
        first, shown, then: Settings when the step begins, that do it for the user, and when the
            user goes on.
    """

    title: str
    text: str
    tab: str
    control: str
    asked: tuple[Relation, ...]
    first: tuple[Relation, ...]
    shown: tuple[Relation, ...]
    then: tuple[Relation, ...]

    @property
    def instructions(self) -> Element:
        """The instructions as a paragraph of HTML."""
        parts = enumerate(self.text.split("*"))
        return paragraph(*(element("em", part) if at % 2 else part for at, part in parts))

    def is_done(self, now: Frame, start: Frame) -> bool:
        """Whether a frame has what the step asks for, if it began in another."""
        return not self.lacking(now, start)

    def lacking(self, now: Frame, start: Frame) -> list[str]:
        """Return what a frame has of each thing that it lacks of what the step asks for."""
        return [each.reading(now, start) for each in self.asked if not each.holds(now, start)]

    def solve(self, state: State, start: Frame) -> Act:
        """Return the action that does the step: from a state, or from home if it cannot from there.

        Raises:
            InputError: Neither does it.
        """
        words, home = "", Relation("verdict", "=", TITLES["clear"])
        for way in ((), (home,)):
            act = arrange(self.title, (*way, *self.shown))
            try:
                after = act.apply(state)
            except ExplorerError as error:
                words = str(error)
                continue
            words = ". ".join(self.lacking(Frame(after), start))
            # A search takes its time.
            if after.busy or not words:
                return act
        raise InputError(f"this design cannot do the step from here or from home. {words}")

    def readings(self, now: Frame, start: Frame) -> list[str]:
        """Return what a frame has of each thing that the step asks for."""
        return [each.reading(now, start) for each in self.asked]


@dataclass(frozen=True)
class Course:
    """The tour or a lesson: the name of its file, a title, a sentence, and its steps.

    A step of a lesson is done only while the state has what it asks for, and one does it or skips
    it; one of the tour stays done, and one may go on before.
    """

    file: str
    title: str
    sentence: str
    steps: tuple[Step, ...]
    is_lesson: bool


def list_courses() -> dict[str, Course]:
    """Return the courses of the explorer by their files; errors are those of `parse_course`."""
    files = packaged_files("lessons", ".md")
    return {file.name: parse_course(file.name, file.read_text("utf-8")) for file in files}


def parse_course(file: str, text: str) -> Course:
    """Return a course, given the name of its file and its Markdown.

    Raises:
        InputError: It is no course, or names what does not exist; with the line and what is
            allowed.
    """
    lines = text.splitlines()
    heads = [index for index, line in enumerate(lines) if line.startswith("#")]
    wrong = [index for index in heads if not lines[index].startswith("## " if index else "# ")]
    if wrong or heads[:1] != [0] or len(heads) < 2:
        line = 1 + min(wrong, default=0)
        words = 'it begins with "# TITLE", and then has steps, each with "## TITLE"'
        raise InputError(f"lesson {file}, line {line}: {words}")
    title, *words = lines[: heads[1]]
    steps = (_step(file, lines, *ends) for ends in pairwise((*heads[1:], len(lines))))
    return Course(file, title[2:], " ".join(words).strip(), tuple(steps), file != TOUR)


def _step(file: str, lines: list[str], start: int, end: int) -> Step:
    """Return the step of a course whose lines are from a start to an end."""
    given: dict[str, list[Any]] = {key: [] for key in ("text", *KEYS)}
    for at in range(start + 1, end):
        found = LINE.fullmatch(lines[at])
        key, value = ("text", lines[at].strip()) if found is None else found.groups()
        try:
            given.get(key, []).append(_parse(key, value))
        except InputError as error:
            raise InputError(f"lesson {file}, line {at + 1}: {error}") from None
    lacking = [key for key in ("text", "tab", "asked", "shown") if not any(given[key])]
    if lacking:
        raise InputError(f"lesson {file}, line {start + 1}: the step lacks {' and '.join(lacking)}")
    control = "".join(given["control"])
    slider = f'[role=slider][aria-label="{control}"]'
    return Step(
        lines[start][3:],
        " ".join(filter(None, given["text"])),
        given["tab"][0],
        control and (control if "[" in control else slider),
        *(tuple(given[key]) for key in RELATIONS),
    )


def _parse(key: str, value: str) -> str | Relation:
    """Return the value of a key; an InputError says what is allowed."""
    _check("the keys", key, ("text", *KEYS))
    if key == "tab":
        _check("the tabs", value, TABS)
    if key not in RELATIONS:
        return value
    found = RELATION.fullmatch(value)
    if found is None:
        raise InputError(f"{value!r} is not NAME < NUMBER, NAME > NUMBER or NAME = VALUE")
    (name, sign, bound), is_setting = found.groups(), key != "asked"
    what = "what can be set" if is_setting else "the values"
    _check(what, name, [each for each, of in VALUES.items() if of.set or not is_setting])
    options, is_length = VALUES[name].options, VALUES[name].is_length
    _check(f"the signs of {name}", sign, "=" if is_setting else "=≠" if options else "<>=")
    if options:
        _check(f"the words of {name}", bound, options)
        return Relation(name, sign, bound)
    number = (LENGTH if is_length else NUMBER).fullmatch(bound)
    if number is None:
        takes = f"a length such as 1{OF_REACH}" if is_length else "a number"
        raise InputError(f"{name!r} takes {takes}; got {bound!r}")
    return Relation(name, sign, float(number[1]))


def _check(what: str, value: str, allowed: Sequence[str]) -> None:
    if value not in allowed:
        raise InputError(f"{value!r} is not among {what}: {', '.join(allowed)}")
