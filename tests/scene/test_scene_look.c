// SPDX-License-Identifier: MIT
// Looks of bodies: the colours that scenes name, and an image that cuts lay open.
#include "test.h"
#include "volume_writer.h"
#include "world_run.h"

#include "body/look.h"

AROUND_ALL(scratch_begin, scratch_end)

// A block of 60 x 40 x 40 mm in voxels of 5 mm, label 2 above label 1.
static void write_labels(void)
{
    FREED Bytes *bytes = calloc(1, sizeof *bytes);
    put_text(bytes, "NRRD0004\ntype: uchar\ndimension: 3\nsizes: 14 10 10\nspacings: 5 5 5\n"
                    "encoding: raw\n\n");
    for (int at = 0; at < 1400; at++) {
        const int i = at % 14, j = at / 14 % 10, k = at / 140;
        const bool inside = i > 0 && i < 13 && j > 0 && j < 9 && k > 0 && k < 9;
        const unsigned char label = (unsigned char)(inside ? k < 5 ? 1 : 2 : 0);
        put_bytes(bytes, &label, 1);
    }
    scratch_write(&scratch_space, "labels.nrrd", bytes->at, bytes->size);
}

// Voxels of 3 mm of an image that covers it, and how much they differ from one to the next.
static const double IMAGE_STEP = 0.003, RAMP = 10.0;

// Grey values that grow along x, from 0 at its lower end, beyond the block.
static double grey_at(double x)
{
    return RAMP * (x + 0.003) / IMAGE_STEP;
}

static void write_ramp(void)
{
    FREED Bytes *bytes = calloc(1, sizeof *bytes);
    put_text(bytes, "NRRD0004\ntype: uchar\ndimension: 3\nspace: LPS\nsizes: 25 18 18\n"
                    "space directions: (3,0,0) (0,3,0) (0,0,3)\nspace origin: (-3,-3,-3)\n"
                    "encoding: raw\n\n");
    for (int at = 0; at < 25 * 18 * 18; at++) {
        const unsigned char grey = (unsigned char)(RAMP * (at % 25));
        put_bytes(bytes, &grey, 1);
    }
    scratch_write(&scratch_space, "ramp.nrrd", bytes->at, bytes->size);
}

static const Vec3 TURN = {0.2, -0.1, 0.5}, SHIFT = {0.3, -0.2, 0.1};

// The place in the world, while nothing has moved, of one in the frame of the file.
static Vec3 in_world(double x, double y, double z)
{
    return vec3_add(quat_rotate(quat_from_rotation(TURN), vec3(x, y, z)), SHIFT);
}

#define BLOCK(more)                                                                                \
    "gravity = [2.0, 0.0, 0.0];\n"                                                                 \
    "bodies = ( { name = \"block\"; model = \"voxel\"; cuttable = true;\n"                         \
    "  voxels = { file = \"labels.nrrd\"; label = [1, 2];\n"                                       \
    "    place = { rotation = [0.2, -0.1, 0.5]; translation = [0.3, -0.2, 0.1]; }; };\n" more      \
    " } );\n"

// Cuts the falling block by a plane of the file's frame through (x, 20 mm, 20 mm), whose normal is
// turned from x towards y by `tilt`.
static void cut_through(Sim *sim, double x, double tilt)
{
    const double t = sim_time(sim);
    const Vec3 fallen = {t * t, 0.0, 0.0}; // half of 2 m/s2
    CutOptions cut = {.body = -1};
    for (int e = 0; e < 2; e++) {
        const double z = e == 0 ? -0.05 : 0.1;
        cut.before.end[e] =
            vec3_add(in_world(x + 0.08 * sin(tilt), 0.02 - 0.08 * cos(tilt), z), fallen);
        cut.after.end[e] =
            vec3_add(in_world(x - 0.08 * sin(tilt), 0.02 + 0.08 * cos(tilt), z), fallen);
    }
    CutOutcome sum;
    char why[192] = "";
    assert_true(sim_apply_cut(sim, &cut, &sum, why, sizeof why));
    assert_true(sum.separated > 0);
}

// Calls `check` for each live node on a wall of a cut, with where it lies at rest in the file.
static int visit_walls(Sim *sim, void (*check)(Vec3 at, LookColours colours))
{
    const Body *body = sim_body(sim, 0);
    const BodyMesh *mesh = &body->mesh;
    FREED float *rest = calloc(3 * (size_t)mesh->node_capacity, sizeof *rest);
    FREED bool *wall = calloc((size_t)mesh->node_capacity, sizeof *wall);
    int nodes = 0;
    body->ops->snapshot_rest(body->model, rest);
    assert_true(mesh->first_wall > 0);
    for (int t = mesh->first_wall; t < mesh->triangle_count; t++)
        for (int k = 0; k < 3 && mesh->triangle[t][0] != mesh->triangle[t][1]; k++)
            wall[mesh->triangle[t][k]] = true;
    for (int i = 0; i < mesh->node_count; i++) {
        if (!wall[i] || mesh->id[i] < 0)
            continue;
        const Vec3 x = vec3((double)rest[3 * i], (double)rest[3 * i + 1], (double)rest[3 * i + 2]);
        check(quat_rotate(quat_conjugate(quat_from_rotation(TURN)), vec3_sub(x, SHIFT)),
              look_colours(body->look, rest + 3 * i));
        nodes++;
    }
    return nodes;
}

