// SPDX-License-Identifier: MIT
#include "rows.h"

#include "scene/scene_parts.h"

#include <string.h>

#define SPHERE(more)         "mesh = { generator = \"ico_sphere\"; radius = 0.05; " more " };"
#define BOX(more)            "model = \"voxel\"; voxels = { generator = \"box\"; size = 0.015; " more " };"
#define DISC(more)           "model = \"voxel\"; voxels = { generator = \"disc\"; " more " };"
#define VOXELS(more)         "model = \"voxel\"; voxels = { " more " };"
#define MESH(more)           "mesh = { " more " };"
#define LIVER                "file = \"" LIVER_FILE "\"; size = 0.02;"
#define NESTED               "mesh = \"nested.obj\"; size = 0.01; "
#define ONE_CAPSULE          "capsules = ( { radius = 0.01; } );"
#define TOOL(id, kind, more) "{ id = " id "; kind = \"" kind "\"; " more " }"
#define PROBE(more)          "tools = ( " TOOL("1", "probe", ONE_CAPSULE more) " );"
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

// Thick enough to adapt.
#define EIGHT          VOXELS("generator = \"box\"; count = 8; size = 0.01125;")
#define ADAPTING(more) "levels = { inside = 1; surface = 1; " more " };"
#define FINE_BALL      "sphere = [0.0, 0.0, 0.05]; radius = 0.02;"

static const char *const PRESET[KEY_MODELS][PARTS] = {
    {"", "name = \"a\";", SPHERE("subdivisions = 2;"), "", "", PROBE(""), LOAD(PUSH), ""},
    {"", "name = \"a\";", BOX("count = 6;"), "", "", PROBE(""), LOAD(PUSH), ""},
    {"", "name = \"a\";", DISC("radius = 0.05; size = 0.01;"), "", "", PROBE(""), LOAD(PUSH), ""},
};

// Expanded once more: two of the rows' parts are macros of several.
#define IN(...) IN_PARTS(__VA_ARGS__)
#define IN_PARTS(table_, key_, models_, evidence_, part_, base_, changed_)                         \
    .table = &table_##_TABLE, .key = #key_, .models = models_, .evidence = evidence_,              \
    .part = part_, .base = base_, .changed = changed_
#define MOVES(table_, key_, models_, ...) IN(table_, key_, models_, STATE, __VA_ARGS__)
// What changes is that a text is added to another.
#define ADDS(table_, key_, models_, part_, base_, more_)                                           \
    MOVES(table_, key_, models_, part_, base_, base_ " " more_)
#define IDLY_ADDS(table_, key_, models_, part_, base_, more_, said_)                               \
    IS_IDLE(table_, key_, models_, part_, base_, base_ " " more_, said_)
#define REFUSES_FROM(table_, key_, models_, part_, base_, changed_, said_)                         \
    IN(table_, key_, models_, REFUSED, part_, base_, changed_), .said = said_
#define REFUSES(table_, key_, models_, part_, changed_, said_)                                     \
    REFUSES_FROM(table_, key_, models_, part_, NULL, changed_, said_)
#define IS_IDLE(table_, key_, models_, part_, base_, changed_, said_)                              \
    IN(table_, key_, models_, IDLE, part_, base_, changed_), .said = said_
