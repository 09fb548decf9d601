// SPDX-License-Identifier: MIT
// What the tests of this folder run: small scenes with levels, cuts, tears and graspers, and all
// that is done to them, drawn from a seed. The same messages are written into a log as --log-inputs
// does, or sent to a running daemon.
#ifndef PLIANT_TESTS_PERSISTENCE_SESSION_H
#define PLIANT_TESTS_PERSISTENCE_SESSION_H

#include "harness.h"

#include <lcm/lcm.h>

enum { TARGETS_MOST = 3, MESSAGE_BYTES = 256, SESSION_RATE = 1000 };

// Where a body is, for tools that are to touch it.
typedef struct Target {
    const char *body;
    double center[3], radius; // [m]
} Target;

typedef struct SessionScene {
    const char *name; // of the file in scenes/
    int targets;
    Target target[TARGETS_MOST];
    bool blade, grasper; // has tool 2, tool 3 (or a remover); all have tool 1, a probe
    bool flat;           // in the plane z = 0
    uint64_t more;       // added to its seeds: with 2 no RESET undoes what the golden state watches
} SessionScene;

enum { SESSION_SCENES = 11 };
extern const SessionScene session_scenes[SESSION_SCENES];

// The scene with its precision and number of threads in the scratch folder; its path.
const char *session_scene(const SessionScene *scene, const char *precision, int threads);

// The step that a checkpoint holds, which must load with its scene; -1: there is none.
long long kept_step(const char *checkpoint, const char *scene);

typedef struct Message {
    int tick;
    const char *channel; // without the prefix
    int size;
    unsigned char data[MESSAGE_BYTES];
} Message;

typedef struct Session {
    int count, capacity, ticks;
    Message *message; // ascending ticks
} Session;

// `ticks` of poses of all tools, and of cuts, loads and commands now and then.
Session session_create(const SessionScene *scene, uint64_t seed, int ticks);
void session_destroy(Session *session);
// As --log-inputs would have written it.
void session_write_log(const Session *session, const SessionScene *scene, const char *path);
// Sends the messages of one tick; `next` counts those sent.
void session_send(const Session *session, int tick, int *next, lcm_t *lcm);

#endif
