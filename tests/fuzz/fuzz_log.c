// SPDX-License-Identifier: MIT
// A log of inputs (--input), plain or exact, replayed over a small scene: read to its end, what is
// let in applied, a bounded number of ticks.
#include "fuzz.h"

#include "run/input_log.h"
#include "world.h"

#include <stdlib.h>

enum { TICKS_MOST = 32, EVENTS_MOST = 200 };

static void read_all(const char *path)
{
    static InputLogReader reader;
    Status status = {0};
    InputKind kind;
    int64_t step;
    int events = 0;
    if (input_log_open(&reader, path, &status))
        while (input_log_next(&reader, 500.0, 0, &kind, &step, &status))
            events++;
    MUST(status.code == STATUS_OK || status.text[0] != '\0');
    input_log_close_reader(&reader);
}

static void replay(const char *path)
{
    static InputLogReader reader;
    static Replay replay;
    FuzzWorld *world = fuzz_world();
    Arena *arena = &world->world.arena;
    int blocks = arena->count;
    Status status = {0};
    // The study's reading: an exact log of any rate.
    const ReplayOptions options = {.input = &reader, .any_rate = true, .quiet = true};
    if (input_log_open(&reader, path, &status) &&
        replay_begin(&replay, &world->world, &world->scene, TICKS_MOST, &options, &status)) {
        for (;;) {
            replay_due(&replay);
            if (replay.stopped || sim_steps(world->world.sim) >= replay.end_step ||
                reader.used > EVENTS_MOST)
                break;
            sim_step(world->world.sim);
        }
        fuzz_world_check(world);
        fuzz_print(replay.applied > 0 ? "applied" : "nothing applied");
    }
    fuzz_print(status.text);
    input_log_close_reader(&reader);
    // What the gate took is the last of the world's arena.
    while (arena->count > blocks)
        free(arena->block[--arena->count].memory);
}

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size)
{
    const char *path = fuzz_write("log", data, size);
    read_all(path);
    replay(path);
    return 0;
}
