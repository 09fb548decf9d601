// Bodies that touch each other: the law, momentum, energy, what rests, what is refused.
#include "effort.h"
#include "touching_bodies.h"

// --- the law -------------------------------------------------------------------------------------

static double component(Vec3 *x, int axis)
{
    return axis == 0 ? x->x : axis == 1 ? x->y : x->z;
}

static void shift(Vec3 *x, int axis, double by)
{
    if (axis == 0)
        x->x += by;
    else if (axis == 1)
        x->y += by;
    else
        x->z += by;
}

// At rest in some overlap: each force against the difference of energies.
static void expect_gradient(Run *run)
{
    Touch *touch = touch_of(run);
    touch_begin_tick(touch);
    read_still(touch);
    touch_evaluate(touch, 0.0);
    assert_true(touch->energy > 0.0);
    double largest = 0.0;
    for (int e = 0; e < 2; e++)
        for (int i = 0; i < touch->end[e].count; i++)
            largest = fmax(largest, vec3_length(touch->end[e].f[i]));
    const double step = 1e-4 * touch->depth;
    for (int e = 0; e < 2; e++)
        for (int i = 0; i < touch->end[e].count; i++) {
            Vec3 force;
            touch_evaluate(touch, 0.0);
            force = touch->end[e].f[i];
            for (int axis = 0; axis < 3; axis++) {
                double energy[2];
                for (int side = 0; side < 2; side++) {
                    const Vec3 kept = touch->end[e].x[i];
                    shift(&touch->end[e].x[i], axis, side == 0 ? -step : step);
                    touch_evaluate(touch, 0.0);
                    energy[side] = touch->energy;
                    touch->end[e].x[i] = kept;
                }
                const double slope = (energy[1] - energy[0]) / (2.0 * step);
                if (fabs(slope + component(&force, axis)) > 1e-6 * largest)
                    printf("end %d node %d axis %d: %g against %g of %g\n", e, i, axis, -slope,
                           component(&force, axis), largest);
                expect_at_most(fabs(slope + component(&force, axis)), 1e-6 * largest);
            }
        }
}

// Presses the second of two bodies onto the first.
#define PRESS                                                                                      \
    "loads = ( { body = \"two\"; center = [0, 0, 0.02]; radius = 0.1; force = [0, 0, -0.5];\n"     \
    "  duration = 1.0; } );\n"

static const char *const PAIRS[][2] = {
    {CUBE("one", "translation = [-0.0213, -0.0197, -0.04];", ""),
     CUBE("two", "translation = [-0.0101, -0.0053, 0.001]; rotation = [0.05, -0.03, 0.4];", "")},
    {BALL("one", "translation = [0.0, 0.0, -0.02];", ""),
     BALL("two", "translation = [0.0031, 0.0017, 0.0209]; rotation = [0.3, 0.2, 0.1];", "")},
    {CUBE("one", "translation = [-0.0213, -0.0197, -0.04];", ""),
     BALL("two", "translation = [0.0031, 0.0017, 0.0209]; rotation = [0.3, 0.2, 0.1];", "")},
};

static void forces_are_the_gradient_of_the_energy(void **state)
{
    (void)state;
    for (int k = 0; k < 3; k++) {
        char text[4096];
        Run run;
        snprintf(text, sizeof text, DOUBLE "bodies = ( %s, %s );\n" TOUCH("") PRESS, PAIRS[k][0],
                 PAIRS[k][1]);
        run_create(&run, text);
        for (int i = 0; i < 200 && touch_of(&run)->depth < 5e-4; i++)
            sim_step(run.world.sim);
        printf("pair %d\n", k);
        expect_gradient(&run);
        run_destroy(&run);
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(forces_are_the_gradient_of_the_energy),
    };
    return cmocka_run_group_tests(tests, run_begin, run_end);
}
