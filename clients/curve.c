// Records the motion of a body from the published messages. One thread.
#include "curve.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

enum { DEEPEST = 16 }; // most nodes between nodes between nodes ..., in one change of topology

static double displacement_of(const float *first, const float *position, int node)
{
    double sum = 0.0;
    for (int k = 0; k < 3; k++) {
        size_t at = 3 * (size_t)node + (size_t)k;
        double d = (double)position[at] - (double)first[at];
        sum += d * d;
    }
    return sqrt(sum);
}

// Reallocates to `count` rows of `size` bytes.
static void *make_rows(void *old, int count, size_t size)
{
    void *rows = realloc(old, size * (size_t)count + 1);
    if (!rows)
        abort(); // the counts are bounded: the machine itself is out of memory
    return rows;
}

static void *copy_rows(void *old, const void *from, int count, size_t size)
{
    return memcpy(make_rows(old, count, size), from, size * (size_t)count);
}

// True if the mesh is that of the current frame.
static bool mesh_known(const Curve *curve)
{
    const MeshFrame *mesh = &curve->mesh;
    return mesh->whole && mesh->topology == curve->nodes.topology &&
           mesh->node_count == curve->nodes.node_count;
}

// --- from one topology to the next ---

typedef struct IdSlot {
    int32_t id;
    int slot;
} IdSlot;

static int compare_ids(const void *left, const void *right)
{
    const IdSlot *a = left, *b = right;
    return (a->id > b->id) - (a->id < b->id);
}

// Returns the slot of a node, or -1.
static int find_slot(const IdSlot *order, int count, int32_t id)
{
    const IdSlot key = {.id = id};
    const IdSlot *found = bsearch(&key, order, (size_t)count, sizeof *order, compare_ids);
    return found ? found->slot : -1;
}

// Sets the reference position of a node between two whose references are known.
static void set_first(Curve *curve, int node, const int parent[2])
{
    const float *position = curve->nodes.position;
    for (size_t k = 0; k < 3; k++) {
        size_t at = 3 * (size_t)node + k;
        size_t a = 3 * (size_t)parent[0] + k, b = 3 * (size_t)parent[1] + k;
        float moved = (position[a] - curve->first[a]) + (position[b] - curve->first[b]);
        curve->first[at] = position[at] - 0.5f * moved;
    }
}

// Sets the references of new nodes: first those between known ones, then those between them.
static void begin_births(Curve *curve, unsigned char *known)
{
    // Ids are looked up, so sort them.
    const MeshFrame *mesh = &curve->mesh;
    int count = mesh->node_count;
    IdSlot *order = make_rows(NULL, count, sizeof *order);
    for (int i = 0; i < count; i++)
        order[i] = (IdSlot){mesh->id[i], i};
    qsort(order, (size_t)count, sizeof *order, compare_ids);
    // A parent may be new itself: repeat until no more nodes are found.
    bool more = true;
    for (int pass = 0; pass < DEEPEST && more; pass++) {
        more = false;
        for (int i = 0; i < count; i++) {
            if (known[i] || mesh->id[i] < 0)
                continue;
            int parent[2];
            for (size_t k = 0; k < 2; k++)
                parent[k] = find_slot(order, count, mesh->parent[2 * (size_t)i + k]);
            if (parent[0] < 0 || parent[1] < 0 || !known[parent[0]] || !known[parent[1]])
                continue;
            set_first(curve, i, parent);
            known[i] = 1;
            more = true;
        }
    }
    free(order);
}

// With both meshes known: a slot that changed its node gets a new reference.
static void follow_topology(Curve *curve)
{
    const int32_t *id = curve->mesh.id;
    int before = curve->node_count, count = curve->nodes.node_count, born = 0;
    float *old = curve->first;
    unsigned char *known = calloc((size_t)count, 1);
    if (!known)
        abort();
    // A node that kept its id keeps its reference; others begin where they are.
    curve->first = copy_rows(NULL, curve->nodes.position, count, 3 * sizeof(float));
    for (int i = 0; i < count; i++) {
        known[i] = i < before && curve->id[i] == id[i] && id[i] >= 0;
        if (known[i])
            memcpy(curve->first + 3 * (size_t)i, old + 3 * (size_t)i, 3 * sizeof(float));
        born += !known[i] && id[i] >= 0;
    }
    // New nodes take theirs from their parents.
    if (born)
        begin_births(curve, known);
    free(known);
    free(old);
}

static void free_shape(CurveShape *shape)
{
    free(shape->position);
    free(shape->first);
    free(shape->triangle);
    *shape = (CurveShape){0};
}

// Starts a mesh whose nodes cannot be compared with those of the last one.
static void begin_topology(Curve *curve)
{
    curve->first =
        copy_rows(curve->first, curve->nodes.position, curve->nodes.node_count, 3 * sizeof(float));
    for (int k = 0; k < CURVE_FRAMES; k++)
        free_shape(&curve->shape[k]);
}

static void take_topology(Curve *curve)
{
    const NodesFrame *nodes = &curve->nodes;
    // Has anything changed since the last frame?
    bool known = mesh_known(curve);
    bool same = curve->first && curve->topology == nodes->topology &&
                curve->node_count == nodes->node_count;
    if (same && (curve->id || !known))
        return;
    // With both meshes nodes keep their reference, else all begin anew.
    if (!same && curve->id && known)
        follow_topology(curve);
    else if (!same)
        begin_topology(curve);
    // From now on this is the topology of the curve.
    curve->topology = nodes->topology;
    curve->node_count = nodes->node_count;
    if (known) {
        curve->id = copy_rows(curve->id, curve->mesh.id, nodes->node_count, sizeof *curve->id);
    } else {
        free(curve->id);
        curve->id = NULL;
    }
}