static double cut_at;

// The plane of the cut is known, wherever the body's own arithmetic has its nodes.
static void expect_grey_of_cut(Vec3 at, LookColours colours)
{
    (void)at;
    for (int c = 0; c < 3; c++)
        expect_near(colours.inside[c], grey_at(cut_at), 0.5 * RAMP); // half a voxel's step
}

static void expect_grey_of_place(Vec3 at, LookColours colours)
{
    // Rounded once; a node's rest position has single precision.
    expect_near(colours.inside[0], grey_at(at.x), 0.51);
}

TEST(a_wall_of_a_cut_shows_the_image_where_it_lies_at_rest)
{
    write_labels();
    write_ramp();
    static const double x[] = {0.0212, 0.0375, 0.049};
    for (int n = 0; n < 3; n++) {
        START_RUN(run, BLOCK("look = { image = \"ramp.nrrd\"; };"));
        for (int t = 0; t < 300; t++)
            sim_step(run.world.sim);
        cut_at = x[n];
        cut_through(run.world.sim, cut_at, 0.0);
        assert_in_range(visit_walls(run.world.sim, expect_grey_of_cut), 100, 10000);
        // An oblique cut through it, as the pieces part.
        cut_through(run.world.sim, cut_at - 0.004, 0.7);
        for (int t = 0; t < 50; t++)
            sim_step(run.world.sim);
        assert_in_range(visit_walls(run.world.sim, expect_grey_of_place), 200, 10000);
    }
}

static void expect_label_of_place(Vec3 at, LookColours colours)
{
    // The last layer of label 1 has its middle at 20 mm, the first one of label 2 at 25.
    const double share = fmin(fmax((at.z - 0.02) / 0.005, 0.0), 1.0);
    expect_near(colours.inside[2], 255.0 + share * (51.0 - 255.0), 0.51); // rounded once
}

TEST(walls_have_the_colour_of_the_label_that_they_cut)
{
    write_labels();
    START_RUN(run, BLOCK("look = { inside = [0.0, 0.0, 1.0]; };\n"
                         "materials = ( { label = 2; inside = [0.0, 0.0, 0.2]; } );"));
    cut_through(run.world.sim, 0.03, 0.3);
    assert_in_range(visit_walls(run.world.sim, expect_label_of_place), 100, 10000);
}

TEST(colours_do_not_change_what_a_checkpoint_is_known_by)
{
    write_labels();
    write_ramp();
    START_RUN(plain, BLOCK(""));
    START_RUN(coloured, BLOCK("look = { color = [1, 1, 1]; image = \"ramp.nrrd\"; };\n"
                              "materials = ( { label = 2; color = [0.0, 0.5, 0.2]; } );"));
    assert_true(plain.world.physics == coloured.world.physics);
    assert_null(sim_body(plain.world.sim, 0)->look);
}

TEST(looks_that_cannot_be_are_refused_with_what_is_right)
{
    static const struct {
        const char *more, *said;
    } wrong[] = {
        {"look = { color = [1.2, 0.0, 0.0]; };", "from 0 to 1 each"},
        {"look = { inside = [0.0, -0.1, 0.0]; };", "from 0 to 1 each"},
        {"look = { colour = [0.0, 0.1, 0.0]; };", "did you mean color?"},
        {"look = { image = \"none.nrrd\"; };", "none.nrrd: No such file"},
        {"look = { black = 1.0; white = 2.0; };", "need an image"},
        {"look = { image = \"ramp.nrrd\"; black = 1.0; };", "only one of black and white"},
        {"look = { image = \"ramp.nrrd\"; black = 1.0; white = 1.0; };", "must differ"},
        {"materials = ( { label = 2; color = [1.5, 0.0, 0.0]; } );", "from 0 to 1 each"},
    };
    write_labels();
    write_ramp();
    for (size_t i = 0; i < sizeof wrong / sizeof *wrong; i++) {
        char text[1024];
        World world;
        snprintf(text, sizeof text, BLOCK("%s"), wrong[i].more);
        const char *said = try_world(&world, text, &(BuildOptions){.isa = "auto"});
        if (strstr(said, wrong[i].said) == NULL)
            fail_msg("'%s' does not say '%s'", said, wrong[i].said);
    }
}
