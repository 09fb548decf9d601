// SPDX-License-Identifier: MIT
// The rows of the matrix.
#include "matrix.h"

// What a case changes of the scene of each model.
#define EVERYWHERE(key, text)                                                                      \
    .surface = {{key, text}}, .voxel = {{key, text}}, .plane = {{key, text}}
#define SOLIDS(text) .voxel = {{"material", text}}, .plane = {{"material", text}}
#define UNIFORM(k)                                                                                 \
    .surface = {{"material", "{ spring_stiffness = " k ";  node_mass = 3.0e-3;  "                  \
                             "spring_damping = 1.0e-3; }"}}
#define YOUNG(e) SOLIDS("{ youngs_modulus = " e ";  density = 1000.0;  damping = 0.2; }")
#define POISSON(nu)                                                                                \
    SOLIDS("{ youngs_modulus = 1.0e4;  poisson_ratio = " nu ";  density = 1000.0;  "               \
           "damping = 0.2; }"),                                                                    \
        .not_surface = true
#define WALL_DAMPED(time, more, ratio)                                                             \
    .surface = {{"material",                                                                       \
                 "{ youngs_modulus_2d = 80.0;  areal_density = 4.2;  damping_time = " time         \
                 ";  " more " }"},                                                                 \
                {"shape", "{ angular_frequency = 50.0;  damping_ratio = " ratio "; }"}}
#define DAMPED(share) SOLIDS("{ youngs_modulus = 1.0e4;  density = 1000.0;  damping = " share "; }")
#define MESH(file)    "mesh", "{ file = \"" file "\"; }"
#define ALL_FIXED     EVERYWHERE("fixed", "( { box = ([-9.0, -9.0, -9.0], [9.0, 9.0, 9.0]); } )")
#define CUTTABLE      EVERYWHERE("cuttable", "true")
#define SURFACE_ALONE .not_voxel = true, .not_plane = true
#define LOADED(force) .drive = DRIVE_LOAD, .value = force
#define PRESSED       .drive = DRIVE_PRESS, .value = 1.0
#define ONE_CELL      "{ generator = \"box\";  count = 1;  size = 0.05; }"
#define ONE_SQUARE    "{ generator = \"box\";  count = [1, 1];  size = 0.05; }"
#define WALL(more)                                                                                 \
    {                                                                                              \
        "material",                                                                                \
            "{ youngs_modulus_2d = 80.0;  areal_density = 4.2;  damping_time = 2.0e-4;  " more     \
            " }"                                                                                   \
    }
#define SOLID(more)                                                                                \
    {                                                                                              \
        "material", "{ youngs_modulus = 1.0e4;  density = 1000.0;  damping = 0.2;  " more " }"     \
    }
#define MATERIAL(more) .surface = {WALL(more)}, .voxel = {SOLID(more)}, .not_plane = true
#define STIFFENS       "stiffening = { strain = 0.05;  cap = 100.0; };"
#define RELAXES                                                                                    \
    "relaxation = ( { time = 1.0e-6;  share = 0.3; }, { time = 1.0e-4;  share = 0.3; }, "          \
    "{ time = 1.0e-2;  share = 0.35; } );"
#define ENCLOSES(what) .surface = {{"cavity", "{ " what " }"}}, SURFACE_ALONE
#define RUBS           EVERYWHERE("contact", "{ friction = 10.0; }")
#define ROUND                                                                                      \
    {"voxels", "{ mesh = \"graded3.off\";  scale = 0.5;  size = 0.008; }"},                        \
        {"surface", "\"fitted\""},                                                                 \
    {                                                                                              \
        "fixed", "( { box = ([-1.0, -1.0, -1.0], [1.0, 1.0, -0.0124]); } )"                        \
    }
// A rigid sheet at a distance along x, against which the body is pushed.
#define BOARD(x)                                                                                   \
    LOADED(10.0),                                                                                  \
        .scene = TOUCHES("\"body\", \"board\""),                                                   \
        .beside = ", { name = \"board\";  mesh = { generator = \"sheet\";  columns = 6;  "         \
                  "rows = 6;  width = 0.2;  height = 0.2;  place = { translation = [" x            \
                  ", 0.0, 0.0];  rotation = [0.0, 1.5707963, 0.0]; }; };  "                        \
                  "fixed = ( { box = ([-9.0, -9.0, -9.0], [9.0, 9.0, 9.0]); } ); }"
