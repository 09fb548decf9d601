// SPDX-License-Identifier: MIT
// A checkpoint (--resume) whose data were changed and whose seal is right: it is refused and the
// world stays as it was, or what it holds can be stepped on. With bit 0 of the first byte the input
// is the file itself, as it comes; with bit 1 the world is one of solids that adapt.
#include "fuzz.h"

#include "io/checkpoint.h"
#include "base/fnv.h"
#include "hdf_edit.h"
#include "world.h"

enum { TICKS = 3 };

static void keep_base(HdfBase *base, FuzzWorld *world)
{
    WorldImage image;
    Status status = {0};
    world_image_reserve(&image, &world->world.arena, &world->world);
    world_image_take(&image, &world->world);
    MUST(checkpoint_write(fuzz_path("base"), &image, &world->world, &status));
    hdf_base_read(base, fuzz_path("base"));
}

// Of a world in motion: cut, refined, held by a tool and under a load.
static void make_base(HdfBase *base, FuzzWorld *world)
{
    Sim *sim = world->world.sim;
    char why[256];
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
    keep_base(base, world);
}

// Of solids that adapt: one is pressed, so that its elements are divided and merged and a round of
// its error is under way; the other is cut, and a part of it has been taken away.
static void make_base_that_adapts(HdfBase *base, FuzzWorld *world)
{
    Sim *sim = world->world.sim;
    char why[256];
    const CutOptions cut = {.body = -1,
                            .before = {{{-0.1, 0.001, -0.1}, {-0.1, 0.001, 0.1}}},
                            .after = {{{0.2, 0.001, -0.1}, {0.2, 0.001, 0.1}}}};
    for (int i = 0; i < 60; i++) {
        ToolPose pose = {.utime = 2000 * i,
                         .position = {0.001 * i, 0.0, 0.05 - 0.0003 * i},
                         .orientation = {1.0, 0.0, 0.0, 0.0},
                         .active = true};
        sim_apply_pose(sim, 0, &pose, false);
        pose.position = vec3(0.12, 0.03, 0.03);
        pose.grip = 1.0;
        sim_apply_pose(sim, 1, &pose, false);
        CutOutcome outcome;
        if (i == 30)
            sim_apply_cut(sim, &cut, &outcome, why, sizeof why);
        sim_step(sim);
    }
    keep_base(base, world);
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

// Returns the world of an input, as it was at its start, and its checkpoint.
static FuzzWorld *world_of(bool adapts, const HdfBase **out)
{
    static HdfBase bases[2];
    HdfBase *base = &bases[adapts];
    *out = base;
    if (base->bytes == NULL && adapts)
        make_base_that_adapts(base, fuzz_world_that_adapts());
    else if (base->bytes == NULL)
        make_base(base, fuzz_world());
    return adapts ? fuzz_world_that_adapts() : fuzz_world();
}

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size)
{
    if (size == 0)
        return 0;
#ifdef PLIANT_WITH_VOXEL
    const bool adapts = data[0] & 2;
#else
    const bool adapts = false;
#endif
    const HdfBase *base;
    FuzzWorld *world = world_of(adapts, &base);
    Feed feed = {data + 1, size - 1};
    const char *path = data[0] & 1 ? fuzz_write("edited", data + 1, size - 1)
                                   : hdf_base_edit(base, "edited", &feed, true);
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
