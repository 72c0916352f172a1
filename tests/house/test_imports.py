"""The direction of imports: each room rests on those below it, and imports are cheap."""

from __future__ import annotations

import ast
import importlib
import subprocess
import sys
from collections.abc import Iterator
from dataclasses import dataclass
from graphlib import TopologicalSorter
from pathlib import Path

import pytest

import explorer

PACKAGE = Path(explorer.__file__).parent

ROOMS = (
    "errors",
    "files",
    "numerics",
    "mechanism",
    "singularity",
    "legs",
    "statics",
    "workspace",
    "measures",
    "paths",
    "optimise",
    "sweep",
    "prototype",
    "reproduce",
    "export",
    "app",
    "cli",
    "__main__",
)
"""The rooms of the package, from the ground up: each imports only from those before it."""

APP_ROOMS = (
    "look",
    "state",
    "session",
    "security",
    "storage",
    "browser",
    "widgets",
    "inputs",
    "scene",
    "features.feature",
    "features",
    "features.listed",
    "bar",
    "layout",
    "page",
    "server",
    "notebook",
    "screenshot",
)
"""The rooms of the page, from the ground up; features import from each other without a circle."""

WITHOUT_VISER = ("app.state", "app.session", "app.storage")
"""The parts of the app whose logic runs without a browser."""

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


def imports(module: str) -> list[Import]:
    return list(imports_of(ast.parse(MODULES[module].read_text(encoding="utf-8"))))


def room(module: str) -> str:
    """Return the room of a module below `explorer`."""
    return module.partition(".")[0]


def belongs_to(module: str, rooms: tuple[str, ...]) -> bool:
    return any(module == room or module.startswith(f"{room}.") for room in rooms)


def test_the_reader_of_imports_sees_each_kind() -> None:
    source = """
import a.b
from c import d
if TYPE_CHECKING:
    from e import f
else:
    import g
def function():
    import h
class Class:
    import i
try:
    import j
except ImportError:
    pass
"""
    found = {(each.name, each.at_import) for each in imports_of(ast.parse(source))}
    assert found == {
        ("a.b", True),
        ("c", True),
        ("e", False),
        ("g", True),
        ("h", False),
        ("i", True),
        ("j", True),
    }


def test_the_modules_of_the_mathematics_are_seen() -> None:
    assert {"errors", "mechanism.design", "measures.snapshot"} <= set(MODULES)
    assert "explorer.mechanism.design" in {each.name for each in imports("mechanism.kinematics")}


def test_every_module_belongs_to_a_room() -> None:
    assert {room(module) for module in MODULES} == set(ROOMS)


@pytest.mark.parametrize("module", list(MODULES))
def test_a_module_imports_only_from_its_own_room_or_those_below(module: str) -> None:
    below = ROOMS[: ROOMS.index(room(module)) + 1]
    for each in imports(module):
        if each.name.startswith("explorer."):
            assert room(each.name.removeprefix("explorer.")) in below, (
                f"explorer.{module}, line {each.line}, imports {each.name} of a room above"
            )


def own_imports(module: str) -> set[str]:
    """Return the other modules of the package that a module imports, whenever it does."""
    names = {each.name.removeprefix("explorer.") for each in imports(module)}
    return {name for name in names if name in MODULES and name != module}


def app_room(module: str) -> str:
    """Return the room of a module of the page, the most specific one of `APP_ROOMS`."""
    inner = module.removeprefix("app.")
    rooms = [each for each in APP_ROOMS if inner == each or inner.startswith(f"{each}.")]
    assert rooms, f"explorer.{module} belongs to no room of the page"
    return max(rooms, key=len)


@pytest.mark.parametrize("module", [module for module in MODULES if module.startswith("app.")])
def test_module_of_page_imports_only_from_its_own_room_or_those_below(module: str) -> None:
    below = APP_ROOMS[: APP_ROOMS.index(app_room(module)) + 1]
    for name in own_imports(module):
        if name.startswith("app."):
            assert app_room(name) in below, f"explorer.{module} imports {name} of a room above"


