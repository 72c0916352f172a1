"""Help: the search, the theme, and the dialog with the tour, lessons, the manual and the keys."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from functools import cache
from html import escape

import viser

from explorer.app.features.feature import BarPart, Feature, Services, Tab
from explorer.app.features.help.guide import CourseGuide
from explorer.app.features.help.handout import handout_html
from explorer.app.features.help.search import TITLE, SearchDialog
from explorer.app.inputs.controls import Controls
from explorer.app.widgets.buttons import MANUAL, open_button, press_button
from explorer.app.widgets.markup import box, caption, dim
from explorer.page.browser.viser_gaps import run_script_in
from explorer.page.widgets import palette

PRESS, LESSON, HANDOUT = "page", "lesson", "lesson.handout"
KEYS = {"Theme": (palette.shift("L"),), "Keys": (palette.Key("K"),)}
BEGIN = "Begin the lesson at this step."
HINTS = {
    "Tour": "Five steps, from the first move to a better design.",
    "Keys": "Show all keys.",
    "Handout": "Download the lesson on this design as an HTML file to print, with its pictures.",
    "Theme": "Turn the page dark or light, or have it as the system is.",
}
# Keys and pointers with which viser moves the camera.
CAMERA = {"Turn": "drag, arrows", "Move": "right drag", "Zoom": "wheel", "Fly": "W A S D Q E"}


def help_buttons(services: Services) -> BarPart:
    """Return the search, the theme and the help, as buttons of the bar."""
    presses: dict[str, Callable[[viser.ClientHandle], None]] = {
        "Tour": services.get(CourseGuide).begin,
        "Keys": lambda client: run_script_in(client, 'window.explorer.open("Help")'),
        "Theme": services.theme.turn,
    }
    buttons = services.buttons
    buttons.on(PRESS, lambda name, client: presses[name](client), values=presses)
    for name in presses:
        buttons.offer(f"Page › {name}", HINTS[name], PRESS, name, keys=KEYS.get(name, ()))
    commands = open_button(
        TITLE,
        f"Search {keycap(str(palette.PALETTE_KEY))}",
        hint="Search commands, all that stands on the page, and the manual.",
        class_name="ex-tool ex-commands",
    )
    hint = palette.with_keys(HINTS["Theme"], KEYS["Theme"])
    look = "ex-tool ex-theme"
    theme = press_button(PRESS, "Theme", "", hint=hint, label="Theme", class_name=look)
    help_ = open_button("Help", "Help", hint="Tour, manual and keys.", class_name="ex-tool")
    return lambda _: f"{commands}{theme}{help_}"


class HelpDialog(Controls):
    """The tour, the lessons, the manual, and all keys of the page."""

    def __init__(self, services: Services) -> None:
        super().__init__(services)
        buttons = (
            press_button(PRESS, "Tour", "Tour", class_name="ex-button") + dim(HINTS["Tour"]),
            press_button(MANUAL, "page.md", "Manual", class_name="ex-button")
            + dim("All pages, beside the scene."),
        )
        rows = "".join(f'<div class="ex-row" data-closes>{each}</div>' for each in buttons)
        rows += lessons_html(services)
        # The keys are known once all features are made.
        content = cache(lambda: box(rows, keys_table(services.commands.all)))
        self.markup(lambda _: content())


def lessons_html(services: Services) -> str:
    """Offer the lessons, their steps and their handouts in the search; return a list as HTML."""
    guide, buttons = services.get(CourseGuide), services.buttons

    def begin(value: str, client: viser.ClientHandle) -> None:
        file, _, at = value.partition("#")
        guide.begin(client, file, int(at))

    def send(file: str, client: viser.ClientHandle) -> None:
        lesson, state = guide.courses[file], services.session.latest_state()
        services.downloads.make(
            client.client_id,
            "Drawing the handout",
            lambda _: (f"{lesson.title}.html", handout_html(lesson, state).encode()),
        )

    def button(label: str, hint: str, press: str, value: str) -> str:
        buttons.offer(f"Lessons{palette.STEP}{label}", hint, press, value)
        words = escape(label.rpartition(palette.STEP)[2])
        return press_button(press, value, words, hint=hint, class_name="ex-link")

    rows, lessons = "", [each for each in guide.courses.values() if each.is_lesson]
    for lesson in lessons:
        label, file = f"{lesson.title}{palette.STEP}", lesson.file
        steps = "".join(
            f"<div>{button(f'{label}{at + 1}  {step.title}', BEGIN, LESSON, f'{file}#{at}')}</div>"
            for at, step in enumerate(lesson.steps)
        )
        begins = button(lesson.title, lesson.sentence, LESSON, f"{file}#0")
        rows += (
            f'<div class="ex-export"><div><b data-closes>{begins}</b>'
            f'<div class="ex-dim">{escape(lesson.sentence)}</div>'
            f"{button(f'{label}Handout', HINTS['Handout'], HANDOUT, file)}</div>"
            f"<div data-closes>{steps}</div></div>"
        )
    # Presses on what no lesson has are dropped.
    steps = {f"{each.file}#{at}" for each in lessons for at in range(len(each.steps))}
    buttons.on(LESSON, begin, values=steps)
    buttons.on(HANDOUT, send, values=[each.file for each in lessons])
    return f'<div class="ex-lessons">{caption("Lessons")}{rows}</div>'


def keycap(key: str) -> str:
    """Return a drawn key, as HTML."""
    return f'<kbd class="ex-keycap">{escape(key)}</kbd>'


def keys_table(commands: Iterable[palette.Command]) -> str:
    """Return all keys as HTML, in the groups of their commands and in two columns."""
    groups = {"Page": [_row("Search commands, page and manual", keycap(str(palette.PALETTE_KEY)))]}
    for command in commands:
        if command.keys:
            caps = " ".join(keycap(str(key)) for key in command.keys)
            group, _, words = command.label.partition(palette.STEP)
            row = _row(words.replace(palette.STEP, ", "), caps)
            groups.setdefault(group, []).append(row)
    groups["Camera"] = [_row(words, keycap(keys)) for words, keys in CAMERA.items()]
    blocks = (f"<div>{caption(name)}{''.join(rows)}</div>" for name, rows in groups.items())
    return f'<div class="ex-keys">{"".join(blocks)}</div>'


def _row(words: str, caps: str) -> str:
    return f'<div class="ex-line"><span>{escape(words)}</span><span>{caps}</span></div>'


HELP = Feature(
    "help",
    tabs=(Tab("dialog", "Help", HelpDialog), Tab("dialog", TITLE, SearchDialog)),
    bar=(("right", help_buttons),),
    runners=(CourseGuide,),
)
