// The inputs of a scene: its own loads, a log of inputs, its gravity; else a press by its tool, or
// a load. They depend on simulated time alone: a tool moves in straight lines between the study's
// sampling times, at which every tick rate has a tick, so that all cases get the same path.
#ifndef PLIANT_STUDY_INPUTS_H
#define PLIANT_STUDY_INPUTS_H

#include "study/context.h"

#include "scene/build.h"
#include "run/input_log.h"

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