const KeyRow KEY_ROWS[] = {
    // --- the scene ---
    {IN(SCENE, name, ALL, STREAM, HEAD, "", "name = \"other\";")},
    {MOVES(SCENE, rate_hz, ALL, HEAD, "", "rate_hz = 900;")},
    {MOVES(SCENE, gravity, ALL, HEAD, "", PULLS)},
    {IN(SCENE, threads, ALL, PLAN, HEAD, "", "threads = 2;")},
    {IN(SCENE, precision, ALL, STATE_ALONE, HEAD, "", "precision = \"double\";")},
    {IN(SCENE, prefix, ALL, STREAM, HEAD, "", "prefix = \"OTHER\";")},
    {IN(SCENE, input_prefix, ALL, STREAM, HEAD, "", "input_prefix = \"NOBODY\";")},
    {IN(SCENE, lcm_url, ALL, STREAM, HEAD, "", "lcm_url = \"udpm://239.255.76.68:7668?ttl=0\";")},
    // What they do wants two hosts, and a STOP: fault_border.
    {IN(SCENE, remote, ALL, PLAN, HEAD, "", "remote = true;")},
    {IN(SCENE, stop_command, ALL, PLAN, HEAD, "", "stop_command = false;")},
    {IN(SCENE, publish, ALL, STREAM, HEAD, "", "publish = { nodes_hz = 10.0; };")},
    {REFUSES(SCENE, late, ALL, HEAD, "late = \"catch_up\";", "must be \"skip\"")},
    {IN(SCENE, start, ALL, STREAM, HEAD, "", "start = \"paused\";")},
    {IN(SCENE, estimate_error, ALL, STREAM, HEAD, "", "estimate_error = true;")},
    {MOVES(SCENE, tool_timeout_s, ALL, HEAD, "", "tool_timeout_s = 0.01;")},
    {IS_IDLE(SCENE, tool_timeout_s, ALL, HEAD, "", "tool_timeout_s = 0.01;", "no tool is moved"),
     .also = {{TOOLS, TABLE("point = [0, -0.03, 0]; normal = [0, 1, 0];")}}},
    {IN(SCENE, settle_s, ALL, STATE_ALONE, HEAD, PULLS, PULLS "settle_s = 0.02;")},
    {REFUSES(SCENE, capacity, ALL, HEAD, "capacity = { nodes = 5; };", "is 5")},
    {REFUSES(SCENE, prepared, ALL, HEAD, "prepared = \"none.h5\";", "none.h5")},
    {MOVES(SCENE, bodies, ALL, OTHER, "", SECOND)},
    {MOVES(SCENE, tools, ALL, TOOLS, "", PROBE(""))},
    {MOVES(SCENE, attachments, ALL, ATTACH, "", HELD(HELD_AT "to = \"world\";"))},
    {MOVES(SCENE, max_ties, ALL, HEAD, "", "max_ties = 2;")},
    {MOVES(SCENE, touch, S | V, ATTACH, "", TOUCHES(TWO)), .also = {{OTHER, BESIDE}}},
    {REFUSES(SCENE, touch, P, ATTACH, TOUCHES(TWO), "plane body"), .also = {{OTHER, BESIDE}}},
    {MOVES(SCENE, loads, ALL, LOADS, "", LOAD(PUSH))},
    // The server prints it, for the score sheet.
    {IN(SCENE, score, ALL, PLAN, HEAD, "", SCORE("force_limit = 2.0;"))},
    {IN(SCORE, force_limit, ALL, PLAN, HEAD, SCORE("force_limit = 1.0;"),
        SCORE("force_limit = 2.0;"))},
    {IN(SCORE, regions, ALL, PLAN, HEAD, SCORE(""), TARGET("name = \"a\"; " BALL))},
    {IN(SCORE_REGION, name, ALL, PLAN, HEAD, TARGET("name = \"a\"; " BALL),
        TARGET("name = \"b\"; " BALL))},
    {IN(SCORE_REGION, box, ALL, PLAN, HEAD, TARGET(BALL),
        TARGET("box = ([0.0, 0.0, 0.0], [1.0, 1.0, 1.0]);"))},
    {IN(SCORE_REGION, sphere, ALL, PLAN, HEAD, TARGET(BALL),
        TARGET("sphere = [0.0, 0.0, 2.0]; radius = 1.0;"))},
    {IN(SCORE_REGION, radius, ALL, PLAN, HEAD, TARGET(BALL),
        TARGET("sphere = [0.0, 0.0, 1.0]; radius = 2.0;"))},
    {IN(SCORE_REGION, margin, ALL, PLAN, HEAD, TARGET(BALL), TARGET(BALL "margin = 0.1;"))},
    {IN(SCORE_REGION, keep, ALL, PLAN, HEAD, TARGET(BALL), TARGET(BALL "keep = true;"))},
    {REFUSES_FROM(SCORE_REGION, label, ALL, HEAD, TARGET(BALL), TARGET("label = 7;"),
                  "label \"7\" is of no body")},

    {IN(PUBLISH, nodes_hz, ALL, STREAM, HEAD, "", "publish = { nodes_hz = 10.0; };")},
    {IN(PUBLISH, mesh_hz, ALL, STREAM, HEAD, "", "publish = { mesh_hz = 20.0; };")},
    {IN(PUBLISH, contact_hz, ALL, STREAM, HEAD, "", "publish = { contact_hz = 10.0; };")},
    {IN(PUBLISH, status_hz, ALL, STREAM, HEAD, "", "publish = { status_hz = 20.0; };")},
    {IN(PUBLISH, error_hz, ALL, STREAM, HEAD, "", "publish = { error_hz = 10.0; };")},
    {IN(PUBLISH, error_map, S | V, STREAM, HEAD, "publish = { error_hz = 10.0; };",
        "publish = { error_hz = 10.0; error_map = true; };")},
    {IS_IDLE(PUBLISH, error_map, P, HEAD, "publish = { error_hz = 10.0; };",
             "publish = { error_hz = 10.0; error_map = true; };", "plane bodies report none")},
    {IN(PUBLISH, elements_hz, V, STREAM, HEAD, "", "publish = { elements_hz = 10.0; };")},
    {IS_IDLE(PUBLISH, elements_hz, S | P, HEAD, "", "publish = { elements_hz = 10.0; };",
             "there is no voxel body")},
    {IN(PUBLISH, nodes, V, STREAM, HEAD, "", "publish = { nodes = \"all\"; };")},
    // They have no inside: all their nodes are published anyhow.
    {IS_IDLE(PUBLISH, nodes, S | P, HEAD, "", "publish = { nodes = \"all\"; };",
             "no body has an inside")},
    {IN(PUBLISH, positions, ALL, STREAM, HEAD, "", "publish = { positions = \"both\"; };")},
    {IN(PUBLISH, velocity, ALL, STREAM, HEAD, "", "publish = { velocity = true; };")},
    {IN(PUBLISH, rest, ALL, STREAM, HEAD, "", "publish = { rest = true; };")},
    {IN(PUBLISH, contact_stiffness, S | V, STREAM, HEAD, "",
        "publish = { contact_stiffness = false; };")},
    {IS_IDLE(PUBLISH, contact_stiffness, P, HEAD, "", "publish = { contact_stiffness = false; };",
             "plane bodies report none")},

    {IS_IDLE(PUBLISH, error_map, ALL, HEAD, "", "publish = { error_map = true; };",
             "error_hz is 0")},
    {IS_IDLE(PUBLISH, positions, ALL, HEAD, "publish = { nodes_hz = 0.0; };",
             "publish = { nodes_hz = 0.0; positions = \"both\"; };", "nodes_hz is 0")},
    {IS_IDLE(PUBLISH, velocity, ALL, HEAD, "publish = { nodes_hz = 0.0; };",
             "publish = { nodes_hz = 0.0; velocity = true; };", "nodes_hz is 0")},
    {IS_IDLE(PUBLISH, contact_hz, ALL, HEAD, "", "publish = { contact_hz = 10.0; };",
             "there is no tool"),
     .also = {{TOOLS, ""}}},
    {IS_IDLE(PUBLISH, contact_stiffness, S | V, HEAD, "",
             "publish = { contact_stiffness = false; };", "no tool is moved"),
     .also = {{TOOLS, ""}}},
    {IS_IDLE(PUBLISH, contact_stiffness, S | V, HEAD, "publish = { contact_hz = 0.0; };",
             "publish = { contact_hz = 0.0; contact_stiffness = false; };", "contact_hz is 0")},

    {REFUSES(CAPACITY, nodes, ALL, HEAD, "capacity = { nodes = 5; };", "capacity.nodes is 5")},
    {REFUSES(CAPACITY, faces, ALL, HEAD, "capacity = { faces = 5; };", "capacity.faces is 5")},

    // --- bodies ---
    {IN(BODY, name, ALL, STREAM, NAME, "name = \"a\";", "name = \"other\";")},
    {MOVES(BODY, model, S, SOURCE, NULL, BOX("count = 6;"))},
    {MOVES(BODY, model, V | P, SOURCE, NULL, SPHERE("subdivisions = 2;"))},
    {MOVES(BODY, mesh, S, SOURCE, NULL, SPHERE("subdivisions = 1;"))},
    {MOVES(BODY, voxels, V | P, SOURCE, NULL, BOX("count = 5;"))},
    {MOVES(BODY, levels, S, BODY, "levels = 1; adapt = {};", "levels = 2; adapt = {};")},
    {MOVES(BODY, levels, V | P, BODY, "levels = 0;", "levels = 1;")},
    {REFUSES(BODY, levels, S | P, BODY, "levels = {};", "must be a whole number")},
    {MOVES(LEVELS, inside, V, BODY, "levels = { inside = 0; };", "levels = { inside = 1; };")},
    {REFUSES(LEVELS, surface, V, BODY, "levels = { inside = 1; surface = 2; };",
             "exceeds levels.inside 1")},
    {MOVES(LEVELS, surface, V, BODY, "levels = { inside = 1; };",
           "levels = { inside = 1; surface = 1; };"),
     .also = {{SOURCE, EIGHT}}},
    {MOVES(LEVELS, fine, V, BODY, ADAPTING(""), ADAPTING("fine = ( { " FINE_BALL " } );")),
     .also = {{SOURCE, EIGHT}}},
    {MOVES(FINE, sphere, V, BODY, ADAPTING("fine = ( { " FINE_BALL " } );"),
           ADAPTING("fine = ( { sphere = [0.0, 0.0, -0.05]; radius = 0.02; } );")),
     .also = {{SOURCE, EIGHT}}},
    {MOVES(FINE, radius, V, BODY, ADAPTING("fine = ( { " FINE_BALL " } );"),
           ADAPTING("fine = ( { sphere = [0.0, 0.0, 0.05]; radius = 0.04; } );")),
     .also = {{SOURCE, EIGHT}}},
    {REFUSES(LEVELS, fine, V, BODY,
             "levels = { fine = ( { sphere = [0, 0, 0]; radius = 1.0; } ); };",
             "means nothing without levels.surface")},
    {REFUSES(FINE, sphere, V, BODY, "levels = { surface = 1; fine = ( { radius = 1.0; } ); };",
             "bodies.levels.fine.sphere is missing")},
    {REFUSES(FINE, radius, V, BODY,
             "levels = { surface = 1; fine = ( { sphere = [0, 0, 0]; } ); };",
             "bodies.levels.fine.radius is missing")},
    {ADDS(BODY, start_level, S, BODY, "levels = 1;", "start_level = 1;")},
    {ADDS(BODY, adjust, S, BODY, "levels = 1; start_level = 1;", "adjust = \"choi2005\";")},
    {IS_IDLE(BODY, adjust, S, BODY, "", "adjust = \"choi2005\";", "levels is 0")},
    {ADDS(BODY, adapt, S, BODY, "levels = 1;", "adapt = {};")},
    {ADDS(BODY, adapt, V, BODY, ADAPTING(""), "adapt = { error = 0.05; };"),
     .also = {{SOURCE, EIGHT}}},
    {REFUSES(BODY, adapt, P, BODY, "adapt = { error = 0.05; };",
             "adapt means nothing for a plane")},
    {REFUSES(BODY, adapt, V, BODY, "adapt = { error = 0.05; };", "needs levels.surface")},
    {MOVES(VOXEL_ADAPT, error, V, BODY, ADAPTING("") "adapt = { error = 0.05; };",
           ADAPTING("") "adapt = { error = 0.01; };"),
     .also = {{SOURCE, EIGHT}}},
    {MOVES(BODY, dimensions, V, BODY, "", "dimensions = 2;"),
     .also = {{SOURCE, BOX("count = [6, 6, 1];")}}},
    {REFUSES(BODY, dimensions, P, BODY, "dimensions = 3;", "a plane body")},
    {MOVES(BODY, material, S, BODY, "", "material = { youngs_modulus_2d = 90.0; };")},
    {MOVES(BODY, material, V | P, BODY, "", "material = { youngs_modulus = 2e4; };")},
    {MOVES(BODY, materials, V | P, BODY, "", "materials = ( { label = 1; density = 900.0; } );")},
    {MOVES(BODY, shape, S, BODY, "", "shape = {};")},
    {ADDS(BODY, cavity, S, BODY, "integrator = \"leapfrog\";", "cavity = { pressure = 50.0; };")},
    {MOVES(BODY, contact, ALL, BODY, "", "contact = { stiffness = 0.3; };")},
    {IN(BODY, skin, V, SHOWN, BODY, "", "skin = { mesh = \"ball.obj\"; };")},
    {REFUSES(BODY, skin, P, BODY, "skin = { mesh = \"ball.obj\"; };",
             "skin means nothing for a plane body")},
    {MOVES(BODY, surface, V, BODY, "", "surface = \"fitted\";")},
    {IS_IDLE(BODY, surface, V, BODY, "", "surface = \"blocks\";", "publish.nodes is"),
     .also = {{HEAD, "publish = { nodes = \"all\"; };"}}},
    {IS_IDLE(BODY, surface, V, BODY, "", "surface = \"blocks\";",
             "nodes_hz is 0 and there is no tool"),
     .also = {{HEAD, "publish = { nodes_hz = 0.0; };"}, {TOOLS, ""}}},
    {REFUSES(BODY, surface, P, BODY, "surface = \"blocks\";",
             "surface means nothing for a plane body")},
    {MOVES(BODY, integrator, S, BODY, "", "integrator = \"rk4\";")},
    {MOVES(BODY, integrator, S, BODY, "", "integrator = \"implicit\";")},
    {MOVES(BODY, integrator, V | P, BODY, "", "integrator = \"leapfrog\";")},
    {REFUSES(BODY, integrator, V | P, BODY, "integrator = \"rk4\";", "means nothing")},
    {REFUSES(BODY, integrator, V | P, BODY, "integrator = \"implicit\";", "means nothing")},
    {ADDS(BODY, theta, S, BODY, "integrator = \"implicit\";", "theta = 0.9;")},
    {IS_IDLE(BODY, theta, S, BODY, "", "theta = 0.9;", "not \"implicit\"")},
    {IDLY_ADDS(BODY, theta, S, BODY, "integrator = \"rk4\";", "theta = 0.9;", "not \"implicit\"")},
    {ADDS(BODY, solver_tolerance, S, BODY, "integrator = \"implicit\";",
          "solver_tolerance = 1.0e-8;")},
    {IS_IDLE(BODY, solver_tolerance, S, BODY, "", "solver_tolerance = 1.0e-8;",
             "not \"implicit\"")},
    {ADDS(BODY, solver_iterations, S, BODY, "integrator = \"implicit\";",
          "solver_iterations = 1;")},
    {IS_IDLE(BODY, solver_iterations, S, BODY, "", "solver_iterations = 1;", "not \"implicit\"")},
    {MOVES(BODY, time_step, ALL, BODY, "", "time_step = 1.0e-4;")},
    {REFUSES_FROM(BODY, unsafe_time_step, S, BODY,
                  STIFF("youngs_modulus_2d = 1e6;") "unsafe_time_step = true;",
                  STIFF("youngs_modulus_2d = 1e6;"), "time_step")},
    {REFUSES_FROM(BODY, unsafe_time_step, V | P, BODY,
                  STIFF("youngs_modulus = 1e8;") "unsafe_time_step = true;",
                  STIFF("youngs_modulus = 1e8;"), "time_step")},
    {IS_IDLE(BODY, unsafe_time_step, ALL, BODY, "", "unsafe_time_step = true;",
             "there is no time_step")},
    {MOVES(BODY, fixed, ALL, BODY, "",
           "fixed = ( { sphere = [0.0, 0.045, 0.0]; radius = 0.03; } );")},
    {REFUSES(BODY, initial, ALL, BODY, "initial = \"none.h5\";", "none.h5")},
    {MOVES(BODY, cuttable, ALL, BODY, "", "cuttable = true;"), .also = {{TOOLS, BLADE}}},
    {ADDS(BODY, split_budget, V, BODY, "levels = 1; cuttable = true;", "split_budget = 1;"),
     .also = {{TOOLS, BLADE}, {SOURCE, VOXELS("generator = \"box\"; count = 10; size = 0.009;")}}},
    {IDLY_ADDS(BODY, split_budget, V, BODY, "levels = 1;", "split_budget = 1;",
               "cuttable is false"),
     .also = {{TOOLS, BLADE}, {SOURCE, VOXELS("generator = \"box\"; count = 10; size = 0.009;")}}},
    {IDLY_ADDS(BODY, split_budget, V, BODY, "levels = 0; cuttable = true;", "split_budget = 1;",
               "levels is 0"),
     .also = {{TOOLS, BLADE}, {SOURCE, VOXELS("generator = \"box\"; count = 10; size = 0.009;")}}},
    {REFUSES(BODY, split_budget, P, BODY, "cuttable = true; split_budget = 1;",
             "split_budget means nothing for a plane body")},
#define BURNING(watts)                                                                             \
    "tools = ( " TOOL("5", "remover",                                                              \
                      "removes_by = \"diathermy\"; power = " watts                                 \
                      "; mouth = { radius = 0.02; };") " );"
    // Light, so that it is hot soon.
    {ADDS(BODY, coagulated_stiffness, V, BODY, "cuttable = true; material = { density = 1.0; };",
          "coagulated_stiffness = 2.0;"),
     .also = {{TOOLS, BURNING("1000")}}},
    {IDLY_ADDS(BODY, coagulated_stiffness, V, BODY, "cuttable = true;",
               "coagulated_stiffness = 2.0;", "no remover heats by diathermy")},
    {REFUSES(BODY, coagulated_stiffness, P, BODY, "cuttable = true; coagulated_stiffness = 2.0;",
             "coagulated_stiffness means nothing for a plane body")},
    {ADDS(BODY, tear, S, BODY, "cuttable = true;", "tear = { stretch = 0.001; };")},
    {ADDS(BODY, tear, V | P, BODY, "cuttable = true;", "tear = { force = 0.001; };")},

    {MOVES(TEAR, stress, V, BODY, "cuttable = true; tear = { stress = 1e6; };",
           "cuttable = true; tear = { stress = 1.0; };")},
    {REFUSES(TEAR, stress, S, BODY, "cuttable = true; tear = { stress = 1.0; };",
             "tear.stress means nothing for a surface body")},
    {REFUSES(TEAR, stress, P, BODY, "cuttable = true; tear = { stress = 1.0; };",
             "tear.stress means nothing for a plane body")},
    {MOVES(TEAR, force, V | P, BODY, "cuttable = true; tear = { force = 1e3; };",
           "cuttable = true; tear = { force = 0.001; };")},
    {REFUSES(TEAR, force, S, BODY, "cuttable = true; tear = { force = 1.0; };",
             "tear.force means nothing for a surface body")},
    {MOVES(TEAR, stretch, S, BODY, "cuttable = true; tear = { stretch = 9.0; };",
           "cuttable = true; tear = { stretch = 0.001; };")},
    {REFUSES(TEAR, stretch, V | P, BODY, "cuttable = true; tear = { stretch = 1.0; };",
             "tear.stretch means nothing for a voxel body")},

    {IS_IDLE(CONTACT, stiffness, ALL, BODY, "", "contact = { stiffness = 0.3; };",
             "no tool touches"),
     .also = {{TOOLS, BLADE}}},
    {IS_IDLE(CONTACT, damping_time, ALL, BODY, "", "contact = { damping_time = 1e-4; };",
             "no tool touches"),
     .also = {{TOOLS, ""}}},
    {IS_IDLE(CONTACT, friction, ALL, BODY, "", "contact = { friction = 0.5; };", "no tool touches"),
     .also = {{TOOLS, ""}}},
    {IS_IDLE(CONTACT, friction, ALL, BODY, "", "contact = { friction = 0.5; };",
             "each tool has a friction"),
     .also = {{TOOLS, PROBE("friction = 0.9;")}}},

    {MOVES(FIXED, box, ALL, BODY, "fixed = ( { box = ([-1, -1, -1], [1, -0.03, 1]); } );",
           "fixed = ( { box = ([-1, 0.03, -1], [1, 1, 1]); } );")},
    {MOVES(FIXED, sphere, ALL, BODY, "fixed = ( { sphere = [0.0, 0.045, 0.0]; radius = 0.03; } );",
           "fixed = ( { sphere = [0.0, -0.045, 0.0]; radius = 0.03; } );")},
    {MOVES(FIXED, radius, ALL, BODY, "fixed = ( { sphere = [0.0, 0.045, 0.0]; radius = 0.02; } );",
           "fixed = ( { sphere = [0.0, 0.045, 0.0]; radius = 0.04; } );")},
    {MOVES(FIXED, nodes, S | V, BODY, "", "fixed = ( { nodes = [ 0 ]; } );")},
    {MOVES(FIXED, nodes, P, BODY, "", "fixed = ( { nodes = [ 17 ]; } );")},

#define WEIGHTS(entry) "weights = ( { " entry " } );"
    {MOVES(BODY, weights, V, BODY, "", WEIGHTS("nodes = [ 0 ]; mass = 0.1;"))},
    {REFUSES(BODY, weights, P, BODY, WEIGHTS("nodes = [ 0 ]; mass = 0.1;"),
             "means nothing for a plane body")},
    {REFUSES(BODY, weights, V, BODY, "cuttable = true; " WEIGHTS("nodes = [ 0 ]; mass = 0.1;"),
             "cannot be mixed with cuttable")},
    {REFUSES(BODY, weights, V, BODY,
             WEIGHTS("sphere = [9.0, 0.0, 0.0]; radius = 0.01; mass = 0.1;"), "holds no vertex")},
    {MOVES(WEIGHT, box, V, BODY, WEIGHTS("mass = 0.1; box = ([-1, -1, -1], [1, -0.03, 1]);"),
           WEIGHTS("mass = 0.1; box = ([-1, 0.03, -1], [1, 1, 1]);"))},
    {MOVES(WEIGHT, sphere, V, BODY,
           WEIGHTS("mass = 0.1; sphere = [0.0, 0.045, 0.0]; radius = 0.03;"),
           WEIGHTS("mass = 0.1; sphere = [0.0, -0.045, 0.0]; radius = 0.03;"))},
    {MOVES(WEIGHT, radius, V, BODY,
           WEIGHTS("mass = 0.1; sphere = [0.0, 0.045, 0.0]; radius = 0.02;"),
           WEIGHTS("mass = 0.1; sphere = [0.0, 0.045, 0.0]; radius = 0.04;"))},
    {MOVES(WEIGHT, nodes, V, BODY, WEIGHTS("mass = 0.1; nodes = [ 0 ];"),
           WEIGHTS("mass = 0.1; nodes = [ 1 ];"))},
    {MOVES(WEIGHT, mass, V, BODY, WEIGHTS("nodes = [ 0 ]; mass = 0.1;"),
           WEIGHTS("nodes = [ 0 ]; mass = 0.2;"))},

    // --- meshes and surface bodies ---
    {MOVES(MESH, file, S, SOURCE, NULL, MESH("file = \"ball.obj\";"))},
    {MOVES(MESH, generator, S, SOURCE, NULL, MESH("generator = \"sphere\";"))},
    {MOVES(MESH, nodes, S, SOURCE, MESH("generator = \"sphere\"; nodes = 60;"),
           MESH("generator = \"sphere\"; nodes = 70;"))},
    {MOVES(MESH, subdivisions, S, SOURCE, NULL, SPHERE("subdivisions = 1;"))},
    {MOVES(MESH, rings, S, SOURCE, MESH("generator = \"uv_sphere\";"),
           MESH("generator = \"uv_sphere\"; rings = 7;"))},
    {MOVES(MESH, segments, S, SOURCE, MESH("generator = \"uv_sphere\";"),
           MESH("generator = \"uv_sphere\"; segments = 10;"))},
    {MOVES(MESH, columns, S, SOURCE, MESH("generator = \"sheet\";"),
           MESH("generator = \"sheet\"; columns = 9;"))},
    {MOVES(MESH, rows, S, SOURCE, MESH("generator = \"sheet\";"),
           MESH("generator = \"sheet\"; rows = 9;"))},
    {MOVES(MESH, radius, S, SOURCE, MESH("generator = \"sphere\";"),
           MESH("generator = \"sphere\"; radius = 0.04;"))},
    {MOVES(MESH, width, S, SOURCE, MESH("generator = \"sheet\";"),
           MESH("generator = \"sheet\"; width = 0.11;"))},
    {MOVES(MESH, height, S, SOURCE, MESH("generator = \"sheet\";"),
           MESH("generator = \"sheet\"; height = 0.11;"))},
    {MOVES(MESH, length, S, SOURCE, MESH("generator = \"stomach\";"),
           MESH("generator = \"stomach\"; length = 0.2;"))},
    {MOVES(MESH, scale, S, SOURCE, NULL, SPHERE("subdivisions = 2; scale = 0.9;"))},
    {MOVES(MESH, place, S, SOURCE, NULL,
           SPHERE("subdivisions = 2; place = { translation = [0, 0.01, 0]; };"))},

    {MOVES(PLACEMENT, translation, S, SOURCE, NULL,
           SPHERE("subdivisions = 2; place = { translation = [0, 0.01, 0]; };"))},
    {MOVES(PLACEMENT, rotation, S, SOURCE, NULL,
           SPHERE("subdivisions = 2; place = { rotation = [0, 0, 0.3]; };"))},
    {MOVES(PLACEMENT, translation, V, SOURCE, NULL,
           BOX("count = 6; place = { translation = [0, 0.01, 0]; };"))},
    {MOVES(PLACEMENT, rotation, V, SOURCE, NULL,
           BOX("count = 6; place = { rotation = [0, 0, 0.3]; };"))},
    {MOVES(PLACEMENT, translation, P, SOURCE, NULL,
           DISC("radius = 0.05; size = 0.01; place = { translation = [0, 0.01, 0]; };"))},
    {MOVES(PLACEMENT, rotation, P, SOURCE, NULL,
           DISC("radius = 0.05; size = 0.01; place = { rotation = [0, 0, 0.3]; };"))},

#define MATERIAL(base, changed) BODY, "material = { " base " };", "material = { " changed " };"
    {MOVES(MATERIAL, spring_stiffness, S,
           MATERIAL(UNIFORM, "spring_stiffness = 70.0; node_mass = 1.0e-3;"))},
    {MOVES(MATERIAL, spring_damping, S, MATERIAL(UNIFORM, UNIFORM "spring_damping = 0.001;"))},
    {MOVES(MATERIAL, node_mass, S,
           MATERIAL(UNIFORM, "spring_stiffness = 60.0; node_mass = 2.0e-3;"))},
    {MOVES(MATERIAL, thickness, S, MATERIAL("", "thickness = 0.004;"))},
    {MOVES(MATERIAL, bending_stiffness, S, MATERIAL("", "bending_stiffness = 1.0e-4;"))},
    {REFUSES(MATERIAL, bending_stiffness, S, BODY,
             "material = { thickness = 0.004; bending_stiffness = 1.0e-4; };",
             "bending_stiffness cannot be mixed with thickness")},
    {MOVES(MATERIAL, node_damping, S, MATERIAL(UNIFORM, UNIFORM "node_damping = 0.01;"))},

#define SHAPED(base, changed) BODY, "shape = { " base " };", "shape = { " changed " };"
    {MOVES(SHAPE, stiffness, S, SHAPED("stiffness = 1.0;", "stiffness = 2.0;"))},
    {MOVES(SHAPE, damping, S, SHAPED("stiffness = 1.0;", "stiffness = 1.0; damping = 0.01;"))},
    {MOVES(SHAPE, damping_direction, S, BODY, "levels = 1; adapt = {}; shape = {};",
           "levels = 1; adapt = {}; shape = { damping_direction = \"radial\"; };")},
    {REFUSES(SHAPE, damping_direction, S, BODY,
             "shape = { frame = \"body\"; damping_direction = \"radial\"; };", "needs frame")},

#define FILLED(base, changed)                                                                      \
    BODY, "integrator = \"leapfrog\"; cavity = { " base " };",                                     \
        "integrator = \"leapfrog\"; cavity = { " changed " };"
    {MOVES(CAVITY, pressure, S, FILLED("", "pressure = 50.0;"))},
    {MOVES(CAVITY, gas, S, FILLED("pressure = 50.0;", "pressure = 50.0; gas = true;"))},
    {MOVES(
        CAVITY, ambient, S,
        FILLED("pressure = 50.0; gas = true;", "pressure = 50.0; gas = true; ambient = 1.0e4;"))},
    {IS_IDLE(CAVITY, ambient, S, BODY, "integrator = \"leapfrog\"; cavity = {};",
             "integrator = \"leapfrog\"; cavity = { ambient = 1.0e4; };", "gas is false")},
    {MOVES(CAVITY, fluid, S, FILLED("pressure = 50.0;", "pressure = 50.0; fluid = true;"))},
    {REFUSES(CAVITY, fluid, S, BODY,
             "integrator = \"leapfrog\"; cavity = { gas = true; fluid = true; };",
             "cannot be mixed with gas")},
    {MOVES(CAVITY, bulk_modulus, S,
           FILLED("pressure = 50.0; fluid = true;",
                  "pressure = 50.0; fluid = true; bulk_modulus = 1.0e4;"))},
    {IS_IDLE(CAVITY, bulk_modulus, S, BODY, "integrator = \"leapfrog\"; cavity = {};",
             "integrator = \"leapfrog\"; cavity = { bulk_modulus = 1.0e4; };", "fluid is false")},
    {MOVES(
         CAVITY, density, S, BODY,
         "integrator = \"leapfrog\"; cuttable = true; cavity = { pressure = 50.0; };",
         "integrator = \"leapfrog\"; cuttable = true; cavity = { pressure = 50.0; density = 50.0; "
         "};"),
     .also = {{TOOLS, BLADE}}},
    {IS_IDLE(CAVITY, density, S, BODY, "integrator = \"leapfrog\"; cavity = {};",
             "integrator = \"leapfrog\"; cavity = { density = 50.0; };", "cuttable is false")},
#define ADAPTS(more) "levels = 2; adapt = { " more " };"
    {REFUSES(MATERIAL, areal_density, S, BODY,
             "integrator = \"implicit\"; material = { areal_density = 1e-25; };",
             "double precision loses the masses")},
    {MOVES(ADAPT, force, S, BODY, ADAPTS("force = 1e6;"), ADAPTS("force = 1e-4;"))},
    {MOVES(ADAPT, speed, S, BODY, ADAPTS("speed = 1e6;"), ADAPTS("speed = 1e-4;"))},
    {MOVES(ADAPT, curvature, S, BODY, ADAPTS("curvature = 1e6;"), ADAPTS("curvature = 1e-3;"))},
    {MOVES(ADAPT, coarsest, S, BODY, ADAPTS("coarsest = 0;"), ADAPTS("coarsest = 1;"))},
    {REFUSES(ADAPT, coarsest, S, BODY, ADAPTS("coarsest = 3;"), "exceeds levels")},
    {MOVES(ADAPT, error, S, BODY, ADAPTS(""), ADAPTS("error = 0.01;"))},
    {REFUSES(ADAPT, coarsest, S, BODY, "start_level = 0; " ADAPTS("coarsest = 1;"),
             "is below adapt.coarsest")},
    {MOVES(ADAPT, check_hz, S, BODY, ADAPTS("check_hz = 1000.0;"), ADAPTS("check_hz = 50.0;"))},

    // --- voxel bodies, solid and plane ---
    {MOVES(VOXELS, file, V, SOURCE, NULL, VOXELS(LIVER))},
    {REFUSES(VOXELS, file, P, SOURCE, VOXELS(LIVER "dimensions = 2;"),
             "dimensions 2 means nothing")},
    {MOVES(VOXELS, label, V, SOURCE, VOXELS(LIVER), VOXELS(LIVER "label = 2;"))},
    {REFUSES(VOXELS, label, V | P, SOURCE, DISC("label = 2;"), "label means nothing")},
    {REFUSES(VOXELS, layer, V, SOURCE, VOXELS(LIVER "layer = 2;"), "layer 2 outside [1, 1]")},
    {REFUSES(VOXELS, layer, V | P, SOURCE, DISC("layer = 1;"), "layer means nothing")},
    {MOVES(VOXELS, mesh, V, SOURCE, NULL, VOXELS("mesh = \"ball.obj\"; size = 0.01;"))},
    {REFUSES(VOXELS, mesh, P, SOURCE, VOXELS("mesh = \"ball.obj\"; size = 0.01; dimensions = 2;"),
             "dimensions 2 means nothing")},
    {MOVES(VOXELS, inner, V, SOURCE, VOXELS(NESTED), VOXELS(NESTED "inner = \"filled\";"))},
    {REFUSES(VOXELS, inner, V | P, SOURCE, DISC("inner = \"filled\";"), "inner means nothing")},
    {MOVES(VOXELS, generator, V, SOURCE, NULL, VOXELS("generator = \"ball\"; size = 0.015;"))},
    {MOVES(VOXELS, generator, P, SOURCE, NULL,
           VOXELS("generator = \"box\"; count = 10; size = 0.01; dimensions = 2;"))},
    {MOVES(VOXELS, count, V, SOURCE, NULL, BOX("count = [6, 5, 6];"))},
    {MOVES(VOXELS, count, P, SOURCE, BOX("dimensions = 2; count = [6, 6];"),
           BOX("dimensions = 2; count = [6, 5];"))},
    {MOVES(VOXELS, radius, V, SOURCE, VOXELS("generator = \"ball\"; size = 0.015;"),
           VOXELS("generator = \"ball\"; size = 0.015; radius = 0.06;"))},
    {MOVES(VOXELS, radius, P, SOURCE, NULL, DISC("radius = 0.04; size = 0.01;"))},
    {MOVES(VOXELS, size, V, SOURCE, NULL, VOXELS("generator = \"box\"; count = 6; size = 0.014;"))},
    {MOVES(VOXELS, size, P, SOURCE, NULL, DISC("radius = 0.05; size = 0.008;"))},
    {MOVES(VOXELS, scale, V, SOURCE, NULL, BOX("count = 6; scale = 0.9;"))},
    {MOVES(VOXELS, scale, V, SOURCE, VOXELS(LIVER), VOXELS(LIVER "scale = 0.9;"))},
    {MOVES(VOXELS, scale, P, SOURCE, NULL, DISC("radius = 0.05; size = 0.01; scale = 0.9;"))},
    {MOVES(VOXELS, place, V, SOURCE, NULL,
           BOX("count = 6; place = { translation = [0, 0.01, 0]; };"))},
    {MOVES(VOXELS, place, P, SOURCE, NULL,
           DISC("radius = 0.05; size = 0.01; place = { translation = [0, 0.01, 0]; };"))},
    {MOVES(VOXELS, dimensions, V, SOURCE, BOX("count = [6, 6, 1];"),
           BOX("count = [6, 6, 1]; dimensions = 2;"))},
    {REFUSES(VOXELS, dimensions, P, SOURCE, DISC("dimensions = 3;"), "a plane body")},

    {REFUSES(MATERIAL, relaxation, S, BODY,
             "integrator = \"rk4\"; material = { relaxation = ( { time = 0.1; share = 0.2; } ); };",
             "relaxation needs integrator \"leapfrog\" or \"symplectic_euler\", not \"rk4\"")},
    {REFUSES(MATERIAL, relaxation, S, BODY,
             "material = { relaxation = ( { time = 0.1; share = 0.6; }, { time = 1.0; share = "
             "0.6; } ); };",
             "add up to 1.2, more than 0.95")},
    {MOVES(MATERIAL, relaxation, S,
           MATERIAL("", "relaxation = ( { time = 0.1; share = 0.2; } );"))},
    {REFUSES(MATERIAL, loss_factor, S, BODY,
             "integrator = \"implicit\"; material = { loss_factor = 0.1; };",
             "loss_factor needs integrator \"leapfrog\" or \"symplectic_euler\", not "
             "\"implicit\"")},
    {REFUSES(MATERIAL, loss_factor, S, BODY,
             "material = { loss_factor = 0.1; relaxation = ( { time = 0.1; share = 0.2; } ); };",
             "cannot be mixed with relaxation")},
    {MOVES(MATERIAL, loss_factor, S, MATERIAL("", "loss_factor = 0.1;"))},

    {MOVES(VOXEL_MATERIAL, poisson_ratio, V | P, MATERIAL("", "poisson_ratio = 0.3;"))},
    {REFUSES(VOXEL_MATERIAL, poisson_ratio, V | P, BODY,
             "law = \"miyazaki2004\"; material = { poisson_ratio = 0.3; };", "knows only 0")},
    {REFUSES(VOXEL_MATERIAL, damping_time, P, BODY, "material = { damping_time = 1e-3; };",
             "means nothing for a plane body")},
    {MOVES(VOXEL_MATERIAL, damping_time, V, MATERIAL("damping = 0.2;", "damping_time = 1e-3;"))},
    {REFUSES(VOXEL_MATERIAL, damping_time, V, BODY,
             "material = { damping = 0.2; damping_time = 1e-3; };",
             "cannot be mixed with damping")},
    {REFUSES(VOXEL_MATERIAL, relaxation, P, BODY,
             "material = { relaxation = ( { time = 0.1; share = 0.2; } ); };",
             "means nothing for a plane body")},
    {REFUSES(
        VOXEL_MATERIAL, relaxation, V, BODY,
        "law = \"miyazaki2004\"; material = { relaxation = ( { time = 0.1; share = 0.2; } ); };",
        "needs law \"affine\"")},
    {REFUSES(
        VOXEL_MATERIAL, relaxation, V, BODY,
        "material = { relaxation = ( { time = 0.1; share = 0.6; }, { time = 1.0; share = 0.6; } "
        "); };",
        "add up to 1.2, more than 0.95")},
    {MOVES(VOXEL_MATERIAL, relaxation, V,
           MATERIAL("drag = 0.0;", "drag = 0.0; relaxation = ( { time = 0.1; share = 0.2; } );"))},
#define STIFFENS(values) "material = { stiffening = { " values " }; };"
    {REFUSES(MATERIAL, stiffening, S, BODY,
             "integrator = \"implicit\"; " STIFFENS("strain = 0.15; cap = 10.0;"),
             "stiffening needs an explicit integrator, not \"implicit\"")},
    {MOVES(MATERIAL, stiffening, S, MATERIAL("", "stiffening = { strain = 0.05; cap = 10.0; };"))},
    {REFUSES(VOXEL_MATERIAL, stiffening, P, BODY, STIFFENS("strain = 0.15; cap = 10.0;"),
             "means nothing for a plane body")},
    {REFUSES(VOXEL_MATERIAL, stiffening, V, BODY,
             "law = \"miyazaki2004\"; " STIFFENS("strain = 0.15; cap = 10.0;"),
             "needs law \"affine\"")},
    {MOVES(VOXEL_MATERIAL, stiffening, V,
           MATERIAL("", "stiffening = { strain = 0.05; cap = 10.0; };"))},
    {MOVES(STIFFENING, strain, S | V, BODY, STIFFENS("strain = 0.05; cap = 10.0;"),
           STIFFENS("strain = 0.08; cap = 10.0;"))},
    {REFUSES(STIFFENING, strain, S | V, BODY, STIFFENS("strain = 0.0; cap = 10.0;"),
             "strain 0 outside (0, 10]")},
    {MOVES(STIFFENING, cap, S | V, BODY, STIFFENS("strain = 0.05; cap = 10.0;"),
           STIFFENS("strain = 0.05; cap = 2.0;"))},
    {REFUSES(STIFFENING, cap, S | V, BODY, STIFFENS("strain = 0.05; cap = 0.5;"),
             "cap 0.5 outside [1, 100]")},
    {REFUSES(VOXEL_MATERIAL, loss_factor, P, BODY, "material = { loss_factor = 0.1; };",
             "means nothing for a plane body")},
    {REFUSES(VOXEL_MATERIAL, loss_factor, V, BODY,
             "material = { loss_factor = 0.1; relaxation = ( { time = 0.1; share = 0.2; } ); };",
             "cannot be mixed with relaxation")},
    {MOVES(VOXEL_MATERIAL, loss_factor, V,
           MATERIAL("drag = 0.0;", "drag = 0.0; loss_factor = 0.1;"))},
#define RELAXES(values) "material = { relaxation = ( { " values " } ); };"
    {MOVES(BRANCH, time, S, BODY, RELAXES("time = 0.1; share = 0.2;"),
           RELAXES("time = 0.2; share = 0.2;"))},
    {MOVES(BRANCH, share, S, BODY, RELAXES("time = 0.1; share = 0.2;"),
           RELAXES("time = 0.1; share = 0.3;"))},
    {REFUSES(BRANCH, volumetric, S, BODY, RELAXES("time = 0.1; share = 0.2; volumetric = true;"),
             "volumetric means nothing for a surface body")},
#define BRANCH(values) "material = { drag = 0.0; relaxation = ( { " values " } ); };"
    {MOVES(BRANCH, time, V, BODY, BRANCH("time = 0.1; share = 0.2;"),
           BRANCH("time = 0.2; share = 0.2;"))},
    {MOVES(BRANCH, share, V, BODY, BRANCH("time = 0.1; share = 0.2;"),
           BRANCH("time = 0.1; share = 0.3;"))},
    {MOVES(BRANCH, volumetric, V, BODY, BRANCH("time = 0.1; share = 0.2;"),
           BRANCH("time = 0.1; share = 0.2; volumetric = true;"))},
    // Without any of these there is drag.
    {MOVES(VOXEL_MATERIAL, drag, V, MATERIAL("", "drag = 0.0;"))},
    {MOVES(VOXEL_MATERIAL, damping, V, MATERIAL("", "damping = 0.2;"))},
#define LABELS(value) "materials = ( { label = 1; " value " } ); "
    {IS_IDLE(VOXEL_MATERIAL, youngs_modulus, V | P, BODY, LABELS("youngs_modulus = 1e4;"),
             LABELS("youngs_modulus = 1e4;") "material = { youngs_modulus = 2e4; };",
             "materials give it")},
    {IS_IDLE(VOXEL_MATERIAL, poisson_ratio, V | P, BODY, LABELS("poisson_ratio = 0.2;"),
             LABELS("poisson_ratio = 0.2;") "material = { poisson_ratio = 0.3; };",
             "materials give it")},
    {IS_IDLE(VOXEL_MATERIAL, density, V | P, BODY, LABELS("density = 1e3;"),
             LABELS("density = 1e3;") "material = { density = 900.0; };", "materials give it")},
#define LABEL(more) "materials = ( { label = 1; " more " } );"
    {REFUSES_FROM(LABEL_MATERIAL, label, V | P, BODY, LABEL(""), "materials = ( { label = 2; } );",
                  "not among those")},
    {MOVES(LABEL_MATERIAL, youngs_modulus, V | P, BODY, LABEL(""), LABEL("youngs_modulus = 2e4;"))},
    {MOVES(LABEL_MATERIAL, poisson_ratio, V | P, BODY, LABEL(""), LABEL("poisson_ratio = 0.3;"))},
    {MOVES(LABEL_MATERIAL, density, V | P, BODY, LABEL(""), LABEL("density = 900.0;"))},
#define TENSION(values) "cuttable = true; material = { " values " };"
    {MOVES(VOXEL_MATERIAL, prestress, V, BODY, TENSION(""), TENSION("prestress = 1000.0;")),
     .also = {{TOOLS, BLADE}}},
    {REFUSES(VOXEL_MATERIAL, prestress, V, BODY, TENSION("prestress = 2001.0;"),
             "prestress 2001 is more than a fifth of youngs_modulus, 2000")},
    {REFUSES(VOXEL_MATERIAL, prestress, V, BODY,
             TENSION("prestress = 1000.0;") "tear = { stress = 1000.0; };",
             "tear.stress 1000 must be more than prestress, 1000")},
    {REFUSES(VOXEL_MATERIAL, prestress, P, BODY, TENSION("prestress = 1000.0;"),
             "prestress means nothing for a plane body")},
    {REFUSES(VOXEL_MATERIAL, prestress_axis, P, BODY, TENSION("prestress_axis = [0, 1, 0];"),
             "prestress_axis means nothing for a plane body")},
    {REFUSES(LABEL_MATERIAL, prestress, P, BODY, LABEL("prestress = 10.0;"),
             "prestress means nothing for a plane body")},
    {REFUSES(LABEL_MATERIAL, prestress_axis, P, BODY, LABEL("prestress_axis = [0, 1, 0];"),
             "prestress_axis means nothing for a plane body")},
    {IS_IDLE(VOXEL_MATERIAL, prestress, V, BODY, "", "material = { prestress = 1000.0; };",
             "cuttable is false")},
    {IS_IDLE(VOXEL_MATERIAL, prestress, V, BODY, "cuttable = true; " LABELS("prestress = 1000.0;"),
             TENSION("prestress = 900.0;") LABELS("prestress = 1000.0;"), "materials give it")},
    {MOVES(VOXEL_MATERIAL, prestress_axis, V, BODY, TENSION("prestress = 1000.0;"),
           TENSION("prestress = 1000.0; prestress_axis = [0, 1, 0];")),
     .also = {{TOOLS, BLADE}}},
    {IS_IDLE(VOXEL_MATERIAL, prestress_axis, V, BODY, TENSION(""),
             TENSION("prestress_axis = [0, 1, 0];"), "prestress is 0")},
    {REFUSES(VOXEL_MATERIAL, prestress_axis, V, BODY,
             TENSION("prestress = 1000.0; prestress_axis = [0, 0, 0];"), "prestress_axis")},
    {MOVES(LABEL_MATERIAL, prestress, V, BODY, "cuttable = true; " LABEL(""),
           "cuttable = true; " LABEL("prestress = 1000.0;")),
     .also = {{TOOLS, BLADE}}},
    {REFUSES(LABEL_MATERIAL, prestress, V, BODY, LABEL("youngs_modulus = 1e3; prestress = 1000.0;"),
             "more than a fifth")},
    {IS_IDLE(LABEL_MATERIAL, prestress, V, BODY, LABEL(""), LABEL("prestress = 1000.0;"),
             "cuttable is false")},
    {MOVES(LABEL_MATERIAL, prestress_axis, V, BODY, TENSION("prestress = 1000.0;") LABEL(""),
           TENSION("prestress = 1000.0;") LABEL("prestress_axis = [0, 1, 0];")),
     .also = {{TOOLS, BLADE}}},
    {IN(LABEL_MATERIAL, color, V | P, PLAN, BODY, LABEL(""), LABEL("color = [0.2, 0.4, 0.6];"))},
    {IN(LABEL_MATERIAL, inside, V | P, PLAN, BODY, LABEL(""), LABEL("inside = [0.2, 0.4, 0.6];"))},
#define LOOKS(more) "look = { " more " };"
#define PICTURE     "image = \"" LIVER_FILE "\"; "
    {IN(BODY, look, ALL, STREAM, BODY, "", LOOKS("color = [0.2, 0.4, 0.6];"))},
    {IN(LOOK, color, ALL, PLAN, BODY, LOOKS(""), LOOKS("color = [0.2, 0.4, 0.6];"))},
    {IN(LOOK, inside, ALL, PLAN, BODY, LOOKS(""), LOOKS("inside = [0.2, 0.4, 0.6];"))},
    {IN(LOOK, texture, ALL, PLAN, BODY, LOOKS(""), LOOKS("texture = \"skin.png\";"))},
    {IN(LOOK, image, V, PLAN, BODY, LOOKS(""), LOOKS(PICTURE)), .also = {{SOURCE, VOXELS(LIVER)}}},
    {IN(LOOK, black, V, PLAN, BODY, LOOKS(PICTURE "black = 0.0; white = 9.0;"),
        LOOKS(PICTURE "black = 1.0; white = 9.0;")),
     .also = {{SOURCE, VOXELS(LIVER)}}},
    {IN(LOOK, white, V, PLAN, BODY, LOOKS(PICTURE "black = 0.0; white = 9.0;"),
        LOOKS(PICTURE "black = 0.0; white = 8.0;")),
     .also = {{SOURCE, VOXELS(LIVER)}}},
    {REFUSES(LOOK, image, S, BODY, LOOKS(PICTURE), "means nothing for a surface body")},
    {REFUSES(LOOK, black, S, BODY, LOOKS("black = 1.0;"), "means nothing for a surface body")},
    {REFUSES(LOOK, white, S, BODY, LOOKS("white = 1.0;"), "means nothing for a surface body")},
    {REFUSES(LOOK, image, P, BODY, LOOKS(PICTURE), "image means nothing")},
    {REFUSES(LOOK, black, P, BODY, LOOKS("black = 1.0;"), "need an image")},
    {REFUSES(LOOK, white, P, BODY, LOOKS("white = 1.0;"), "need an image")},
#define SKIN(more) "skin = { " more " };"
    {IN(SKIN, mesh, V, SHOWN, BODY, SKIN("mesh = \"ball.obj\";"), SKIN("mesh = \"finer.obj\";"))},
    {IN(SKIN, scale, V, SHOWN, BODY, SKIN("mesh = \"ball.obj\";"),
        SKIN("mesh = \"ball.obj\"; scale = 0.9;"))},
    {IN(SKIN, place, V, SHOWN, BODY, SKIN("mesh = \"ball.obj\";"),
        SKIN("mesh = \"ball.obj\"; place = { rotation = [0, 0, 0.3]; };"))},

    // --- tools, loads and attachments ---
    {IN(TOOL, id, ALL, STREAM, TOOLS, PROBE(""),
        "tools = ( " TOOL("7", "probe", ONE_CAPSULE) " );")},
    {MOVES(TOOL, kind, ALL, TOOLS, PROBE(""), GRASPER(""))},
    {MOVES(TOOL, capsules, ALL, TOOLS, PROBE(""),
           "tools = ( " TOOL("1", "probe", "capsules = ( { radius = 0.02; } );") " );")},
    {MOVES(TOOL, plane, ALL, TOOLS, "", TABLE("point = [0, -0.03, 0]; normal = [0, 1, 0];"))},
    {MOVES(TOOL, max_force, ALL, TOOLS, PROBE(""), PROBE("max_force = 0.01;"))},
    {MOVES(TOOL, max_force, ALL, TOOLS, GRASPER(""), GRASPER("max_force = 0.01;"))},
    {MOVES(TOOL, friction, ALL, TOOLS, PROBE(""), PROBE("friction = 0.9;"))},
    {MOVES(TOOL, lag, ALL, TOOLS, PROBE(""), PROBE("lag = 0.02;"))},
    {MOVES(TOOL, fastest, ALL, TOOLS, PROBE(""), PROBE("fastest = 1e-3;"))},
#define EDGED(more)                                                                                \
    "tools = ( " TOOL("2", "blade", "edge = ([0.0, 0.0, -0.1], [0.0, 0.0, 0.1]); " more) " );"
    {IS_IDLE(TOOL, max_force, ALL, TOOLS, EDGED(""), EDGED("max_force = 0.01;"),
             "it has no capsules"),
     .also = {{BODY, "cuttable = true;"}}},
    {IS_IDLE(TOOL, friction, ALL, TOOLS, EDGED(""), EDGED("friction = 0.9;"), "it has no capsules"),
     .also = {{BODY, "cuttable = true;"}}},
    {MOVES(TOOL, grip_stiffness, ALL, TOOLS, GRASPER(""), GRASPER("grip_stiffness = 0.1;"))},
    {MOVES(TOOL, grip_damping_ratio, ALL, TOOLS, GRASPER(""),
           GRASPER("grip_damping_ratio = 0.1;"))},
    {MOVES(TOOL, edge, ALL, TOOLS, BLADE,
           "tools = ( " TOOL("2", "blade", "edge = ([0.0, 0.0, -0.1], [0.03, 0.0, 0.1]);") " );"),
     .also = {{BODY, "cuttable = true;"}}},
#define TAKING(by, mouth)                                                                          \
    "tools = ( " TOOL("5", "remover", "removes_by = \"" by "\"; mouth = { " mouth " };") " );"
#define TAKEN(by, more)                                                                            \
    "tools = ( " TOOL("5", "remover",                                                              \
                      "removes_by = \"" by "\"; mouth = { radius = 0.02; };" more) " );"
    {MOVES(TOOL, removes_by, V, TOOLS, TAKEN("suction", ""), TAKEN("drill", "")),
     .also = {{BODY, "cuttable = true;"}}},
    {MOVES(TOOL, mouth, V, TOOLS, TAKEN("drill", ""), TAKING("drill", "radius = 0.03;")),
     .also = {{BODY, "cuttable = true;"}}},
    {MOVES(TOOL, rate_mm3_s, V, TOOLS, TAKEN("suction", "rate_mm3_s = 1e5;"),
           TAKEN("suction", "rate_mm3_s = 9e5;")),
     .also = {{BODY, "cuttable = true;"}}},
    {REFUSES_FROM(TOOL, removes_by, ALL, TOOLS, TAKING("suction", "radius = 0.02;"),
                  "tools = ( " TOOL("5", "remover", "mouth = { radius = 0.02; };") " );",
                  "does not say how it removes tissue")},
    {REFUSES_FROM(TOOL, mouth, ALL, TOOLS, TAKING("suction", "radius = 0.02;"),
                  "tools = ( " TOOL("5", "remover", "removes_by = \"suction\";") " );",
                  "remover 5 has no mouth")},
    {REFUSES_FROM(TOOL, rate_mm3_s, ALL, TOOLS, TAKING("drill", "radius = 0.02;"),
                  "tools = ( " TOOL("5", "remover",
                                    "removes_by = \"diathermy\"; rate_mm3_s = 5; mouth "
                                    "= { radius = 0.02; };") " );",
                  "rate_mm3_s means nothing for a remover by diathermy")},
    {MOVES(TOOL, power, V, TOOLS, BURNING("30"), BURNING("60")),
     .also = {{BODY, "cuttable = true;"}}},
    {REFUSES_FROM(TOOL, power, ALL, TOOLS, PROBE(""), PROBE("power = 5;"),
                  "power means something for a remover only")},
    {MOVES(CAPSULE, from, ALL, TOOLS, PROBE(""),
           "tools = ( " TOOL("1", "probe",
                             "capsules = ( { radius = 0.01; from = [0.01, 0, 0]; } );") " );")},
    {MOVES(CAPSULE, to, ALL, TOOLS, PROBE(""),
           "tools = ( " TOOL("1", "probe",
                             "capsules = ( { radius = 0.01; to = [0.01, 0, 0]; } );") " );")},
    {MOVES(CAPSULE, radius, ALL, TOOLS, PROBE(""),
           "tools = ( " TOOL("1", "probe", "capsules = ( { radius = 0.02; } );") " );")},
    {MOVES(PLANE, point, ALL, TOOLS, TABLE("point = [0, -0.03, 0]; normal = [0, 1, 0];"),
           TABLE("point = [0, -0.035, 0]; normal = [0, 1, 0];"))},
    {MOVES(PLANE, normal, ALL, TOOLS, TABLE("point = [0, -0.03, 0]; normal = [0, 1, 0];"),
           TABLE("point = [0, -0.03, 0]; normal = [0.1, 1, 0];"))},

    {MOVES(LOAD, body, ALL, LOADS, LOAD(PUSH "body = \"a\";"), LOAD(PUSH "body = \"b\";")),
     .also = {{OTHER, SECOND}}},
    {MOVES(LOAD, center, ALL, LOADS, LOAD(PUSH),
           LOAD("center = [0.0, -0.04, 0.0]; radius = 0.03; force = [0.5, 0.0, 0.0]; duration = "
                "0.04;"))},
    {MOVES(LOAD, radius, ALL, LOADS, LOAD(PUSH),
           LOAD("center = [0.0, 0.04, 0.0]; radius = 0.05; force = [0.5, 0.0, 0.0]; duration = "
                "0.04;"))},
    {MOVES(LOAD, force, ALL, LOADS, LOAD(PUSH),
           LOAD("center = [0.0, 0.04, 0.0]; radius = 0.03; force = [0.4, 0.0, 0.0]; duration = "
                "0.04;"))},
    {MOVES(LOAD, start, ALL, LOADS, LOAD(PUSH), LOAD(PUSH "start = 0.01;"))},
    {MOVES(LOAD, duration, ALL, LOADS, LOAD(PUSH),
           LOAD("center = [0.0, 0.04, 0.0]; radius = 0.03; force = [0.5, 0.0, 0.0]; duration = "
                "0.03;"))},

#define TO_WORLD "to = \"world\"; "
    {MOVES(ATTACHMENT, body, ALL, ATTACH, HELD(HELD_AT TO_WORLD),
           HELD("body = \"b\"; sphere = [0.0, 0.1, 0.0]; radius = 0.05; " TO_WORLD)),
     .also = {{OTHER, SECOND}}},
    {MOVES(ATTACHMENT, box, ALL, ATTACH,
           HELD("body = \"a\"; box = ([-1, 0.03, -1], [1, 1, 1]); " TO_WORLD),
           HELD("body = \"a\"; box = ([-1, -1, -1], [1, -0.03, 1]); " TO_WORLD))},
    {MOVES(ATTACHMENT, sphere, ALL, ATTACH, HELD(HELD_AT TO_WORLD),
           HELD("body = \"a\"; sphere = [0.0, -0.045, 0.0]; radius = 0.03; " TO_WORLD))},
    {MOVES(ATTACHMENT, radius, ALL, ATTACH, HELD(HELD_AT TO_WORLD),
           HELD("body = \"a\"; sphere = [0.0, 0.045, 0.0]; radius = 0.05; " TO_WORLD))},
    {MOVES(ATTACHMENT, nodes, S | V, ATTACH, "", HELD("body = \"a\"; nodes = [ 0 ]; " TO_WORLD))},
    {MOVES(ATTACHMENT, nodes, P, ATTACH, "", HELD("body = \"a\"; nodes = [ 5 ]; " TO_WORLD))},
    {MOVES(ATTACHMENT, to, ALL, ATTACH, HELD(HELD_AT "tool = 1;"), HELD(HELD_AT TO_WORLD))},
    {MOVES(ATTACHMENT, tool, ALL, ATTACH, HELD(HELD_AT TO_WORLD), HELD(HELD_AT "tool = 1;"))},
    {MOVES(ATTACHMENT, to_body, ALL, ATTACH, HELD(HELD_AT TO_WORLD),
           HELD(HELD_AT "to_body = \"b\";")),
     .also = {{OTHER, SECOND}}},
    {MOVES(ATTACHMENT, stiffness, ALL, ATTACH, HELD(HELD_AT TO_WORLD),
           HELD(HELD_AT TO_WORLD "stiffness = 0.1;"))},
    {MOVES(ATTACHMENT, damping_ratio, ALL, ATTACH, HELD(HELD_AT TO_WORLD),
           HELD(HELD_AT TO_WORLD "damping_ratio = 0.1;"))},

    {MOVES(TOUCH, bodies, S | V, ATTACH, TOUCHES("bodies = [\"a\"]; "), TOUCHES(TWO)),
     .also = {{OTHER, BESIDE}, {LOADS, ONTO}}},
    {MOVES(TOUCH, stiffness, S | V, ATTACH, TOUCHES(TWO), TOUCHES(TWO "stiffness = 1.0;")),
     .also = {{OTHER, BESIDE}, {LOADS, ONTO}}},
    {MOVES(TOUCH, friction, S | V, ATTACH, TOUCHES(TWO), TOUCHES(TWO "friction = 0.5;")),
     .also = {{OTHER, BESIDE}, {LOADS, ONTO}}},
    {MOVES(TOUCH, thickness, S | V, ATTACH, TOUCHES(TWO), TOUCHES(TWO "thickness = 0.002;")),
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
        {&LEVELS_TABLE, V},
        {&FINE_TABLE, V},
        {&VOXEL_ADAPT_TABLE, V},
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
