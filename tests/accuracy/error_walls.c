// SPDX-License-Identifier: MIT
// pliant-error-walls CONFIG [NAME...]: estimated and true errors of walls (BodyOps.estimate), a
// line for each scene, for the scenes whose names contain a NAME. CONFIG: the folder of the shipped
// scenes. The truth is the same body refined once more everywhere, under the same loads and the
// same ways of tools. The scenes marked "fit" and those marked "test" are rated apart: either half
// asks for the same factor (errors.md).
#include "run.h"
#include "scoped.h"

#include "base/check.h"
#include "scene/build.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

typedef struct Case {
    const char *name;
    const char *mesh;     // of level 0; NULL: the gallbladder of the shipped scene
    int level;            // held at this level
    int adapts;           // finest level if it adapts, else 0
    const char *material; // further keys
    const char *body;     // further keys of the body
    const char *tail;     // loads and others
    double radius;        // of the tool; 0: none
    Vec3 way[3];          // of the tool: from here, pressed to there in 0.3 s, dragged to there
    Vec3 other[2];        // of a second tool: from here to there
    double seconds;
    bool later; // had no part in any choice
    bool cuts;
    Vec3 cut[4]; // before, after
} Case;

#define SPHERE   "generator = \"sphere\"; nodes = 114; radius = 0.05;"
#define SPHERE2  "generator = \"ico_sphere\"; nodes = 162; radius = 0.05;"
#define SHEET    "generator = \"sheet\"; columns = 11; rows = 11; width = 0.2; height = 0.2;"
#define STOMACH  "generator = \"stomach\"; nodes = 188; length = 0.25;"
#define TUBE     "file = \"tube.off\";"
#define SOFT     "youngs_modulus_2d = 80.0; areal_density = 4.2; damping_time = 2.0e-4;"
#define BENDS    SOFT " thickness = 0.004;"
#define CALM     "shape = { angular_frequency = 50.0; damping_ratio = 1.0; };"
#define WEAK     "shape = { angular_frequency = 15.0; damping_ratio = 2.0; };"
#define HELD_LOW "fixed = ( { box = ([-1.0, -1.0, -1.0], [1.0, 1.0, -0.035]); } );"
#define HELD_SIDES                                                                                 \
    "fixed = ( { box = ([-1.0, -1.0, -1.0], [-0.0999, 1.0, 1.0]); },"                              \
    " { box = ([0.0999, -1.0, -1.0], [1.0, 1.0, 1.0]); } );"
#define HELD_ENDS                                                                                  \
    "fixed = ( { box = ([-1.0, -1.0, -1.0], [-0.0699, 1.0, 1.0]); },"                              \
    " { box = ([0.0699, -1.0, -1.0], [1.0, 1.0, 1.0]); } );"
#define HELD_HEAD "fixed = ( { box = ([0.05, -1.0, -1.0], [1.0, 1.0, 1.0]); } );"
// Loads of several radii: a pressure without a jump at its border.
#define ONE(x, y, z, r, fx, fy, fz)                                                                \
    "{ center = [" #x ", " #y ", " #z "]; radius = " #r "; force = [" #fx ", " #fy ", " #fz        \
    "]; duration = 10.0; }"
#define LOAD(x, y, z, fx, fy, fz)                                                                  \
    "loads = (" ONE(x, y, z, 0.03, fx, fy, fz) "," ONE(x, y, z, 0.025, fx, fy,                     \
                                                       fz) "," ONE(x, y, z, 0.02, fx, fy, fz) ");"
#define TOP_LOAD(f) LOAD(0.0, 0.0, 0.05, 0.0, 0.0, f)

