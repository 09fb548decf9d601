// SPDX-License-Identifier: MIT
// The rows and cells from which a body that cannot be cut publishes its smooth surface.
#include "voxel/fitted_body.h"

#include "base/check.h"

#include <stdlib.h>
#include <string.h>

// Lists the cells with an outer vertex, and the vertices that they need besides.
typedef struct Gathering {
    const LatticeMesh *mesh;
    int *row_of; // [vertex] -1: none
    int *vertex; // [row]
    int (*cell)[FIT_CORNERS];
    int row_count, cell_count;
} Gathering;

static void gather(Gathering *out, const Layout *layout)
{
    const LatticeMesh *mesh = out->mesh;
    for (int v = 0; v < mesh->vertex_count; v++)
        out->row_of[v] = v < mesh->surface_count ? v : -1;
    for (out->row_count = 0; out->row_count < mesh->surface_count; out->row_count++)
        out->vertex[out->row_count] = out->row_count;
    for (int e = 0; e < layout->leaf_count && layout->leaf[e].level == 0; e++) {
        const int *corner = mesh->vertex[e];
        bool outer = false;
        for (int k = 0; k < FIT_CORNERS; k++)
            outer |= corner[k] < mesh->surface_count;
        if (!outer)
            continue;
        for (int k = 0; k < FIT_CORNERS; k++) {
            int *row = &out->row_of[corner[k]];
            if (*row < 0) {
                *row = out->row_count++;
                out->vertex[*row] = corner[k];
            }
            out->cell[out->cell_count][k] = *row;
        }
        out->cell_count++;
    }
}

// Returns the outer triangles with the better diagonals.
static const int (*choose_triangles(const LatticeMesh *mesh, const float (*offset)[3],
                                    const char *name, Arena *arena))[3]
{
    int(*triangle)[3] = arena_allocate(arena, ARENA_OUTPUT, (size_t)mesh->face_count,
                                       sizeof *triangle, "%s/%s", name, "fitted triangles");
    for (int q = 0; q < mesh->face_count / 2; q++) {
        int corner[4];
        double at[4][3];
        lattice_mesh_corners(mesh, q, corner);
        for (int k = 0; k < 4; k++)
            for (int c = 0; c < 3; c++)
                at[k][c] = mesh->point[corner[k]][c] + (double)offset[corner[k]][c];
        const bool turned = fitted_turns_diagonal((const double(*)[3])at, false);
        for (int half = 0; half < 2; half++)
            for (int c = 0; c < 3; c++)
                triangle[2 * q + half][c] = corner[FITTED_TRIANGLES[turned][half][c]];
    }
    return (const int(*)[3])triangle;
}

// Lists the cells around each outer point.
static const int (*list_around(const Gathering *gathered, const char *name, Arena *arena))[8]
{
    const int nodes = gathered->mesh->surface_count;
    int(*around)[8] = arena_allocate(arena, ARENA_CONTACT, (size_t)nodes, sizeof *around, "%s/%s",
                                     name, "fitted cells of nodes");
    memset(around, -1, (size_t)nodes * sizeof *around);
    for (int c = 0; c < gathered->cell_count; c++)
        for (int k = 0; k < FIT_CORNERS; k++)
            if (gathered->cell[c][k] < nodes)
                around[gathered->cell[c][k]][FIT_CORNERS - 1 - k] = c;
    return (const int(*)[8])around;
}

static FittedBody *create_rows(const Gathering *gathered, const float (*offset)[3],
                               const VoxelOptions *options, Arena *arena)
{
    const int rows = gathered->row_count, cells = gathered->cell_count;
    const double size = options->lattice->size;
    const char *name = options->body.name;
    FittedBody *fitted = ALLOCATE(ARENA_OUTPUT, 1, FittedBody, "fitted");
    int *vertex = ALLOCATE(ARENA_OUTPUT, rows, int, "fitted vertices");
    int *row = ALLOCATE(ARENA_OUTPUT, gathered->mesh->surface_count, int, "fitted rows");
    float(*of_row)[3] = arena_allocate(arena, ARENA_OUTPUT, (size_t)rows, sizeof *of_row, "%s/%s",
                                       name, "fitted offsets");
    int(*cell)[FIT_CORNERS] = arena_allocate(arena, ARENA_OUTPUT, (size_t)cells, sizeof *cell,
                                             "%s/%s", name, "fitted cells");
    memcpy(vertex, gathered->vertex, (size_t)rows * sizeof *vertex);
    memcpy(cell, gathered->cell, (size_t)cells * sizeof *cell);
    for (int i = 0; i < gathered->mesh->surface_count; i++) {
        row[i] = i;
        memcpy(of_row[i], offset[i], sizeof of_row[i]);
    }
    if (!options->body.without_contacts)
        fitted->around = list_around(gathered, name, arena);
    fitted->vertex = vertex;
    fitted->size = size;
    fitted->fit = (BodyFit){.reach = FITTED_REACH * size,
                            .row_count = rows,
                            .cell_count = cells,
                            .row_capacity = rows,
                            .cell_capacity = cells,
                            .row = row,
                            .offset = (const float(*)[3])of_row,
                            .cell = (const int(*)[FIT_CORNERS])cell};
    return fitted;
}

