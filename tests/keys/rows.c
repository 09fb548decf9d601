// SPDX-License-Identifier: MIT
#include "rows.h"

#include "scene/scene_parts.h"

#include <math.h>
#include <string.h>

#define SPHERE(more)         "mesh = { generator = \"ico_sphere\"; radius = 0.05; " more " };"
#define BOX(more)            "model = \"voxel\"; voxels = { generator = \"box\"; size = 0.015; " more " };"
#define DISC(more)           "model = \"voxel\"; voxels = { generator = \"disc\"; " more " };"
#define VOXELS(more)         "model = \"voxel\"; voxels = { " more " };"
#define MESH(more)           "mesh = { " more " };"
#define LIVER                "file = \"" LIVER_FILE "\"; size = 0.02;"
#define CAPSULE              "capsules = ( { radius = 0.01; } );"
#define TOOL(id, kind, more) "{ id = " id "; kind = \"" kind "\"; " more " }"
#define PROBE(more)          "tools = ( " TOOL("1", "probe", CAPSULE more) " );"
#define GRASPER(more)                                                                              \
    "tools = ( " TOOL("3", "grasper", "capsules = ( { radius = 0.02; } );" more) " );"
#define BLADE       "tools = ( " TOOL("2", "blade", "edge = ([0.0, 0.0, -0.1], [0.0, 0.0, 0.1]);") " );"
#define TABLE(more) "tools = ( " TOOL("4", "static", "plane = { " more " };") " );"
#define PUSH        "center = [0.0, 0.04, 0.0]; radius = 0.03; force = [0.5, 0.0, 0.0]; duration = 0.04; "
#define LOAD(more)  "loads = ( { " more " } );"
#define HELD(more)  "attachments = ( { " more " } );"
#define HELD_AT     "body = \"a\"; sphere = [0.0, 0.045, 0.0]; radius = 0.03; "
#define SECOND                                                                                     \
    ", { name = \"b\"; mesh = { generator = \"ico_sphere\"; subdivisions = 1; radius = 0.04;\n"    \
    "    place = { translation = [0.0, 0.1, 0.0]; }; }; }"
// Beside the first body, onto which it is pushed.
#define BESIDE                                                                                     \
    ", { name = \"b\"; mesh = { generator = \"ico_sphere\"; subdivisions = 1; radius = 0.04;\n"    \
    "    place = { translation = [0.0, 0.092, 0.0]; }; }; }"
#define TOUCHES(more) "touch = ( { " more " } );"
#define SCORE(more)   "score = { " more " };"
#define TARGET(more)  SCORE("regions = ( { " more " } );")
#define BALL          "sphere = [0.0, 0.0, 1.0]; radius = 1.0;"
#define TWO           "bodies = [\"a\", \"b\"]; "
#define ONTO                                                                                       \
    LOAD("body = \"b\"; center = [0.0, 0.092, 0.0]; radius = 0.05; force = [1.0, -4.0, 0.0]; "     \
         "duration = 1.0; ")
#define PULLS          "gravity = [0.0, -9.0, 0.0]; "
#define STIFF(modulus) "material = { " modulus " }; time_step = 1e-3; "
#define UNIFORM        "spring_stiffness = 60.0; node_mass = 1.0e-3; "

static const char *const PRESET[KEY_MODELS][PARTS] = {
    {"", "name = \"a\";", SPHERE("subdivisions = 2;"), "", "", PROBE(""), LOAD(PUSH), ""},
    {"", "name = \"a\";", BOX("count = 6;"), "", "", PROBE(""), LOAD(PUSH), ""},
    {"", "name = \"a\";", DISC("radius = 0.05; size = 0.01;"), "", "", PROBE(""), LOAD(PUSH), ""},
};

// Expanded once more: two of the rows' parts are macros of several.
#define IN(...) IN_PARTS(__VA_ARGS__)
#define IN_PARTS(table_, key_, models_, evidence_, part_, base_, changed_)                         \
    .table = &table_, .key = key_, .models = models_, .evidence = evidence_, .part = part_,        \
    .base = base_, .changed = changed_
#define REFUSES_FROM(table_, key_, models_, part_, base_, changed_, said_)                         \
    IN(table_, key_, models_, REFUSED, part_, base_, changed_), .said = said_
#define REFUSES(table_, key_, models_, part_, changed_, said_)                                     \
    REFUSES_FROM(table_, key_, models_, part_, NULL, changed_, said_)
#define IS_IDLE(table_, key_, models_, part_, base_, changed_, said_)                              \
    IN(table_, key_, models_, IDLE, part_, base_, changed_), .said = said_
