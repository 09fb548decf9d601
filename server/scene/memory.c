// SPDX-License-Identifier: MIT
// The memory left on the machine, and that of bodies. Called at load time, once or twice per body.
#include "scene/build_parts.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/resource.h>
#include <unistd.h>

// --- available -----------------------------------------------------------------------------------

// Returns the number after a key of a file, in units of `unit` bytes; NaN: missing.
static double read_key(const char *path, const char *key, double unit)
{
    char line[256];
    double value = nan("");
    FILE *file = fopen(path, "r");
    while (file != NULL && fgets(line, sizeof line, file) != NULL)
        if (strncmp(line, key, strlen(key)) == 0)
            value = strtod(line + strlen(key), NULL) * unit;
    if (file != NULL)
        fclose(file);
    return value;
}

// Returns the only number of a file of the control group; NaN: none, or "max".
static double read_group(const char *folder, const char *name)
{
    char path[600], line[64], *end;
    snprintf(path, sizeof path, "/sys/fs/cgroup%s/%s", folder, name);
    FILE *file = fopen(path, "r");
    double value = nan("");
    if (file != NULL && fgets(line, sizeof line, file) != NULL) {
        value = strtod(line, &end);
        value = end != line ? value : nan("");
    }
    if (file != NULL)
        fclose(file);
    return value;
}

// Returns what the control group has left. Its file cache counts as used but can be dropped.
static double group_free(void)
{
    char line[512], folder[512] = "", stat[600];
    FILE *file = fopen("/proc/self/cgroup", "r");
    while (file != NULL && fgets(line, sizeof line, file) != NULL)
        if (strncmp(line, "0::", 3) == 0)
            snprintf(folder, sizeof folder, "%.*s", (int)strcspn(line + 3, "\n"), line + 3);
    if (file != NULL)
        fclose(file);
    snprintf(stat, sizeof stat, "/sys/fs/cgroup%s/memory.stat", folder);
    return read_group(folder, "memory.max") - read_group(folder, "memory.current") +
           read_key(stat, "inactive_file ", 1.0) + read_key(stat, "active_file ", 1.0);
}

static double limit_free(int resource, const char *key)
{
    struct rlimit limit;
    if (getrlimit(resource, &limit) != 0 || limit.rlim_cur == RLIM_INFINITY)
        return nan("");
    return (double)limit.rlim_cur - read_key("/proc/self/status", key, 1024.0);
}

double memory_free(void)
{
    // fmin ignores the unknown values, which are NaN.
    double least = read_key("/proc/meminfo", "MemAvailable:", 1024.0) +
                   read_key("/proc/meminfo", "SwapFree:", 1024.0);
    least = fmin(least, group_free());
    least = fmin(least, limit_free(RLIMIT_AS, "VmSize:"));
    least = fmin(least, limit_free(RLIMIT_DATA, "VmData:"));
    return isnan(least) ? HUGE_VAL : fmax(least, 0.0);
}

// --- required ------------------------------------------------------------------------------------

static bool check(const char *what, double count, double bytes, Status *status)
{
    double have = memory_free();
    return bytes <= have ||
           status_fail(status, STATUS_INVALID,
                       "%.0f %s need at least %.2g GB of memory, and %.2g GB are free; fewer "
                       "levels, a coarser mesh or larger cells take less",
                       count, what, bytes / 1e9, have / 1e9);
}

bool memory_check_surface(const SceneBody *body, double nodes, Status *status)
{
    // Bytes per node at the finest level, a tenth less than the smallest measured, for bodies that
    // stay as they are, that refine and coarsen, and that can be cut.
    enum { FIXED = 580, CHANGING = 1900, CUTTABLE = 2500, A_COPY = 100, HIERARCHY = 140 };
    const SurfaceOptions *surface = &body->surface;
    bool changes = surface_changes(surface);
    double start = nodes * pow(4.0, surface->start_level);
    double finest = nodes * pow(4.0, surface->body.levels);
    if (!changes) // the levels are built in any case
        return check(surface->body.levels > 0 ? "nodes at the finest level" : "nodes", finest,
                     start * FIXED + (surface->body.levels > 0 ? finest * HIERARCHY : 0.0), status);
    double each = surface->body.node_capacity > 0 ? FIXED
                  : surface->body.cuttable        ? CUTTABLE
                                                  : CHANGING;
    double copies = surface->body.cuttable ? fmax(surface->body.node_capacity - finest, 0.0) : 0.0;
    return check("nodes at the finest level", finest + copies, finest * each + copies * A_COPY,
                 status);
}

bool memory_check_voxel(const SceneBody *body, double cells, Status *status)
{
    // Bytes per cell, found in the same way; levels save most of the inner cells. Capacities that
    // the scene sets explicitly count as they are.
    enum { FINE = 300, LEVELED = 60, CUTTABLE = 2300, FIBRES = 300, A_VERTEX = 100 };
    const VoxelOptions *voxel = &body->voxel;
    // A body that adapts is stored as one that can be cut.
    const bool changes = voxel->body.cuttable || voxel->surface_level > 0;
    if (changes && voxel->body.node_capacity > 0)
        return check("nodes (capacity)", voxel->body.node_capacity,
                     fmax(cells * LEVELED, (double)voxel->body.node_capacity * A_VERTEX), status);
    double each = changes ? CUTTABLE : voxel->body.levels == 0 ? FINE : LEVELED;
    for (int i = 0; i < voxel->material_count && changes; i++)
        if (body->material[i].prestress > 0.0) {
            each += FIBRES;
            break;
        }
    return check("cells", cells, cells * each, status);
}

double memory_source_nodes(const MeshSource *source)
{
    switch (source->kind) {
    case MESH_FILE:
        return 0.0;
    case MESH_UV_SPHERE:
        return 2.0 + (double)source->rings * source->segments;
    case MESH_SHEET:
        return (double)source->columns * source->rows;
    default:
        return source->nodes;
    }
}
