// SPDX-License-Identifier: MIT
// Meshes with their levels, and lattices, in prepared files.
#include "scene/prepared_parts.h"

#include "base/check.h"
#include "geometry/mesh.h"
#include "io/volume_import.h"
#include "scene/build_parts.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

// --- meshes and their levels ---------------------------------------------------------------------

#ifdef PLIANT_WITH_HDF5

static bool hash_mesh_source(const MeshSource *source, uint64_t *hash, Status *status)
{
    *hash = FNV_START;
    // Every key that the mesh depends on, and the bytes of its file.
    const int whole[] = {(int)source->kind, source->nodes,   source->rings,
                         source->segments,  source->columns, source->rows};
    const double real[] = {source->radius, source->width, source->height, source->length,
                           source->scale};
    for (size_t i = 0; i < sizeof whole / sizeof *whole; i++)
        fnv_int(hash, whole[i]);
    for (size_t i = 0; i < sizeof real / sizeof *real; i++)
        fnv_real(hash, real[i]);
    fnv_vector(hash, source->rotation);
    fnv_vector(hash, source->translation);
    return source->kind != MESH_FILE || prepared_hash_file(hash, source->file, status);
}

static const char *level_path(char text[PREPARED_NAME], const char *body, int level,
                              const char *rest)
{
    snprintf(text, PREPARED_NAME, "/bodies/%s/level%d/%s", body, level, rest);
    return text;
}

// --- writing ---

static bool write_ints(const HdfFile *file, const char *name, int rows, int columns,
                       const void *data)
{
    const hsize_t size[2] = {(hsize_t)rows, (hsize_t)columns};
    return hdf_write(file, name, H5T_NATIVE_INT, columns == 1 ? 1 : 2, size, data, "1");
}

static bool write_mesh(const HdfFile *file, const char *body, const TriMesh *mesh)
{
    char name[PREPARED_NAME];
    // Tables that a mesh need not have are not written.
    return write_ints(file, prepared_path(name, body, "/triangle"), mesh->triangle_count, 3,
                      mesh->triangle) &&
           write_ints(file, prepared_path(name, body, "/file_index"), mesh->node_count, 1,
                      mesh->file_index) &&
           (mesh->file_node == NULL || write_ints(file, prepared_path(name, body, "/file_node"),
                                                  mesh->file_node_count, 1, mesh->file_node)) &&
           (mesh->copy_count == 0 || write_ints(file, prepared_path(name, body, "/copy_of"),
                                                mesh->copy_count, 1, mesh->copy_of)) &&
           (mesh->uv == NULL ||
            hdf_write(file, prepared_path(name, body, "/texture"), H5T_NATIVE_DOUBLE, 1,
                      (hsize_t[]){2 * (hsize_t)mesh->node_count}, mesh->uv, "1"));
}

static bool write_levels(const HdfFile *file, const char *body, const Levels *levels)
{
    bool ok = true;
    for (int l = 0; l <= levels->finest && ok; l++) {
        const Level *level = &levels->level[l];
        char name[PREPARED_NAME];
        ok = write_ints(file, level_path(name, body, l, "edge"), level->edge_count, 2,
                        level->edge) &&
             write_ints(file, level_path(name, body, l, "edge_face"), level->edge_count, 2,
                        level->edge_face) &&
             write_ints(file, level_path(name, body, l, "face_edge"), level->face_count, 3,
                        level->face_edge);
    }
    return ok;
}

// `levels` is NULL for a body without levels.
static bool write_body(const HdfFile *file, const SceneBody *body, const TriMesh *mesh,
                       const Levels *levels)
{
    char group[PREPARED_NAME], name[PREPARED_NAME];
    uint64_t source;
    prepared_path(group, body->name, "");
    int nodes = levels != NULL ? levels->level[levels->finest].node_count : mesh->node_count;
    const hsize_t size[2] = {(hsize_t)nodes, 3};
    return hash_mesh_source(&body->mesh, &source, file->status) &&
           hdf_write(file, prepared_path(name, body->name, "/position"), H5T_NATIVE_DOUBLE, 2, size,
                     levels != NULL ? levels->position : mesh->position, "m") &&
           write_mesh(file, body->name, mesh) &&
           (levels == NULL || write_levels(file, body->name, levels)) &&
           prepared_write_source(file, body, source) &&
           hdf_write_int(file, group, "levels", body->options.levels) &&
           hdf_write_int(file, group, "file_nodes", mesh->file_node_count) &&
           hdf_write_int(file, group, "copies", mesh->copy_count);
}

