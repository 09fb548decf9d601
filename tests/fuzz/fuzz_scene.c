// SPDX-License-Identifier: MIT
// The text of a scene file, with files beside it that it may name: read, and if it is small enough,
// built and run for a tick. It is refused with one line, or what it shows is finite.
#include "fuzz.h"

#include "base/log.h"
#include "scene/build.h"
#include "world.h"

#include <math.h>

// Libconfig 1.5 forgets the text of a string when the syntax is wrong right behind it.
const char *__lsan_default_suppressions(void);
const char *__lsan_default_suppressions(void)
{
    return "leak:strbuf_append\nleak:libconfig_yylex";
}

enum { NODES_MOST = 3000, CELLS_MOST = 2000, STEPS_MOST = 200 };

static void write_beside(void)
{
    static const char OBJ[] = "v 0 0 0\nv .1 0 0\nv 0 .1 0\nv 0 0 .1\n"
                              "f 1 3 2\nf 1 2 4\nf 2 3 4\nf 3 1 4\n";
    static const char NRRD[] = "NRRD0004\ntype: uchar\ndimension: 3\nsizes: 2 2 2\n"
                               "spacings: 10 10 10\nencoding: ascii\n\n1 1 1 1 2 2 1 0\n";
    static const char INCLUDE[] = "gravity = [0.0, 0.0, -1.0];\n";
    static const char LOOP[] = "@include \"loop.cfg\"\n";
    fuzz_write("m.obj", OBJ, strlen(OBJ));
    fuzz_write("v.nrrd", NRRD, strlen(NRRD));
    fuzz_write("i.cfg", INCLUDE, strlen(INCLUDE));
    fuzz_write("loop.cfg", LOOP, strlen(LOOP));
}

static double mesh_nodes(const SceneBody *body)
{
    const MeshSource *mesh = &body->mesh;
    double nodes = mesh->kind == MESH_UV_SPHERE ? (double)mesh->rings * mesh->segments
                   : mesh->kind == MESH_SHEET   ? (double)mesh->columns * mesh->rows
                   : mesh->kind == MESH_FILE    ? 10.0
                                                : mesh->nodes;
    return nodes * pow(4.0, body->surface.body.levels);
}

static double voxel_cells(const VoxelSource *voxels)
{
    if (voxels->kind == VOXELS_BOX)
        return (double)voxels->count[0] * voxels->count[1] * voxels->count[2];
    double across = voxels->kind == VOXELS_MESH || voxels->kind == VOXELS_FILE
                        ? 0.2 * voxels->scale / voxels->size
                        : 2.0 * voxels->radius / voxels->size;
    if (voxels->kind == VOXELS_FILE && voxels->size == 0.0)
        return 8.0;
    return pow(across + 2.0, voxels->kind == VOXELS_DISC ? 2 : 3);
}

// Whether building it takes no longer than an input may.
static bool is_small(const Scene *scene)
{
    double nodes = 0.0, cells = 0.0;
    for (int i = 0; i < scene->body_count; i++) {
        const SceneBody *body = &scene->body[i];
        if (scene_has_cells(body))
            cells += voxel_cells(&body->voxels);
        else
            nodes += mesh_nodes(body);
    }
    return nodes <= NODES_MOST && cells <= CELLS_MOST && scene->node_capacity <= 10000 &&
           scene->face_capacity <= 20000 && scene->threads <= 2;
}

// Ticks may have up to a hundred thousand substeps.
static bool is_quick(const Sim *sim)
{
    for (int i = 0; i < sim_body_count(sim); i++)
        if (sim_body((Sim *)sim, i)->substeps > STEPS_MOST)
            return false;
    return true;
}

static void run(Scene *scene)
{
    World world;
    Status status = {0};
    const BuildOptions options = {.isa = "baseline", .may_load = true, .publishes = true};
    if (world_build(&world, scene, &options, &status)) {
        FuzzWorld shown = {.world = world};
        if (is_quick(world.sim))
            sim_step(world.sim);
        fuzz_world_check(&shown);
        fuzz_print("ran");
        world_destroy(&world);
    } else {
        fuzz_print(status.text);
        MUST(status.code != STATUS_OK && status.text[0] != '\0');
        MUST(strchr(status.text, '\n') == NULL);
    }
}

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size)
{
    static bool ready;
    log_set_level(LOG_ERROR);
    if (!ready)
        write_beside();
    ready = true;
    if (size > 1 << 16)
        return 0;
    Scene scene;
    Status status = {0};
    bool ok = scene_read(fuzz_write("x.cfg", data, size), &scene, &status);
    fuzz_print(ok ? "read" : status.text);
    MUST(ok == (status.code == STATUS_OK));
    if (!ok) {
        MUST(status.code == STATUS_INVALID && strchr(status.text, '\n') == NULL);
        return 0;
    }
    scene.settle_s = 0.0;
    if (is_small(&scene))
        run(&scene);
    scene_destroy(&scene);
    return 0;
}