const KeyRow KEY_ROWS[] = {
    // --- the scene ---
    {IN(SCENE_TABLE, "name", ALL, STREAM, HEAD, "", "name = \"other\";")},
    {IN(SCENE_TABLE, "rate_hz", ALL, STATE, HEAD, "", "rate_hz = 900;")},
    {IN(SCENE_TABLE, "gravity", ALL, STATE, HEAD, "", PULLS)},
    {IN(SCENE_TABLE, "threads", ALL, PLAN, HEAD, "", "threads = 2;")},
    {IN(SCENE_TABLE, "precision", ALL, STATE_ALONE, HEAD, "", "precision = \"double\";")},
    {IN(SCENE_TABLE, "prefix", ALL, STREAM, HEAD, "", "prefix = \"OTHER\";")},
    {IN(SCENE_TABLE, "input_prefix", ALL, STREAM, HEAD, "", "input_prefix = \"NOBODY\";")},
    {IN(SCENE_TABLE, "lcm_url", ALL, STREAM, HEAD, "",
        "lcm_url = \"udpm://239.255.76.68:7668?ttl=0\";")},
    // What they do wants two hosts, and a STOP: fault_border.
    {IN(SCENE_TABLE, "remote", ALL, PLAN, HEAD, "", "remote = true;")},
    {IN(SCENE_TABLE, "stop_command", ALL, PLAN, HEAD, "", "stop_command = false;")},
    {IN(SCENE_TABLE, "publish", ALL, STREAM, HEAD, "", "publish = { nodes_hz = 10.0; };")},
    {REFUSES(SCENE_TABLE, "late", ALL, HEAD, "late = \"catch_up\";", "must be \"skip\"")},
    {IN(SCENE_TABLE, "start", ALL, STREAM, HEAD, "", "start = \"paused\";")},
    {IN(SCENE_TABLE, "estimate_error", ALL, STREAM, HEAD, "", "estimate_error = true;")},
    {IN(SCENE_TABLE, "tool_timeout_s", ALL, STATE, HEAD, "", "tool_timeout_s = 0.01;")},
    {IS_IDLE(SCENE_TABLE, "tool_timeout_s", ALL, HEAD, "", "tool_timeout_s = 0.01;",
             "no tool is moved"),
     .also = {{TOOLS, TABLE("point = [0, -0.03, 0]; normal = [0, 1, 0];")}}},
    {IN(SCENE_TABLE, "settle_s", ALL, STATE_ALONE, HEAD, PULLS, PULLS "settle_s = 0.02;")},
    {REFUSES(SCENE_TABLE, "capacity", ALL, HEAD, "capacity = { nodes = 5; };", "is 5")},
    {REFUSES(SCENE_TABLE, "prepared", ALL, HEAD, "prepared = \"none.h5\";", "none.h5")},
    {IN(SCENE_TABLE, "bodies", ALL, STATE, OTHER, "", SECOND)},
    {IN(SCENE_TABLE, "tools", ALL, STATE, TOOLS, "", PROBE(""))},
    {IN(SCENE_TABLE, "attachments", ALL, STATE, ATTACH, "", HELD(HELD_AT "to = \"world\";"))},
    {IN(SCENE_TABLE, "max_ties", ALL, STATE, HEAD, "", "max_ties = 2;")},
    {IN(SCENE_TABLE, "touch", S | V, STATE, ATTACH, "", TOUCHES(TWO)), .also = {{OTHER, BESIDE}}},
    {REFUSES(SCENE_TABLE, "touch", P, ATTACH, TOUCHES(TWO), "plane body"),
     .also = {{OTHER, BESIDE}}},
    {IN(SCENE_TABLE, "loads", ALL, STATE, LOADS, "", LOAD(PUSH))},
    // The server prints it, for the score sheet.
    {IN(SCENE_TABLE, "score", ALL, PLAN, HEAD, "", SCORE("force_limit = 2.0;"))},
    {IN(SCORE_TABLE, "force_limit", ALL, PLAN, HEAD, SCORE("force_limit = 1.0;"),
        SCORE("force_limit = 2.0;"))},
    {IN(SCORE_TABLE, "regions", ALL, PLAN, HEAD, SCORE(""), TARGET("name = \"a\"; " BALL))},
    {IN(SCORE_REGION_TABLE, "name", ALL, PLAN, HEAD, TARGET("name = \"a\"; " BALL),
        TARGET("name = \"b\"; " BALL))},
    {IN(SCORE_REGION_TABLE, "box", ALL, PLAN, HEAD, TARGET(BALL),
        TARGET("box = ([0.0, 0.0, 0.0], [1.0, 1.0, 1.0]);"))},
    {IN(SCORE_REGION_TABLE, "sphere", ALL, PLAN, HEAD, TARGET(BALL),
        TARGET("sphere = [0.0, 0.0, 2.0]; radius = 1.0;"))},
    {IN(SCORE_REGION_TABLE, "radius", ALL, PLAN, HEAD, TARGET(BALL),
        TARGET("sphere = [0.0, 0.0, 1.0]; radius = 2.0;"))},

    {IN(PUBLISH_TABLE, "nodes_hz", ALL, STREAM, HEAD, "", "publish = { nodes_hz = 10.0; };")},
    {IN(PUBLISH_TABLE, "mesh_hz", ALL, STREAM, HEAD, "", "publish = { mesh_hz = 20.0; };")},
    {IN(PUBLISH_TABLE, "contact_hz", ALL, STREAM, HEAD, "", "publish = { contact_hz = 10.0; };")},
    {IN(PUBLISH_TABLE, "status_hz", ALL, STREAM, HEAD, "", "publish = { status_hz = 20.0; };")},
    {IN(PUBLISH_TABLE, "nodes", V, STREAM, HEAD, "", "publish = { nodes = \"all\"; };")},
    // They have no inside: all their nodes are published anyhow.
    {IS_IDLE(PUBLISH_TABLE, "nodes", S | P, HEAD, "", "publish = { nodes = \"all\"; };",
             "no body has an inside")},
    {IN(PUBLISH_TABLE, "positions", ALL, STREAM, HEAD, "", "publish = { positions = \"both\"; };")},
    {IN(PUBLISH_TABLE, "velocity", ALL, STREAM, HEAD, "", "publish = { velocity = true; };")},
    {IN(PUBLISH_TABLE, "rest", ALL, STREAM, HEAD, "", "publish = { rest = true; };")},
    {IN(PUBLISH_TABLE, "contact_stiffness", S | V, STREAM, HEAD, "",
        "publish = { contact_stiffness = false; };")},
    {IS_IDLE(PUBLISH_TABLE, "contact_stiffness", P, HEAD, "",
             "publish = { contact_stiffness = false; };", "plane bodies report none")},

    {IS_IDLE(PUBLISH_TABLE, "positions", ALL, HEAD, "publish = { nodes_hz = 0.0; };",
             "publish = { nodes_hz = 0.0; positions = \"both\"; };", "nodes_hz is 0")},
    {IS_IDLE(PUBLISH_TABLE, "velocity", ALL, HEAD, "publish = { nodes_hz = 0.0; };",
             "publish = { nodes_hz = 0.0; velocity = true; };", "nodes_hz is 0")},
    {IS_IDLE(PUBLISH_TABLE, "contact_hz", ALL, HEAD, "", "publish = { contact_hz = 10.0; };",
             "there is no tool"),
     .also = {{TOOLS, ""}}},
    {IS_IDLE(PUBLISH_TABLE, "contact_stiffness", S | V, HEAD, "",
             "publish = { contact_stiffness = false; };", "no tool is moved"),
     .also = {{TOOLS, ""}}},
    {IS_IDLE(PUBLISH_TABLE, "contact_stiffness", S | V, HEAD, "publish = { contact_hz = 0.0; };",
             "publish = { contact_hz = 0.0; contact_stiffness = false; };", "contact_hz is 0")},

    {REFUSES(CAPACITY_TABLE, "nodes", ALL, HEAD, "capacity = { nodes = 5; };",
             "capacity.nodes is 5")},
    {REFUSES(CAPACITY_TABLE, "faces", ALL, HEAD, "capacity = { faces = 5; };",
             "capacity.faces is 5")},

    // --- bodies ---
    {IN(BODY_TABLE, "name", ALL, STREAM, NAME, "name = \"a\";", "name = \"other\";")},
    {IN(BODY_TABLE, "model", S, STATE, SOURCE, NULL, BOX("count = 6;"))},
    {IN(BODY_TABLE, "model", V | P, STATE, SOURCE, NULL, SPHERE("subdivisions = 2;"))},
    {IN(BODY_TABLE, "mesh", S, STATE, SOURCE, NULL, SPHERE("subdivisions = 1;"))},
    {IN(BODY_TABLE, "voxels", V | P, STATE, SOURCE, NULL, BOX("count = 5;"))},
    {IN(BODY_TABLE, "levels", S, STATE, BODY, "levels = 1; adapt = {};",
        "levels = 2; adapt = {};")},
    {IN(BODY_TABLE, "levels", V | P, STATE, BODY, "levels = 0;", "levels = 1;")},
    {IN(BODY_TABLE, "start_level", S, STATE, BODY, "levels = 1;", "levels = 1; start_level = 1;")},
    {IN(BODY_TABLE, "adjust", S, STATE, BODY, "levels = 1; start_level = 1;",
        "levels = 1; start_level = 1; adjust = \"choi2005\";")},
    {IS_IDLE(BODY_TABLE, "adjust", S, BODY, "", "adjust = \"choi2005\";", "levels is 0")},
    {IN(BODY_TABLE, "adapt", S, STATE, BODY, "levels = 1;", "levels = 1; adapt = {};")},
    {IN(BODY_TABLE, "dimensions", V, STATE, BODY, "", "dimensions = 2;"),
     .also = {{SOURCE, BOX("count = [6, 6, 1];")}}},
    {REFUSES(BODY_TABLE, "dimensions", P, BODY, "dimensions = 3;", "a plane body")},
    {IN(BODY_TABLE, "material", S, STATE, BODY, "", "material = { youngs_modulus_2d = 90.0; };")},
    {IN(BODY_TABLE, "material", V | P, STATE, BODY, "", "material = { youngs_modulus = 2e4; };")},
    {IN(BODY_TABLE, "materials", V | P, STATE, BODY, "",
        "materials = ( { label = 1; density = 900.0; } );")},
    {IN(BODY_TABLE, "shape", S, STATE, BODY, "", "shape = {};")},
    {IN(BODY_TABLE, "cavity", S, STATE, BODY, "integrator = \"leapfrog\";",
        "integrator = \"leapfrog\"; cavity = { pressure = 50.0; };")},
    {IN(BODY_TABLE, "contact", ALL, STATE, BODY, "", "contact = { stiffness = 0.3; };")},
    {IN(BODY_TABLE, "skin", V, SHOWN, BODY, "", "skin = { mesh = \"ball.obj\"; };")},
    {REFUSES(BODY_TABLE, "skin", P, BODY, "skin = { mesh = \"ball.obj\"; };",
             "skin means nothing for a plane body")},
    {IN(BODY_TABLE, "surface", V, STATE, BODY, "", "surface = \"fitted\";")},
    {IS_IDLE(BODY_TABLE, "surface", V, BODY, "", "surface = \"blocks\";", "publish.nodes is"),
     .also = {{HEAD, "publish = { nodes = \"all\"; };"}}},
    {IS_IDLE(BODY_TABLE, "surface", V, BODY, "", "surface = \"blocks\";",
             "nodes_hz is 0 and there is no tool"),
     .also = {{HEAD, "publish = { nodes_hz = 0.0; };"}, {TOOLS, ""}}},
    {REFUSES(BODY_TABLE, "surface", P, BODY, "surface = \"blocks\";",
             "surface means nothing for a plane body")},
    {IN(BODY_TABLE, "integrator", S, STATE, BODY, "", "integrator = \"rk4\";")},
    {IN(BODY_TABLE, "integrator", S, STATE, BODY, "", "integrator = \"implicit\";")},
    {IN(BODY_TABLE, "integrator", V | P, STATE, BODY, "", "integrator = \"leapfrog\";")},
    {REFUSES(BODY_TABLE, "integrator", V | P, BODY, "integrator = \"rk4\";", "means nothing")},
    {REFUSES(BODY_TABLE, "integrator", V | P, BODY, "integrator = \"implicit\";", "means nothing")},
    {IN(BODY_TABLE, "theta", S, STATE, BODY, "integrator = \"implicit\";",
        "integrator = \"implicit\"; theta = 0.9;")},
    {IS_IDLE(BODY_TABLE, "theta", S, BODY, "", "theta = 0.9;", "not \"implicit\"")},
    {IS_IDLE(BODY_TABLE, "theta", S, BODY, "integrator = \"rk4\";",
             "integrator = \"rk4\"; theta = 0.9;", "not \"implicit\"")},
    {IN(BODY_TABLE, "solver_tolerance", S, STATE, BODY, "integrator = \"implicit\";",
        "integrator = \"implicit\"; solver_tolerance = 1.0e-8;")},
    {IS_IDLE(BODY_TABLE, "solver_tolerance", S, BODY, "", "solver_tolerance = 1.0e-8;",
             "not \"implicit\"")},
    {IN(BODY_TABLE, "solver_iterations", S, STATE, BODY, "integrator = \"implicit\";",
        "integrator = \"implicit\"; solver_iterations = 1;")},
    {IS_IDLE(BODY_TABLE, "solver_iterations", S, BODY, "", "solver_iterations = 1;",
             "not \"implicit\"")},
    {IN(BODY_TABLE, "time_step", ALL, STATE, BODY, "", "time_step = 1.0e-4;")},
    {REFUSES_FROM(BODY_TABLE, "unsafe_time_step", S, BODY,
                  STIFF("youngs_modulus_2d = 1e6;") "unsafe_time_step = true;",
                  STIFF("youngs_modulus_2d = 1e6;"), "time_step")},
    {REFUSES_FROM(BODY_TABLE, "unsafe_time_step", V | P, BODY,
                  STIFF("youngs_modulus = 1e8;") "unsafe_time_step = true;",
                  STIFF("youngs_modulus = 1e8;"), "time_step")},
    {IS_IDLE(BODY_TABLE, "unsafe_time_step", ALL, BODY, "", "unsafe_time_step = true;",
             "there is no time_step")},
    {IN(BODY_TABLE, "fixed", ALL, STATE, BODY, "",
        "fixed = ( { sphere = [0.0, 0.045, 0.0]; radius = 0.03; } );")},
    {REFUSES(BODY_TABLE, "initial", ALL, BODY, "initial = \"none.h5\";", "none.h5")},
    {IN(BODY_TABLE, "cuttable", ALL, STATE, BODY, "", "cuttable = true;"),
     .also = {{TOOLS, BLADE}}},
    {IN(BODY_TABLE, "split_budget", V, STATE, BODY, "levels = 1; cuttable = true;",
        "levels = 1; cuttable = true; split_budget = 1;"),
     .also = {{TOOLS, BLADE}, {SOURCE, VOXELS("generator = \"box\"; count = 10; size = 0.009;")}}},
    {IS_IDLE(BODY_TABLE, "split_budget", V, BODY, "levels = 1;", "levels = 1; split_budget = 1;",
             "cuttable is false"),
     .also = {{TOOLS, BLADE}, {SOURCE, VOXELS("generator = \"box\"; count = 10; size = 0.009;")}}},
    {IS_IDLE(BODY_TABLE, "split_budget", V, BODY, "levels = 0; cuttable = true;",
             "levels = 0; cuttable = true; split_budget = 1;", "levels is 0"),
     .also = {{TOOLS, BLADE}, {SOURCE, VOXELS("generator = \"box\"; count = 10; size = 0.009;")}}},
    {REFUSES(BODY_TABLE, "split_budget", P, BODY, "cuttable = true; split_budget = 1;",
             "split_budget means nothing for a plane body")},
    {IN(BODY_TABLE, "tear", S, STATE, BODY, "cuttable = true;",
        "cuttable = true; tear = { stretch = 0.001; };")},
    {IN(BODY_TABLE, "tear", V | P, STATE, BODY, "cuttable = true;",
        "cuttable = true; tear = { force = 0.001; };")},

    {IN(TEAR_TABLE, "stress", V, STATE, BODY, "cuttable = true; tear = { stress = 1e6; };",
        "cuttable = true; tear = { stress = 1.0; };")},
    {REFUSES(TEAR_TABLE, "stress", S, BODY, "cuttable = true; tear = { stress = 1.0; };",
             "tear.stress means nothing for a surface body")},
    {REFUSES(TEAR_TABLE, "stress", P, BODY, "cuttable = true; tear = { stress = 1.0; };",
             "tear.stress means nothing for a plane body")},
    {IN(TEAR_TABLE, "force", V | P, STATE, BODY, "cuttable = true; tear = { force = 1e3; };",
        "cuttable = true; tear = { force = 0.001; };")},
    {REFUSES(TEAR_TABLE, "force", S, BODY, "cuttable = true; tear = { force = 1.0; };",
             "tear.force means nothing for a surface body")},
    {IN(TEAR_TABLE, "stretch", S, STATE, BODY, "cuttable = true; tear = { stretch = 9.0; };",
        "cuttable = true; tear = { stretch = 0.001; };")},
    {REFUSES(TEAR_TABLE, "stretch", V | P, BODY, "cuttable = true; tear = { stretch = 1.0; };",
             "tear.stretch means nothing for a voxel body")},

    {IS_IDLE(CONTACT_TABLE, "stiffness", ALL, BODY, "", "contact = { stiffness = 0.3; };",
             "no tool touches"),
     .also = {{TOOLS, BLADE}}},
    {IS_IDLE(CONTACT_TABLE, "damping_time", ALL, BODY, "", "contact = { damping_time = 1e-4; };",
             "no tool touches"),
     .also = {{TOOLS, ""}}},
    {IS_IDLE(CONTACT_TABLE, "friction", ALL, BODY, "", "contact = { friction = 0.5; };",
             "no tool touches"),
     .also = {{TOOLS, ""}}},
    {IS_IDLE(CONTACT_TABLE, "friction", ALL, BODY, "", "contact = { friction = 0.5; };",
             "each tool has a friction"),
     .also = {{TOOLS, PROBE("friction = 0.9;")}}},

    {IN(FIXED_TABLE, "box", ALL, STATE, BODY,
        "fixed = ( { box = ([-1, -1, -1], [1, -0.03, 1]); } );",
        "fixed = ( { box = ([-1, 0.03, -1], [1, 1, 1]); } );")},
    {IN(FIXED_TABLE, "sphere", ALL, STATE, BODY,
        "fixed = ( { sphere = [0.0, 0.045, 0.0]; radius = 0.03; } );",
        "fixed = ( { sphere = [0.0, -0.045, 0.0]; radius = 0.03; } );")},
    {IN(FIXED_TABLE, "radius", ALL, STATE, BODY,
        "fixed = ( { sphere = [0.0, 0.045, 0.0]; radius = 0.02; } );",
        "fixed = ( { sphere = [0.0, 0.045, 0.0]; radius = 0.04; } );")},
    {IN(FIXED_TABLE, "nodes", S | V, STATE, BODY, "", "fixed = ( { nodes = [ 0 ]; } );")},
    {IN(FIXED_TABLE, "nodes", P, STATE, BODY, "", "fixed = ( { nodes = [ 17 ]; } );")},

#define WEIGHTS(entry) "weights = ( { " entry " } );"
    {IN(BODY_TABLE, "weights", V, STATE, BODY, "", WEIGHTS("nodes = [ 0 ]; mass = 0.1;"))},
    {REFUSES(BODY_TABLE, "weights", P, BODY, WEIGHTS("nodes = [ 0 ]; mass = 0.1;"),
             "means nothing for a plane body")},
    {REFUSES(BODY_TABLE, "weights", V, BODY,
             "cuttable = true; " WEIGHTS("nodes = [ 0 ]; mass = 0.1;"),
             "cannot be mixed with cuttable")},
    {REFUSES(BODY_TABLE, "weights", V, BODY,
             WEIGHTS("sphere = [9.0, 0.0, 0.0]; radius = 0.01; mass = 0.1;"), "holds no vertex")},
    {IN(WEIGHT_TABLE, "box", V, STATE, BODY,
        WEIGHTS("mass = 0.1; box = ([-1, -1, -1], [1, -0.03, 1]);"),
        WEIGHTS("mass = 0.1; box = ([-1, 0.03, -1], [1, 1, 1]);"))},
    {IN(WEIGHT_TABLE, "sphere", V, STATE, BODY,
        WEIGHTS("mass = 0.1; sphere = [0.0, 0.045, 0.0]; radius = 0.03;"),
        WEIGHTS("mass = 0.1; sphere = [0.0, -0.045, 0.0]; radius = 0.03;"))},
    {IN(WEIGHT_TABLE, "radius", V, STATE, BODY,
        WEIGHTS("mass = 0.1; sphere = [0.0, 0.045, 0.0]; radius = 0.02;"),
        WEIGHTS("mass = 0.1; sphere = [0.0, 0.045, 0.0]; radius = 0.04;"))},
    {IN(WEIGHT_TABLE, "nodes", V, STATE, BODY, WEIGHTS("mass = 0.1; nodes = [ 0 ];"),
        WEIGHTS("mass = 0.1; nodes = [ 1 ];"))},
    {IN(WEIGHT_TABLE, "mass", V, STATE, BODY, WEIGHTS("nodes = [ 0 ]; mass = 0.1;"),
        WEIGHTS("nodes = [ 0 ]; mass = 0.2;"))},

    // --- meshes and surface bodies ---
    {IN(MESH_TABLE, "file", S, STATE, SOURCE, NULL, MESH("file = \"ball.obj\";"))},
    {IN(MESH_TABLE, "generator", S, STATE, SOURCE, NULL, MESH("generator = \"sphere\";"))},
    {IN(MESH_TABLE, "nodes", S, STATE, SOURCE, MESH("generator = \"sphere\"; nodes = 60;"),
        MESH("generator = \"sphere\"; nodes = 70;"))},
    {IN(MESH_TABLE, "subdivisions", S, STATE, SOURCE, NULL, SPHERE("subdivisions = 1;"))},
    {IN(MESH_TABLE, "rings", S, STATE, SOURCE, MESH("generator = \"uv_sphere\";"),
        MESH("generator = \"uv_sphere\"; rings = 7;"))},
    {IN(MESH_TABLE, "segments", S, STATE, SOURCE, MESH("generator = \"uv_sphere\";"),
        MESH("generator = \"uv_sphere\"; segments = 10;"))},
    {IN(MESH_TABLE, "columns", S, STATE, SOURCE, MESH("generator = \"sheet\";"),
        MESH("generator = \"sheet\"; columns = 9;"))},
    {IN(MESH_TABLE, "rows", S, STATE, SOURCE, MESH("generator = \"sheet\";"),
        MESH("generator = \"sheet\"; rows = 9;"))},
    {IN(MESH_TABLE, "radius", S, STATE, SOURCE, MESH("generator = \"sphere\";"),
        MESH("generator = \"sphere\"; radius = 0.04;"))},
    {IN(MESH_TABLE, "width", S, STATE, SOURCE, MESH("generator = \"sheet\";"),
        MESH("generator = \"sheet\"; width = 0.11;"))},
    {IN(MESH_TABLE, "height", S, STATE, SOURCE, MESH("generator = \"sheet\";"),
        MESH("generator = \"sheet\"; height = 0.11;"))},
    {IN(MESH_TABLE, "length", S, STATE, SOURCE, MESH("generator = \"stomach\";"),
        MESH("generator = \"stomach\"; length = 0.2;"))},
    {IN(MESH_TABLE, "scale", S, STATE, SOURCE, NULL, SPHERE("subdivisions = 2; scale = 0.9;"))},
    {IN(MESH_TABLE, "place", S, STATE, SOURCE, NULL,
        SPHERE("subdivisions = 2; place = { translation = [0, 0.01, 0]; };"))},

    {IN(PLACEMENT_TABLE, "translation", S, STATE, SOURCE, NULL,
        SPHERE("subdivisions = 2; place = { translation = [0, 0.01, 0]; };"))},
    {IN(PLACEMENT_TABLE, "rotation", S, STATE, SOURCE, NULL,
        SPHERE("subdivisions = 2; place = { rotation = [0, 0, 0.3]; };"))},
    {IN(PLACEMENT_TABLE, "translation", V, STATE, SOURCE, NULL,
        BOX("count = 6; place = { translation = [0, 0.01, 0]; };"))},
    {IN(PLACEMENT_TABLE, "rotation", V, STATE, SOURCE, NULL,
        BOX("count = 6; place = { rotation = [0, 0, 0.3]; };"))},
    {IN(PLACEMENT_TABLE, "translation", P, STATE, SOURCE, NULL,
        DISC("radius = 0.05; size = 0.01; place = { translation = [0, 0.01, 0]; };"))},
    {IN(PLACEMENT_TABLE, "rotation", P, STATE, SOURCE, NULL,
        DISC("radius = 0.05; size = 0.01; place = { rotation = [0, 0, 0.3]; };"))},

#define MATERIAL(base, changed)                                                                    \
    STATE, BODY, "material = { " base " };", "material = { " changed " };"
    {IN(MATERIAL_TABLE, "spring_stiffness", S,
        MATERIAL(UNIFORM, "spring_stiffness = 70.0; node_mass = 1.0e-3;"))},
    {IN(MATERIAL_TABLE, "spring_damping", S, MATERIAL(UNIFORM, UNIFORM "spring_damping = 0.001;"))},
    {IN(MATERIAL_TABLE, "node_mass", S,
        MATERIAL(UNIFORM, "spring_stiffness = 60.0; node_mass = 2.0e-3;"))},
    {IN(MATERIAL_TABLE, "thickness", S, MATERIAL("", "thickness = 0.004;"))},
    {IN(MATERIAL_TABLE, "bending_stiffness", S, MATERIAL("", "bending_stiffness = 1.0e-4;"))},
    {REFUSES(MATERIAL_TABLE, "bending_stiffness", S, BODY,
             "material = { thickness = 0.004; bending_stiffness = 1.0e-4; };",
             "bending_stiffness cannot be mixed with thickness")},
    {IN(MATERIAL_TABLE, "node_damping", S, MATERIAL(UNIFORM, UNIFORM "node_damping = 0.01;"))},

#define SHAPED(base, changed) STATE, BODY, "shape = { " base " };", "shape = { " changed " };"
    {IN(SHAPE_TABLE, "stiffness", S, SHAPED("stiffness = 1.0;", "stiffness = 2.0;"))},
    {IN(SHAPE_TABLE, "damping", S, SHAPED("stiffness = 1.0;", "stiffness = 1.0; damping = 0.01;"))},
    {IN(SHAPE_TABLE, "damping_direction", S, STATE, BODY, "levels = 1; adapt = {}; shape = {};",
        "levels = 1; adapt = {}; shape = { damping_direction = \"radial\"; };")},
    {REFUSES(SHAPE_TABLE, "damping_direction", S, BODY,
             "shape = { frame = \"body\"; damping_direction = \"radial\"; };", "needs frame")},

#define FILLED(base, changed)                                                                      \
    STATE, BODY, "integrator = \"leapfrog\"; cavity = { " base " };",                              \
        "integrator = \"leapfrog\"; cavity = { " changed " };"
    {IN(CAVITY_TABLE, "pressure", S, FILLED("", "pressure = 50.0;"))},
    {IN(CAVITY_TABLE, "gas", S, FILLED("pressure = 50.0;", "pressure = 50.0; gas = true;"))},
    {IN(CAVITY_TABLE, "ambient", S,
        FILLED("pressure = 50.0; gas = true;", "pressure = 50.0; gas = true; ambient = 1.0e4;"))},
    {IS_IDLE(CAVITY_TABLE, "ambient", S, BODY, "integrator = \"leapfrog\"; cavity = {};",
             "integrator = \"leapfrog\"; cavity = { ambient = 1.0e4; };", "gas is false")},
    {IN(CAVITY_TABLE, "fluid", S, FILLED("pressure = 50.0;", "pressure = 50.0; fluid = true;"))},
    {REFUSES(CAVITY_TABLE, "fluid", S, BODY,
             "integrator = \"leapfrog\"; cavity = { gas = true; fluid = true; };",
             "cannot be mixed with gas")},
    {IN(CAVITY_TABLE, "bulk_modulus", S,
        FILLED("pressure = 50.0; fluid = true;",
               "pressure = 50.0; fluid = true; bulk_modulus = 1.0e4;"))},
    {IS_IDLE(CAVITY_TABLE, "bulk_modulus", S, BODY, "integrator = \"leapfrog\"; cavity = {};",
             "integrator = \"leapfrog\"; cavity = { bulk_modulus = 1.0e4; };", "fluid is false")},
    {IN(CAVITY_TABLE, "density", S, STATE, BODY,
        "integrator = \"leapfrog\"; cuttable = true; cavity = { pressure = 50.0; };",
        "integrator = \"leapfrog\"; cuttable = true; cavity = { pressure = 50.0; density = 50.0; "
        "};"),
     .also = {{TOOLS, BLADE}}},
    {IS_IDLE(CAVITY_TABLE, "density", S, BODY, "integrator = \"leapfrog\"; cavity = {};",
             "integrator = \"leapfrog\"; cavity = { density = 50.0; };", "cuttable is false")},
#define ADAPTS(more) "levels = 2; adapt = { " more " };"
    {REFUSES(MATERIAL_TABLE, "areal_density", S, BODY,
             "integrator = \"implicit\"; material = { areal_density = 1e-25; };",
             "double precision loses the masses")},
    {IN(ADAPT_TABLE, "force", S, STATE, BODY, ADAPTS("force = 1e6;"), ADAPTS("force = 1e-4;"))},
    {IN(ADAPT_TABLE, "speed", S, STATE, BODY, ADAPTS("speed = 1e6;"), ADAPTS("speed = 1e-4;"))},
    {IN(ADAPT_TABLE, "curvature", S, STATE, BODY, ADAPTS("curvature = 1e6;"),
        ADAPTS("curvature = 1e-3;"))},
    {IN(ADAPT_TABLE, "coarsest", S, STATE, BODY, ADAPTS("coarsest = 0;"), ADAPTS("coarsest = 1;"))},
    {REFUSES(ADAPT_TABLE, "coarsest", S, BODY, ADAPTS("coarsest = 3;"), "exceeds levels")},
    {REFUSES(ADAPT_TABLE, "coarsest", S, BODY, "start_level = 0; " ADAPTS("coarsest = 1;"),
             "is below adapt.coarsest")},
    {IN(ADAPT_TABLE, "check_hz", S, STATE, BODY, ADAPTS("check_hz = 1000.0;"),
        ADAPTS("check_hz = 50.0;"))},

    // --- voxel bodies, solid and plane ---
    {IN(VOXELS_TABLE, "file", V, STATE, SOURCE, NULL, VOXELS(LIVER))},
    {REFUSES(VOXELS_TABLE, "file", P, SOURCE, VOXELS(LIVER "dimensions = 2;"),
             "dimensions 2 means nothing")},
    {IN(VOXELS_TABLE, "label", V, STATE, SOURCE, VOXELS(LIVER), VOXELS(LIVER "label = 2;"))},
    {REFUSES(VOXELS_TABLE, "label", V | P, SOURCE, DISC("label = 2;"), "label means nothing")},
    {IN(VOXELS_TABLE, "mesh", V, STATE, SOURCE, NULL, VOXELS("mesh = \"ball.obj\"; size = 0.01;"))},
    {REFUSES(VOXELS_TABLE, "mesh", P, SOURCE,
             VOXELS("mesh = \"ball.obj\"; size = 0.01; dimensions = 2;"),
             "dimensions 2 means nothing")},
    {IN(VOXELS_TABLE, "generator", V, STATE, SOURCE, NULL,
        VOXELS("generator = \"ball\"; size = 0.015;"))},
    {IN(VOXELS_TABLE, "generator", P, STATE, SOURCE, NULL,
        VOXELS("generator = \"box\"; count = 10; size = 0.01; dimensions = 2;"))},
    {IN(VOXELS_TABLE, "count", V, STATE, SOURCE, NULL, BOX("count = [6, 5, 6];"))},
    {IN(VOXELS_TABLE, "count", P, STATE, SOURCE, BOX("dimensions = 2; count = [6, 6];"),
        BOX("dimensions = 2; count = [6, 5];"))},
    {IN(VOXELS_TABLE, "radius", V, STATE, SOURCE, VOXELS("generator = \"ball\"; size = 0.015;"),
        VOXELS("generator = \"ball\"; size = 0.015; radius = 0.06;"))},
    {IN(VOXELS_TABLE, "radius", P, STATE, SOURCE, NULL, DISC("radius = 0.04; size = 0.01;"))},
    {IN(VOXELS_TABLE, "size", V, STATE, SOURCE, NULL,
        VOXELS("generator = \"box\"; count = 6; size = 0.014;"))},
    {IN(VOXELS_TABLE, "size", P, STATE, SOURCE, NULL, DISC("radius = 0.05; size = 0.008;"))},
    {IN(VOXELS_TABLE, "scale", V, STATE, SOURCE, NULL, BOX("count = 6; scale = 0.9;"))},
    {IN(VOXELS_TABLE, "scale", V, STATE, SOURCE, VOXELS(LIVER), VOXELS(LIVER "scale = 0.9;"))},
    {IN(VOXELS_TABLE, "scale", P, STATE, SOURCE, NULL,
        DISC("radius = 0.05; size = 0.01; scale = 0.9;"))},
    {IN(VOXELS_TABLE, "place", V, STATE, SOURCE, NULL,
        BOX("count = 6; place = { translation = [0, 0.01, 0]; };"))},
    {IN(VOXELS_TABLE, "place", P, STATE, SOURCE, NULL,
        DISC("radius = 0.05; size = 0.01; place = { translation = [0, 0.01, 0]; };"))},
    {IN(VOXELS_TABLE, "dimensions", V, STATE, SOURCE, BOX("count = [6, 6, 1];"),
        BOX("count = [6, 6, 1]; dimensions = 2;"))},
    {REFUSES(VOXELS_TABLE, "dimensions", P, SOURCE, DISC("dimensions = 3;"), "a plane body")},

    {REFUSES(MATERIAL_TABLE, "relaxation", S, BODY,
             "integrator = \"rk4\"; material = { relaxation = ( { time = 0.1; share = 0.2; } ); };",
             "relaxation needs integrator \"leapfrog\" or \"symplectic_euler\", not \"rk4\"")},
    {REFUSES(MATERIAL_TABLE, "relaxation", S, BODY,
             "material = { relaxation = ( { time = 0.1; share = 0.6; }, { time = 1.0; share = "
             "0.6; } ); };",
             "add up to 1.2, more than 0.95")},
    {IN(MATERIAL_TABLE, "relaxation", S,
        MATERIAL("", "relaxation = ( { time = 0.1; share = 0.2; } );"))},
    {REFUSES(MATERIAL_TABLE, "loss_factor", S, BODY,
             "integrator = \"implicit\"; material = { loss_factor = 0.1; };",
             "loss_factor needs integrator \"leapfrog\" or \"symplectic_euler\", not "
             "\"implicit\"")},
    {REFUSES(MATERIAL_TABLE, "loss_factor", S, BODY,
             "material = { loss_factor = 0.1; relaxation = ( { time = 0.1; share = 0.2; } ); };",
             "cannot be mixed with relaxation")},
    {IN(MATERIAL_TABLE, "loss_factor", S, MATERIAL("", "loss_factor = 0.1;"))},

    {IN(VOXEL_MATERIAL_TABLE, "poisson_ratio", V | P, MATERIAL("", "poisson_ratio = 0.3;"))},
    {REFUSES(VOXEL_MATERIAL_TABLE, "poisson_ratio", V | P, BODY,
             "law = \"miyazaki2004\"; material = { poisson_ratio = 0.3; };", "knows only 0")},
    {REFUSES(VOXEL_MATERIAL_TABLE, "damping_time", P, BODY, "material = { damping_time = 1e-3; };",
             "means nothing for a plane body")},
    {IN(VOXEL_MATERIAL_TABLE, "damping_time", V,
        MATERIAL("damping = 0.2;", "damping_time = 1e-3;"))},
    {REFUSES(VOXEL_MATERIAL_TABLE, "damping_time", V, BODY,
             "material = { damping = 0.2; damping_time = 1e-3; };",
             "cannot be mixed with damping")},
    {REFUSES(VOXEL_MATERIAL_TABLE, "relaxation", P, BODY,
             "material = { relaxation = ( { time = 0.1; share = 0.2; } ); };",
             "means nothing for a plane body")},
    {REFUSES(
        VOXEL_MATERIAL_TABLE, "relaxation", V, BODY,
        "law = \"miyazaki2004\"; material = { relaxation = ( { time = 0.1; share = 0.2; } ); };",
        "needs law \"affine\"")},
    {REFUSES(
        VOXEL_MATERIAL_TABLE, "relaxation", V, BODY,
        "material = { relaxation = ( { time = 0.1; share = 0.6; }, { time = 1.0; share = 0.6; } "
        "); };",
        "add up to 1.2, more than 0.95")},
    {IN(VOXEL_MATERIAL_TABLE, "relaxation", V,
        MATERIAL("drag = 0.0;", "drag = 0.0; relaxation = ( { time = 0.1; share = 0.2; } );"))},
#define STIFFENS(values) "material = { stiffening = { " values " }; };"
    {REFUSES(MATERIAL_TABLE, "stiffening", S, BODY,
             "integrator = \"implicit\"; " STIFFENS("strain = 0.15; cap = 10.0;"),
             "stiffening needs an explicit integrator, not \"implicit\"")},
    {IN(MATERIAL_TABLE, "stiffening", S,
        MATERIAL("", "stiffening = { strain = 0.05; cap = 10.0; };"))},
    {REFUSES(VOXEL_MATERIAL_TABLE, "stiffening", P, BODY, STIFFENS("strain = 0.15; cap = 10.0;"),
             "means nothing for a plane body")},
    {REFUSES(VOXEL_MATERIAL_TABLE, "stiffening", V, BODY,
             "law = \"miyazaki2004\"; " STIFFENS("strain = 0.15; cap = 10.0;"),
             "needs law \"affine\"")},
    {IN(VOXEL_MATERIAL_TABLE, "stiffening", V,
        MATERIAL("", "stiffening = { strain = 0.05; cap = 10.0; };"))},
    {IN(STIFFENING_TABLE, "strain", S | V, STATE, BODY, STIFFENS("strain = 0.05; cap = 10.0;"),
        STIFFENS("strain = 0.08; cap = 10.0;"))},
    {REFUSES(STIFFENING_TABLE, "strain", S | V, BODY, STIFFENS("strain = 0.0; cap = 10.0;"),
             "strain 0 outside (0, 10]")},
    {IN(STIFFENING_TABLE, "cap", S | V, STATE, BODY, STIFFENS("strain = 0.05; cap = 10.0;"),
        STIFFENS("strain = 0.05; cap = 2.0;"))},
    {REFUSES(STIFFENING_TABLE, "cap", S | V, BODY, STIFFENS("strain = 0.05; cap = 0.5;"),
             "cap 0.5 outside [1, 100]")},
    {REFUSES(VOXEL_MATERIAL_TABLE, "loss_factor", P, BODY, "material = { loss_factor = 0.1; };",
             "means nothing for a plane body")},
    {REFUSES(VOXEL_MATERIAL_TABLE, "loss_factor", V, BODY,
             "material = { loss_factor = 0.1; relaxation = ( { time = 0.1; share = 0.2; } ); };",
             "cannot be mixed with relaxation")},
    {IN(VOXEL_MATERIAL_TABLE, "loss_factor", V,
        MATERIAL("drag = 0.0;", "drag = 0.0; loss_factor = 0.1;"))},
#define RELAXES(values) "material = { relaxation = ( { " values " } ); };"
    {IN(BRANCH_TABLE, "time", S, STATE, BODY, RELAXES("time = 0.1; share = 0.2;"),
        RELAXES("time = 0.2; share = 0.2;"))},
    {IN(BRANCH_TABLE, "share", S, STATE, BODY, RELAXES("time = 0.1; share = 0.2;"),
        RELAXES("time = 0.1; share = 0.3;"))},
    {REFUSES(BRANCH_TABLE, "volumetric", S, BODY,
             RELAXES("time = 0.1; share = 0.2; volumetric = true;"),
             "volumetric means nothing for a surface body")},
#define BRANCH(values) "material = { drag = 0.0; relaxation = ( { " values " } ); };"
    {IN(BRANCH_TABLE, "time", V, STATE, BODY, BRANCH("time = 0.1; share = 0.2;"),
        BRANCH("time = 0.2; share = 0.2;"))},
    {IN(BRANCH_TABLE, "share", V, STATE, BODY, BRANCH("time = 0.1; share = 0.2;"),
        BRANCH("time = 0.1; share = 0.3;"))},
    {IN(BRANCH_TABLE, "volumetric", V, STATE, BODY, BRANCH("time = 0.1; share = 0.2;"),
        BRANCH("time = 0.1; share = 0.2; volumetric = true;"))},
    // Without any of these there is drag.
    {IN(VOXEL_MATERIAL_TABLE, "drag", V, MATERIAL("", "drag = 0.0;"))},
    {IN(VOXEL_MATERIAL_TABLE, "damping", V, MATERIAL("", "damping = 0.2;"))},
#define LABELS(value) "materials = ( { label = 1; " value " } ); "
    {IS_IDLE(VOXEL_MATERIAL_TABLE, "youngs_modulus", V | P, BODY, LABELS("youngs_modulus = 1e4;"),
             LABELS("youngs_modulus = 1e4;") "material = { youngs_modulus = 2e4; };",
             "materials give it")},
    {IS_IDLE(VOXEL_MATERIAL_TABLE, "poisson_ratio", V | P, BODY, LABELS("poisson_ratio = 0.2;"),
             LABELS("poisson_ratio = 0.2;") "material = { poisson_ratio = 0.3; };",
             "materials give it")},
    {IS_IDLE(VOXEL_MATERIAL_TABLE, "density", V | P, BODY, LABELS("density = 1e3;"),
             LABELS("density = 1e3;") "material = { density = 900.0; };", "materials give it")},
#define LABEL(more) "materials = ( { label = 1; " more " } );"
    {REFUSES_FROM(LABEL_MATERIAL_TABLE, "label", V | P, BODY, LABEL(""),
                  "materials = ( { label = 2; } );", "not among those")},
    {IN(LABEL_MATERIAL_TABLE, "youngs_modulus", V | P, STATE, BODY, LABEL(""),
        LABEL("youngs_modulus = 2e4;"))},
    {IN(LABEL_MATERIAL_TABLE, "poisson_ratio", V | P, STATE, BODY, LABEL(""),
        LABEL("poisson_ratio = 0.3;"))},
    {IN(LABEL_MATERIAL_TABLE, "density", V | P, STATE, BODY, LABEL(""), LABEL("density = 900.0;"))},
#define SKIN(more) "skin = { " more " };"
    {IN(SKIN_TABLE, "mesh", V, SHOWN, BODY, SKIN("mesh = \"ball.obj\";"),
        SKIN("mesh = \"finer.obj\";"))},
    {IN(SKIN_TABLE, "scale", V, SHOWN, BODY, SKIN("mesh = \"ball.obj\";"),
        SKIN("mesh = \"ball.obj\"; scale = 0.9;"))},
    {IN(SKIN_TABLE, "place", V, SHOWN, BODY, SKIN("mesh = \"ball.obj\";"),
        SKIN("mesh = \"ball.obj\"; place = { rotation = [0, 0, 0.3]; };"))},

    // --- tools, loads and attachments ---
    {IN(TOOL_TABLE, "id", ALL, STREAM, TOOLS, PROBE(""),
        "tools = ( " TOOL("7", "probe", CAPSULE) " );")},
    {IN(TOOL_TABLE, "kind", ALL, STATE, TOOLS, PROBE(""), GRASPER(""))},
    {IN(TOOL_TABLE, "capsules", ALL, STATE, TOOLS, PROBE(""),
        "tools = ( " TOOL("1", "probe", "capsules = ( { radius = 0.02; } );") " );")},
    {IN(TOOL_TABLE, "plane", ALL, STATE, TOOLS, "",
        TABLE("point = [0, -0.03, 0]; normal = [0, 1, 0];"))},
    {IN(TOOL_TABLE, "max_force", ALL, STATE, TOOLS, PROBE(""), PROBE("max_force = 0.01;"))},
    {IN(TOOL_TABLE, "max_force", ALL, STATE, TOOLS, GRASPER(""), GRASPER("max_force = 0.01;"))},
    {IN(TOOL_TABLE, "friction", ALL, STATE, TOOLS, PROBE(""), PROBE("friction = 0.9;"))},
#define EDGED(more)                                                                                \
    "tools = ( " TOOL("2", "blade", "edge = ([0.0, 0.0, -0.1], [0.0, 0.0, 0.1]); " more) " );"
    {IS_IDLE(TOOL_TABLE, "max_force", ALL, TOOLS, EDGED(""), EDGED("max_force = 0.01;"),
             "it has no capsules"),
     .also = {{BODY, "cuttable = true;"}}},
    {IS_IDLE(TOOL_TABLE, "friction", ALL, TOOLS, EDGED(""), EDGED("friction = 0.9;"),
             "it has no capsules"),
     .also = {{BODY, "cuttable = true;"}}},
    {IN(TOOL_TABLE, "grip_stiffness", ALL, STATE, TOOLS, GRASPER(""),
        GRASPER("grip_stiffness = 0.1;"))},
    {IN(TOOL_TABLE, "grip_damping_ratio", ALL, STATE, TOOLS, GRASPER(""),
        GRASPER("grip_damping_ratio = 0.1;"))},
    {IN(TOOL_TABLE, "edge", ALL, STATE, TOOLS, BLADE,
        "tools = ( " TOOL("2", "blade", "edge = ([0.0, 0.0, -0.1], [0.03, 0.0, 0.1]);") " );"),
     .also = {{BODY, "cuttable = true;"}}},
    {IN(CAPSULE_TABLE, "from", ALL, STATE, TOOLS, PROBE(""),
        "tools = ( " TOOL("1", "probe",
                          "capsules = ( { radius = 0.01; from = [0.01, 0, 0]; } );") " );")},
    {IN(CAPSULE_TABLE, "to", ALL, STATE, TOOLS, PROBE(""),
        "tools = ( " TOOL("1", "probe",
                          "capsules = ( { radius = 0.01; to = [0.01, 0, 0]; } );") " );")},
    {IN(CAPSULE_TABLE, "radius", ALL, STATE, TOOLS, PROBE(""),
        "tools = ( " TOOL("1", "probe", "capsules = ( { radius = 0.02; } );") " );")},
    {IN(PLANE_TABLE, "point", ALL, STATE, TOOLS,
        TABLE("point = [0, -0.03, 0]; normal = [0, 1, 0];"),
        TABLE("point = [0, -0.035, 0]; normal = [0, 1, 0];"))},
    {IN(PLANE_TABLE, "normal", ALL, STATE, TOOLS,
        TABLE("point = [0, -0.03, 0]; normal = [0, 1, 0];"),
        TABLE("point = [0, -0.03, 0]; normal = [0.1, 1, 0];"))},

    {IN(LOAD_TABLE, "body", ALL, STATE, LOADS, LOAD(PUSH "body = \"a\";"),
        LOAD(PUSH "body = \"b\";")),
     .also = {{OTHER, SECOND}}},
    {IN(LOAD_TABLE, "center", ALL, STATE, LOADS, LOAD(PUSH),
        LOAD("center = [0.0, -0.04, 0.0]; radius = 0.03; force = [0.5, 0.0, 0.0]; duration = "
             "0.04;"))},
    {IN(LOAD_TABLE, "radius", ALL, STATE, LOADS, LOAD(PUSH),
        LOAD("center = [0.0, 0.04, 0.0]; radius = 0.05; force = [0.5, 0.0, 0.0]; duration = "
             "0.04;"))},
    {IN(LOAD_TABLE, "force", ALL, STATE, LOADS, LOAD(PUSH),
        LOAD("center = [0.0, 0.04, 0.0]; radius = 0.03; force = [0.4, 0.0, 0.0]; duration = "
             "0.04;"))},
    {IN(LOAD_TABLE, "start", ALL, STATE, LOADS, LOAD(PUSH), LOAD(PUSH "start = 0.01;"))},
    {IN(LOAD_TABLE, "duration", ALL, STATE, LOADS, LOAD(PUSH),
        LOAD("center = [0.0, 0.04, 0.0]; radius = 0.03; force = [0.5, 0.0, 0.0]; duration = "
             "0.03;"))},

#define TO_WORLD "to = \"world\"; "
    {IN(ATTACHMENT_TABLE, "body", ALL, STATE, ATTACH, HELD(HELD_AT TO_WORLD),
        HELD("body = \"b\"; sphere = [0.0, 0.1, 0.0]; radius = 0.05; " TO_WORLD)),
     .also = {{OTHER, SECOND}}},
    {IN(ATTACHMENT_TABLE, "box", ALL, STATE, ATTACH,
        HELD("body = \"a\"; box = ([-1, 0.03, -1], [1, 1, 1]); " TO_WORLD),
        HELD("body = \"a\"; box = ([-1, -1, -1], [1, -0.03, 1]); " TO_WORLD))},
    {IN(ATTACHMENT_TABLE, "sphere", ALL, STATE, ATTACH, HELD(HELD_AT TO_WORLD),
        HELD("body = \"a\"; sphere = [0.0, -0.045, 0.0]; radius = 0.03; " TO_WORLD))},
    {IN(ATTACHMENT_TABLE, "radius", ALL, STATE, ATTACH, HELD(HELD_AT TO_WORLD),
        HELD("body = \"a\"; sphere = [0.0, 0.045, 0.0]; radius = 0.05; " TO_WORLD))},
    {IN(ATTACHMENT_TABLE, "nodes", S | V, STATE, ATTACH, "",
        HELD("body = \"a\"; nodes = [ 0 ]; " TO_WORLD))},
    {IN(ATTACHMENT_TABLE, "nodes", P, STATE, ATTACH, "",
        HELD("body = \"a\"; nodes = [ 5 ]; " TO_WORLD))},
    {IN(ATTACHMENT_TABLE, "to", ALL, STATE, ATTACH, HELD(HELD_AT "tool = 1;"),
        HELD(HELD_AT TO_WORLD))},
    {IN(ATTACHMENT_TABLE, "tool", ALL, STATE, ATTACH, HELD(HELD_AT TO_WORLD),
        HELD(HELD_AT "tool = 1;"))},
    {IN(ATTACHMENT_TABLE, "to_body", ALL, STATE, ATTACH, HELD(HELD_AT TO_WORLD),
        HELD(HELD_AT "to_body = \"b\";")),
     .also = {{OTHER, SECOND}}},
    {IN(ATTACHMENT_TABLE, "stiffness", ALL, STATE, ATTACH, HELD(HELD_AT TO_WORLD),
        HELD(HELD_AT TO_WORLD "stiffness = 0.1;"))},
    {IN(ATTACHMENT_TABLE, "damping_ratio", ALL, STATE, ATTACH, HELD(HELD_AT TO_WORLD),
        HELD(HELD_AT TO_WORLD "damping_ratio = 0.1;"))},

    {IN(TOUCH_TABLE, "bodies", S | V, STATE, ATTACH, TOUCHES("bodies = [\"a\"]; "), TOUCHES(TWO)),
     .also = {{OTHER, BESIDE}, {LOADS, ONTO}}},
    {IN(TOUCH_TABLE, "stiffness", S | V, STATE, ATTACH, TOUCHES(TWO),
        TOUCHES(TWO "stiffness = 1.0;")),
     .also = {{OTHER, BESIDE}, {LOADS, ONTO}}},
    {IN(TOUCH_TABLE, "friction", S | V, STATE, ATTACH, TOUCHES(TWO),
        TOUCHES(TWO "friction = 0.5;")),
     .also = {{OTHER, BESIDE}, {LOADS, ONTO}}},
    {IN(TOUCH_TABLE, "thickness", S | V, STATE, ATTACH, TOUCHES(TWO),
        TOUCHES(TWO "thickness = 0.002;")),
     .also = {{OTHER, BESIDE}, {LOADS, ONTO}}},
};
const int KEY_ROW_COUNT = (int)(sizeof KEY_ROWS / sizeof *KEY_ROWS);

