"""On what the measurements were made."""

from __future__ import annotations

import os
import platform
import re
from datetime import date
from importlib.metadata import version
from pathlib import Path


def describe() -> str:
    """Return one line: processor, cores, versions and the day."""
    packages = ", ".join(f"{name} {version(name)}" for name in ("numpy", "numba", "viser"))
    return (
        f"{_processor()}, {os.cpu_count()} cores; {platform.system()}; "
        f"Python {platform.python_version()}, {packages}; {date.today().isoformat()}"
    )


def _processor() -> str:
    listing = Path("/proc/cpuinfo")
    if listing.exists():
        found = re.search(r"^model name\s*:\s*(.+)$", listing.read_text("utf-8"), re.MULTILINE)
        if found:
            return found[1].strip()
    return platform.processor() or platform.machine()
