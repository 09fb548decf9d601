// SPDX-License-Identifier: MIT
// Where the nodes of published meshes rest, and their texture coordinates: of all kinds of bodies,
// before and after their meshes have changed.
#include "test.h"
#include "world_run.h"

#include "run/exchange.h"

static void build(Run *run, const char *text, bool publishes)
{
    run_create_with(run, text,
                    &(BuildOptions){.isa = "auto", .may_load = true, .publishes = publishes});
}

static int live_nodes(const Body *body)
{
    int live = 0;
    for (int i = 0; i < body->mesh.node_count; i++)
        live += body->mesh.id[i] >= 0;
    return live;
}

static RestCopy *take_rest(const Body *body)
{
    RestCopy *rest = zeroed(1, rest_copy_bytes(body));
    assert_true(rest_is_known(body));
    rest_copy_follow(rest, body);
    assert_int_equal(rest->topology, body->mesh.topology);
    assert_int_equal(rest->node_count, body->mesh.node_count);
    return rest;
}

// Every node in use is at its rest position; every other rests at the origin.
static void expect_at_rest(const Body *body, const RestCopy *rest)
{
    const BodyMesh *mesh = &body->mesh;
    FREED float *x = zeroed(3 * (size_t)mesh->node_count, sizeof *x);
    body->ops->snapshot(body->model, x, NULL);
    for (int i = 0; i < mesh->node_count; i++)
        for (int c = 0; c < 3; c++) {
            double at = mesh->id[i] >= 0 ? (double)x[3 * i + c] : 0.0;
            // Coordinates here are below 1 m, to which single precision is good to 6e-8; frame and
            // place add a few roundings of their own.
            expect_near((double)rest->position[3 * i + c], at, 3e-7);
        }
}

static void move(Sim *sim, int ticks)
{
    for (int k = 0; k < ticks; k++)
        sim_step(sim);
}

static const char LOAD[] = "loads = ( { center = [0.2, 0.1, 0.35]; radius = 0.02; start = 0.0;\n"
                           "  force = [0.1, 0.0, -0.4]; duration = 10.0; } );\n";

// A ball around (0.2, 0.1, 0.3) of 5 cm.
static void write_ball(char text[2048], const char *head, const char *keys)
{
    snprintf(text, 2048,
             "name = \"rest\"; publish = { rest = true; }; %s\n"
             "bodies = ( { name = \"ball\"; mesh = { generator = \"ico_sphere\"; nodes = 162;\n"
             "  radius = 0.05; place = { translation = [0.2, 0.1, 0.3]; }; }; %s } );\n%s",
             head, keys, LOAD);
}

#define FIXED "fixed = ( { box = ([-1.0, -1.0, -1.0], [1.0, 1.0, 0.27]); } ); "
#define ADAPT "levels = 2; shape = {}; adapt = { force = 0.005; }; "

static const struct {
    const char *head, *keys;
    bool changes;
} BALLS[] = {
    {"", FIXED "shape = {};", false},
    {"precision = \"double\";", FIXED "shape = {};", false},
    {"", "shape = { frame = \"body\"; };", false}, // flies
    {"", FIXED "levels = 1; start_level = 1; shape = {};", false},
    {"", FIXED "levels = 0; integrator = \"implicit\"; shape = {};", false},
    {"", FIXED ADAPT, true},
    {"precision = \"double\";", FIXED ADAPT, true},
    {"", "levels = 2; shape = { frame = \"body\"; }; adapt = { force = 0.005; };", true},
    {"", FIXED ADAPT "adjust = \"choi2005\";", true},
    {"", FIXED ADAPT "cuttable = true;", true},
    {"", FIXED "levels = 1; shape = {}; cuttable = true; prestress = 0.05;", true},
};
enum { BALL_COUNT = sizeof BALLS / sizeof *BALLS };

AROUND_ALL(scratch_begin, scratch_end)

TEST(nodes_rest_where_they_are_before_anything_acts)
{
    for (int k = 0; k < BALL_COUNT; k++) {
        char text[2048];
        SCOPED(run_destroy) Run run;
        write_ball(text, BALLS[k].head, BALLS[k].keys);
        build(&run, text, true);
        Body *body = sim_body(run.world.sim, 0);
        FREED RestCopy *rest = take_rest(body);
        expect_at_rest(body, rest);
        // What moves does not take it along.
        move(run.world.sim, 5);
        if (!body_changes(body)) {
            FREED RestCopy *again = take_rest(body);
            assert_memory_equal(again, rest,
                                sizeof *rest + 3 * (size_t)rest->node_count * sizeof(float));
        }
    }
}

