#include "voxel/setup.h"

#include <string.h>

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
    vertices->damped = options->damping > 0.0;
    vertices_create(vertices, &options->body, by_id, fixed, loadable_count,
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
