"""Affine arithmetic: bounds of formulas over n cells at once, whose error falls with their square.

A quantity is c + Σ sᵢ eᵢ + r e with the coordinates eᵢ of a cell, from −1 to 1 across it, and an
unknown e within ±1 of its own (L. H. de Figueiredo and J. Stolfi, "Affine arithmetic: concepts and
applications", 2004). Sums keep it exact; products, roots and quotients add to r what they bend.
"""

from __future__ import annotations

from typing import Any, ClassVar

import numpy as np

from explorer.numerics.arrays import FloatArray


class Affine:
    """Quantities over n cells with m coordinates: centre (n,), slopes (n, m) and rest (n,)."""

    # Arrays leave their operators to this class.
    __array_ufunc__: ClassVar[None] = None

    def __init__(self, centre: FloatArray, slopes: FloatArray, rest: FloatArray) -> None:
        self.centre, self.slopes, self.rest = centre, slopes, rest

    @property
    def radius(self) -> FloatArray:
        """The largest distance from the centre, shape (n,)."""
        return np.abs(self.slopes).sum(axis=1) + self.rest

    @property
    def upper(self) -> FloatArray:
        """Upper bounds, shape (n,); infinite where none is known."""
        return np.nan_to_num(self.centre + self.radius, nan=np.inf, posinf=np.inf)

    @property
    def lower(self) -> FloatArray:
        """Lower bounds, shape (n,); minus infinity where none is known."""
        return np.nan_to_num(self.centre - self.radius, nan=-np.inf, neginf=-np.inf)

    def __add__(self, other: Any) -> Affine:
        """Return the sum with another quantity or a number."""
        if isinstance(other, Affine):
            rest = self.rest + other.rest
            return Affine(self.centre + other.centre, self.slopes + other.slopes, rest)
        return Affine(self.centre + other, self.slopes, self.rest)

    __radd__ = __add__

    def __neg__(self) -> Affine:
        """Return the negative."""
        return Affine(-self.centre, -self.slopes, self.rest)

    def __sub__(self, other: Any) -> Affine:
        """Return the difference from another quantity or a number."""
        return self + -other

    def __rsub__(self, other: Any) -> Affine:
        """Return the difference of a number from this."""
        return -self + other

    def __mul__(self, other: Any) -> Affine:
        """Return the product with another quantity or a number."""
        if isinstance(other, Affine):
            a, b = self.centre, other.centre
            slopes = a[:, None] * other.slopes + b[:, None] * self.slopes
            bend = self.radius * other.radius
            return Affine(a * b, slopes, np.abs(a) * other.rest + np.abs(b) * self.rest + bend)
        factor = np.asarray(other)
        return Affine(
            self.centre * factor, self.slopes * factor[..., None], self.rest * np.abs(factor)
        )

    __rmul__ = __mul__

    def __truediv__(self, other: Any) -> Affine:
        """Return the quotient by another quantity or a number."""
        return self * (other.reciprocal() if isinstance(other, Affine) else 1.0 / other)

    def __rtruediv__(self, other: Any) -> Affine:
        """Return the quotient of a number by this."""
        return self.reciprocal() * other

    def reciprocal(self) -> Affine:
        """Return one over the quantity; without a bound where it may be zero."""
        least = np.abs(self.centre) - self.radius
        with np.errstate(divide="ignore", invalid="ignore", over="ignore"):
            slope = -1.0 / self.centre**2
            # (x − c)² / (c² x) lies between zero and this, on the side of c.
            bend = np.where(least > 0.0, -slope * self.radius**2 / least, np.inf)
            centre = 1.0 / self.centre + 0.5 * np.where(least > 0.0, bend, 0.0) * np.sign(
                self.centre
            )
            return Affine(centre, slope[:, None] * self.slopes, -slope * self.rest + 0.5 * bend)

    def root(self) -> Affine:
        """Return the square root; without a bound where the quantity may be zero."""
        least = self.centre - self.radius
        with np.errstate(divide="ignore", invalid="ignore"):
            root = np.sqrt(self.centre)
            slope = 0.5 / root
            bend = np.where(least > 0.0, self.radius**2 / (8.0 * np.abs(least) ** 1.5), np.inf)
            centre = root - 0.5 * np.where(least > 0.0, bend, 0.0)
            return Affine(centre, slope[:, None] * self.slopes, slope * self.rest + 0.5 * bend)


def largest_norm(x: Affine, y: Affine, z: Affine) -> FloatArray:
    """Return upper bounds of the lengths of vectors, shape (n,)."""
    centre = np.stack([x.centre, y.centre, z.centre], axis=1)
    slopes = np.stack([x.slopes, y.slopes, z.slopes], axis=1)
    along = np.abs((centre[:, None] @ slopes)[:, 0]).sum(axis=1)
    bend = np.abs(np.swapaxes(slopes, 1, 2) @ slopes).sum(axis=(1, 2))
    rest = np.sqrt(x.rest**2 + y.rest**2 + z.rest**2)
    length = np.sqrt((centre**2).sum(axis=1) + 2.0 * along + bend) + rest
    return np.nan_to_num(length, nan=np.inf, posinf=np.inf)
