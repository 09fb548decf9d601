// Called at load, and by pliant-prepare.
#include "files/prepared.h"

#include "base/check.h"
#include "files/body_mesh.h"
#include "files/fnv.h"
#include "files/hdf.h"

#include <errno.h>
#include <stdlib.h>
#include <string.h>

#ifdef PLIANT_WITH_HDF5

#define PREPARED_FORMAT "pliant-prepared"
enum { PREPARED_VERSION = 1, NAME_TEXT = 128 };

struct Prepared {
    HdfFile file;
    char *path;
};

// --- what a mesh is made from --------------------------------------------------------------------

static bool hash_file(uint64_t *hash, const char *path, Status *status)
{
    unsigned char piece[1 << 16];
    FILE *file = fopen(path, "rb");
    if (file == NULL)
        return status_fail(status, STATUS_INVALID, "%s: %s", path, strerror(errno));
    size_t count;
    while ((count = fread(piece, 1, sizeof piece, file)) > 0)
        *hash = fnv_bytes(*hash, piece, count);
    bool whole = ferror(file) == 0;
    fclose(file);
    return whole || status_fail(status, STATUS_INVALID, "%s: cannot be read", path);
}

static bool hash_source(const MeshSource *source, char text[FNV_TEXT], Status *status)
{
    uint64_t hash = FNV_START;
    const int whole[] = {(int)source->kind, source->nodes,   source->rings,
                         source->segments,  source->columns, source->rows};
    const double real[] = {source->radius, source->width, source->height, source->length,
                           source->scale};
    for (size_t i = 0; i < sizeof whole / sizeof *whole; i++)
        fnv_int(&hash, whole[i]);
    for (size_t i = 0; i < sizeof real / sizeof *real; i++)
        fnv_real(&hash, real[i]);
    fnv_vector(&hash, source->rotation);
    fnv_vector(&hash, source->translation);
    if (source->kind == MESH_FILE && !hash_file(&hash, source->file, status))
        return false;
    fnv_text(text, hash);
    return true;
}

// The name of a body's group, or of something in it.
static const char *path_of(char text[NAME_TEXT], const char *body, const char *rest)
{
    snprintf(text, NAME_TEXT, "/bodies/%s%s", body, rest);
    return text;
}

static const char *level_path(char text[NAME_TEXT], const char *body, int level, const char *rest)
{
    snprintf(text, NAME_TEXT, "/bodies/%s/level%d/%s", body, level, rest);
    return text;
}

// --- writing -------------------------------------------------------------------------------------

static bool write_ints(const HdfFile *file, const char *name, int rows, int columns,
                       const void *data)
{
    const hsize_t size[2] = {(hsize_t)rows, (hsize_t)columns};
    return hdf_write(file, name, H5T_NATIVE_INT, columns == 1 ? 1 : 2, size, data, "1");
}

static bool write_mesh(const HdfFile *file, const char *body, const TriMesh *mesh)
{
    char name[NAME_TEXT];
    return write_ints(file, path_of(name, body, "/triangle"), mesh->triangle_count, 3,
                      mesh->triangle) &&
           write_ints(file, path_of(name, body, "/file_index"), mesh->node_count, 1,
                      mesh->file_index) &&
           (mesh->file_node == NULL || write_ints(file, path_of(name, body, "/file_node"),
                                                  mesh->file_node_count, 1, mesh->file_node)) &&
           (mesh->copy_count == 0 ||
            write_ints(file, path_of(name, body, "/copy_of"), mesh->copy_count, 1, mesh->copy_of));
}

static bool write_levels(const HdfFile *file, const char *body, const Levels *levels)
{
    bool ok = true;
    for (int l = 0; l <= levels->finest && ok; l++) {
        const Level *level = &levels->level[l];
        char name[NAME_TEXT];
        ok = write_ints(file, level_path(name, body, l, "edge"), level->edge_count, 2,
                        level->edge) &&
             write_ints(file, level_path(name, body, l, "edge_face"), level->edge_count, 2,
                        level->edge_face) &&
             write_ints(file, level_path(name, body, l, "face_edge"), level->face_count, 3,
                        level->face_edge);
    }
    return ok;
}