static const Case CASES[] = {
    {"sphere pressed 0.2 N", SPHERE, 0, 0, BENDS, CALM, TOP_LOAD(-0.067), .seconds = 0.8},
    {"sphere pressed 0.5 N", SPHERE, 0, 0, BENDS, CALM, TOP_LOAD(-0.167), .seconds = 0.8},
    {"sphere pulled 0.3 N", SPHERE, 0, 0, BENDS, CALM, TOP_LOAD(0.1), .seconds = 0.8},
    {"sphere level 1", SPHERE, 1, 0, BENDS, CALM, TOP_LOAD(-0.167), .seconds = 0.8},
    {"sphere adapts to 1", SPHERE, 0, 1, BENDS, CALM, TOP_LOAD(-0.167), .seconds = 0.8},
    {"sphere adapts to 2", SPHERE, 0, 2, BENDS, CALM, TOP_LOAD(-0.167), .seconds = 0.8},
    {"sphere thin", SPHERE, 0, 0, SOFT, CALM, TOP_LOAD(-0.067), .seconds = 0.8},
    {"sphere thin pulled", SPHERE, 0, 0, SOFT, CALM, TOP_LOAD(0.1), .seconds = 0.8},
    {"ball sags", SPHERE2, 0, 0, BENDS, WEAK HELD_LOW, "gravity = [0.0, 0.0, -9.81];",
     .seconds = 1.2},
    {"ball sags, level 1", SPHERE2, 1, 0, BENDS, WEAK HELD_LOW, "gravity = [0.0, 0.0, -9.81];",
     .seconds = 1.2},
    {"ball probed", SPHERE2, 0, 0, BENDS, CALM HELD_LOW, "", .radius = 0.012,
     .way = {{0.0, 0.0, 0.0625}, {0.0, 0.0, 0.052}, {0.0, 0.0, 0.052}}, .seconds = 0.8},
    {"ball probed off a node", SPHERE2, 0, 0, BENDS, CALM HELD_LOW, "", .radius = 0.012,
     .way = {{0.0125, 0.004, 0.0625}, {0.0125, 0.004, 0.052}, {0.0125, 0.004, 0.052}},
     .seconds = 0.8},
    {"ball dragged on", SPHERE2, 0, 0, BENDS, CALM HELD_LOW, "", .radius = 0.012,
     .way = {{0.0, 0.0, 0.0625}, {0.0, 0.0, 0.052}, {0.02, 0.0, 0.052}}, .seconds = 0.8},
    {"ball probed, adapts to 2", SPHERE2, 0, 2, BENDS, CALM HELD_LOW, "", .radius = 0.012,
     .way = {{0.0, 0.0, 0.0625}, {0.0, 0.0, 0.052}, {0.0, 0.0, 0.052}}, .seconds = 0.8},
    {"gas ball pressed", SPHERE2, 0, 0, BENDS, CALM "cavity = { gas = true; pressure = 300.0; };",
     TOP_LOAD(-0.167), .seconds = 0.8},
    {"ball blown up", SPHERE2, 0, 0, BENDS, WEAK HELD_LOW "cavity = { pressure = 150.0; };", "",
     .seconds = 0.8},
    {"water ball probed", SPHERE2, 0, 0, BENDS,
     "shape = { angular_frequency = 15.0; damping_ratio = 2.0; };" HELD_LOW
     "cavity = { fluid = true; pressure = 300.0; };",
     "", .radius = 0.012, .way = {{0.0, 0.0, 0.066}, {0.0, 0.0, 0.056}, {0.0, 0.0, 0.056}},
     .seconds = 0.8},
    {"sheet pressed", SHEET, 0, 0, BENDS, CALM HELD_SIDES, LOAD(0.0, 0.0, 0.0, 0.0, 0.0, -0.1),
     .seconds = 0.8},
    {"sheet pressed, level 1", SHEET, 1, 0, BENDS, CALM HELD_SIDES,
     LOAD(0.0, 0.0, 0.0, 0.0, 0.0, -0.1), .seconds = 0.8},
    {"sheet pressed, thin", SHEET, 0, 0, SOFT, CALM HELD_SIDES, LOAD(0.0, 0.0, 0.0, 0.0, 0.0, -0.1),
     .seconds = 0.8},
    {"sheet drawn in plane", SHEET, 0, 0, SOFT, WEAK HELD_SIDES, LOAD(0.0, 0.0, 0.0, 0.3, 0.0, 0.0),
     .seconds = 0.8},
    {"sheet sags", SHEET, 0, 0, BENDS, WEAK HELD_SIDES, "gravity = [0.0, 0.0, -9.81];",
     .seconds = 1.2},
    {"sheet adapts to 2", SHEET, 0, 2, BENDS, CALM HELD_SIDES, LOAD(0.0, 0.0, 0.0, 0.0, 0.0, -0.1),
     .seconds = 0.8},
    {"sheet cut", SHEET, 0, 0, BENDS, CALM HELD_SIDES, LOAD(0.0, 0.01, 0.0, 0.0, 0.0, -0.03),
     .seconds = 0.8, .cuts = true,
     .cut = {{-0.041, 0.0, -0.05}, {-0.041, 0.0, 0.05}, {0.041, 0.0, -0.05}, {0.041, 0.0, 0.05}}},
    {"sheet probed", SHEET, 0, 0, BENDS, CALM HELD_SIDES, "", .radius = 0.015,
     .way = {{0.0, 0.0, 0.016}, {0.0, 0.0, 0.0}, {0.0, 0.0, 0.0}}, .seconds = 0.8},
    {"stomach pressed", STOMACH, 0, 0, BENDS, CALM, LOAD(-0.1067, -0.0001, 0.0187, 0.05, 0.0, 0.0),
     .seconds = 0.8},
    {"stomach pinched", STOMACH, 0, 0, BENDS, CALM HELD_HEAD,
     "loads = (" ONE(-0.0367, 0.045, 0.0, 0.03, 0.0, -0.15, 0.0) "," ONE(-0.0367, -0.045, 0.0, 0.03,
                                                                         0.0, 0.15, 0.0) ");",
     .seconds = 0.8},
    {"stomach adapts to 2", STOMACH, 0, 2, BENDS, CALM,
     LOAD(-0.1067, -0.0001, 0.0187, 0.05, 0.0, 0.0), .seconds = 0.8},
    {"stomach sags", STOMACH, 0, 0, BENDS, WEAK HELD_HEAD, "gravity = [0.0, 0.0, -9.81];",
     .seconds = 1.2},
    {"stomach thin adapts to 1", STOMACH, 0, 1, SOFT, CALM,
     LOAD(-0.1067, -0.0001, 0.0187, 0.05, 0.0, 0.0), .seconds = 0.8},
    {"tube pressed", TUBE, 0, 0, BENDS, CALM HELD_ENDS, LOAD(0.0, 0.0, 0.02, 0.0, 0.0, -0.1),
     .seconds = 0.8},
    {"tube pinched", TUBE, 0, 0, BENDS, CALM HELD_ENDS,
     "loads = (" ONE(0.0, 0.0, 0.02, 0.015, 0.0, 0.0, -0.3) "," ONE(0.0, 0.0, -0.02, 0.015, 0.0,
                                                                    0.0, 0.3) ");",
     .seconds = 0.8},
    {"tube twisted, level 1", TUBE, 1, 0, BENDS, CALM HELD_ENDS,
     "loads = (" ONE(0.0, 0.0, 0.02, 0.02, 0.0, 0.3, 0.0) "," ONE(0.0, 0.0, -0.02, 0.02, 0.0, -0.3,
                                                                  0.0) ");",
     .seconds = 0.8},
    {"tube pulled, stiffens", TUBE, 0, 0, BENDS " stiffening = { strain = 0.3; cap = 4.0; };",
     CALM HELD_ENDS, "loads = (" ONE(0.0, 0.0, 0.02, 0.015, 0.0, 0.0, 0.5) ");", .seconds = 0.8},
    {"sheet probed, level 1", SHEET, 1, 0, BENDS, CALM HELD_SIDES, "", .radius = 0.015,
     .way = {{0.0, 0.0, 0.016}, {0.0, 0.0, 0.0}, {0.0, 0.0, 0.0}}, .seconds = 0.8},
    {"sheet dragged on", SHEET, 0, 0, BENDS, CALM HELD_SIDES, "", .radius = 0.015,
     .way = {{-0.03, 0.0, 0.016}, {-0.03, 0.0, 0.005}, {0.03, 0.01, 0.005}}, .seconds = 0.7},
    {"sheet probed, adapts to 1", SHEET, 0, 1, BENDS, CALM HELD_SIDES, "", .radius = 0.015,
     .way = {{0.013, 0.007, 0.016}, {0.013, 0.007, 0.003}, {0.013, 0.007, 0.003}}, .seconds = 0.8},
    {"sheet cut at level 1", SHEET, 1, 0, BENDS, CALM HELD_SIDES,
     LOAD(0.0, 0.01, 0.0, 0.0, 0.0, -0.03), .seconds = 0.8, .cuts = true,
     .cut = {{-0.041, 0.0, -0.05}, {-0.041, 0.0, 0.05}, {0.041, 0.0, -0.05}, {0.041, 0.0, 0.05}}},
    {"sheet cut and sags", SHEET, 0, 0, BENDS, WEAK HELD_SIDES, "gravity = [0.0, 0.0, -9.81];",
     .seconds = 1.2, .cuts = true,
     .cut = {{-0.061, 0.0, -0.05}, {-0.061, 0.0, 0.05}, {0.061, 0.0, -0.05}, {0.061, 0.0, 0.05}}},
    {"stomach probed", STOMACH, 0, 0, BENDS, CALM HELD_HEAD, "", .radius = 0.012,
     .way = {{-0.055, 0.057, 0.0775}, {-0.055, 0.05, 0.0775}, {-0.055, 0.05, 0.0775}},
     .seconds = 0.8},
    {"stomach dragged on", STOMACH, 0, 0, BENDS, CALM HELD_HEAD, "", .radius = 0.012,
     .way = {{-0.055, 0.057, 0.0775}, {-0.055, 0.05, 0.0775}, {-0.035, 0.05, 0.0775}},
     .seconds = 0.6},
    {"ball pinched by two", SPHERE2, 1, 0, BENDS, CALM, "", .radius = 0.012,
     .way = {{0.0625, 0.0, 0.0}, {0.054, 0.0, 0.0}, {0.054, 0.0, 0.0}},
     .other = {{-0.0625, 0.0, 0.0}, {-0.054, 0.0, 0.0}}, .seconds = 0.8},
    {"free ball hit", SPHERE2, 0, 0, BENDS,
     "shape = { angular_frequency = 50.0; damping_ratio = 0.3; frame = \"body\"; };",
     "loads = (" ONE(0.0, 0.0, 0.05, 0.03, 0.0, 0.0, -0.3) "," ONE(0.0, 0.0, -0.05, 0.03, 0.0, 0.0,
                                                                   0.3) ");",
     .seconds = 0.6},
    {"gallbladder in its bed", NULL, 0, 0, NULL, NULL, NULL, .seconds = 0.5},
    {"gallbladder probed", NULL, 0, 0, NULL, NULL, NULL, .radius = 0.004,
     .way = {{0.0, -0.022, 0.047}, {0.0, -0.022, 0.024}, {0.0, -0.022, 0.024}}, .seconds = 0.6},
    {"gallbladder probed, level 1", NULL, 1, 0, NULL, NULL, NULL, .radius = 0.004,
     .way = {{0.0, -0.022, 0.047}, {0.0, -0.022, 0.024}, {0.0, -0.022, 0.024}}, .seconds = 0.6},
    {"gallbladder, level 1, later", NULL, 1, 0, NULL, NULL, NULL, .seconds = 2.5},
    {"tube probed", TUBE, 0, 0, BENDS, CALM HELD_ENDS, "", .radius = 0.008,
     .way = {{0.0, 0.0, 0.0285}, {0.0, 0.0, 0.022}, {0.0, 0.0, 0.022}}, .seconds = 0.8},
    {"tube probed, adapts to 1", TUBE, 0, 1, BENDS, CALM HELD_ENDS, "", .radius = 0.008,
     .way = {{0.0, 0.0, 0.0285}, {0.0, 0.0, 0.022}, {0.0, 0.0, 0.022}}, .seconds = 0.8},
    // Had no part in any choice.
    {"sheet, small ball", SHEET, 0, 0, BENDS, CALM HELD_SIDES, "", .radius = 0.008,
     .way = {{0.011, 0.004, 0.009}, {0.011, 0.004, -0.002}, {0.011, 0.004, -0.002}}, .seconds = 0.8,
     .later = true},
    {"sheet, large ball", SHEET, 0, 0, BENDS, CALM HELD_SIDES, "", .radius = 0.025,
     .way = {{-0.02, 0.007, 0.026}, {-0.02, 0.007, 0.017}, {-0.02, 0.007, 0.017}}, .seconds = 0.8,
     .later = true},
    {"sheet, thin, ball", SHEET, 0, 0, SOFT, CALM HELD_SIDES, "", .radius = 0.015,
     .way = {{0.007, -0.013, 0.016}, {0.007, -0.013, 0.009}, {0.007, -0.013, 0.009}},
     .seconds = 0.8, .later = true},
    {"sheet, level 1, ball in a drag", SHEET, 1, 0, BENDS, CALM HELD_SIDES, "", .radius = 0.01,
     .way = {{-0.03, 0.003, 0.011}, {-0.03, 0.003, 0.004}, {0.03, -0.01, 0.004}}, .seconds = 0.55,
     .later = true},
    {"sheet, rough, ball in a drag", SHEET, 0, 0, BENDS,
     CALM HELD_SIDES "contact = { friction = 0.6; };", "", .radius = 0.015,
     .way = {{-0.03, 0.0, 0.016}, {-0.03, 0.0, 0.009}, {0.02, 0.01, 0.009}}, .seconds = 0.6,
     .later = true},
    {"sheet adapts to 2, ball in a drag", SHEET, 0, 2, BENDS, CALM HELD_SIDES, "", .radius = 0.012,
     .way = {{-0.02, 0.005, 0.013}, {-0.02, 0.005, 0.006}, {0.03, 0.0, 0.006}}, .seconds = 0.65,
     .later = true},
    {"ball, small tool", SPHERE2, 0, 0, BENDS, CALM HELD_LOW, "", .radius = 0.006,
     .way = {{0.006, 0.003, 0.0565}, {0.006, 0.003, 0.0495}, {0.006, 0.003, 0.0495}},
     .seconds = 0.8, .later = true},
    {"ball, level 1, large tool", SPHERE2, 1, 0, BENDS, CALM HELD_LOW, "", .radius = 0.02,
     .way = {{0.0, 0.0, 0.071}, {0.0, 0.0, 0.06}, {0.0, 0.0, 0.06}}, .seconds = 0.8, .later = true},
    {"ball, weak, deep", SPHERE2, 0, 0, BENDS, WEAK HELD_LOW, "", .radius = 0.012,
     .way = {{0.004, 0.0, 0.063}, {0.004, 0.0, 0.048}, {0.004, 0.0, 0.048}}, .seconds = 1.0,
     .later = true},
    {"gas ball, tool", SPHERE2, 0, 0, BENDS,
     CALM HELD_LOW "cavity = { gas = true; pressure = 300.0; };", "", .radius = 0.015,
     .way = {{0.0, 0.005, 0.066}, {0.0, 0.005, 0.058}, {0.0, 0.005, 0.058}}, .seconds = 0.8,
     .later = true},
    {"water ball of a given modulus, tool", SPHERE2, 0, 0, BENDS,
     WEAK HELD_LOW "cavity = { fluid = true; pressure = 300.0; bulk_modulus = 40000.0; };", "",
     .radius = 0.012, .way = {{0, 0, 0.066}, {0, 0, 0.056}, {0, 0, 0.056}}, .seconds = 0.8,
     .later = true},
    {"tube, ball", TUBE, 0, 0, BENDS, CALM HELD_ENDS, "", .radius = 0.012,
     .way = {{0.005, 0.004, 0.033}, {0.005, 0.004, 0.024}, {0.005, 0.004, 0.024}}, .seconds = 0.8,
     .later = true},
    {"tube, level 1, ball in a drag", TUBE, 1, 0, BENDS, CALM HELD_ENDS, "", .radius = 0.006,
     .way = {{-0.02, 0.0, 0.027}, {-0.02, 0.0, 0.02}, {0.02, 0.0, 0.02}}, .seconds = 0.6,
     .later = true},
    {"stomach, level 1, ball", STOMACH, 1, 0, BENDS, CALM HELD_HEAD, "", .radius = 0.012,
     .way = {{-0.055, 0.057, 0.0775}, {-0.055, 0.047, 0.0775}, {-0.055, 0.047, 0.0775}},
     .seconds = 0.8, .later = true},
    {"sphere between two",
     SPHERE,
     0,
     0,
     BENDS,
     CALM,
     "",
     .radius = 0.015,
     .way = {{0.0655, 0.0, 0.0}, {0.058, 0.0, 0.0}, {0.058, 0.0, 0.0}},
     {{-0.0655, 0.0, 0.0}, {-0.056, 0.0, 0.0}},
     .seconds = 0.8,
     .later = true},
    {"sheet pulled aside", SHEET, 0, 0, BENDS, CALM HELD_SIDES,
     LOAD(0.03, 0.02, 0.0, 0.05, 0.0, 0.06), .seconds = 0.8, .later = true},
    {"stomach pulled", STOMACH, 0, 0, BENDS, CALM HELD_HEAD,
     LOAD(-0.1067, -0.0001, 0.0187, -0.08, 0.0, 0.0), .seconds = 0.8, .later = true},
};