bool prepared_write_mesh(const HdfFile *file, const SceneBody *body, FILE *report)
{
    TriMesh mesh = {0};
    Arena arena = {0};
    Levels levels;
    int finest = body->options.levels;
    bool ok = body_mesh_make(body, &mesh, &levels, &arena, file->status) &&
              write_body(file, body, &mesh, finest > 0 ? &levels : NULL);
    // What came out, for the user.
    if (ok)
        fprintf(report, "body %s: %d nodes, %d faces; finest level %d: %d nodes, %d faces\n",
                body->name, mesh.node_count, mesh.triangle_count, finest,
                finest > 0 ? levels.level[finest].node_count : mesh.node_count,
                finest > 0 ? levels.level[finest].face_count : mesh.triangle_count);
    arena_destroy(&arena);
    mesh_destroy(&mesh);
    return ok;
}

// --- reading ---

// True if the group was made from what the scene says now.
static bool check_source(const HdfFile *file, const SceneBody *body)
{
    char group[PREPARED_NAME];
    uint64_t source;
    int levels = 0;
    prepared_path(group, body->name, "");
    if (!hash_mesh_source(&body->mesh, &source, file->status) ||
        !prepared_check_source(file, body, source, "mesh") ||
        !hdf_read_int(file, group, "levels", &levels))
        return false;
    return levels == body->options.levels ||
           hdf_fail(file, group, "was prepared with levels %d, the scene has %d", levels,
                    body->options.levels);
}

// True if the node names map between mesh and file as mesh.h requires.
static bool check_names(const TriMesh *mesh)
{
    // Nodes of the file, in its order, come first; each must point back to its row,
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
    // then copies, each of a node of the file,
    for (int c = 0; c < mesh->copy_count; c++) {
        int node = mesh_node_of_file(mesh, mesh->copy_of[c]);
        if (mesh->file_index[own + c] != mesh->file_node_count + c || node < 0 || node >= own)
            return false;
    }
    // then what became of each row of the file.
    for (int k = 0; mesh->file_node != NULL && k < mesh->file_node_count; k++)
        if (mesh->file_node[k] < -1 || mesh->file_node[k] >= mesh->node_count)
            return false;
    return true;
}

// Reads [count] integers into newly allocated memory.
static bool read_names(const HdfFile *file, const char *name, int count, int **to)
{
    if (hdf_count_ints(file, name, 1) != count)
        return hdf_fail(file, name, "must have %d rows", count);
    *to = malloc((size_t)count * sizeof **to + 1);
    ASSERT(*to != NULL);
    return hdf_read_ints(file, name, 1, count, *to);
}

static bool read_texture(const HdfFile *file, const char *name, TriMesh *mesh)
{
    const size_t values = 2 * (size_t)mesh->node_count;
    mesh->uv = calloc(values + 2, sizeof(double));
    ASSERT(mesh->uv != NULL);
    // Coordinates that are no numbers would spoil a picture.
    if (!hdf_read_numbers(file, name, H5T_NATIVE_DOUBLE, values, mesh->uv))
        return false;
    for (size_t i = 0; i < values; i++)
        if (!isfinite(mesh->uv[i / 2][i % 2]))
            return hdf_fail(file, name, "has a number that is not finite");
    return true;
}

