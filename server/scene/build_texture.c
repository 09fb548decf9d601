// Texture coordinates of a body's published mesh, for scenes with publish.rest. Load time only.
#include "scene/build_parts.h"

#include <stdlib.h>

// Returns the published id of node i of the mesh or its levels.
static int id_of(const TriMesh *mesh, int i)
{
    if (i < mesh->node_count)
        return mesh->file_index[i];
    return mesh->file_node_count + mesh->copy_count + i - mesh->node_count;
}

Texture build_texture(World *world, const Scene *scene, const BuildOptions *options,
                      const char *name, TriMesh *mesh, const Levels *levels)
{
    Texture texture = {0};
    if (mesh->uv != NULL && scene->publish.rest && options->publishes) {
        const int roots = mesh->node_count;
        const int nodes = levels != NULL ? levels->level[levels->finest].node_count : roots;
        texture.count = mesh->file_node_count + mesh->copy_count + nodes - roots;
        float(*uv)[2] = arena_allocate(&world->arena, ARENA_OUTPUT, (size_t)texture.count,
                                       sizeof *uv, "%s/texture", name);
        for (int i = 0; i < roots; i++)
            for (int c = 0; c < 2; c++)
                uv[id_of(mesh, i)][c] = (float)mesh->uv[i][c];
        for (int i = roots; i < nodes; i++) { // parents come before their children
            int parent[2];
            levels_parents(levels, i, parent);
            const float *a = uv[id_of(mesh, parent[0])], *b = uv[id_of(mesh, parent[1])];
            for (int c = 0; c < 2; c++)
                uv[id_of(mesh, i)][c] = 0.5F * (a[c] + b[c]);
        }
        texture.uv = (const float(*)[2])uv;
    }
    free(mesh->uv); // no other code uses them
    mesh->uv = NULL;
    return texture;
}
