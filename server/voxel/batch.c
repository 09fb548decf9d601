#include "voxel/batch.h"

#include "base/check.h"

#include <stdlib.h>
#include <string.h>

// Sort keys of an element.
typedef struct Key {
    int mixed_count; // number of vertices in mixed batches; 0 in others
    unsigned mask;
    int element_class; // 0 with hanging vertices: their batches may mix classes
    int element;
} Key;

static int compare_keys(const void *a, const void *b)
{
    const Key *x = a, *y = b;
    if (x->mixed_count != y->mixed_count)
        return x->mixed_count < y->mixed_count ? -1 : 1;
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

// Collects the classes in use, each once; returns the new index of each of the options' classes
// (malloc'ed).
static int *unite_classes(Batches *out, const BatchOptions *options, Arena *arena)
{
    const char *name = options->name;
    int given = 0;
    for (int e = 0; e < options->element_count; e++)
        if (options->element_class[e] >= given)
            given = options->element_class[e] + 1;
    int *become = calloc((size_t)given + 1, sizeof *become);
    bool *used = calloc((size_t)given + 1, sizeof *used);
    ASSERT(become != NULL && used != NULL);
    for (int e = 0; e < options->element_count; e++)
        used[options->element_class[e]] = true;
    ElementClass *classes = calloc((size_t)given + 1, sizeof *classes);
    ASSERT(classes != NULL);
    for (int c = 0; c < given; c++) {
        if (!used[c])
            continue;
        int k = 0;
        while (k < out->class_count && !same_class(&classes[k], &options->classes[c]))
            k++;
        if (k == out->class_count)
            classes[out->class_count++] = options->classes[c];
        become[c] = k;
    }
    out->classes = ALLOCATE(ARENA_STEP, out->class_count, ElementClass, "element classes");
    memcpy(out->classes, classes, (size_t)out->class_count * sizeof *classes);
    free(classes);
    free(used);
    return become;
}

// Sorts ascending; returns how many elements have no hanging vertex.
static int sort_elements(const BatchOptions *options, const int *become, Key *key)
{
    int plain = 0;
    for (int e = 0; e < options->element_count; e++) {
        key[e] = (Key){.element = e, .mask = template_mask_of(options->vertex[e])};
        if (key[e].mask == 0)
            key[e].element_class = become[options->element_class[e]];
        plain += key[e].mask == 0;
    }
    qsort(key, (size_t)options->element_count, sizeof *key, compare_keys);
    return plain;
}

// Returns the end of the batch that begins at `first`.
static int batch_end(const Key *key, int first, int count)
{
    int end = first + 1;
    while (end < count && end < first + LANES &&
           (key[first].mixed_count > 0 ||
            (key[end].mixed_count == 0 && key[end].mask == key[first].mask &&
             key[end].element_class == key[first].element_class)))
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

// Writes a lane's vertices by the nodes of its rest shape; the spare vertex without an element.
// Shorter lists are padded with the spare vertex, too.
static void put_vertices(const BatchOptions *options, int element, const int *node, int node_count,
                         int row_count, int *row, int lane)
{
    for (int n = 0; n < row_count; n++)
        row[n * LANES + lane] = element >= 0 && n < node_count ? options->vertex[element][node[n]]
                                                               : options->vertex_count;
}

static void put_places(Batches *out, const Key *key, int count, int batch)
{
    for (int lane = 0; lane < count; lane++)
        out->place[key[lane].element] = batch * LANES + lane;
}

static void create_plain(Batches *out, const BatchOptions *options, const Key *key, int count,
                         Arena *arena)
{
    const char *name = options->name;
    const int batch_count = count_batches(key, count);
    int *vertex =
        ALLOCATE(ARENA_STEP, (long)batch_count * NODE_CORNERS * LANES, int, "plain vertices");
    int *element_class = ALLOCATE(ARENA_STEP, batch_count, int, "plain classes");
    static const int corner[NODE_CORNERS] = {0, 1, 2, 3, 4, 5, 6, 7};
    for (int first = 0, batch = 0, end; first < count; first = end, batch++) {
        end = batch_end(key, first, count);
        for (int lane = 0; lane < LANES; lane++)
            put_vertices(options, first + lane < end ? key[first + lane].element : -1, corner,
                         NODE_CORNERS, NODE_CORNERS, vertex + (long)batch * NODE_CORNERS * LANES,
                         lane);
        put_places(out, key + first, end - first, batch);
        element_class[batch] = key[first].element_class;
    }
    out->plain = (PlainBatches){batch_count, vertex, element_class};
}

static void create_templates(Batches *out, const BatchOptions *options, const Key *key, int count,
                             Arena *arena)
{
    const char *name = options->name;
    for (int k = 0; k < count; k++)
        out->template_count += k == 0 || key[k].mask != key[k - 1].mask;
    out->templates = ALLOCATE(ARENA_TOPOLOGY, out->template_count, Template, "templates");
    for (int k = 0, t = 0; k < count; k++)
        if (k == 0 || key[k].mask != key[k - 1].mask)
            template_create(&out->templates[t++], key[k].mask);
}

static int template_at(const Batches *batches, unsigned mask)
{
    int t = 0;
    while (batches->templates[t].mask != mask)
        t++;
    return t;
}

// Moves elements that would leave a batch too empty behind all others. Ascending masks before,
// ascending numbers of vertices after.
static void choose_mixed(const Batches *batches, Key *key, int count)
{
    for (int first = 0, end; first < count; first = end) {
        end = batch_end(key, first, count);
        if (end - first < LANES * 3 / 4)
            for (int k = first; k < end; k++)
                key[k].mixed_count = batches->templates[template_at(batches, key[k].mask)].count;
    }
    qsort(key, (size_t)count, sizeof *key, compare_keys);
}

static void create_hanging(Batches *out, const BatchOptions *options, const int *become, Key *key,
                           int count, Arena *arena)
{
    const char *name = options->name;
    create_templates(out, options, key, count, arena);
    choose_mixed(out, key, count);
    const int batch_count = count_batches(key, count);
    int *start = ALLOCATE(ARENA_STEP, batch_count + 1, int, "hanging start");
    int *table = ALLOCATE(ARENA_STEP, batch_count, int, "hanging tables");
    int(*element_class)[LANES] =
        arena_allocate(arena, ARENA_STEP, (size_t)batch_count, sizeof *element_class,
                       "%s/hanging classes", options->name);
    int pure = 0, mixed = 0;
    // Count the batches and the rows of each: a mixed batch needs those of its largest template.
    for (int first = 0, end, batch = 0; first < count; first = end, batch++) {
        end = batch_end(key, first, count);
        const bool mixes = key[first].mixed_count > 0;
        const int last = template_at(out, key[end - 1].mask); // the one with the most vertices
        table[batch] = mixes ? out->template_count + mixed : last;
        start[batch + 1] = start[batch] + out->templates[last].count;
        pure += !mixes;
        mixed += mixes;
    }
    int *vertex = ALLOCATE(ARENA_STEP, (long)start[batch_count] * LANES, int, "hanging vertices");
    out->mixture = arena_allocate(arena, ARENA_TOPOLOGY, (size_t)mixed, sizeof *out->mixture,
                                  "%s/mixed templates", options->name);
    // Fill the lanes; unused ones repeat the class of the first.
    for (int first = 0, end, batch = 0; first < count; first = end, batch++) {
        end = batch_end(key, first, count);
        for (int lane = 0; lane < LANES; lane++) {
            const bool used = first + lane < end;
            const Key *own = &key[used ? first + lane : first];
            const int t = template_at(out, own->mask);
            put_vertices(options, used ? own->element : -1, out->templates[t].node,
                         out->templates[t].count, start[batch + 1] - start[batch],
                         vertex + (long)start[batch] * LANES, lane);
            element_class[batch][lane] = become[options->element_class[own->element]];
            if (batch >= pure)
                out->mixture[batch - pure][lane] = used ? t : -1;
        }
        put_places(out, key + first, end - first, out->plain.batch_count + batch);
    }
    out->hanging = (HangingBatches){batch_count, mixed, start,
                                    vertex,      table, (const int(*)[LANES])element_class};
}

void batches_create(Batches *out, const BatchOptions *options, Arena *arena)
{
    const char *name = options->name;
    const int count = options->element_count;
    *out = (Batches){.element_count = count};
    Key *key = calloc((size_t)count + 1, sizeof *key);
    ASSERT(key != NULL);
    int *become = unite_classes(out, options, arena);
    int plain = sort_elements(options, become, key);
    out->place = ALLOCATE(ARENA_STEP, count, int, "places of elements");
    create_plain(out, options, key, plain, arena);
    create_hanging(out, options, become, key + plain, count - plain, arena);
    free(become);
    free(key);
}