enum { CASE_COUNT = sizeof CASES / sizeof *CASES };

// An open tube of equilateral faces along x.
static void write_tube(const char *path)
{
    enum { AROUND = 14, ALONG = 18 };
    const double radius = 0.02;
    CLOSED FILE *file = fopen(path, "w");
    ASSERT(file != NULL);
    fprintf(file, "OFF\n%d %d 0\n", AROUND * ALONG, 2 * AROUND * (ALONG - 1));
    for (int i = 0; i < ALONG; i++)
        for (int k = 0; k < AROUND; k++) {
            const double at = 2.0 * M_PI * (k + 0.5 * (i % 2)) / AROUND;
            fprintf(file, "%.9g %.9g %.9g\n", -0.07 + 0.14 * i / (ALONG - 1), radius * sin(at),
                    radius * cos(at));
        }
    for (int i = 0; i + 1 < ALONG; i++)
        for (int k = 0; k < AROUND; k++) {
            const int a = i * AROUND + k, b = i * AROUND + (k + 1) % AROUND, odd = i % 2;
            const int c = a + AROUND, d = b + AROUND; // above
            if (odd)
                fprintf(file, "3 %d %d %d\n3 %d %d %d\n", a, d, b, a, c, d);
            else
                fprintf(file, "3 %d %d %d\n3 %d %d %d\n", a, c, b, b, c, d);
        }
}

