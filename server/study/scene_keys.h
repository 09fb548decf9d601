// A case as keys of a scene file: to be read, to be pasted, or set in a copy of the file.
#ifndef PLIANT_STUDY_SCENE_KEYS_H
#define PLIANT_STUDY_SCENE_KEYS_H

#include "study/study.h"

#include <stdio.h>

enum { SCENE_KEY_NAME = 24, SCENE_KEY_VALUE = 192, SCENE_KEYS = 12, SCENE_KEYS_BODIES = 16 };

typedef struct SceneKey {
    char name[SCENE_KEY_NAME];
    char value[SCENE_KEY_VALUE]; // libconfig text; "": the scene has no such key
} SceneKey;

typedef struct SceneKeyList {
    int count;
    SceneKey key[SCENE_KEYS];
} SceneKeyList;

typedef struct SceneKeys {
    SceneKeyList top; // of the scene
    int body_count;   // those behind SCENE_KEYS_BODIES stay as they are
    char name[SCENE_KEYS_BODIES][BODY_NAME_MAX];
    SceneKeyList body[SCENE_KEYS_BODIES];
} SceneKeys;

// The keys that make `scene` the case, at `rate_hz` ticks a second: of all bodies, as a study runs
// it. Not for step doubling and halved cells, which no such key asks for. False: out of memory.
bool scene_keys_of_case(const Scene *scene, const StudyCase *what, double rate_hz, SceneKeys *keys);
// As text to be pasted.
void scene_keys_print(const SceneKeys *keys, FILE *out);

// Writes a copy of the scene file `from` to `to` with these keys set in it and everything else as
// it stands, comments too; names of files that are relative are made absolute, since the copy may
// lie elsewhere. False with `status`: a file that cannot be read or written, a text that is no
// scene.
bool scene_keys_set(const SceneKeys *keys, const char *from, const char *to, Status *status);

#endif
