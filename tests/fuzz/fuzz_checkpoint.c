// SPDX-License-Identifier: MIT
// A checkpoint (--resume) whose data were changed and whose seal is right: it is refused and the
// world stays as it was, or what it holds can be stepped on. With an odd first byte the input is
// the file itself, as it comes.
#include "fuzz.h"

#include "io/checkpoint.h"
#include "base/fnv.h"
#include "hdf_edit.h"
#include "world.h"

enum { TICKS = 3 };

// Of a world in motion: cut, refined, held by a tool and under a load.
static void make_base(HdfBase *base, FuzzWorld *world)
{
    Sim *sim = world->world.sim;
    char why[256];
    WorldImage image;
    Status status = {0};
    world_image_reserve(&image, &world->world.arena, &world->world);
    const CutOptions cut = {.body = -1,
                            .before = {{{-0.1, 0.001, -0.1}, {-0.1, 0.001, 0.1}}},
                            .after = {{{0.12, 0.001, -0.1}, {0.12, 0.001, 0.1}}}};
    CutOutcome outcome;
    sim_apply_cut(sim, &cut, &outcome, why, sizeof why);
    const LoadOptions load = {.body = 0,
                              .center = {0.05, 0.0, 0.0},
                              .radius = 0.05,
                              .force = {0.2, 0.0, 0.0},
                              .duration = 10.0,
                              .sender = 1,
                              .id = 1};
    sim_apply_load(sim, &load, why, sizeof why);
    for (int i = 0; i < 20; i++) {
        for (int tool = 0; tool < 3; tool++) {
            ToolPose pose = {.utime = 2000 * i,
                             .position = {0.05 * tool, 0.0, 0.07 - 0.001 * i},
                             .orientation = {1.0, 0.0, 0.0, 0.0},
                             .active = true,
                             .grip = i > 10 ? 1.0 : 0.0};
            sim_apply_pose(sim, tool, &pose, false);
        }
        sim_step(sim);
    }
    world_image_take(&image, &world->world);
    MUST(checkpoint_write(fuzz_path("base"), &image, &world->world, &status));
    hdf_base_read(base, fuzz_path("base"));
}

// Of all state but the counters of a sweep, among them the number of topologies, which goes up with
// every restore.
static uint64_t hash_motion(const FuzzWorld *world)
{
    uint64_t hash = FNV_START;
    for (int i = 0; i < world->world.state.count; i++) {
        const StateArray *array = &world->world.state.array[i];
        if (strstr(array->name, "/sweep") == NULL)
            hash = fnv_bytes(hash, state_memory(array), array->bytes);
    }
    return hash;
}

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size)
{
    static HdfBase base;
    FuzzWorld *world = fuzz_world();
    if (base.bytes == NULL) {
        make_base(&base, world);
        world = fuzz_world();
    }
    if (size == 0)
        return 0;
    Feed feed = {data + 1, size - 1};
    const char *path = data[0] & 1 ? fuzz_write("edited", data + 1, size - 1)
                                   : hdf_base_edit(&base, "edited", &feed, true);
    uint64_t before = hash_motion(world);
    Status status = {0};
    bool ok = checkpoint_read(path, &world->world, &status);
    fuzz_print(ok ? "taken" : status.text);
    MUST(ok == (status.code == STATUS_OK));
    if (!ok) {
        MUST(status.text[0] != '\0' && strchr(status.text, '\n') == NULL);
        MUST(hash_motion(world) == before);
    }
    for (int i = 0; i < TICKS; i++)
        sim_step(world->world.sim);
    fuzz_world_check(world);
    return 0;
}