static void give_up(const Case *what, const Status *status)
{
    fprintf(stderr, "%s: %s\n", what->name, status->text);
    exit(1);
}

static void write_case(const Case *what, const char *levels, const char *path)
{
    CLOSED FILE *file = fopen(path, "w");
    ASSERT(file != NULL);
    fprintf(file,
            "name = \"error\"; rate_hz = 1000.0;\nbodies = ( { name = \"a\"; mesh = { %s }; "
            "material = { %s };\n%s %s %s } );\n%s\n",
            what->mesh, what->material, levels, what->body, what->cuts ? "cuttable = true;" : "",
            what->tail);
    if (what->radius > 0.0)
        fprintf(file, "tools = (");
    for (int id = 1; what->radius > 0.0 && id <= 2; id++)
        fprintf(
            file,
            "%s { id = %d; kind = \"probe\"; max_force = 50.0; capsules = ( { radius = %g; } ); "
            "}",
            id > 1 ? "," : "", id, what->radius);
    if (what->radius > 0.0)
        fprintf(file, " );\n");
}

static void read_case(const Case *what, bool truth, const char *config, const char *folder,
                      Scene *scene)
{
    char path[512], levels[128] = "";
    Status status = {0};
    const int finest = (what->adapts > 0 ? what->adapts : what->level) + truth;
    if (!truth && what->adapts > 0)
        snprintf(levels, sizeof levels, "levels = %d; adapt = { force = 0.0025; };", finest);
    else if (finest > 0)
        snprintf(levels, sizeof levels, "levels = %d; start_level = %d;", finest, finest);
    snprintf(path, sizeof path, "%s/%s", what->mesh == NULL ? config : folder,
             what->mesh == NULL ? "gallbladder.cfg" : "error.cfg");
    if (what->mesh != NULL)
        write_case(what, levels, path);
    if (!scene_read(path, scene, &status))
        give_up(what, &status);
    if (what->mesh != NULL)
        unlink(path);
    SurfaceOptions *surface = &scene->body[scene->body_count - 1].surface;
    if (what->mesh == NULL)
        surface->body.levels = surface->start_level = finest;
    scene->publish.error_hz = truth ? 0.0 : 50.0;
}

