// SPDX-License-Identifier: MIT
// Creates a body with levels, and everything that follows from which faces are refined. Load time;
// detail_rebuild also after the state was restored.
#include "surface/cavity.h"
#include "surface/detail/detail.h"

#include "base/check.h"
#include "surface/bending.h"
#include "surface/law.h"
#include "base/log.h"
#include "geometry/edges.h"
#include "surface/network.h"

#include <stdlib.h>
#include <string.h>

// --- the order of slots ---

// Interleaves the bits of a point's coordinates in the box, 10 of each: neighbours in this order
// are neighbours in space (Morton 1966).
static uint32_t morton(Vec3 x, Vec3 low, double extent)
{
    const double part[3] = {x.x - low.x, x.y - low.y, x.z - low.z};
    uint32_t code = 0;
    for (int c = 0; c < 3; c++) {
        uint32_t cell = (uint32_t)fmin(1023.0, fmax(0.0, part[c] / extent * 1024.0));
        for (int bit = 0; bit < 10; bit++)
            code |= (cell >> bit & 1U) << (3 * bit + c);
    }
    return code;
}

typedef struct RootKey {
    uint32_t code;
    int face;
} RootKey;

static int compare_keys(const void *a, const void *b)
{
    const RootKey *x = a, *y = b;
    return x->code != y->code ? (x->code > y->code) - (x->code < y->code)
                              : (x->face > y->face) - (x->face < y->face);
}

static RootKey *order_roots(const TriMesh *mesh)
{
    RootKey *key = calloc((size_t)mesh->triangle_count, sizeof *key);
    ASSERT(key != NULL);
    const Box box = mesh_box(mesh);
    const Vec3 low = box_low(&box);
    double extent = box_extent(&box);
    for (int f = 0; f < mesh->triangle_count; f++) {
        const int *t = mesh->triangle[f];
        // Along a Z curve by their centres.
        Vec3 sum =
            vec3_add(vec3_add(mesh->position[t[0]], mesh->position[t[1]]), mesh->position[t[2]]);
        key[f] = (RootKey){morton(vec3_scale(1.0 / 3.0, sum), low, extent), f};
    }
    qsort(key, (size_t)mesh->triangle_count, sizeof *key, compare_keys);
    return key;
}

// Orders slots level by level: the nodes of level 0, then the midpoints of each level's edges, in
// the order in which the faces, root by root, first have them.
static void order_slots(SurfaceModel *model, const RootKey *root, int root_count)
{
    Detail *detail = model->detail;
    LeafSet *set = &detail->set;
    const Levels *levels = &set->levels;
    int next = 0;
    for (int i = 0; i < set->node_count; i++)
        model->slot[i] = -1;
    for (int level = 0; level <= set->levels.finest; level++) {
        // Level 0 by its own faces' corners, the others by the edges of the faces one level up.
        const Level *at = &levels->level[level > 0 ? level - 1 : 0];
        int children = 1 << (2 * (level > 0 ? level - 1 : 0));
        for (int r = 0; r < root_count; r++)
            for (int c = 0; c < children; c++) {
                int face = root[r].face * children + c;
                for (int k = 0; k < 3; k++) {
                    // A node gets its slot at the first face that has it.
                    int node =
                        level > 0 ? at->node_count + at->face_edge[face][k] : at->face[face][k];
                    if (model->slot[node] >= 0)
                        continue;
                    detail->pack.of_slot[next] = node;
                    model->slot[node] = next++;
                }
            }
    }
    for (int i = next; i < set->node_count; i++) { // copies, if the body can be cut
        detail->pack.of_slot[i] = i;
        model->slot[i] = i;
    }
}

// --- tables ---

