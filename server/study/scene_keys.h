// A case as keys of a scene file: to be read, to be pasted, or set in a copy of the file.
#ifndef PLIANT_STUDY_SCENE_KEYS_H
#define PLIANT_STUDY_SCENE_KEYS_H

#include "study/study.h"

#include <stdio.h>

enum { SCENE_KEY_NAME = 24, SCENE_KEY_VALUE = 160, SCENE_KEYS_TOP = 4, SCENE_KEYS_BODY = 12 };

typedef struct SceneKey {
    char name[SCENE_KEY_NAME];
    char value[SCENE_KEY_VALUE]; // libconfig text; "": the scene has no such key
} SceneKey;

typedef struct SceneKeys {
    int top_count, body_count;
    SceneKey top[SCENE_KEYS_TOP];   // of the scene
    SceneKey body[SCENE_KEYS_BODY]; // of each body
} SceneKeys;

// The keys that make `scene` the case, at `rate_hz` ticks a second. Not for step doubling, which no
// scene can ask for.
void scene_keys_of_case(const Scene *scene, const StudyCase *what, double rate_hz,
                        SceneKeys *keys);
// As text to be pasted.
void scene_keys_print(const SceneKeys *keys, FILE *out);

// Writes a copy of the scene file `from` to `to` with these keys set in it and everything else as it
// stands, comments too; names of files that are relative are made absolute, since the copy may lie
// elsewhere. False with `status`: a file that cannot be read or written, a text that is no scene.
bool scene_keys_set(const SceneKeys *keys, const char *from, const char *to, Status *status);

#endif
