// SPDX-License-Identifier: MIT
// Contact stiffness by face (server/sim/README.md, "Contact stiffness"): on bodies whose nodes
// carry very different masses for their area, as voxels do at corners, every face may be as stiff
// as its own nodes bear.
#include "test.h"
#include "contact_bench.h"
#include "random.h"

// A sphere whose nodes weigh what a test says, given to the law of contact.
typedef struct Case {
    Bench bench;
    double *mass;
    double plain_kappa; // without firmness, of these masses
} Case;

// Masses spread over a factor of 10, or as the bench makes them.
static void create_case(Case *c, BenchFixing fixing, bool spread, ToolOptions tool)
{
    BenchOptions options = bench_with_tool(bench_ico_sphere(2), tool);
    options.fixing = fixing;
    bench_create(&c->bench, &options);
    BodySurface *surface = &c->bench.body->surface;
    size_t nodes = (size_t)surface->node_count, faces = (size_t)surface->face_count;
    c->mass = zeroed(nodes, sizeof *c->mass);
    surface->node_firmness = zeroed(nodes, sizeof(double));
    surface->face_firmness = zeroed(faces, sizeof(double));
    uint64_t random = 5;
    for (size_t i = 0; i < nodes; i++)
        c->mass[i] =
            surface->node_mass[i] * (spread ? pow(10.0, random_between(&random, 0.0, 1.0)) : 1.0);
    surface->node_mass = c->mass;

    double *face = surface->face_firmness;
    surface->face_firmness = NULL;
    contact_set_stiffness(c->bench.body);
    c->plain_kappa = c->bench.body->contact_kappa;
    surface->face_firmness = face;
    contact_set_stiffness(c->bench.body);
}

static void destroy_case(Case *c)
{
    free(c->bench.body->surface.node_firmness);
    free(c->bench.body->surface.face_firmness);
    free(c->mass);
    bench_destroy(&c->bench);
}

static bool is_fixed(const Body *body, int node)
{
    return body->ops->is_fixed(body->model, node);
}

TEST(faces_around_a_node_are_together_within_its_share_of_the_bound)
{
    for (int fixing = BENCH_FREE; fixing <= BENCH_SEATED; fixing++) {
        Case c;
        create_case(&c, (BenchFixing)fixing, true, bench_ball(0.005));
        const Body *body = c.bench.body;
        const BodySurface *s = &body->surface;
        for (int i = 0; i < s->node_count; i++) {
            if (is_fixed(body, i))
                continue;
            double sum = 0.0, share = body->contact_ratio * body->contact_lambda * s->node_mass[i];
            for (int k = s->node_face_start[i]; k < s->node_face_end[i]; k++) {
                int f = s->node_face[k];
                sum += body->contact_kappa * body_face_area(s, f) * s->face_firmness[f];
            }
            expect_at_most(sum, share * (1.0 + 1e-12)); // rounding of the sums
            // A plane meets a third of the faces' area: a third of the share, and all of it.
            double plane = body->contact_kappa * s->node_area[i] * s->node_firmness[i];
            expect_near(plane, share / 3.0, 1e-12 * share);
        }
        destroy_case(&c);
    }
}

TEST(every_face_is_as_stiff_as_its_lightest_node_bears)
{
    Case c;
    create_case(&c, BENCH_SEATED, true, bench_ball(0.005));
    const Body *body = c.bench.body;
    const BodySurface *s = &body->surface;
    double most = 0.0;
    for (int f = 0; f < s->face_count; f++) {
        double least = (double)INFINITY;
        for (int k = 0; k < 3; k++)
            if (!is_fixed(body, s->face[f][k]))
                least = fmin(least, s->node_mass[s->face[f][k]] / s->node_area[s->face[f][k]]);
        double kappa = body->contact_kappa * s->face_firmness[f];
        expect_at_least(kappa, c.plain_kappa * (1.0 - 1e-12)); // never softer than by one number
        most = fmax(most, kappa / c.plain_kappa);
        if (least < (double)INFINITY)
            expect_near(kappa, body->contact_ratio * body->contact_lambda * least / 3.0,
                        1e-12 * kappa);
    }
    expect_at_least(most, 3.0); // of the 10 that masses differ by
    destroy_case(&c);
}

// Where each node bears the same for its area, one number for all is right: the masses of the
// bench's body are lumped by area.
TEST(of_a_body_of_even_mass_every_face_is_equally_firm)
{
    Case c;
    create_case(&c, BENCH_FREE, false, bench_ball(0.005));
    expect_near(c.bench.body->contact_kappa, c.plain_kappa, 0.0);
    for (int f = 0; f < c.bench.body->surface.face_count; f++)
        expect_near(c.bench.body->surface.face_firmness[f], 1.0, 1e-12);
    destroy_case(&c);
}

// The first touch of a still body: the force is linear in the stiffness of what is touched.
static double push(bool table, double firmness)
{
    Case c;
    ToolOptions tool = table
                           ? bench_table(vec3(0.0, 0.0, -BENCH_RADIUS + 0.001), vec3(0.0, 0.0, 1.0))
                           : bench_ball(0.005);
    create_case(&c, BENCH_FROZEN, false, tool);
    BodySurface *s = &c.bench.body->surface;
    for (int f = 0; f < s->face_count; f++)
        s->face_firmness[f] = firmness;
    for (int i = 0; i < s->node_count; i++)
        s->node_firmness[i] = firmness;
    Vec3 force;
    if (table) {
        sim_step(c.bench.sim);
        force = sim_wrench(c.bench.sim, 0)->force;
    } else {
        bench_touch(&c.bench, 0, vec3(0.0, 0.0, BENCH_RADIUS + 0.0055)); // it comes from outside
        force = bench_touch(&c.bench, 0, vec3(0.0, 0.0, BENCH_RADIUS + 0.0045));
    }
    destroy_case(&c);
    return vec3_length(force);
}

TEST(forces_grow_with_firmness)
{
    for (int table = 0; table < 2; table++) {
        double once = push(table == 1, 1.0), thrice = push(table == 1, 3.0);
        assert_true(once > 0.0);
        expect_near(thrice, 3.0 * once, 1e-9 * thrice); // the same faces at the same depth
    }
}