// Returns the number of entries.
static size_t create_springs(SurfaceModel *model, const char *name, Arena *arena)
{
    Detail *detail = model->detail;
    DetailPack *pack = &detail->pack;
    LeafSet *set = &detail->set;
    int chunks = pack->window_count * pack->window_chunks, most = 0;
    SpringTable *springs = &model->springs;
    springs->chunk_count = chunks;
    springs->start = ALLOCATE(ARENA_STEP, chunks + 1, int, "spring start");
    springs->end = ALLOCATE(ARENA_STEP, chunks, int, "spring end");
    springs->own = ALLOCATE(ARENA_STEP, chunks * LANES, int, "slots of lanes");
    // A window reserves entries for its node with the most leaves.
    for (int w = 0; w < pack->window_count; w++) {
        int leaves = 0;
        for (int s = w * pack->width; s < (w + 1) * pack->width; s++)
            if (pack->of_slot[s] >= 0 && detail_most_leaves(set, pack->of_slot[s]) > leaves)
                leaves = detail_most_leaves(set, pack->of_slot[s]);
        most = leaves > most ? leaves : most;
        // Towards each neighbour there may be a whole edge and half of it; at a border there is one
        // more edge than faces. The ring around a cavity's node has a gap between both.
        const int entries = (model->cavity != NULL ? 3 : 2) * leaves + 2;
        for (int k = 0; k < pack->window_chunks; k++)
            springs->start[w * pack->window_chunks + k + 1] =
                springs->start[w * pack->window_chunks + k] + entries;
    }
    size_t entries = (size_t)springs->start[chunks] * LANES;
    model_allocate_springs(model, entries, name, arena);
    // Scratch lists of the same bound.
    for (int d = 0; d < LEVELS_MAX + 4; d++)
        set->ring[d] = ALLOCATE(ARENA_TOPOLOGY, most, Leaf, "leaves around");
    most = (model->cavity != NULL ? 3 : 2) * most + 2;
    for (int i = 0; i < pack->width; i++) {
        pack->springs[i].neighbour = ALLOCATE(ARENA_TOPOLOGY, most, int, "springs of a node");
        pack->springs[i].stiffness = ALLOCATE(ARENA_TOPOLOGY, most, double, "stiffness of a node");
    }
    return entries;
}

static void create_nodes(SurfaceModel *model, const SurfaceOptions *options, int free_count,
                         Arena *arena, StateList *state)
{
    const char *name = options->body.name;
    Detail *detail = model->detail;
    DetailPack *pack = &detail->pack;
    bool all_free = free_count == detail->set.levels.level[0].node_count;
    model_create_node_table(model, options, all_free, arena);
    // Nothing ties it to the world: speeds count relative to the motion of the whole body
    // (README.md, "Refinement criteria").
    bool body_frame = model->shape == SHAPE_FRAME_BODY;
    bool roams = all_free && (body_frame || !options->shape.wanted);
    if (body_frame || roams) {
        model->rigid_weight = ALLOCATE(ARENA_STEP, model->basis.count, double, "frame weights");
        model->basis.rigid = rigid_frame_create(
            name, model->basis.precision, model->basis.displaced, model->basis.count,
            (const double(*)[3])model->basis.rest, model->rigid_weight, arena, state);
    }
    if (body_frame && options->body.cuttable)
        detail_frames_create(model, name, arena, state);
    // Values per unit mass: those of a node of 1 kg.
    pack->shape_rate = level_rules_shape_stiffness(&detail->rules, 1.0);
    pack->shape_drag = level_rules_shape_damping(&detail->rules, 1.0);
    pack->node_drag = level_rules_node_damping(&detail->rules, 1.0);
}

static void create_slots(SurfaceModel *model, const TriMesh *mesh, const SurfaceOptions *options,
                         Arena *arena, StateList *state)
{
    const char *name = options->body.name;
    int nodes = mesh->node_count;
    int *piece = ALLOCATE(ARENA_TOPOLOGY, nodes, int, "root pieces");
    int *id = ALLOCATE(ARENA_TOPOLOGY, nodes, int, "root ids");
    int *origin = ALLOCATE(ARENA_TOPOLOGY, nodes, int, "root origins");
    model_label_pieces(mesh, piece);
    memcpy(id, mesh->file_index, (size_t)nodes * sizeof *id);
    // Copies that the repair made have the origin of their node.
    for (int i = 0; i < nodes; i++)
        origin[i] =
            mesh->copy_count == 0 ? id[i] : id[mesh_node_of_file(mesh, mesh_file_row(mesh, i))];
    const int capacity[2] = {options->body.node_capacity, options->body.face_capacity};
    model->detail->faces.slots = slots_create(
        name, &model->detail->set.levels, capacity, model->slot, id, origin, piece,
        mesh->file_node_count + mesh->copy_count, model->detail->set.cut, arena, state);
}

