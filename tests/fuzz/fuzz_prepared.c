// SPDX-License-Identifier: MIT
// A prepared file (pliant-prepare) whose data were changed and whose seal is right: each body is
// refused, or what comes out is fit for simulation. With an odd first byte the input is the file
// itself, as it comes.
#include "fuzz.h"

#include "base/log.h"
#include "scene/prepared.h"
#include "hdf_edit.h"
#include "world.h"

#include <stdio.h>

static void make_base(HdfBase *base, FuzzWorld *world)
{
    Status status = {0};
    FILE *nowhere = fopen("/dev/null", "w");
    MUST(nowhere != NULL);
    MUST(prepared_write(fuzz_path("base"), &world->scene, nowhere, &status));
    fclose(nowhere);
    hdf_base_read(base, fuzz_path("base"));
}

static void read_mesh(const Prepared *prepared, const SceneBody *body)
{
    Status status = {0};
    TriMesh mesh = {0};
    Levels levels = {0};
    Arena arena = {0};
    MeshFault fault;
    bool ok = prepared_read(prepared, body, &mesh, &levels, &arena, &status);
    fuzz_print(ok ? "taken" : status.text);
    MUST(ok == (status.code == STATUS_OK));
    MUST(strchr(status.text, '\n') == NULL);
    MUST(!ok || mesh_check(&mesh, &fault));
    mesh_destroy(&mesh);
    arena_destroy(&arena);
}

static void read_voxels(const Prepared *prepared, const SceneBody *body)
{
    Status status = {0};
    Lattice lattice = {0};
    bool ok = prepared_read_voxels(prepared, body, &lattice, &status);
    fuzz_print(ok ? "taken" : status.text);
    MUST(ok == (status.code == STATUS_OK));
    MUST(strchr(status.text, '\n') == NULL);
    MUST(!ok || lattice_solid(&lattice) > 0);
    lattice_destroy(&lattice); // the caller's, also after a failure
}

// Reading it is not enough: a world is made of it.
static void build(FuzzWorld *world, const char *path)
{
    World built;
    Status status = {0};
    const BuildOptions options = {.isa = "baseline", .prepared = path, .may_load = true};
    if (world_build(&built, &world->scene, &options, &status)) {
        FuzzWorld shown = {.world = built};
        sim_step(built.sim);
        fuzz_world_check(&shown);
        world_destroy(&built);
    }
}

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size)
{
    static HdfBase base;
    static FuzzWorld *world;
    if (base.bytes == NULL) {
        world = fuzz_world();
        make_base(&base, world);
    }
    if (size == 0)
        return 0;
    Feed feed = {data + 1, size - 1};
    const char *path = data[0] & 1 ? fuzz_write("edited", data + 1, size - 1)
                                   : hdf_base_edit(&base, "edited", &feed, true);
    Prepared *prepared;
    Status status = {0};
    bool ok = prepared_open(&prepared, path, &status);
    MUST(ok == (status.code == STATUS_OK));
    if (!ok) {
        fuzz_print(status.text);
        return 0;
    }
    for (int i = 0; i < world->scene.body_count; i++) {
        const SceneBody *body = &world->scene.body[i];
        (scene_has_cells(body) ? read_voxels : read_mesh)(prepared, body);
    }
    prepared_close(prepared);
    build(world, path);
    return 0;
}
