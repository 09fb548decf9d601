// The tools in a daemon's answer to DESCRIBE. Pure functions, any thread.
#include "describe.h"

#include <math.h>
#include <stdio.h>
#include <string.h>

enum { LINE_BYTES = 512 };

static bool all_finite(const double *number, int count)
{
    for (int k = 0; k < count; k++) {
        if (!isfinite(number[k]))
            return false;
    }
    return true;
}

// Reads "tool 1: probe, 1 capsules, max_force 5 N".
static bool read_tool(const char *line, DescribedTool *tool)
{
    *tool = (DescribedTool){0};
    if (sscanf(line, "tool %d: %15[a-z]", &tool->id, tool->kind) != 2)
        return false;
    const char *force = strstr(line, "max_force ");
    tool->has_force = force && sscanf(force, "max_force %lf N", &tool->max_force) == 1 &&
                      isfinite(tool->max_force);
    return true;
}

// Reads an indented line below a tool's.
static void read_part(const char *line, DescribedTool *tool)
{
    DescribedCapsule c;
    if (sscanf(line, " capsule [%lf, %lf, %lf] to [%lf, %lf, %lf], radius %lf m", &c.from[0],
               &c.from[1], &c.from[2], &c.to[0], &c.to[1], &c.to[2], &c.radius) == 7) {
        if (tool->capsules < DESCRIBE_CAPSULES && all_finite(c.from, 3) && all_finite(c.to, 3) &&
            isfinite(c.radius))
            tool->capsule[tool->capsules++] = c;
        return;
    }
    double n[6];
    if (sscanf(line, " edge [%lf, %lf, %lf] to [%lf, %lf, %lf] m", &n[0], &n[1], &n[2], &n[3],
               &n[4], &n[5]) == 6 &&
        all_finite(n, 6)) {
        memcpy(tool->edge, n, sizeof tool->edge);
        tool->has_edge = true;
    }
    if (sscanf(line, " plane [%lf, %lf, %lf] m, normal [%lf, %lf, %lf]", &n[0], &n[1], &n[2], &n[3],
               &n[4], &n[5]) == 6 &&
        all_finite(n, 6)) {
        memcpy(tool->point, n, sizeof tool->point);
        memcpy(tool->normal, n + 3, sizeof tool->normal);
        tool->has_plane = true;
    }
}

int describe_tools(const char *text, DescribedTool tool[DESCRIBE_TOOLS])
{
    int count = 0;
    bool within = false; // inside the lines of the newest tool
    while (*text) {
        size_t length = strcspn(text, "\n");
        char line[LINE_BYTES];
        size_t kept = length < sizeof line ? length : sizeof line - 1;
        memcpy(line, text, kept);
        line[kept] = '\0';
        text += length + (text[length] == '\n');
        if (line[0] == ' ') {
            if (within)
                read_part(line, &tool[count - 1]);
            continue;
        }
        within = count < DESCRIBE_TOOLS && read_tool(line, &tool[count]);
        count += within;
    }
    return count;
}
