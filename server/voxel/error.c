// SPDX-License-Identifier: MIT
// Recovered against element strains (Zienkiewicz and Zhu 1987): a round copies the displacements,
// so that all of it sees one state, collects at each vertex the mean of the strains that its
// elements have in that corner, then compares it with them. Strains are R^T F - 1, in the axes at
// rest, so that rotations of the body and of its parts do not count.
#include "voxel/error.h"

#include "base/check.h"
#include "voxel/cut/cut_body.h"
#include "voxel/fitted_body.h"
#include "voxel/model.h"
#include "voxel/rotation.h"
#include "voxel/skin.h"

#include <math.h>
#include <string.h>

// Energy of an overlap over force and its greatest depth: 1/2 int p^2 / int p of a ball's pressure,
// which falls as the root of 1 - s^2 to its edge (Hertz).
static const double OVERLAP_SHARE = 0.375;
// Relative change of a force over that of the way of its tool times force over energy: f ~ way^3/2,
// so U = 2/5 f way (Hertz).
static const double BY_WAY = 0.6;
// Least that is left of the terms of a tool's force, which cancel each other; and of the defects of
// elements beneath the finest ones, which change it either way.
static const double LEAST_LEFT = 0.12, LARGER_LEFT = 0.3;
// Error of what a grasper pulls, by which vertices happen to be within it [cells over its radius].
static const double BY_GRIP = 0.2;
// Reach of the surroundings of a tool [its radius and 1.5 edges of an element].
static const double NEAR_TOOL = 2.0;

// What a round does, one after the other.
typedef enum ErrorPass {
    COPY_MOTION, // at once
    GATHER_STRAINS,
    COMPARE_STRAINS,
    MEASURE_MOTION,
    SHOW
} ErrorPass;

enum { STRAINS = 6 };                // xx yy zz yz zx xy
enum { VERTICES = 16, CARRIED = 2 }; // that take as long as an element
enum { OUTER_MOST = 4096 };          // carried ones by which their mean displacement is known

// Sums over the corners of elements at a vertex. A corner weighs 1 / H, so that what elements of
// two sizes have in their middles is interpolated to the vertex between them.
typedef struct VertexError {
    float u[3]; // displacement as the round began [m]
    float strain[STRAINS];
    float weight;  // [1/m]
    float corners; // how many, each an eighth of the surroundings
    float defect;  // energy per volume of the differences [J/m3], times weight
} VertexError;

typedef struct ErrorSums {
    double energy, defect;                                     // of all elements [J]
    double near_energy[ERROR_TOOLS], near_defect[ERROR_TOOLS]; // the latter of finest elements,
    double near_larger[ERROR_TOOLS];                           // and of others
    double square; // of the displacements of outer vertices, summed [m2]
    int outer;
    float largest; // defect at a vertex [J/m3]
} ErrorSums;

typedef struct VoxelError {
    VertexError *vertex; // [capacity]
    float *shown;        // [capacity] defect of the last complete round [J/m3]
    float largest;       // of these
    int capacity;
    // --- within a round; of a driven body part of the state, as the vertices are ---
    int used; // vertices that ever were in use
    ErrorPass pass;
    int next; // batch, hanging ones after the plain ones; or vertex, or published node
    ErrorSums sums;
} VoxelError;

VoxelError *voxel_error_create(int capacity, const char *name, Arena *arena, StateList *state)
{
    VoxelError *error = ALLOCATE(ARENA_OUTPUT, 1, VoxelError, "error");
    error->vertex = ALLOCATE(ARENA_OUTPUT, capacity, VertexError, "recovered strains");
    error->shown = ALLOCATE(ARENA_OUTPUT, capacity, float, "error by vertex");
    error->capacity = capacity;
    if (state == NULL)
        return error;
    // Not by names of the body's own arrays: tries of its steps (sim/estimate.c) change none of it.
    state_add(state, error->vertex, (size_t)capacity * sizeof *error->vertex, "error of %s/strains",
              name);
    state_add(state, &error->used, sizeof error->used, "error of %s/used", name);
    state_add(state, &error->pass, sizeof error->pass, "error of %s/pass", name);
    state_add(state, &error->next, sizeof error->next, "error of %s/next", name);
    state_add(state, &error->sums, sizeof error->sums, "error of %s/sums", name);
    return error;
}

