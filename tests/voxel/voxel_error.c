// SPDX-License-Identifier: MIT
#include "voxel_error.h"

#include "base/check.h"
#include "sim_steps.h"
#include "voxel/model.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#define PRESS(r, x, y, top, depth)                                                                 \
    {                                                                                              \
        {                                                                                          \
            .radius = (r), .from = {(x), (y), (top) + (r)},                                        \
            .to = {(x), (y), (top) + (r) - (depth)}, .on = {                                       \
                (x),                                                                               \
                (y),                                                                               \
                (top) + (r) - (depth)                                                              \
            }                                                                                      \
        }                                                                                          \
    }
#define DRAG(r, x, y, top, depth, way)                                                             \
    {                                                                                              \
        {                                                                                          \
            .radius = (r), .from = {(x), (y), (top) + (r)},                                        \
            .to = {(x), (y), (top) + (r) - (depth)}, .on = {                                       \
                (x) + (way),                                                                       \
                (y),                                                                               \
                (top) + (r) - (depth)                                                              \
            }                                                                                      \
        }                                                                                          \
    }
#define BLOCK(n, s) .shape = SHAPE_BLOCK, .count = {n, n, n}, .size = (s)

const ErrorScene ERROR_SCENES[] = {
    {"block press shallow", .truth = 0.1156, .force_truth = -0.0850, BLOCK(12, 0.1 / 12),
     .hold = HOLD_BOTTOM, .poisson = 0.3, .tool = PRESS(0.02, 0, 0, 0.05, 0.004)},
    {"block press medium", .truth = 0.0525, .force_truth = 0.0001, BLOCK(12, 0.1 / 12),
     .hold = HOLD_BOTTOM, .poisson = 0.3, .tool = PRESS(0.02, 0, 0, 0.05, 0.010)},
    {"block press deep", .truth = 0.0584, .force_truth = -0.0026, BLOCK(12, 0.1 / 12),
     .hold = HOLD_BOTTOM, .poisson = 0.3, .tool = PRESS(0.02, 0, 0, 0.05, 0.016)},
    {"block press nu 0", .truth = 0.1151, .force_truth = 0.0885, BLOCK(12, 0.1 / 12),
     .hold = HOLD_BOTTOM, .poisson = 0.0, .tool = PRESS(0.02, 0, 0, 0.05, 0.010)},
    {"block press nu 0.45", .truth = 0.0924, .force_truth = -0.0721, BLOCK(12, 0.1 / 12),
     .hold = HOLD_BOTTOM, .poisson = 0.45, .tool = PRESS(0.02, 0, 0, 0.05, 0.008)},
    {"block press big ball", .truth = 0.0299, .force_truth = -0.0001, BLOCK(12, 0.1 / 12),
     .hold = HOLD_BOTTOM, .poisson = 0.3, .tool = PRESS(0.04, 0, 0, 0.05, 0.010)},
    {"block press small ball", .truth = 0.5354, .force_truth = -0.0980, BLOCK(12, 0.1 / 12),
     .hold = HOLD_BOTTOM, .poisson = 0.3, .tool = PRESS(0.01, 0.003, 0.002, 0.05, 0.006)},
    {"block press ball of 1.8 cells", .truth = 0.1562, .force_truth = -0.0277, BLOCK(12, 0.1 / 12),
     .hold = HOLD_BOTTOM, .poisson = 0.3, .tool = PRESS(0.015, 0.003, 0.002, 0.05, 0.007)},
    {"block drag sliding", .truth = 0.1631, .force_truth = -0.0176, BLOCK(12, 0.1 / 12),
     .hold = HOLD_BOTTOM, .poisson = 0.3, .friction = 0.1,
     .tool = DRAG(0.02, -0.01, 0, 0.05, 0.008, 0.02)},
    {"block press near edge", .truth = 0.0617, .force_truth = 0.0011, BLOCK(12, 0.1 / 12),
     .hold = HOLD_BOTTOM, .poisson = 0.3, .tool = PRESS(0.02, 0.035, 0.01, 0.05, 0.010)},
    {"block press coarse", .truth = 0.1679, .force_truth = -0.0629, BLOCK(8, 0.1 / 8),
     .hold = HOLD_BOTTOM, .poisson = 0.3, .tool = PRESS(0.02, 0.003, 0.001, 0.05, 0.010)},
    {"block press fine", .truth = 0.0463, .force_truth = -0.0178, .slow = true, BLOCK(16, 0.1 / 16),
     .hold = HOLD_BOTTOM, .poisson = 0.3, .tool = PRESS(0.02, 0.0, 0.001, 0.05, 0.010)},
    {"block press level 1", .truth = 0.0423, .force_truth = -0.0029, BLOCK(16, 0.1 / 16),
     .levels = 1, .hold = HOLD_BOTTOM, .poisson = 0.3,
     .tool = PRESS(0.02, 0.0, 0.001, 0.05, 0.010)},
    {"block press level 2", .truth = 0.0425, .force_truth = 0.0326, BLOCK(16, 0.1 / 16),
     .levels = 2, .hold = HOLD_BOTTOM, .poisson = 0.3,
     .tool = PRESS(0.03, 0.0, 0.001, 0.05, 0.016)},
    {"block press level 3", .truth = 0.0466, .force_truth = 0.0466, .slow = true,
     BLOCK(32, 0.1 / 32), .levels = 3, .hold = HOLD_BOTTOM, .poisson = 0.0,
     .tool = PRESS(0.03, 0.0, 0.001, 0.05, 0.016)},
    {"block press sides held", .truth = 0.0623, .force_truth = 0.0012, BLOCK(12, 0.1 / 12),
     .hold = HOLD_BOTH_ENDS, .poisson = 0.3, .tool = PRESS(0.02, 0, 0, 0.05, 0.012)},
    {"block two balls", .truth = 0.0883, .force_truth = -0.0566, BLOCK(12, 0.1 / 12),
     .hold = HOLD_BOTTOM, .poisson = 0.3,
     .tool = {{.radius = 0.015,
               .from = {-0.025, 0, 0.065},
               .to = {-0.025, 0, 0.057},
               .on = {-0.025, 0, 0.057}},
              {.radius = 0.015,
               .from = {0.025, 0, 0.065},
               .to = {0.025, 0, 0.055},
               .on = {0.025, 0, 0.055}}}},
    {"block capsule", .truth = 0.0782, .force_truth = -0.0318, BLOCK(12, 0.1 / 12),
     .hold = HOLD_BOTTOM, .poisson = 0.3,
     .tool = {{.radius = 0.01,
               .length = 0.05,
               .from = {0, 0, 0.06},
               .to = {0, 0, 0.052},
               .on = {0, 0, 0.052}}}},
    {"block drag", .truth = 0.0556, .force_truth = -0.0358, BLOCK(12, 0.1 / 12),
     .hold = HOLD_BOTTOM, .poisson = 0.3, .friction = 1.0,
     .tool = DRAG(0.02, -0.01, 0, 0.05, 0.008, 0.006)},
    {"block drag level 2", .truth = 0.0411, .force_truth = 0.0123, .slow = true,
     BLOCK(16, 0.1 / 16), .levels = 2, .hold = HOLD_BOTTOM, .poisson = 0.3, .friction = 1.0,
     .tool = DRAG(0.02, -0.01, 0.002, 0.05, 0.008, 0.006)},
    {"block gravity", .truth = 0.0069, BLOCK(10, 0.01), .hold = HOLD_BOTTOM, .poisson = 0.3,
     .gravity = 9.81},
    {"block pull load", .truth = 0.0492, BLOCK(12, 0.1 / 12), .hold = HOLD_BOTTOM, .poisson = 0.3,
     .load = {0, 0, 0.05, 0.021, 0, 0, 0.6}},
    {"block pull aside", .truth = 0.0182, BLOCK(12, 0.1 / 12), .hold = HOLD_BOTTOM, .poisson = 0.45,
     .load = {0, 0, 0.05, 0.021, 0.6, 0, 0.1}},
    {"block pull level 2", .truth = 0.0472, .slow = true, BLOCK(16, 0.1 / 16), .levels = 2,
     .hold = HOLD_BOTTOM, .poisson = 0.3, .load = {0, 0, 0.05, 0.021, 0, 0, 0.6}},
    {"block grasp up", .truth = 0.2687, .force_truth = 0.3356, BLOCK(12, 0.1 / 12),
     .hold = HOLD_BOTTOM, .poisson = 0.3,
     .tool = {{.radius = 0.015,
               .grasps = true,
               .from = {0, 0, 0.05},
               .to = {0, 0, 0.06},
               .on = {0, 0, 0.06}}}},
    {"block grasp aside", .truth = 0.0816, .force_truth = 0.0045, BLOCK(12, 0.1 / 12),
     .hold = HOLD_BOTTOM, .poisson = 0.3,
     .tool = {{.radius = 0.012,
               .grasps = true,
               .from = {0, 0, 0.05},
               .to = {0.01, 0, 0.053},
               .on = {0.01, 0, 0.053}}}},
    {"cantilever 1 thick", .truth = 0.0173, .shape = SHAPE_BLOCK, .count = {10, 1, 1}, .size = 0.01,
     .hold = HOLD_LEFT, .poisson = 0.3, .gravity = 0.8},
    {"cantilever 2 thick", .truth = 0.0213, .shape = SHAPE_BLOCK, .count = {16, 2, 2}, .size = 0.01,
     .hold = HOLD_LEFT, .poisson = 0.3, .gravity = 0.8},
    {"cantilever 4 thick", .truth = 0.0128, .shape = SHAPE_BLOCK, .count = {20, 4, 4}, .size = 0.01,
     .hold = HOLD_LEFT, .poisson = 0.3, .gravity = 2.0},
    {"cantilever nu 0", .truth = 0.0065, .shape = SHAPE_BLOCK, .count = {20, 4, 4}, .size = 0.01,
     .hold = HOLD_LEFT, .poisson = 0.0, .gravity = 2.0},
    {"cantilever nu 0.45", .truth = 0.0240, .shape = SHAPE_BLOCK, .count = {20, 4, 4}, .size = 0.01,
     .hold = HOLD_LEFT, .poisson = 0.45, .gravity = 2.0},
    {"cantilever levels", .truth = 0.0029, .slow = true, .shape = SHAPE_BLOCK, .count = {32, 8, 8},
     .size = 0.005, .levels = 2, .hold = HOLD_LEFT, .poisson = 0.3, .gravity = 3.0},
    {"cantilever far bent", .truth = 0.0170, .shape = SHAPE_BLOCK, .count = {20, 3, 3},
     .size = 0.01, .hold = HOLD_LEFT, .poisson = 0.3, .gravity = 3.5},
    {"plate 1 thick press", .truth = 0.0763, .force_truth = -0.0299, .shape = SHAPE_BLOCK,
     .count = {16, 16, 1}, .size = 0.00625, .hold = HOLD_BOTH_ENDS, .poisson = 0.3,
     .tool = PRESS(0.02, 0, 0, 0.003125, 0.008)},
    {"plate 2 thick press", .truth = 0.0449, .force_truth = -0.0635, .shape = SHAPE_BLOCK,
     .count = {16, 16, 2}, .size = 0.00625, .hold = HOLD_BOTH_ENDS, .poisson = 0.3,
     .tool = PRESS(0.02, 0, 0, 0.00625, 0.008)},
    {"plate sag", .truth = 0.0330, .shape = SHAPE_BLOCK, .count = {16, 16, 2}, .size = 0.00625,
     .hold = HOLD_BOTH_ENDS, .poisson = 0.3, .gravity = 5.0},
    {"ball sag", .truth = 0.0440, .shape = SHAPE_BALL, .count = {10, 0, 0}, .size = 0.01,
     .hold = HOLD_LOW_CAP, .poisson = 0.3, .gravity = 5.0},
    {"ball press", .truth = 0.1210, .force_truth = -0.0640, .shape = SHAPE_BALL,
     .count = {12, 0, 0}, .size = 0.1 / 12, .hold = HOLD_LOW_CAP, .poisson = 0.45,
     .tool = PRESS(0.02, 0, 0, 0.05, 0.010)},
    {"ball press level 1", .truth = 0.1586, .force_truth = 0.0438, .slow = true,
     .shape = SHAPE_BALL, .count = {20, 0, 0}, .size = 0.005, .levels = 1, .hold = HOLD_LOW_CAP,
     .poisson = 0.3, .tool = PRESS(0.015, 0.01, 0, 0.05, 0.010)},
    {"organ sag", .truth = 0.0762, .slow = true, .shape = SHAPE_ORGAN, .count = {18, 12, 8},
     .size = 0.0083333, .hold = HOLD_LEFT, .poisson = 0.45, .gravity = 2.0},
    {"organ press", .truth = 0.1448, .force_truth = -0.0905, .shape = SHAPE_ORGAN,
     .count = {18, 12, 8}, .size = 0.0083333, .hold = HOLD_BOTTOM, .poisson = 0.45,
     .tool = PRESS(0.015, -0.03, 0, 0.0333, 0.010)},
    {"organ press level 2", .truth = 0.0601, .force_truth = 0.0261, .slow = true,
     .shape = SHAPE_ORGAN, .count = {36, 24, 16}, .size = 0.0041667, .levels = 2,
     .hold = HOLD_BOTTOM, .poisson = 0.3, .tool = PRESS(0.015, -0.03, 0, 0.0333, 0.010)},
    {"organ load", .truth = 0.0653, .shape = SHAPE_ORGAN, .count = {18, 12, 8}, .size = 0.0083333,
     .hold = HOLD_LEFT, .poisson = 0.3, .load = {0.06, 0, 0, 0.025, 0, 0, 0.2}},
    {"cut opened", .truth = 0.0316, .shape = SHAPE_BLOCK, .count = {12, 8, 6}, .size = 0.0083333,
     .hold = HOLD_BOTH_ENDS, .poisson = 0.3, .gravity = 3.0, .cut = {0.0, 0.0, -0.06, 0.06}},
    {"cut pressed", .truth = 0.0722, .force_truth = -0.0164, .shape = SHAPE_BLOCK,
     .count = {12, 12, 8}, .size = 0.0083333, .hold = HOLD_BOTTOM, .poisson = 0.3,
     .cut = {0.0, 0.0083333, -0.06, 0.06}, .tool = PRESS(0.02, 0.02, 0, 0.033333, 0.008)},
    {"cut pulled open level 1", .truth = 0.0622, .shape = SHAPE_BLOCK, .count = {16, 16, 8},
     .size = 0.00625, .levels = 1, .hold = HOLD_BOTTOM, .poisson = 0.3,
     .cut = {0.0, 0.0, -0.06, 0.06}, .load = {0.02, 0, 0.025, 0.021, 0.3, 0, 0.3}},
    {"stiffening press", .truth = 0.0574, .force_truth = -0.0257, BLOCK(12, 0.1 / 12),
     .hold = HOLD_BOTTOM, .poisson = 0.3, .stiffening = 0.5,
     .tool = PRESS(0.02, 0, 0, 0.05, 0.010)},
    // Added after the estimates were chosen.
    {"block press soft wide", .truth = 0.1073, .force_truth = -0.0000, BLOCK(10, 0.01),
     .hold = HOLD_BOTTOM, .poisson = 0.2, .tool = PRESS(0.025, 0.002, 0.003, 0.05, 0.008)},
    {"block press nu 0.4", .truth = 0.1969, .force_truth = -0.0843, BLOCK(10, 0.01),
     .hold = HOLD_BOTTOM, .poisson = 0.4, .tool = PRESS(0.018, 0.004, 0.001, 0.05, 0.009)},
    {"block press on a face", .truth = 0.0665, .force_truth = -0.0379, BLOCK(9, 0.1 / 9),
     .hold = HOLD_BOTTOM, .poisson = 0.35, .tool = PRESS(0.03, 0, 0, 0.05, 0.012)},
    {"block press nu 0.47", .truth = 0.1836, .force_truth = -0.1632, BLOCK(10, 0.01),
     .hold = HOLD_BOTTOM, .poisson = 0.47, .tool = PRESS(0.02, 0, 0, 0.05, 0.006)},
    {"block press nu 0.1", .truth = 0.1270, .force_truth = 0.0299, BLOCK(8, 0.0125),
     .hold = HOLD_BOTTOM, .poisson = 0.1, .tool = PRESS(0.025, 0.002, 0.001, 0.05, 0.010)},
    {"ball press wide", .truth = 0.2204, .force_truth = -0.0144, .shape = SHAPE_BALL,
     .count = {10, 0, 0}, .size = 0.01, .hold = HOLD_LOW_CAP, .poisson = 0.3,
     .tool = PRESS(0.02, 0.005, 0.002, 0.05, 0.012)},
    {"plate 3 thick press", .truth = 0.0367, .force_truth = -0.0702, .shape = SHAPE_BLOCK,
     .count = {14, 14, 3}, .size = 0.0071428, .hold = HOLD_BOTH_ENDS, .poisson = 0.4,
     .tool = PRESS(0.025, 0.002, 0.001, 0.0107142, 0.006)},
    {"block drag rough", .truth = 0.3144, .force_truth = -0.1529, BLOCK(10, 0.01),
     .hold = HOLD_BOTTOM, .poisson = 0.4, .friction = 0.5,
     .tool = DRAG(0.02, -0.01, 0, 0.05, 0.007, 0.008)},
    {"block capsule wide", .truth = 0.0933, .force_truth = -0.0660, BLOCK(10, 0.01),
     .hold = HOLD_BOTTOM, .poisson = 0.4,
     .tool = {{.radius = 0.018,
               .length = 0.03,
               .from = {0, 0, 0.068},
               .to = {0, 0, 0.059},
               .on = {0, 0, 0.059}}}},
    {"organ press aside", .truth = 0.0967, .force_truth = -0.0084, .shape = SHAPE_ORGAN,
     .count = {18, 12, 8}, .size = 0.0083333, .hold = HOLD_BOTTOM, .poisson = 0.3,
     .tool = PRESS(0.02, -0.02, 0.005, 0.0333, 0.012)},
};
const int ERROR_SCENE_COUNT = (int)(sizeof ERROR_SCENES / sizeof ERROR_SCENES[0]);