// `levels` is NULL for a body without.
static bool write_body(const HdfFile *file, const SceneBody *body, const TriMesh *mesh,
                       const Levels *levels)
{
    char group[NAME_TEXT], name[NAME_TEXT], source[FNV_TEXT];
    path_of(group, body->name, "");
    int nodes = levels != NULL ? levels->level[levels->finest].node_count : mesh->node_count;
    const hsize_t size[2] = {(hsize_t)nodes, 3};
    return hash_source(&body->mesh, source, file->status) &&
           hdf_write(file, path_of(name, body->name, "/position"), H5T_NATIVE_DOUBLE, 2, size,
                     levels != NULL ? levels->position : mesh->position, "m") &&
           write_mesh(file, body->name, mesh) &&
           (levels == NULL || write_levels(file, body->name, levels)) &&
           hdf_write_text(file, group, "source", source) &&
           hdf_write_int(file, group, "levels", body->surface.levels) &&
           hdf_write_int(file, group, "file_nodes", mesh->file_node_count) &&
           hdf_write_int(file, group, "copies", mesh->copy_count);
}

static bool prepare_body(const HdfFile *file, const SceneBody *body, FILE *report, Status *status)
{
    TriMesh mesh = {0};
    Arena arena = {0};
    Levels levels;
    int finest = body->surface.levels;
    bool ok = body_mesh_make(body, &mesh, &levels, &arena, status) &&
              write_body(file, body, &mesh, finest > 0 ? &levels : NULL);
    if (ok)
        fprintf(report, "body %s: %d nodes, %d faces; finest level %d: %d nodes, %d faces\n",
                body->name, mesh.node_count, mesh.triangle_count, finest,
                finest > 0 ? levels.level[finest].node_count : mesh.node_count,
                finest > 0 ? levels.level[finest].face_count : mesh.triangle_count);
    arena_destroy(&arena);
    mesh_destroy(&mesh);
    return ok;
}

bool prepared_write(const char *path, const Scene *scene, FILE *report, Status *status)
{
    HdfFile file;
    if (!hdf_create(&file, path, status))
        return false;
    bool ok = hdf_write_text(&file, "/", "format", PREPARED_FORMAT) &&
              hdf_write_int(&file, "/", "version", PREPARED_VERSION) &&
              hdf_write_text(&file, "/", "scene", scene->text) &&
              hdf_write_text(&file, "/", "created_by", "pliant-prepare " PLIANT_VERSION);
    for (int i = 0; i < scene->body_count && ok; i++) {
        Status said = {0};
        ok = prepare_body(&file, &scene->body[i], report, &said);
        if (said.code != STATUS_OK)
            status_fail(status, said.code, "%s:%d: %s", scene->path, scene->body[i].line,
                        said.text);
    }
    ok = ok && hdf_save(&file);
    hdf_close(&file);
    return ok;
}

// --- reading -------------------------------------------------------------------------------------

static bool check_head(const HdfFile *file)
{
    char text[64];
    int version = 0;
    if (!hdf_read_text(file, "/", "format", text, sizeof text))
        return false;
    if (strcmp(text, PREPARED_FORMAT) != 0)
        return hdf_fail(file, "/", "format \"%.40s\" must be \"%s\"", text, PREPARED_FORMAT);
    return hdf_read_int(file, "/", "version", &version) &&
           (version == PREPARED_VERSION ||
            hdf_fail(file, "/", "version %d must be %d", version, PREPARED_VERSION));
}

bool prepared_open(Prepared **prepared, const char *path, Status *status)
{
    *prepared = calloc(1, sizeof **prepared);
    ASSERT(*prepared != NULL);
    (*prepared)->path = strdup(path);
    ASSERT((*prepared)->path != NULL);
    HdfFile *file = &(*prepared)->file;
    file->id = -1;
    if (hdf_check_seal(path, status) && hdf_open(file, (*prepared)->path, status) &&
        check_head(file))
        return true;
    prepared_close(*prepared);
    *prepared = NULL;
    return false;
}