// From way[0] to way[1] in 0.3 s, then on in 0.4 s.
static Vec3 way_at(const Vec3 way[2], const Vec3 *on, double time)
{
    const double press = fmin(time / 0.3, 1.0), drag = fmin(fmax((time - 0.3) / 0.4, 0.0), 1.0);
    const Vec3 down = vec3_madd(way[0], press, vec3_sub(way[1], way[0]));
    return vec3_madd(down, drag, vec3_sub(*on, way[1]));
}

static void cut(const Case *what, Sim *sim)
{
    char why[256];
    CutOutcome sum;
    const CutOptions options = {.body = 0,
                                .before = {{what->cut[0], what->cut[1]}},
                                .after = {{what->cut[2], what->cut[3]}}};
    if (!sim_apply_cut(sim, &options, &sum, why, sizeof why))
        fprintf(stderr, "%s: %s\n", what->name, why);
}

static void put_tool(Sim *sim, int tool, Vec3 place)
{
    const ToolPose pose = {.position = place, .orientation = {1.0, 0.0, 0.0, 0.0}, .active = true};
    sim_apply_pose(sim, tool, &pose, true);
}

typedef struct Outcome {
    int count, *id;
    Vec3 *x, *rest;
    double *area;
    double force; // on the tool, mean of the last ticks [N]
    SimError error;
    double force_error; // over the force
} Outcome;

