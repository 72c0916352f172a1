"""Pictures of the scene at any size, drawn by the browser that downloads one.

The browser draws the scene alone, with its labels, its camera and the settings of the tab Show;
lines and labels grow with the picture.
"""

from __future__ import annotations

import importlib
import math
from collections.abc import Sequence
from typing import Any, cast

import numpy as np
import viser
from numpy.typing import NDArray

from explorer.errors import InputError, NoAnswerError
from explorer.numerics.number_text import format_number

LEAST, MOST = 16, 4096
"""The bounds of width and height, in pixels; some browsers draw larger pictures only in part."""

# A software renderer takes many seconds for the largest picture.
PATIENCE_SECONDS = 90.0
# Widest angle of view, for pictures much higher than wide, in radians.
WIDEST = math.radians(150.0)

Pixels = NDArray[np.uint8]
Colour = tuple[int, int, int]


def check_size(width: float, height: float) -> tuple[int, int]:
    """Return a size as whole pixels.

    Raises:
        InputError: A side that is out of bounds, or no number.
    """
    for name, value in (("width", width), ("height", height)):
        if not (math.isfinite(value) and LEAST <= value <= MOST):
            raise InputError(
                f"the {name} of a picture is {LEAST} to {MOST} pixels; got {format_number(value)}"
            )
    return round(width), round(height)


def scaled_size(client: viser.ClientHandle, factor: float) -> tuple[int, int]:
    """Return the size of the scene in a browser, times a factor, within the bounds."""
    sides = (client.camera.image_width, client.camera.image_height)
    factor = min(factor, MOST / max(sides))
    width, height = (max(round(factor * side), LEAST) for side in sides)
    return width, height


def view_picture(
    client: viser.ClientHandle,
    size: tuple[int, int],
    background: Colour | None = (255, 255, 255),
    without: Sequence[str] = (),
) -> bytes:
    """Return the view of a browser as PNG; blocks until the browser has drawn it.

    A picture narrower than the view shows more above and below, so that nothing is lost.

    Args:
        client: The browser.
        size: Width and height in pixels.
        background: Colour of the background; None for a transparent one.
        without: Names of nodes of the scene to leave out.

    Raises:
        NoAnswerError: The browser is gone, hidden, or cannot draw that much.
    """
    # A node of one browser covers the shared one of the same name.
    covers = [client.scene.add_frame(name, show_axes=False) for name in without]
    try:
        pixels = _draw(client, *size)
    finally:
        for cover in covers:
            cover.remove()
    return encode_png(pixels if background is None else on_background(pixels, background))


def _draw(client: viser.ClientHandle, width: int, height: int) -> Pixels:
    """Return the view of a browser, shape (height, width, 4), transparent where it is empty.

    Raises:
        NoAnswerError: It is gone, hidden, or cannot draw that much.
    """
    camera = client.camera
    fov, aspect = float(camera.fov), width / height
    if aspect < camera.aspect:
        fov = 2.0 * math.atan(math.tan(0.5 * fov) * camera.aspect / aspect)
    try:
        pixels = client.get_render(
            height,
            width,
            wxyz=np.array(camera.wxyz),
            position=np.array(camera.position),
            fov=min(fov, WIDEST),
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


def encode_png(pixels: Pixels) -> bytes:
    """Return pixels (height, width, 3 or 4) as PNG."""
    # Types of its parameters are partly unknown.
    imageio: Any = importlib.import_module("imageio.v3")
    return cast("bytes", imageio.imwrite("<bytes>", pixels, extension=".png"))
