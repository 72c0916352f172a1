/* The component over n rows of world coordinates, X to C, and joints; the results are 0 or -1. */
#include "flagged44kins.c"

void inverse_rows(long n, const double (*worlds)[6], double (*joints)[6], int *results)
{
    update_state();
    for (long k = 0; k < n; k++) {
        const double *w = worlds[k];
        const EmcPose pose = {{w[0], w[1], w[2]}, w[3], w[4], w[5], 0.0, 0.0, 0.0};
        const KINEMATICS_INVERSE_FLAGS inverse = 0;
        KINEMATICS_FORWARD_FLAGS forward = 0;
        results[k] = kinematicsInverse(&pose, joints[k], &inverse, &forward);
    }
}

/* Worlds are those before, then those of the joints. */
void forward_rows(long n, const double (*joints)[6], double (*worlds)[6], int *results)
{
    update_state();
    for (long k = 0; k < n; k++) {
        double *w = worlds[k];
        EmcPose pose = {{w[0], w[1], w[2]}, w[3], w[4], w[5], 0.0, 0.0, 0.0};
        const KINEMATICS_FORWARD_FLAGS forward = 0;
        KINEMATICS_INVERSE_FLAGS inverse = 0;
        results[k] = kinematicsForward(joints[k], &pose, &forward, &inverse);
        const double now[6] = {pose.tran.x, pose.tran.y, pose.tran.z, pose.a, pose.b, pose.c};
        memcpy(w, now, sizeof now);
    }
}