static void outcome_destroy(Outcome *out)
{
    free(out->id), free(out->x), free(out->rest), free(out->area);
}

static void play(const Case *what, const Scene *scene, Outcome *out)
{
    SCOPED(world_destroy) World world;
    Status status = {0};
    if (!world_build(&world, scene, &(BuildOptions){.isa = "auto", .publishes = true}, &status))
        give_up(what, &status);
    Sim *sim = world.sim;
    Body *body = sim_body(sim, sim_body_count(sim) - 1);
    *out = (Outcome){0};
    const int64_t ticks = lround(what->seconds * 1000.0);
    const bool probes = what->radius > 0.0;
    for (int64_t t = 0; t < ticks; t++) {
        if (what->cuts && t == 50)
            cut(what, sim);
        if (probes)
            put_tool(sim, 0, way_at(what->way, &what->way[2], 0.001 * (double)t));
        if (probes && vec3_length(what->other[0]) > 0.0)
            put_tool(sim, 1, way_at(what->other, &what->other[1], 0.001 * (double)t));
        sim_step(sim);
        if (probes && t >= ticks - 50)
            out->force += vec3_length(sim_wrench(sim, 0)->force) / 50.0;
    }
    if (scene->publish.error_hz > 0.0) {
        SimToolError tool[ERROR_TOOLS];
        sim_error(sim, sim_body_count(sim) - 1, &out->error);
        sim_tool_errors(sim, tool);
        out->force_error = probes && tool[0].force > 0.0 ? tool[0].error / tool[0].force : 0.0;
    }
    const BodyMesh *mesh = &body->mesh;
    const size_t slots = (size_t)mesh->node_count;
    out->count = mesh->node_count;
    out->id = zeroed(slots, sizeof(int));
    out->x = zeroed(slots, sizeof(Vec3));
    out->rest = zeroed(slots, sizeof(Vec3));
    out->area = zeroed(slots, sizeof(double));
    FREED Vec3 *v = zeroed(slots, sizeof *v);
    FREED float *rest = zeroed(3 * slots, sizeof *rest);
    body->ops->read_state(body->model, out->id, out->x, v);
    body->ops->snapshot_rest(body->model, rest);
    for (size_t s = 0; s < slots; s++)
        out->rest[s] =
            (Vec3){(double)rest[3 * s], (double)rest[3 * s + 1], (double)rest[3 * s + 2]};
    // Areas of what is published.
    for (int f = 0; f < mesh->triangle_count; f++) {
        const int *n = mesh->triangle[f];
        if (n[0] == n[1])
            continue;
        const double area =
            0.5 * vec3_length(vec3_cross(vec3_sub(out->rest[n[1]], out->rest[n[0]]),
                                         vec3_sub(out->rest[n[2]], out->rest[n[0]])));
        for (int k = 0; k < 3; k++)
            out->area[n[k]] += area / 3.0;
    }
}