static void copy_motion(const VoxelModel *model, int vertex, float u[3])
{
    const Vertices *vertices = &model->vertices;
    const Vec3 x = rows_vector(&vertices->rows, vertices_row(vertices), vertex, 0);
    u[0] = (float)x.x, u[1] = (float)x.y, u[2] = (float)x.z;
}

// Returns a vertex that came within a round, or was carried as that began: it was between its
// parents then.
static VertexError born_within(const VoxelModel *model, const CutBirth *birth)
{
    VertexError born = {.weight = 0.0F};
    for (int p = 0; p < birth->parent_count; p++)
        for (int k = 0; k < 3; k++)
            born.u[k] += model->error->vertex[birth->parent[p]].u[k] / (float)birth->parent_count;
    if (birth->parent_count == 0)
        copy_motion(model, birth->vertex, born.u);
    return born;
}

void voxel_error_follow(const void *self)
{
    const VoxelModel *model = self;
    const CutChanges *changes = &model->cuts->lattice.changes;
    VoxelError *error = model->error;
    for (int b = 0; error != NULL && b < changes->birth_count; b++) {
        error->vertex[changes->birth[b].vertex] = born_within(model, &changes->birth[b]);
        error->shown[changes->birth[b].vertex] = 0.0F;
    }
}

// A number beyond the end of its list ends a pass; one of the vertices and of the nodes has to be
// within their memory.
bool voxel_error_check(const void *self)
{
    const VoxelError *error = ((const VoxelModel *)self)->error;
    return error == NULL ||
           ((int)error->pass >= COPY_MOTION && error->pass <= SHOW && error->next >= 0 &&
            error->used >= 0 && error->used <= error->capacity && error->sums.outer >= 0 &&
            error->sums.outer <= error->capacity);
}

// ---------------------------------------------------------------------------------------------
// Elements

// One element, lengths over its edge.
typedef struct ErrorElement {
    int count;
    int vertex[NODE_COUNT]; // corners first
    // Bit c: it is corner c, or in the middle of an edge or face that has corner c; how many those
    // are.
    unsigned char corner[NODE_COUNT], corners[NODE_COUNT];
    const ElementClass *by;
    double f[3][3]; // F
    // Of the displacements of the corners: number m is their sum with the product of the signs of
    // the coordinates of its bits.
    Vec3 mode[NODE_CORNERS];
    double mu, lambda, bend; // [Pa]; bend: of the residual, alpha k / H
    double excess;           // share of the residual's energy that bending should not have
    const double *last;      // rotation, see VoxelPass
} ErrorElement;

static void add_outer(double m[3][3], Vec3 a, Vec3 b)
{
    const double x[3] = {a.x, a.y, a.z}, y[3] = {b.x, b.y, b.z};
    for (int k = 0; k < 9; k++)
        m[k / 3][k % 3] += x[k / 3] * y[k % 3];
}

// Computes the modes of the corners' displacements, in place: sums and differences along the axes,
// one after the other.
static void to_modes(Vec3 mode[NODE_CORNERS])
{
    for (int bit = 1; bit < NODE_CORNERS; bit *= 2)
        for (int c = 0; c < NODE_CORNERS; c++)
            if (!(c & bit)) {
                const Vec3 low = mode[c], high = mode[c | bit];
                mode[c] = vec3_add(high, low);
                mode[c | bit] = vec3_sub(high, low);
            }
}