// The state: which faces are refined, and where the sweep is.
static void create_bits(SurfaceModel *model, const SurfaceOptions *options, Arena *arena,
                        StateList *state)
{
    const char *name = options->body.name;
    Detail *detail = model->detail;
    DetailAdapt *adapt = &detail->adapt;
    LeafSet *set = &detail->set;
    int nodes = set->node_count, coarse = set->face_base[set->levels.finest];
    // What is refined, and since when it could be coarsened.
    set->refined = ALLOCATE(ARENA_TOPOLOGY, coarse, unsigned char, "refined faces");
    adapt->calm_since = ALLOCATE(ARENA_TOPOLOGY, coarse, int64_t, "calm faces");
    adapt->sweep = ALLOCATE(ARENA_TOPOLOGY, 1, Sweep, "sweep");
    *adapt->sweep = (Sweep){
        .thresholds = {options->adapt.force, options->adapt.speed, options->adapt.curvature},
        .scale = 1.0,
        .level = set->levels.finest,
    };
    adapt->drive = ALLOCATE(ARENA_TOPOLOGY, 1, SweepDrive, "steering by the error");
    *adapt->drive = (SweepDrive){.error = options->body.adapt_error, .fineness = 1.0};
    if (adapt->drive->error > 0.0)
        state_add(state, adapt->drive, sizeof *adapt->drive, "%s/drive", name);
    int roots = set->levels.level[0].face_count;
    adapt->skip = ALLOCATE(ARENA_TOPOLOGY, roots, unsigned char, "quiet faces");
    state_add(state, adapt->skip, (size_t)roots, "%s/quiet", name);
    adapt->felt_count = ALLOCATE(ARENA_TOPOLOGY, 1, int64_t, "felt count");
    state_add(state, set->refined, (size_t)coarse, "%s/refined", name);
    state_add(state, adapt->calm_since, (size_t)coarse * sizeof *adapt->calm_since, "%s/calm_since",
              name);
    state_add(state, adapt->sweep, sizeof *adapt->sweep, "%s/sweep", name);
    state_add(state, adapt->felt_count, sizeof *adapt->felt_count, "%s/felt_count", name);
    // Scratch of a sweep.
    adapt->look = ALLOCATE(ARENA_TOPOLOGY, nodes, NodeLook, "looks at nodes");
    adapt->felt_force = ALLOCATE(ARENA_TOPOLOGY, nodes, double, "felt forces");
    adapt->calm_capacity = coarse < 4096 ? coarse : 4096;
    adapt->calm = ALLOCATE(ARENA_TOPOLOGY, adapt->calm_capacity, Leaf, "calm for long");
    adapt->want_capacity = adapt->calm_capacity;
    adapt->want = ALLOCATE(ARENA_TOPOLOGY, adapt->want_capacity, Leaf, "leaves to divide");
}

// What is derived from the bits, and rebuilt after a restore.
static void create_packing(SurfaceModel *model, const char *name, Arena *arena)
{
    DetailPack *pack = &model->detail->pack;
    DetailLists *lists = &model->detail->lists;
    LeafSet *set = &model->detail->set;
    const int nodes = set->node_count, chunks = pack->window_count * pack->window_chunks;
    set->status = ALLOCATE(ARENA_TOPOLOGY, nodes, unsigned char, "node status");
    // By node and window: what a changed node makes stale.
    pack->window = ALLOCATE(ARENA_TOPOLOGY, pack->window_count, Window, "windows");
    pack->bound = ALLOCATE(ARENA_TOPOLOGY, nodes, double, "node bounds");
    pack->is_dirty = ALLOCATE(ARENA_TOPOLOGY, nodes, bool, "dirty nodes");
    pack->stale_window = ALLOCATE(ARENA_TOPOLOGY, pack->window_count, bool, "stale windows");
    // What each evaluation visits.
    lists->hanging = ALLOCATE(ARENA_STEP, nodes, int, "hanging nodes");
    lists->master = ALLOCATE(ARENA_STEP, nodes, *lists->master, "masters");
    lists->carrier = ALLOCATE(ARENA_STEP, 2 * nodes, int, "free masters");
    lists->free_chunk = ALLOCATE(ARENA_STEP, chunks, int, "chunks");
    lists->hanging_chunk = ALLOCATE(ARENA_STEP, chunks, int, "hanging chunks");
    lists->carries = ALLOCATE(ARENA_STEP, chunks, unsigned char, "carrying chunks");
    model->run = ALLOCATE(ARENA_STEP, pack->window_count * (pack->width / BLOCK), *model->run,
                          "runs of slots");
    lists->handed = model_allocate_reals(model, (size_t)model->basis.count * ROW, name,
                                         "forces of hanging nodes", arena);
}

