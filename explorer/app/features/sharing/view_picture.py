"""Pictures of the scene at any size, drawn by the browser that asks for one.

The browser draws the scene alone, with its labels, from where its camera stands and as the
View tab has it; lines and labels grow with the picture. What its graphics cannot draw at
once, some browsers fill with a part of the picture and tell nobody: so a large picture is
held against a small one.
"""

from __future__ import annotations

import importlib
import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, cast

import numpy as np
import viser
from numpy.typing import NDArray

from explorer.errors import InputError, NoAnswerError
from explorer.numerics.arrays import FloatArray

LEAST, MOST = 16, 8192
"""The bounds of width and height, in pixels."""

# A software renderer takes half a minute for the largest.
PATIENCE_SECONDS = 90.0
# What every browser that has WebGL draws at once, in pixels.
CERTAIN = 2048
# Of the small picture that a large one is held against, in pixels, and the squares that are
# compared, along each side.
SMALL, SQUARES = 512, 16
# Mean difference of two pictures of one scene, of 255; different parts of it differ by 30.
ALIKE = 8.0
# The widest angle of view, of what is much higher than wide, in radians.
WIDEST = math.radians(150.0)

Pixels = NDArray[np.uint8]
Colour = tuple[int, int, int]


@dataclass(frozen=True)
class Eye:
    """From where to look, as of viser's camera.

    Attributes:
        wxyz: Orientation.
        position: In the scene.
        fov: Vertical angle of view, in radians.
    """

    wxyz: FloatArray
    position: FloatArray
    fov: float


def check_size(width: float, height: float) -> tuple[int, int]:
    """Return a size as whole pixels.

    Raises:
        InputError: a side that is out of bounds, or no number.
    """
    for name, value in (("width", width), ("height", height)):
        if not (math.isfinite(value) and LEAST <= value <= MOST):
            raise InputError(f"the {name} of a picture is {LEAST} to {MOST} pixels; got {value:g}")
    return round(width), round(height)


def view_picture(
    client: viser.ClientHandle,
    size: tuple[int, int],
    background: Colour | None = (255, 255, 255),
    without: Sequence[str] = (),
) -> bytes:
    """Return the view of a browser as PNG; blocks until that has drawn it.

    What is seen in the browser is in the picture: where that is narrower than the view, more
    is seen above and below.

    Args:
        client: The browser.
        size: Width and height in pixels.
        background: Behind the scene; None to leave it transparent.
        without: The names of parts of the scene to leave out.

    Raises:
        InputError: a size that is out of bounds.
        NoAnswerError: the browser is gone, is out of sight, or cannot draw that much.
    """
    width, height = check_size(*size)
    # A browser shows a part of its own in place of everybody's of the same name.
    covers = [client.scene.add_frame(name, show_axes=False) for name in without]
    try:
        pixels = _checked(client, width, height)
    finally:
        for cover in covers:
            cover.remove()
    return encoded(pixels if background is None else on_background(pixels, background))


def _checked(client: viser.ClientHandle, width: int, height: int) -> Pixels:
    """Return what a browser sees, (height, width, 4), and all of it.

    Raises:
        NoAnswerError: it cannot draw that much.
    """
    eye = _eye(client, width / height)
    pixels = _drawn(client, eye, width, height)
    if max(width, height) > CERTAIN:
        scale = SMALL / max(width, height)
        sides = [max(round(scale * side), SQUARES) for side in (width, height)]
        small = _drawn(client, eye, *sides)
        if difference(pixels, small) > ALIKE:
            half = math.sqrt(0.5)
            raise NoAnswerError(
                f"this browser cannot draw {width} × {height} pixels at once; "
                f"{round(half * width)} × {round(half * height)} may work"
            )
    return pixels


def shown_size(client: viser.ClientHandle, factor: float) -> tuple[int, int]:
    """Return the size of the scene in a browser, times a factor, within the bounds."""
    sides = (client.camera.image_width, client.camera.image_height)
    factor = min(factor, MOST / max(sides))
    width, height = (max(round(factor * side), LEAST) for side in sides)
    return width, height


def on_background(pixels: Pixels, colour: Colour) -> Pixels:
    """Return a picture (height, width, 4) laid on a colour, (height, width, 3)."""
    # In strips, since a large one takes much memory as numbers.
    out = np.empty((*pixels.shape[:2], 3), dtype=np.uint8)
    for start in range(0, len(pixels), 256):
        strip = pixels[start : start + 256].astype(np.uint16)
        alpha = strip[..., 3:]
        mixed = strip[..., :3] * alpha + np.array(colour, dtype=np.uint16) * (255 - alpha)
        out[start : start + 256] = (mixed + 127) // 255
    return out


def difference(one: Pixels, other: Pixels) -> float:
    """Return how much two pictures (height, width, 4) differ, of 255, whatever their sizes."""
    return float(np.abs(_squares(one) - _squares(other)).mean())


def encoded(pixels: Pixels) -> bytes:
    """Return pixels (height, width, 3 or 4) as PNG."""
    # Types of its parameters are partly unknown.
    imageio: Any = importlib.import_module("imageio.v3")
    return cast("bytes", imageio.imwrite("<bytes>", pixels, extension=".png"))


def _eye(client: viser.ClientHandle, aspect: float) -> Eye:
    camera = client.camera
    fov = float(camera.fov)
    if aspect < camera.aspect:
        fov = 2.0 * math.atan(math.tan(0.5 * fov) * camera.aspect / aspect)
    return Eye(np.array(camera.wxyz), np.array(camera.position), min(fov, WIDEST))


def _drawn(client: viser.ClientHandle, eye: Eye, width: int, height: int) -> Pixels:
    """Return what a browser draws, (height, width, 4), transparent where nothing is.

    Raises:
        NoAnswerError: it is gone, is out of sight, or cannot draw that much.
    """
    try:
        pixels = client.get_render(
            height,
            width,
            wxyz=eye.wxyz,
            position=eye.position,
            fov=eye.fov,
            transport_format="png",
            timeout=PATIENCE_SECONDS,
        )
    except TimeoutError:
        raise NoAnswerError(
            "the browser did not draw the picture in time: keep its tab in sight, or take a "
            "smaller size"
        ) from None
    except RuntimeError:
        pixels = np.empty((0, 0, 4), dtype=np.uint8)
    if pixels.shape != (height, width, 4):
        raise NoAnswerError(
            f"the browser could not draw {width} × {height} pixels; take a smaller size"
        )
    return pixels


def _squares(pixels: Pixels) -> FloatArray:
    """Return the mean darkness and opacity of parts of a picture, (squares, squares, 2)."""
    height, width = pixels.shape[:2]
    rows, columns = (
        np.linspace(0, side, SQUARES, endpoint=False, dtype=np.float64).astype(np.int64)
        for side in (height, width)
    )
    both = np.empty((SQUARES, width, 2))
    for row, (start, end) in enumerate(zip(rows, [*rows[1:], height], strict=True)):
        strip = pixels[start:end]
        alpha = strip[..., 3].astype(np.float32)
        dark = (255.0 - strip[..., :3].mean(axis=-1, dtype=np.float32)) * alpha / 255.0
        both[row, :, 0], both[row, :, 1] = dark.mean(axis=0), alpha.mean(axis=0)
    sums = np.add.reduceat(both, columns, axis=1)
    return sums / np.diff([*columns, width])[:, None]
