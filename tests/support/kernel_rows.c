/* The functions of flagged44.h over n rows, for tests and benchmarks. */
#include "flagged44.h"

void inverse_rows(long n, const double (*p)[3], const double (*r)[9], double (*joints)[6])
{
    for (long k = 0; k < n; k++)
        f44_inverse(p[k], r[k], joints[k]);
}

void forward_rows(long n, const double (*joints)[6], double (*p)[8][3], double (*r)[8][9],
                  int *modes)
{
    for (long k = 0; k < n; k++)
        modes[k] = f44_forward(joints[k], p[k], r[k]);
}

void margin_rows(long n, const double (*p)[3], const double (*r)[9], double (*margins)[3],
                 int *modes)
{
    for (long k = 0; k < n; k++) {
        f44_margins(p[k], r[k], margins[k]);
        modes[k] = f44_mode(margins[k]);
    }
}

void fold_rows(long n, const double (*p)[3], const double (*r)[9], double (*folds)[6])
{
    for (long k = 0; k < n; k++)
        f44_folds(p[k], r[k], folds[k]);
}

void jacobian_rows(long n, const double (*p)[3], const double (*r)[9], double (*rows)[36])
{
    for (long k = 0; k < n; k++)
        f44_jacobian(p[k], r[k], rows[k]);
}

void limit_rows(long n, const double (*p)[3], const double (*r)[9], unsigned *broken)
{
    for (long k = 0; k < n; k++)
        broken[k] = f44_limits(p[k], r[k]);
}

/* The machine has the deviations with which the kernel was exported. */
void built_inverse_rows(long n, const double (*p)[3], const double (*r)[9], double (*joints)[6])
{
    struct f44_machine machine;
    f44_build(F44_DEVIATIONS, &machine);
    for (long k = 0; k < n; k++)
        f44_built_inverse(&machine, p[k], r[k], joints[k]);
}

void built_forward_rows(long n, const double (*joints)[6], const int *modes, double (*p)[3],
                        double (*r)[9], int *closes)
{
    struct f44_machine machine;
    f44_build(F44_DEVIATIONS, &machine);
    for (long k = 0; k < n; k++)
        closes[k] = f44_built_forward(&machine, joints[k], modes[k], p[k], r[k]);
}
