// SPDX-License-Identifier: MIT
// pliantd --explain: of a scene that requires nothing every feature is disabled, and each is
// enabled with its key, alone or with those that the table here names.
#include "test.h"
#include "scene_writer.h"

#include <stdlib.h>
#include <string.h>

// What is written into the scene, and the feature that it switches on.
typedef struct Case {
    const char *feature; // as printed
    const char *head;    // keys of the scene
    const char *publish; // its group
    const char *material, *contact;
    const char *body; // keys of the body
    const char *tail; // tools, loads, attachments
    const char *arguments;
    int others; // features that cannot come alone and bring so many along
} Case;

#define SILENT "nodes_hz = 0.0; mesh_hz = 0.0; status_hz = 0.0; contact_hz = 0.0;"
#define BALL   "capsules = ( { from = [0.0, 0.0, 0.0]; to = [0.0, 0.0, 0.0]; radius = 0.005; } ); "
#define PROBE  "tools = ( { id = 1; kind = \"probe\"; " BALL "} );"
#define BLADE                                                                                      \
    "tools = ( { id = 1; kind = \"blade\"; edge = ([0.0, 0.0, 0.0], [0.0, 0.0, 0.1]); } );"
#define FIXED "fixed = ( { box = ([-1.0, -1.0, -1.0], [1.0, 1.0, -0.02]); } );"

// Of scenes with any body.
static const Case COMMON[] = {
    {.feature = "gravity", .head = "gravity = [0.0, 0.0, -9.81];"},
    {.feature = "settling before the first tick", .head = "settle_s = 0.01;"},
    {.feature = "more threads for a step", .head = "threads = 2;"},
    {.feature = "contact", .tail = PROBE},
    {.feature = "blades", .tail = BLADE},
    {.feature = "removers",
     .body = "cuttable = true;",
     .tail = "tools = ( { id = 1; kind = \"remover\"; removes_by = \"suction\"; "
             "mouth = { radius = 0.005; }; } );",
     .others = 1}, // cuts
    {.feature = "graspers",
     .tail = "tools = ( { id = 1; kind = \"grasper\"; " BALL "} );",
     .others = 1}, // contact
    {.feature = "attachments",
     .tail = "attachments = ( { body = \"body\"; sphere = [0.0, 0.0, 0.05]; "
             "radius = 0.03; to = \"world\"; } );"},
    {.feature = "ties by message", .head = "max_ties = 2;"},
    {.feature = "contact between bodies",
     .tail = "touch = ( { bodies = [\"body\", \"other\"]; } );"},
    {.feature = "loads of the scene",
     .tail = "loads = ( { center = [0.0, 0.0, 0.05]; radius = 0.03; force = [0.0, 0.0, -0.1]; "
             "start = 0.0; duration = 1.0; } );"},
    {.feature = "positions in messages", .publish = "mesh_hz = 0.0; status_hz = 0.0;"},
    {.feature = "positions in packets",
     .publish = "mesh_hz = 0.0; status_hz = 0.0; positions = \"packets\";",
     .others = 1}, // positions
    {.feature = "velocities in messages",
     .publish = "mesh_hz = 0.0; status_hz = 0.0; velocity = true;",
     .others = 1}, // positions
    {.feature = "meshes in messages", .publish = "nodes_hz = 0.0; status_hz = 0.0;"},
    {.feature = "rest positions in messages", .publish = SILENT " rest = true;"},
    {.feature = "status in messages", .publish = "nodes_hz = 0.0; mesh_hz = 0.0;"},
    {.feature = "contacts in messages",
     .publish = "nodes_hz = 0.0; mesh_hz = 0.0; status_hz = 0.0; contact_stiffness = false;",
     .tail = PROBE,
     .others = 1}, // contact
    {.feature = "stiffness in contacts",
     .publish = "nodes_hz = 0.0; mesh_hz = 0.0; status_hz = 0.0;",
     .tail = PROBE,
     .others = 2}, // contact, its messages
    {.feature = "error of the time steps in status", .head = "estimate_error = true;"},
    {.feature = "error of bodies in messages",
     .publish = SILENT " error_hz = 10.0;",
     .others = 1}, // that of the time steps
    {.feature = "error of nodes in messages",
     .publish = SILENT " error_hz = 10.0; error_map = true;",
     .others = 2},                                                                // both of these
    {.feature = "checkpoints", .arguments = "--checkpoint none.h5", .others = 1}, // files thread
    {.feature = "log of applied inputs", .arguments = "--log-inputs none.log", .others = 1},
    {.feature = "recording",
     .publish = "mesh_hz = 0.0; status_hz = 0.0;",
     .arguments = "--record none.h5",
     .others = 2}, // positions, files thread
    {.feature = "files thread", .arguments = "--log-inputs none.log", .others = 1},
    {.feature = "held nodes", .body = FIXED},
    {.feature = "friction at tools",
     .contact = "friction = 0.2;",
     .tail = PROBE,
     .others = 1}, // contact
    {.feature = "cuts", .body = "cuttable = true;"},
};