// --- derived from the bits ---

int detail_topology(const Detail *detail)
{
    return (int)(1 + detail->adapt.sweep->topology % INT_MAX); // as topology_after counts
}

void detail_publish(Body *body)
{
    SurfaceModel *model = body->model;
    Detail *detail = model->detail;
    DetailPack *pack = &detail->pack;
    LeafSet *set = &detail->set;
    body->mass = pack->mass;
    body->lambda = pack->lambda > 0.0 ? pack->lambda : pack->least_lambda;
    body->damping = pack->lambda > 0.0 ? pack->damping : pack->least_damping;
    // Each spring is at two nodes; for hanging nodes both ends are counted too.
    body->spring_count = pack->spring_ends / 2;
    // Leaves and the finest level in use.
    body->element_count = 0;
    for (int l = 0; l <= set->levels.finest; l++) {
        body->element_count += set->leaf_count[l];
        if (set->leaf_count[l] > 0)
            body->finest_level = l;
    }
    if (model->bending != NULL) {
        const double bending = model->bending->lambda[body->finest_level];
        body->lambda += bending;
        body->damping += model->damping_time * bending;
    }
    level_rules_raise_bounds(&detail->rules, body->finest_level, pack->least_lambda,
                             pack->least_damping, &body->lambda, &body->damping);
    if (model->cavity != NULL) {
        body->lambda += model->cavity->lambda;
        cavity_find_borders(model);
    }
    if (set->cut != NULL)
        detail_lips_weigh(model);
    // The mesh as clients see it.
    const MeshSlots *slots = detail->faces.slots;
    slots_describe(slots, detail_topology(detail), &body->mesh);
    model->shown = (SurfaceShown){.row = slots->row,
                                  .id = slots->id,
                                  .count = slots->node.high,
                                  .free_count = slots->node.high - slots->node.used};
}

static void set_statuses(SurfaceModel *model)
{
    LeafSet *set = &model->detail->set;
    // Leaves by level.
    memset(set->leaf_count, 0, sizeof set->leaf_count);
    for (int l = 0; l <= set->levels.finest; l++)
        for (int f = 0; f < set->levels.level[l].face_count; f++)
            set->leaf_count[l] += detail_is_leaf(set, l, f);
    // Empty slots have no node and zero rows.
    for (int s = 0; s < model->basis.count; s++)
        model->node[s] = -1;
    memset(model->basis.rest, 0, (size_t)model->basis.count * sizeof *model->basis.rest);
    // Nodes of the uncut mesh, then the copies in use.
    const int originals = set->levels.level[set->levels.finest].node_count;
    for (int i = 0; i < originals; i++) { // parents have lower numbers
        set->status[i] = (unsigned char)detail_status(set, i);
        if (set->status[i] == NODE_OFF)
            continue;
        model->node[model->slot[i]] = i;
        detail_set_rest(model, i);
    }
    // Copies are made in their order.
    for (int i = originals; i < set->node_count; i++) {
        const bool is_made = i - originals < *set->cut->copies;
        set->status[i] = (unsigned char)(is_made ? detail_status(set, i) : NODE_OFF);
        if (set->status[i] == NODE_OFF)
            continue;
        model->node[model->slot[i]] = i;
        detail_set_rest(model, i);
    }
}

void detail_rebuild(Body *body)
{
    SurfaceModel *model = body->model;
    Detail *detail = model->detail;
    DetailPack *pack = &detail->pack;
    if (detail->set.cut != NULL)
        detail_cut_rebuild(detail);
    set_statuses(model);
    // Everything is stale.
    for (int w = 0; w < pack->window_count; w++)
        pack->stale_window[w] = true;
    memset(pack->is_dirty, true, (size_t)detail->set.node_count);
    detail_pack(model, false);
    // The mesh is drawn from nothing, in the slots that it had.
    slots_restore(detail->faces.slots);
    detail_draw_all(&detail->faces, &detail->report);
    detail_publish(body);
}

