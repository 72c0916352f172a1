"""The exported kernel, compiled by the machine's C compiler, over arrays of rows."""

from __future__ import annotations

import ctypes
import shutil
import subprocess
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np

from explorer import BuiltMachine, Design
from explorer.export.controller import kernel_files
from explorer.numerics.arrays import FloatArray, IntArray

COMPILER = shutil.which("cc")
WARNINGS = ("-Wall", "-Wextra", "-Wconversion", "-Wshadow", "-Werror", "-pedantic")
STRICT = ("-std=c99", *WARNINGS)
SANITIZED = ("-O2", "-fsanitize=undefined")
ROWS = Path(__file__).parent / "kernel_rows.c"


def compile_c(out: Path, sources: Sequence[Path], *options: str) -> Path:
    """Compile C sources, with warnings as errors, to a program or a library."""
    assert COMPILER is not None
    command = [COMPILER, *STRICT, *options, f"-I{out.parent}", "-o", out, *sources, "-lm"]
    subprocess.run(command, check=True)
    return out


class CompiledKernel:
    """The kernel of a design, in millimetres and radians, over n rows.

    Args:
        design: The manipulator.
        folder: Where its files are written and compiled.
        options: Further options of the compiler.
        extra: Further C sources of the library.
        machine: The machine that was built of the design.
    """

    def __init__(
        self,
        design: Design,
        folder: Path,
        options: Sequence[str] = SANITIZED,
        extra: Sequence[Path] = (),
        machine: BuiltMachine | None = None,
    ) -> None:
        for name, data in kernel_files(design, machine).items():
            (folder / name).write_bytes(data)
        sources = (folder / "flagged44.c", ROWS, *extra)
        library = compile_c(folder / "kernel.so", sources, "-shared", "-fPIC", *options)
        self.library = ctypes.CDLL(str(library))

    def run(self, function: str, *arrays: np.ndarray[Any, Any]) -> None:
        """Call a function over the rows of contiguous arrays of double or int."""
        assert all(array.flags.c_contiguous for array in arrays)
        pointers = (array.ctypes.data_as(ctypes.c_void_p) for array in arrays)
        self.library[function](ctypes.c_long(len(arrays[0])), *pointers)

    def inverse(self, position: FloatArray, rotation: FloatArray) -> FloatArray:
        """Return the joints (n, 6)."""
        return self._of_poses("inverse_rows", position, rotation, 6)

    def folds(self, position: FloatArray, rotation: FloatArray) -> FloatArray:
        """Return the fold coordinates (n, 6)."""
        return self._of_poses("fold_rows", position, rotation, 6)

    def jacobian(self, position: FloatArray, rotation: FloatArray) -> FloatArray:
        """Return J (n, 6, 6)."""
        return self._of_poses("jacobian_rows", position, rotation, 36).reshape(-1, 6, 6)

    def margins(self, position: FloatArray, rotation: FloatArray) -> tuple[FloatArray, IntArray]:
        """Return the margins (n, 3) and the modes (n,)."""
        margins, modes = np.empty((len(position), 3)), np.empty(len(position), dtype=np.intc)
        self.run("margin_rows", position, rotation, margins, modes)
        return margins, modes.astype(np.int64)

    def limits(self, position: FloatArray, rotation: FloatArray) -> IntArray:
        """Return the bits of broken limits (n,)."""
        broken = np.empty(len(position), dtype=np.uintc)
        self.run("limit_rows", position, rotation, broken)
        return broken.astype(np.int64)

    def forward(self, joints: FloatArray) -> tuple[FloatArray, FloatArray, IntArray]:
        """Return positions (n, 8, 3), rotations (n, 8, 3, 3), NaN without modes, and 8 or 0."""
        count = len(joints)
        positions = np.full((count, 8, 3), np.nan)
        rotations, modes = np.full((count, 8, 3, 3), np.nan), np.empty(count, dtype=np.intc)
        self.run("forward_rows", joints, positions, rotations, modes)
        return positions, rotations, modes.astype(np.int64)

    def built_inverse(self, position: FloatArray, rotation: FloatArray) -> FloatArray:
        """Return the joints (n, 6) of the machine."""
        return self._of_poses("built_inverse_rows", position, rotation, 6)

    def built_forward(
        self, joints: FloatArray, modes: IntArray
    ) -> tuple[FloatArray, FloatArray, IntArray]:
        """Return positions (n, 3), rotations (n, 3, 3) of the machine, and 1 where it closes."""
        count = len(joints)
        out = np.empty((count, 3)), np.empty((count, 3, 3)), np.empty(count, dtype=np.intc)
        self.run("built_forward_rows", joints, modes.astype(np.intc), *out)
        return out[0], out[1], out[2].astype(np.int64)

    def _of_poses(
        self, function: str, position: FloatArray, rotation: FloatArray, columns: int
    ) -> FloatArray:
        out = np.empty((len(position), columns))
        self.run(function, position, rotation, out)
        return out
