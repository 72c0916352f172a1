"""The look of the page and its behaviour in a browser: one stylesheet, and scripts.

A script sets `window.explorer.NAME` once, even if the page connects again. Where that is a
function, its arguments are values from the server.
"""

from __future__ import annotations

import msgspec

from explorer.files.packaged import packaged_file

FOLDER = "page/look"


def read_script(name: str, *arguments: object) -> str:
    """Return a script of this folder by its name without the suffix.

    Arguments, values of JSON, are for the function that the script sets, which is then called.
    """
    # Scripts come to a page in any order, so that each brings what all of them use.
    source = read_file("base.js") + read_file("clock.js") + read_file(f"{name}.js")
    return source + call_script(name, *arguments) if arguments else source


def call_script(name: str, *arguments: object) -> str:
    """Return a call of the function that a script of this folder sets, with values of JSON."""
    values = ", ".join(msgspec.json.encode(each).decode() for each in arguments)
    return f"window.explorer.{name}({values});\n"


def read_stylesheet(before: str = "") -> str:
    """Return the script that puts the stylesheet into a page, after other rules, if any."""
    return read_script("style", before + read_file("page.css"))


def read_file(file: str) -> str:
    """Return the text of a file of this folder."""
    return packaged_file(FOLDER, file).read_text("utf-8")