int key_models(const OptionTable *table)
{
    static const struct {
        const OptionTable *table;
        int models;
    } OF_SOME[] = {
        {&MESH_TABLE, S},
        {&MATERIAL_TABLE, S},
        {&SHAPE_TABLE, S},
        {&ADAPT_TABLE, S},
        {&CAVITY_TABLE, S},
        {&VOXELS_TABLE, V | P},
        {&VOXEL_MATERIAL_TABLE, V | P},
        {&SKIN_TABLE, V},
        {&BRANCH_TABLE, S | V},
        {&STIFFENING_TABLE, S | V},
        {&WEIGHT_TABLE, V},
        {&LABEL_MATERIAL_TABLE, V | P},
        {&TOUCH_TABLE, S | V},
    };
    for (size_t i = 0; i < sizeof OF_SOME / sizeof *OF_SOME; i++)
        if (OF_SOME[i].table == table)
            return OF_SOME[i].models;
    return ALL;
}

// Returns a number that is not the default, inside the range.
static double other_number(const Option *option)
{
    const double preset = fmax(option->preset, option->low);
    if (option->type == OPTION_INT)
        return preset < option->high ? preset + 1.0 : preset - 1.0;
    if (0.9 * preset > option->low)
        return 0.9 * preset;
    return preset + fmin(0.01, 0.1 * (option->high - preset));
}