void prepared_close(Prepared *prepared)
{
    if (prepared == NULL)
        return;
    hdf_close(&prepared->file);
    free(prepared->path);
    free(prepared);
}

// Whether the group was made from what the scene says now.
static bool check_source(const HdfFile *file, const SceneBody *body)
{
    char group[NAME_TEXT], found[64], source[FNV_TEXT];
    int levels = 0;
    path_of(group, body->name, "");
    if (!hdf_exists(file, "/bodies") || !hdf_exists(file, group))
        return hdf_fail(file, group, "is missing: the file was prepared for another scene");
    if (!hash_source(&body->mesh, source, file->status) ||
        !hdf_read_text(file, group, "source", found, sizeof found) ||
        !hdf_read_int(file, group, "levels", &levels))
        return false;
    if (strcmp(found, source) != 0)
        return hdf_fail(file, group, "was prepared from another mesh than this scene's");
    return levels == body->surface.levels ||
           hdf_fail(file, group, "was prepared with levels %d, the scene has %d", levels,
                    body->surface.levels);
}

// Whether names of nodes lead from mesh to file and back as mesh.h says.
static bool check_names(const TriMesh *mesh)
{
    int own = mesh->node_count - mesh->copy_count; // nodes that are no copies
    if (own < 0 ||
        (mesh->file_node == NULL && (own != mesh->file_node_count || own < mesh->node_count)))
        return false;
    for (int i = 0; i < own; i++) {
        int index = mesh->file_index[i];
        if (index < 0 || index >= mesh->file_node_count || mesh_node_of_file(mesh, index) != i ||
            (i > 0 && index <= mesh->file_index[i - 1]))
            return false;
    }
    for (int c = 0; c < mesh->copy_count; c++) {
        int node = mesh_node_of_file(mesh, mesh->copy_of[c]);
        if (mesh->file_index[own + c] != mesh->file_node_count + c || node < 0 || node >= own)
            return false;
    }
    for (int k = 0; mesh->file_node != NULL && k < mesh->file_node_count; k++)
        if (mesh->file_node[k] < -1 || mesh->file_node[k] >= mesh->node_count)
            return false;
    return true;
}

// Reads [count] integers into memory of their own.
static bool read_names(const HdfFile *file, const char *name, int count, int **to)
{
    if (hdf_count_ints(file, name, 1) != count)
        return hdf_fail(file, name, "must have %d rows", count);
    *to = malloc((size_t)count * sizeof **to + 1);
    ASSERT(*to != NULL);
    return hdf_read_ints(file, name, 1, count, *to);
}

// Everything of the mesh but positions.
static bool read_mesh(const HdfFile *file, const char *body, TriMesh *mesh)
{
    char group[NAME_TEXT], triangle[NAME_TEXT], index[NAME_TEXT], name[NAME_TEXT];
    path_of(group, body, "");
    path_of(triangle, body, "/triangle");
    path_of(index, body, "/file_index");
    int64_t faces = hdf_count_ints(file, triangle, 3), nodes = hdf_count_ints(file, index, 1);
    int file_nodes = 0, copies = 0;
    if (faces < 0 || nodes < 0 || !hdf_read_int(file, group, "file_nodes", &file_nodes) ||
        !hdf_read_int(file, group, "copies", &copies))
        return false;
    if (file_nodes < 0 || file_nodes > MESH_COUNT_MAX || copies < 0 || copies > nodes)
        return hdf_fail(file, group, "has %d nodes in its file and %d copies", file_nodes, copies);
    mesh_create(mesh, (int)nodes, (int)faces);
    mesh->file_node_count = file_nodes;
    mesh->copy_count = copies;
    if (!hdf_read_ints(file, triangle, 3, faces, &mesh->triangle[0][0]) ||
        !hdf_read_ints(file, index, 1, nodes, mesh->file_index))
        return false;
    if (hdf_exists(file, path_of(name, body, "/file_node")) &&
        !read_names(file, name, file_nodes, &mesh->file_node))
        return false;
    if (copies > 0 && !read_names(file, path_of(name, body, "/copy_of"), copies, &mesh->copy_of))
        return false;
    return check_names(mesh) || hdf_fail(file, group, "has inconsistent numbers of nodes");
}