static Vec3 displacement(const VoxelModel *model, const ErrorElement *e, int vertex)
{
    const float *u = model->error->vertex[vertex].u;
    return vec3_scale(1.0 / e->by->size, vec3((double)u[0], (double)u[1], (double)u[2]));
}

static void read_plain(const VoxelModel *model, const int *vertex, ErrorElement *e)
{
    e->count = NODE_CORNERS;
    for (int p = 0; p < NODE_CORNERS; p++) {
        e->corner[p] = (unsigned char)(1 << p);
        e->corners[p] = 1;
        e->vertex[p] = vertex[p * LANES];
        e->mode[p] = displacement(model, e, e->vertex[p]);
    }
    to_modes(e->mode);
    // Area vectors of 1/4.
    for (int k = 0; k < 3; k++) {
        const Vec3 g = e->mode[1 << k];
        e->f[0][k] = (k == 0 ? 1.0 : 0.0) + 0.25 * g.x;
        e->f[1][k] = (k == 1 ? 1.0 : 0.0) + 0.25 * g.y;
        e->f[2][k] = (k == 2 ? 1.0 : 0.0) + 0.25 * g.z;
    }
}

// Finds the corners among which vertex p is, from its place relative to corner 0 in edges.
static void find_corners(ErrorElement *e, int p, Vec3 place)
{
    const double at[3] = {place.x, place.y, place.z};
    e->corner[p] = e->corners[p] = 0;
    for (int c = 0; c < NODE_CORNERS; c++) {
        bool among = true;
        for (int d = 0; d < 3; d++)
            among = among && fabs(at[d] - (c >> d & 1)) < 0.75;
        e->corner[p] |= (unsigned char)(among << c);
        e->corners[p] += among;
    }
}

static void read_hanging(const VoxelModel *model, const RestTable *table, int lane,
                         const int *vertex, ErrorElement *e)
{
    const Rows *rows = &model->vertices.rows;
    Vec3 first = {0.0, 0.0, 0.0};
    for (int k = 0; k < 9; k++)
        e->f[k / 3][k % 3] = k % 4 == 0 ? 1.0 : 0.0;
    e->count = 0;
    for (int p = 0; p < table->count && vertex[p * LANES] != model->vertices.capacity; p++) {
        double row[TABLE_ROW];
        for (int k = 0; k < TABLE_ROW; k++) {
            const long at = TABLE_HEAD + (long)p * TABLE_ROW + k;
            row[k] =
                rows_get(rows, table->number, at * table->stride + (table->stride > 1 ? lane : 0));
        }
        const Vec3 rest = vec3(row[4], row[5], row[6]);
        if (p == 0)
            first = rest;
        find_corners(e, p, vec3_sub(rest, first));
        e->vertex[p] = vertex[p * LANES];
        const Vec3 u = displacement(model, e, e->vertex[p]);
        if (p < NODE_CORNERS)
            e->mode[p] = u;
        add_outer(e->f, u, vec3(row[0], row[1], row[2]));
        e->count++;
    }
    to_modes(e->mode);
}

// Reads the element in a lane; false: none.
static bool read_element(const VoxelModel *model, bool hanging, int batch, int lane,
                         ErrorElement *e)
{
    const BatchRuns *runs = model->batches;
    const int first = hanging ? runs->hanging.start[batch] : batch * NODE_CORNERS;
    const int *vertex =
        (hanging ? runs->hanging.vertex : runs->plain.vertex) + (long)first * LANES + lane;
    if (vertex[0] == model->vertices.capacity)
        return false;
    const int which =
        hanging ? runs->hanging.element_class[batch][lane] : runs->plain.element_class[batch];
    e->by = &runs->classes[which];
    e->last = runs->last[batch + (hanging ? runs->plain.batch_count : 0)][lane];
    e->bend = e->by->residual / e->by->size;
    if (model->law == VOXEL_MIYAZAKI2004) {
        e->mu = e->bend;
        e->lambda = 0.0;
        e->excess = 2.0 / 3.0; // alpha is 1 in place of 1/3
    } else {
        e->mu = e->by->mu;
        e->lambda = e->by->lambda;
        e->excess = 0.0;
    }
    if (hanging)
        read_hanging(model, &runs->tables[runs->hanging.table[batch]], lane, vertex, e);
    else
        read_plain(model, vertex, e);
    return true;
}