// Reads all of the mesh except positions.
static bool read_mesh(const HdfFile *file, const char *body, TriMesh *mesh)
{
    char group[PREPARED_NAME], triangle[PREPARED_NAME], index[PREPARED_NAME], name[PREPARED_NAME];
    prepared_path(group, body, "");
    prepared_path(triangle, body, "/triangle");
    prepared_path(index, body, "/file_index");
    // Sizes first: they say how much memory is needed.
    int64_t faces = hdf_count_ints(file, triangle, 3), nodes = hdf_count_ints(file, index, 1);
    int file_nodes = 0, copies = 0;
    if (faces < 0 || nodes < 0 || !hdf_read_int(file, group, "file_nodes", &file_nodes) ||
        !hdf_read_int(file, group, "copies", &copies))
        return false;
    if (file_nodes < 0 || file_nodes > MESH_COUNT_MAX || copies < 0 || copies > nodes)
        return hdf_fail(file, group, "has %d nodes in its file and %d copies", file_nodes, copies);
    // Triangles and names; the tables of joined, split and textured nodes where there are any.
    mesh_create(mesh, (int)nodes, (int)faces);
    mesh->file_node_count = file_nodes;
    mesh->copy_count = copies;
    if (!hdf_read_ints(file, triangle, 3, faces, &mesh->triangle[0][0]) ||
        !hdf_read_ints(file, index, 1, nodes, mesh->file_index))
        return false;
    if (hdf_exists(file, prepared_path(name, body, "/file_node")) &&
        !read_names(file, name, file_nodes, &mesh->file_node))
        return false;
    if (copies > 0 &&
        !read_names(file, prepared_path(name, body, "/copy_of"), copies, &mesh->copy_of))
        return false;
    if (hdf_exists(file, prepared_path(name, body, "/texture")) && !read_texture(file, name, mesh))
        return false;
    return check_names(mesh) || hdf_fail(file, group, "has inconsistent numbers of nodes");
}

// Allocates the levels and reads their tables except faces; the caller reads positions.
static bool read_levels(const HdfFile *file, const SceneBody *body, const TriMesh *mesh,
                        Levels *levels, Arena *arena)
{
    char group[PREPARED_NAME], edge[PREPARED_NAME], edge_face[PREPARED_NAME],
        face_edge[PREPARED_NAME];
    Status said = {0};
    bool ok = true;
    // Refuse a file that is too small for its levels before allocating memory for them.
    int64_t first = hdf_count_ints(file, level_path(edge, body->name, 0, "edge"), 2);
    int64_t edges = first, faces = mesh->triangle_count;
    for (int l = 0; l <= body->options.levels; l++) {
        int64_t rows = hdf_count_ints(file, level_path(edge, body->name, l, "edge"), 2);
        if (rows < 0 || rows != edges)
            return hdf_fail(file, edge, "must have %lld rows", (long long)edges);
        edges = 2 * edges + 3 * faces;
        faces *= 4;
    }
    // All levels in one reservation.
    const int count[3] = {mesh->node_count, (int)first, mesh->triangle_count};
    if (!levels_reserve(levels, count, body->options.levels, body->name, arena, &said))
        return hdf_fail(file, prepared_path(group, body->name, ""), "%s", said.text);
    // The tables of each level.
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
    char group[PREPARED_NAME], position[PREPARED_NAME];
    prepared_path(group, body->name, "");
    prepared_path(position, body->name, "/position");
    // The source decides whether the file is for this mesh at all.
    bool divided = body->options.levels > 0;
    if (!check_source(file, body) || !read_mesh(file, body->name, mesh) ||
        (divided && !read_levels(file, body, mesh, levels, arena)))
        return false;
    // With levels the positions are those of the finest; the first of them are the mesh's.
    int nodes = divided ? levels->level[levels->finest].node_count : mesh->node_count;
    Vec3 *to = divided ? levels->position : mesh->position;
    if (!hdf_read_vectors(file, position, nodes, to))
        return false;
    if (divided)
        memcpy(mesh->position, to, (size_t)mesh->node_count * sizeof *to);
    // What a file says is checked like what a mesh file says.
    MeshFault fault;
    if (!mesh_check(mesh, &fault))
        return hdf_fail(file, group, "%s", fault.text);
    Status said = {0};
    return !divided || levels_check(levels, mesh, &said) || hdf_fail(file, group, "%s", said.text);
}

bool prepared_read(const Prepared *prepared, const SceneBody *body, TriMesh *mesh, Levels *levels,
                   Arena *arena, Status *status)
{
    HdfFile file = prepared->file;
    file.status = status;
    return read_body(&file, body, mesh, levels, arena) && hdf_alive(&file);
}

#else

