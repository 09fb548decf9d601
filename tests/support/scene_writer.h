// SPDX-License-Identifier: MIT
// Scenes of one body as files in the scratch folder, put together from parts.
#ifndef PLIANT_TESTS_SCENE_WRITER_H
#define PLIANT_TESTS_SCENE_WRITER_H

#include "harness.h"

// Texts in the syntax of scenes, in the order of the file; NULL takes what is said here.
typedef struct SceneParts {
    const char *head;     // keys of the scene; none
    const char *name;     // of the body; "sphere"
    const char *source;   // its model and its mesh or voxels; SMALL_SPHERE
    const char *material; // keys of its group; those of soft tissue, SOFT_MATERIAL
    const char *body;     // its other keys; SMALL_SHAPE and LOWER_FIXED
    const char *others;   // more bodies, each behind a comma; none
    const char *tail;     // tools, loads and attachments; none
} SceneParts;

#define ICO_SPHERE(nodes, radius)                                                                  \
    "model = \"surface\"; mesh = { generator = \"ico_sphere\"; nodes = " #nodes                    \
    "; radius = " #radius "; };\n"
#define SMALL_SPHERE   ICO_SPHERE(42, 0.05)
#define SOFT_MATERIAL  "youngs_modulus_2d = 80.0; areal_density = 4.2; damping_time = 2.0e-4;"
#define SMALL_SHAPE    "shape = { angular_frequency = 50.0; damping_ratio = 0.1; };\n"
#define FIXED_BELOW(z) "fixed = ( { box = ([-1.0, -1.0, -1.0], [1.0, 1.0, " #z "]); } );\n"
#define LOWER_FIXED    FIXED_BELOW(-0.02)
enum { SPHERE_NODES = 42, SPHERE_TRIANGLES = 80 }; // of SMALL_SPHERE

// A daemon in lockstep, 100 ticks a second, so that a busy machine has time to spare in each.
#define LOCKSTEP_HEAD(publish)                                                                     \
    "rate_hz = 100.0; start = \"paused\";\n"                                                       \
    "publish = { mesh_hz = 0.0; status_hz = 20.0; " publish " };"

// Tool 1, a ball of 5 mm.
#define PROBE_TOOL                                                                                 \
    "tools = ( { id = 1; kind = \"probe\"; max_force = 5.0;\n"                                     \
    "  capsules = ( { from = [0.0, 0.0, 0.0]; to = [0.0, 0.0, 0.0]; radius = 0.005; } ); } );\n"

// Returns the file's path, as scratch().
const char *write_body_scene(const char *file, const SceneParts *parts);
// The small scene: a sphere of 42 nodes, radius 0.05 m, its lower part fixed.
const char *write_scene(const char *file, const char *head, const char *tail);

#endif
