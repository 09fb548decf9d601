// SPDX-License-Identifier: MIT
// The kernels with partly filled elements, in both precisions and at every instruction-set level:
// forces and energies of element.c for every option of the law, the stress of what is solid, and
// that under the same uniform deformation such an element feels what a whole one feels.
#include "test.h"
#include "effort.h"
#include "voxel_fill.h"

#include "voxel/batch.h"

static const double SIZE = 3e-3;

enum { UNDAMPED, DAMPED, VISCOUS };
typedef struct Variant {
    int damping;
    Stiffening stiffening;
    double lambda; // [mu]
} Variant;
static const Variant VARIANTS[] = {
    {.damping = UNDAMPED, .lambda = 0.0},
    {.damping = UNDAMPED, .lambda = 9.0},
    {.damping = DAMPED, .lambda = 1.5},
    {.damping = VISCOUS, .lambda = 1.5},
    {.damping = UNDAMPED, .lambda = 1.5, .stiffening = {0.3, 10.0}},
    {.damping = DAMPED, .lambda = 0.5, .stiffening = {0.5, 3.0}},
    {.damping = VISCOUS, .lambda = 1.5, .stiffening = {0.2, 100.0}},
};
enum { VARIANT_COUNT = sizeof VARIANTS / sizeof *VARIANTS };

// One mixed batch, a lane of which is an element with vertices of its own; the first lane is whole.
typedef struct Trial {
    const Variant *variant;
    double mu; // [Pa]
    Template shape[LANES];
    ElementClass classes[LANES];
    int vertex[NODE_COUNT][LANES], lane_class[LANES], rows; // rows: of the longest lane
    double row[LANES * NODE_COUNT + 1][ROW];
    double last[1][LANES][4];
} Trial;
enum { SPARE = LANES * NODE_COUNT };

static void trial_of(Trial *trial, const Variant *variant, bool whole_ones, uint64_t *random)
{
    *trial = (Trial){.variant = variant, .mu = 5e3};
    for (int lane = 0; lane < LANES; lane++) {
        const int level = 1 + lane % FILL_LEVELS;
        const double size = SIZE * (1 << level), k = trial->mu * size;
        uint64_t solid[FILL_WORDS];
        fill_random(solid, level, random);
        Template *shape = &trial->shape[lane];
        if (lane == 0 || whole_ones)
            template_create(shape, fill_random_mask(random));
        else
            template_create_partial(shape, fill_random_mask(random), level, solid);
        const ElementClass whole = {.size = size,
                                    .mu = trial->mu,
                                    .lambda = variant->lambda * trial->mu,
                                    .residual = k / 2.2,
                                    .damping = variant->damping != UNDAMPED ? 3e-4 * k : 0.0,
                                    .share = 1.0};
        trial->classes[lane] = template_class(shape, &whole);
        trial->lane_class[lane] = lane;
        trial->rows = shape->count > trial->rows ? shape->count : trial->rows;
        memcpy(trial->last[0][lane], (const double[4]){1.0}, sizeof trial->last[0][lane]);
        for (int i = 0; i < NODE_COUNT; i++)
            trial->vertex[i][lane] = i < shape->count ? lane * NODE_COUNT + i : SPARE;
    }
}

static void trial_create(Trial *trial, const Variant *variant, uint64_t *random)
{
    trial_of(trial, variant, false, random);
}

static double size_of(const Trial *trial, int lane)
{
    return trial->classes[lane].size;
}

static Vec3 rest_of(const Trial *trial, int lane, int i)
{
    return vec3_scale(size_of(trial, lane), trial->shape[lane].rest[i]);
}

// Rounded, so that both precisions see the same state.
static void put_vector(double *to, Vec3 a)
{
    to[0] = (double)(float)a.x, to[1] = (double)(float)a.y, to[2] = (double)(float)a.z;
}

static Vec3 vector_at(const double *from)
{
    return vec3(from[0], from[1], from[2]);
}

// --- what is expected ---

// A lane in the form of element.c, whose volume is that of the solid cells.
typedef struct Readable {
    Element element;
    Vec3 rest[NODE_COUNT], area[NODE_COUNT], position[NODE_COUNT], velocity[NODE_COUNT];
    ElementStiffness stiffness;
} Readable;

