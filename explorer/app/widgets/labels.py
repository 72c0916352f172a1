"""Clicks on HTML: viser's takes none of its own, but a label pushes the button that it is for.

The buttons are viser's, unseen but for keyboards and screen readers.
"""

from __future__ import annotations

from collections.abc import Sequence
from html import escape


def labelled(identity: str, name: str, content: str, *, style: str) -> str:
    """Return HTML that pushes a button when it is clicked.

    Args:
        identity: Of the button in the page.
        name: Of what it does, plain text.
        content: What is seen, HTML.
        style: Of the label.
    """
    named = escape(name, quote=True)
    return (
        f'<label for="{identity}" title="{named}" aria-label="{named}" '
        f'style="user-select:none;{style}">{content}</label>'
    )


def out_of_sight(ids: Sequence[str]) -> str:
    """Return the style that leaves buttons to keyboards and screen readers alone."""
    # Fixed, so that nothing scrolls to a button which is pushed by its label.
    boxes = ",".join(f'div:has(> [id="{each}"])' for each in ids)
    return (
        f"<style>{boxes}{{position:fixed;top:0;width:1px;height:1px;margin:0;padding:0;"
        "overflow:hidden;clip-path:inset(50%);white-space:nowrap}</style>"
    )
