"""How alike two pictures are to the eye, and what is kept of those that are not alike.

Both pictures are first reduced to a quarter, which evens out what differs between
rasterisers and fonts: the last half pixel of an edge, the smoothing of a letter. Then

- `structure` is 1 less the mean structural similarity of the lightness (Wang et al. 2004):
  what stands elsewhere or is missing;
- `colour` is the mean colour difference ΔE of CIEDE2000: what has changed in large;
- `spot` is the mean ΔE of the worst square of 32 × 32 pixels: what has changed in small.
"""

from __future__ import annotations

import io
from dataclasses import astuple, dataclass
from pathlib import Path
from typing import Any

import numpy as np
from PIL import Image
from skimage import color, metrics

from explorer.numerics.arrays import FloatArray

FAILED = Path(__file__).resolve().parents[1] / "failed"

REDUCTION = 4
# In reduced pixels.
SPOT = 8

untyped_color: Any = color
untyped_metrics: Any = metrics


@dataclass(frozen=True)
class Likeness:
    """How far two pictures are apart; all zero if they are the same."""

    structure: float
    colour: float
    spot: float

    def is_within(self, limit: Likeness) -> bool:
        """Whether none of the three exceeds its limit."""
        return all(a <= b for a, b in zip(astuple(self), astuple(limit), strict=True))


def decoded(png: bytes) -> FloatArray:
    """Return a picture as (height, width, 3), 0 to 1."""
    with Image.open(io.BytesIO(png)) as image:
        return np.asarray(image.convert("RGB"), dtype=np.float64) / 255.0


def likeness(expected: FloatArray, got: FloatArray) -> Likeness:
    """Return how far two pictures (height, width, 3) of one size are apart."""
    a, b = (untyped_color.rgb2lab(reduced(picture)) for picture in (expected, got))
    similarity = untyped_metrics.structural_similarity(
        a[..., 0] / 100.0, b[..., 0] / 100.0, data_range=1.0, gaussian_weights=True
    )
    difference = untyped_color.deltaE_ciede2000(a, b)
    return Likeness(
        structure=float(1.0 - similarity),
        colour=float(difference.mean()),
        spot=float(blocks(difference[..., None], SPOT).max()),
    )


def reduced(picture: FloatArray) -> FloatArray:
    """Return the picture at a quarter of its size."""
    return blocks(picture, REDUCTION)


def blocks(picture: FloatArray, side: int) -> FloatArray:
    """Return the means over squares of (height, width, n); what is left at an edge is cut off."""
    height, width, n = picture.shape
    rows, columns = height // side, width // side
    cut = picture[: rows * side, : columns * side]
    return cut.reshape(rows, side, columns, side, n).mean(axis=(1, 3))


Part = tuple[slice, slice]
EVERYWHERE = (slice(None), slice(None))


def assert_alike(
    name: str, expected: bytes, got: bytes, limit: Likeness, part: Part = EVERYWHERE
) -> None:
    """Fail if the pictures differ by more than the limit, and keep both and the difference.

    Args:
        name: Of what they show.
        expected: A PNG.
        got: Another.
        limit: How far they may be apart.
        part: The rows and columns that count.
    """
    a, b = decoded(expected), decoded(got)
    assert a.shape == b.shape, f"{name}: expected {a.shape[1::-1]} pixels, got {b.shape[1::-1]}"
    measured = likeness(a[part], b[part])
    if measured.is_within(limit):
        return
    FAILED.mkdir(exist_ok=True)
    files = [FAILED / f"{name}-{kind}.png" for kind in ("expected", "got", "difference")]
    for file, data in zip(files, (expected, got, difference_picture(a, b)), strict=True):
        file.write_bytes(data)
    raise AssertionError(
        f"{name} does not look as it should: {measured}, limit {limit}; "
        f"see {', '.join(map(str, files))}"
    )


def difference_picture(a: FloatArray, b: FloatArray) -> bytes:
    """Return a PNG that is white where the pictures agree, and the darker the less they do."""
    lab_a, lab_b = untyped_color.rgb2lab(a), untyped_color.rgb2lab(b)
    difference = untyped_color.deltaE_ciede2000(lab_a, lab_b)
    grey = (255.0 * (1.0 - np.clip(difference / 20.0, 0.0, 1.0))).astype(np.uint8)
    out = io.BytesIO()
    Image.fromarray(grey).save(out, "PNG")
    return out.getvalue()