def test_no_feature_imports_itself_through_others() -> None:
    def feature(module: str) -> str | None:
        parts = module.split(".")
        return parts[2] if parts[:2] == ["app", "features"] and len(parts) > 3 else None

    graph: dict[str, set[str]] = {}
    for module in MODULES:
        own = feature(module)
        if own is not None:
            others = {feature(name) for name in own_imports(module)} - {own, None}
            graph.setdefault(own, set()).update(other for other in others if other)
    assert {"compare", "workspace"} <= set(graph)
    assert len(tuple(TopologicalSorter(graph).static_order())) == len(graph)


def test_no_module_imports_itself_in_a_circle() -> None:
    """Imports for type checkers, and those that run in functions, count as well."""
    graph = {module: own_imports(module) for module in MODULES}
    assert len(tuple(TopologicalSorter(graph).static_order())) >= len(MODULES)


@pytest.mark.parametrize("module", list(MODULES))
def test_only_those_that_make_solids_import_manifold3d(module: str) -> None:
    names = {each.name.partition(".")[0] for each in imports(module)}
    assert "manifold3d" not in names or belongs_to(module, MAKE_SOLIDS)


@pytest.mark.parametrize("module", list(MODULES))
def test_only_the_app_imports_viser_and_its_state_and_jobs_do_not(module: str) -> None:
    names = {each.name.partition(".")[0] for each in imports(module)}
    allowed = belongs_to(module, ("app",)) and not belongs_to(module, WITHOUT_VISER)
    assert "viser" not in names or allowed


@pytest.mark.parametrize("module", list(MODULES))
def test_slow_libraries_are_imported_when_they_are_needed(module: str) -> None:
    if belongs_to(module, MAY_IMPORT_SLOW):
        return
    early = {each.name.partition(".")[0] for each in imports(module) if each.at_import}
    assert early.isdisjoint(SLOW)


def test_the_package_itself_imports_nothing_of_its_own_at_once() -> None:
    tree = ast.parse((PACKAGE / "__init__.py").read_text(encoding="utf-8"))
    early = {each.name.partition(".")[0] for each in imports_of(tree) if each.at_import}
    assert early == {"lazy_loader"}


def loaded_after(statement: str) -> set[str]:
    """Return the top-level modules that a fresh interpreter has after a statement."""
    code = f"{statement}\nimport sys\nprint(*{{n.partition('.')[0] for n in sys.modules}})"
    command = [sys.executable, "-c", code]
    done = subprocess.run(command, capture_output=True, text=True, check=True, cwd=PACKAGE.parent)
    return set(done.stdout.split())


def test_importing_the_package_loads_neither_numpy_nor_viser() -> None:
    loaded = loaded_after("import explorer")
    assert "explorer" in loaded
    assert loaded.isdisjoint({"numpy", "scipy", "viser", "msgspec", *SLOW})


def test_the_mathematics_loads_no_slow_library() -> None:
    loaded = loaded_after("import explorer.measures.snapshot, explorer.mechanism.design_file")
    assert {"numpy", "explorer"} <= loaded
    assert loaded.isdisjoint({"viser", *SLOW})


@pytest.mark.parametrize("module", WITHOUT_VISER)
def test_the_logic_of_the_app_loads_without_viser(module: str) -> None:
    loaded = loaded_after(f"import explorer.{module}")
    assert "explorer" in loaded
    assert "viser" not in loaded


@pytest.mark.parametrize("name", explorer.__all__)
def test_every_public_name_resolves_to_what_its_module_holds(name: str) -> None:
    value = getattr(explorer, name)
    assert value is not None
    assert name in dir(explorer)
    home = getattr(value, "__module__", None)
    if isinstance(home, str) and home.startswith("explorer."):
        assert getattr(importlib.import_module(home), name) is value


def test_public_names_are_listed_once_and_others_are_refused() -> None:
    assert len(set(explorer.__all__)) == len(explorer.__all__)
    with pytest.raises(AttributeError, match="nothing_of_the_kind"):
        getattr(explorer, "nothing_of_the_kind")  # noqa: B009 - no name that a checker knows
