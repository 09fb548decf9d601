// SPDX-License-Identifier: MIT
// What each key of a scene must show when it changes: rows for every key of every table and every
// model that takes it, unless the table itself tells how to change it. Scenes are put together from
// parts; a row replaces some of them.
#ifndef PLIANT_TESTS_KEYS_ROWS_H
#define PLIANT_TESTS_KEYS_ROWS_H

#include "scene/option_table.h"

#include <stddef.h>

typedef enum KeyModel { KEY_SURFACE, KEY_VOXEL, KEY_PLANE, KEY_MODELS } KeyModel;
enum { S = 1 << KEY_SURFACE, V = 1 << KEY_VOXEL, P = 1 << KEY_PLANE, ALL = S | V | P };

// In the order of the text.
typedef enum Part {
    HEAD,
    NAME,   // of the first body
    SOURCE, // its model and its mesh or voxels
    BODY,   // what else it says
    OTHER,  // more bodies, behind a comma
    TOOLS,
    LOADS,
    ATTACH,
    PARTS
} Part;

// What tells that the change was noticed.
typedef enum Evidence {
    STATE,       // the hash of the state after a run, and what checkpoints know scenes apart by
    STATE_ALONE, // that hash, though a checkpoint of one scene continues as the other
    SHOWN,       // what is published of the bodies after it: mesh, ids and positions
    PLAN,        // what --explain prints
    STREAM,      // what the running daemon publishes (stream.c)
    IDLE,        // nothing, and the scene says so, with `said`: another key leaves it no effect
    REFUSED,     // the changed scene is not accepted, in a sentence that has `said`
} Evidence;

typedef struct Change {
    Part part;
    const char *text;
} Change;

typedef struct KeyRow {
    const OptionTable *table;
    const char *key;
    int models; // S | V | P
    Evidence evidence;
    Part part; // that has `base` in one run and `changed` in the other
    const char *base, *changed;
    const char *said;
    Change also[2]; // in both runs; a NULL text ends them
} KeyRow;

extern const KeyRow KEY_ROWS[];
extern const int KEY_ROW_COUNT;

// A row that its table tells: a number, truth or word of a body, or of one of its groups, gets
// another value than its default, which shows in the state if the motion depends on it, else in the
// plan; a key of other models is refused. Returns false for other keys.
typedef struct MadeRow {
    KeyRow row;
    char base[64], changed[160], said[96];
} MadeRow;
bool key_row_make(const OptionTable *table, const Option *option, KeyModel model, MadeRow *made);

// Models to which a table belongs: none of its keys can be said of the others.
int key_models(const OptionTable *table);
// The scene of a row; the caller's to free. `prefix`: what HEAD begins with, "" for nothing.
char *key_scene(const KeyRow *row, KeyModel model, bool changed, const char *prefix);

#endif
