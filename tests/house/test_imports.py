"""The direction of imports: each room rests on those below it, and imports are cheap."""

from __future__ import annotations

import ast
import importlib
import re
import subprocess
import sys
from collections.abc import Iterator
from dataclasses import dataclass
from graphlib import TopologicalSorter
from pathlib import Path

import pytest

import explorer
from explorer.app.page import TASKS

PACKAGE = Path(explorer.__file__).parent

ROOMS = (
    "errors",
    "files",
    "numerics",
    "jobs",
    "mechanism",
    "singularity",
    "legs",
    "motion",
    "statics",
    "workspace",
    "measures",
    "six_legged",
    "prototype",
    "paths",
    "optimise",
    "find",
    "calibration",
    "sweep",
    "reproduce",
    "export",
    "page",
    "app",
    "cli",
    "__main__",
)
"""The rooms of the package, from the ground up: each imports only from those before it."""

PAGE_ROOMS = ("look", "state", "session", "security", "storage", "browser", "widgets")
"""The rooms of what a page is made of, whatever its mechanism, from the ground up."""

APP_ROOMS = (
    "state",
    "session",
    "storage",
    "widgets",
    "inputs",
    "scene",
    "features.feature",
    "features",
    "layout",
    "page",
    "server",
    "notebook",
    "screenshot",
)
"""The rooms of the page, from the ground up; features import from each other without a circle."""

INNER_ROOMS = {"page": PAGE_ROOMS, "app": APP_ROOMS}

UNDER_PAGE = ("errors", "files", "numerics", "jobs", "page")
"""All that the page may import that knows no mechanism."""

WITHOUT_VISER = tuple(
    f"{room}.{each}" for room in INNER_ROOMS for each in ("state", "session", "storage")
)
"""The parts of the page whose logic runs without a browser."""

WORK = tuple(f"explorer.app.features.{each}" for each in ("studies.feed", "studies.work"))
"""The modules of tasks that no process imports before it needs them."""

SLOW = ("numba", "trimesh", "manifold3d", "playwright")
"""Libraries to import when they are needed, since each costs about half a second."""

MAY_IMPORT_SLOW = ("app.scene", "workspace.solids")

MAKE_SOLIDS = ("workspace.solids", "prototype.shapes")
"""The modules that use manifold3d."""


@dataclass(frozen=True)
class Import:
    """One imported module, as seen in a source.

    Attributes:
        name: Dotted, absolute.
        at_import: Whether it runs when the module is imported, rather than in a function
            or for type checkers only.
        line: Where.
    """

    name: str
    at_import: bool
    line: int


def modules() -> dict[str, Path]:
    """Return the sources by module name below `explorer`, its own `__init__` left out."""
    found: dict[str, Path] = {}
    for path in sorted(PACKAGE.rglob("*.py")):
        parts = path.relative_to(PACKAGE).with_suffix("").parts
        if parts[-1] == "__init__":
            parts = parts[:-1]
        if parts:
            found[".".join(parts)] = path
    return found


MODULES = modules()


def imports_of(tree: ast.AST, at_import: bool = True) -> Iterator[Import]:
    """Yield every import below a node; the package has no relative ones (see a test)."""
    for node in ast.iter_child_nodes(tree):
        if isinstance(node, ast.Import):
            for alias in node.names:
                yield Import(alias.name, at_import, node.lineno)
        elif isinstance(node, ast.ImportFrom):
            assert node.level == 0, f"line {node.lineno}: relative import"
            assert node.module is not None
            for alias in node.names:
                # A name may be a submodule: `from explorer.app import state`.
                inner = f"{node.module}.{alias.name}"
                known = inner.removeprefix("explorer.") in MODULES
                yield Import(inner if known else node.module, at_import, node.lineno)
        elif isinstance(node, ast.If) and "TYPE_CHECKING" in ast.unparse(node.test):
            for part in node.body:
                yield from imports_of(ast.Module([part], []), at_import=False)
            for part in node.orelse:
                yield from imports_of(ast.Module([part], []), at_import)
        else:
            is_function = isinstance(node, ast.FunctionDef | ast.AsyncFunctionDef | ast.Lambda)
            yield from imports_of(node, at_import and not is_function)


IMPORTS = {
    name: list(imports_of(ast.parse(path.read_text(encoding="utf-8"))))
    for name, path in MODULES.items()
}


def belongs_to(module: str, rooms: tuple[str, ...]) -> bool:
    return any(module == room or module.startswith(f"{room}.") for room in rooms)


def rank(module: str, rooms: tuple[str, ...]) -> int:
    """Return the place of a module's room, the most specific one, among the rooms."""
    found = [room for room in rooms if belongs_to(module, (room,))]
    assert found, f"{module} belongs to no room"
    return rooms.index(max(found, key=len))


def own_imports(module: str) -> set[str]:
    """Return the other modules of the package that a module imports, whenever it does."""
    names = {each.name.removeprefix("explorer.") for each in IMPORTS[module]}
    return {name for name in names if name in MODULES and name != module}


def libraries(module: str, *, at_import: bool = False) -> set[str]:
    """Return the top-level packages that a module imports, or only those that it always does."""
    kept = [each for each in IMPORTS[module] if each.at_import or not at_import]
    return {each.name.partition(".")[0] for each in kept}


def modules_loaded_after(statement: str) -> set[str]:
    """Return the top-level modules that a fresh interpreter has after a statement."""
    code = f"{statement}\nimport sys\nprint(*{{n.partition('.')[0] for n in sys.modules}})"
    command = [sys.executable, "-c", code]
    done = subprocess.run(command, capture_output=True, text=True, check=True, cwd=PACKAGE.parent)
    return set(done.stdout.split())


