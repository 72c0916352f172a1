"""The nearest poses in which a1 or b4 lies on the plane of the other flag, exactly.

For a given rotation the best translation is the shortest one to the plane, of signed length x.
The rest is to minimise F(D) = x(D)² − 2 tr(D M) over the rotations D from the given pose. Both x
and tr are linear in D, hence quadratic forms of a unit quaternion q. Two such forms have a
convex joint range (Brickman 1961), so the dual problem is exact: to maximise over s

    g(s) = −s² − 2 λ(s),    λ(s) the largest eigenvalue of N_M − s N_x,

which is concave, with g'(s) = 2 (x(q(s)) − s). The root lies between 0 and the x of the given
rotation. If two eigenvalues are equal at the root there are two nearest poses or more, and one
of them is the combination of their quaternions at which x = s.
"""

from __future__ import annotations

import math

from explorer.numerics.arrays import FloatArray
from explorer.numerics.compiled import helper

Quaternion = tuple[float, float, float, float]

ROOT_STEPS = 200
SWEEPS = 20
EPSILON = 2.0**-52


@helper
def write_form(s: FloatArray, out: FloatArray) -> None:
    """Write the N with qᵀ N q = Σ D_ij s_ij, where D is the rotation of q = (w, x, y, z)."""
    out[0, 0] = s[0, 0] + s[1, 1] + s[2, 2]
    out[1, 1] = s[0, 0] - s[1, 1] - s[2, 2]
    out[2, 2] = s[1, 1] - s[0, 0] - s[2, 2]
    out[3, 3] = s[2, 2] - s[0, 0] - s[1, 1]
    out[0, 1] = out[1, 0] = s[2, 1] - s[1, 2]
    out[0, 2] = out[2, 0] = s[0, 2] - s[2, 0]
    out[0, 3] = out[3, 0] = s[1, 0] - s[0, 1]
    out[1, 2] = out[2, 1] = s[0, 1] + s[1, 0]
    out[1, 3] = out[3, 1] = s[0, 2] + s[2, 0]
    out[2, 3] = out[3, 2] = s[1, 2] + s[2, 1]


@helper
def diagonalise(a: FloatArray, v: FloatArray) -> int:
    """Diagonalise a symmetric matrix a (4, 4) in place by Jacobi's rotations.

    Writes the eigenvectors into the columns of v; returns the index of the largest eigenvalue.
    """
    for i in range(4):
        for j in range(4):
            v[i, j] = 1.0 if i == j else 0.0
    for _ in range(SWEEPS):
        rest = 0.0
        for i in range(3):
            for j in range(i + 1, 4):
                small = abs(a[i, j])
                if small <= 0.01 * EPSILON * (abs(a[i, i]) + abs(a[j, j])):
                    continue
                rest += small
                half = 0.5 * (a[j, j] - a[i, i])
                t = a[i, j] / (half + math.copysign(math.hypot(half, a[i, j]), half))
                c = 1.0 / math.sqrt(1.0 + t * t)
                s = t * c
                for k in range(4):
                    x, y = a[k, i], a[k, j]
                    a[k, i], a[k, j] = c * x - s * y, s * x + c * y
                for k in range(4):
                    x, y = a[i, k], a[j, k]
                    a[i, k], a[j, k] = c * x - s * y, s * x + c * y
                    x, y = v[k, i], v[k, j]
                    v[k, i], v[k, j] = c * x - s * y, s * x + c * y
                a[i, j] = a[j, i] = 0.0
        if rest == 0.0:
            break
    best = 0
    for k in range(1, 4):
        if a[k, k] > a[best, best]:
            best = k
    return best


@helper
def bilinear(q: Quaternion, form: FloatArray, r: Quaternion) -> float:
    """Return qᵀ N r, where N is the matrix `form`, shape (4, 4)."""
    total = 0.0
    for i in range(4):
        total += q[i] * (
            form[i, 0] * r[0] + form[i, 1] * r[1] + form[i, 2] * r[2] + form[i, 3] * r[3]
        )
    return total


