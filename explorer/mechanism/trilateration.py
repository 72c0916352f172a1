"""The three trilaterations in closed form (the paper's geometric analysis, Figure 2).

With u, v, n the platform's axes in the base frame and p the position of b4, the joints
determine the scalars c = u·x̂, the yz-radius r of b4, w = uy py + uz pz, X = u·p and Y = v·p.
Then

    trilateration 1 (b1 b2 b3 a1):  δ1² = |p|² − X² − Y²
    trilateration 2 (a1 a2 b2 b3):  δ2² = (1 − c²) r² − w²
    trilateration 3 (b4 a1 a2 a3):  δ3² = r² − py²

so the three discriminants are the squared margins, equal in all eight modes, and the signs of
the three roots are those of the mode.
"""

from __future__ import annotations

import math

from explorer.numerics.arrays import BoolArray, FloatArray
from explorer.numerics.compiled import kernel

# Relative rounding of one operation; the kernel propagates first-order bounds of the errors.
EPSILON = 2.0**-52
# Number of error bounds below zero within which a discriminant counts as zero.
ROUNDINGS = 8.0
# Square of a length that is negligible beside one and far from underflow.
NEGLIGIBLE_SQUARE = 1e-200
# Square of the least angle that is more than rounding.
LEAST_SQUARED_ANGLE = 1e-29


