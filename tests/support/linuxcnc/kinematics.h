/* What the component takes of LinuxCNC, and of what halcompile puts before it. */
#include <stdio.h>

typedef struct {
    struct {
        double x, y, z;
    } tran;
    double a, b, c, u, v, w;
} EmcPose;

typedef unsigned long KINEMATICS_FORWARD_FLAGS, KINEMATICS_INVERSE_FLAGS;
typedef enum { KINEMATICS_BOTH = 4 } KINEMATICS_TYPE;

/* The latest message. */
char message[600];

#define rtapi_print_msg(level, ...) snprintf(message, sizeof message, __VA_ARGS__)
#define EXPORT_SYMBOL(name) extern int exported_##name
#define KINS_NOT_SWITCHABLE
