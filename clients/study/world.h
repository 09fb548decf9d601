// The scene modified for a case.
#ifndef PLIANT_STUDY_WORLD_H
#define PLIANT_STUDY_WORLD_H

#include "study/context.h"

#include "scene/build.h"

// A scene that shares all but its bodies with another.
typedef struct StudyScene {
    Scene scene;
    SceneBody *body; // owned
} StudyScene;

// Copies the study's scene without what does not affect its motion: one thread, no skin, no
// prepared file. Returns false if memory runs out.
bool study_copy_scene(const Scene *from, StudyScene *copy);
void study_destroy_scene(StudyScene *copy);
// Changes bodies and rate for the case. `sample_s`: a lower rate's tick divides it.
void study_change_scene(StudyScene *copy, const StudyCase *what, double sample_s);
// Copies, changes and builds. Returns false with `status` if the scene is refused.
bool study_build(const StudyContext *context, const StudyCase *what, StudyScene *copy, World *world,
                 Status *status);

#endif