// Divides all faces above start_level; midpoints move with their parents.
static void start_at_level(SurfaceModel *model, int level)
{
    Detail *detail = model->detail;
    LeafSet *set = &detail->set;
    for (int f = 0; f < set->face_base[level]; f++)
        set->refined[f] = 1;
    set_statuses(model);
    for (int i = 0; i < set->node_count; i++) {
        if (set->status[i] == NODE_OFF)
            continue;
        if (i >= set->levels.level[0].node_count)
            detail_give_birth(model, i);
        slots_take_node(detail->faces.slots, i);
    }
}

static void create_set(LeafSet *set, const SurfaceOptions *options, const WingedMesh *winged,
                       Arena *arena)
{
    const char *name = options->body.name;
    const int nodes = winged->node_count, faces = winged->face_count;
    set->levels = *options->hierarchy;
    // With one level there is nothing to adjust; the continuum rule keeps cut masses exact.
    set->constrained = set->levels.finest == 0 || options->adjust == ADJUST_CONTINUUM;
    const Level *finest = &set->levels.level[set->levels.finest];
    set->node_count = finest->node_count;
    set->face_count = finest->face_count;
    // Faces and edges of all levels are numbered through.
    for (int l = 0; l <= set->levels.finest; l++) {
        set->face_base[l + 1] = set->face_base[l] + set->levels.level[l].face_count;
        set->edge_base[l + 1] = set->edge_base[l] + set->levels.level[l].edge_count;
    }
    set->root_ring_start = ALLOCATE(ARENA_TOPOLOGY, nodes + 1, int, "ring start");
    set->root_ring = ALLOCATE(ARENA_TOPOLOGY, 3 * faces, int, "rings");
    memcpy(set->root_ring_start, winged->node_face_start, (size_t)(nodes + 1) * sizeof(int));
    memcpy(set->root_ring, winged->node_face, 3 * (size_t)faces * sizeof(int));
}

static double mean_edge(const TriMesh *mesh, const WingedMesh *winged)
{
    double length = 0.0;
    for (int e = 0; e < winged->edge_count; e++) {
        const int *end = winged->edge[e].node;
        length += vec3_length(vec3_sub(mesh->position[end[0]], mesh->position[end[1]]));
    }
    return length / winged->edge_count;
}

static void create_rules(Detail *detail, const TriMesh *mesh, const SpringNetwork *network,
                         const char *name, Arena *arena)
{
    level_rules_create(&detail->rules, mesh, &detail->options);
    double *area = ALLOCATE(ARENA_TOPOLOGY, mesh->triangle_count, double, "root areas");
    memcpy(area, detail->rules.area, (size_t)mesh->triangle_count * sizeof *area);
    free(detail->rules.area);
    detail->rules.area = area;
    detail->fixed = ALLOCATE(ARENA_TOPOLOGY, detail->set.node_count, bool, "fixed nodes");
    memcpy(detail->fixed, network->fixed,
           (size_t)detail->set.levels.level[detail->set.levels.finest].node_count *
               sizeof *detail->fixed);
    // A sheet of equilateral faces with springs k has E2D = 2 k / sqrt(3)
    // (server/surface/README.md, "Springs and masses from the material").
    const SurfaceMaterial *material = &detail->options.material;
    detail->adapt.modulus = material->uniform ? material->spring_stiffness * 2.0 / sqrt(3.0)
                                              : material->youngs_modulus_2d;
    detail->adapt.wave_speed = sqrt(detail->adapt.modulus / detail->rules.areal_density);
    detail->pack.rigidity = law_rigidity(material);
    detail->pack.least_lambda = network->lambda;
    detail->pack.least_damping = network->damping;
}

