// SPDX-License-Identifier: MIT
// The stability matrix: which cases there are, what a cell is, how it is judged and printed.
#ifndef PLIANT_TESTS_STABILITY_MATRIX_H
#define PLIANT_TESTS_STABILITY_MATRIX_H

#include <stdbool.h>
#include <stdio.h>

// A key of the body and its value, as text of a scene file; a list of them ends with a NULL key. A
// value NULL: the key is left out.
typedef struct Key {
    const char *key, *value;
} Key;

typedef enum ModelKind { KIND_SURFACE, KIND_VOXEL, KIND_PLANE } ModelKind;

enum { MODEL_KEYS = 10, CASE_KEYS = 5 };

typedef struct Model {
    const char *name, *about;
    ModelKind kind;
    bool adapts;
    Key key[MODEL_KEYS];
} Model;

// How a body begins.
typedef enum Start {
    START_REST,
    START_FLAT,     // in a plane
    START_MIRRORED, // inside out: x is -x
    START_POINT,    // all nodes in one place
    START_RANDOM,   // anywhere in a cube of 0.5 m for a surface body, of 0.1 m for others
} Start;

// What is done to it before it is left alone.
typedef enum Drive {
    DRIVE_NOTHING,
    DRIVE_LOAD,      // `value` N for LOAD_S
    DRIVE_TOOL_FAST, // a ball at 100 m/s to and fro through the body, with at most `value` N
    DRIVE_TOOL_IN,   // a ball put into its outside for LOAD_S, with at most `value` N
    DRIVE_TOOL_STAY, // a static ball in its middle, for ever
    DRIVE_TOOL_WALL, // a static ball in its outside, for ever
    DRIVE_PRESS,     // a ball pressed into the outside by `value` of its radius, and held there
    DRIVE_CUT,       // one cut through its middle
    DRIVE_CUT_ALL,   // a push, then cuts through every cell along every axis
    DRIVE_STROKE,    // a blade to and fro through the body at `value` m/s for LOAD_S
    DRIVE_GRASP,     // its outside grasped and pulled 0.3 m off in LOAD_S, with at most `value` N
    DRIVE_TIE,       // its outside pinned by message, then DRIVE_LOAD
    DRIVE_STEP,      // DRIVE_LOAD at `value` of the largest stable time step
    DRIVE_BIG_STEP,  // the same with unsafe_time_step
} Drive;

typedef struct Case {
    const char *name;
    Start start;
    Drive drive;
    double value;
    double rate_hz; // 0: 1000
    bool undamped;  // nothing takes energy out
    bool quick;     // part of the test
    // What replaces keys of the model; `means_nothing`: no row for that kind of body.
    const Key surface[CASE_KEYS], voxel[CASE_KEYS], plane[CASE_KEYS];
    const char *scene, *beside; // text of further keys of the scene, and of a second body, or NULL
    bool not_surface, not_voxel, not_plane;
} Case;

typedef enum Verdict {
    VERDICT_FAILED, // crashed, hung, a number that is none, or energy out of nothing
    VERDICT_REFUSED,
    VERDICT_RESET,    // the check of numbers took the body back
    VERDICT_TREMBLES, // under a tool that is held still its force or its motion does not settle
    VERDICT_SINKS,    // a tool that is held lies deeper in the body than its radius
    VERDICT_SWELLED,  // more energy than it was left with for a while, less than a thousand times
    VERDICT_BOUNDED,
    VERDICT_REST,
    VERDICT_COUNT,
} Verdict;

enum { REASON_TEXT = 400 };

typedef struct Cell {
    int model, at_case, integrator;
    bool is_double;
    // results
    bool done;
    Verdict verdict;
    bool came_to_rest, swelled, trembles, sinks;
    double held_force;    // mean on the tool that is held, in the last second [N]
    double held_swing;    // largest distance of the force from that [N]
    double held_farthest; // of a node from its rest while it is held, in depths of the press
    int resets;
    double simulated; // [s]
    double cpu_s;
    double displacement; // of the node farthest from its rest, in sizes of the body, at the end
    double speed;        // mean at the end, in sizes a second
    double left;         // energy at the end over that when it was left alone
    int pieces;          // at the end
    double growth;       // largest energy while it was left alone, over that at the start
    char reason[REASON_TEXT];
} Cell;

// models.c
extern const Model MODELS[];
extern const int MODEL_COUNT;

// cases.c
extern const Case CASES[];
extern const int CASE_COUNT;
bool case_concerns(const Case *at, const Model *model);
const Key *case_keys(const Case *at, const Model *model);

// trial.c
// Runs one cell in `folder`, which it may litter with files that begin with `prefix`.
void trial_run(Cell *cell, const char *integrator, const char *folder, const char *prefix);
const char *verdict_word(Verdict verdict);

// remarks.c
// Why a verdict that is neither rest nor refused is as it should be; NULL: nobody knows.
const char *remark_find(const Cell *cell, const char *integrator);

// table.c
typedef struct Matrix {
    Cell *cell;
    int cell_count;
    const char *const *integrator;
    int integrator_count;
} Matrix;
// Prints the table, and the sentences to which its cells point by number.
void table_print(const Matrix *matrix, FILE *out, FILE *sentences);
// The verdict's word that a table printed earlier has at a cell; false: it has no such cell.
bool table_find(const char *text, const char *model, const char *row, const char *column,
                char word[16]);
// "leapfrog single"
void table_column(const Cell *cell, const char *integrator, char name[64]);

#endif