@helper
def combine(low: Quaternion, high: Quaternion, form: FloatArray, value: float) -> Quaternion:
    """Return the unit quaternion between two at which a form has a value between theirs."""
    a, c = bilinear(low, form, low) - value, bilinear(high, form, high) - value
    dot = low[0] * high[0] + low[1] * high[1] + low[2] * high[2] + low[3] * high[3]
    # Their signs are free; combinations of opposite quaternions would vanish.
    sign = -1.0 if dot < 0.0 else 1.0
    b = sign * (bilinear(low, form, high) - value * dot)
    if a < 0.0 or c > 0.0:
        a, b, c = -a, -b, -c
    # a (1 − t)² + 2 b (1 − t) t + c t² = 0 has one root between 0 and 1.
    root = math.sqrt(max(0.0, b * b - a * c))
    over = a - b + root
    t = a / over if over > 0.0 else 0.5
    if not 0.0 <= t <= 1.0:
        t = 0.5
    w = (1.0 - t) * low[0] + sign * t * high[0]
    x = (1.0 - t) * low[1] + sign * t * high[1]
    y = (1.0 - t) * low[2] + sign * t * high[2]
    z = (1.0 - t) * low[3] + sign * t * high[3]
    norm = math.sqrt(w * w + x * x + y * y + z * z)
    return (w / norm, x / norm, y / norm, z / norm)


@helper
def nearest_quaternion(
    scatter: FloatArray, form: FloatArray, constant: float, work: FloatArray, vectors: FloatArray
) -> tuple[Quaternion, float]:
    """Return the unit q that minimises (constant + qᵀ N_x q)² − 2 qᵀ N_M q, and a lower bound.

    `scatter` is N_M, whose form alone is largest at the identity, and `form` is N_x; the last two
    arguments are working space. All matrices are of shape (4, 4).
    """
    still = (1.0, 0.0, 0.0, 0.0)
    # With the sign of x at rest, x − s is positive at `low` and negative at `high`.
    at_rest = constant + form[0, 0]
    sign = -1.0 if at_rest < 0.0 else 1.0
    low, high = 0.0, abs(at_rest)
    below, above = still, still
    has_above = False
    s, q, bound = 0.0, still, -math.inf
    for _ in range(ROOT_STEPS):
        for i in range(4):
            for j in range(4):
                work[i, j] = scatter[i, j] - sign * s * form[i, j]
        top = diagonalise(work, vectors)
        q = (vectors[0, top], vectors[1, top], vectors[2, top], vectors[3, top])
        bound = max(bound, 2.0 * sign * s * constant - s * s - 2.0 * work[top, top])
        off = sign * (constant + bilinear(q, form, q)) - s
        if off >= 0.0:
            low, below = s, q
        else:
            high, above, has_above = s, q, True
        if off == 0.0:
            return q, bound
        slope = -1.0
        for k in range(4):
            gap = work[top, top] - work[k, k]
            if k != top and gap > 0.0:
                other = (vectors[0, k], vectors[1, k], vectors[2, k], vectors[3, k])
                across = bilinear(other, form, q)
                slope -= 2.0 * across * across / gap
        step = -off / slope
        if abs(step) <= EPSILON * s and s > 0.0:
            return q, bound
        following = s + step
        if not low < following < high:
            following = 0.5 * (low + high)
            if following in (low, high):
                break
        s = following
    # The eigenvector is discontinuous here: the two largest eigenvalues are equal.
    if has_above:
        q = combine(below, above, form, sign * 0.5 * (low + high) - constant)
    return q, bound


@helper
def write_turned(rotation: FloatArray, q: Quaternion, out: FloatArray) -> None:
    """Write the product of a rotation (3, 3) and the rotation of a unit quaternion."""
    w, x, y, z = q
    for i in range(3):
        a, b, c = rotation[i, 0], rotation[i, 1], rotation[i, 2]
        out[i, 0] = a + 2.0 * (b * (x * y + w * z) + c * (x * z - w * y) - a * (y * y + z * z))
        out[i, 1] = b + 2.0 * (a * (x * y - w * z) + c * (y * z + w * x) - b * (x * x + z * z))
        out[i, 2] = c + 2.0 * (a * (x * z + w * y) + b * (y * z - w * x) - c * (x * x + y * y))
