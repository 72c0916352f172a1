"""Pictures of the scene at any size, drawn by the browser that downloads one.

The browser draws the scene alone, with its labels, its camera and the settings of the tab Show;
lines and labels grow with the picture. Some browsers fill a picture too large for their graphics
with a part of it, without an error; so a large picture is compared with a small one.
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
from explorer.numerics.number_text import format_number

LEAST, MOST = 16, 8192
"""The bounds of width and height, in pixels."""

# A software renderer takes half a minute for the largest picture.
PATIENCE_SECONDS = 90.0
# Side that every browser with WebGL draws at once, in pixels.
CERTAIN = 2048
# Side of the small picture in pixels, and number of compared squares along each side.
SMALL, SQUARES = 512, 16
# Largest mean difference of two pictures of one scene, of 255; different parts differ by 30.
ALIKE = 8.0
# Widest angle of view, for pictures much higher than wide, in radians.
WIDEST = math.radians(150.0)

Pixels = NDArray[np.uint8]
Colour = tuple[int, int, int]


@dataclass(frozen=True)
class ViewCamera:
    """A camera of viser.

    Attributes:
        wxyz: Orientation.
        position: Position in the scene.
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
            raise InputError(
                f"the {name} of a picture is {LEAST} to {MOST} pixels; got {format_number(value)}"
            )
    return round(width), round(height)


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
        InputError: a size that is out of bounds.
        NoAnswerError: the browser is gone, hidden, or cannot draw that much.
    """
    width, height = check_size(*size)
    # A node of one browser covers the shared one of the same name.
    covers = [client.scene.add_frame(name, show_axes=False) for name in without]
    try:
        pixels = _draw_and_check(client, width, height)
    finally:
        for cover in covers:
            cover.remove()
    return encoded(pixels if background is None else on_background(pixels, background))


def _draw_and_check(client: viser.ClientHandle, width: int, height: int) -> Pixels:
    """Return the whole view of a browser, shape (height, width, 4).

    Raises:
        NoAnswerError: it cannot draw that much.
    """
    camera = _camera(client, width / height)
    pixels = _draw(client, camera, width, height)
    if max(width, height) > CERTAIN:
        scale = SMALL / max(width, height)
        sides = [max(round(scale * side), SQUARES) for side in (width, height)]
        small = _draw(client, camera, *sides)
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
    """Return the mean difference of two pictures (height, width, 4) of any sizes, of 255."""
    return float(np.abs(_squares(one) - _squares(other)).mean())


def encoded(pixels: Pixels) -> bytes:
    """Return pixels (height, width, 3 or 4) as PNG."""
    # Types of its parameters are partly unknown.
    imageio: Any = importlib.import_module("imageio.v3")
    return cast("bytes", imageio.imwrite("<bytes>", pixels, extension=".png"))


def _camera(client: viser.ClientHandle, aspect: float) -> ViewCamera:
    camera = client.camera
    fov = float(camera.fov)
    if aspect < camera.aspect:
        fov = 2.0 * math.atan(math.tan(0.5 * fov) * camera.aspect / aspect)
    return ViewCamera(np.array(camera.wxyz), np.array(camera.position), min(fov, WIDEST))


def _draw(client: viser.ClientHandle, camera: ViewCamera, width: int, height: int) -> Pixels:
    """Return a picture drawn by a browser, shape (height, width, 4), transparent where empty.

    Raises:
        NoAnswerError: it is gone, hidden, or cannot draw that much.
    """
    try:
        pixels = client.get_render(
            height,
            width,
            wxyz=camera.wxyz,
            position=camera.position,
            fov=camera.fov,
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
