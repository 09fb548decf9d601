// Records what a body did from what the daemon really published. One thread.
#include "curve.h"

#include <errno.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>

static double displacement_of(const Curve *curve, const float *position, int node)
{
    double sum = 0.0;
    for (int k = 0; k < 3; k++) {
        size_t at = 3 * (size_t)node + (size_t)k;
        double d = (double)position[at] - (double)curve->first[at];
        sum += d * d;
    }
    return sqrt(sum);
}

static float *copy_positions(const NodesFrame *nodes)
{
    const size_t bytes = 3 * sizeof(float) * (size_t)nodes->node_count;
    float *copy = malloc(bytes);
    if (!copy)
        abort(); // the counts are bounded: the machine itself is out of memory
    memcpy(copy, nodes->position, bytes);
    return copy;
}

// Another mesh: its nodes cannot be compared with those of the last one.
static void begin_topology(Curve *curve)
{
    free(curve->first);
    curve->first = copy_positions(&curve->nodes);
    curve->node_count = curve->nodes.node_count;
    curve->topology = curve->nodes.topology;
    for (int k = 0; k < CURVE_FRAMES; k++) {
        free(curve->shape[k].position);
        curve->shape[k] = (CurveShape){copy_positions(&curve->nodes), curve->nodes.time, 0.0};
    }
}

static void keep(CurveShape *shape, const NodesFrame *nodes, double displacement)
{
    memcpy(shape->position, nodes->position, 3 * sizeof(float) * (size_t)nodes->node_count);
    shape->time = nodes->time;
    shape->displacement = displacement;
}

void curve_take_nodes(Curve *curve, const void *data, size_t size)
{
    const NodesFrame *nodes = &curve->nodes;
    if (nodes_frame_add(&curve->nodes, data, size) != FRAMES_WHOLE)
        return;
    if (!curve->first || curve->topology != nodes->topology ||
        curve->node_count != nodes->node_count)
        begin_topology(curve);
    double largest = 0.0;
    int largest_node = 0;
    for (int i = 0; i < nodes->node_count; i++) {
        double displacement = displacement_of(curve, nodes->position, i);
        if (displacement > largest) {
            largest = displacement;
            largest_node = i;
        }
    }
    keep(&curve->shape[CURVE_LAST], nodes, largest);
    if (largest > curve->shape[CURVE_PEAK].displacement)
        keep(&curve->shape[CURVE_PEAK], nodes, largest);
    curve->frames++;
    if (curve->out)
        fprintf(curve->out, "%.6f\t%.9g\t%d\n", nodes->time, largest, largest_node);
}

void curve_take_mesh(Curve *curve, const void *data, size_t size)
{
    mesh_frame_add(&curve->mesh, data, size);
}

static void write_corner(FILE *out, const Curve *curve, const float *position, int node)
{
    const float *x = position + 3 * (size_t)node;
    fprintf(out, "%.7g %.7g %.7g %.7g\n", (double)x[0], (double)x[1], (double)x[2],
            displacement_of(curve, position, node));
}

bool curve_write_shape(const Curve *curve, CurveFrame which, const char *path, ClientError *error)
{
    const MeshFrame *mesh = &curve->mesh;
    const CurveShape *shape = &curve->shape[which];
    if (!curve->frames)
        return client_fail(error, "%s not written: no whole frame of positions came", path);
    if (!mesh->whole || mesh->topology != curve->topology || mesh->node_count != curve->node_count)
        return client_fail(error, "%s not written: no whole mesh of topology %d came", path,
                           curve->topology);
    FILE *out = fopen(path, "w");
    if (!out)
        return client_fail(error, "%s: %s", path, strerror(errno));
    fprintf(out, "# x_m y_m z_m displacement_m at %.6f s, largest %.9g m\n", shape->time,
            shape->displacement);
    for (int t = 0; t < mesh->triangle_count; t++) {
        const int32_t *corner = mesh->triangle + 3 * (size_t)t;
        if (corner[0] == corner[1])
            continue; // a free slot
        // pm3d draws quadrilaterals: a triangle is one whose first two corners coincide (with the
        // last two it loses its shading).
        for (int k = 0; k < 4; k++) {
            write_corner(out, curve, shape->position, corner[k ? k - 1 : 0]);
            if (k == 1)
                fputc('\n', out);
        }
        fputs("\n\n", out);
    }
    bool failed = ferror(out) != 0;
    if (fclose(out) != 0 || failed)
        return client_fail(error, "%s: not all could be written", path);
    return true;
}

void curve_destroy(Curve *curve)
{
    free(curve->first);
    for (int k = 0; k < CURVE_FRAMES; k++)
        free(curve->shape[k].position);
    nodes_frame_destroy(&curve->nodes);
    mesh_frame_destroy(&curve->mesh);
    *curve = (Curve){0};
}