// ---------------------------------------------------------------------------------------------
// Strains

// Strains of an element in its corners, and its energy per volume.
typedef struct CornerStrain {
    double at[NODE_CORNERS][STRAINS];
    double energy, bending; // [J/m3]; `bending`: that of the residual
} CornerStrain;

static double energy_of(const ErrorElement *e, const double strain[STRAINS])
{
    double square = 0.0;
    for (int k = 0; k < STRAINS; k++)
        square += (k < 3 ? 1.0 : 2.0) * strain[k] * strain[k];
    const double trace = strain[0] + strain[1] + strain[2];
    return e->mu * square + 0.5 * e->lambda * trace * trace;
}

// Computes the uniform strain R^T F - 1, and R.
static void uniform_strain(const ErrorElement *e, double strain[STRAINS], double r[3][3])
{
    enum { STEPS = 6 };
    double trace, s[3][3];
    if (!rotation_foam((const double(*)[3])e->f, STEPS, r, &trace)) {
        Quat last = {e->last[0], e->last[1], e->last[2], e->last[3]};
        rotation_fit((const double(*)[3])e->f, r, &last);
    }
    for (int i = 0; i < 3; i++)
        for (int k = 0; k < 3; k++)
            s[i][k] = r[0][i] * e->f[0][k] + r[1][i] * e->f[1][k] + r[2][i] * e->f[2][k];
    for (int i = 0; i < 3; i++) {
        const int p = (i + 1) % 3, q = (i + 2) % 3;
        strain[i] = s[i][i] - 1.0;
        strain[3 + i] = 0.5 * (s[p][q] + s[q][p]);
    }
}

// Computes the bilinear part of the corners' displacements, turned back: a[i][m] s_p s_q along axis
// i, m = p q being yz, zx, xy, or xyz, and s +-1 in the corners.
static void bent_modes(const ErrorElement *e, const double r[3][3], double a[3][4])
{
    static const int AXES[4] = {6, 5, 3, 7};
    for (int m = 0; m < 4; m++) {
        const Vec3 sum = vec3_scale(0.125, e->mode[AXES[m]]);
        for (int i = 0; i < 3; i++)
            a[i][m] = r[0][i] * sum.x + r[1][i] * sum.y + r[2][i] * sum.z;
    }
}

// Computes the strain in the corners: the uniform one, and what the residual stands for. Stretches
// vary as the corners' displacements say; along an axis itself they vary as those of the other axes
// do along it, without stress (Poisson), as through the thickness of a bent plate, which no corner
// shows. Of shear only what twists: what else the corners show of it is bending, which the element
// takes for what it is (README.md, "Bending and the factor alpha").
static void corner_strains(const ErrorElement *e, CornerStrain *out)
{
    double strain[STRAINS], r[3][3], a[3][4], modes = 0.0;
    uniform_strain(e, strain, r);
    bent_modes(e, (const double(*)[3])r, a);
    for (int k = 0; k < 12; k++)
        modes += a[k / 4][k % 4] * a[k / 4][k % 4];
    out->bending = 4.0 * e->bend * modes;
    out->energy = energy_of(e, strain) + out->bending;
    const double thin = e->lambda > 0.0 ? e->lambda / (e->lambda + 2.0 * e->mu) : 0.0;
    for (int c = 0; c < NODE_CORNERS; c++) {
        const double s[3] = {c & 1 ? 1.0 : -1.0, c & 2 ? 1.0 : -1.0, c & 4 ? 1.0 : -1.0};
        for (int i = 0; i < 3; i++) {
            const int p = (i + 1) % 3, q = (i + 2) % 3;
            const double own = a[i][q] * s[p] + a[i][p] * s[q] + a[i][3] * s[p] * s[q];
            out->at[c][i] = strain[i] + 2.0 * (own - thin * (a[p][q] + a[q][p]) * s[i]);
            out->at[c][3 + i] = strain[3 + i] + (a[p][p] + a[q][q]) * s[i];
        }
    }
}

