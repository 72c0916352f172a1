"""Reads a report as a browser would, and refuses what one would have to mend."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, field
from html.parser import HTMLParser

VOID = frozenset({"meta", "br", "hr", "img", "link", "input", "source", "wbr"})


@dataclass
class Node:
    """An element: its name, attributes, and what is inside, in order."""

    tag: str
    attributes: dict[str, str]
    inside: list[Node | str] = field(default_factory=list["Node | str"])

    def all(self, *tags: str) -> Iterator[Node]:
        """Yield the elements inside at any depth with these names, or all."""
        for each in self.inside:
            if isinstance(each, Node):
                if not tags or each.tag in tags:
                    yield each
                yield from each.all(*tags)

    def one(self, **attributes: str) -> Node:
        """Return the only element inside with these attributes."""
        wanted = attributes.items()
        (found,) = (each for each in self.all() if wanted <= each.attributes.items())
        return found

    @property
    def text(self) -> str:
        """All text inside."""
        return "".join(each if isinstance(each, str) else each.text for each in self.inside)

    @property
    def values(self) -> list[float]:
        """The figures inside, in full."""
        return [float(each.attributes["value"]) for each in self.all("data")]


class _Reader(HTMLParser):
    def __init__(self) -> None:
        super().__init__(convert_charrefs=True)
        self.root = Node("", {})
        self.open = [self.root]

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        names = [name for name, _ in attrs]
        assert len(set(names)) == len(names), f"<{tag}> has an attribute twice"
        node = Node(tag, {name: value or "" for name, value in attrs})
        self.open[-1].inside.append(node)
        if tag not in VOID:
            self.open.append(node)

    def handle_endtag(self, tag: str) -> None:
        assert self.open[-1].tag == tag, f"</{tag}> closes <{self.open[-1].tag}>"
        self.open.pop()

    def handle_data(self, data: str) -> None:
        self.open[-1].inside.append(data)


def read(html: str) -> Node:
    """Return the document, whose every element is closed where it should be."""
    reader = _Reader()
    reader.feed(html)
    reader.close()
    assert reader.open == [reader.root], "something is left open"
    assert html.startswith("<!DOCTYPE html>\n<html")
    return reader.root


def table_of(page: Node, caption: str) -> dict[str, Node]:
    """Return the rows of the table with a caption that begins so, by their names."""
    (table,) = (
        each
        for each in page.all("table")
        if any(title.text.startswith(caption) for title in each.all("caption"))
    )
    (body,) = table.all("tbody")
    rows = {next(row.all("th")).text: row for row in body.all("tr")}
    assert len(rows) == len(list(body.all("tr")))
    return rows
