"""Writes the object code of all kernels that comes with the explorer, for this kind of processor.

To be run after a change of a kernel: python tests/tools/kernels.py
"""

from __future__ import annotations

import importlib

from explorer.files.packaged import SOURCES
from explorer.numerics.compiled import KERNELS
from explorer.numerics.object_code import PACKAGED, processor, write_code

FOLDER = SOURCES / "assets" / PACKAGED / processor()


def import_all() -> None:
    """Import every module that has kernels."""
    for path in (SOURCES / "explorer").rglob("*.py"):
        if "\n@kernel(" in path.read_text(encoding="utf-8"):
            importlib.import_module(".".join(path.relative_to(SOURCES).with_suffix("").parts))


def main() -> None:
    """Compile what is new, and remove what is old."""
    import_all()
    kernels = {kernel.file_name: kernel for kernel in KERNELS}
    for path in FOLDER.glob("*.o"):
        if path.name not in kernels:
            path.unlink()
    for name, kernel in kernels.items():
        if not (FOLDER / name).exists():
            # Code in the cache is optimised less, since somebody waited for it.
            write_code(FOLDER, name, kernel.make_code())
            print(f"{name}: {(FOLDER / name).stat().st_size} bytes")


if __name__ == "__main__":
    main()
