"""Writes the object code of all kernels that comes with the explorer, for this kind of processor.

To be run after a change of a kernel: python tests/tools/kernels.py
"""

from __future__ import annotations

import importlib

from explorer.files.packaged import SOURCES
from explorer.numerics.compiled import all_kernels
from explorer.numerics.kernel_cache import PACKAGED, SUFFIX
from explorer.numerics.object_code import processor

FOLDER = SOURCES / "assets" / PACKAGED / processor()


def import_all() -> None:
    """Import every module that has kernels."""
    for path in (SOURCES / "explorer").rglob("*.py"):
        if "\n@kernel(" in path.read_text(encoding="utf-8"):
            importlib.import_module(".".join(path.relative_to(SOURCES).with_suffix("").parts))


def main() -> None:
    """Compile what is new, and remove what is old."""
    import_all()
    entries = {kernel.entry.file_name: kernel.entry for kernel in all_kernels()}
    for path in FOLDER.glob(f"*{SUFFIX}"):
        if path.name not in entries:
            path.unlink()
    for name, entry in entries.items():
        if not (FOLDER / name).exists():
            # Code in the cache is optimised less, since somebody waited for it.
            entry.write_to(FOLDER, entry.compile_here())
            print(f"{name}: {(FOLDER / name).stat().st_size} bytes")


if __name__ == "__main__":
    main()
