"""The script that writes the manual's page of the public names from their docstrings.

From the checkout: python tests/tools/names_page.py
"""

from __future__ import annotations

import ast
import itertools
import re
import textwrap
from collections.abc import Iterator
from pathlib import Path

from explorer.files.packaged import SOURCES

PAGE = SOURCES / "assets" / "manual" / "names.md"
HEAD = """\
# Public names

The names of `explorer` itself with their docstrings, by room; [Python](python.md) shows them at
work. This page is made from the sources.
"""


def public_names() -> Iterator[tuple[str, str]]:
    """Yield the module and the name of each public name, in the order of the stub."""
    stub = ast.parse((SOURCES / "explorer" / "__init__.pyi").read_text(encoding="utf-8"))
    for each in stub.body:
        if isinstance(each, ast.ImportFrom) and each.module:
            yield from ((each.module, alias.name) for alias in each.names)


def definition(module: str, name: str) -> tuple[str, str]:
    """Return the signature and the docstring of a name."""
    path = Path(SOURCES, "explorer", *module.split(".")).with_suffix(".py")
    body = ast.parse(path.read_text(encoding="utf-8")).body
    for each, after in itertools.zip_longest(body, body[1:]):
        if isinstance(each, ast.FunctionDef) and each.name == name:
            returned = f" -> {ast.unparse(each.returns)}" if each.returns else ""
            signature = f"{name}({ast.unparse(each.args)}){returned}"
            return signature, ast.get_docstring(each) or ""
        if isinstance(each, ast.ClassDef) and each.name == name:
            return name, ast.get_docstring(each) or ""
        targets = each.targets if isinstance(each, ast.Assign) else []
        if isinstance(each, ast.AnnAssign):
            targets = [each.target]
        if any(isinstance(target, ast.Name) and target.id == name for target in targets):
            match after:
                case ast.Expr(ast.Constant(str(text))):
                    return name, text
                case _:
                    return name, ""
    raise LookupError(f"{path} defines no {name}")


def as_markdown(docstring: str) -> str:
    """Return a docstring with its sections as lists."""
    parts: list[str] = []
    for paragraph in re.split(r"\n\s*\n", docstring):
        head, _, rest = paragraph.partition("\n")
        if not re.fullmatch(r"[A-Z]\w+:", head):
            parts.append(paragraph)
            continue
        entries = re.split(r"\n(?! )", textwrap.dedent(rest))
        lines = [re.sub(r"^([\w, ]+?):", r"`\1`:", " ".join(each.split())) for each in entries]
        parts.append("\n".join([head, "", *(f"- {line}" for line in lines)]))
    return "\n\n".join(parts)


def page() -> str:
    """Return the page in Markdown."""
    rooms: dict[str, list[str]] = {}
    for module, name in public_names():
        signature, docstring = definition(module, name)
        entry = f"**`{signature}`**\n\n{as_markdown(docstring)}\n"
        rooms.setdefault(module.split(".")[0], []).append(entry)
    sections = (f"## {room.capitalize()}\n\n" + "\n".join(each) for room, each in rooms.items())
    return "\n".join([HEAD, *sections])


if __name__ == "__main__":
    PAGE.write_text(page(), encoding="utf-8")
