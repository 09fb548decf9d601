// The scene as a case wants it.
#ifndef PLIANT_STUDY_WORLD_H
#define PLIANT_STUDY_WORLD_H

#include "study/context.h"

#include "files/build.h"

// A scene that shares all but its bodies with another.
typedef struct StudyScene {
    Scene scene;
    SceneBody *body; // owned
} StudyScene;

// The study's scene without what does not matter to its motion: one thread, no skin, no prepared
// file. False: out of memory.
bool study_copy_scene(const Scene *from, StudyScene *copy);
void study_destroy_scene(StudyScene *copy);
// Changes bodies and rate to what the case asks. `sample_s`: the tick of a lower rate divides it.
void study_change_scene(StudyScene *copy, const StudyCase *what, double sample_s);
// Both, and builds. False with `status`: refused.
bool study_build(const StudyContext *context, const StudyCase *what, StudyScene *copy, World *world,
                 Status *status);

#endif