const ErrorScene *error_scene(const char *name)
{
    for (int s = 0; s < ERROR_SCENE_COUNT; s++)
        if (strcmp(ERROR_SCENES[s].name, name) == 0)
            return &ERROR_SCENES[s];
    return NULL;
}

static void need(bool good, const char *why)
{
    if (!good) {
        fprintf(stderr, "error scene: %s\n", why);
        abort();
    }
}

// Two lobes, made of ellipsoids, of the middles of the undivided cells.
static bool in_organ(const int count[3], int i, int j, int k)
{
    const double x = (i + 0.5) / count[0], y = (j + 0.5) / count[1], z = (k + 0.5) / count[2];
    const double a = pow((x - 0.34) / 0.34, 2) + pow((y - 0.5) / 0.5, 2) + pow((z - 0.5) / 0.5, 2);
    const double b =
        pow((x - 0.68) / 0.32, 2) + pow((y - 0.4) / 0.36, 2) + pow((z - 0.4) / 0.32, 2);
    return a < 1.0 || b < 1.0;
}

static void make_lattice(Lattice *lattice, const ErrorScene *scene, int divided)
{
    Status status = {0};
    Lattice coarse;
    if (scene->shape == SHAPE_BALL) {
        need(lattice_ball(&coarse, 0.5 * scene->count[0] * scene->size, scene->size, &status),
             status.text);
    } else {
        need(lattice_box(&coarse, scene->count, scene->size, &status), status.text);
        for (int k = 0; k < scene->count[2] && scene->shape == SHAPE_ORGAN; k++)
            for (int j = 0; j < scene->count[1]; j++)
                for (int i = 0; i < scene->count[0]; i++)
                    coarse.label[lattice_index(&coarse, i, j, k)] = in_organ(scene->count, i, j, k);
        if (scene->shape == SHAPE_ORGAN) {
            const Vec3 middle = coarse.origin;
            need(lattice_crop(&coarse, &status), status.text);
            (void)middle;
        }
    }
    const int n = 1 << divided;
    const int count[3] = {coarse.count[0] * n, coarse.count[1] * n, coarse.count[2] * n};
    need(lattice_create(lattice, count, coarse.size / n, &status), status.text);
    lattice->origin = coarse.origin;
    lattice->turn = coarse.turn;
    for (int k = 0; k < count[2]; k++)
        for (int j = 0; j < count[1]; j++)
            for (int i = 0; i < count[0]; i++)
                lattice->label[lattice_index(lattice, i, j, k)] =
                    coarse.label[lattice_index(&coarse, i / n, j / n, k / n)];
    lattice_destroy(&coarse);
}