static void read_lane(const Trial *trial, int lane, Readable *out)
{
    const Template *shape = &trial->shape[lane];
    const double size = size_of(trial, lane), volume = shape->share * size * size * size;
    const double k = trial->mu * volume / (size * size);
    const Variant *v = trial->variant;
    for (int i = 0; i < shape->count; i++) {
        out->rest[i] = rest_of(trial, lane, i);
        out->area[i] = vec3_scale(size * size, shape->area[i]);
        const double *row = trial->row[trial->vertex[i][lane]];
        out->position[i] = vec3_add(out->rest[i], vector_at(row));
        out->velocity[i] = vector_at(row + 4);
    }
    out->element = (Element){shape->count, out->rest, shape->weight, out->area, volume};
    out->stiffness = (ElementStiffness){
        .law = VOXEL_AFFINE,
        .mu = trial->mu,
        .lambda = v->lambda * trial->mu,
        .residual = shape->softer * k / 2.2,
        .damping = v->damping == DAMPED ? 3e-4 * k : 0.0,
        .damping_time = v->damping == VISCOUS ? 3e-4 : 0.0,
        .stiffening = v->stiffening,
    };
}

// --- what the kernels say ---

// Of Real numbers; [vertex].
typedef struct Result {
    double force[SPARE + 1][3];
    double energy;
    uint16_t high; // |P| above the limit
} Result;

// Lanes' tables of one precision, as cut_pack.c writes them.
static void put_tables(const Trial *trial, Precision precision, void *number)
{
    for (int lane = 0; lane < LANES; lane++) {
        double own[TEMPLATE_NUMBERS] = {0};
        voxel_table_put(own, &trial->shape[lane], VOXEL_AFFINE, precision);
        const int count = TABLE_HEAD + trial->shape[lane].count * TABLE_ROW;
        for (int i = 0; i < TEMPLATE_NUMBERS; i++)
            if (precision == PRECISION_SINGLE)
                ((float *)number)[i * LANES + lane] = i < count ? ((float *)own)[i] : 0.0f;
            else
                ((double *)number)[i * LANES + lane] = i < count ? own[i] : 0.0;
    }
}

// `branch`: NULL, or of a pass that relaxes, its dashpots at none before it.
static void run(const Trial *trial, const VoxelKernels *kernels, const RelaxationBranch *branch,
                double limit, Result *out)
{
    const bool single = kernels->precision == PRECISION_SINGLE;
    static _Alignas(64) double number[TEMPLATE_NUMBERS * LANES];
    static _Alignas(64) double rows[(SPARE + 1) * ROW], force[(SPARE + 1) * 4];
    static _Alignas(64) double dashpot[2][6 * LANES];
    memset(force, 0, sizeof force);
    memset(dashpot, 0, sizeof dashpot);
    put_tables(trial, kernels->precision, number);
    for (int i = 0; i < (SPARE + 1) * ROW; i++)
        if (single)
            ((float *)rows)[i] = (float)trial->row[i / ROW][i % ROW];
        else
            rows[i] = trial->row[i / ROW][i % ROW];
    const PlainBatches none = {0};
    const int start[2] = {0, trial->rows}, table = 0;
    const HangingBatches hanging = {1, start, trial->vertex[0], &table,
                                    (const int(*)[LANES])trial->lane_class};
    const RestTable tables = {trial->rows, LANES, number};
    const Stiffening *stiffens = &trial->variant->stiffening;
    const VoxelStiffening stiffening = {stiffens->strain,
                                        stiffening_curve(fmax(stiffens->cap, 1.0))};
    double last[1][LANES][4];
    memcpy(last, trial->last, sizeof last);
    VoxelPass pass = {
        .plain = &none,
        .hanging = &hanging,
        .tables = &tables,
        .classes = trial->classes,
        .law = VOXEL_AFFINE,
        .damped = trial->variant->damping != UNDAMPED,
        .viscous = trial->variant->damping == VISCOUS,
        .rows = rows,
        .force = force,
        .last = last,
        .stiffness_scale = 1.0,
        .damping_scale = 1.0,
        .stiffening = stiffening_is_on(stiffens) ? &stiffening : NULL,
    };
    if (branch != NULL) {
        pass.relaxation.count = 1;
        pass.relaxation.branch[0] = *branch;
        pass.relaxation.from = dashpot[0];
        pass.relaxation.to = dashpot[1];
    }
    out->energy = kernels->energy(&pass);
    kernels->stress(&pass, limit, &out->high);
    kernels->evaluate(&pass);
    for (int i = 0; i < SPARE * 3; i++)
        out->force[i / 3][i % 3] =
            single ? (double)((float *)force)[i / 3 * 4 + i % 3] : force[i / 3 * 4 + i % 3];
}

// All levels of a precision give the same bits.
static void run_all_levels(const Trial *trial, Precision precision, const RelaxationBranch *branch,
                           double limit, Result *out)
{
    bool first = true;
    for (const char *const *level = isa_available(); *level != NULL; level++) {
        static Result other;
        memset(&other, 0, sizeof other);
        run(trial, voxel_kernels_find(precision, *level), branch, limit, first ? out : &other);
        if (!first)
            assert_memory_equal(out->force, other.force, sizeof out->force);
        first = false;
    }
}

