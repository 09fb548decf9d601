// SPDX-License-Identifier: MIT
// Local stiffness of a voxel body, for haptics (body/patch.h): that of each element at its
// current rotation, without the derivative of the rotation, so that it is positive. With F = sum
// u_i g_i^T and b_i = R g_i the stiffness between two vertices of an element is
//   V (mu (b_i . b_k 1 + b_k b_i^T) + lambda b_i b_k^T)
//   + r (w_i d_ik - w_i w_k / sum w - w_i w_k X_i^T M^-1 X_k) 1,
// where Miyazaki's law has g_i = 3 X_i / tr M, V mu = k tr M / 6 and r = k. Of an element that
// stiffens it is G' times that, the secant of the present state. With the tangent along the
// deformation (G''/(c V) f_i f_k^T added, f being the linear law's forces) 1.4 to 1.8 times too
// much was told, as the softer tissue around a press is beyond the patch; with the secant 0.97
// to 1.14 (test_voxel_stiffness.c). Step thread.
#include "body/patch.h"

#include "voxel/model.h"
#include "voxel/rotation.h"
#include "voxel/stiffening.h"

#include <string.h>

// An element with the kernels' numbers, in double precision.
typedef struct PatchElement {
    int count;
    int vertex[NODE_COUNT];
    Vec3 g[NODE_COUNT];          // [1/m]
    Vec3 rest[NODE_COUNT];       // X, in edge lengths
    Vec3 lever[NODE_COUNT];      // w M^-1 X, likewise
    double weight[NODE_COUNT];   // w
    double mu, lambda, residual; // V mu, V lambda [N m]; r [N/m]
    double f[3][3], r[3][3];     // F and R, in the base frame
    double factor, damping;      // G', and that of the damping; 1 unless it stiffens
} PatchElement;

// Adds the free vertices in the region, from patch->next on; when done, starts the next pass.
static void add_vertices(const Vertices *vertices, Patch *patch, int *budget)
{
    const Region here = rows_region(&vertices->rows, &patch->region);
    const RegionTest test = region_test(&here);
    const void *row = vertices_row(vertices);
    for (; patch->next<vertices->count && * budget> 0; patch->next++, --*budget) {
        int i = (int)patch->next;
        if (!region_contains(&test, rows_local(&vertices->rows, row, i)))
            continue;
        // Fixed vertices do not move: they are no unknowns.
        double inverse = rows_get(&vertices->rows, vertices->inverse_mass, i);
        if (inverse > 0.0 && !patch_add_node(patch, i, 1.0 / inverse, 0.0, 0.0))
            return;
    }
    // Not through yet: continue in the next tick.
    if (patch->next < vertices->count)
        return;
    patch->pass++;
    patch->next = 0;
}

static bool is_near(const Patch *patch, const int *vertex, int count)
{
    for (int p = 0; p < count; p++)
        if (patch->local[vertex[p * LANES]] >= 0)
            return true;
    return false;
}

// Computes the deformation and the rotation of an element: the best fit of its vertices. `last` as
// in VoxelPass.
static void find_rotation(const Vertices *vertices, PatchElement *piece, const double last[4])
{
    const Rows *rows = &vertices->rows;
    const void *row = vertices_row(vertices);
    double f[3][3] = {{1.0, 0.0, 0.0}, {0.0, 1.0, 0.0}, {0.0, 0.0, 1.0}}, r[3][3];
    // F = 1 + sum u_i g_i^T.
    for (int i = 0; i < piece->count; i++) {
        Vec3 moved = rows_vector(rows, row, piece->vertex[i], 0), g = piece->g[i];
        const double u[3] = {moved.x, moved.y, moved.z}, by[3] = {g.x, g.y, g.z};
        for (int k = 0; k < 9; k++)
            f[k / 3][k % 3] += u[k / 3] * by[k % 3];
    }
    Quat before = {last[0], last[1], last[2], last[3]};
    rotation_fit((const double(*)[3])f, r, &before);
    memcpy(piece->f, f, sizeof f);
    memcpy(piece->r, r, sizeof r);
}

// Computes how an element stiffens in its present state.
static void find_stiffening(const VoxelModel *model, const ElementClass *by, PatchElement *piece)
{
    const Rows *rows = &model->vertices.rows;
    const void *row = vertices_row(&model->vertices);
    StiffElement stiff = {.count = piece->count};
    for (int i = 0; i < piece->count; i++) {
        stiff.weight[i] = piece->weight[i];
        stiff.rest[i] = piece->rest[i];
        stiff.lever[i] = piece->lever[i];
        stiff.u[i] = vec3_scale(1.0 / by->size, rows_vector(rows, row, piece->vertex[i], 0));
    }
    const StiffeningCurve *curve = &model->stiffening->curve;
    const double q = stiff_q(model->stiffening, by, (const double(*)[3])piece->f,
                             (const double(*)[3])piece->r, stiff_residual(&stiff));
    piece->factor = stiffening_factor(curve, q);
    piece->damping = stiffening_damping(curve, q);
}