@kernel("void(f8[::1], f8[:,::1], f8[:,:,::1], f8[:,:,:,::1], b1[::1], f8[:,::1])")
def solve_rows(  # noqa: PLR0915 - one loop body, so that nothing is stored between steps
    variables: FloatArray,
    joints: FloatArray,
    positions: FloatArray,
    rotations: FloatArray,
    feasible: BoolArray,
    discriminants: FloatArray,
) -> None:
    """Solve the forward kinematics of each row of joints.

    Joints that do not close yield the poses of the nearest scalars that do: finite and rigid,
    but with other joints.

    Args:
        variables: Design variables X, shape (6,).
        joints: (l1, d1, d2, d3, d4, l4), shape (n, 6).
        positions: Output, b4 in the base frame, shape (n, 8, 3).
        rotations: Output, platform to base, shape (n, 8, 3, 3).
        feasible: Output, whether the joints close, shape (n,).
        discriminants: Output, δ1², δ2², δ3², negative if a trilateration fails, shape (n, 3).
    """
    for row in range(joints.shape[0]):
        # Lengths are divided by the largest, so that no square over- or underflows.
        scale = 0.0
        for i in range(6):
            scale = max(scale, abs(variables[i]), abs(joints[row, i]))
        shrink = 1.0 / scale
        a3x, a3y = variables[0] * shrink, variables[1] * shrink
        b1x, b1y = variables[2] * shrink, variables[3] * shrink
        b2, b3 = variables[4] * shrink, variables[5] * shrink
        l1, d1, d2 = joints[row, 0] * shrink, joints[row, 1] * shrink, joints[row, 2] * shrink
        d3, d4, l4 = joints[row, 3] * shrink, joints[row, 4] * shrink, joints[row, 5] * shrink

        # The scalars, each with a bound of its rounding error (named with a leading e).
        span = b3 - b2
        per_span = 1.0 / span
        c = (d3 - d1) * per_span
        ec = EPSILON * (abs(d3) + abs(d1) + abs(c) * (abs(b3) + abs(b2))) / abs(span)
        px = d1 - b2 * c
        epx = abs(b2) * ec + EPSILON * (abs(d1) + abs(b2 * c))
        s2 = (1.0 - c) * (1.0 + c)
        es2 = 2.0 * abs(c) * ec + EPSILON * abs(s2)

        t = -b2 / span
        pull = t * (1.0 - t) * span * span
        r2 = (1.0 - t) * d2 * d2 + t * d4 * d4 - pull * s2
        er2 = abs(pull) * es2 + EPSILON * (
            abs(1.0 - t) * d2 * d2 + abs(t) * d4 * d4 + abs(pull * s2)
        ) * (1.0 + (abs(b3) + abs(b2)) / abs(span))
        w = (d4 * d4 - d2 * d2 - (b3 + b2) * span * s2) / (2.0 * span)
        ew = (
            abs(b3 + b2) * es2 * 0.5
            + EPSILON * (d4 * d4 + d2 * d2) / (2.0 * abs(span))
            + EPSILON * abs(w) * (1.0 + (abs(b3) + abs(b2)) / abs(span))
        )
        py = ((px - a3x) * (px - a3x) + r2 + a3y * a3y - l4 * l4) / (2.0 * a3y)
        epy = (
            2.0 * abs(px - a3x) * epx
            + er2
            + EPSILON * ((px - a3x) * (px - a3x) + abs(r2) + a3y * a3y + l4 * l4)
        ) / (2.0 * abs(a3y))

        p2 = px * px + r2
        ep2 = 2.0 * abs(px) * epx + er2 + EPSILON * px * px
        along = c * px + w
        ealong = abs(px) * ec + abs(c) * epx + ew
        across = (l1 * l1 - p2 - b1x * b1x - b1y * b1y - 2.0 * b1x * along) / (2.0 * b1y)
        eacross = (
            ep2 + 2.0 * abs(b1x) * ealong + EPSILON * (l1 * l1 + abs(p2) + b1x * b1x + b1y * b1y)
        ) / (2.0 * abs(b1y))

        # The discriminants. δ2² is a Gram determinant: 1 - c² and r² must not be negative either.
        k3 = r2 - py * py
        ek3 = er2 + 2.0 * abs(py) * epy + epy * epy
        k2 = s2 * r2 - w * w
        if s2 < 0.0 or r2 < 0.0:
            k2 = min(k2, s2, r2)
        ek2 = abs(s2) * er2 + abs(r2) * es2 + 2.0 * abs(w) * ew + ew * ew
        h2 = p2 - along * along
        k1 = h2 - across * across
        ek1 = (
            ep2
            + 2.0 * abs(along) * ealong
            + ealong * ealong
            + 2.0 * abs(across) * eacross
            + eacross * eacross
        )
        feasible[row] = (
            k1 >= -ROUNDINGS * ek1
            and k2 >= -ROUNDINGS * (ek2 + es2 + er2 if s2 < 0.0 or r2 < 0.0 else ek2)
            and k3 >= -ROUNDINGS * ek3
        )
        unit = scale * scale
        discriminants[row, 0] = k1 * unit
        discriminants[row, 1] = k2 * unit
        discriminants[row, 2] = k3 * unit

        # If a discriminant is negative, the nearest scalars that close replace the given ones.
        c = min(1.0, max(-1.0, c))
        s = math.sqrt(max(0.0, (1.0 - c) * (1.0 + c)))
        r = math.sqrt(max(0.0, r2))
        py = min(r, max(-r, py))
        w = min(s * r, max(-s * r, w))
        delta3 = math.sqrt(max(0.0, (r - py) * (r + py)))
        delta2 = math.sqrt(max(0.0, (s * r - w) * (s * r + w)))
        along = c * px + w

        for lower in range(4):
            pz = delta3 if lower & 1 else -delta3
            turn = delta2 if lower & 2 else -delta2
            uy, uz = w * py + turn * pz, w * pz - turn * py
            square = uy * uy + uz * uz
            # (uy, uz) has length s; near the guide rounding spoils it, hence the scaling.
            if square > NEGLIGIBLE_SQUARE:
                stretch = s / math.sqrt(square)
                uy, uz = uy * stretch, uz * stretch
            else:
                uy, uz = s, 0.0

            # e: direction from a1 to the nearest point of the line b2b3; f = u × e.
            ex, ey, ez = px - along * c, py - along * uy, pz - along * uz
            square_h = ex * ex + ey * ey + ez * ez
            lean = ex * c + ey * uy + ez * uz
            on_line = square_h < NEGLIGIBLE_SQUARE
            if lean * lean > LEAST_SQUARED_ANGLE * square_h:
                # Near the line, cancellation leaves a part of e along u, so project once more.
                # What is left may be mere rounding: then a1 is on the line, and e any normal of u.
                ex, ey, ez = ex - lean * c, ey - lean * uy, ez - lean * uz
                rough, square_h = square_h, ex * ex + ey * ey + ez * ez
                on_line = square_h <= max(0.25 * rough, NEGLIGIBLE_SQUARE)
            cosine, sine = 1.0, 0.0
            if not on_line:
                inverse = 1.0 / math.sqrt(square_h)
                ex, ey, ez = ex * inverse, ey * inverse, ez * inverse
                cosine = min(1.0, max(-1.0, across * inverse))
                sine = math.sqrt((1.0 - cosine) * (1.0 + cosine))
            elif abs(c) < 0.9:
                size = math.sqrt((1.0 - c) * (1.0 + c))
                ex, ey, ez = (1.0 - c * c) / size, -c * uy / size, -c * uz / size
            else:
                size = math.sqrt(1.0 - uy * uy)
                ex, ey, ez = -uy * c / size, (1.0 - uy * uy) / size, -uy * uz / size
            fx, fy, fz = uy * ez - uz * ey, uz * ex - c * ez, c * ey - uy * ex

            for upper in range(2):
                mode = lower + 4 * upper
                # δ1 = -(n·p): a positive one turns n away from p.
                sin = -sine if upper else sine
                positions[row, mode, 0] = px * scale
                positions[row, mode, 1] = py * scale
                positions[row, mode, 2] = pz * scale
                rotations[row, mode, 0, 0] = c
                rotations[row, mode, 1, 0] = uy
                rotations[row, mode, 2, 0] = uz
                rotations[row, mode, 0, 1] = cosine * ex - sin * fx
                rotations[row, mode, 1, 1] = cosine * ey - sin * fy
                rotations[row, mode, 2, 1] = cosine * ez - sin * fz
                rotations[row, mode, 0, 2] = sin * ex + cosine * fx
                rotations[row, mode, 1, 2] = sin * ey + cosine * fy
                rotations[row, mode, 2, 2] = sin * ez + cosine * fz
