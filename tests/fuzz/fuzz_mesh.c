// SPDX-License-Identifier: MIT
// A mesh file of any format, as the group `mesh` of a scene names it: read, repaired, placed and
// divided once. Either it is refused, or what comes out is fit for simulation. What follows the
// mark is the .node of TetGen's pair.
#include "fuzz.h"

#include "base/log.h"
#include "scene/build_parts.h"

#define MARK "\n=data=\n"

static const char *write_files(const uint8_t *data, size_t size)
{
    const uint8_t *mark = memmem(data, size, MARK, strlen(MARK));
    if (mark == NULL)
        return fuzz_write("mesh", data, size);
    const uint8_t *rest = mark + strlen(MARK);
    fuzz_write("mesh.node", rest, size - (size_t)(rest - data));
    return fuzz_write("mesh.ele", data, (size_t)(mark - data));
}

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size)
{
    log_set_level(LOG_ERROR);
    // Small meshes show all there is; large ones only take time.
    if (size > 1 << 16)
        return 0;
    SceneBody body = {.name = "a", .mesh = {.kind = MESH_FILE, .scale = 1.0}};
    body.surface.body.levels = 1;
    body.mesh.file = (char *)write_files(data, size);
    TriMesh mesh = {0};
    Levels levels;
    Arena arena = {0};
    Status status = {0};
    bool ok = body_mesh_make(&body, &mesh, &levels, &arena, &status);
    fuzz_print(ok ? "taken" : status.text);
    MUST(ok == (status.code == STATUS_OK));
    MUST(ok || (status.code == STATUS_INVALID && status.text[0] != '\0'));
    MUST(strchr(status.text, '\n') == NULL);
    MeshFault fault;
    MUST(!ok || mesh_check(&mesh, &fault));
    mesh_destroy(&mesh);
    arena_destroy(&arena);
    return 0;
}
