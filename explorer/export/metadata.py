"""Metadata of the files: the program, the design as JSON, and colours."""

from __future__ import annotations

import json
from typing import TypeAlias

import msgspec

from explorer import __version__
from explorer.mechanism.design import Design

Rgb: TypeAlias = tuple[int, int, int]
"""A colour in sRGB, each channel from 0 to 255."""

APPLICATION = f"flagged-explorer {__version__}"


def design_json(design: Design) -> str:
    """Return the design as JSON on one line, in ASCII."""
    return json.dumps(json.loads(msgspec.json.encode(design)))


def linear(channel: int) -> float:
    """Return a channel of sRGB, 0 to 255, as linear light from 0 to 1 (IEC 61966-2-1)."""
    share = channel / 255.0
    return share / 12.92 if share <= 0.04045 else ((share + 0.055) / 1.055) ** 2.4