static void gather(VoxelError *error, const ErrorElement *e)
{
    CornerStrain strain;
    corner_strains(e, &strain);
    const float weight = (float)(1.0 / e->by->size);
    for (int p = 0; p < e->count; p++) {
        VertexError *to = &error->vertex[e->vertex[p]];
        for (int c = 0; c < NODE_CORNERS; c++)
            for (int k = 0; k < STRAINS && (e->corner[p] >> c & 1); k++)
                to->strain[k] += weight * (float)strain.at[c][k];
        to->weight += weight * (float)e->corners[p];
        to->corners += (float)e->corners[p];
    }
}

// Returns the energy per volume of the difference between recovered and own strains, both trilinear
// between the corners.
static double defect_of(const VoxelError *error, const ErrorElement *e, const CornerStrain *own)
{
    // Axes along which there are elements on both sides of a vertex, by how many eighths are
    // filled.
    static const double SIDES[] = {0.0, 0.0, 1.0, 1.585, 2.0, 2.322, 2.585, 2.807, 3.0};
    double mode[NODE_CORNERS][STRAINS], sum = 0.0, seen = 0.0;
    for (int c = 0; c < NODE_CORNERS; c++) {
        const VertexError *at = &error->vertex[e->vertex[c]];
        // Sums from a file may be anything.
        seen += SIDES[at->corners >= 8.0F ? 8 : at->corners > 0.0F ? (int)at->corners : 0];
        // A vertex that came within this round knows nothing.
        const double share = at->weight > 0.0F ? 1.0 / (double)at->weight : 0.0;
        for (int k = 0; k < STRAINS; k++)
            mode[c][k] = share > 0.0 ? share * (double)at->strain[k] - own->at[c][k] : 0.0;
    }
    // Products of the coordinates from -1 to 1, as in to_modes; eight times their factors.
    for (int bit = 1; bit < NODE_CORNERS; bit *= 2)
        for (int c = 0; c < NODE_CORNERS; c++)
            for (int k = 0; k < STRAINS && !(c & bit); k++) {
                const double low = mode[c][k], high = mode[c | bit][k];
                mode[c][k] = high + low;
                mode[c | bit][k] = high - low;
            }
    // The mean square of a product of n coordinates is 3^-n.
    static const double SHARE[NODE_CORNERS] = {1.0,       1.0 / 3.0, 1.0 / 3.0, 1.0 / 9.0,
                                               1.0 / 3.0, 1.0 / 9.0, 1.0 / 9.0, 1.0 / 27.0};
    for (int m = 0; m < NODE_CORNERS; m++)
        sum += SHARE[m] / 64.0 * energy_of(e, mode[m]);
    // Towards a face nothing is recovered: that counts as much as what is along the other axes.
    const double all = 3.0 * NODE_CORNERS;
    return sum * all / fmax(seen, all / 3.0);
}

// Returns the factor of the energies of an element that stiffens.
static double stiffened(const VoxelModel *model, const ErrorElement *e, double energy)
{
    if (model->stiffening == NULL)
        return 1.0;
    const double scale = element_energy_scale(e->mu, e->lambda, model->stiffening->strain);
    return stiffening_factor(&model->stiffening->curve, energy / scale);
}

