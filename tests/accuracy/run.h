// SPDX-License-Identifier: MIT
// A scene run offline in this process, as one of the models that the paper compares: its curve of
// displacement, what it costs, and where its nodes are.
#ifndef PLIANT_TESTS_ACCURACY_RUN_H
#define PLIANT_TESTS_ACCURACY_RUN_H

#include "scene/build.h"
#include "geometry/levels.h"

// How a scene's body is divided. The scene's own `adapt` holds for MODEL_ADAPTIVE.
typedef enum ModelKind { MODEL_HELD, MODEL_ADAPTIVE } ModelKind;

typedef struct Model {
    const char *name;
    ModelKind kind;
    int levels; // MODEL_HELD: stays at this level; MODEL_ADAPTIVE: the finest, starts at 0
} Model;

extern const Model MODEL_COARSE, MODEL_REFINED_1, MODEL_REFINED_2, MODEL_ADAPTIVE_1,
    MODEL_ADAPTIVE_2;

// Multiplies all loads of a scene.
void scene_scale_loads(Scene *scene, double factor);
// Reads a scene of this folder's scenes/; ends the program when that fails.
void run_read(const char *folder, const char *name, Scene *scene);

// The nodes of level 0 on which the scene's loads act and how the coarse mesh shares the force
// among them: displacements are means with these weights, along the force (the displacement on
// which the force does its work).
typedef struct Probe {
    TriMesh mesh;   // of level 0
    double *weight; // [mesh.node_count], sum 1
    Vec3 direction; // of the force
} Probe;
void probe_create(const Scene *scene, Probe *probe);
void probe_destroy(Probe *probe);

enum { TRACE_MOST = 2048 };

typedef struct Trace {
    int count;                       // ticks
    double time[TRACE_MOST];         // [s]
    double displacement[TRACE_MOST]; // [m]
    int nodes[2], springs[2];        // least and most in use
    int64_t cpu_ns;                  // of this thread, in sim_step
    int64_t resets;
} Trace;

// Nodes that a body has at the moment.
int run_node_count(const Body *body);
// A world of the scene with its body as `model`; ends the program when that fails.
void run_build(const Scene *scene, const Model *model, World *world);
// One tick; the CPU time of this thread in it [ns].
int64_t run_step(World *world);
// Steps it for so long.
void run_steps(World *world, const Probe *probe, double seconds, Trace *trace);
// All of it.
void run_trace(const Scene *scene, const Model *model, const Probe *probe, double seconds,
               Trace *trace);

// sqrt(integral (u - reference)^2 / integral reference^2) over time.
double trace_difference(const Trace *trace, const Trace *reference);

// Displacements of all nodes of the finest level of `levels`, by hierarchical number: those that
// the body does not have move with the mean of their parents.
void run_displacements(const World *world, const Levels *levels, Vec3 *displacement);

#endif
