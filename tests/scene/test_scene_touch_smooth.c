// SPDX-License-Identifier: MIT
// Bodies that touch with their smooth surfaces: the slope of the energy for the vertices that carry
// them, Hertz, states after cuts; and bodies that overlap at the start.
#include "test.h"
#include "effort.h"
#include "touching_bodies.h"

#include "geometry/generator.h"

#define ONE LUMP("one", "translation = [0.0, 0.0, -0.02];", "")
#define TWO LUMP("two", "translation = [0.0031, 0.0017, 0.0209]; rotation = [0.3, 0.2, 0.1];", "")

// A body with a smooth surface is read with one vertex elsewhere, by `aside`.
static const BodyOps *plain_ops;
static int moved_vertex;
static Vec3 aside;

static void read_with_one_aside(const void *model, const int *node, int count, Vec3 *x, Vec3 *v)
{
    plain_ops->read_nodes(model, node, count, x, v);
    for (int i = 0; i < count; i++)
        if (node[i] == moved_vertex)
            x[i] = vec3_add(x[i], aside);
}

static double energy_with(Run *run, int vertex, Vec3 way)
{
    moved_vertex = vertex;
    aside = way;
    read_still(touch_of(run));
    touch_evaluate(touch_of(run), 0.0);
    return touch_of(run)->energy;
}

AROUND_ALL(scratch_begin, scratch_end)

// Of smooth surfaces the vertices that carry them get the slope of the energy: both bodies' by
// which something is pushed.
TEST(forces_on_vertices_are_the_gradient_of_the_energy)
{
    char text[4096];
    SCOPED(run_destroy) Run run;
    snprintf(text, sizeof text, DOUBLE "bodies = ( %s, %s );\n" TOUCH("") PRESS, ONE, TWO);
    run_create(&run, text);
    for (int i = 0; i < 200 && touch_of(&run)->depth < 5e-4; i++)
        sim_step(run.world.sim);
    Touch *touch = touch_of(&run);
    touch_begin_tick(touch, 0);
    const double step = 1e-4 * touch->depth;
    int pushed = 0;
    for (int e = 0; e < 2; e++) {
        TouchEnd *end = &touch->end[e];
        BodyOps ops = *end->body->ops;
        plain_ops = end->body->ops;
        ops.read_nodes = read_with_one_aside;
        energy_with(&run, -1, aside);
        carriers_give(end->fit, end->count, end->f);
        FREED Vec3 *force = malloc((size_t)end->fit->count * sizeof *force);
        assert_non_null(force);
        memcpy(force, end->fit->f, (size_t)end->fit->count * sizeof *force);
        double largest = 0.0;
        for (int i = 0; i < end->fit->count; i++)
            largest = fmax(largest, vec3_length(force[i]));
        end->body->ops = &ops;
        for (int i = 0; i < end->fit->count; i++) {
            pushed += vec3_length(force[i]) > 0.01 * largest;
            for (int axis = 0; axis < 3; axis++) {
                Vec3 way = {0.0, 0.0, 0.0};
                shift(&way, axis, step);
                const double slope = (energy_with(&run, end->fit->node[i], way) -
                                      energy_with(&run, end->fit->node[i], vec3_scale(-1.0, way))) /
                                     (2.0 * step);
                expect_at_most(fabs(slope + component(&force[i], axis)), 1e-6 * largest);
            }
        }
        end->body->ops = plain_ops;
    }
    assert_true(pushed > 20);
}

// Free bodies that overlap by half a cell at the start part slowly, as far as they overlap.
TEST(what_overlaps_at_the_start_parts_slowly)
{
    for (int k = 0; k < 3; k++) {
        static const char *const PLACED[][2] = {
            {CUBE("one", "", ""), CUBE("two", "translation = [0.001, 0.002, 0.035];", "")},
            {LUMP("one", "", ""), LUMP("two", "translation = [0.001, 0.002, 0.035];", "")},
            {CUBE("one", "", ""), LUMP("two", "translation = [0.001, 0.002, 0.035];", "")},
        };
        char text[4096];
        SCOPED(run_destroy) Run run;
        snprintf(text, sizeof text, DOUBLE "bodies = ( %s, %s );\n" TOUCH(""), PLACED[k][0],
                 PLACED[k][1]);
        run_create(&run, text);
        double fastest = 0.0, deepest = 0.0;
        for (int i = 0; i < 1000; i++) {
            sim_step(run.world.sim);
            const Touch *touch = touch_of(&run);
            fastest = fmax(fastest, fmax(touch->end[0].fastest, touch->end[1].fastest));
        }
        SCOPED(shell_free) Shell one = shell_of(&run, 0), two = shell_of(&run, 1);
        deepest = fmax(depth_inside(&one, &two), depth_inside(&two, &one));
        print_message("at most %.3f m/s, %.3f mm deep at the end\n", fastest, 1e3 * deepest);
        // They part by an edge of a face in 0.1 s, at 0.14 m/s; then they fly apart, and swing.
        expect_at_most(fastest, 0.5);
        expect_at_most(deepest, 1e-4);
        assert_int_equal(sim_resets(run.world.sim), 0);
    }
}

// Writes a sphere as a mesh file into the folder of the test.
static void write_sphere(double radius)
{
    SCOPED(mesh_destroy) TriMesh mesh;
    Status status = {0};
    expect_ok(generate_ico_sphere(&mesh, 5, radius, &status), status);
    char *text = malloc((size_t)64 * (size_t)(mesh.node_count + mesh.triangle_count)), *to = text;
    assert_non_null(text);
    for (int i = 0; i < mesh.node_count; i++)
        to += sprintf(to, "v %.9f %.9f %.9f\n", mesh.position[i].x, mesh.position[i].y,
                      mesh.position[i].z);
    for (int i = 0; i < mesh.triangle_count; i++)
        to += sprintf(to, "f %d %d %d\n", mesh.triangle[i][0] + 1, mesh.triangle[i][1] + 1,
                      mesh.triangle[i][2] + 1);
    scratch_write(&scratch_space, "sphere.obj", text, (size_t)(to - text));
    free(text);
}

