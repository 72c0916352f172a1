"""The nearest poses in which the line b2b3 meets the guide or is parallel to it, exactly.

Two lines meet or are parallel if and only if one plane contains both. Let φ be the angle of
that plane about the guide and σ the angle of the platform about the line b2b3 from the plane's
normal n. For given φ and σ the best direction of the line in the plane and the best translation,
which is along n, have closed forms. The squared distance that remains is a function on a torus,

    f(φ, σ) = 2 tr M − 2 |W| − 2 b sin σ + (γ − c_y sin σ)²,
    W = (a' + k cos σ, h − b' cos σ),

with a and b the components along n of m = R M x̂ and l = R M ŷ (M the scatter of the platform's
points), γ that of their centroid, a' and b' the derivatives by φ, and h and k the components of
m and l along the guide. Branch and bound minimises f: on a box of half-sides α and β, W becomes
linear and the other terms their tangents, which makes f concave, so that its least value is at one
of the four corners; that value less bounds of the second-order terms is a lower bound.
"""

from __future__ import annotations

import math
from typing import NamedTuple

from explorer.numerics.arrays import FloatArray
from explorer.numerics.compiled import helper
from explorer.numerics.vectors import Vector, times, vector_of

Angles = tuple[float, float]
Terms = tuple[float, float, float, float, float, float, float, float, float, float]
"""a, b and γ at φ, their derivatives by φ, and the sines and cosines of φ and σ."""

# Numbers of initial boxes over half the torus, since (φ + π, σ + π) is the same pose.
FIRST_PHI, FIRST_SIGMA = 6, 12
# Largest number of halvings; only poses in which the lines nearly coincide need more.
MOST_HALVINGS = 4_000
ROOM = FIRST_PHI * FIRST_SIGMA + 2 * MOST_HALVINGS
POLISH_STEPS = 60
# Least improvement for which a box is divided, relative to the minimum and to the scatter.
RELATIVE_GAIN, LEAST_GAIN = 1e-9, 1e-14
EPSILON = 2.0**-52
# 2 tr M: the unit of length is that of a scatter with a trace of one.
TWICE_TRACE = 2.0


class Constants(NamedTuple):
    """The constants of f: m, l and the centroid g in base axes, and c_y of the centroid."""

    m: Vector
    l: Vector  # noqa: E741 - the name in the formula
    g: Vector
    c_y: float


@helper
def constants_at(r: FloatArray, g: FloatArray, scatter: FloatArray, c: FloatArray) -> Constants:
    """Return the constants of a rotation, a centroid in the base and the platform's moments."""
    return Constants(times(r, scatter[:, 0]), times(r, scatter[:, 1]), vector_of(g), c[1])


@helper
def terms_at(phi: float, sigma: float, k: Constants) -> Terms:
    """Return the terms of f at the angles φ of the plane and σ of the platform."""
    cp, sp, cs, ss = math.cos(phi), math.sin(phi), math.cos(sigma), math.sin(sigma)
    # n = (0, −sin φ, cos φ): at φ = 0 the plane is that of the base.
    a, b, g = -sp * k.m[1] + cp * k.m[2], -sp * k.l[1] + cp * k.l[2], -sp * k.g[1] + cp * k.g[2]
    da, db, dg = -cp * k.m[1] - sp * k.m[2], -cp * k.l[1] - sp * k.l[2], -cp * k.g[1] - sp * k.g[2]
    return a, b, g, da, db, dg, sp, cp, ss, cs


@helper
def value_at(phi: float, sigma: float, k: Constants) -> float:
    """Return f(φ, σ), the squared distance."""
    _, b, g, da, db, _, _, _, ss, cs = terms_at(phi, sigma, k)
    y = g - k.c_y * ss
    return TWICE_TRACE - 2.0 * math.hypot(da + k.l[0] * cs, k.m[0] - db * cs) - 2.0 * b * ss + y * y