static const Case SURFACE[] = {
    {.feature = "damping of springs", .material = "damping_time = 1.0e-4;"},
    {.feature = "drag on nodes", .material = "damping_time = 0.0; node_damping = 0.001;"},
    {.feature = "loss factor", .material = "damping_time = 0.0; loss_factor = 0.1;"},
    {.feature = "stiffening",
     .material = "damping_time = 0.0; stiffening = { strain = 0.2; cap = 5.0; };"},
    {.feature = "bending of the wall", .material = "damping_time = 0.0; thickness = 0.002;"},
    {.feature = "shape springs", .body = "shape = {};"},
    {.feature = "shape springs that follow the body",
     .body = "shape = { frame = \"body\"; };",
     .others = 1}, // shape springs
    {.feature = "shape springs damped along themselves",
     .body = "shape = { damping_direction = \"radial\"; };",
     .others = 1}, // shape springs
    {.feature = "pressure inside", .body = "cavity = { pressure = 50.0; };"},
    {.feature = "gas inside", .body = "cavity = { gas = true; };"},
    {.feature = "fluid inside", .body = "cavity = { fluid = true; };"},
    {.feature = "prestress", .body = "prestress = 0.05;"},
    {.feature = "implicit integration", .body = "integrator = \"implicit\";"},
    {.feature = "levels of detail", .body = "levels = 1;"},
    {.feature = "refinement at run time", .body = "levels = 1; adapt = {};", .others = 1},
    {.feature = "detail steered by its error",
     .body = "levels = 1; adapt = { error = 0.05; };",
     .others = 2}, // levels, refinement
    {.feature = "tearing", .body = "cuttable = true; tear = { stretch = 2.0; };", .others = 1},
};

static const Case VOXEL[] = {
    {.feature = "damping of elements", .material = "damping = 0.2;"},
    {.feature = "damping by a time", .material = "damping_time = 1.0e-4;"},
    {.feature = "loss factor", .material = "damping = 0.0; loss_factor = 0.1;"},
    {.feature = "stiffening",
     .material = "damping = 0.0; stiffening = { strain = 0.2; cap = 5.0; };"},
    {.feature = "drag on solids", .material = "damping = 0.0; drag = 1.0;"},
    {.feature = "inner vertices in messages",
     .publish = "mesh_hz = 0.0; status_hz = 0.0; nodes = \"all\";",
     .others = 1}, // positions
    {.feature = "elements at surfaces in messages", .publish = SILENT " elements_hz = 10.0;"},
    {.feature = "levels of detail", .body = "levels = 1;"},
    {.feature = "elements that adapt to tools",
     .body = "levels = { inside = 1; surface = 1; };",
     .others = 1}, // levels
    {.feature = "detail steered by its error",
     .body = "levels = { inside = 1; surface = 1; }; adapt = { error = 0.05; };",
     .others = 2}, // both of these
    {.feature = "display surface", .body = "levels = 0; skin = { mesh = \"skin.off\"; };"},
    {.feature = "tearing", .body = "cuttable = true; tear = { stress = 1.0e4; };", .others = 1},
    {.feature = "tension at rest",
     .body = "cuttable = true;",
     .material = "damping = 0.0; prestress = 100.0;",
     .others = 1},
};