static void compare(const Outcome *own, const Outcome *truth, double *wrong, double *moved)
{
    int most = 0;
    for (int s = 0; s < truth->count; s++)
        most = truth->id[s] > most ? truth->id[s] : most;
    FREED int *slot = zeroed((size_t)most + 1, sizeof *slot);
    for (int s = 0; s < truth->count; s++)
        if (truth->id[s] >= 0)
            slot[truth->id[s]] = s + 1;
    double sum = 0.0, size = 0.0, area = 0.0;
    for (int s = 0; s < own->count; s++) {
        const int id = own->id[s], at = id >= 0 && id <= most ? slot[id] - 1 : -1;
        if (at < 0)
            continue;
        // Copies that a cut has made have numbers that the finer body gives to others.
        if (vec3_length(vec3_sub(own->rest[s], truth->rest[at])) > 3e-3)
            continue;
        const Vec3 u = vec3_sub(own->x[s], own->rest[s]),
                   w = vec3_sub(truth->x[at], truth->rest[at]), d = vec3_sub(u, w);
        sum += own->area[s] * vec3_dot(d, d);
        size += own->area[s] * vec3_dot(u, u);
        area += own->area[s];
    }
    *wrong = sqrt(sum / area);
    *moved = sqrt(size / area);
}

// What is true of one scene, and what was estimated.
typedef struct Row {
    double moved, truth, error;             // [mm]
    double force, force_truth, force_error; // [N], [%], [%]
} Row;