@helper
def bound_over(phi: float, sigma: float, alpha: float, beta: float, k: Constants) -> float:
    """Return a lower bound of f within α of φ and β of σ."""
    a, b, g, da, db, dg, _, _, ss, cs = terms_at(phi, sigma, k)
    y = g - k.c_y * ss
    w0, w1 = da + k.l[0] * cs, k.m[0] - db * cs
    w0_phi, w1_phi = -a * alpha, b * cs * alpha
    w0_sigma, w1_sigma = -k.l[0] * ss * beta, db * ss * beta
    slope_phi = (-2.0 * db * ss + 2.0 * y * dg) * alpha
    slope_sigma = (-2.0 * b * cs - 2.0 * y * k.c_y * cs) * beta
    least = math.inf
    for corner in range(4):
        i = 1.0 if corner & 1 else -1.0
        j = 1.0 if corner & 2 else -1.0
        long = math.hypot(w0 + i * w0_phi + j * w0_sigma, w1 + i * w1_phi + j * w1_sigma)
        least = min(least, i * slope_phi + j * slope_sigma - 2.0 * long)
    # Second derivatives: of W, of b sin σ, and of γ − c_y sin σ.
    size_a, size_b = math.hypot(k.m[1], k.m[2]), math.hypot(k.l[1], k.l[2])
    second_w = (
        math.hypot(size_a, size_b) * alpha * alpha
        + 2.0 * size_b * alpha * beta
        + math.hypot(k.l[0], size_b) * beta * beta
    )
    second_b = size_b * (alpha + beta) * (alpha + beta)
    second_y = math.hypot(k.g[1], k.g[2]) * alpha * alpha + abs(k.c_y) * beta * beta
    return TWICE_TRACE - 2.0 * b * ss + y * y + least - second_w - second_b - abs(y) * second_y


@helper
def polish(phi: float, sigma: float, k: Constants) -> Angles:
    """Return the angles of the local minimum to which Newton's method descends."""
    value = value_at(phi, sigma, k)
    for _ in range(POLISH_STEPS):
        a, b, g, da, db, dg, _, _, ss, cs = terms_at(phi, sigma, k)
        y = g - k.c_y * ss
        w0, w1 = da + k.l[0] * cs, k.m[0] - db * cs
        w = math.hypot(w0, w1)
        if w == 0.0:
            # On a ridge of f every direction descends.
            phi, sigma = phi + 1e-3, sigma + 1e-3
            value = value_at(phi, sigma, k)
            continue
        p0, p1, s0, s1 = -a, b * cs, -k.l[0] * ss, db * ss
        along_p, along_s = (w0 * p0 + w1 * p1) / w, (w0 * s0 + w1 * s1) / w
        pp = (p0 * p0 + p1 * p1 - w0 * da + w1 * db * cs - along_p * along_p) / w
        ps = (p0 * s0 + p1 * s1 - w1 * b * ss - along_p * along_s) / w
        square = s0 * s0 + s1 * s1 - w0 * k.l[0] * cs + w1 * db * cs
        sss = (square - along_s * along_s) / w
        y_sigma = -k.c_y * cs
        slope_p = -2.0 * along_p - 2.0 * db * ss + 2.0 * y * dg
        slope_s = -2.0 * along_s - 2.0 * b * cs + 2.0 * y * y_sigma
        hpp = -2.0 * pp + 2.0 * b * ss + 2.0 * dg * dg - 2.0 * y * g
        hps = -2.0 * ps - 2.0 * db * cs + 2.0 * dg * y_sigma
        hss = -2.0 * sss + 2.0 * b * ss + 2.0 * y_sigma * y_sigma + 2.0 * y * k.c_y * ss
        # If f is not convex here, raise both eigenvalues of the Hessian above zero.
        middle, half = 0.5 * (hpp + hss), math.hypot(0.5 * (hpp - hss), hps)
        raised = 0.0 if middle - half > 1e-9 * half else half - middle + 1e-3 * half
        hpp, hss = hpp + raised, hss + raised
        determinant = hpp * hss - hps * hps
        if not determinant > 0.0:
            break
        step_p = -(hss * slope_p - hps * slope_s) / determinant
        step_s = -(hpp * slope_s - hps * slope_p) / determinant
        longest = max(abs(step_p), abs(step_s))
        share = min(1.0, 0.5 / longest) if longest > 0.0 else 1.0
        moved = value
        for _ in range(30):
            moved = value_at(phi + share * step_p, sigma + share * step_s, k)
            if moved <= value + 8.0 * EPSILON * (abs(value) + TWICE_TRACE):
                break
            share *= 0.25
        phi, sigma = phi + share * step_p, sigma + share * step_s
        value = moved
        if share * longest <= 4.0 * EPSILON:
            break
    return phi, sigma