// Gives each node, on or off, a slot in a window.
static void create_windows(SurfaceModel *model, const TriMesh *mesh, const char *name, Arena *arena)
{
    DetailPack *pack = &model->detail->pack;
    const int nodes = model->detail->set.node_count;
    // Small bodies are packed as one window: that is fast enough.
    pack->width = nodes <= 4 * WINDOW_MOST ? WINDOW_MOST : WINDOW_LEAST;
    pack->window_chunks = pack->width / LANES + 1;
    pack->window_count = (nodes + pack->width - 1) / pack->width;
    pack->spare_slot = pack->window_count * pack->width;
    // Slots are padded to whole windows, with one spare row per window.
    model->node_count = nodes;
    model->basis.count = (pack->spare_slot + pack->window_count + LANES - 1) / LANES * LANES;
    model->lane_count = pack->window_count * pack->window_chunks * LANES;
    model->slot = ALLOCATE(ARENA_TOPOLOGY, nodes, int, "slot of node");
    model->node = ALLOCATE(ARENA_TOPOLOGY, model->basis.count, int, "node of slot");
    model->lane = ALLOCATE(ARENA_TOPOLOGY, model->basis.count, int, "lane of slot");
    pack->of_slot = ALLOCATE(ARENA_TOPOLOGY, model->basis.count, int, "node of slot, if on");
    for (int s = 0; s < model->basis.count; s++)
        pack->of_slot[s] = model->node[s] = model->lane[s] = -1;
    // Neighbours in space are neighbours in memory.
    RootKey *root = order_roots(mesh);
    order_slots(model, root, mesh->triangle_count);
    free(root);
}

static BodySurface describe_surface(const DetailFaces *faces)
{
    return (BodySurface){
        .node_count = faces->set->node_count,
        .face_count = faces->set->face_count,
        .node_used = faces->set->node_count,
        .face_used = faces->set->face_count,
        .face = (const int(*)[3])faces->face,
        .face_area = faces->face_area,
        .finest_area = faces->finest_area,
        .face_neighbor = (const int(*)[3])faces->face_neighbor,
        .node_face_start = faces->node_face_start,
        .node_face_end = faces->node_face_end,
        .node_face = faces->node_face,
        .node_area = faces->node_area,
    };
}

void detail_create(Body *body, SurfaceModel *model, const TriMesh *mesh, const WingedMesh *winged,
                   const SpringNetwork *network, const SurfaceOptions *options, Arena *arena,
                   StateList *state)
{
    const char *name = options->body.name;
    Detail *detail = model->detail = ALLOCATE(ARENA_TOPOLOGY, 1, Detail, "detail");
    LeafSet *set = &detail->set;
    create_set(set, options, winged, arena);
    // The options as this body uses them.
    detail->state = state;
    detail->options = *options;
    detail->options.hierarchy = &set->levels;
    detail->options.adjust = set->constrained ? ADJUST_CONTINUUM : ADJUST_CHOI2005;
    detail->adapt.edge_length = mean_edge(mesh, winged);
    detail_folds_create(&detail->folds, set, name, arena);
    // A cut adds copies: everything below is sized with them.
    if (options->body.cuttable) {
        detail_cut_create(detail, options, arena, state);
        set->node_count += set->cut->copy_capacity;
        if (options->tear_stretch > 0.0)
            detail_tear_create(detail, options, arena, state);
        if (options->heats)
            detail_heat_create(detail, arena, state);
    }
    create_rules(detail, mesh, network, name, arena);
    create_windows(model, mesh, name, arena);

    // Tables first, then the state, then the level at which it starts.
    model_create_rest(model, mesh, name, arena, state);
    if (model->cavity != NULL)
        cavity_create_tables(model, name, arena);
    const size_t entries = create_springs(model, name, arena);
    create_nodes(model, options, network->free_count, arena, state);
    detail_faces_create(&detail->faces, &detail->report, set, &detail->rules, name, arena);
    create_slots(model, mesh, options, arena, state);
    create_bits(model, options, arena, state);
    create_packing(model, name, arena);
    model_create_rows(model, mesh, network->fixed, options, arena, state);
    if (bending_stiffness(&options->material) > 0.0)
        detail_bend_create(model, bending_stiffness(&options->material), name, arena);
    detail_law_create(model, &options->material, entries, name, arena, state);
    start_at_level(model, options->start_level);

    // Everything else follows from the bits.
    detail->is_valid = true;
    detail_rebuild(body);
    law_rest(model);
    body->state_capacity = body->mesh.node_capacity;
    body->surface = describe_surface(&detail->faces);
}
