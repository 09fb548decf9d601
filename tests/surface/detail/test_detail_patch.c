// SPDX-License-Identifier: MIT
// The patch test of meshes of mixed levels (server/surface/detail/README.md, "Hanging nodes"):
// under a homogeneous strain of a flat lattice every face carries the same stress, so that no free
// node feels a force, wherever levels meet; the strain is the solution of the problem with moved
// borders, and its energy is that of the lattice of level 0. choi2005 lacks this, by an amount that
// is stated.
#include "detail_bench.h"

#include "test.h"
#include "sim_steps.h"
#include "geometry/generator.h"
#include "random.h"

#define SIDE   0.12 // [m]
#define STRAIN 0.01 // eps

enum { CELLS = 6, LEVELS = 3 };

// dx = F dX in the plane.
typedef struct Strain {
    const char *name;
    double f[2][2];
} Strain;

static const Strain STRAINS[] = {
    {"biaxial", {{1.0 + STRAIN, 0.0}, {0.0, 1.0 + STRAIN}}},
    {"uniaxial", {{1.0 + STRAIN, 0.0}, {0.0, 1.0}}},
    {"shear", {{1.0, 0.5 * STRAIN}, {0.5 * STRAIN, 1.0}}},
};
enum { STRAIN_COUNT = sizeof STRAINS / sizeof *STRAINS };

static Vec3 strained(const Strain *strain, Vec3 x)
{
    return (Vec3){strain->f[0][0] * x.x + strain->f[0][1] * x.y,
                  strain->f[1][0] * x.x + strain->f[1][1] * x.y, x.z};
}

static bool on_border(Vec3 x)
{
    return fmax(fabs(x.x), fabs(x.y)) > 0.5 * SIDE - 1e-9;
}

// A sheet; with borders held also damping that lets it settle within half a second.
static void create(DetailBench *bench, int levels, SurfaceAdjust adjust, bool hold)
{
    TriMesh mesh;
    assert_true(generate_sheet(&mesh, CELLS + 1, CELLS + 1, SIDE, SIDE, &(Status){0}));
    int border[4 * CELLS], count = 0;
    for (int i = 0; i < mesh.node_count; i++)
        if (on_border(mesh.position[i]))
            border[count++] = i;
    const FixedRegion region = {.kind = FIXED_NODES, .node = border, .node_count = count};
    SurfaceOptions options = bench_options(levels, 0);
    options.shape = (SurfaceShape){.wanted = false};
    options.adjust = adjust;
    options.material.node_damping = hold ? 0.4 : 0.0;
    options.body.fixed_count = hold;
    options.body.fixed = &region;
    bench_create(bench, BENCH_ADAPTIVE, &mesh, &options, NULL, NULL);
}

static void refine_at_random(DetailBench *bench, uint64_t random)
{
    for (int i = 0; i < 20 * bench->detail->set.levels.finest; i++)
        bench_change_at_random(bench, &random, 8);
    bench_expect_sound(bench);
    assert_true(bench->detail->lists.hanging_count > 5);
    sim_restored(bench->sim); // the time step follows
}

static Vec3 rest_of(const DetailBench *bench, int node)
{
    const double *place = bench->model->basis.rest[bench->model->slot[node]];
    return vec3_add(bench->model->basis.rest_origin, (Vec3){place[0], place[1], place[2]});
}

static void put(DetailBench *bench, int node, Vec3 x)
{
    SurfaceModel *model = bench->model;
    rows_write(&model->basis, model->rows[model->current], model->slot[node], x, (Vec3){0});
}

// All nodes in the strained place; `noise` [m] on those that are free to move.
static void strain_body(DetailBench *bench, const Strain *strain, double noise, uint64_t *random)
{
    for (int i = 0; i < bench->detail->set.node_count; i++) {
        if (bench->detail->set.status[i] == NODE_OFF)
            continue;
        Vec3 rest = rest_of(bench, i), x = strained(strain, rest);
        if (!bench->detail->fixed[i]) {
            x.x += random_between(random, -noise, noise);
            x.y += random_between(random, -noise, noise);
        }
        put(bench, i, x);
    }
    detail_hang(&bench->model->detail->lists, bench->model->basis.precision,
                bench->model->rows[bench->model->current]);
}

// The largest force on a free node inside, over E2D eps L of the scale of the springs' own.
static double residual(DetailBench *bench)
{
    SurfaceModel *model = bench->model;
    const double h = 1e-6; // [s]
    const Evaluation kick = {EVALUATION_KICK, 0.0, 1.0, 0.0, true};
    bench->body->ops->drift(model, 0.0);
    bench->body->ops->evaluate(model, &kick, h);
    assert_true(bench->body->ops->commit(model));
    double worst = 0.0;
    for (int i = 0; i < bench->detail->set.node_count; i++)
        if (bench->detail->set.status[i] == NODE_FREE && !on_border(rest_of(bench, i)))
            worst = fmax(worst, vec3_length(detail_velocity(model, i)) / h * model->mass[i]);
    return worst / (80.0 * STRAIN * SIDE / CELLS);
}

