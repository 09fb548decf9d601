#include "run/exchange.h"

#include <string.h>

int mesh_live_nodes(const BodyMesh *mesh)
{
    int live = 0;
    for (int i = 0; i < mesh->node_count; i++)
        live += mesh->id[i] >= 0;
    return live;
}

// Ints per node (id, origin, piece, two parents; the level is a byte) and per triangle.
enum { NODE_INTS = 5, TRIANGLE_INTS = 3 };

static size_t bytes_of(size_t nodes, size_t triangles)
{
    return (nodes * NODE_INTS + triangles * TRIANGLE_INTS) * sizeof(int) + nodes;
}

size_t mesh_copy_bytes(const BodyMesh *mesh)
{
    size_t bytes =
        sizeof(MeshCopy) + bytes_of((size_t)mesh->node_capacity, (size_t)mesh->triangle_capacity);
    return (bytes + 7) / 8 * 8;
}

BodyMesh mesh_copy_view(const MeshCopy *copy)
{
    size_t nodes = (size_t)copy->node_count;
    const int *id = copy->data, *origin = id + nodes, *piece = origin + nodes;
    const int *parent = piece + nodes, *triangle = parent + 2 * nodes;
    return (BodyMesh){
        .topology = copy->topology,
        .node_count = copy->node_count,
        .triangle_count = copy->triangle_count,
        .node_capacity = copy->node_capacity,
        .triangle_capacity = copy->triangle_capacity,
        .triangle = (const int(*)[3])triangle,
        .id = id,
        .origin = origin,
        .parent = (const int(*)[2])parent,
        .piece = piece,
        .level = (const signed char *)(triangle + 3 * (size_t)copy->triangle_count),
    };
}

static unsigned char *append(unsigned char *to, const void *from, size_t bytes)
{
    if (bytes > 0) // memcpy from NULL is undefined even for no bytes
        memcpy(to, from, bytes);
    return to + bytes;
}

void mesh_copy_follow(MeshCopy *copy, const BodyMesh *mesh)
{
    if (copy->node_count > 0 && copy->topology == mesh->topology)
        return;
    size_t nodes = (size_t)mesh->node_count, triangles = (size_t)mesh->triangle_count;
    copy->topology = mesh->topology;
    copy->node_count = mesh->node_count;
    copy->triangle_count = mesh->triangle_count;
    copy->node_capacity = mesh->node_capacity;
    copy->triangle_capacity = mesh->triangle_capacity;
    // Arrays follow in the order of mesh_copy_view.
    unsigned char *to = (unsigned char *)copy->data;
    to = append(to, mesh->id, nodes * sizeof *mesh->id);
    to = append(to, mesh->origin, nodes * sizeof *mesh->origin);
    to = append(to, mesh->piece, nodes * sizeof *mesh->piece);
    to = append(to, mesh->parent, nodes * sizeof *mesh->parent);
    to = append(to, mesh->triangle, triangles * sizeof *mesh->triangle);
    append(to, mesh->level, nodes * sizeof *mesh->level);
}

size_t rest_copy_bytes(const BodyMesh *mesh)
{
    size_t bytes = sizeof(RestCopy) + 3 * (size_t)mesh->node_capacity * sizeof(float);
    return (bytes + 7) / 8 * 8;
}

void rest_copy_follow(RestCopy *copy, const Body *body)
{
    const BodyMesh *mesh = &body->mesh;
    if (copy->node_count > 0 && copy->topology == mesh->topology)
        return;
    copy->topology = mesh->topology;
    copy->node_count = mesh->node_count;
    body->ops->snapshot_rest(body->model, copy->position);
    for (int i = 0; i < mesh->node_count; i++)
        if (mesh->id[i] < 0)
            memset(copy->position + 3L * i, 0, 3 * sizeof *copy->position);
}

void rest_copy_take(RestCopy *copy, const RestCopy *from)
{
    if (copy->node_count > 0 && copy->topology == from->topology)
        return;
    memcpy(copy, from, sizeof *from + 3 * (size_t)from->node_count * sizeof *from->position);
}

void rest_texture(const Body *body, const BodyMesh *mesh, int first, int end, float *uv)
{
    for (int i = first; i < end; i++, uv += 2) {
        int id = mesh->id[i];
        if (id >= body->texture_count)
            id = mesh->origin[i];
        bool known = id >= 0 && id < body->texture_count;
        uv[0] = known ? body->texture[id][0] : 0.0F;
        uv[1] = known ? body->texture[id][1] : 0.0F;
    }
}