static const char *or_else(const char *text, const char *preset)
{
    return text != NULL ? text : preset;
}

static const char *const BODIES[2] = {
    "model = \"surface\"; mesh = { generator = \"ico_sphere\"; nodes = 42; radius = 0.05; };",
    "model = \"voxel\"; voxels = { generator = \"box\"; count = [8, 8, 8]; size = 0.0125; };"};
static const char *const UNDAMPED[2] = {"damping_time = 0.0;", "damping = 0.0;"};

static void explain(Process *daemon, bool voxel, const Case *what)
{
    char head[512], groups[1024], other[512] = "";
    const char *body = or_else(what->body, "");
    if (strstr(or_else(what->tail, ""), "other") != NULL)
        snprintf(other, sizeof other, ", { name = \"other\"; %s material = { %s }; levels = 0; }",
                 BODIES[voxel], UNDAMPED[voxel]);
    snprintf(head, sizeof head, "%s publish = { %s };", or_else(what->head, ""),
             or_else(what->publish, SILENT));
    snprintf(groups, sizeof groups, "contact = { %s }; %s %s",
             or_else(what->contact, "friction = 0.0;"),
             strstr(body, "levels") == NULL ? "levels = 0;" : "", body);
    const char *scene = write_body_scene(
        "feature.cfg", &(SceneParts){.head = head,
                                     .name = "body",
                                     .source = BODIES[voxel],
                                     .material = or_else(what->material, UNDAMPED[voxel]),
                                     .body = groups,
                                     .others = other,
                                     .tail = what->tail});
    run_daemon(daemon, "--explain %s %s", or_else(what->arguments, ""), scene);
    if (daemon->code != 0)
        fail_msg("%s: %s", or_else(what->feature, "nothing"), daemon->err);
}

// The rows of features that are on; `found`: whether that of a name is among them, or off.
typedef struct Rows {
    int on, off;
    bool listed, found;
} Rows;

static Rows read_rows(const Process *daemon, const char *feature)
{
    Rows rows = {0};
    size_t length = strlen(feature);
    const char *line = strstr(daemon->out, "\nfeatures of ");
    assert_non_null(line);
    for (; line != NULL; line = strchr(line + 1, '\n')) {
        bool on = strncmp(line, "\n  on   ", 8) == 0, off = strncmp(line, "\n  off  ", 8) == 0;
        rows.on += on;
        rows.off += off;
        // The column is wider than every name.
        if ((on || off) && strncmp(line + 8, feature, length) == 0 &&
            strncmp(line + 8 + length, "  ", 2) == 0) {
            rows.listed = true;
            rows.found = on;
        }
    }
    return rows;
}

static void expect_flip(bool voxel, const Case *what)
{
    Process daemon;
    explain(&daemon, voxel, what);
    Rows rows = read_rows(&daemon, what->feature);
    if (!rows.listed || !rows.found || rows.on != 1 + what->others)
        fail_msg("%s: %s, %d features are on, not %d, in\n%s", what->feature,
                 !rows.listed ? "not listed"
                 : rows.found ? "on"
                              : "off",
                 rows.on, 1 + what->others, strstr(daemon.out, "\nfeatures of "));
}

#define COUNT(cases) ((int)(sizeof(cases) / sizeof *(cases)))

