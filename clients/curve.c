// SPDX-License-Identifier: MIT
// Records the motion of a body from its frames. One thread.
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
static void set_first(Curve *curve, const float *position, int node, const int parent[2])
{
    for (size_t k = 0; k < 3; k++) {
        size_t at = 3 * (size_t)node + k;
        size_t a = 3 * (size_t)parent[0] + k, b = 3 * (size_t)parent[1] + k;
        float moved = (position[a] - curve->first[a]) + (position[b] - curve->first[b]);
        curve->first[at] = position[at] - 0.5f * moved;
    }
}

// Sets the references of new nodes: first those between known ones, then those between them.
static void begin_births(Curve *curve, const PliantBody *body, unsigned char *known)
{
    // Ids are looked up, so sort them.
    int count = body->node_count;
    IdSlot *order = make_rows(NULL, count, sizeof *order);
    for (int i = 0; i < count; i++)
        order[i] = (IdSlot){body->id[i], i};
    qsort(order, (size_t)count, sizeof *order, compare_ids);
    // A parent may be new itself: repeat until no more nodes are found.
    bool more = true;
    for (int pass = 0; pass < DEEPEST && more; pass++) {
        more = false;
        for (int i = 0; i < count; i++) {
            if (known[i] || body->id[i] < 0)
                continue;
            int parent[2];
            for (size_t k = 0; k < 2; k++)
                parent[k] = find_slot(order, count, body->parent[2 * (size_t)i + k]);
            if (parent[0] < 0 || parent[1] < 0 || !known[parent[0]] || !known[parent[1]])
                continue;
            set_first(curve, body->position, i, parent);
            known[i] = 1;
            more = true;
        }
    }
    free(order);
}

// A slot that changed its node gets a new reference.
static void follow_topology(Curve *curve, const PliantBody *body)
{
    const PliantBody *last = curve->before;
    const int32_t *id = body->id;
    int count = body->node_count, born = 0;
    float *old = curve->first;
    unsigned char *known = calloc((size_t)count, 1);
    if (!known)
        abort();
    // A node that kept its id keeps its reference; others begin where they are.
    curve->first = copy_rows(NULL, body->position, count, 3 * sizeof(float));
    for (int i = 0; i < count; i++) {
        known[i] = i < last->node_count && last->id[i] == id[i] && id[i] >= 0;
        if (known[i])
            memcpy(curve->first + 3 * (size_t)i, old + 3 * (size_t)i, 3 * sizeof(float));
        born += !known[i] && id[i] >= 0;
    }
    // New nodes take theirs from their parents.
    if (born)
        begin_births(curve, body, known);
    free(known);
    free(old);
}

// --- frames ---

static void keep(CurveShape *shape, const Curve *curve, double displacement)
{
    const PliantBody *body = curve->before;
    pliant_body_release(shape->body);
    shape->body = pliant_body_keep(body);
    shape->first = copy_rows(shape->first, curve->first, body->node_count, 3 * sizeof(float));
    shape->displacement = displacement;
}

void curve_take(Curve *curve, const PliantBody *body)
{
    const PliantBody *last = curve->before;
    if (!last)
        curve->first = copy_rows(NULL, body->position, body->node_count, 3 * sizeof(float));
    else if (last->topology != body->topology || last->node_count != body->node_count)
        follow_topology(curve, body);
    pliant_body_release(last);
    curve->before = pliant_body_keep(body);
    // The node that has moved farthest.
    double largest = 0.0;
    int largest_node = 0;
    for (int i = 0; i < body->node_count; i++) {
        if (body->id[i] < 0)
            continue; // a free slot
        double displacement = displacement_of(curve->first, body->position, i);
        if (displacement > largest) {
            largest = displacement;
            largest_node = i;
        }
    }
    // Keep this frame, and the one that moved most of all.
    keep(&curve->shape[CURVE_LAST], curve, largest);
    CurveShape *peak = &curve->shape[CURVE_PEAK];
    if (!peak->body || largest > peak->displacement)
        keep(peak, curve, largest);
    curve->frames++;
    if (curve->out)
        fprintf(curve->out, "%.6f\t%.9g\t%d\n", body->time, largest, largest_node);
}

// --- shapes ---

static void write_corner(FILE *out, const CurveShape *shape, int node)
{
    const float *x = shape->body->position + 3 * (size_t)node;
    fprintf(out, "%.7g %.7g %.7g %.7g\n", (double)x[0], (double)x[1], (double)x[2],
            displacement_of(shape->first, shape->body->position, node));
}

static void write_triangles(FILE *out, const CurveShape *shape)
{
    for (int t = 0; t < shape->body->triangle_count; t++) {
        const int32_t *corner = shape->body->triangle + 3 * (size_t)t;
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
    const CurveShape *shape = &curve->shape[which];
    if (!curve->frames)
        return program_fail(error, "%s not written: no whole frame of positions came", path);
    FILE *out = program_open_output(path, CURVE_SHAPE_MARK, error);
    if (!out)
        return false;
    // What it shows, then triangles as gnuplot wants them.
    fprintf(out, CURVE_SHAPE_MARK " at %.6f s, largest %.9g m\n", shape->body->time,
            shape->displacement);
    write_triangles(out, shape);
    // A full disk shows at the end only.
    bool failed = ferror(out) != 0;
    if (fclose(out) != 0 || failed)
        return program_fail(error, "%s: not all could be written", path);
    return true;
}

void curve_destroy(Curve *curve)
{
    for (int k = 0; k < CURVE_FRAMES; k++) {
        pliant_body_release(curve->shape[k].body);
        free(curve->shape[k].first);
    }
    pliant_body_release(curve->before);
    free(curve->first);
    *curve = (Curve){0};
}