// Adds the element's stiffness to the patch.
static void add_element(const Vertices *vertices, Patch *patch, const PatchElement *piece)
{
    double turn[3][3], total = 0.0, m[9];
    Vec3 b[NODE_COUNT];
    // The rotation in the world's axes.
    for (int k = 0; k < 3; k++) {
        Vec3 column = vec3(piece->r[0][k], piece->r[1][k], piece->r[2][k]);
        if (vertices->rows.turned)
            column = quat_rotate(vertices->rows.frame->turn, column);
        turn[0][k] = column.x, turn[1][k] = column.y, turn[2][k] = column.z;
    }
    // Rotate the gradients.
    for (int i = 0; i < piece->count; i++) {
        Vec3 g = piece->g[i];
        b[i] = vec3(turn[0][0] * g.x + turn[0][1] * g.y + turn[0][2] * g.z,
                    turn[1][0] * g.x + turn[1][1] * g.y + turn[1][2] * g.z,
                    turn[2][0] * g.x + turn[2][1] * g.y + turn[2][2] * g.z);
        total += piece->weight[i];
    }
    // A block for each pair of vertices that are both in the patch.
    for (int i = 0; i < piece->count; i++) {
        int a = patch->local[piece->vertex[i]];
        const double p[3] = {b[i].x, b[i].y, b[i].z};
        for (int k = i; k < piece->count && a >= 0; k++) {
            int c = patch->local[piece->vertex[k]];
            if (c < 0)
                continue;
            const double q[3] = {b[k].x, b[k].y, b[k].z};
            // The part that is the same in all directions: shear and residual.
            double even =
                piece->mu * vec3_dot(b[i], b[k]) -
                piece->residual * piece->weight[i] *
                    (piece->weight[k] / total + vec3_dot(piece->rest[i], piece->lever[k]));
            if (i == k)
                even += piece->residual * piece->weight[i];
            // Shear and bulk along the two gradients.
            for (int e = 0; e < 9; e++)
                m[e] = piece->mu * q[e / 3] * p[e % 3] + piece->lambda * p[e / 3] * q[e % 3] +
                       (e % 4 == 0 ? even : 0.0);
            patch_add_block(patch, a, c, m);
        }
    }
}

// Sets the parameters of a class with the current scales; damping that acts on all non-rigid motion
// is treated like Miyazaki's law. `spread` is tr M in edge lengths squared.
static void set_factors(const VoxelModel *model, Patch *patch, const ElementClass *by,
                        double spread, PatchElement *piece)
{
    const Vertices *vertices = &model->vertices;
    const BodyParameters *scale = vertices->parameters;
    const double h = by->size, volume = h * h * h;
    const bool paper = model->law == VOXEL_MIYAZAKI2004;
    double damping = vertices->damping_time > 0.0 ? scale->damping_scale * by->damping : 0.0;
    damping *= piece->damping;
    double stiff = paper ? by->residual : by->mu * h;
    double like = (model->viscous ? 0.0 : damping / patch->time) + (paper ? by->residual : 0.0);
    // What stiffening and viscous damping make of the stiffness.
    double more =
        piece->factor + (model->viscous && stiff > 0.0 ? damping / (stiff * patch->time) : 0.0);
    piece->mu = scale->stiffness_scale *
                ((paper ? 0.0 : more * by->mu * volume) + like * spread * h * h / 6.0);
    piece->lambda = paper ? 0.0 : scale->stiffness_scale * more * by->lambda * volume;
    piece->residual = scale->stiffness_scale * (like + (paper ? 0.0 : more * by->residual));
    // What branches resist a motion of that duration by.
    const Relaxation *relaxation = model->batches->relaxation;
    for (int i = 0; relaxation != NULL && i < relaxation->count; i++) {
        const MaxwellBranch *branch = &relaxation->branch[i];
        const double e = scale->stiffness_scale * volume * branch->share * relaxation->rigidity *
                         exp(-0.5 * patch->time / branch->time);
        piece->mu += e * by->mu;
        piece->lambda += e * (branch->volumetric ? by->lambda : -2.0 / 3.0 * by->mu);
    }
    if (stiff > 0.0)
        patch->relaxation = fmax(patch->relaxation, damping / stiff);
}

// Adds an element with all of its vertices.
static void add_whole(const VoxelModel *model, Patch *patch, const ElementClass *by, double spread,
                      const double last[4], PatchElement *piece)
{
    find_rotation(&model->vertices, piece, last);
    piece->factor = piece->damping = 1.0;
    if (model->stiffening != NULL)
        find_stiffening(model, by, piece);
    set_factors(model, patch, by, spread, piece);
    add_element(&model->vertices, patch, piece);
}