// All rows are off, and there is a case for each of them.
static void expect_nothing(bool voxel, int cases)
{
    Process daemon;
    explain(&daemon, voxel, &(Case){0});
    Rows rows = read_rows(&daemon, "recording");
    if (rows.on > 0 || rows.off != cases)
        fail_msg("%d on, %d off for %d cases in\n%s", rows.on, rows.off, cases,
                 strstr(daemon.out, "\nfeatures of "));
}

TEST(each_feature_of_a_surface_scene_has_its_key)
{
    if (!WITH_SURFACE)
        skip();
    // And inner vertices and elements, which no surface body has.
    expect_nothing(false, COUNT(COMMON) + COUNT(SURFACE) + 2);
    for (int i = 0; i < COUNT(COMMON); i++)
        if (WITH_HDF5 || or_else(COMMON[i].arguments, "")[0] == '\0')
            expect_flip(false, &COMMON[i]);
    for (int i = 0; i < COUNT(SURFACE); i++)
        expect_flip(false, &SURFACE[i]);
}

TEST(each_feature_of_a_voxel_scene_has_its_key)
{
    if (!WITH_VOXEL)
        skip();
    // A cube on the outside of the elements: corners and two triangles a side.
    write_text(scratch("skin.off"),
               "OFF\n8 12 0\n-.05 -.05 -.05\n.05 -.05 -.05\n-.05 .05 -.05\n.05 .05 -.05\n"
               "-.05 -.05 .05\n.05 -.05 .05\n-.05 .05 .05\n.05 .05 .05\n"
               "3 0 2 1\n3 1 2 3\n3 4 5 6\n3 5 7 6\n3 0 1 4\n3 1 5 4\n"
               "3 2 6 3\n3 3 6 7\n3 0 4 2\n3 2 4 6\n3 1 3 5\n3 3 7 5\n");
    expect_nothing(true, COUNT(COMMON) + COUNT(VOXEL));
    for (int i = 0; i < COUNT(COMMON); i++)
        if (WITH_HDF5 || or_else(COMMON[i].arguments, "")[0] == '\0')
            expect_flip(true, &COMMON[i]);
    for (int i = 0; i < COUNT(VOXEL); i++)
        expect_flip(true, &VOXEL[i]);
}

// Bytes of the whole, as printed last.
static long long total_bytes(const Process *daemon)
{
    const char *at = strstr(daemon->out, "\ntotal: ");
    assert_non_null(at);
    return strtoll(at + 8, NULL, 10);
}

TEST(arrays_add_up_to_the_total)
{
    Process daemon;
    explain(&daemon, !WITH_SURFACE, &(Case){.feature = "everything", .tail = PROBE});
    long long sum = 0, single = 0;
    for (const char *line = strchr(daemon.out, '\n'); line != NULL; line = strchr(line + 1, '\n')) {
        const char *colon = strstr(line, ": ");
        if (strncmp(line, "\narrays, ", 9) == 0 || strncmp(line, "\nkept from ", 11) == 0)
            sum += strtoll(colon + 2, NULL, 10);
    }
    // Lines of single arrays: a name of up to 47 characters, then the bytes.
    const char *end = strstr(daemon.out, "\ntotal: ");
    const char *line = strstr(daemon.out, "\narrays, ");
    for (; line != NULL && line < end; line = strchr(line + 1, '\n'))
        if (strncmp(line, "\n  ", 3) == 0)
            single += strtoll(line + 3 + 47, NULL, 10);
    assert_int_equal(sum, total_bytes(&daemon));
    assert_int_equal(single, total_bytes(&daemon));
}

TEST(off_line_nothing_of_a_live_run_is_listed)
{
    Process daemon;
    explain(&daemon, !WITH_SURFACE, &(Case){.arguments = "--offline 1"});
    assert_null(strstr(daemon.out, "run/"));
    assert_null(strstr(daemon.out, "in messages"));
    assert_non_null(strstr(daemon.out, "stages: forces check\n"));
}
