/* Move the platform straight up from home as a controller does: the joints of each step, and a stop
 * before the first pose that breaks a limit.
 *
 *     explorer export kernel --out controller
 *     cc -std=c99 -I controller kernel.c controller/flagged44.c -lm && ./a.out
 */
#include "flagged44.h"
#include <math.h>
#include <stdio.h>

int main(void)
{
    /* Joints (l1, d1, d2, d3, d4, l4) of the paper's optimum near home, in mm; mode 1 is home's. */
    const double start[6] = {117.36, 107.58, 93.42, 114.27, 90.05, 130.13};
    double positions[8][3], rotations[8][9], joints[6], margins[3];
    if (f44_forward(start, positions, rotations) == 0) {
        puts("the lengths do not close");
        return 1;
    }
    double *position = positions[1], *rotation = rotations[1];
    const double step = 0.5;
    int steps = 0;
    unsigned broken;
    while ((broken = f44_limits(position, rotation)) == 0) {
        f44_inverse(position, rotation, joints);
        if (steps++ % 50 == 0)
            printf("z = %6.2f mm: l1 = %.3f, d2 = %.3f, d4 = %.3f, l4 = %.3f mm\n",
                   position[2], joints[0], joints[2], joints[4], joints[5]);
        position[2] += step;
    }
    f44_margins(position, rotation, margins);
    printf("stop below z = %.1f mm, where limits %#x break; mode %d, smallest margin %.1f mm\n",
           position[2], broken, f44_mode(margins),
           fmin(fabs(margins[0]), fmin(fabs(margins[1]), fabs(margins[2]))));
    return 0;
}
