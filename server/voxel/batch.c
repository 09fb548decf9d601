#include "voxel/batch.h"

#include "base/check.h"

#include <stdlib.h>
#include <string.h>

#define ALLOCATE(use, count, type, label)                                                          \
    (type *)arena_allocate(arena, (use), (size_t)(count), sizeof(type), "%s/%s", options->name,    \
                           label)

// What elements are ordered by.
typedef struct Key {
    unsigned mask;
    int element_class;
    int element;
} Key;

static int compare_keys(const void *a, const void *b)
{
    const Key *x = a, *y = b;
    if (x->mask != y->mask)
        return x->mask < y->mask ? -1 : 1;
    if (x->element_class != y->element_class)
        return x->element_class < y->element_class ? -1 : 1;
    return (x->element > y->element) - (x->element < y->element);
}

static bool same_class(const ElementClass *a, const ElementClass *b)
{
    return a->size == b->size && a->mu == b->mu && a->lambda == b->lambda &&
           a->residual == b->residual && a->damping == b->damping;
}

// The classes in use, each once; returns what became of each of the options' (malloc'ed).
static int *unite_classes(Batches *out, const BatchOptions *options, Arena *arena)
{
    int given = 0;
    for (int e = 0; e < options->element_count; e++)
        if (options->element_class[e] >= given)
            given = options->element_class[e] + 1;
    int *become = calloc((size_t)given + 1, sizeof *become);
    bool *used = calloc((size_t)given + 1, sizeof *used);
    ASSERT(become != NULL && used != NULL);
    for (int e = 0; e < options->element_count; e++)
        used[options->element_class[e]] = true;
    out->classes = ALLOCATE(ARENA_STEP, given, ElementClass, "element classes");
    for (int c = 0; c < given; c++) {
        if (!used[c])
            continue;
        int k = 0;
        while (k < out->class_count && !same_class(&out->classes[k], &options->classes[c]))
            k++;
        if (k == out->class_count)
            out->classes[out->class_count++] = options->classes[c];
        become[c] = k;
    }
    free(used);
    return become;
}

// Ascending; returns how many have no hanging vertex.
static int sort_elements(const BatchOptions *options, const int *become, Key *key)
{
    int plain = 0;
    for (int e = 0; e < options->element_count; e++) {
        key[e] = (Key){.element_class = become[options->element_class[e]], .element = e};
        for (int n = NODE_CORNERS; n < NODE_COUNT; n++)
            key[e].mask |= options->vertex[e][n] >= 0 ? 1u << (n - NODE_CORNERS) : 0u;
        plain += key[e].mask == 0;
    }
    qsort(key, (size_t)options->element_count, sizeof *key, compare_keys);
    return plain;
}

// The end of the batch that begins at `first`.
static int batch_end(const Key *key, int first, int count)
{
    int end = first + 1;
    while (end < count && end < first + LANES && key[end].mask == key[first].mask &&
           key[end].element_class == key[first].element_class)
        end++;
    return end;
}

static int count_batches(const Key *key, int count)
{
    int batches = 0;
    for (int first = 0; first < count; first = batch_end(key, first, count))
        batches++;
    return batches;
}

// Rows of vertices, one a node; lanes left over hold the spare vertex.
static void put_vertices(const BatchOptions *options, const Key *key, int count, const int *node,
                         int node_count, int *row)
{
    for (int n = 0; n < node_count; n++)
        for (int lane = 0; lane < LANES; lane++)
            row[n * LANES + lane] =
                lane < count ? options->vertex[key[lane].element][node[n]] : options->vertex_count;
}

static void put_places(Batches *out, const Key *key, int count, int batch)
{
    for (int lane = 0; lane < count; lane++)
        out->place[key[lane].element] = batch * LANES + lane;
}

static void create_plain(Batches *out, const BatchOptions *options, const Key *key, int count,
                         Arena *arena)
{
    const int batch_count = count_batches(key, count);
    int *vertex =
        ALLOCATE(ARENA_STEP, (long)batch_count * NODE_CORNERS * LANES, int, "plain vertices");
    int *element_class = ALLOCATE(ARENA_STEP, batch_count, int, "plain classes");
    static const int corner[NODE_CORNERS] = {0, 1, 2, 3, 4, 5, 6, 7};
    for (int first = 0, batch = 0, end; first < count; first = end, batch++) {
        end = batch_end(key, first, count);
        put_vertices(options, key + first, end - first, corner, NODE_CORNERS,
                     vertex + (long)batch * NODE_CORNERS * LANES);
        put_places(out, key + first, end - first, batch);
        element_class[batch] = key[first].element_class;
    }
    out->plain = (PlainBatches){batch_count, vertex, element_class};
}

static void create_templates(Batches *out, const BatchOptions *options, const Key *key, int count,
                             Arena *arena)
{
    for (int k = 0; k < count; k++)
        out->template_count += k == 0 || key[k].mask != key[k - 1].mask;
    out->templates = ALLOCATE(ARENA_TOPOLOGY, out->template_count, Template, "templates");
    for (int k = 0, t = 0; k < count; k++)
        if (k == 0 || key[k].mask != key[k - 1].mask)
            template_create(&out->templates[t++], key[k].mask);
}

static void create_hanging(Batches *out, const BatchOptions *options, const Key *key, int count,
                           Arena *arena)
{
    create_templates(out, options, key, count, arena);
    const int batch_count = count_batches(key, count);
    int *start = ALLOCATE(ARENA_STEP, batch_count + 1, int, "hanging start");
    int *template_index = ALLOCATE(ARENA_STEP, batch_count, int, "hanging templates");
    int *element_class = ALLOCATE(ARENA_STEP, batch_count, int, "hanging classes");
    for (int first = 0, batch = 0, t = 0; first < count;
         first = batch_end(key, first, count), batch++) {
        while (out->templates[t].mask != key[first].mask)
            t++;
        template_index[batch] = t;
        element_class[batch] = key[first].element_class;
        start[batch + 1] = start[batch] + out->templates[t].count;
    }
    int *vertex = ALLOCATE(ARENA_STEP, (long)start[batch_count] * LANES, int, "hanging vertices");
    for (int first = 0, batch = 0, end; first < count; first = end, batch++) {
        const Template *template = &out->templates[template_index[batch]];
        end = batch_end(key, first, count);
        put_vertices(options, key + first, end - first, template->node, template->count,
                     vertex + (long)start[batch] * LANES);
        put_places(out, key + first, end - first, out->plain.batch_count + batch);
    }
    out->hanging = (HangingBatches){batch_count, start, vertex, template_index, element_class};
}

void batches_create(Batches *out, const BatchOptions *options, Arena *arena)
{
    const int count = options->element_count;
    *out = (Batches){.element_count = count};
    Key *key = calloc((size_t)count + 1, sizeof *key);
    ASSERT(key != NULL);
    int *become = unite_classes(out, options, arena);
    int plain = sort_elements(options, become, key);
    out->place = ALLOCATE(ARENA_STEP, count, int, "places of elements");
    create_plain(out, options, key, plain, arena);
    create_hanging(out, options, key + plain, count - plain, arena);
    free(become);
    free(key);
}
