// Meshes from generators and files, and their levels. Called once per body, at load time.
#include "scene/body_mesh.h"

#include "base/log.h"
#include "scene/memory.h"
#include "io/mesh_import.h"
#include "geometry/generator.h"

bool body_mesh_check_extent(const char *file, double scale, const TriMesh *mesh, Status *status)
{
    double extent = mesh_extent(mesh);
    if (mesh_extent_fits(extent))
        return true;
    return status_fail(status, STATUS_INVALID,
                       "%s: measures %g m after scale %g, outside [%g, %g] m; scale is metres a "
                       "unit of the file, 0.001 for millimetres",
                       file, extent, scale, MESH_SMALLEST_EXTENT, MESH_LARGEST_EXTENT);
}

bool body_mesh_import(const char *file, double scale, Vec3 rotation, Vec3 translation,
                      TriMesh *mesh, Status *status)
{
    MeshImport import;
    char repairs[512];
    if (!mesh_import(file, mesh, &import, status))
        return false;
    mesh_repairs_text(&import.repairs, repairs, sizeof repairs);
    if (repairs[0] != '\0')
        log_line(LOG_INFO, "%s: %s", file, repairs);
    mesh_place(mesh, scale, rotation, translation);
    return body_mesh_check_extent(file, scale, mesh, status);
}

static bool generate_mesh(const MeshSource *source, TriMesh *mesh, Status *status)
{
    switch (source->kind) {
    case MESH_FILE:
        break;
    case MESH_SPHERE:
        return generate_sphere(mesh, source->nodes, source->radius, status);
    case MESH_UV_SPHERE:
        return generate_uv_sphere(mesh, source->rings, source->segments, source->radius, status);
    case MESH_ICO_SPHERE: {
        int subdivisions = 0;
        for (int nodes = 12; nodes < source->nodes; nodes = 4 * nodes - 6)
            subdivisions++;
        return generate_ico_sphere(mesh, subdivisions, source->radius, status);
    }
    case MESH_SHEET:
        return generate_sheet(mesh, source->columns, source->rows, source->width, source->height,
                              status);
    case MESH_STOMACH:
        return generate_stomach(mesh, source->nodes, source->length, status);
    }
    return status_fail(status, STATUS_INVALID, "unknown generator of a mesh");
}

static bool place_mesh(const MeshSource *source, TriMesh *mesh, Status *status)
{
    if (source->kind == MESH_FILE) {
        if (!body_mesh_import(source->file, source->scale, source->rotation, source->translation,
                              mesh, status))
            return false;
    } else {
        if (!generate_mesh(source, mesh, status))
            return false;
        generate_texture(mesh, source->kind != MESH_SHEET);
        mesh_place(mesh, source->scale, source->rotation, source->translation);
        if (!body_mesh_check_extent("mesh", source->scale, mesh, status))
            return false;
    }
    MeshFault fault;
    if (mesh_check(mesh, &fault))
        return true;
    return status_fail(status, STATUS_INVALID, "%s: %s",
                       source->kind == MESH_FILE ? source->file : "mesh", fault.text);
}

bool body_mesh_make(const SceneBody *body, TriMesh *mesh, Levels *levels, Arena *arena,
                    Status *status)
{
    int finest = body->options.levels;
    return memory_check_surface(body, memory_source_nodes(&body->mesh), status) &&
           place_mesh(&body->mesh, mesh, status) &&
           memory_check_surface(body, mesh->node_count, status) &&
           (finest == 0 || levels_create(levels, mesh, finest, body->name, arena, status));
}

bool body_skin_make(const SceneBody *body, TriMesh *mesh, Status *status)
{
    return place_mesh(&body->skin, mesh, status);
}
