#include "run/rest_copy.h"

#include <string.h>

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