static FixedRegion region_of(const ErrorScene *scene, const Lattice *lattice, int end)
{
    const double thin = 1e-6;
    Vec3 low = lattice->origin,
         high = lattice_point(lattice, lattice->count[0], lattice->count[1], lattice->count[2]);
    FixedRegion region = {.kind = FIXED_BOX, .low = {-1, -1, -1}, .high = {1, 1, 1}};
    // Whole layers of undivided cells, so that the same is held in all bodies.
    const double deep = scene->shape == SHAPE_BLOCK ? 0.0 : 0.2;
    const double x = scene->size * floor(deep * (high.x - low.x) / scene->size + 0.01);
    const double z = scene->size * floor(deep * (high.z - low.z) / scene->size + 0.01);
    if (scene->hold == HOLD_BOTTOM || scene->hold == HOLD_LOW_CAP)
        region.high.z = low.z + z + thin;
    else if (end == 0)
        region.high.x = low.x + x + thin;
    else
        region.low.x = high.x - thin;
    return region;
}

static Vec3 along(const double a[3], const double b[3], double t)
{
    return vec3(a[0] + t * (b[0] - a[0]), a[1] + t * (b[1] - a[1]), a[2] + t * (b[2] - a[2]));
}

static void place(ErrorRun *run, const ErrorScene *scene, double time)
{
    const double go = 0.2, drag = 0.2;
    for (int t = 0; t < 2; t++) {
        const ErrorTool *tool = &scene->tool[t];
        if (tool->radius == 0.0)
            continue;
        const ToolPose pose = {
            .utime = (int64_t)(1e6 * time),
            .position = time < go ? along(tool->from, tool->to, time / go)
                                  : along(tool->to, tool->on, fmin(1.0, (time - go) / drag)),
            .orientation = QUAT_NONE,
            .active = true,
            .grip = tool->grasps ? 1.0 : 0.0};
        sim_apply_pose(run->world.sim, t, &pose, true);
    }
}

