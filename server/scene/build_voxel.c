// SPDX-License-Identifier: MIT
// Makes a voxel body: its lattice, skin and initial state.
#include "scene/build_parts.h"

#include "base/check.h"
#include "base/fnv.h"
#include "base/log.h"
#include "io/checkpoint.h"
#include "io/mesh_import.h"
#include "plane/plane.h"
#include "voxel/layout.h"
#include "voxel/thickness.h"

#include <stdlib.h>

#ifdef PLIANT_WITH_LATTICES

// Hashes everything that determines the elements: cells, labels and placement.
static uint64_t hash_lattice(const Lattice *lattice)
{
    uint64_t hash = FNV_START;
    size_t cells = 1;
    for (int k = 0; k < 3; k++) {
        fnv_int(&hash, lattice->count[k]);
        cells *= (size_t)lattice->count[k];
    }
    fnv_real(&hash, lattice->size);
    fnv_vector(&hash, lattice->origin);
    fnv_real(&hash, lattice->turn.w);
    fnv_vector(&hash, vec3(lattice->turn.x, lattice->turn.y, lattice->turn.z));
    return fnv_bytes(hash, lattice->label, cells);
}

static WorldCells summarize(const Lattice *lattice)
{
    return (WorldCells){.hash = hash_lattice(lattice),
                        .count = {lattice->count[0], lattice->count[1], lattice->count[2]},
                        .solid = lattice_solid(lattice),
                        .size = lattice->size,
                        .shells = lattice->shells};
}

// Checks the body against the capacities of the scene.
static bool check_capacity(const Scene *scene, const Body *body, Status *status)
{
    int nodes = body->mesh.node_count, faces = body->mesh.triangle_count;
    bool many = scene->node_capacity > 0 && nodes > scene->node_capacity;
    if (!many && (scene->face_capacity == 0 || faces <= scene->face_capacity))
        return true;
    return status_fail(
        status, STATUS_INVALID,
        "body %s has %d %s to start with, capacity.%s is %d: raise it, or leave it out", body->name,
        many ? nodes : faces, many ? "nodes" : "faces", many ? "nodes" : "faces",
        many ? scene->node_capacity : scene->face_capacity);
}

#ifdef PLIANT_WITH_PLANE
static bool create_plane(Body *body, World *world, const VoxelOptions *voxel, Status *status)
{
    const PlaneOptions plane = {
        .body = voxel->body,
        .lattice = voxel->lattice,
        .law = voxel->law == VOXEL_AFFINE ? PLANE_AFFINE : PLANE_MIYAZAKI2004,
        .material_count = voxel->material_count,
        .material = voxel->material,
        .damping = voxel->damping,
        .drag = voxel->drag,
        .tear_force = voxel->tear_force,
    };
    return plane_create(body, &plane, &world->arena, &world->state, status);
}
#endif

// The scene reader has refused bodies of a model that is not built in.
static bool create_model(Body *body, World *world, SceneModel model, const VoxelOptions *voxel,
                         Status *status)
{
#ifdef PLIANT_WITH_PLANE
    if (model == MODEL_PLANE)
        return create_plane(body, world, voxel, status);
#endif
#ifdef PLIANT_WITH_VOXEL
    if (model == MODEL_VOXEL)
        return voxel_create(body, voxel, &world->arena, &world->state, status);
#endif
    (void)body, (void)world, (void)voxel;
    return status_fail(status, STATUS_INVALID, "built without %s bodies",
                       model == MODEL_PLANE ? "plane" : "voxel");
}

static bool create_voxel(World *world, const Scene *scene, SceneModel model,
                         const VoxelOptions *voxel, Texture texture, const BodyLook *look,
                         Status *status)
{
    Body body = {0};
    if (!create_model(&body, world, model, voxel, status) || !check_capacity(scene, &body, status))
        return false;
    body.texture = texture.uv;
    body.texture_count = texture.count;
    body.look = look;
    sim_add_body(world->sim, &body);
    return true;
}

// Makes the lattice, or takes the prepared one, and the field of its smooth surface.
static bool make_lattice(const SceneBody *described, const Prepared *prepared, bool fitted,
                         Lattice *lattice, SurfaceField *field, Status *status)
{
    if (prepared == NULL)
        return body_voxels_fit(&described->voxels, lattice, fitted ? field : NULL, status);
    if (!prepared_read_voxels(prepared, described, lattice, status))
        return false;
    Lattice again = {0};
    bool ok = !fitted || body_voxels_fit(&described->voxels, &again, field, status);
    lattice_destroy(&again);
    return ok;
}

// Warns of a skin that does not overlap the labels that it is to show: their frames may differ.
static void warn_skin(const Scene *scene, const SceneBody *body, const Lattice *lattice,
                      const TriMesh *skin)
{
    if (body->skin.kind != MESH_FILE || body->skin.file == NULL || body->voxels.kind != VOXELS_FILE)
        return;
    Box cells = box_empty();
    for (int c = 0; c < 8; c++)
        box_add(&cells,
                lattice_point(lattice, c & 1 ? lattice->count[0] : 0, c & 2 ? lattice->count[1] : 0,
                              c & 4 ? lattice->count[2] : 0));
    const Box box = mesh_box(skin);
    if (box_gap(&cells, &box) > 0.0)
        log_line(LOG_WARNING,
                 "%s:%d: the skin of body \"%s\" does not overlap its labels: %s %s, labels are "
                 "read in LPS",
                 scene->path, body->line, body->name, body->skin.file, mesh_frame(body->skin.file));
}