// Writes another value than the default.
static void write_other(const Option *option, char *text, size_t size)
{
    const OptionWord *word = option->words;
    switch (option->type) {
    case OPTION_REAL:
    case OPTION_INT:
        snprintf(text, size, "%g", other_number(option));
        break;
    case OPTION_BOOL:
        snprintf(text, size, "%s", option->preset > 0.0 ? "false" : "true");
        break;
    case OPTION_WORD:
        snprintf(text, size, "\"%s\"", word[word->value == (int)option->preset].word);
        break;
    default:
        snprintf(text, size, "%s", option->type == OPTION_LIST ? "()" : "{}");
    }
}

bool key_row_make(const OptionTable *table, const Option *option, KeyModel model, MadeRow *made)
{
    const SceneModel scene_model = model == KEY_SURFACE ? MODEL_SURFACE : MODEL_VOXEL;
    const char *group = strncmp(table->path, "bodies.", 7) == 0 ? table->path + 7 : NULL;
    const bool used = option_is_used(option, (int)scene_model);
    const bool refused = table == &BODY_TABLE && !used;
    const bool number = option->type == OPTION_REAL || option->type == OPTION_INT ||
                        option->type == OPTION_BOOL || option->type == OPTION_WORD;
    if ((table != &BODY_TABLE && group == NULL) || (!refused && (!number || !used)))
        return false;
    char value[64];
    write_other(option, value, sizeof value);
    snprintf(made->base, sizeof made->base, group != NULL ? "%s = {};" : "%s",
             group != NULL ? group : "");
    snprintf(made->changed, sizeof made->changed,
             group != NULL ? "%s = { %s = %s; };" : "%s%s = %s;", group != NULL ? group : "",
             option->key, value);
    snprintf(made->said, sizeof made->said, "%s means nothing for a ", option->key);
    made->row = (KeyRow){.table = table,
                         .key = option->key,
                         .models = 1 << model,
                         .evidence = refused           ? REFUSED
                                     : option->physics ? STATE
                                                       : PLAN,
                         .part = BODY,
                         .base = made->base,
                         .changed = made->changed,
                         .said = made->said};
    return true;
}

char *key_scene(const KeyRow *row, KeyModel model, bool changed, const char *prefix)
{
    const char *part[PARTS];
    for (int p = 0; p < PARTS; p++)
        part[p] = PRESET[model][p];
    for (int i = 0; i < 2; i++)
        if (row->also[i].text != NULL)
            part[row->also[i].part] = row->also[i].text;
    const char *own = changed ? row->changed : row->base;
    if (own != NULL)
        part[row->part] = own;
    char *text = NULL;
    size_t size = 0;
    FILE *out = open_memstream(&text, &size);
    fprintf(out, "%s%s\nbodies = ( { %s\n%s\n%s }%s );\n%s\n%s\n%s\n", prefix, part[HEAD],
            part[NAME], part[SOURCE], part[BODY], part[OTHER], part[TOOLS], part[LOADS],
            part[ATTACH]);
    fclose(out);
    return text;
}
