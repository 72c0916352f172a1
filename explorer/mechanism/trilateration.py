"""The three trilaterations in closed form (the paper's geometric analysis, Figure 2).

With c = cos between the guide and the line b2b3, X and Y the platform's x and y components of the
vector from a1 to b4, and r, β, ε and the folds φ1 to φ3 of `explorer.mechanism.folds`, the joints
determine px, py, c, X and Y, and with them one cosine for each trilateration:

    trilateration 1 (b1 b2 b3 a1):  cos φ1 = −Y / (r sin ε)
    trilateration 2 (a1 a2 b2 b3):  cos φ2 = (cos β cos ε − c) / (sin β sin ε)
    trilateration 3 (b4 a1 a2 a3):  cos φ3 = py / (r sin β)

Each cosine has two folds, of opposite signs, or one flat fold: the eight modes. The discriminants
are the squared margins, equal in all of them.
"""

from __future__ import annotations

import math

from explorer.mechanism.folds import write_rotation
from explorer.numerics.arrays import BoolArray, FloatArray
from explorer.numerics.compiled import kernel

# Relative rounding of one operation.
EPSILON = 2.0**-52
# Number of roundings, magnified by the design, within which a discriminant counts as zero.
ROUNDINGS = 32.0
# Share of the largest length that is as good as zero, and whose square does not underflow.
NEGLIGIBLE = 1e-150


@kernel("void(f8[::1], f8[:,::1], f8[:,:,::1], f8[:,:,:,::1], b1[::1], f8[:,::1])")
def solve_rows(
    variables: FloatArray,
    joints: FloatArray,
    positions: FloatArray,
    rotations: FloatArray,
    feasible: BoolArray,
    discriminants: FloatArray,
) -> None:
    """Solve the forward kinematics of each row of joints.

    Joints that do not close yield poses in which each cosine beyond ±1 is ±1: finite and rigid, but
    with other joints.

    Args:
        variables: Design variables X, shape (6,).
        joints: (l1, d1, d2, d3, d4, l4), shape (n, 6).
        positions: Output, b4 in the base frame, shape (n, 8, 3).
        rotations: Output, platform to base, shape (n, 8, 3, 3).
        feasible: Output, whether the joints close, shape (n,).
        discriminants: Output, δ1², δ2², δ3², shape (n, 3); some negative number where a
            trilateration fails.
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

        # h and g are the distances of b4 from the guide and of a1 from the line b2b3.
        span = b3 - b2
        c = (d3 - d1) / span
        sine_square = (1.0 - c) * (1.0 + c)
        px = d1 - b2 * c
        t = -b2 / span
        h_square = (1.0 - t) * d2 * d2 + t * d4 * d4 - t * (1.0 - t) * span * span * sine_square
        lean = (d4 * d4 - d2 * d2 - (b3 + b2) * span * sine_square) / (2.0 * span)
        along = c * px + lean
        r_square = px * px + h_square
        g_square = r_square - along * along
        py = ((px - a3x) * (px - a3x) + h_square + a3y * a3y - l4 * l4) / (2.0 * a3y)
        across = (l1 * l1 - r_square - b1x * b1x - b1y * b1y - 2.0 * b1x * along) / (2.0 * b1y)

        square1 = g_square - across * across
        square2 = sine_square * h_square - lean * lean
        if sine_square < 0.0 or h_square < 0.0:
            square2 = min(square2, sine_square, h_square)
        square3 = h_square - py * py
        zero = ROUNDINGS * EPSILON / (abs(span) * min(abs(a3y), abs(b1y)))
        feasible[row] = min(square1, square2, square3) >= -zero
        discriminants[row, 0] = square1 * scale * scale
        discriminants[row, 1] = square2 * scale * scale
        discriminants[row, 2] = square3 * scale * scale

        # Where a cosine is beyond ±1, the fold is flat. Undefined ones are 0.
        c = min(1.0, max(-1.0, c))
        h = math.sqrt(max(0.0, h_square))
        r = math.sqrt(px * px + h * h)
        cos_b, sin_b = (px / r, h / r) if r > NEGLIGIBLE else (1.0, 0.0)
        cos_e = min(1.0, max(-1.0, along / r)) if r > NEGLIGIBLE else c
        sin_e = math.sqrt((1.0 - cos_e) * (1.0 + cos_e))
        cos2 = (cos_b * cos_e - c) / (sin_b * sin_e) if sin_b * sin_e > 0.0 else 1.0
        if abs(cos2) >= 1.0:
            # The lines are in one plane, so that ε follows from β and the angle between them.
            cos2 = math.copysign(1.0, cos2)
            sine = math.sqrt((1.0 - c) * (1.0 + c))
            sine = math.copysign(sine, sin_b * cos_e + cos2 * cos_b * sin_e)
            cos_e = cos_b * c + sin_b * sine
            sin_e = cos2 * (cos_b * sine - sin_b * c)
        cos1 = min(1.0, max(-1.0, -across / (r * sin_e))) if r * sin_e > 0.0 else 1.0
        cos3 = min(1.0, max(-1.0, py / h)) if h > 0.0 else 1.0
        sin1 = math.sqrt((1.0 - cos1) * (1.0 + cos1))
        sin2 = math.sqrt((1.0 - cos2) * (1.0 + cos2))
        sin3 = math.sqrt((1.0 - cos3) * (1.0 + cos3))
        angles = (cos_b, sin_b), (cos_e, sin_e)
        for mode in range(8):
            folds = (
                (cos1, sin1 if mode & 4 else -sin1),
                (cos2, sin2 if mode & 2 else -sin2),
                (cos3, sin3 if mode & 1 else -sin3),
            )
            positions[row, mode, 0] = px * scale
            positions[row, mode, 1] = h * cos3 * scale
            positions[row, mode, 2] = h * folds[2][1] * scale
            write_rotation(angles, folds, rotations[row, mode])