// Finds how coarse the surface of a body that adapts may be; the caller frees it. NULL: it does
// not.
#ifdef PLIANT_WITH_VOXEL
_Static_assert((int)VOXEL_LEVELS_MAX < (int)WORLD_LEVELS, "a count for each level");
static unsigned char *find_coarsest(const VoxelOptions *voxel, const Lattice *lattice,
                                    WorldCells *cells)
{
    if (voxel->surface_level == 0)
        return NULL;
    size_t count = 1;
    for (int d = 0; d < 3; d++)
        count *= (size_t)lattice->count[d];
    unsigned char *coarsest = malloc(count);
    ASSERT(coarsest != NULL);
    thickness_levels(lattice, voxel->surface_level, coarsest);
    for (size_t c = 0; c < count; c++)
        if (lattice->label[c] != 0)
            cells->coarsest[coarsest[c]]++;
    return coarsest;
}
#else
static unsigned char *find_coarsest(const VoxelOptions *voxel, const Lattice *lattice,
                                    WorldCells *cells)
{
    (void)voxel, (void)lattice, (void)cells;
    return NULL;
}
#endif

// The names of tissues and what the score watches, as the options of a body refer to them.
typedef struct Watching {
    char name[LATTICE_MATERIALS][SCENE_LABEL_MAX];
    const char *tissue[LATTICE_MATERIALS];
    WatchedRegion watch[SCENE_SCORE_REGIONS];
} Watching;

// Returns memory that the caller frees after the body is made; NULL: it needs none.
static Watching *watch_regions(const Scene *scene, const SceneBody *described, VoxelOptions *voxel)
{
    const SceneScore *score = &scene->score;
    if (!voxel->body.cuttable || described->model != MODEL_VOXEL)
        return NULL;
    Watching *watching = calloc(1, sizeof *watching);
    ASSERT(watching != NULL);
    scene_name_tissues(described, watching->name);
    for (int m = 0; m < LATTICE_MATERIALS; m++)
        watching->tissue[m] = watching->name[m][0] != '\0' ? watching->name[m] : described->name;
    for (int r = 0; r < score->region_count; r++) {
        const SceneRegion *from = &score->region[r];
        WatchedRegion *to = &watching->watch[r];
        to->region = from->region;
        if (from->label[0] != '\0')
            to->material = scene_find_tissue(described, from->label);
        if (from->label[0] != '\0' && to->material == 0)
            to->material = -1;
    }
    voxel->tissue = watching->tissue;
    voxel->body.watch = watching->watch;
    voxel->body.watch_count = score->region_count;
    return watching;
}

bool build_voxel(World *world, const Scene *scene, int index, const Prepared *prepared,
                 const BuildOptions *options, Status *status)
{
    const SceneBody *described = &scene->body[index];
    VoxelOptions voxel = described->voxel;
    Lattice lattice = {0};
    SurfaceField field = {0};
    TriMesh skin = {0};
    const BodyLook *look = NULL;
    Vec3 *position = NULL, *velocity = NULL;
    // The lattice, prepared or made from scratch, and the skin.
    const bool fitted = build_is_fitted(scene, described);
    bool ok = make_lattice(described, prepared, fitted, &lattice, &field, status);
    ok = ok && memory_check_voxel(described, (double)lattice_solid(&lattice), status);
    ok = ok && (described->skin.file == NULL || body_skin_make(described, &skin, status));
    if (ok && described->initial != NULL) {
        // A vertex is a corner of a cell.
        int most = 8 * (int)lattice_solid(&lattice);
        ok = initial_read_rows(described->initial, most, &voxel.body.initial_count, &position,
                               &velocity, status);
    }
    ok = ok && build_look(world, described, &lattice,
                          scene_heats(scene) && described->options.cuttable &&
                              described->model == MODEL_VOXEL,
                          &look, status);
    // What only the whole scene knows, then the body itself.
    if (ok) {
        build_complete(&voxel.body, world, scene, options);
        voxel.body.name = described->name;
        // Attachments need neither firmness nor the cells around nodes.
        voxel.body.without_contacts = scene->tool_count == 0 && scene->touch_count == 0;
        voxel.body.initial_position = position;
        voxel.body.initial_velocity = velocity;
        world->cells[index] = summarize(&lattice);
        voxel.lattice = &lattice;
        unsigned char *coarsest = find_coarsest(&voxel, &lattice, &world->cells[index]);
        voxel.coarsest = coarsest;
        voxel.material = described->material;
        voxel.publish_all = scene->publish.nodes == NODES_ALL;
        voxel.field = field.value != NULL ? &field : NULL;
        voxel.tick = 1.0 / scene->sim.rate_hz;
        // Of a body that adapts without being cuttable nothing can be taken or heated.
        voxel.heats = scene_heats(scene) && described->options.cuttable;
        voxel.body.removable &= described->options.cuttable;
        voxel.skin = described->skin.file != NULL ? &skin : NULL;
        Watching *watching = watch_regions(scene, described, &voxel);
        Texture texture = build_texture(world, scene, options, described->name, &skin, NULL);
        warn_skin(scene, described, &lattice, &skin);
        ok = create_voxel(world, scene, described->model, &voxel, texture, look, status);
        free(watching);
        free(coarsest);
    }
    free(position);
    free(velocity);
    mesh_destroy(&skin);
    surface_field_destroy(&field);
    lattice_destroy(&lattice);
    return ok;
}

#else
bool build_voxel(World *world, const Scene *scene, int index, const Prepared *prepared,
                 const BuildOptions *options, Status *status)
{
    (void)world, (void)scene, (void)index, (void)prepared, (void)options;
    return status_fail(status, STATUS_INVALID,
                       "this pliantd was built without voxel and plane bodies");
}
#endif