static void cut_through(Sim *sim, double x)
{
    const CutOptions cut = {.body = -1,
                            .before = {{{x, -1.0, -1.0}, {x, -1.0, 1.0}}},
                            .after = {{{x, 1.0, -1.0}, {x, 1.0, 1.0}}}};
    CutOutcome sum;
    char why[192];
    sim_apply_cut(sim, &cut, &sum, why, sizeof why);
}

// Back in its rest shape a refined, cut body lies where its nodes are said to rest. So do nodes
// that came meanwhile, wherever they hang or were moved to by a blade.
TEST(nodes_that_came_rest_where_the_rest_shape_has_them)
{
    for (int k = 0; k < BALL_COUNT; k++) {
        if (!BALLS[k].changes)
            continue;
        char text[2048];
        SCOPED(run_destroy) Run run;
        write_ball(text, BALLS[k].head, BALLS[k].keys);
        build(&run, text, true);
        Sim *sim = run.world.sim;
        Body *body = sim_body(sim, 0);
        const int before = live_nodes(body);
        FREED RestCopy *kept = take_rest(body);
        for (int n = 0; n < 20; n++) {
            move(sim, 5);
            if (n == 10 && body->ops->cut != NULL)
                cut_through(sim, 0.203);
            // A copy that was kept through is as one taken again: places move with topologies only.
            rest_copy_follow(kept, body);
            FREED RestCopy *anew = take_rest(body);
            assert_memory_equal(anew, kept,
                                sizeof *anew + 3 * (size_t)anew->node_count * sizeof(float));
        }
        assert_true(live_nodes(body) > before);
        body->ops->restore(body->model, RESTORE_SHAPE);
        FREED RestCopy *rest = take_rest(body);
        expect_at_rest(body, rest);
    }
}

#if defined(PLIANT_WITH_VOXEL) && defined(PLIANT_WITH_PLANE)
TEST(nodes_of_voxel_bodies_rest_in_their_lattice)
{
    static const char *const BODIES[] = {
        "voxels = { generator = \"ball\"; radius = 0.04; size = 0.008; }; levels = 1; ",
        "voxels = { generator = \"box\"; count = [6, 6, 6]; size = 0.008; }; levels = 1; "
        "cuttable = true; split_budget = 1000; ",
        "voxels = { generator = \"disc\"; radius = 0.04; size = 0.005; }; dimensions = 2; "
        "levels = 2; ",
        "voxels = { generator = \"disc\"; radius = 0.04; size = 0.005; }; dimensions = 2; "
        "levels = 2; cuttable = true; ",
        "voxels = { generator = \"box\"; count = [6, 6, 6]; size = 0.008; }; "
        "skin = { mesh = \"skin.obj\"; }; ",
    };
    static const char SKIN[] = "v -.024 -.024 -.024\nv .024 -.024 -.024\nv -.024 .024 -.024\n"
                               "v -.024 -.024 .024\nvt 0 0\nvt 1 0\nvt 0 1\nvt .5 .5\n"
                               "f 1/1 3/3 2/2\nf 1/1 2/2 4/4\nf 2/2 3/3 4/4\nf 1/1 4/4 3/3\n";
    scratch_write(&scratch_space, "skin.obj", SKIN, strlen(SKIN));
    for (size_t k = 0; k < sizeof BODIES / sizeof *BODIES; k++) {
        char text[2048];
        SCOPED(run_destroy) Run run;
        snprintf(text, sizeof text,
                 "name = \"rest\"; publish = { rest = true; }; gravity = [0.0, -9.81, 0.0];\n"
                 "bodies = ( { name = \"cells\"; model = \"voxel\"; %s } );\n",
                 BODIES[k]);
        build(&run, text, true);
        Sim *sim = run.world.sim;
        Body *body = sim_body(sim, 0);
        FREED RestCopy *rest = take_rest(body);
        expect_at_rest(body, rest);
        move(sim, 20);
        if (body->ops->cut != NULL) {
            cut_through(sim, 0.003);
            move(sim, 20);
            assert_true(body->mesh.topology != rest->topology);
        }
        rest_copy_follow(rest, body);
        body->ops->restore(body->model, RESTORE_SHAPE);
        expect_at_rest(body, rest);
        assert_int_equal(body->texture != NULL, strstr(BODIES[k], "skin") != NULL);
    }
}
#endif

