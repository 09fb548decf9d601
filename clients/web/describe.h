// The tools in a daemon's answer to DESCRIBE. Pure functions, any thread.
#ifndef PLIANT_WEB_DESCRIBE_H
#define PLIANT_WEB_DESCRIBE_H

#include <stdbool.h>

enum { DESCRIBE_TOOLS = 32, DESCRIBE_CAPSULES = 8 };

typedef struct DescribedCapsule {
    double from[3], to[3], radius; // tool frame [m]
} DescribedCapsule;

typedef struct DescribedTool {
    int id;
    char kind[16]; // "probe", "blade", "grasper", "static"
    bool has_force, has_edge, has_plane;
    double max_force; // [N]
    int capsules;
    DescribedCapsule capsule[DESCRIBE_CAPSULES];
    double edge[2][3];          // tool frame [m]
    double point[3], normal[3]; // of a static plane, world frame [m]
} DescribedTool;

// Reads the tools; ignores other lines, and tools beyond DESCRIBE_TOOLS. Returns their number.
int describe_tools(const char *text, DescribedTool tool[DESCRIBE_TOOLS]);

#endif