#define TOUCHES(who) "touch = ( { bodies = [" who "];  stiffness = 10.0; } );\n"

// Ticks [1/s] so long that soft ones come to rest.
#define STIFFNESS(k, rate)                                                                         \
    .name = "stiffness " k, LOADED(1.0), .rate_hz = (rate), UNIFORM(k), YOUNG(k)

const Case CASES[] = {
    // [N/m] of every spring, [Pa] of an element.
    {STIFFNESS("1.0e1", 50.0), .quick = true},
    {STIFFNESS("1.0e2", 120.0)},
    {STIFFNESS("1.0e3", 1000.0)},
    {STIFFNESS("1.0e4", 1000.0), .quick = true},
    {STIFFNESS("1.0e5", 1000.0)},
    {STIFFNESS("1.0e6", 1000.0), .quick = true},
    {STIFFNESS("1.0e7", 1000.0)},
    {STIFFNESS("1.0e8", 1000.0)},
    {STIFFNESS("1.0e9", 1000.0)},

    {.name = "node masses 1 : 1e3",
     LOADED(1.0),
     .quick = true,
     .surface = {{MESH("graded3.off")}},
     .voxel = {{"voxels", "{ file = \"labels.nrrd\";  label = [1, 2]; }"},
               {"materials", "( { label = 2;  density = 1.0; } )"}},
     .not_plane = true},
    {.name = "node masses 1 : 1e6",
     LOADED(1.0),
     .surface = {{MESH("graded6.off")}, {"levels", "1"}},
     .voxel = {{"voxels", "{ file = \"labels.nrrd\";  label = [1, 2]; }"},
               {"material", "{ youngs_modulus = 1.0e4;  density = 1.0e4;  damping = 0.2; }"},
               {"materials", "( { label = 2;  density = 0.01; } )"}},
     .not_plane = true},

    {.name = "no damping",
     LOADED(0.1),
     .undamped = true,
     .quick = true,
     WALL_DAMPED("0.0", "", "0.0"),
     DAMPED("0.0")},
    {.name = "light damping", LOADED(0.1), WALL_DAMPED("1.0e-5", "", "0.05"), DAMPED("0.05")},
    {.name = "critical damping", LOADED(0.1), WALL_DAMPED("1.0e-2", "", "1.0"), DAMPED("1.0")},
    {.name = "overdamped",
     LOADED(0.1),
     .quick = true,
     WALL_DAMPED("10.0", "", "100.0"),
     DAMPED("10.0")},
    {.name = "drag of 0.1 N s/m a node",
     LOADED(1.0),
     WALL_DAMPED("2.0e-4", "node_damping = 0.1;", "0.3"),
     SURFACE_ALONE},
    {.name = "drag of 1e6 N s/m a node",
     LOADED(1.0),
     .quick = true,
     WALL_DAMPED("2.0e-4", "node_damping = 1.0e6;", "0.3"),
     SURFACE_ALONE},

    {.name = "time step 0.5 of the bound", .drive = DRIVE_STEP, .value = 0.5},
    {.name = "time step 0.8 of the bound", .drive = DRIVE_STEP, .value = 0.8},
    {.name = "time step 1.0 of the bound", .drive = DRIVE_STEP, .value = 0.99999, .quick = true},
    {.name = "time step 1.1 of the bound", .drive = DRIVE_STEP, .value = 1.1, .quick = true},
    {.name = "time step 1.1 of the bound, unsafe", .drive = DRIVE_BIG_STEP, .value = 1.1},
    {.name = "time step 1.2 of the bound, unsafe",
     .drive = DRIVE_BIG_STEP,
     .value = 1.2,
     .quick = true},
    {.name = "time step 2.5 of the bound, unsafe",
     .drive = DRIVE_BIG_STEP,
     .value = 2.5,
     .quick = true},

    {.name = "starts flattened", .start = START_FLAT, .quick = true},
    {.name = "starts inside out", .start = START_MIRRORED, .quick = true},
    {.name = "starts in one point", .start = START_POINT, .quick = true},
    {.name = "starts at random", .start = START_RANDOM, .quick = true},

    {.name = "Poisson ratio 0.3", LOADED(0.1), POISSON("0.3")},
    {.name = "Poisson ratio 0.45", LOADED(0.1), POISSON("0.45")},
    {.name = "Poisson ratio 0.49", LOADED(0.1), .quick = true, POISSON("0.49")},

    {.name = "springs without length",
     LOADED(1.0),
     .quick = true,
     .surface = {{MESH("twins.off")}},
     SURFACE_ALONE},
    {.name = "springs of 1 nm",
     LOADED(1.0),
     .surface = {{MESH("near.off")}, {"levels", "1"}},
     SURFACE_ALONE},
    {.name = "springs of 1 nm, uniform",
     LOADED(1.0),
     .surface = {{MESH("near.off")},
                 {"levels", "1"},
                 {"material", "{ spring_stiffness = 80.0;  node_mass = 3.0e-3; }"}},
     SURFACE_ALONE},
    {.name = "rest lengths shortened by 0.9",
     LOADED(1.0),
     .surface = {{"prestress", "0.9"}},
     SURFACE_ALONE},
    {.name = "cells of 1 um",
     LOADED(1.0e-6),
     .not_surface = true,
     .voxel = {{"voxels", "{ generator = \"box\";  count = 4;  size = 1.0e-6; }"},
               {"fixed", "( { box = ([-1.0, -1.0, -1.0], [1.0, 1.0, -1.9e-6]); } )"}},
     .plane = {{"voxels", "{ generator = \"disc\";  radius = 4.0e-6;  size = 1.0e-6; }"},
               {"fixed", "( { box = ([-1.0, -1.0, -1.0], [1.0, -2.9e-6, 1.0]); } )"}}},

    {.name = "tool at 100 m/s, 3.3 N", .drive = DRIVE_TOOL_FAST, .value = 3.3, .quick = true},
    {.name = "tool at 100 m/s, 1e6 N", .drive = DRIVE_TOOL_FAST, .value = 1.0e6, .quick = true},
    {.name = "tool in the outside for 0.1 s, 3.3 N", .drive = DRIVE_TOOL_IN, .value = 3.3},
    {.name = "tool in the outside for 0.1 s, 1e6 N",
     .drive = DRIVE_TOOL_IN,
     .value = 1.0e6,
     .quick = true},
    {.name = "tool left in the outside", .drive = DRIVE_TOOL_WALL, .quick = true},
    {.name = "tool left inside", .drive = DRIVE_TOOL_STAY, .value = 0.0, .quick = true},

    {.name = "1e3 N for 0.1 s", LOADED(1.0e3)},
    {.name = "1e6 N for 0.1 s", LOADED(1.0e6), .quick = true},

    {.name = "cut", .drive = DRIVE_CUT, CUTTABLE},
    {.name = "cut while inside out",
     .start = START_MIRRORED,
     .drive = DRIVE_CUT,
     .quick = true,
     CUTTABLE},
    {.name = "cut while in one point", .start = START_POINT, .drive = DRIVE_CUT, CUTTABLE},
    {.name = "cut while at random", .start = START_RANDOM, .drive = DRIVE_CUT, CUTTABLE},
    {.name = "everything cut away", .drive = DRIVE_CUT_ALL, .value = 1.0, .quick = true, CUTTABLE},

    {.name = "all nodes fixed", LOADED(1.0), .quick = true, ALL_FIXED},
    {.name = "one element",
     LOADED(0.1),
     .quick = true,
     .surface = {{MESH("triangle.off")}},
     .voxel = {{"voxels", ONE_CELL}},
     .plane = {{"voxels", ONE_SQUARE},
               {"fixed", "( { box = ([-1.0, -1.0, -1.0], [1.0, -0.0249, 1.0]); } )"}}},
    {.name = "no element",
     LOADED(1.0),
     .quick = true,
     .surface = {{MESH("nothing.off")}},
     .voxel = {{"voxels", "{ generator = \"ball\";  radius = 1.0e-4;  size = 0.01; }"}},
     .plane = {{"voxels", "{ generator = \"disc\";  radius = 1.0e-4;  size = 0.01; }"}}},

    // Behind the others, so that the test's share of these stays.
    {.name = "pressed by one radius and held", .drive = DRIVE_PRESS, .value = 1.0, .quick = true},
    {.name = "pressed by two radii and held", .drive = DRIVE_PRESS, .value = 2.0, .quick = true},

    {.name = "pressure 1 kPa, pressed", PRESSED, ENCLOSES("pressure = 1.0e3;")},
    {.name = "gas, pressed", PRESSED, ENCLOSES("gas = true;")},
    {.name = "fluid of 1 MPa, pressed", PRESSED, ENCLOSES("fluid = true;  bulk_modulus = 1.0e6;")},
    {.name = "stiffening 100 times", LOADED(1.0e3), .quick = true, MATERIAL(STIFFENS)},
    {.name = "relaxation of 95 %", LOADED(1.0), .quick = true, MATERIAL(RELAXES)},
    {.name = "bending of a wall of 2 cm",
     LOADED(1.0e3),
     .surface = {WALL("thickness = 0.02;")},
     SURFACE_ALONE},
    {.name = "touches itself, starts flattened",
     .start = START_FLAT,
     .scene = TOUCHES("\"body\""),
     .quick = true,
     .not_plane = true},
    {.name = "touches itself, cut",
     .drive = DRIVE_CUT,
     CUTTABLE,
     .scene = TOUCHES("\"body\""),
     .not_plane = true},
    {.name = "pushed against a board", BOARD("0.052"), SURFACE_ALONE},
    {.name = "pushed against a board", BOARD("0.026"), .not_surface = true, .not_plane = true},
    {.name = "attached, 10 times as stiff",
     LOADED(1.0),
     .quick = true,
     .scene = "attachments = ( { body = \"body\";  box = ([-9.0, -9.0, -9.0], [9.0, 9.0, 9.0]);  "
              "to = \"world\";  stiffness = 10.0; } );\n"},
    {.name = "pinned, 1e3 N", .drive = DRIVE_TIE, .value = 1.0e3, .scene = "max_ties = 1;\n"},
    {.name = "friction 10, pressed", PRESSED, RUBS},
    {.name = "friction 10, tool at 100 m/s, 1e6 N",
     .drive = DRIVE_TOOL_FAST,
     .value = 1.0e6,
     .quick = true,
     RUBS},
    {.name = "gravity of 1e3 m/s2", .quick = true, .scene = "gravity = [0.0, -707.0, -707.0];\n"},
    {.name = "grasped and pulled, 3.3 N", .drive = DRIVE_GRASP, .value = 3.3},
    {.name = "grasped and pulled, 1e6 N", .drive = DRIVE_GRASP, .value = 1.0e6, .quick = true},
    {.name = "strokes of a blade at 10 m/s",
     .drive = DRIVE_STROKE,
     .value = 10.0,
     .quick = true,
     CUTTABLE},
    {.name = "fitted surface, pressed",
     PRESSED,
     .not_surface = true,
     .voxel = {ROUND},
     .not_plane = true},
    {.name = "fitted surface, cut at random",
     .start = START_RANDOM,
     .drive = DRIVE_CUT,
     .not_surface = true,
     .voxel = {ROUND, {"cuttable", "true"}},
     .not_plane = true},
    {.name = "free, starts at random",
     .start = START_RANDOM,
     .quick = true,
     .surface = {{"shape",
                  "{ angular_frequency = 50.0;  damping_ratio = 0.3;  frame = \"body\"; }"}},
     .voxel = {{"fixed", NULL}},
     .plane = {{"fixed", NULL}}},
};
const int CASE_COUNT = (int)(sizeof CASES / sizeof *CASES);

bool case_concerns(const Case *at, const Model *model)
{
    switch (model->kind) {
    case KIND_SURFACE:
        return !at->not_surface;
    case KIND_VOXEL:
        return !at->not_voxel;
    default:
        return !at->not_plane;
    }
}

const Key *case_keys(const Case *at, const Model *model)
{
    switch (model->kind) {
    case KIND_SURFACE:
        return at->surface;
    case KIND_VOXEL:
        return at->voxel;
    default:
        return at->plane;
    }
}