def test_modules_import_only_from_their_own_room_or_those_below() -> None:
    offenders: list[str] = []
    for module in MODULES:
        for name in own_imports(module):
            is_above = rank(name, ROOMS) > rank(module, ROOMS)
            room, _, own = module.partition(".")
            other_room, _, other = name.partition(".")
            if room == other_room and room in INNER_ROOMS:
                rooms = INNER_ROOMS[room]
                is_above = rank(other, rooms) > rank(own, rooms)
            if is_above:
                offenders.append(f"explorer.{module} imports {name} of a room above")
    assert not offenders, "\n".join(offenders)
    # No room is empty.
    assert {rank(module, ROOMS) for module in MODULES} == set(range(len(ROOMS)))
    for room, rooms in INNER_ROOMS.items():
        inner = [name.partition(".")[2] for name in MODULES if name.startswith(f"{room}.")]
        assert {rank(module, rooms) for module in inner} == set(range(len(rooms)))
    # What is read is the package, not nothing.
    assert "mechanism.design" in own_imports("mechanism.kinematics")


def test_page_knows_no_mechanism() -> None:
    of_page = [module for module in MODULES if belongs_to(module, ("page",))]
    names = {name for module in of_page for name in own_imports(module)}
    assert not [name for name in sorted(names) if not belongs_to(name, UNDER_PAGE)]
    assert names


def test_contributors_read_of_the_rooms_in_their_order() -> None:
    page = (PACKAGE.parent / "CONTRIBUTING.md").read_text("utf-8")
    rows = re.findall(r"^\| ((?:`\w+`(?:, )?)+) \|", page.partition("| room |")[2], re.MULTILINE)
    told = [room for row in rows for room in re.findall(r"\w+", row)]
    assert told == [room for room in ROOMS if (PACKAGE / room).is_dir()]


def test_modules_and_features_import_themselves_in_no_circle() -> None:
    """Imports for type checkers, and those that run in functions, count as well."""

    def feature(module: str) -> str | None:
        parts = module.split(".")
        return parts[2] if parts[:2] == ["app", "features"] and len(parts) > 3 else None

    modules_graph = {module: own_imports(module) for module in MODULES}
    features: dict[str, set[str]] = {}
    for module, names in modules_graph.items():
        own = feature(module)
        if own is not None:
            others = {other for name in names if (other := feature(name)) not in (None, own)}
            features.setdefault(own, set()).update(other for other in others if other)
    assert {"compare", "workspace"} <= set(features)
    for graph in (modules_graph, features):
        # A circle raises an error that names its members.
        assert len(tuple(TopologicalSorter(graph).static_order())) >= len(graph)


def test_state_of_the_page_needs_neither_the_optimiser_nor_studies() -> None:
    """What belongs to these lies in the folders of their features, which no state imports."""
    above = ("paths", "optimise", "sweep", "prototype", "reproduce", "export")
    modules_of_state = [module for module in MODULES if belongs_to(module, ("app.state",))]
    reached = {name for module in modules_of_state for name in own_imports(module)}
    assert "mechanism.design" in reached
    assert not [name for name in sorted(reached) if belongs_to(name, above)]


def test_libraries_are_imported_only_where_they_may_be() -> None:
    offenders: list[str] = []
    for module in MODULES:
        used, early = libraries(module), libraries(module, at_import=True)
        of_page = belongs_to(module, ("page", "app")) and not belongs_to(module, WITHOUT_VISER)
        if "viser" in used and not of_page:
            offenders.append(f"explorer.{module} imports viser")
        if "manifold3d" in used and not belongs_to(module, MAKE_SOLIDS):
            offenders.append(f"explorer.{module} imports manifold3d")
        if not belongs_to(module, MAY_IMPORT_SLOW) and early & set(SLOW):
            names = ", ".join(sorted(early & set(SLOW)))
            offenders.append(f"explorer.{module} imports {names} before it is needed")
    assert not offenders, "\n".join(offenders)


def test_imports_load_no_library_that_they_do_not_need() -> None:
    cases = [
        ("explorer", {"numpy", "scipy", "viser", "msgspec", *SLOW}),
        ("explorer.measures.snapshot, explorer.mechanism.design_file", {"viser", *SLOW}),
        (", ".join((*(f"explorer.{each}" for each in WITHOUT_VISER), *TASKS, *WORK)), {"viser"}),
    ]
    offenders: list[str] = []
    for names, unwanted in cases:
        found = modules_loaded_after(f"import {names}")
        assert "explorer" in found
        offenders += [f"importing {names} loads {each}" for each in sorted(found & unwanted)]
    assert not offenders, "\n".join(offenders)


def test_public_names_are_listed_once_and_are_those_of_their_modules() -> None:
    assert len(set(explorer.__all__)) == len(explorer.__all__)
    assert set(explorer.__all__) <= set(dir(explorer))
    offenders: list[str] = []
    for name in explorer.__all__:
        value = getattr(explorer, name)
        home = getattr(value, "__module__", None)
        of_package = isinstance(home, str) and home.startswith("explorer.")
        if of_package and getattr(importlib.import_module(str(home)), name) is not value:
            offenders.append(name)
    assert not offenders
    with pytest.raises(AttributeError, match="nothing_of_the_kind"):
        getattr(explorer, "nothing_of_the_kind")  # noqa: B009 - no name that a checker knows