static int compare_nodes(const void *a, const void *b)
{
    const int *x = a, *y = b;
    return (x[0] > y[0]) - (x[0] < y[0]);
}

// Outer nodes with their displacements, by id.
static void read_outer(ErrorRun *run)
{
    const Body *body = run->world.body;
    const VoxelModel *model = body->model;
    const BodySurface *surface = &body->surface;
    bool *is_outer = zeroed((size_t)model->vertices.count, sizeof *is_outer);
    for (int f = 0; f < surface->face_used; f++)
        for (int k = 0; k < 3; k++)
            if (surface->face[f][0] != surface->face[f][1])
                is_outer[surface->face[f][k]] = true;
    int(*pair)[2] = zeroed((size_t)model->vertices.count, sizeof *pair);
    for (int v = 0; v < model->vertices.count; v++)
        if (is_outer[v]) {
            pair[run->nodes][0] = model->vertices.id[v];
            pair[run->nodes++][1] = v;
        }
    qsort(pair, (size_t)run->nodes, sizeof *pair, compare_nodes);
    run->id = zeroed((size_t)run->nodes, sizeof *run->id);
    run->moved = zeroed((size_t)run->nodes, sizeof *run->moved);
    for (int i = 0; i < run->nodes; i++) {
        Vec3 x;
        body->ops->read_nodes(model, &pair[i][1], 1, &x, NULL);
        run->id[i] = pair[i][0];
        run->moved[i] = vec3_sub(x, rows_rest(&model->vertices.rows, pair[i][1]));
    }
    free(pair);
    free(is_outer);
}

