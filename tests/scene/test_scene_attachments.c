// SPDX-License-Identifier: MIT
// How scenes name attachments: what is refused, and the integrator that joined bodies share.
#include "test.h"
#include "tied_bodies.h"

static void expect_refused(const char *attachment, const char *why)
{
    static const char ONE[] =
        BALL("one", "[0, 0, 0]", "fixed = ( { sphere = [0, 0, -0.05]; radius = 0.03; } );");
    static const char TWO[] = BALL("two", "[0.3, 0, 0]", "");
    static const char OTHER[] = BALL("other", "[0.1, 0, 0]", "time_step = 1e-4;");
    static const char TOOLS[] =
        "tools = ( { id = 3; kind = \"grasper\"; capsules = ( { radius = 0.01; } ); } );\n";
    char text[4096];
    World world;
    snprintf(text, sizeof text, "bodies = ( %s,\n  %s,\n  %s );\n%sattachments = (\n%s );", ONE,
             TWO, OTHER, TOOLS, attachment);
    const char *said = strstr(try_world(&world, text, &(BuildOptions){.isa = "auto"}), "x.cfg:");
    assert_non_null(said);
    assert_string_equal(said, why);
}

AROUND_ALL(scratch_begin, scratch_end)

TEST(wrong_attachments_are_named_by_their_line)
{
#define AT "x.cfg:12: "
    expect_refused("{ body = \"thing\"; sphere = [0, 0, 0]; radius = 1; to = \"world\"; }",
                   AT "body \"thing\" is not in the scene: its bodies are one, two, other");
    expect_refused("{ body = \"one\"; to = \"world\"; }",
                   AT "attachments entry must be one of { box }, { sphere; radius } and { nodes }");
    expect_refused("{ body = \"one\"; sphere = [0, 0, 0]; to = \"world\"; }",
                   AT "attachments radius is missing: a ball has a sphere and a radius");
    expect_refused("{ body = \"one\"; sphere = [0, 0, 0]; radius = 1; }",
                   AT "attachments entry must hold to one of to = \"world\", tool = id and to_body "
                      "= name");
    expect_refused("{ body = \"one\"; sphere = [0, 0, 0]; radius = 1; tool = 4; }",
                   AT "tool 4 is not in the scene: tools = ( { id = 4; ... } )");
    expect_refused("{ body = \"one\"; sphere = [0, 0, 0]; radius = 1; to_body = \"one\"; }",
                   AT "to_body \"one\" is the body itself");
    expect_refused("{ body = \"one\"; sphere = [0, 0, 5]; radius = 1; to = \"world\"; }",
                   AT "attachments: no free node of body one lies in the region");
    expect_refused(
        "{ body = \"one\"; sphere = [0, 0, -0.05]; radius = 0.02; to = \"world\"; }",
        AT "attachments: no free node of body one lies in the region: all that do are fixed");
    expect_refused("{ body = \"one\"; nodes = [3, 4, 1000]; to = \"world\"; }",
                   AT "attachments: nodes: 1 of 3 are not on the outside of body one");
#undef AT
}

TEST(attachment_far_from_the_other_body_is_refused)
{
    const char *text = "bodies = ( " BALL("one", "[0, 0, 0]", "") ",\n" BALL(
        "two", "[0.3, 0, 0]",
        "") " );\n"
            "attachments = ( { body = \"two\"; sphere = [0.25, 0, 0]; radius = 0.02;\n"
            "  to_body = \"one\"; } );";
    World world;
    const char *said = strstr(try_world(&world, text, &(BuildOptions){.isa = "auto"}),
                              "x.cfg:7: attachments: a node at (");
    assert_non_null(said);
    expect_in(said, " m from body one, at most ");
}

TEST(nodes_are_named_as_in_the_mesh)
{
    START_RUN(
        run, "bodies = ( " BALL(
                 "one", "[0, 0, 0]",
                 "") " );\n"
                     "attachments = ( { body = \"one\"; nodes = [5, 7, 161]; to = \"world\"; } );");
    const Attachment *hold = run.world.sim->attachment[0];
    bool points;
    assert_int_equal(attachment_held(hold, &points), 3);
}