bool prepared_read(const Prepared *prepared, const SceneBody *body, TriMesh *mesh, Levels *levels,
                   Arena *arena, Status *status)
{
    (void)prepared, (void)body, (void)mesh, (void)levels, (void)arena, (void)status;
    return false;
}

#endif

// --- lattices ------------------------------------------------------------------------------------

#if defined(PLIANT_WITH_HDF5) && defined(PLIANT_WITH_LATTICES)

// Hashes the source files: for a detached header both.
static bool hash_files(const VoxelSource *source, uint64_t *hash, Status *status)
{
    char *data = NULL;
    bool ok = (source->kind != VOXELS_FILE || volume_find_data(source->file, &data, status)) &&
              prepared_hash_file(hash, source->file, status) &&
              (data == NULL || prepared_hash_file(hash, data, status));
    free(data);
    return ok;
}

static bool hash_voxels_source(const VoxelSource *source, uint64_t *hash, Status *status)
{
    // Every key that the lattice depends on, and the bytes of its files.
    *hash = fnv_bytes(FNV_START, "voxels", sizeof "voxels");
    fnv_int(hash, source->kind);
    fnv_int(hash, source->label_count);
    for (int i = 0; i < source->label_count; i++)
        fnv_int(hash, source->label[i]);
    if (source->layer > 0) // files of before it was a key are as they were
        fnv_int(hash, source->layer);
    for (int k = 0; k < 3; k++)
        fnv_int(hash, source->count[k]);
    fnv_real(hash, source->radius);
    fnv_real(hash, source->size);
    fnv_real(hash, source->scale);
    fnv_vector(hash, source->rotation);
    fnv_vector(hash, source->translation);
    // A later key: files that were made before it stay valid.
    if (source->inner != INNER_CAVITY)
        fnv_int(hash, source->inner);
    return source->file == NULL || hash_files(source, hash, status);
}

// --- writing ---

static bool write_lattice(const HdfFile *file, const SceneBody *body, const Lattice *lattice)
{
    char name[PREPARED_NAME];
    uint64_t source;
    // Turn and cells as HDF5 takes them.
    const double turn[] = {lattice->turn.w, lattice->turn.x, lattice->turn.y, lattice->turn.z};
    const hsize_t cells =
        (hsize_t)lattice->count[0] * (hsize_t)lattice->count[1] * (hsize_t)lattice->count[2];
    const hsize_t three = 3, four = 4, row[2] = {1, 3};
    return hash_voxels_source(&body->voxels, &source, file->status) &&
           hdf_write(file, prepared_path(name, body->name, "/count"), H5T_NATIVE_INT, 1, &three,
                     lattice->count, "1") &&
           hdf_write(file, prepared_path(name, body->name, "/label"), H5T_NATIVE_UINT8, 1, &cells,
                     lattice->label, "1") &&
           hdf_write(file, prepared_path(name, body->name, "/size"), H5T_NATIVE_DOUBLE, 0, NULL,
                     &lattice->size, "m") &&
           hdf_write(file, prepared_path(name, body->name, "/origin"), H5T_NATIVE_DOUBLE, 2, row,
                     &lattice->origin, "m") &&
           hdf_write(file, prepared_path(name, body->name, "/turn"), H5T_NATIVE_DOUBLE, 1, &four,
                     turn, "1") &&
           prepared_write_source(file, body, source);
}

bool prepared_write_voxels(const HdfFile *file, const SceneBody *body, FILE *report)
{
    Lattice lattice = {0};
    bool ok = body_voxels_make(&body->voxels, &lattice, file->status) &&
              write_lattice(file, body, &lattice);
    if (ok)
        fprintf(report, "body %s: %d x %d x %d cells of %.6g m, %ld solid\n", body->name,
                lattice.count[0], lattice.count[1], lattice.count[2], lattice.size,
                lattice_solid(&lattice));
    lattice_destroy(&lattice);
    return ok;
}

// --- reading ---

