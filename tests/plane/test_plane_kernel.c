// SPDX-License-Identifier: MIT
// Kernels of plane bodies against the element written out (plane/shape.h), at every level and
// precision of this machine.
#include "test.h"
#include "plane_world.h"
#include "random.h"

static const PlaneLaw LAWS[2] = {PLANE_AFFINE, PLANE_MIYAZAKI2004};

static void make_world(PlaneWorld *world, PlaneLaw law, Precision precision, const char *isa)
{
    PlaneWorldOptions options = plane_world_disc(16);
    options.body.law = law;
    options.material.poisson_ratio = law == PLANE_AFFINE ? 0.3 : 0.0;
    options.body.body.precision = precision;
    options.body.body.isa = isa;
    plane_world_create(world, &options);
}

// Displacements and velocities of so many cells, with single precision's digits.
static void disturb(PlaneWorld *world, double cells)
{
    uint64_t seed = 77;
    PlaneModel *model = world->model;
    for (int v = 0; v < model->vertices.count; v++)
        for (int k = 0; k < 2; k++) {
            float u = (float)random_between(&seed, -0.002 * cells, 0.002 * cells);
            float speed = (float)random_between(&seed, -0.5, 0.5);
            rows_put(&model->vertices.rows, model->vertices.row[0], (long)v * ROW + k, (double)u);
            rows_put(&model->vertices.rows, model->vertices.row[0], (long)v * ROW + 4 + k,
                     (double)speed);
        }
}

static void reference_forces(const PlaneModel *model, double (*force)[2])
{
    for (int e = 0; e < model->element_count; e++) {
        const PlaneForm *form = &model->form[e];
        double x[PLANE_PLACES][2], v[PLANE_PLACES][2], f[PLANE_PLACES][2] = {{0.0}};
        for (int i = 0; i < form->shape->count; i++)
            for (int d = 0; d < 2; d++) {
                long at = (long)form->vertex[i] * ROW + d;
                x[i][d] = model->vertices.rows.rest[form->vertex[i]][d] +
                          rows_get(&model->vertices.rows, model->vertices.row[0], at);
                v[i][d] = rows_get(&model->vertices.rows, model->vertices.row[0], at + 4);
            }
        plane_shape_forces(form->shape, &form->stiffness, form->size, (const double(*)[2])x,
                           (const double(*)[2])v, f);
        for (int i = 0; i < form->shape->count; i++)
            for (int d = 0; d < 2; d++)
                force[form->vertex[i]][d] += f[i][d];
    }
}

static void evaluate(PlaneModel *model, double stiffness_scale)
{
    const PlanePass pass = {
        .batches = &model->batches,
        .law = model->law,
        .damped = model->vertices.damping_time > 0.0,
        .rows = model->vertices.row[0],
        .force = model->vertices.force,
        .stiffness_scale = stiffness_scale,
        .damping_scale = 1.0,
    };
    model->kernels->evaluate(&pass);
}

static void compare(PlaneLaw law, Precision precision, const char *isa, double cells,
                    double tolerance)
{
    SCOPED(plane_world_destroy) PlaneWorld world;
    make_world(&world, law, precision, isa);
    disturb(&world, cells);
    PlaneModel *model = world.model;
    FREED double(*expected)[2] = calloc((size_t)model->vertices.count, sizeof *expected);
    reference_forces(model, expected);
    evaluate(model, 1.0);
    double most = 0.0, worst = 0.0;
    for (int v = 0; v < model->vertices.count; v++)
        for (int d = 0; d < 2; d++) {
            double f = rows_get(&model->vertices.rows, model->vertices.force, 4L * v + d);
            most = fmax(most, fabs(expected[v][d]));
            worst = fmax(worst, fabs(f - expected[v][d]));
        }
    expect_at_most(worst / most, tolerance);
    for (int k = 0; k < 4; k++) // the spare vertex feels nothing
        assert_true(rows_get(&model->vertices.rows, model->vertices.force,
                             4L * model->vertices.count + k) == 0.0);
}

TEST(kernels_give_the_elements_forces)
{
    for (const char *const *isa = isa_available(); *isa != NULL; isa++)
        for (int k = 0; k < 2; k++) {
            // The reference takes small differences of places: 1e-16 times 32 cells over the
            // displacement. Single precision near rest stays as exact as far from it, because its
            // numbers are displacements.
            compare(LAWS[k], PRECISION_DOUBLE, *isa, 0.3, 1e-12);
            compare(LAWS[k], PRECISION_DOUBLE, *isa, 1e-6, 1e-8);
            compare(LAWS[k], PRECISION_SINGLE, *isa, 0.3, 3e-6);
            compare(LAWS[k], PRECISION_SINGLE, *isa, 1e-6, 3e-6);
        }
}

// Damping goes with the stiffness, so that all forces double, to the bit.
TEST(stiffness_scale_scales_all_forces)
{
    for (int precision = 0; precision < PRECISION_COUNT; precision++)
        for (int k = 0; k < 2; k++) {
            SCOPED(plane_world_destroy) PlaneWorld world;
            make_world(&world, LAWS[k], (Precision)precision, "auto");
            disturb(&world, 0.3);
            PlaneModel *model = world.model;
            const long count = 4L * model->vertices.count;
            FREED double *once = calloc((size_t)count, sizeof *once);
            evaluate(model, 1.0);
            for (long i = 0; i < count; i++) {
                once[i] = rows_get(&model->vertices.rows, model->vertices.force, i);
                rows_put(&model->vertices.rows, model->vertices.force, i, 0.0);
            }
            evaluate(model, 2.0);
            for (long i = 0; i < count; i++)
                assert_true(rows_get(&model->vertices.rows, model->vertices.force, i) ==
                            2.0 * once[i]);
        }
}

TEST(levels_give_the_same_bits)
{
    for (int precision = 0; precision < PRECISION_COUNT; precision++)
        for (int k = 0; k < 2; k++) {
            unsigned char *first = NULL;
            size_t bytes = 0;
            for (const char *const *isa = isa_available(); *isa != NULL; isa++) {
                SCOPED(plane_world_destroy) PlaneWorld world;
                make_world(&world, LAWS[k], (Precision)precision, *isa);
                disturb(&world, 0.5);
                plane_world_run(&world, 0.02);
                bytes = state_bytes(&world.state);
                unsigned char *block = calloc(1, bytes);
                state_copy_out(&world.state, block);
                if (first != NULL)
                    assert_memory_equal(first, block, bytes);
                free(first);
                first = block;
            }
            free(first);
        }
}