// `tool`: in the rows' coordinates.
static void compare(const VoxelModel *model, const ErrorQuestion *question, const Vec3 *tool,
                    const ErrorElement *e)
{
    VoxelError *error = model->error;
    ErrorSums *sums = &error->sums;
    const double size = e->by->size, volume = size * size * size;
    CornerStrain own;
    corner_strains(e, &own);
    const double factor =
        model->vertices.parameters->stiffness_scale * stiffened(model, e, own.energy);
    const double energy = factor * own.energy;
    const double defect = factor * (defect_of(error, e, &own) + e->excess * own.bending);
    sums->energy += volume * energy;
    sums->defect += volume * defect;
    for (int p = 0; p < e->count; p++)
        error->vertex[e->vertex[p]].defect += (float)(defect * e->corners[p] / size);
    // Around the tools.
    const Rows *rows = &model->vertices.rows;
    const void *row = vertices_row(&model->vertices);
    const Vec3 middle =
        vec3_scale(0.5, vec3_add(rows_local(rows, row, e->vertex[0]),
                                 rows_local(rows, row, e->vertex[NODE_CORNERS - 1])));
    for (int t = 0; t < question->tool_count; t++) {
        const double reach = NEAR_TOOL * (question->size[t] + 1.5 * size);
        if (vec3_length(vec3_sub(middle, tool[t])) > reach)
            continue;
        sums->near_energy[t] += volume * energy;
        *(size < 1.5 * rows->longest_edge ? &sums->near_defect[t] : &sums->near_larger[t]) +=
            volume * defect;
    }
}

// ---------------------------------------------------------------------------------------------
// A round

static bool is_carried(const VoxelModel *model, int vertex)
{
    return model->cuts != NULL && model->cuts->carry != NULL &&
           cut_lattice_is_carried(&model->cuts->lattice, vertex);
}

// Copies where the vertices of elements are.
static bool copy_all(const VoxelModel *model, int *budget)
{
    const int count = model->vertices.count;
    for (int v = 0; v < count; v++)
        if (!is_carried(model, v))
            copy_motion(model, v, model->error->vertex[v].u);
    *budget -= count / VERTICES + 1;
    return true;
}

// Goes through the batches in use from number `next` on. True when there is none left.
static bool through_elements(const VoxelModel *model, const ErrorQuestion *question, int *budget)
{
    VoxelError *error = model->error;
    const BatchRuns *runs = model->batches;
    Vec3 tool[ERROR_TOOLS];
    for (int t = 0; t < question->tool_count; t++) {
        const Region there = {
            .kind = REGION_CAPSULE, .from = question->tool[t], .to = question->tool[t]};
        tool[t] = rows_region(&model->vertices.rows, &there).from;
    }
    int end = 0;
    for (int batch; (batch = batch_runs_next(runs, error->next, &end)) >= 0;) {
        const bool hanging = batch >= runs->plain.batch_count;
        const int before = hanging ? runs->plain.batch_count : 0;
        for (error->next = batch; error->next < end; error->next++) {
            if (*budget <= 0)
                return false;
            ErrorElement e;
            for (int lane = 0; lane < LANES; lane++)
                if (read_element(model, hanging, error->next - before, lane, &e)) {
                    if (error->pass == GATHER_STRAINS)
                        gather(error, &e);
                    else
                        compare(model, question, tool, &e);
                }
            *budget -= LANES;
        }
    }
    return true;
}

// Returns the vertex of a published node.
static int vertex_of_node(const VoxelModel *model, int node)
{
    const FittedBody *fitted = model->fitted;
    return fitted != NULL ? fitted->vertex[fitted->fit.row[node]] : model->node[node];
}

// Returns the displacement of a vertex as the round began; of a carried one, by what carries it.
static Vec3 displacement_of(const VoxelModel *model, int vertex)
{
    const VertexError *all = model->error->vertex;
    FitWeight weight[NODE_COUNT] = {{vertex, 1.0}};
    const int count =
        is_carried(model, vertex) ? cut_carry_weights(model->cuts->carry, vertex, weight) : 1;
    Vec3 sum = {0.0, 0.0, 0.0};
    for (int w = 0; w < count; w++) {
        const float *u = all[weight[w].vertex].u;
        sum = vec3_madd(sum, weight[w].weight, vec3((double)u[0], (double)u[1], (double)u[2]));
    }
    return sum;
}