TEST(midpoints_have_the_mean_texture_of_their_parents)
{
    static const char *const KEYS[] = {FIXED ADAPT, FIXED ADAPT "cuttable = true;",
                                       FIXED "levels = 2; start_level = 2; shape = {};"};
    for (int k = 0; k < 3; k++) {
        char text[2048];
        SCOPED(run_destroy) Run run;
        write_ball(text, "", KEYS[k]);
        build(&run, text, true);
        Sim *sim = run.world.sim;
        Body *body = sim_body(sim, 0);
        move(sim, 50);
        if (body->ops->cut != NULL)
            cut_through(sim, 0.203);
        const BodyMesh *mesh = &body->mesh;
        float(*uv)[2] = calloc((size_t)mesh->node_count, sizeof *uv);
        assert_non_null(uv);
        assert_non_null(body->texture);
        rest_texture(body, mesh, 0, mesh->node_count, uv[0]);
        int midpoints = 0, copies = 0;
        for (int i = 0; i < mesh->node_count; i++) {
            const int *parent = mesh->parent[i];
            if (mesh->id[i] < 0) {
                assert_true(uv[i][0] == 0.0F && uv[i][1] == 0.0F);
            } else if (mesh->origin[i] != mesh->id[i]) {
                copies++;
                assert_memory_equal(uv[i], body->texture[mesh->origin[i]], sizeof uv[i]);
            } else if (parent[0] != mesh->id[i]) {
                midpoints++;
                const float *a = body->texture[parent[0]], *b = body->texture[parent[1]];
                for (int c = 0; c < 2; c++)
                    assert_true(uv[i][c] == 0.5F * (a[c] + b[c]));
            } else {
                assert_memory_equal(uv[i], body->texture[mesh->id[i]], sizeof uv[i]);
            }
        }
        assert_true(midpoints > 10);
        assert_int_equal(copies > 0, body->ops->cut != NULL);
        free(uv);
    }
}

// A tetrahedron whose first vertex no face names: indices of the file, not of what is left of it.
static const char OBJ[] =
    "v 9 9 9\nv 0 0 0\nv .1 0 0\nv 0 .1 0\nv 0 0 .1\nvt .25 .5\nvt .75 0\nvt 0 1\nvt 1 .125\n"
    "f 2/1 4/3 3/2\nf 2/1 3/2 5/4\nf 3/2 4/3 5/4\nf 2/1 5/4 4/3\n";
static const char FROM_FILE[] = "name = \"rest\"; publish = { rest = %s; };\n"
                                "bodies = ( { name = \"a\"; mesh = { file = \"a.obj\"; };\n"
                                "  levels = 1; start_level = 1; shape = {}; } );\n";

TEST(nodes_of_a_file_have_its_texture)
{
    char text[512];
    SCOPED(run_destroy) Run run;
    scratch_write(&scratch_space, "a.obj", OBJ, strlen(OBJ));
    snprintf(text, sizeof text, FROM_FILE, "true");
    build(&run, text, true);
    const Body *body = sim_body(run.world.sim, 0);
    const float expected[4][2] = {{0.25F, 0.5F}, {0.75F, 0.0F}, {0.0F, 1.0F}, {1.0F, 0.125F}};
    assert_int_equal(body->texture_count, 5 + 6);
    assert_memory_equal(body->texture[1], expected, sizeof expected);
    for (int i = 0; i < body->mesh.node_count; i++)
        assert_in_range(body->mesh.id[i], 1, body->texture_count - 1);
}

TEST(nobody_keeps_what_nobody_is_told)
{
    for (int k = 0; k < 2; k++) {
        char text[512];
        SCOPED(run_destroy) Run run;
        scratch_write(&scratch_space, "a.obj", OBJ, strlen(OBJ));
        snprintf(text, sizeof text, FROM_FILE, k == 0 ? "false" : "true");
        build(&run, text, k == 0); // not requested, and offline
        assert_null(sim_body(run.world.sim, 0)->texture);
        assert_null(run.world.mesh[0].uv);
        for (int i = 0; i < run.world.arena.count; i++)
            assert_null(strstr(run.world.arena.block[i].name, "texture"));
    }
}