// --- claims ---

static void move_vertices(Trial *trial, Quat turn, double noise, uint64_t *random)
{
    for (int lane = 0; lane < LANES; lane++) {
        const Vec3 shift = vec3_scale(SIZE, random_vec3(random)), spin = random_vec3(random);
        for (int i = 0; i < trial->shape[lane].count; i++) {
            double *row = trial->row[trial->vertex[i][lane]];
            const Vec3 rest = rest_of(trial, lane, i);
            const Vec3 u = vec3_add(vec3_sub(quat_rotate(turn, rest), rest), shift);
            put_vector(row, vec3_madd(u, noise * size_of(trial, lane), random_vec3(random)));
            put_vector(row + 4, vec3_madd(vec3_cross(spin, rest), 0.01, random_vec3(random)));
        }
    }
}

// As in test_voxel_kernel.c: a few dozen times rounding of the force of an element that is deformed
// by its own size. The area vectors are divided by shares down to 1/512, with the stiffness
// multiplied by them: relative to the element's own force nothing is lost.
static const double CLOSE[PRECISION_COUNT] = {
    [PRECISION_DOUBLE] = 3e-14, [PRECISION_SINGLE] = 4e-6};

static void expect_lanes(Trial *trial, const Result *result, double tolerance, bool energies)
{
    double energy = 0.0, worst = 0.0;
    for (int lane = 0; lane < LANES; lane++) {
        Readable r;
        Vec3 force[NODE_COUNT] = {{0.0, 0.0, 0.0}};
        Quat last = QUAT_NONE;
        double fastest = 0.0;
        read_lane(trial, lane, &r);
        energy += element_forces(&r.element, &r.stiffness, r.position, r.velocity, &last, force);
        for (int i = 0; i < r.element.count; i++)
            fastest = fmax(fastest, vec3_length(r.velocity[i]));
        const ElementClass *c = &trial->classes[lane];
        // Of its own solid part: k H = mu V / H.
        const double scale =
            stiffening_cap(&r.stiffness.stiffening) * (c->mu + c->lambda) * c->size * c->size +
            c->damping * fastest;
        for (int i = 0; i < r.element.count; i++) {
            const double *got = result->force[trial->vertex[i][lane]];
            const Vec3 off = vec3_sub(vector_at(got), force[i]);
            worst = fmax(worst, isfinite(off.x + off.y + off.z) ? vec3_length(off) / scale
                                                                : (double)HUGE_VAL);
        }
    }
    expect_at_most(worst, tolerance);
    if (energies)
        expect_near(result->energy / energy, 1.0, 100.0 * tolerance);
}

TEST(partly_filled_elements_have_the_forces_of_the_readable_element)
{
    uint64_t random = 6;
    for (int v = 0; v < VARIANT_COUNT; v++)
        for (int round = 0; round < EFFORT(40); round++) {
            static Trial trial;
            static Result result;
            trial_create(&trial, &VARIANTS[v], &random);
            const Vec3 axis = vec3_unit(random_vec3(&random));
            move_vertices(&trial, quat_from_rotation(vec3_scale(round % 4 * 1.04, axis)), 0.1,
                          &random);
            for (int k = 0; k < PRECISION_COUNT; k++) {
                run_all_levels(&trial, (Precision)k, NULL, 1.0, &result);
                expect_lanes(&trial, &result, CLOSE[k], true);
            }
        }
}

// Flat, inverted and crushed: what the fast path leaves to the slow one, and the barrier.
TEST(badly_deformed_ones_too)
{
    uint64_t random = 7;
    for (int v = 0; v < VARIANT_COUNT; v++)
        for (int round = 0; round < EFFORT(20); round++) {
            static Trial trial;
            static Result result;
            trial_create(&trial, &VARIANTS[v], &random);
            move_vertices(&trial, QUAT_NONE, 0.5, &random);
            run_all_levels(&trial, PRECISION_DOUBLE, NULL, 1.0, &result);
            // Near mirrored states a rotation turns by much for little.
            expect_lanes(&trial, &result, 1e-10, false);
        }
}