// Adds the displacements of the outer vertices: of bodies that can be cut those of published nodes,
// of bodies that adapt some of these. An odd number apart, they are anywhere in larger elements.
static bool through_outer(const VoxelModel *model, int *budget)
{
    VoxelError *error = model->error;
    const bool adapts = model->cuts != NULL && model->cuts->carry != NULL;
    const int count = model->cuts != NULL ? (int)*model->node_count : model->surface_count;
    const int at_once = adapts ? CARRIED : VERTICES, apart = adapts ? count / OUTER_MOST | 1 : 1;
    const int end = (int)fmin(count, error->next + (double)apart * at_once * *budget);
    *budget -= (end - error->next) / (apart * at_once) + 1;
    for (; error->next < end; error->next += apart) {
        const int v = model->cuts != NULL ? vertex_of_node(model, error->next) : error->next;
        if (!(error->vertex[v].weight > 0.0F) && !is_carried(model, v)) // it has no element
            continue;
        const Vec3 u = displacement_of(model, v);
        error->sums.square += vec3_dot(u, u);
        error->sums.outer++;
    }
    return error->next >= count;
}

// Keeps what is shown, and clears the vertices for the next round.
static bool through_vertices(const VoxelModel *model, int *budget)
{
    VoxelError *error = model->error;
    if (error->used < model->vertices.count)
        error->used = model->vertices.count;
    const int end = (int)fmin(error->used, error->next + (double)VERTICES * *budget);
    *budget -= (end - error->next) / VERTICES + 1;
    for (; error->next < end; error->next++) {
        VertexError *at = &error->vertex[error->next];
        const float density = at->weight > 0.0F ? at->defect / at->weight : 0.0F;
        const float shown = density >= 0.0F && isfinite(density) ? density : 0.0F;
        error->shown[error->next] = shown;
        error->sums.largest = shown > error->sums.largest ? shown : error->sums.largest;
        *at = (VertexError){.weight = 0.0F};
    }
    return error->next >= error->used;
}

// Goes on with a pass; true when it is complete.
static bool go_on(const VoxelModel *model, const ErrorQuestion *question, int *budget)
{
    switch (model->error->pass) {
    case COPY_MOTION:
        return copy_all(model, budget);
    case MEASURE_MOTION:
        return through_outer(model, budget);
    case SHOW:
        return through_vertices(model, budget);
    default:
        return through_elements(model, question, budget);
    }
}

// Returns the energy of the springs between a tool and faces, which a stiffer contact would not
// have [J].
static double overlap_of(const ErrorQuestion *question, int t)
{
    const double depth = question->depth == NULL ? 0.0 : question->depth[t];
    return depth > 0.0 ? OVERLAP_SHARE * vec3_length(question->force[t]) * depth : 0.0;
}

// Returns the relative error by which vertices a tool holds, if it does not touch.
static double grip_error(const VoxelModel *model, const ErrorQuestion *question, int t)
{
    const bool grips = question->depth != NULL && !(question->depth[t] > 0.0) &&
                       question->size[t] > 0.0 && vec3_length(question->force[t]) > 0.0;
    return grips ? BY_GRIP * model->vertices.rows.longest_edge / question->size[t] : 0.0;
}