static void run_case(const Case *what, const char *use, const char *config, const char *folder,
                     Row *row)
{
    SCOPED(scene_destroy) Scene own, truth;
    SCOPED(outcome_destroy) Outcome a, b;
    read_case(what, false, config, folder, &own);
    play(what, &own, &a);
    read_case(what, true, config, folder, &truth);
    play(what, &truth, &b);
    double wrong, moved;
    compare(&a, &b, &wrong, &moved);
    *row = (Row){.moved = 1e3 * moved, .truth = 1e3 * wrong, .error = 1e3 * a.error.space};
    printf("%s\t%s\t%.3f\t%.4f\t%.4f\t%.2f", what->name, use, row->moved, row->truth, row->error,
           row->error / row->truth);
    if (a.force > 0.0) {
        row->force_truth = 100.0 * fabs(a.force - b.force) / a.force;
        row->force_error = 100.0 * a.force_error;
        if (row->force_error >= 0.0)
            printf("\t%.4f\t%.1f\t%.1f\t%.2f", a.force, row->force_truth, row->force_error,
                   row->force_error / row->force_truth);
        else
            printf("\t%.4f\t%.1f\tunknown\t", a.force, row->force_truth);
    } else {
        printf("\t\t\t\t");
    }
    printf("\t%d\n", a.error.rounds);
    fflush(stdout);
}

static bool is_named(const Case *what, int count, char **name)
{
    for (int i = 0; i < count; i++)
        if (strstr(what->name, name[i]) != NULL)
            return true;
    return count == 0;
}

static void rate(double ratio, int *within, int *all, double *least)
{
    *within += ratio >= 0.5 && ratio <= 2.0;
    *least = fmin(*least, ratio);
    ++*all;
}

int main(int argc, char **argv)
{
    char folder[] = "/tmp/pliant-error-XXXXXX", path[64];
    if (argc < 2) {
        fprintf(stderr, "usage: pliant-error-walls CONFIG [NAME...]\n");
        return 2;
    }
    if (mkdtemp(folder) == NULL)
        return 1;
    snprintf(path, sizeof path, "%s/tube.off", folder);
    write_tube(path);
    printf("scene\tuse\tdisplacement [mm]\ttrue error [mm]\testimate [mm]\tratio\tforce [N]\ttrue "
           "error [%%]\testimate [%%]\tratio\trounds\n");
    static const char *const USE[] = {"fit", "test", "later"};
    int within[3] = {0}, all[3] = {0};
    double least = 1.0;
    for (int c = 0; c < CASE_COUNT; c++) {
        const int use = CASES[c].later ? 2 : c % 2;
        Row row;
        if (!is_named(&CASES[c], argc - 2, argv + 2))
            continue;
        run_case(&CASES[c], USE[use], argv[1], folder, &row);
        rate(row.error / row.truth, &within[use], &all[use], &least);
        if (row.force_truth > 0.0 && row.force_error >= 0.0)
            rate(row.force_error / row.force_truth, &within[use], &all[use], &least);
    }
    for (int use = 0; use < 3; use++)
        fprintf(stderr, "%s: %d of %d within a factor of 2\n", USE[use], within[use], all[use]);
    fprintf(stderr, "least ratio %.2f\n", least);
    unlink(path);
    rmdir(folder);
    return 0;
}