static bool add_plain(const VoxelModel *model, Patch *patch, int batch, int lane)
{
    const PlainBatches *plain = &model->batches->plain;
    const ElementClass *by = &model->batches->classes[plain->element_class[batch]];
    const int *vertex = plain->vertex + (long)batch * NODE_CORNERS * LANES + lane;
    if (!is_near(patch, vertex, NODE_CORNERS))
        return false;
    PatchElement piece = {.count = NODE_CORNERS};
    for (int p = 0; p < NODE_CORNERS; p++) {
        Vec3 sign = vec3((p & 1) - 0.5, (p >> 1 & 1) - 0.5, (p >> 2 & 1) - 0.5);
        piece.vertex[p] = vertex[p * LANES];
        piece.rest[p] = sign;
        piece.lever[p] = vec3_scale(0.5, sign); // M = 2 in each axis
        piece.weight[p] = 1.0;
        piece.g[p] = vec3_scale(0.5 / by->size, sign);
    }
    add_whole(model, patch, by, 6.0, model->batches->last[batch][lane], &piece);
    return true;
}

// Adds one vertex with the numbers of its row of a RestTable; returns its part of tr M.
static double add_row(VoxelLaw law, const ElementClass *by, const double row[TABLE_ROW], int vertex,
                      PatchElement *piece)
{
    int i = piece->count++;
    piece->vertex[i] = vertex;
    piece->g[i] = vec3_scale(1.0 / by->size, vec3(row[0], row[1], row[2]));
    piece->weight[i] = row[3];
    piece->rest[i] = vec3(row[4], row[5], row[6]);
    // For Miyazaki's law the table has only 3 X / tr M, which approximates M^-1 X.
    piece->lever[i] =
        law == VOXEL_AFFINE ? vec3(row[7], row[8], row[9]) : vec3(row[0], row[1], row[2]);
    return row[3] * vec3_dot(piece->rest[i], piece->rest[i]);
}

static bool add_hanging(const VoxelModel *model, Patch *patch, int batch, int lane)
{
    const HangingBatches *hanging = &model->batches->hanging;
    const ElementClass *by = &model->batches->classes[hanging->element_class[batch][lane]];
    const int *vertex = hanging->vertex + (long)hanging->start[batch] * LANES + lane;
    const RestTable *table = &model->batches->tables[hanging->table[batch]];
    const int spare = model->vertices.capacity;
    // Most elements are far from the contact.
    if (!is_near(patch, vertex, table->count))
        return false;
    // Its rest shape, from the numbers of the kernel.
    PatchElement piece = {0};
    double spread = 0.0;
    for (int p = 0; p < table->count && vertex[p * LANES] != spare; p++) {
        double row[TABLE_ROW];
        for (int k = 0; k < TABLE_ROW; k++) {
            long at = TABLE_HEAD + (long)p * TABLE_ROW + k;
            row[k] = rows_get(&model->vertices.rows, table->number,
                              at * table->stride + (table->stride > 1 ? lane : 0));
        }
        spread += add_row(model->law, by, row, vertex[p * LANES], &piece);
    }
    // Its stiffness, at its current rotation.
    add_whole(model, patch, by, spread,
              model->batches->last[model->batches->plain.batch_count + batch][lane], &piece);
    return true;
}

// Adds the elements of a batch; returns what that takes of the budget.
static int add_batch(const VoxelModel *model, Patch *patch, bool hanging, int batch)
{
    enum { SKIPPED = 4, ADDED = 128 }; // per element
    int cost = 0;
    for (int lane = 0; lane < LANES; lane++) {
        const bool added =
            hanging ? add_hanging(model, patch, batch, lane) : add_plain(model, patch, batch, lane);
        cost += added ? ADDED : SKIPPED;
    }
    return cost;
}

// Goes on with the first batch in use from number patch->next on. True when there is none left.
static bool add_batches(const VoxelModel *model, Patch *patch, int budget)
{
    const int plain = model->batches->plain.batch_count;
    int end = 0;
    for (int batch; (batch = batch_runs_next(model->batches, (int)patch->next, &end)) >= 0;)
        for (patch->next = batch; patch->next < end; patch->next++) {
            if (budget <= 0)
                return false;
            const bool hanging = batch >= plain;
            budget -= add_batch(model, patch, hanging, (int)patch->next - (hanging ? plain : 0));
        }
    return true;
}

bool voxel_gather_patch(const void *self, Patch *patch, int budget)
{
    const VoxelModel *model = self;
    if (patch->pass == 0)
        add_vertices(&model->vertices, patch, &budget);
    const bool complete = patch->pass == 1 && add_batches(model, patch, budget);
    return patch->full || complete;
}
