"""The manual: Markdown pages that are part of the package, in the order to read them."""

from __future__ import annotations

from typing import NamedTuple

from explorer.errors import InputError
from explorer.files.packaged import packaged_file

FILES = (
    "glossary.md",
    "mechanism.md",
    "page.md",
    "workspace.md",
    "orientation.md",
    "singularity.md",
    "legs.md",
    "loads.md",
    "precision.md",
    "optimise.md",
    "claims.md",
    "studies.md",
    "prototype-and-export.md",
    "command-line.md",
    "python.md",
    "files.md",
    "network.md",
)


class ManualPage(NamedTuple):
    """A page of the manual.

    Attributes:
        title: Text of the page's first heading.
        file: Name of the page's file, the argument of `read_page` and the target of links.
    """

    title: str
    file: str


def list_pages() -> tuple[ManualPage, ...]:
    """Return the pages of the manual in the order to read them; the glossary is the first."""
    return tuple(ManualPage(_title(read_page(file)), file) for file in FILES)


def read_page(file: str) -> str:
    """Return the Markdown of a page.

    Args:
        file: Name of the page's file, such as "glossary.md".

    Raises:
        InputError: The manual has no such page.
    """
    if file not in FILES:
        raise InputError(f"the manual has no page {file!r}; its pages are {', '.join(FILES)}")
    return packaged_file("manual", file).read_text(encoding="utf-8")


def _title(markdown: str) -> str:
    return markdown.partition("\n")[0].removeprefix("# ")
