/* The forward kinematics that controllers of hexapods use today, as LinuxCNC's genhexkins describes
 * it, written anew: Newton's iteration on the six lengths, from the last pose to the next one. The
 * hexapod is the 6-4 twin, whose six legs hold the platform as the four legs of the joints do. */
#include <math.h>
#include <string.h>

enum { LEGS = 6, MOST_ITERATIONS = 100 };
static const double CLOSED = 1e-9;

/* The twin: base and platform ends of its legs. */
struct twin {
    double base[LEGS][3], platform[LEGS][3];
};

/* points: a2x, a3x, a3y, b1x, b1y, b2, b3 */
static struct twin twin_of(const double points[7])
{
    const double a[4][2] = {{0, 0}, {0, 0}, {points[0], 0}, {points[1], points[2]}};
    const double b[5][2] = {{0, 0}, {points[3], points[4]}, {points[5], 0}, {points[6], 0}, {0, 0}};
    static const int from[LEGS] = {1, 1, 1, 2, 2, 3}, to[LEGS] = {1, 2, 3, 2, 3, 4};
    struct twin twin;
    memset(&twin, 0, sizeof twin);
    for (int leg = 0; leg < LEGS; leg++)
        for (int i = 0; i < 2; i++) {
            twin.base[leg][i] = a[from[leg]][i];
            twin.platform[leg][i] = b[to[leg]][i];
        }
    return twin;
}

/* Solve six linear equations, rows[k] with the right side in its last place. */
static int solve(double rows[6][7], double x[6])
{
    for (int k = 0; k < 6; k++) {
        int pivot = k;
        for (int i = k + 1; i < 6; i++)
            if (fabs(rows[i][k]) > fabs(rows[pivot][k]))
                pivot = i;
        if (!(fabs(rows[pivot][k]) > 1e-300))
            return 0;
        for (int j = k; j < 7; j++) {
            const double swapped = rows[k][j];
            rows[k][j] = rows[pivot][j];
            rows[pivot][j] = swapped;
        }
        for (int i = k + 1; i < 6; i++) {
            const double factor = rows[i][k] / rows[k][k];
            for (int j = k; j < 7; j++)
                rows[i][j] -= factor * rows[k][j];
        }
    }
    for (int k = 5; k >= 0; k--) {
        x[k] = rows[k][6];
        for (int j = k + 1; j < 6; j++)
            x[k] -= rows[k][j] * x[j];
        x[k] /= rows[k][k];
    }
    return 1;
}

/* Turn a rotation by a rotation vector along the axes of the base. */
static void turn(const double vector[3], double r[9])
{
    const double angle =
        sqrt(vector[0] * vector[0] + vector[1] * vector[1] + vector[2] * vector[2]);
    const double s = angle > 1e-12 ? sin(angle) / angle : 1.0;
    const double v = angle > 1e-6 ? (1.0 - cos(angle)) / (angle * angle) : 0.5;
    for (int j = 0; j < 3; j++) {
        const double c[3] = {r[j], r[3 + j], r[6 + j]};
        const double along = vector[0] * c[0] + vector[1] * c[1] + vector[2] * c[2];
        for (int i = 0; i < 3; i++) {
            const int k = (i + 1) % 3, l = (i + 2) % 3;
            r[3 * i + j] = c[i] * (1.0 - v * angle * angle)
                + s * (vector[k] * c[l] - vector[l] * c[k]) + v * along * vector[i];
        }
    }
}

/* Move a pose to where the six legs have their lengths; return the iterations, or 0. */
static int iterate(const struct twin *twin, const double lengths[LEGS], double p[3], double r[9])
{
    for (int iteration = 1; iteration <= MOST_ITERATIONS; iteration++) {
        double rows[6][7], step[6], worst = 0.0;
        for (int leg = 0; leg < LEGS; leg++) {
            double arm[3], along[3], square = 0.0;
            for (int i = 0; i < 3; i++) {
                arm[i] = r[3 * i] * twin->platform[leg][0] + r[3 * i + 1] * twin->platform[leg][1];
                along[i] = p[i] + arm[i] - twin->base[leg][i];
                square += along[i] * along[i];
            }
            const double length = sqrt(square);
            for (int i = 0; i < 3; i++) {
                const int k = (i + 1) % 3, l = (i + 2) % 3;
                rows[leg][i] = along[i] / length;
                rows[leg][3 + i] = (arm[k] * along[l] - arm[l] * along[k]) / length;
            }
            rows[leg][6] = lengths[leg] - length;
            worst = fmax(worst, fabs(rows[leg][6]));
        }
        if (worst <= CLOSED)
            return iteration;
        if (!solve(rows, step))
            return 0;
        for (int i = 0; i < 3; i++)
            p[i] += step[i];
        turn(step + 3, r);
    }
    return 0;
}

void newton_rows(long n, const double (*joints)[6], const double points[7], double (*p)[3],
                 double (*r)[9], int *iterations)
{
    const struct twin twin = twin_of(points);
    for (long k = 0; k < n; k++) {
        const double *q = joints[k];
        const double lengths[LEGS] = {
            q[0], sqrt(q[1] * q[1] + q[2] * q[2]), sqrt(q[3] * q[3] + q[4] * q[4]),
            sqrt((q[1] - points[0]) * (q[1] - points[0]) + q[2] * q[2]),
            sqrt((q[3] - points[0]) * (q[3] - points[0]) + q[4] * q[4]), q[5],
        };
        iterations[k] = iterate(&twin, lengths, p[k], r[k]);
    }
}