void fitted_reserve(FittedBody *fitted, const char *name, Arena *arena)
{
    const int rows = fitted->fit.row_capacity;
    fitted->position = ALLOCATE(ARENA_OUTPUT, 3L * rows, float, "fitted positions");
    fitted->velocity = ALLOCATE(ARENA_OUTPUT, 3L * rows, float, "fitted velocities");
    fitted->scratch = ALLOCATE(ARENA_OUTPUT, (long)FIT_SCRATCH * rows, double, "fitted scratch");
}

void fitted_create(VoxelModel *model, Body *body, const LatticeMesh *mesh, const Layout *layout,
                   const VoxelOptions *options, Arena *arena)
{
    const char *name = options->body.name;
    double level;
    float(*offset)[3] = fitted_offsets(mesh, layout, options->field, &level);
    Gathering gathered = {.mesh = mesh};
    gathered.row_of = malloc(((size_t)mesh->vertex_count + 1) * sizeof(int));
    gathered.vertex = malloc(((size_t)mesh->vertex_count + 1) * sizeof(int));
    gathered.cell = malloc(((size_t)layout->leaf_count + 1) * sizeof *gathered.cell);
    ASSERT(gathered.row_of != NULL && gathered.vertex != NULL && gathered.cell != NULL);
    gather(&gathered, layout);
    model->fitted = create_rows(&gathered, (const float(*)[3])offset, options, arena);
    fitted_reserve(model->fitted, name, arena);
    body->mesh.fit = model->fitted->fit;
    body->mesh.triangle = choose_triangles(mesh, (const float(*)[3])offset, name, arena);
    free(gathered.row_of);
    free(gathered.vertex);
    free(gathered.cell);
    free(offset);
}

// ---------------------------------------------------------------------------------------------

void fitted_node(const FittedBody *fitted, const Rows *rows, int node, FitNode *out)
{
    *out = (FitNode){0};
    for (int c = 0; c < 3; c++) {
        out->offset[c] = (double)fitted->fit.offset[node][c];
        out->rest[c] = rows->rest[node][c] + fitted->size * out->offset[c];
    }
    for (int s = 0; s < 8; s++) {
        const int cell = fitted->around[node][s];
        if (cell < 0)
            continue;
        for (int k = 0; k < FIT_CORNERS; k++)
            out->corner[out->cell_count][k] = fitted->vertex[fitted->fit.cell[cell][k]];
        out->cell_count++;
    }
}

void fitted_snapshot_rows(const FittedBody *fitted, const Rows *rows, const void *row,
                          float *position, float *velocity)
{
    rows_snapshot(rows, row, fitted->vertex, fitted->fit.row_count, position, velocity);
}

void fitted_snapshot(const FittedBody *fitted, int node_count, float *position, float *velocity)
{
    const BodyFit *fit = &fitted->fit;
    fit_nodes(fit, node_count, fitted->position, fitted->scratch, position);
    if (velocity != NULL)
        fit_nodes(fit, node_count, fitted->velocity, fitted->scratch, velocity);
}

void fitted_snapshot_rest(const FittedBody *fitted, const Rows *rows, int node_count,
                          float *position)
{
    const BodyFit *fit = &fitted->fit;
    for (int i = 0; i < node_count; i++) {
        const int r = fit->row[i];
        const double *rest = rows->rest[fitted->vertex[r]];
        double at[3];
        for (int c = 0; c < 3; c++)
            at[c] = rest[c] + fitted->size * (double)fit->offset[r][c];
        const Vec3 x = rows_rest_out(rows, vec3(at[0], at[1], at[2]));
        position[3L * i] = (float)x.x;
        position[3L * i + 1] = (float)x.y;
        position[3L * i + 2] = (float)x.z;
    }
}