// Returns the relative error of the force on a tool (README.md, "Error of the elements"): it sinks
// into the faces, which lowers its force, but these are chords of it, and elements too stiff.
static double force_error(const VoxelModel *model, const ErrorQuestion *question, int t)
{
    const ErrorSums *sums = &model->error->sums;
    const double edge = model->vertices.rows.longest_edge, overlap = overlap_of(question, t);
    if (!(sums->near_energy[t] > 0.0))
        return 0.0;
    // Ways times force: 2 W / f as an overlap under Hertz's pressure has on average, and of chords.
    const double sinks = BY_WAY * 2.0 * overlap;
    const double chords =
        overlap > 0.0 && question->size[t] > 0.0
            ? BY_WAY * vec3_length(question->force[t]) * edge * edge / (16.0 * question->size[t])
            : 0.0;
    const double left = sinks - chords - sums->near_defect[t];
    const double least = LEAST_LEFT * (sinks + chords + sums->near_defect[t]);
    const double larger = LARGER_LEFT * sums->near_larger[t];
    return hypot(hypot(hypot(left, least), larger) / sums->near_energy[t],
                 grip_error(model, question, t));
}

// Computes the answer from the sums of a round.
static void conclude(const VoxelModel *model, const ErrorQuestion *question, BodyError *out)
{
    const ErrorSums *sums = &model->error->sums;
    *out = (BodyError){.displacement = 0.0};
    double overlap = 0.0, grip = 0.0;
    for (int t = 0; t < question->tool_count; t++) {
        grip = fmax(grip, grip_error(model, question, t));
        overlap += overlap_of(question, t);
        out->force[t] = force_error(model, question, t);
    }
    const double all = sums->energy + overlap;
    if (all > 0.0)
        out->relative = hypot(hypot(sums->defect, overlap) / all, grip);
    if (sums->outer > 0)
        out->displacement = out->relative * sqrt(sums->square / sums->outer);
}

bool voxel_estimate(void *self, const ErrorQuestion *question, int budget, BodyError *out)
{
    const VoxelModel *model = self;
    VoxelError *error = model->error;
    ASSERT(question->tool_count <= ERROR_TOOLS);
    if (error == NULL)
        return false;
    while (budget > 0) {
        if (!go_on(model, question, &budget))
            return false;
        error->next = 0;
        if (error->pass != SHOW) {
            error->pass++;
            continue;
        }
        conclude(model, question, out);
        error->largest = error->sums.largest;
        error->pass = COPY_MOTION;
        error->sums = (ErrorSums){.outer = 0};
        return true;
    }
    return false;
}

// Returns what is shown of a vertex; of a carried one, between the corners of its element.
static double shown_of(const VoxelModel *model, int vertex)
{
    const float *shown = model->error->shown;
    if (!is_carried(model, vertex))
        return (double)shown[vertex];
    const CutLattice *lattice = &model->cuts->lattice;
    const int *node = cut_lattice_nodes(lattice, model->cuts->carry->leaf_of[vertex]);
    int at[3], low[3], high[3];
    cut_lattice_point(lattice, vertex, at);
    cut_lattice_point(lattice, node[0], low);
    cut_lattice_point(lattice, node[NODE_CORNERS - 1], high);
    double sum = 0.0;
    for (int c = 0; c < NODE_CORNERS; c++) {
        double weight = 1.0;
        for (int d = 0; d < 3; d++)
            weight *= (double)(c >> d & 1 ? at[d] - low[d] : high[d] - at[d]) / (high[d] - low[d]);
        sum += weight * (double)shown[node[c]];
    }
    return sum;
}

// By the root, as strains go. After a restore within a round what is shown may be of another state
// than the largest.
void voxel_snapshot_error(const void *self, int first, int end, unsigned char *share)
{
    const VoxelModel *model = self;
    const double most = model->error == NULL ? 0.0 : (double)model->error->largest;
    for (int i = first; i < end; i++) {
        const int vertex =
            model->skin != NULL ? skin_vertex(model->skin, i) : vertex_of_node(model, i);
        const double part = most > 0.0 ? shown_of(model, vertex) / most : 0.0;
        share[i - first] = (unsigned char)lrint(255.0 * sqrt(fmin(part, 1.0)));
    }
}
