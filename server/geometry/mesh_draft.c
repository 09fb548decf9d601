#include "geometry/mesh_draft.h"

#include "base/check.h"

#include <stdlib.h>

// Grows the capacity for one more element if necessary; false when the limit is reached.
static bool has_room(MeshDraft *draft, int count, int *capacity)
{
    if (count == MESH_COUNT_MAX)
        draft->full = true;
    if (draft->full)
        return false;
    if (count == *capacity)
        *capacity = *capacity == 0 ? 1024 : 2 * *capacity;
    return true;
}

static void *grown(void *array, int capacity, size_t size)
{
    array = realloc(array, (size_t)capacity * size);
    ASSERT(array != NULL);
    return array;
}

void mesh_draft_add_node(MeshDraft *draft, Vec3 position)
{
    int before = draft->node_capacity;
    if (!has_room(draft, draft->node_count, &draft->node_capacity))
        return;
    if (draft->node_capacity != before)
        draft->position = grown(draft->position, draft->node_capacity, sizeof *draft->position);
    draft->position[draft->node_count++] = position;
}

void mesh_draft_add_uv(MeshDraft *draft, double u, double v)
{
    int before = draft->uv_capacity;
    if (!has_room(draft, draft->uv_count, &draft->uv_capacity))
        return;
    if (draft->uv_capacity != before)
        draft->uv = grown(draft->uv, draft->uv_capacity, sizeof *draft->uv);
    draft->uv[draft->uv_count][0] = u;
    draft->uv[draft->uv_count++][1] = v;
}

void mesh_draft_add_corner(MeshDraft *draft, int node, int uv)
{
    int before = draft->corner_capacity;
    if (!has_room(draft, draft->corner_count, &draft->corner_capacity))
        return;
    if (draft->corner_capacity != before) {
        draft->corner = grown(draft->corner, draft->corner_capacity, sizeof *draft->corner);
        if (draft->keeps_uv)
            draft->corner_uv =
                grown(draft->corner_uv, draft->corner_capacity, sizeof *draft->corner_uv);
    }
    if (draft->keeps_uv)
        draft->corner_uv[draft->corner_count] = uv;
    draft->corner[draft->corner_count++] = node;
}

void mesh_draft_end_polygon(MeshDraft *draft, int line)
{
    int before = draft->polygon_capacity;
    if (!has_room(draft, draft->polygon_count, &draft->polygon_capacity))
        return;
    if (draft->polygon_capacity != before) {
        draft->end = grown(draft->end, draft->polygon_capacity, sizeof *draft->end);
        draft->line = grown(draft->line, draft->polygon_capacity, sizeof *draft->line);
    }
    draft->end[draft->polygon_count] = draft->corner_count;
    draft->line[draft->polygon_count++] = line;
}

void mesh_draft_destroy(MeshDraft *draft)
{
    free(draft->position);
    free(draft->corner);
    free(draft->corner_uv);
    free(draft->end);
    free(draft->line);
    free(draft->uv);
    *draft = (MeshDraft){0};
}