void error_run(ErrorRun *run, const ErrorScene *scene, int divided)
{
    *run = (ErrorRun){0};
    VoxelWorldOptions options = voxel_world_cube(4);
    lattice_destroy(&options.lattice);
    make_lattice(&options.lattice, scene, divided);
    for (int d = 0; d < 3; d++)
        run->points[d] = options.lattice.count[d] + 1;
    const FixedRegion fixed[2] = {region_of(scene, &options.lattice, 0),
                                  region_of(scene, &options.lattice, 1)};
    options.material.poisson_ratio = scene->poisson;
    options.body.body.fixed = fixed;
    options.body.body.fixed_count = scene->hold == HOLD_BOTH_ENDS ? 2 : 1;
    options.body.body.levels = divided == 0 ? scene->levels : 0;
    options.body.body.gravity = vec3(0.0, 0.0, -scene->gravity);
    options.body.body.friction = scene->friction;
    options.body.body.estimate_error = true;
    options.body.body.cuttable = scene->cut[2] != scene->cut[3];
    options.body.split_budget = 100000;
    options.body.tick = 0.002;
    // Slender bodies swing slowly.
    const bool slender = scene->gravity > 0.0 || scene->load[3] > 0.0;
    options.body.drag = slender && scene->hold == HOLD_LEFT ? 8.0 : slender ? 20.0 : 40.0;
    if (scene->stiffening > 0.0)
        options.body.stiffening = (Stiffening){scene->stiffening, 4.0};
    options.rate_hz = 500.0;
    for (int t = 0; t < 2; t++) {
        const ErrorTool *tool = &scene->tool[t];
        if (tool->radius == 0.0)
            continue;
        ToolOptions *to = &options.tool[options.tool_count++];
        *to = (ToolOptions){CAPSULE(tool->length, tool->radius, 1e3)};
        to->id = t + 1;
        if (tool->grasps) {
            to->kind = TOOL_GRASPER;
            // The same springs in all bodies: they belong to the scene, not to the elements.
            to->grip_stiffness = 0.3 / (1 << 2 * divided);
            to->grip_damping = 1.0;
        }
    }
    voxel_world_create(&run->world, &options);
    Sim *sim = run->world.sim;
    sim_set_lockstep(sim, true);
    if (options.body.body.cuttable) {
        CutOptions cut = {.body = 0};
        const double x = scene->cut[0] + 1e-5, z = scene->cut[1] + 1e-5;
        cut.before.end[0] = vec3(x, scene->cut[2], 1.0);
        cut.before.end[1] = vec3(x, scene->cut[3], 1.0);
        cut.after.end[0] = vec3(x, scene->cut[2], z);
        cut.after.end[1] = vec3(x, scene->cut[3], z);
        char why[SIM_EVENT_TEXT] = "";
        CutOutcome outcome;
        need(sim_apply_cut(sim, &cut, &outcome, why, sizeof why), why);
    }
    if (scene->load[3] > 0.0) {
        const LoadOptions load = {.body = 0,
                                  .center = {scene->load[0], scene->load[1], scene->load[2]},
                                  .radius = scene->load[3],
                                  .force = {scene->load[4], scene->load[5], scene->load[6]},
                                  .duration = 1e6};
        char why[SIM_EVENT_TEXT] = "";
        need(sim_apply_load(sim, &load, why, sizeof why), why);
    }
    // Until it rests.
    double time = 0.0;
    const int window = slender && scene->hold == HOLD_LEFT ? 50 : 15;
    for (int tick = 0, quiet = 0; tick < 8000 && quiet < window; tick++, time += sim_tick(sim)) {
        place(run, scene, time);
        sim_step(sim);
        if (time > 0.5 && tick % 10 == 0) {
            const BodyMeasure now = measure_of(run->world.body);
            run->kinetic = now.kinetic / fmax(now.elastic, 1e-12);
            quiet = run->kinetic < 1e-7 ? quiet + 1 : 0;
        }
    }
    for (int t = 0; t < options.tool_count; t++)
        run->force[t] = vec3_length(sim_wrench(sim, t)->force);
    read_outer(run);
    need(sim_resets(sim) == 0, "a bad number");
}

