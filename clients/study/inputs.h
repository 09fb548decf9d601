// SPDX-License-Identifier: MIT
// The inputs of a scene: its own loads, a log of inputs, its gravity; else a press by its tool, or
// a load. They depend on simulated time alone: a tool moves in straight lines between the study's
// sampling times, at which every tick rate has a tick, so that all cases get the same path.
#ifndef PLIANT_STUDY_INPUTS_H
#define PLIANT_STUDY_INPUTS_H

#include "run/input_log.h"
#include "scene/build.h"
#include "study/context.h"

// --- the built-in press --------------------------------------------------------------------------

// The built-in press: its location on a body, and the path of the tool.

// The point of a body that is farthest from its fixed nodes.
typedef struct PressSite {
    Vec3 point;       // on the surface [m]
    Vec3 inward;      // unit, against the normal; in the plane towards the middle
    double edge;      // length of an edge of the surface [m]
    double thickness; // of the body, as press_extent measures it [m]
} PressSite;

// `plane`: the body is in z = 0. Returns false if every node is fixed.
bool press_find_site(const Body *body, bool plane, PressSite *site);
// Returns the longest side of the box around a body's surface; sets the shortest that is not flat
// [m].
double press_extent(const Body *body, double *thickness);

// Returns the index of the tool that presses: a probe, else a grasper or a blade that has a body;
// -1: none.
int press_find_tool(const Scene *scene);
// Returns the depth of the press [m].
double press_depth(const PressSite *site);
// Plans the press: the tool starts clear of the surface and moves along `inward`, with its shaft
// outside; in the plane case it keeps its orientation.
void press_plan(StudyPress *press, int tool, const ToolOptions *options, const PressSite *site,
                bool plane);
// Returns the tool's position along its path at `time` [m]: a raised cosine down, a rest, and back,
// in straight lines between multiples of `knot_s`.
double press_way_at(const StudyPress *press, double time, double knot_s);

// --- inputs --------------------------------------------------------------------------------------

// Chooses and describes the inputs; may add a load to context->scene. `world`: the scene as it is.
bool study_choose_inputs(StudyContext *context, World *world, Status *status);

// The inputs of one run.
typedef struct StudyPlay {
    const StudyContext *context;
    Sim *sim;
    bool has_log;
    InputLogReader log;
    Replay *replay; // NULL: no log
} StudyPlay;

bool study_play_begin(StudyPlay *play, const StudyContext *context, World *world,
                      const Scene *scene, Status *status);
// Applies all inputs due at the start of the next tick. Returns false if the log stops the run.
bool study_play_tick(StudyPlay *play);
void study_play_end(StudyPlay *play);

#endif