// x = F X and v = L X at all vertices of all lanes; both by `seed`.
static void deform_evenly(Trial *trial, uint64_t seed)
{
    double f[9], rate[9];
    for (int k = 0; k < 9; k++) {
        f[k] = (k % 4 == 0 ? 1.0 : 0.0) + random_between(&seed, -0.2, 0.2);
        rate[k] = random_between(&seed, -2.0, 2.0);
    }
    for (int lane = 0; lane < LANES; lane++)
        for (int i = 0; i < trial->shape[lane].count; i++) {
            const Vec3 rest = rest_of(trial, lane, i);
            const double x[3] = {rest.x, rest.y, rest.z};
            double *row = trial->row[trial->vertex[i][lane]];
            for (int c = 0; c < 3; c++) {
                row[c] = f[3 * c] * x[0] + f[3 * c + 1] * x[1] + f[3 * c + 2] * x[2] - x[c];
                row[4 + c] = rate[3 * c] * x[0] + rate[3 * c + 1] * x[1] + rate[3 * c + 2] * x[2];
            }
        }
}

// P = -sum f_i X_i^T / V.
static void stress_of(const Trial *trial, const Result *result, int lane, double stress[3][3])
{
    const Template *shape = &trial->shape[lane];
    const double size = size_of(trial, lane), volume = shape->share * size * size * size;
    memset(stress, 0, 9 * sizeof(double));
    for (int i = 0; i < shape->count; i++) {
        const Vec3 rest = rest_of(trial, lane, i);
        const double x[3] = {rest.x, rest.y, rest.z};
        for (int k = 0; k < 9; k++)
            stress[k / 3][k % 3] -=
                result->force[trial->vertex[i][lane]][k / 3] * x[k % 3] / volume;
    }
}

static double volume_of(const Trial *trial)
{
    double sum = 0.0;
    for (int lane = 0; lane < LANES; lane++)
        sum += trial->shape[lane].share * pow(size_of(trial, lane), 3.0);
    return sum;
}

// No residual, so that each vertex bears its part of one stress: that of the whole cube. It counts
// as stress, too, whatever the share, and the energy per volume is one.
TEST(an_even_deformation_has_the_stress_of_whole_elements)
{
    uint64_t random = 8;
    const RelaxationBranch branch = {.stiffness = 0.7, .half = 0.8, .volumetric = true};
    for (int n = 0; n < VARIANT_COUNT * 2 * EFFORT(6); n++) {
        const Variant *variant = &VARIANTS[n / 2 % VARIANT_COUNT];
        const bool relaxes = n % 2 == 1;
        if (variant->damping == DAMPED) // damps each vertex
            continue;
        static Trial trial;
        static Result result;
        trial_create(&trial, variant, &random);
        static Trial wholes;
        static Result all_whole;
        trial_of(&wholes, variant, true, &random);
        const uint64_t seed = random_bits(&random);
        deform_evenly(&trial, seed);
        deform_evenly(&wholes, seed);
        for (int k = 0; k < PRECISION_COUNT; k++) {
            double whole[3][3], size = 0.0;
            run_all_levels(&trial, (Precision)k, relaxes ? &branch : NULL, 1.0, &result);
            run_all_levels(&wholes, (Precision)k, relaxes ? &branch : NULL, 1.0, &all_whole);
            expect_near(result.energy / volume_of(&trial) / all_whole.energy * volume_of(&wholes),
                        1.0, k == PRECISION_SINGLE ? 1e-4 : 1e-11);
            stress_of(&trial, &result, 0, whole);
            for (int c = 0; c < 9; c++)
                size += whole[c / 3][c % 3] * whole[c / 3][c % 3];
            size = sqrt(size);
            // Rounding of displacements, of numbers divided by the share and of the sums.
            const double tolerance = (k == PRECISION_SINGLE ? 1e-4 : 1e-11) * size;
            for (int lane = 1; lane < LANES; lane++) {
                double own[3][3];
                stress_of(&trial, &result, lane, own);
                for (int c = 0; c < 9; c++)
                    expect_near(own[c / 3][c % 3], whole[c / 3][c % 3], tolerance);
                for (int i = 0; i < trial.shape[lane].count; i++) {
                    const double *f = result.force[trial.vertex[i][lane]];
                    const Vec3 a = trial.shape[lane].area[i];
                    const double area = size_of(&trial, lane) * size_of(&trial, lane);
                    for (int c = 0; c < 3; c++)
                        expect_near(-f[c] / area / trial.shape[lane].share,
                                    (whole[c][0] * a.x + whole[c][1] * a.y + whole[c][2] * a.z) /
                                        trial.shape[lane].share,
                                    tolerance);
                }
            }
            if (relaxes || variant->damping != UNDAMPED)
                continue; // not the elastic stress
            run_all_levels(&trial, (Precision)k, NULL, 0.999 * size, &result);
            assert_int_equal(result.high, 0xffff);
            run_all_levels(&trial, (Precision)k, NULL, 1.001 * size, &result);
            assert_int_equal(result.high, 0);
        }
    }
}