void error_run_end(ErrorRun *run)
{
    free(run->id);
    free(run->moved);
    voxel_world_destroy(&run->world);
}

static Vec3 at(const ErrorRun *run, int divided, const ErrorRun *grid, int grid_divided, int id)
{
    const int points = grid->points[0] * grid->points[1] * grid->points[2], copy = id / points;
    const int index = id % points, up = 1 << (divided - grid_divided);
    const int i = index % grid->points[0], j = index / grid->points[0] % grid->points[1];
    const int k = index / grid->points[0] / grid->points[1];
    const int there = ((k * up) * run->points[1] + j * up) * run->points[0] + i * up +
                      copy * run->points[0] * run->points[1] * run->points[2];
    const int *found = bsearch(&there, run->id, (size_t)run->nodes, sizeof *run->id, compare_nodes);
    need(found != NULL, "no such node");
    return run->moved[found - run->id];
}

double error_run_differ(const ErrorRun *grid, int grid_divided, const ErrorRun *a, int a_divided,
                        const ErrorRun *b, int b_divided)
{
    double sum = 0.0;
    for (int i = 0; i < grid->nodes; i++) {
        const Vec3 d = vec3_sub(at(a, a_divided, grid, grid_divided, grid->id[i]),
                                at(b, b_divided, grid, grid_divided, grid->id[i]));
        sum += vec3_dot(d, d);
    }
    return sqrt(sum / grid->nodes);
}

double error_run_rms(const ErrorRun *run)
{
    double sum = 0.0;
    for (int i = 0; i < run->nodes; i++)
        sum += vec3_dot(run->moved[i], run->moved[i]);
    return sqrt(sum / run->nodes);
}

BodyError error_run_estimate(const ErrorRun *run, const ErrorScene *scene, int budget)
{
    Vec3 place[2], force[2];
    double size[2], depth[2];
    ErrorQuestion question = {.tool = place, .size = size, .force = force, .depth = depth};
    for (int t = 0; t < 2 && scene->tool[t].radius > 0.0; t++) {
        const ToolWrench *wrench = sim_wrench(run->world.sim, t);
        place[t] = wrench->point;
        size[t] = scene->tool[t].radius;
        force[t] = wrench->force;
        depth[t] = wrench->depth;
        question.tool_count++;
    }
    BodyError error;
    int calls = 1;
    while (!run->world.body->ops->estimate(run->world.body->model, &question, budget, &error))
        need(calls++ < 1000000, "the estimate does not end");
    return error;
}
