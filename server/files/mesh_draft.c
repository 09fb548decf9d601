#include "files/mesh_draft.h"

#include "base/check.h"

#include <stdlib.h>
#include <string.h>

static void *grown(void *array, int capacity, size_t size)
{
    array = realloc(array, (size_t)capacity * size);
    ASSERT(array != NULL);
    return array;
}

void mesh_draft_add_node(MeshDraft *draft, Vec3 position)
{
    if (draft->node_count == draft->node_capacity) {
        draft->node_capacity = draft->node_capacity == 0 ? 1024 : 2 * draft->node_capacity;
        draft->position = grown(draft->position, draft->node_capacity, sizeof *draft->position);
    }
    draft->position[draft->node_count++] = position;
}

void mesh_draft_add_triangle(MeshDraft *draft, const int corner[3], int line)
{
    if (draft->triangle_count == draft->triangle_capacity) {
        int capacity = draft->triangle_capacity == 0 ? 1024 : 2 * draft->triangle_capacity;
        draft->triangle_capacity = capacity;
        draft->triangle = grown(draft->triangle, capacity, sizeof *draft->triangle);
        draft->line = grown(draft->line, capacity, sizeof *draft->line);
    }
    memcpy(draft->triangle[draft->triangle_count], corner, sizeof *draft->triangle);
    draft->line[draft->triangle_count++] = line;
}

void mesh_draft_finish(const MeshDraft *draft, TriMesh *mesh)
{
    mesh_create(mesh, draft->node_count, draft->triangle_count);
    for (int i = 0; i < draft->node_count; i++)
        mesh->position[i] = draft->position[i];
    for (int t = 0; t < draft->triangle_count; t++)
        memcpy(mesh->triangle[t], draft->triangle[t], sizeof *mesh->triangle);
}

void mesh_draft_destroy(MeshDraft *draft)
{
    free(draft->position);
    free(draft->triangle);
    free(draft->line);
    *draft = (MeshDraft){0};
}
