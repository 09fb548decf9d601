#include "surface/fixed.h"

bool fixed_mark(const TriMesh *mesh, const SurfaceOptions *options, bool *fixed, Status *status)
{
    const Levels *levels = options->hierarchy;
    int nodes = levels != NULL ? levels->level[0].node_count : mesh->node_count;
    for (int r = 0; r < options->body.fixed_count; r++) {
        const FixedRegion *region = &options->body.fixed[r];
        if (region->kind == FIXED_NODES) {
            for (int k = 0; k < region->node_count; k++) {
                int node = mesh_node_of_file(mesh, region->node[k]);
                if (node < 0)
                    return status_fail(status, STATUS_INVALID,
                                       "fixed: node %d is not a node of the mesh (%d in its file)",
                                       region->node[k], mesh->file_node_count);
                fixed[node] = true;
            }
            continue;
        }
        for (int i = 0; i < nodes; i++)
            if (fixed_contains(region, mesh->position[i]))
                fixed[i] = true;
    }
    // Copies, the last nodes of the mesh, have no number of their own in the file: they follow
    // their originals.
    for (int c = 0; c < mesh->copy_count; c++)
        if (fixed[mesh_node_of_file(mesh, mesh->copy_of[c])])
            fixed[nodes - mesh->copy_count + c] = true;
    // A midpoint is fixed when both its parents are.
    for (int l = 0; levels != NULL && l < levels->finest; l++) {
        const Level *level = &levels->level[l];
        for (int e = 0; e < level->edge_count; e++)
            fixed[level->node_count + e] = fixed[level->edge[e][0]] && fixed[level->edge[e][1]];
    }
    return true;
}
