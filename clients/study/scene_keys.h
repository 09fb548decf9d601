// SPDX-License-Identifier: MIT
// A case as keys of a scene file: to print, to paste, or to set in a copy of the file.
#ifndef PLIANT_STUDY_SCENE_KEYS_H
#define PLIANT_STUDY_SCENE_KEYS_H

#include "study/study.h"

#include <stdio.h>

enum { SCENE_KEY_NAME = 24, SCENE_KEYS = 12, SCENE_KEYS_BODIES = 16 };

typedef struct SceneKey {
    char name[SCENE_KEY_NAME];
    char value[SCENE_VALUE_TEXT]; // libconfig text; "": the scene has no such key
} SceneKey;

typedef struct SceneKeyList {
    int count;
    SceneKey key[SCENE_KEYS];
} SceneKeyList;

typedef struct SceneKeys {
    SceneKeyList top; // of the scene
    int body_count;   // bodies after SCENE_KEYS_BODIES are not changed
    char name[SCENE_KEYS_BODIES][BODY_NAME_MAX];
    SceneKeyList body[SCENE_KEYS_BODIES];
} SceneKeys;

// Finds the keys that turn `scene` into the case, at `rate_hz` ticks per second, for all bodies, as
// the study runs it. Not for step doubling and halved cells, which no key specifies. Returns false
// if memory runs out.
bool scene_keys_of_case(const Scene *scene, const StudyCase *what, double rate_hz, SceneKeys *keys);
// Prints the keys as text to paste.
void scene_keys_print(const SceneKeys *keys, FILE *out);

// Writes a copy of the scene file `from` to `to` with these keys set and all else unchanged,
// comments included. Relative file names become absolute, since the copy may be in another folder.
// Returns false with `status` if a file cannot be read or written, or the text is no scene.
bool scene_keys_set(const SceneKeys *keys, const char *from, const char *to, Status *status);

#endif
