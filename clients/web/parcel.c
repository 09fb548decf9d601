// Messages to pages, built once and shared by all. Any thread.
#include "parcel.h"

#include <stdlib.h>
#include <string.h>

// Binary messages are written in memory order.
_Static_assert(__BYTE_ORDER__ == __ORDER_LITTLE_ENDIAN__, "the page expects little-endian numbers");

enum { KIND_MESH = 1, KIND_NODES = 2, KIND_REST = 3, HEADER_WORDS = 6 };

static Parcel *make(bool text, size_t size)
{
    Parcel *parcel = malloc(sizeof *parcel + size);
    if (!parcel)
        abort(); // messages are bounded: the machine itself is out of memory
    atomic_init(&parcel->holders, 1);
    parcel->text = text;
    parcel->size = size;
    return parcel;
}

// Copies `count` elements to *at and advances it.
static void put(unsigned char **at, const void *from, size_t count, size_t size)
{
    if (count)
        memcpy(*at, from, count * size);
    *at += count * size;
}

static void put_header(unsigned char **at, uint32_t kind, int body, int32_t topology, int nodes,
                       uint32_t fifth)
{
    const uint32_t header[HEADER_WORDS] = {
        kind, (uint32_t)body, (uint32_t)topology, (uint32_t)nodes, fifth, 0};
    put(at, header, kind == KIND_NODES ? 4 : HEADER_WORDS, sizeof *header);
}

Parcel *parcel_text(const char *text)
{
    size_t size = strlen(text);
    Parcel *parcel = make(true, size);
    memcpy(parcel->data, text, size);
    return parcel;
}

Parcel *parcel_mesh(int body, const MeshFrame *mesh)
{
    size_t n = (size_t)mesh->node_count, t = (size_t)mesh->triangle_count;
    Parcel *parcel = make(false, 4 * HEADER_WORDS + 12 * t + (4 + 4 + 8 + 4 + 1) * n);
    unsigned char *at = parcel->data;
    put_header(&at, KIND_MESH, body, mesh->topology, mesh->node_count,
               (uint32_t)mesh->triangle_count);
    put(&at, mesh->triangle, 3 * t, sizeof *mesh->triangle);
    put(&at, mesh->id, n, sizeof *mesh->id);
    put(&at, mesh->origin, n, sizeof *mesh->origin);
    put(&at, mesh->parent, 2 * n, sizeof *mesh->parent);
    put(&at, mesh->piece, n, sizeof *mesh->piece);
    put(&at, mesh->level, n, sizeof *mesh->level);
    return parcel;
}

Parcel *parcel_nodes(int body, const NodesFrame *nodes)
{
    const double times[3] = {nodes->time, (double)nodes->step, (double)nodes->utime};
    size_t n = (size_t)nodes->node_count;
    Parcel *parcel = make(false, 16 + sizeof times + 12 * n);
    unsigned char *at = parcel->data;
    put_header(&at, KIND_NODES, body, nodes->topology, nodes->node_count, 0);
    put(&at, times, 3, sizeof *times);
    put(&at, nodes->position, 3 * n, sizeof *nodes->position);
    return parcel;
}

Parcel *parcel_rest(int body, const RestFrame *rest)
{
    size_t n = (size_t)rest->node_count;
    Parcel *parcel = make(false, 4 * HEADER_WORDS + (rest->textured ? 20 : 12) * n);
    unsigned char *at = parcel->data;
    put_header(&at, KIND_REST, body, rest->topology, rest->node_count, rest->textured);
    put(&at, rest->position, 3 * n, sizeof *rest->position);
    put(&at, rest->texture, rest->textured ? 2 * n : 0, sizeof *rest->texture);
    return parcel;
}

Parcel *parcel_hold(Parcel *parcel)
{
    if (parcel)
        atomic_fetch_add_explicit(&parcel->holders, 1, memory_order_relaxed);
    return parcel;
}

void parcel_drop(Parcel *parcel)
{
    if (parcel && atomic_fetch_sub_explicit(&parcel->holders, 1, memory_order_acq_rel) == 1)
        free(parcel);
}

bool parcel_equal(const Parcel *a, const Parcel *b)
{
    return a && b && a->size == b->size && memcmp(a->data, b->data, a->size) == 0;
}