// Returns the force between two spheres of tissue, with so many cells on a radius, that are held in
// their far halves and overlap by `overlap` before they give way [N].
static double press_spheres(double radius, double cells, double overlap, Vec3 way)
{
    char text[4096], sphere[2][1024];
    for (int b = 0; b < 2; b++) {
        const Vec3 at = vec3_scale(b == 0 ? 0.0 : 2.0 * radius - overlap, vec3_unit(way));
        snprintf(sphere[b], sizeof sphere[b],
                 "{ name = \"%s\"; model = \"voxel\"; voxels = { mesh = \"sphere.obj\";\n"
                 "  size = %.9f; place = { translation = [%.9f, %.9f, %.9f]; }; };\n"
                 "  material = { youngs_modulus = 5000.0; poisson_ratio = 0.3; density = 1000.0;\n"
                 "    damping = 2.0; drag = 60.0; };\n"
                 "  fixed = ( { box = ([-1, -1, %.9f], [1, 1, %.9f]); } ); }",
                 b == 0 ? "one" : "two", radius / cells, at.x, at.y, at.z,
                 b == 0 ? -1.0 : at.z - 1e-6, b == 0 ? 1e-6 : 1.0);
    }
    snprintf(text, sizeof text,
             "gravity = [0, 0, 0];\nbodies = ( %s,\n %s );\n" TOUCH("stiffness = 4.0;"), sphere[0],
             sphere[1]);
    Run run;
    run_create(&run, text);
    sim_ticks(run.world.sim, 160);
    Vec3 sum = {0, 0, 0};
    const TouchEnd *end = &touch_of(&run)->end[1];
    for (int n = 0; n < end->count; n++)
        sum = vec3_add(sum, end->f[n]);
    run_destroy(&run);
    return vec3_length(sum);
}

// Two equal elastic spheres: F = 4/3 E' sqrt(R/2) d^(3/2), E' = E / (2 (1 - nu^2)) (Hertz 1881),
// for contacts much smaller than the spheres, here an eighth of their radius. Along an axis of the
// cells, and on two ways between.
LONG_TEST(spheres_follow_hertz)
{
    static const Vec3 WAYS[] = {{0.0, 0.0, 1.0}, {0.2, 0.1, 0.97}, {0.4, 0.25, 0.88}};
    static const double CELLS[] = {8.3, 16.3, 31.6};
    const double radius = 0.02, overlap = 0.03 * radius;
    const double hertz =
        4.0 / 3.0 * 5000.0 / (2.0 * (1.0 - 0.09)) * sqrt(0.5 * radius) * pow(overlap, 1.5);
    double rms[3] = {0.0};
    write_sphere(radius);
    for (int k = 0; k < 3; k++) {
        double off[3];
        for (int w = 0; w < 3; w++) {
            off[w] = press_spheres(radius, CELLS[k], overlap, WAYS[w]) / hertz - 1.0;
            rms[k] += off[w] * off[w] / 3.0;
        }
        rms[k] = sqrt(rms[k]);
        print_message("%.1f cells on a radius: %+.1f %+.1f %+.1f %% of Hertz, %.1f %% rms\n",
                      CELLS[k], 100.0 * off[0], 100.0 * off[1], 100.0 * off[2], 100.0 * rms[k]);
        for (int w = 0; w < 3 && k == 2; w++)
            expect_at_most(fabs(off[w]), 0.05);
    }
    assert_true(rms[1] < rms[0] && rms[2] < rms[1]);
}

// A cap lies on the smooth ball that it was cut from. When a search holds and nothing fades any
// more, the state goes on alike in another world.
TEST(a_cut_goes_on_alike_in_another_world)
{
    static const char TEXT[] = "gravity = [0, 0, -9.81];\nbodies = ( " LUMP(
        "one", "",
        "cuttable = true; fixed = ( { box = ([-1, -1, -1], [1, 1, -0.01]); } );") " );\n"
                                                                                  "touch = ( { "
                                                                                  "bodies = "
                                                                                  "[\"one\"]; "
                                                                                  "friction = 0.5; "
                                                                                  "} );\n";
    SCOPED(run_destroy) Run run, other;
    const CutOptions cut = {.body = 0,
                            .before = {{{-0.1, -0.1, 0.004}, {-0.1, 0.1, 0.004}}},
                            .after = {{{0.1, -0.1, 0.004}, {0.1, 0.1, 0.004}}}};
    CutOutcome sum = {0};
    run_create(&run, TEXT);
    Sim *sim = run.world.sim;
    apply_well(sim_apply_cut, sim, &cut, &sum);
    sim_ticks(sim, 1500);
    for (int i = 0; i < 200 && touch_of(&run)->kept->holds == 0; i++)
        sim_step(sim);
    assert_true(touch_of(&run)->kept->holds != 0 && touch_of(&run)->depth > 0.0);
    assert_true(sim_body(sim, 0)->mesh.fit.fade_last > 0);
    FREED void *middle = malloc(state_bytes(&run.world.state));
    assert_non_null(middle);
    state_copy_out(&run.world.state, middle);
    run_create(&other, TEXT);
    state_copy_in(&other.world.state, middle);
    sim_restored(other.world.sim);
    for (int i = 0; i < 50; i++) {
        sim_step(sim);
        sim_step(other.world.sim);
    }
    assert_true(state_hash(&run.world.state) == state_hash(&other.world.state));
}