// Room for the levels, and their tables but faces; positions are read by the caller.
static bool read_levels(const HdfFile *file, const SceneBody *body, const TriMesh *mesh,
                        Levels *levels, Arena *arena)
{
    char group[NAME_TEXT], edge[NAME_TEXT], edge_face[NAME_TEXT], face_edge[NAME_TEXT];
    Status said = {0};
    bool ok = true;
    // A file that is too small for its levels is refused before memory is taken for them.
    int64_t first = hdf_count_ints(file, level_path(edge, body->name, 0, "edge"), 2);
    int64_t edges = first, faces = mesh->triangle_count;
    for (int l = 0; l <= body->surface.levels; l++) {
        int64_t rows = hdf_count_ints(file, level_path(edge, body->name, l, "edge"), 2);
        if (rows < 0 || rows != edges)
            return hdf_fail(file, edge, "must have %lld rows", (long long)edges);
        edges = 2 * edges + 3 * faces;
        faces *= 4;
    }
    const int count[3] = {mesh->node_count, (int)first, mesh->triangle_count};
    if (!levels_reserve(levels, count, body->surface.levels, body->name, arena, &said))
        return hdf_fail(file, path_of(group, body->name, ""), "%s", said.text);
    for (int l = 0; l <= levels->finest && ok; l++) {
        Level *level = &levels->level[l];
        ok = hdf_read_ints(file, level_path(edge, body->name, l, "edge"), 2, level->edge_count,
                           &level->edge[0][0]) &&
             hdf_read_ints(file, level_path(edge_face, body->name, l, "edge_face"), 2,
                           level->edge_count, &level->edge_face[0][0]) &&
             hdf_read_ints(file, level_path(face_edge, body->name, l, "face_edge"), 3,
                           level->face_count, &level->face_edge[0][0]);
    }
    return ok;
}

static bool read_body(const HdfFile *file, const SceneBody *body, TriMesh *mesh, Levels *levels,
                      Arena *arena)
{
    char group[NAME_TEXT], position[NAME_TEXT];
    path_of(group, body->name, "");
    path_of(position, body->name, "/position");
    bool divided = body->surface.levels > 0;
    if (!check_source(file, body) || !read_mesh(file, body->name, mesh) ||
        (divided && !read_levels(file, body, mesh, levels, arena)))
        return false;
    int nodes = divided ? levels->level[levels->finest].node_count : mesh->node_count;
    Vec3 *to = divided ? levels->position : mesh->position;
    if (!hdf_read_vectors(file, position, nodes, to))
        return false;
    if (divided)
        memcpy(mesh->position, to, (size_t)mesh->node_count * sizeof *to);
    MeshFault fault;
    if (!mesh_validate(mesh, &fault))
        return hdf_fail(file, group, "%s", fault.text);
    Status said = {0};
    return !divided || levels_validate(levels, mesh, &said) ||
           hdf_fail(file, group, "%s", said.text);
}

bool prepared_read(const Prepared *prepared, const SceneBody *body, TriMesh *mesh, Levels *levels,
                   Arena *arena, Status *status)
{
    HdfFile file = prepared->file;
    file.status = status;
    return read_body(&file, body, mesh, levels, arena);
}

#else

bool prepared_write(const char *path, const Scene *scene, FILE *report, Status *status)
{
    (void)scene, (void)report;
    return status_fail(status, STATUS_INVALID, "%s: %s", path, HDF_NOT_BUILT);
}

bool prepared_open(Prepared **prepared, const char *path, Status *status)
{
    *prepared = NULL;
    return status_fail(status, STATUS_INVALID, "%s: %s", path, HDF_NOT_BUILT);
}

bool prepared_read(const Prepared *prepared, const SceneBody *body, TriMesh *mesh, Levels *levels,
                   Arena *arena, Status *status)
{
    (void)prepared, (void)body, (void)mesh, (void)levels, (void)arena, (void)status;
    return false;
}

void prepared_close(Prepared *prepared)
{
    (void)prepared;
}

#endif