// Of the lattice of level 0, spring by spring of each face: E2D A/L^2 (l - L)^2 / 2.
static double lattice_energy(const DetailBench *bench, const Strain *strain)
{
    double energy = 0.0;
    const TriMesh *mesh = &bench->mesh;
    for (int f = 0; f < mesh->triangle_count; f++) {
        const int *t = mesh->triangle[f];
        const Vec3 *x = mesh->position;
        double area =
            0.5 * vec3_length(vec3_cross(vec3_sub(x[t[1]], x[t[0]]), vec3_sub(x[t[2]], x[t[0]])));
        for (int k = 0; k < 3; k++) {
            Vec3 edge = vec3_sub(x[t[(k + 1) % 3]], x[t[k]]);
            double stretch = vec3_length(strained(strain, edge)) / vec3_length(edge) - 1.0;
            energy += 0.5 * 80.0 * area * stretch * stretch;
        }
    }
    return energy;
}

TEST(homogeneous_strain_is_free_of_forces_and_has_its_energy)
{
    for (int levels = 1; levels <= LEVELS; levels++)
        for (int s = 0; s < STRAIN_COUNT; s++)
            for (uint64_t seed = 1; seed <= 4; seed++) {
                SCOPED(bench_destroy) DetailBench bench;
                uint64_t random = seed;
                create(&bench, levels, ADJUST_CONTINUUM, false);
                refine_at_random(&bench, 10 * seed + (uint64_t)s);
                strain_body(&bench, &STRAINS[s], 0.0, &random);
                // Stretches are differences of lengths: 1e-16 L / (eps L) = 1e-14 each.
                expect_near(measure_of(bench.body).elastic / lattice_energy(&bench, &STRAINS[s]),
                            1.0, 1e-12);
                expect_at_most(residual(&bench), 1e-12);
            }
}

static double settled_error(DetailBench *bench, const Strain *strain)
{
    uint64_t random = 5;
    strain_body(bench, strain, 0.1 * STRAIN * SIDE / CELLS, &random);
    sim_ticks(bench->sim, 1500);
    double worst = 0.0;
    for (int i = 0; i < bench->detail->set.node_count; i++) {
        if (bench->detail->set.status[i] == NODE_OFF)
            continue;
        Vec3 x, v, should = strained(strain, rest_of(bench, i));
        rows_read(&bench->model->basis, bench->model->rows[bench->model->current],
                  bench->model->slot[i], &x, &v);
        worst = fmax(worst, vec3_length(vec3_sub(x, should)));
    }
    return worst / (STRAIN * SIDE / CELLS);
}

TEST(moved_borders_strain_the_inside_homogeneously)
{
    for (int levels = 1; levels <= LEVELS; levels++)
        for (int s = 0; s < STRAIN_COUNT; s++) {
            SCOPED(bench_destroy) DetailBench bench;
            create(&bench, levels, ADJUST_CONTINUUM, true);
            refine_at_random(&bench, 77 + (uint64_t)s);
            double error = settled_error(&bench, &STRAINS[s]);
            print_message("level %d, %s: %.1e eps L\n", levels, STRAINS[s].name, error);
            expect_at_most(error, 1e-9); // what is left of the noise after the time given
        }
}

// The faces within two edges of the middle, down to the finest level.
static void refine_the_middle(DetailBench *bench)
{
    Detail *detail = bench->detail;
    const double reach = 2.5 * SIDE / CELLS;
    detail_begin_change(bench->model);
    for (int l = 0; l < detail->set.levels.finest; l++)
        for (int f = 0; f < detail->set.levels.level[l].face_count; f++) {
            const int *t = detail->set.levels.level[0].face[f >> (2 * l)];
            double farthest = 0.0;
            for (int k = 0; k < 3; k++)
                farthest = fmax(farthest, vec3_length(bench->mesh.position[t[k]]));
            if (farthest < reach)
                detail_refine(bench->model, l, f);
        }
    assert_true(detail_end_change(bench->body));
    sim_restored(bench->sim);
}

// The paper's rule: the rim's coarse edges off, free nodes on the rim, springs by eq 8. A prototype
// had 0.12 at level 1 and 0.15 at level 2 around such a patch of an equilateral lattice
// (server/surface/detail/README.md, "Hanging nodes"); this one, of squares with diagonals, has
// 0.148 and 0.169.
TEST(the_papers_rule_fails_the_patch_test_by_a_seventh)
{
    for (int levels = 1; levels <= 2; levels++) {
        DetailBench bench;
        create(&bench, levels, ADJUST_CHOI2005, true);
        refine_the_middle(&bench);
        double error = settled_error(&bench, &STRAINS[0]) / CELLS;
        print_message("choi2005, level %d: %.3f eps times the side\n", levels, error);
        expect_at_least(error, 0.06);
        expect_at_most(error, 0.3);
        bench_destroy(&bench);
        create(&bench, levels, ADJUST_CONTINUUM, true);
        refine_the_middle(&bench);
        expect_at_most(settled_error(&bench, &STRAINS[0]), 1e-9);
        bench_destroy(&bench);
    }
}
