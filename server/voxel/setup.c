#include "voxel/setup.h"

#include <string.h>

bool setup_check(const VoxelOptions *options, bool has_kernels, int vertices, Status *status)
{
    if (!has_kernels)
        return status_fail(status, STATUS_INVALID,
                           "isa %s is not a level that this machine can run", options->body.isa);
    if (options->body.initial_position != NULL && options->body.initial_count != vertices)
        return status_fail(status, STATUS_INVALID, "initial has %d rows, the body %d vertices",
                           options->body.initial_count, vertices);
    return true;
}

int setup_held_vertex(const VertexId *by_id, int vertices, int id, Status *status)
{
    int vertex = vertex_ids_find(by_id, vertices, id);
    if (vertex < 0)
        status_fail(status, STATUS_INVALID,
                    "fixed: node %d is not a vertex of the body (%d vertices)", id, vertices);
    return vertex;
}

static bool hold_nodes(const FixedRegion *region, const VertexId *by_id, int vertices, bool *fixed,
                       Status *status)
{
    for (int k = 0; k < region->node_count; k++) {
        int vertex = setup_held_vertex(by_id, vertices, region->node[k], status);
        if (vertex < 0)
            return false;
        fixed[vertex] = true;
    }
    return true;
}

bool setup_fixed(const VoxelOptions *options, const VertexId *by_id, int vertices,
                 SetupPlace *place, const void *mesh, bool *fixed, Status *status)
{
    for (int r = 0; r < options->body.fixed_count; r++) {
        const FixedRegion *region = &options->body.fixed[r];
        if (region->kind == FIXED_NODES) {
            if (!hold_nodes(region, by_id, vertices, fixed, status))
                return false;
            continue;
        }
        for (int v = 0; v < vertices; v++)
            fixed[v] |= fixed_contains(region, place(options->lattice, mesh, v));
    }
    return true;
}

void setup_vertices(Vertices *vertices, const VoxelOptions *options, const int (*point)[3],
                    const VertexId *by_id, const bool *fixed, int elements, int loadable_count,
                    Arena *arena, StateList *state)
{
    const Lattice *lattice = options->lattice;
    const int *cells = lattice->count;
    Rows *rows = &vertices->rows;
    const int most = vertices->capacity > 0 ? vertices->capacity : vertices->count;
    const double middle[3] = {0.5 * cells[0], 0.5 * cells[1], 0.5 * cells[2]};
    rows->longest_edge = lattice->size;
    rows->rest_origin = lattice_point(lattice, middle[0], middle[1], middle[2]);
    rows->rest_turn = lattice->turn;
    rows->place = arena_allocate(arena, ARENA_STEP, (size_t)most + 1, sizeof *rows->place,
                                 "%s/places", options->body.name);
    for (int i = 0; i < vertices->count; i++)
        for (int c = 0; c < 3; c++)
            rows->place[i][c] = lattice->size * (point[i][c] - middle[c]);
    vertices->team = options->body.team;
    vertices->halved = elements >= SETUP_HALVED_LEAST;
    vertices_create(vertices, options, by_id, fixed, loadable_count,
                    lattice->size * (cells[0] + cells[1] + cells[2]), arena, state);
}

void setup_frame(Vertices *vertices, const char *name, Arena *arena, StateList *state)
{
    Rows *rows = &vertices->rows;
    if (!rows->floating)
        return;
    double *weight = arena_allocate(arena, ARENA_STEP, (size_t)rows->count, sizeof *weight, "%s/%s",
                                    name, "frame weights");
    memcpy(weight, vertices->mass, (size_t)vertices->count * sizeof *weight);
    rows->rigid = rigid_frame_create(name, rows->precision, true, rows->count,
                                     (const double(*)[3])rows->place, weight, arena, state);
}
