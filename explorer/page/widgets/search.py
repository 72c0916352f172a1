"""The search of the page: its commands, all texts that stand on it, and its manual.

Texts are read from the page itself, its tabs, controls and markup, so that what stands there is
found in the words in which it stands there.
"""

from __future__ import annotations

import difflib
import re
import unicodedata
from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass
from functools import lru_cache
from html.parser import HTMLParser
from typing import Literal, NamedTuple

import viser

from explorer.page.browser.viser_gaps import contents_of
from explorer.page.widgets.palette import STEP

Kind = Literal["command", "text", "manual"]
KINDS: tuple[Kind, ...] = ("command", "text", "manual")
"""The kinds of what is found, in the order in which those of equal words are listed."""

# Elements of HTML that stand in a line with others; what is within any other is a line of its own.
INLINE = {"a", "b", "em", "i", "kbd", "small", "span", "strong", "sub", "sup", "td", "th"}
# Elements without an end; likeness of a mistyped word, and the most such words of a query.
VOID, LIKENESS, MOST_MISTYPED = {"br", "img", "input", "hr"}, 0.75, 4


@dataclass(frozen=True)
class Entry:
    """What a search may find.

    Attributes:
        label: Its name, or the text as it stands on the page.
        does: Sentence on it.
        value: Label of a command, title of the tab of a text, "" for one that is always in sight,
            or place in the manual.
        is_ready: Function that tells whether it can be pressed now.
        folders: Titles of the folders that a text stands in, the outer one first.
    """

    kind: Kind
    label: str
    does: str
    value: str
    is_ready: Callable[[], bool] = lambda: True
    folders: tuple[str, ...] = ()


@lru_cache(maxsize=8192)
def normalise(text: str) -> str:
    """Return a text as it is compared: without case and marks, Greek letters by their names."""
    plain = unicodedata.normalize("NFKD", text.casefold()).replace("\N{MINUS SIGN}", "-")
    spelled = (
        unicodedata.name(each).lower().rpartition(" ")[2] if "α" <= each <= "ω" else each
        for each in plain
        if not unicodedata.combining(each)
    )
    return " ".join("".join(spelled).split())


def find(query: str, entries: Iterable[Entry]) -> list[Entry]:
    """Return the entries that have all words of a query, the best first.

    Those whose own name is the query come first, then those whose name begins with it, then those
    whose label has its words, and last those whose sentence has them; among equals commands come
    before texts of the page, and these before the manual. A word that nothing has counts as the one
    most like it; with more than `MOST_MISTYPED` of them nothing is found.
    """
    found = list(entries)
    words = normalise(query).split()
    known = "\n".join(f"{normalise(each.label)} {normalise(each.does)}" for each in found)
    unknown = [index for index, word in enumerate(words) if word not in known]
    if len(unknown) > MOST_MISTYPED:
        return []
    for index in unknown:
        near = difflib.get_close_matches(words[index], {*known.split()}, 1, LIKENESS)
        words[index] = near[0] if near else words[index]
    ranked = [(_rank(words, each), index) for index, each in enumerate(found)] if words else []
    return [found[index] for rank, index in sorted(ranked) if rank < NOT_FOUND]


NOT_FOUND = (4,)


def _rank(words: list[str], entry: Entry) -> tuple[int, ...]:
    label = normalise(entry.label)
    if not all(word in label for word in words):
        is_told = all(word in f"{label} {normalise(entry.does)}" for word in words)
        return (3, KINDS.index(entry.kind), len(label)) if is_told else NOT_FOUND
    name, query = re.sub(r" \(.*\)$", "", label.rpartition(STEP)[2]), " ".join(words)
    level = 0 if name == query else 1 if name.startswith(query) else 2
    return level, KINDS.index(entry.kind), len(label)


def page_texts(gui: viser.GuiApi) -> Iterator[Entry]:
    """Yield the texts that all browsers show, once for each tab, which a press opens."""
    found: dict[tuple[str, str], Entry] = {}
    for titles, handle in contents_of(gui):
        lines = [Line(title, "") for title in titles]
        if isinstance(handle, viser.GuiHtmlHandle):
            lines += lines_of(str(handle.content))
        else:
            words, hint = (str(getattr(handle, name, None) or "") for name in ("label", "hint"))
            lines.append(Line(words, hint))
        for line in lines:
            tab = titles[0] if titles else line.opens
            if line.words:
                entry = Entry("text", line.words, line.hint, tab, folders=titles[1:])
                found.setdefault((tab, line.words), entry)
    yield from found.values()


class Line(NamedTuple):
    """A line of text, with the hint of what it stands in, and the tab that this opens."""

    words: str
    hint: str
    opens: str = ""


@lru_cache(maxsize=1024)
def lines_of(markup: str) -> tuple[Line, ...]:
    """Return the lines of text of HTML."""
    reader = _Lines()
    reader.feed(markup)
    reader.close()
    reader.end_line()
    return tuple(reader.lines)


class _Lines(HTMLParser):
    """Collects the lines of text of HTML."""

    def __init__(self) -> None:
        super().__init__()
        self.lines: list[Line] = []
        self._line = Line("", "")
        # Elements that are open, each with the hint and the tab that count in it.
        self._open: list[tuple[str, Line]] = [("", Line("", ""))]

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        """Begin an element, and a line unless it stands in one."""
        if tag not in INLINE:
            self.end_line()
        if tag not in VOID:
            given, outer = dict(attrs), self._open[-1][1]
            own = Line("", given.get("title") or outer.hint, given.get("data-opens") or outer.opens)
            self._open.append((tag, own))

    def handle_endtag(self, tag: str) -> None:
        """End an element, with those in it that have no end of their own, and its line."""
        if tag not in INLINE:
            self.end_line()
        places = [place for place, (name, _) in enumerate(self._open) if name == tag]
        del self._open[places[-1] if places else len(self._open) :]

    def handle_data(self, data: str) -> None:
        """Add text to the line, which has the first hint that it stands in."""
        if data.strip():
            inner = self._open[-1][1]
            words, hint, opens = self._line
            self._line = Line(f"{words} {data}", hint or inner.hint, opens or inner.opens)

    def end_line(self) -> None:
        """End the line, and keep it if it has any text."""
        words = " ".join(self._line.words.split())
        if words:
            self.lines.append(self._line._replace(words=words))
        self._line = Line("", "")