// A chain of four bodies, each tied to the next; `more`: what each says besides.
static const char *read_chain(const char *const model[4], const char *const more[4], Scene *scene)
{
    static char text[2048], said[512];
    char path[SCRATCH_PATH];
    Status status = {0};
    int size = snprintf(text, sizeof text, "bodies = (");
    for (int i = 0; i < 4; i++)
        size += snprintf(text + size, sizeof text - (size_t)size,
                         "%s { name = \"b%d\"; model = \"%s\"; %s = { generator = \"%s\"; }; %s }",
                         i > 0 ? "," : "", i, model[i], model[i][0] == 'v' ? "voxels" : "mesh",
                         model[i][0] == 'v' ? "box" : "sphere", more[i]);
    size += snprintf(text + size, sizeof text - (size_t)size, ");\nattachments = (");
    for (int i = 0; i < 3; i++)
        size += snprintf(text + size, sizeof text - (size_t)size,
                         "%s\n{ body = \"b%d\"; to_body = \"b%d\"; nodes = [0]; }",
                         i > 0 ? "," : "", i, i + 1);
    snprintf(text + size, sizeof text - (size_t)size, ");\n");
    scratch_write(&scratch_space, "x.cfg", text, strlen(text));
    scene_read(scratch_path(&scratch_space, "x.cfg", path), scene, &status);
    snprintf(said, sizeof said, "%s", status.text);
    const char *slash = strrchr(said, '/');
    return slash != NULL ? slash + 1 : said;
}

static IntegratorKind integrator_in(const Scene *scene, int b)
{
    const SceneBody *body = &scene->body[b];
    return body->options.integrator;
}

TEST(joined_bodies_that_name_no_integrator_take_a_common_one)
{
#define S     "surface"
#define V     "voxel"
#define EULER "integrator = \"symplectic_euler\";"
#define RK4   "integrator = \"rk4\";"
#define AUTO  "integrator = \"auto\";"
    const struct {
        const char *model[4], *more[4];
        int common; // or -1: refused
        const char *said;
    } cases[] = {
        {{S, S, S, S}, {"", "", "", ""}, INTEGRATOR_LEAPFROG, ""},
        {{V, V, V, V}, {"", "", "", ""}, INTEGRATOR_SYMPLECTIC_EULER, ""}, // its preset
        {{V, V, V, S}, {"", "", "", ""}, INTEGRATOR_LEAPFROG, ""},
        {{S, V, V, V}, {"", "", AUTO, ""}, INTEGRATOR_LEAPFROG, ""},
        {{V, S, V, S}, {EULER, "", "", ""}, INTEGRATOR_SYMPLECTIC_EULER, ""},
        {{S, V, V, S}, {"", "", "", EULER}, INTEGRATOR_SYMPLECTIC_EULER, ""},
        {{S, S, S, S}, {"", "", "", RK4}, INTEGRATOR_RK4, ""},
        {{S, V, V, S}, {AUTO, "", "", ""}, INTEGRATOR_LEAPFROG, ""},
        {{S, S, S, V},
         {"", "", RK4, ""},
         -1,
         "x.cfg:5: to_body: bodies \"b2\" (rk4) and \"b3\" (symplectic_euler) must have one "
         "integrator"},
        {{S, S, S, V},
         {RK4, "", "", EULER},
         -1,
         "x.cfg:5: to_body: bodies \"b2\" (rk4) and \"b3\" (symplectic_euler) must have one "
         "integrator"},
    };
    for (size_t c = 0; c < sizeof cases / sizeof cases[0]; c++) {
        Scene scene;
        assert_string_equal(read_chain(cases[c].model, cases[c].more, &scene),
                            cases[c].common < 0 ? cases[c].said : "");
        for (int b = 0; b < 4 && cases[c].common >= 0; b++)
            assert_int_equal(integrator_in(&scene, b), cases[c].common);
        if (cases[c].common >= 0)
            scene_destroy(&scene);
    }
}
