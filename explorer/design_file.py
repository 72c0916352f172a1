"""Design files: JSON, read strictly, and the designs that come along.

Unknown fields are refused, so that a misspelt limit is never silently ignored. The
presets are both rows of the paper's Table 1.
"""

from __future__ import annotations

from collections.abc import Mapping
from importlib import resources
from pathlib import Path
from types import MappingProxyType

import msgspec

from explorer.design import Design
from explorer.errors import DesignError

# No honest design file comes near this size, in bytes.
LARGEST_FILE = 1_000_000


def decode_design(data: bytes, source: str) -> Design:
    """Return the design in a JSON text.

    Args:
        data: The text, UTF-8.
        source: What to call it in an error message.

    Raises:
        DesignError: not JSON, of another schema, with unknown fields or unusable values.
    """
    if len(data) > LARGEST_FILE:
        raise DesignError(
            f"{source}: {len(data)} bytes is no design file; they stay below {LARGEST_FILE}"
        )
    try:
        return msgspec.json.decode(data, type=Design)
    except (msgspec.MsgspecError, UnicodeDecodeError, RecursionError) as error:
        raise DesignError(" ".join(f"{source}: {error}".split())) from None


def encode_design(design: Design) -> bytes:
    """Return the design as indented JSON, which `decode_design` reads back unchanged."""
    return msgspec.json.format(msgspec.json.encode(design), indent=2) + b"\n"


def load_design(preset_or_file: str) -> Design:
    """Return a preset by name, or the design in a file.

    Raises:
        DesignError: no such preset or file, or a file that holds no design.
    """
    preset = PRESETS.get(preset_or_file)
    if preset is not None:
        return preset
    path = Path(preset_or_file)
    try:
        with path.open("rb") as file:
            data = file.read(LARGEST_FILE + 1)
    except FileNotFoundError:
        raise DesignError(
            f"no preset and no file named {preset_or_file!r}; the presets are {', '.join(PRESETS)}"
        ) from None
    except (OSError, ValueError) as error:
        reason = error.strerror if isinstance(error, OSError) else str(error)
        raise DesignError(f"cannot read {preset_or_file!r}: {reason}") from None
    return decode_design(data, preset_or_file)


def _load_presets() -> Mapping[str, Design]:
    # In a wheel the presets lie inside the package, in a checkout beside it.
    packaged = resources.files("explorer").joinpath("presets")
    folder = packaged if packaged.is_dir() else Path(__file__).parents[1] / "assets" / "presets"
    files = sorted((f for f in folder.iterdir() if f.name.endswith(".json")), key=lambda f: f.name)
    designs = [decode_design(file.read_bytes(), file.name) for file in files]
    return MappingProxyType({design.name: design for design in designs})


PRESETS: Mapping[str, Design] = _load_presets()
"""The designs that come along, by name: both rows of the paper's Table 1."""