@helper
def minimise_on_torus(k: Constants, boxes: FloatArray) -> tuple[float, float, float]:
    """Return the angles φ and σ of the minimum of f, and a lower bound of f.

    `boxes` is working space of the shape (ROOM, 4).
    """
    alpha, beta = 0.5 * math.pi / FIRST_PHI, math.pi / FIRST_SIGMA
    last = 0
    best, phi, sigma = math.inf, 0.0, 0.0
    for i in range(FIRST_PHI):
        for j in range(FIRST_SIGMA):
            boxes[last, 0], boxes[last, 1] = (2 * i + 1) * alpha, (2 * j + 1) * beta
            boxes[last, 2], boxes[last, 3] = alpha, beta
            value = value_at(boxes[last, 0], boxes[last, 1], k)
            if value < best:
                best, phi, sigma = value, boxes[last, 0], boxes[last, 1]
            last += 1
    phi, sigma = polish(phi, sigma, k)
    best = value_at(phi, sigma, k)
    bound, first = math.inf, 0
    # Rates of the second-order terms: a box is halved along the angle whose term is larger.
    size_b = math.hypot(k.l[1], k.l[2])
    bend_phi = math.hypot(math.hypot(k.m[1], k.m[2]), size_b) + k.g[1] * k.g[1] + k.g[2] * k.g[2]
    bend_sigma = math.hypot(k.l[0], size_b) + k.c_y * k.c_y
    # Large boxes precede small ones, so that the boxes left at the end have similar bounds.
    while first < last:
        p, s, alpha, beta = boxes[first]
        first += 1
        low, value = bound_over(p, s, alpha, beta, k), value_at(p, s, k)
        if value < best:
            best, phi, sigma = value, p, s
            p_down, s_down = polish(p, s, k)
            value = value_at(p_down, s_down, k)
            if value < best:
                best, phi, sigma = value, p_down, s_down
        enough = best - RELATIVE_GAIN * abs(best) - LEAST_GAIN * TWICE_TRACE
        if low >= enough or last + 2 > ROOM:
            bound = min(bound, low)
            continue
        halves_phi = bend_phi * alpha * alpha > bend_sigma * beta * beta
        if halves_phi:
            alpha *= 0.5
        else:
            beta *= 0.5
        for side in (-1.0, 1.0):
            boxes[last, 0] = p + side * alpha if halves_phi else p
            boxes[last, 1] = s if halves_phi else s + side * beta
            boxes[last, 2], boxes[last, 3] = alpha, beta
            last += 1
    return phi, sigma, min(bound, best)


@helper
def write_on_plane(
    phi: float,
    sigma: float,
    k: Constants,
    centroid: FloatArray,
    g: FloatArray,
    rotation: FloatArray,
    position: FloatArray,
) -> None:
    """Write the best rotation (3, 3) and position (3,) at the two angles.

    The centroid of the points is in the platform frame, g in the base frame, shape (3,) each.
    """
    _, _, _, da, db, _, sp, cp, ss, cs = terms_at(phi, sigma, k)
    w0, w1 = da + k.l[0] * cs, k.m[0] - db * cs
    w = math.hypot(w0, w1)
    if w > 0.0:
        w0, w1 = w0 / w, w1 / w
    else:
        w0, w1 = 0.0, 1.0
    # The guide, the plane's normal n, and n' = x̂ × n, the plane's direction across the guide.
    x, n, across = (1.0, 0.0, 0.0), (0.0, -sp, cp), (0.0, -cp, -sp)
    for i in range(3):
        u = w1 * x[i] + w0 * across[i]
        e = w0 * x[i] - w1 * across[i]
        rotation[i, 0] = u
        rotation[i, 1] = cs * e + ss * n[i]
        rotation[i, 2] = cs * n[i] - ss * e
        position[i] = g[i] - rotation[i, 0] * centroid[0] - rotation[i, 1] * centroid[1]
    # The second projection removes the rounding of the first.
    for _ in range(2):
        off = n[1] * position[1] + n[2] * position[2]
        position[1] -= off * n[1]
        position[2] -= off * n[2]