// --- frames ---

static void keep(CurveShape *shape, const Curve *curve, double displacement)
{
    const NodesFrame *nodes = &curve->nodes;
    const MeshFrame *mesh = &curve->mesh;
    // Triangles change with the topology only.
    bool same = shape->position && shape->topology == nodes->topology;
    if (!same || !shape->triangle) {
        free(shape->triangle);
        shape->triangle = NULL;
        if (mesh_known(curve)) {
            shape->triangle_count = mesh->triangle_count;
            shape->triangle =
                copy_rows(NULL, mesh->triangle, mesh->triangle_count, 3 * sizeof *mesh->triangle);
        }
    }
    // Positions always.
    shape->topology = nodes->topology;
    shape->node_count = nodes->node_count;
    shape->position =
        copy_rows(shape->position, nodes->position, nodes->node_count, 3 * sizeof(float));
    shape->first = copy_rows(shape->first, curve->first, nodes->node_count, 3 * sizeof(float));
    shape->time = nodes->time;
    shape->displacement = displacement;
}

void curve_take_nodes(Curve *curve, const void *data, size_t size)
{
    const NodesFrame *nodes = &curve->nodes;
    if (nodes_frame_add(&curve->nodes, data, size) != FRAMES_WHOLE)
        return;
    take_topology(curve);
    // The node that has moved farthest.
    double largest = 0.0;
    int largest_node = 0;
    for (int i = 0; i < nodes->node_count; i++) {
        if (curve->id && curve->id[i] < 0)
            continue; // a free slot
        double displacement = displacement_of(curve->first, nodes->position, i);
        if (displacement > largest) {
            largest = displacement;
            largest_node = i;
        }
    }
    // Keep this frame, and the one that moved most of all.
    keep(&curve->shape[CURVE_LAST], curve, largest);
    CurveShape *peak = &curve->shape[CURVE_PEAK];
    if (!peak->position || largest > peak->displacement)
        keep(peak, curve, largest);
    curve->frames++;
    if (curve->out)
        fprintf(curve->out, "%.6f\t%.9g\t%d\n", nodes->time, largest, largest_node);
}

void curve_take_mesh(Curve *curve, const void *data, size_t size)
{
    mesh_frame_add(&curve->mesh, data, size);
}

void curve_take_delta(Curve *curve, const void *data, size_t size)
{
    mesh_frame_add_delta(&curve->mesh, data, size);
}

// --- shapes ---

static void write_corner(FILE *out, const CurveShape *shape, int node)
{
    const float *x = shape->position + 3 * (size_t)node;
    fprintf(out, "%.7g %.7g %.7g %.7g\n", (double)x[0], (double)x[1], (double)x[2],
            displacement_of(shape->first, shape->position, node));
}

static void write_triangles(FILE *out, const CurveShape *shape, const int32_t *triangle, int count)
{
    for (int t = 0; t < count; t++) {
        const int32_t *corner = triangle + 3 * (size_t)t;
        if (corner[0] == corner[1])
            continue; // a free slot
        // pm3d draws quadrilaterals: a triangle is one whose first two corners coincide (with the
        // last two it loses its shading).
        for (int k = 0; k < 4; k++) {
            write_corner(out, shape, corner[k ? k - 1 : 0]);
            if (k == 1)
                fputc('\n', out);
        }
        fputs("\n\n", out);
    }
}

bool curve_write_shape(const Curve *curve, CurveFrame which, const char *path, PliantError *error)
{
    const MeshFrame *mesh = &curve->mesh;
    const CurveShape *shape = &curve->shape[which];
    if (!curve->frames)
        return program_fail(error, "%s not written: no whole frame of positions came", path);
    // Its own mesh, or one that arrived later.
    bool late =
        mesh->whole && mesh->topology == shape->topology && mesh->node_count == shape->node_count;
    if (!shape->triangle && !late)
        return program_fail(error, "%s not written: no whole mesh of topology %d came", path,
                            shape->topology);
    FILE *out = program_open_output(path, CURVE_SHAPE_MARK, error);
    if (!out)
        return false;
    // What it shows, then triangles as gnuplot wants them.
    fprintf(out, CURVE_SHAPE_MARK " at %.6f s, largest %.9g m\n", shape->time, shape->displacement);
    if (shape->triangle)
        write_triangles(out, shape, shape->triangle, shape->triangle_count);
    else
        write_triangles(out, shape, mesh->triangle, mesh->triangle_count);
    // A full disk shows at the end only.
    bool failed = ferror(out) != 0;
    if (fclose(out) != 0 || failed)
        return program_fail(error, "%s: not all could be written", path);
    return true;
}

void curve_destroy(Curve *curve)
{
    free(curve->id);
    free(curve->first);
    for (int k = 0; k < CURVE_FRAMES; k++)
        free_shape(&curve->shape[k]);
    nodes_frame_destroy(&curve->nodes);
    mesh_frame_destroy(&curve->mesh);
    *curve = (Curve){0};
}
