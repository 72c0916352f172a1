"""A lesson as a handout: its steps, each beside a picture of the mechanism once it is done."""

from __future__ import annotations

from base64 import b64encode
from collections.abc import Iterator
from contextlib import suppress
from xml.etree.ElementTree import Element

from explorer.app.features.help.lessons import Course, Step, arrange
from explorer.app.features.paths.state import journey_of
from explorer.app.state.frame import Frame
from explorer.app.state.state import State, open_state
from explorer.errors import InputError
from explorer.export.drawings.figure import figure_svg
from explorer.export.drawings.markup import element, illustration, paragraph
from explorer.export.drawings.mechanism import fit_view, points_to_show
from explorer.export.report.document import page_html
from explorer.measures.snapshot import Snapshot

# Width of a picture in millimetres, so that five steps take two sheets.
WIDTH = 66.0


def handout_html(course: Course, present: State) -> str:
    """Return a lesson on the design of a state, in the unit of its view, to be printed.

    A step that the design cannot do says so.
    """
    state = open_state(present.design, view=present.view)
    about = element("p", f"Lesson on {state.design.name}", class_="kind")
    body = element("body", about, element("h1", course.title), paragraph(course.sentence))
    for number, (step, frame) in enumerate(solve(course, state), 1):
        # Right after a heading, a paragraph would stay on the sheet of what follows.
        head = element("header", element("h2", f"{number}  {step.title}"))
        task = element("div", head, step.instructions)
        body.append(element("section", task, _picture(step, frame), class_="pair"))
    return page_html(course.title, body)


def solve(course: Course, state: State) -> Iterator[tuple[Step, Frame]]:
    """Yield each step of a course with the frame in which "Show me" has done it."""
    for step in course.steps:
        begun = Frame(arrange(step.title, step.first).apply(state))
        with suppress(InputError):
            state = step.solve(begun.state, begun).apply(begun.state)
        yield step, Frame(state)


def _picture(step: Step, frame: Frame) -> Element:
    """Return the mechanism, in the first singular pose of the path if there is one."""
    snapshot, journey = frame.snapshot, journey_of(frame.state)
    words = snapshot.mode_words
    if journey is not None and journey.margins.crossings:
        snapshot = Snapshot(frame.state.design, journey.margins.crossings[0].pose)
        words = f"The path on the {snapshot.mode_words}"
    view = fit_view("isometric", points_to_show(snapshot), (0.0, 0.0, 1.0, 1.0))
    svg = b64encode(figure_svg(snapshot, view, WIDTH)).decode()
    words = ". ".join((f"{words[:1].upper()}{words[1:]}", *step.readings(frame, frame)))
    if step.lacking(frame, frame):
        words += ". This design cannot do the step"
    image = element("img", src=f"data:image/svg+xml;base64,{svg}", alt=words)
    return illustration(image, f"{words}.")
