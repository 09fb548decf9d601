// SPDX-License-Identifier: MIT
// Random scenes, drawn from the tables that read scene files: a new key is drawn as soon as its
// table knows it.
#ifndef PLIANT_TESTS_STABILITY_RANDOM_SCENE_H
#define PLIANT_TESTS_STABILITY_RANDOM_SCENE_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>

enum { SCENE_LINES = 2000, SCENE_LINE = 200 };

// A scene as lines, of which some can be struck out.
typedef struct RandomScene {
    uint64_t random;
    int count;
    struct {
        char text[SCENE_LINE];
        int last;  // of the group that begins here; else the line itself
        bool gone; // struck out
    } line[SCENE_LINES];
} RandomScene;

// Draws scene `seed`.
void random_scene_draw(RandomScene *scene, uint64_t seed);
// Reads a scene as it was printed. False: `path` cannot be read, or is longer than any that is
// drawn.
bool random_scene_read(RandomScene *scene, const char *path);
void random_scene_print(const RandomScene *scene, FILE *out);
// Strikes out what stands at line `number` of the text as printed (from 1): a key, or the group
// that begins or ends there. False: nothing can be struck out.
bool random_scene_strike(RandomScene *scene, int number);

#endif