// Allocates the labels after checking that the file holds so many.
static bool reserve_lattice(const HdfFile *file, const char *body, Lattice *lattice)
{
    char name[PREPARED_NAME];
    int count[3];
    double size;
    if (!hdf_read_numbers(file, prepared_path(name, body, "/count"), H5T_NATIVE_INT, 3, count) ||
        !hdf_read_numbers(file, prepared_path(name, body, "/size"), H5T_NATIVE_DOUBLE, 0, &size))
        return false;
    // The stated counts must give the stored number of cells, without overflow.
    int64_t cells = hdf_count_ints(file, prepared_path(name, body, "/label"), 1), wanted = 1;
    if (cells < 0)
        return false;
    for (int k = 0; k < 3; k++)
        wanted = count[k] < 1 || wanted > cells ? 0 : wanted * count[k];
    if (wanted != cells)
        return hdf_fail(file, name, "has %lld cells, the lattice %d x %d x %d", (long long)cells,
                        count[0], count[1], count[2]);
    Status said = {0};
    if (!lattice_create(lattice, count, size, &said))
        return hdf_fail(file, prepared_path(name, body, ""), "%s", said.text);
    // And their size must make a body.
    double extent = size * fmax(count[0], fmax(count[1], count[2]));
    return mesh_extent_fits(extent) || hdf_fail(file, prepared_path(name, body, "/size"),
                                                "makes a body of %g m, outside [%g, %g]", extent,
                                                MESH_SMALLEST_EXTENT, MESH_LARGEST_EXTENT);
}

// True if every label has a material and some cell is solid.
static bool check_labels(const Lattice *lattice, int materials)
{
    size_t cells =
        (size_t)lattice->count[0] * (size_t)lattice->count[1] * (size_t)lattice->count[2];
    int most = 0;
    for (size_t i = 0; i < cells; i++)
        most = lattice->label[i] > most ? lattice->label[i] : most;
    return most > 0 && most <= materials && lattice_solid(lattice) <= LATTICE_MOST_SOLID;
}

static bool read_lattice(const HdfFile *file, const SceneBody *body, Lattice *lattice)
{
    char name[PREPARED_NAME];
    uint64_t source;
    double turn[4];
    // The file is for these voxels, and large enough.
    if (!hash_voxels_source(&body->voxels, &source, file->status) ||
        !prepared_check_source(file, body, source, "source of voxels") ||
        !reserve_lattice(file, body->name, lattice))
        return false;
    // Cells and what they are made of.
    size_t cells =
        (size_t)lattice->count[0] * (size_t)lattice->count[1] * (size_t)lattice->count[2];
    if (!hdf_read_bytes(file, prepared_path(name, body->name, "/label"), cells, lattice->label))
        return false;
    if (!check_labels(lattice, body->voxels.label_count))
        return hdf_fail(file, name, "has no solid cell, too many, or one without a material");
    // Where it stands,
    const Vec3 *origin = &lattice->origin;
    if (!hdf_read_vectors(file, prepared_path(name, body->name, "/origin"), 1, &lattice->origin))
        return false;
    if (!(fmax(fabs(origin->x), fmax(fabs(origin->y), fabs(origin->z))) <= LATTICE_FARTHEST))
        return hdf_fail(file, name, "lies farther than %g m away", LATTICE_FARTHEST);
    // and how it is turned.
    if (!hdf_read_numbers(file, prepared_path(name, body->name, "/turn"), H5T_NATIVE_DOUBLE, 4,
                          turn))
        return false;
    lattice->turn = (Quat){turn[0], turn[1], turn[2], turn[3]};
    double norm = turn[0] * turn[0] + turn[1] * turn[1] + turn[2] * turn[2] + turn[3] * turn[3];
    return fabs(norm - 1.0) <= 1e-9 || hdf_fail(file, name, "is no unit quaternion");
}

bool prepared_read_voxels(const Prepared *prepared, const SceneBody *body, Lattice *lattice,
                          Status *status)
{
    HdfFile file = prepared->file;
    file.status = status;
    return read_lattice(&file, body, lattice) && hdf_alive(&file);
}

#else

// Without HDF5 there are no prepared files.
#ifdef PLIANT_WITH_HDF5
bool prepared_write_voxels(const HdfFile *file, const SceneBody *body, FILE *report)
{
    (void)file, (void)body, (void)report;
    return false;
}
#endif

bool prepared_read_voxels(const Prepared *prepared, const SceneBody *body, Lattice *lattice,
                          Status *status)
{
    (void)prepared, (void)body, (void)lattice, (void)status;
    return false;
}

#endif
