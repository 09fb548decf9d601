// SPDX-License-Identifier: MIT
// Ties that messages make, change and release while a scene runs: attachments of a pool that is
// reserved at load, ties and clips to another body, or its own. Step thread; nothing here runs in
// a substep. Bodies that are tied together advance together while they are, with the most substeps
// that any of them needs, and every tie shortens the steps by what it adds to the bounds.
#include "sim/hold/tie.h"

#include "base/bits.h"
#include "base/check.h"
#include "sim/guard/guard.h"
#include "sim/time_step.h"
#include "sim/events.h"
#include "geometry/distance.h"

#include <limits.h>
#include <stdio.h>
#include <string.h>

enum {
    GROWTH = 4,       // nodes that one may become where faces are divided or cut
    TIE_FACES = 4096, // most faces among which the other ends of a tie are searched
};
// Time in which a clip closes [s].
#define CLIP_TIME 0.2
// Walls face each other if the cosine between their normals is below.
#define OPPOSED (-0.5)

static const char *const KINDS[] = {
    [TIE_PIN] = "pin", [TIE_BODIES] = "tie", [TIE_CLIP] = "clip", [TIE_CARRY] = "carry"};

#define REFUSE(...) (snprintf(why, why_size, __VA_ARGS__), false)

static bool is_joint(int64_t kind)
{
    return kind == TIE_BODIES || kind == TIE_CLIP;
}

// ---------------------------------------------------------------------------------------------
// Creation

#define MEMORY(use, count, type, label)                                                            \
    arena_allocate(sim->arena, (use), (size_t)(count), sizeof(type), "ties/%s", label)

static void create_scratch(Sim *sim, TiePool *pool)
{
    int nodes = 0, faces = 0, rows = 0;
    bool changes = false;
    // For the largest body: one is searched at a time.
    for (int b = 0; b < sim->body_count; b++) {
        const Body *body = &sim->body[b];
        nodes = body->surface.node_count > nodes ? body->surface.node_count : nodes;
        faces = body->surface.face_count > faces ? body->surface.face_count : faces;
        rows = body->state_capacity > rows ? body->state_capacity : rows;
        changes |= body_changes(body);
    }
    pool->room = changes ? GROWTH * TIE_NODES : TIE_NODES;
    pool->shared.mark = MEMORY(ARENA_CONTACT, bits_words(nodes), uint64_t, "marks");
    pool->shared.pulls = MEMORY(ARENA_CONTACT, nodes, double, "pulls");
    if (changes)
        pool->shared.given = arena_allocate(sim->arena, ARENA_CONTACT, (size_t)nodes,
                                            attachment_row_size(), "ties/held before");
    TieScratch *shared = &pool->shared;
    shared->v = MEMORY(ARENA_CONTACT, pool->room, Vec3, "ends' velocities");
    shared->corner = MEMORY(ARENA_CONTACT, 3 * pool->room, int, "corners of faces");
    shared->corner_x = MEMORY(ARENA_CONTACT, 3 * pool->room, Vec3, "corners' positions");
    shared->corner_v = MEMORY(ARENA_CONTACT, 3 * pool->room, Vec3, "corners' velocities");
    shared->corner_f = MEMORY(ARENA_CONTACT, 3 * pool->room, Vec3, "corners' forces");
    // To find nodes and walls.
    pool->found = shared->found = MEMORY(ARENA_CONTACT, nodes, int, "found");
    pool->mark_face = MEMORY(ARENA_CONTACT, bits_words(faces), uint64_t, "marks of faces");
    pool->face = MEMORY(ARENA_CONTACT, TIE_FACES, int, "faces");
    pool->corner = MEMORY(ARENA_CONTACT, 3 * TIE_FACES, Vec3, "corners");
    pool->id = MEMORY(ARENA_CONTACT, rows, int, "ids");
    pool->x = MEMORY(ARENA_CONTACT, rows, Vec3, "positions");
    pool->v = MEMORY(ARENA_CONTACT, rows, Vec3, "velocities");
    pool->share = MEMORY(ARENA_CONTACT, nodes, double, "shares");
    pool->root = MEMORY(ARENA_CONTACT, nodes, double, "damping");
}

void ties_create(Sim *sim)
{
    TiePool *pool = sim->ties = MEMORY(ARENA_CONTACT, 1, TiePool, "pool");
    const int capacity = pool->capacity = sim->options.max_ties, bodies = sim->body_count;
    create_scratch(sim, pool);
    // The slots, all of them free.
    pool->record = MEMORY(ARENA_CONTACT, capacity, TieRecord, "record");
    state_add(sim->state, pool->record, (size_t)capacity * sizeof *pool->record, "ties/record");
    pool->slot = MEMORY(ARENA_CONTACT, capacity, Attachment *, "attachments");
    pool->live = MEMORY(ARENA_CONTACT, capacity, bool, "live");
    for (int s = 0; s < capacity; s++) {
        char name[32];
        snprintf(name, sizeof name, "ties/%d", s);
        pool->slot[s] = attachment_reserve(name, pool->room, &pool->shared, sim->arena, sim->state);
    }
    pool->lambda = MEMORY(ARENA_CONTACT, bodies, double, "bounds of stiffness");
    pool->damping = MEMORY(ARENA_CONTACT, bodies, double, "bounds of damping");
    // What there is without ties, to which every release returns.
    pool->group = MEMORY(ARENA_CONTACT, bodies, GroupMember, "groups");
    memcpy(pool->group, sim->group, (size_t)bodies * sizeof *pool->group);
    pool->joint_count = sim->joint_count;
    pool->own_start = MEMORY(ARENA_CONTACT, bodies + 1, int, "start");
    if (sim->attachment_count > 0) {
        pool->own = MEMORY(ARENA_CONTACT, sim->attachment_count, Attachment *, "attached");
        memcpy(pool->own, sim->attachment, (size_t)sim->attachment_count * sizeof *pool->own);
    }
    memcpy(pool->own_start, sim->attachment_start, (size_t)(bodies + 1) * sizeof *pool->own_start);
}

int ties_node_capacity(const Sim *sim)
{
    return 4 * sim->ties->capacity * sim->ties->room; // nodes, and three corners for each
}

// ---------------------------------------------------------------------------------------------
// What follows from the state

static bool is_body(const Sim *sim, int64_t body)
{
    return body >= 0 && body < sim->body_count;
}

static bool is_record(const Sim *sim, const TieRecord *tie)
{
    // The same ranges as of messages.
    if (tie->number < 1 || tie->number > INT_MAX || tie->kind < TIE_PIN || tie->kind > TIE_CARRY ||
        !is_body(sim, tie->body) ||
        !(tie->stiffness > 0.0 && tie->stiffness <= TIE_STIFFNESS_MOST) ||
        !(tie->damping_ratio >= 0.0 && tie->damping_ratio <= TIE_DAMPING_MOST) ||
        !(tie->break_force >= 0.0 && tie->break_force < 1e9) ||
        !(tie->closing >= 0.0 && tie->closing < 1e9))
        return false;
    // To what the kind says, and to nothing else.
    if (is_joint(tie->kind))
        return is_body(sim, tie->to_body) && tie->tool == -1 &&
               (tie->kind == TIE_CLIP || tie->body != tie->to_body) &&
               sim->body[tie->body].integrator == sim->body[tie->to_body].integrator;
    return tie->to_body == -1 &&
           (tie->kind == TIE_PIN ? tie->tool == -1 : tie->tool >= 0 && tie->tool < sim->tool_count);
}

// Lets the slot's attachment be that of its record.
static void assign(Sim *sim, int slot)
{
    const TieRecord *tie = &sim->ties->record[slot];
    const AttachmentOptions options = {.body = (int)tie->body,
                                       .to = tie->kind == TIE_PIN     ? ATTACH_WORLD
                                             : tie->kind == TIE_CARRY ? ATTACH_TOOL
                                                                      : ATTACH_BODY,
                                       .tool = (int)tie->tool,
                                       .to_body = (int)tie->to_body,
                                       .stiffness = tie->stiffness,
                                       .damping_ratio = tie->damping_ratio};
    attachment_assign(sim->ties->slot[slot], &options,
                      tie->tool >= 0 ? &sim->tool[tie->tool] : NULL, &sim->body[tie->body],
                      is_joint(tie->kind) ? &sim->body[tie->to_body] : NULL);
}

// True if a slot is used and its state, which may come from any file, can be.
static bool is_live(Sim *sim, int slot)
{
    const TiePool *pool = sim->ties;
    if (pool->record[slot].number == 0 || !is_record(sim, &pool->record[slot]))
        return false;
    for (int s = 0; s < slot; s++)
        if (pool->record[s].number == pool->record[slot].number)
            return false;
    assign(sim, slot);
    return attachment_check(pool->slot[slot]);
}

// Lists the attachments of each body: its own, then those of ties.
static void list_attachments(Sim *sim)
{
    const TiePool *pool = sim->ties;
    sim->attachment_count = 0;
    for (int b = 0; b < sim->body_count; b++) {
        sim->attachment_start[b] = sim->attachment_count;
        for (int k = pool->own_start[b]; k < pool->own_start[b + 1]; k++)
            sim->attachment[sim->attachment_count++] = pool->own[k];
        for (int s = 0; s < pool->capacity; s++)
            if (pool->live[s] && pool->record[s].body == b && !is_joint(pool->record[s].kind))
                sim->attachment[sim->attachment_count++] = pool->slot[s];
    }
    sim->attachment_start[sim->body_count] = sim->attachment_count;
}

// Lists the joints and groups the bodies that these join.
static void list_joints(Sim *sim)
{
    const TiePool *pool = sim->ties;
    memcpy(sim->group, pool->group, (size_t)sim->body_count * sizeof *sim->group);
    sim->joint_count = pool->joint_count;
    for (int s = 0; s < pool->capacity; s++) {
        const TieRecord *tie = &pool->record[s];
        if (!pool->live[s] || !is_joint(tie->kind))
            continue;
        sim->joint[sim->joint_count++] = pool->slot[s];
        if (!in_one_group(sim, (int)tie->body, (int)tie->to_body))
            time_step_group(sim, (int)tie->body, (int)tie->to_body);
    }
}

// True if a tie acts on a body.
static bool acts_on(const TiePool *pool, int slot, int b)
{
    const TieRecord *tie = &pool->record[slot];
    return pool->live[slot] && (tie->body == b || tie->to_body == b);
}

// Adds one tie's shares at the nodes of a body.
static void add_shares(const Sim *sim, int slot, int b)
{
    const TiePool *pool = sim->ties;
    const TieRecord *tie = &pool->record[slot];
    const double root = 2.0 * tie->damping_ratio * sqrt(tie->stiffness);
    attachment_add_shares(pool->slot[slot], &sim->body[b], tie->stiffness, pool->share);
    attachment_add_shares(pool->slot[slot], &sim->body[b], root, pool->root);
}

// The springs of a tie add at most g lambda_b to the rows of M^-1 K of its nodes and corners
// (attachment.h, joint.c), so all ties together add the largest sum of g at one node.
static double find_largest_share(Sim *sim, int b, double *root)
{
    TiePool *pool = sim->ties;
    const int nodes = sim->body[b].surface.node_count;
    double share = 0.0;
    bool any = false;
    *root = 0.0;
    for (int s = 0; s < pool->capacity && !any; s++)
        any = acts_on(pool, s, b);
    if (!any)
        return 0.0;
    memset(pool->share, 0, (size_t)nodes * sizeof *pool->share);
    memset(pool->root, 0, (size_t)nodes * sizeof *pool->root);
    for (int s = 0; s < pool->capacity; s++)
        if (acts_on(pool, s, b))
            add_shares(sim, s, b);
    for (int i = 0; i < nodes; i++) {
        share = fmax(share, pool->share[i]);
        *root = fmax(*root, pool->root[i]);
    }
    return share;
}

double ties_bound(Sim *sim)
{
    double most = 0.0;
    for (int b = 0; b < sim->body_count; b++) {
        double root;
        const double share = find_largest_share(sim, b, &root);
        sim->ties->lambda[b] = share * sim->body[b].contact_lambda;
        sim->ties->damping[b] = root * sqrt(sim->body[b].contact_lambda);
        most = fmax(most, share);
    }
    return most;
}

double ties_follow(Sim *sim)
{
    TiePool *pool = sim->ties;
    for (int s = 0; s < pool->capacity; s++)
        pool->live[s] = is_live(sim, s);
    list_attachments(sim);
    list_joints(sim);
    const double most = ties_bound(sim);
    for (int b = 0; b < sim->body_count; b++)
        if (sim->group[b].first == b)
            time_step_follow(sim, &sim->body[b]);
    return most;
}

bool ties_check(const Sim *sim)
{
    static const TieRecord FREE = {0};
    const TiePool *pool = sim->ties;
    for (int s = 0; s < pool->capacity; s++) {
        const bool is_free =
            memcmp(&pool->record[s], &FREE, sizeof FREE) == 0 && attachment_is_empty(pool->slot[s]);
        if (!pool->live[s] && !is_free)
            return false;
    }
    return true;
}

int64_t ties_refused(const Sim *sim)
{
    int64_t refused = 0; // those in use are counted with the other attachments
    for (int s = 0; s < sim->ties->capacity; s++)
        if (!sim->ties->live[s])
            refused += attachment_refused(sim->ties->slot[s]);
    return refused;
}

// ---------------------------------------------------------------------------------------------
// Where: nodes and walls

// Writes the marked nodes to `found`, ascending, and clears the marks. Returns how many.
static int collect_marked(TiePool *pool, const Body *body)
{
    return bits_move(pool->shared.mark, body->surface.node_count, pool->found);
}

// Marks the outer nodes of a body within a sphere. Returns how many nodes it has there.
static int mark_sphere(TiePool *pool, const Body *body, Vec3 center, double radius)
{
    const Region region = {.kind = REGION_CAPSULE, .from = center, .to = center, .radius = radius};
    const int room = body->surface.node_count;
    int count = body->ops->find_nodes(body->model, &region, pool->found, room);
    count = count < room ? count : room;
    for (int i = 0; i < count; i++)
        bits_add(pool->shared.mark, pool->found[i]);
    return count;
}

// Marks the outer nodes at the places of these ids (attachment.c does so at load).
static bool mark_ids(TiePool *pool, const Body *body, const TieOptions *options, char *why,
                     size_t why_size)
{
    const int rows = body->ops->read_state(body->model, pool->id, pool->x, pool->v);
    for (int k = 0; k < options->node_count; k++) {
        bool any = false;
        for (int r = 0; r < rows && options->node[k] >= 0; r++) {
            if (pool->id[r] != options->node[k])
                continue;
            // Of a plane body there is one on either side. Rounding aside they are exactly there.
            const double size = vec3_length(pool->x[r]);
            any |= mark_sphere(pool, body, pool->x[r],
                               body->half_thickness + 1e-12 * (1.0 + size)) > 0;
        }
        if (any)
            continue;
        collect_marked(pool, body); // clears the marks
        return REFUSE("node %d of a tie is not on the outside of body %s", options->node[k],
                      body->name);
    }
    return true;
}

// Finds the free nodes that the message means, ascending in `found`. Returns how many; 0 with a
// sentence if there are none, or too many.
static int find_nodes(TiePool *pool, const Body *body, const TieOptions *options, char *why,
                      size_t why_size)
{
    const Vec3 c = options->center;
    if (options->node_count > 0 ? !mark_ids(pool, body, options, why, why_size)
                                : mark_sphere(pool, body, c, options->radius) == 0) {
        if (options->node_count == 0)
            snprintf(why, why_size,
                     "center, radius: no node of body %s within %g m of (%g, %g, %g)", body->name,
                     options->radius, c.x, c.y, c.z);
        return 0;
    }
    // Without those that do not move.
    const int all = collect_marked(pool, body);
    int count = 0;
    for (int i = 0; i < all; i++)
        if (!body->ops->is_fixed(body->model, pool->found[i]))
            pool->found[count++] = pool->found[i];
    if (count == 0)
        snprintf(why, why_size, "%s: all %d nodes of body %s there are fixed",
                 options->node_count > 0 ? "node" : "center, radius", all, body->name);
    if (count <= TIE_NODES)
        return count;
    snprintf(why, why_size, "radius %g m: %d nodes of body %s, at most %d in one tie",
             options->radius, count, body->name, TIE_NODES);
    return 0;
}

// Returns a sphere around nodes.
static double enclose(const Body *body, const int *node, int count, Vec3 *center)
{
    Vec3 x;
    double radius = 0.0;
    *center = (Vec3){0.0, 0.0, 0.0};
    for (int i = 0; i < count; i++) {
        body->ops->read_nodes(body->model, &node[i], 1, &x, NULL);
        *center = vec3_madd(*center, 1.0 / count, x);
    }
    for (int i = 0; i < count; i++) {
        body->ops->read_nodes(body->model, &node[i], 1, &x, NULL);
        radius = fmax(radius, vec3_length(vec3_sub(x, *center)));
    }
    return radius;
}

// Collects the faces with a node in a sphere, ascending, and reads their corners. Returns how many;
// -1: too many. Overwrites `found`.
static int collect_faces(TiePool *pool, const Body *body, Vec3 center, double radius)
{
    const BodySurface *surface = &body->surface;
    mark_sphere(pool, body, center, radius);
    const int nodes = collect_marked(pool, body);
    for (int i = 0; i < nodes; i++) {
        const int node = pool->found[i];
        for (int j = surface->node_face_start[node]; j < surface->node_face_end[node]; j++)
            bits_add(pool->mark_face, surface->node_face[j]);
    }
    int count = 0;
    for (int word = 0; word < bits_words(surface->face_count); word++) {
        for (uint64_t left = pool->mark_face[word]; left != 0; count++) {
            const int face = bits_take(&left, word);
            if (count < TIE_FACES)
                pool->face[count] = face;
        }
        pool->mark_face[word] = 0;
    }
    for (int f = 0; f < count && count <= TIE_FACES; f++)
        body->ops->read_nodes(body->model, surface->face[pool->face[f]], 3, &pool->corner[3 * f],
                              NULL);
    return count <= TIE_FACES ? count : -1;
}

static Vec3 face_normal(const Vec3 x[3])
{
    return vec3_cross(vec3_sub(x[1], x[0]), vec3_sub(x[2], x[0]));
}

static Vec3 node_normal(const Body *body, int node)
{
    const BodySurface *surface = &body->surface;
    Vec3 sum = {0.0, 0.0, 0.0};
    for (int j = surface->node_face_start[node]; j < surface->node_face_end[node]; j++) {
        Vec3 x[3];
        body->ops->read_nodes(body->model, surface->face[surface->node_face[j]], 3, x, NULL);
        sum = vec3_add(sum, face_normal(x));
    }
    return vec3_unit(sum);
}

// A node that looks for its face.
typedef struct Search {
    const Body *body, *other;
    int node;
    Vec3 x, normal;
    bool walls; // only a wall that faces the node
} Search;

// True if a face is a wall that faces the node. The inside of a solid is no opening.
static bool faces_it(const Search *search, const Vec3 x[3], int face, Vec3 on)
{
    const int *corner = search->other->surface.face[face];
    const bool own =
        search->body == search->other &&
        (corner[0] == search->node || corner[1] == search->node || corner[2] == search->node);
    return !own && vec3_dot(search->normal, vec3_unit(face_normal(x))) < OPPOSED &&
           (!search->body->surface.solid ||
            vec3_dot(search->normal, vec3_sub(on, search->x)) >= 0.0);
}

// Returns the nearest of the collected faces, and its distance; -1: none.
static int nearest_face(const TiePool *pool, const Search *search, int count, double *distance)
{
    int nearest = -1;
    *distance = (double)INFINITY;
    for (int f = 0; f < count; f++) {
        const Vec3 *x = &pool->corner[3 * f];
        // Most are too far to be looked at closely.
        const double side =
            fmax(vec3_length(vec3_sub(x[1], x[0])), vec3_length(vec3_sub(x[2], x[0])));
        if (vec3_length(vec3_sub(search->x, x[0])) - side > *distance)
            continue;
        ClosestPair pair;
        distance_point_triangle(search->x, x, &pair);
        if (pair.distance >= *distance ||
            (search->walls && !faces_it(search, x, pool->face[f], pair.on_triangle)))
            continue;
        *distance = pair.distance;
        nearest = pool->face[f];
    }
    return nearest;
}

// Ties nodes to the other body, or closes a clip on its walls.
static bool join_nodes(Sim *sim, int slot, const TieOptions *options, const int *node, int count,
                       char *why, size_t why_size)
{
    TiePool *pool = sim->ties;
    const bool clip = options->kind == TIE_CLIP;
    Search search = {
        .body = &sim->body[options->body], .other = &sim->body[options->to_body], .walls = clip};
    const double edge = search.other->surface.longest_edge;
    // The faces among which each finds its own: all within reach, or those in the clip.
    Vec3 center = options->center;
    double reach = options->radius;
    if (!clip || options->node_count > 0)
        reach = enclose(search.body, node, count, &center) + (JOINT_REACH + 1.0) * edge;
    const int faces = collect_faces(pool, search.other, center, reach);
    if (faces < 0)
        return REFUSE("radius %g m: more than %d faces of body %s there", options->radius,
                      TIE_FACES, search.other->name);
    Attachment *joint = pool->slot[slot];
    for (int i = 0; i < count; i++) {
        double distance;
        search.node = node[i];
        search.body->ops->read_nodes(search.body->model, &node[i], 1, &search.x, NULL);
        search.normal = clip ? node_normal(search.body, node[i]) : (Vec3){0.0, 0.0, 0.0};
        const int face = nearest_face(pool, &search, faces, &distance);
        if (!clip && !(distance <= JOINT_REACH * edge))
            return REFUSE("to_body: a node at (%.4g, %.4g, %.4g) m of body %s is farther than "
                          "%.3g m, two edges, from body %s",
                          search.x.x, search.x.y, search.x.z, search.body->name, JOINT_REACH * edge,
                          search.other->name);
        if (face >= 0)
            joint_add(joint, node[i], face);
    }
    if (attachment_is_empty(joint))
        return REFUSE("center, radius: no walls of body %s%s%s face each other there",
                      search.body->name, search.body == search.other ? "" : " and ",
                      search.body == search.other ? "" : search.other->name);
    joint_stiffen(joint);
    if (clip)
        pool->record[slot].closing = joint_gap(joint) / CLIP_TIME;
    return true;
}

// ---------------------------------------------------------------------------------------------
// Make, change, release

static int find_slot(const TiePool *pool, int64_t number)
{
    for (int s = 0; s < pool->capacity; s++)
        if (pool->record[s].number == number)
            return s;
    return -1;
}

static void free_slot(Sim *sim, int slot)
{
    TiePool *pool = sim->ties;
    attachment_drop(pool->slot[slot]);
    pool->record[slot] = (TieRecord){0};
}

static int lowest_free_number(const TiePool *pool)
{
    int number = 1;
    while (find_slot(pool, number) >= 0)
        number++;
    return number;
}

static int count_nodes(const TiePool *pool, int slot)
{
    bool points;
    return attachment_held(pool->slot[slot], &points);
}

static void describe(const Sim *sim, int slot, char *text, size_t size)
{
    const TieRecord *tie = &sim->ties->record[slot];
    char to[64] = "";
    if (is_joint(tie->kind) && tie->to_body != tie->body)
        snprintf(to, sizeof to, " to body %s", sim->body[tie->to_body].name);
    if (tie->kind == TIE_CARRY)
        snprintf(to, sizeof to, " to tool %d", sim->tool[tie->tool].id);
    snprintf(text, size, "tie %lld: %s of %d nodes of body %s%s", (long long)tie->number,
             KINDS[tie->kind], count_nodes(sim->ties, slot), sim->body[tie->body].name, to);
}

// Takes the change of a slot over, or refuses it if ties would pull one node too hard.
static bool accept(Sim *sim, char *why, size_t why_size)
{
    const double most = ties_follow(sim);
    if (most > TIE_STIFFNESS_MOST * (1.0 + 1e-12))
        return REFUSE("stiffness: the ties at one node would have %.4g together, at most %g", most,
                      TIE_STIFFNESS_MOST);
    guard_renew(sim, -1); // springs come or go with energy that is no work
    return true;
}

static bool make(Sim *sim, const TieOptions *options, char *why, size_t why_size)
{
    TiePool *pool = sim->ties;
    const Body *body = &sim->body[options->body];
    const int slot = find_slot(pool, 0);
    // A number and a slot, and bodies that can be tied.
    if (options->number > 0 && find_slot(pool, options->number) >= 0)
        return REFUSE("tie %d exists", options->number);
    if (slot < 0)
        return REFUSE("all %d ties are in use (max_ties)", pool->capacity);
    if (is_joint(options->kind) && body->integrator != sim->body[options->to_body].integrator)
        return REFUSE("to_body: bodies %s (%s) and %s (%s) must have one integrator", body->name,
                      integrator_name(body->integrator), sim->body[options->to_body].name,
                      integrator_name(sim->body[options->to_body].integrator));
    const int count = find_nodes(pool, body, options, why, why_size);
    if (count == 0)
        return false;
    int node[TIE_NODES]; // `found` is needed again
    memcpy(node, pool->found, (size_t)count * sizeof *node);
    // Fill the slot.
    pool->record[slot] =
        (TieRecord){.number = options->number > 0 ? options->number : lowest_free_number(pool),
                    .kind = options->kind,
                    .body = options->body,
                    .to_body = is_joint(options->kind) ? options->to_body : -1,
                    .tool = options->kind == TIE_CARRY ? options->tool : -1,
                    .stiffness = options->stiffness,
                    .damping_ratio = options->damping_ratio,
                    .break_force = options->break_force};
    assign(sim, slot);
    bool ok = true;
    if (is_joint(options->kind))
        ok = join_nodes(sim, slot, options, node, count, why, why_size);
    else
        attachment_hold(pool->slot[slot], node, count);
    // All of it, or nothing.
    if (ok && accept(sim, why, why_size)) {
        describe(sim, slot, why, why_size);
        return true;
    }
    free_slot(sim, slot);
    ties_follow(sim);
    return false;
}

static bool change(Sim *sim, int slot, const TieOptions *options, char *why, size_t why_size)
{
    TieRecord *tie = &sim->ties->record[slot];
    const TieRecord before = *tie;
    tie->stiffness = options->stiffness;
    tie->damping_ratio = options->damping_ratio;
    tie->break_force = options->break_force;
    // Its springs follow, or all stays as it was.
    const bool ok = accept(sim, why, why_size);
    if (!ok) {
        *tie = before;
        ties_follow(sim);
    }
    if (ok && is_joint(tie->kind))
        joint_stiffen(sim->ties->slot[slot]);
    if (ok)
        snprintf(why, why_size, "tie %lld: stiffness %g, damping_ratio %g, break_force %g N",
                 (long long)tie->number, tie->stiffness, tie->damping_ratio, tie->break_force);
    return ok;
}

static void release(Sim *sim, int slot)
{
    free_slot(sim, slot);
    ties_follow(sim);
    guard_renew(sim, -1);
}

bool sim_apply_tie(Sim *sim, const TieOptions *options, char *why, size_t why_size)
{
    if (sim->ties == NULL)
        return REFUSE("this scene has no ties by message (max_ties)");
    if (options->action == TIE_MAKE)
        return make(sim, options, why, why_size);
    // One that exists.
    const int slot = options->number > 0 ? find_slot(sim->ties, options->number) : -1;
    if (slot < 0)
        return REFUSE("tie %d does not exist", options->number);
    if (options->action == TIE_CHANGE)
        return change(sim, slot, options, why, why_size);
    release(sim, slot);
    snprintf(why, why_size, "tie %d released", options->number);
    return true;
}

// ---------------------------------------------------------------------------------------------
// In a tick

void ties_begin_tick(Sim *sim)
{
    const TiePool *pool = sim->ties;
    for (int s = 0; s < pool->capacity; s++) {
        if (!pool->live[s] || !is_joint(pool->record[s].kind))
            continue;
        attachment_clear(pool->slot[s]);
        if (pool->record[s].kind == TIE_CLIP)
            joint_close(pool->slot[s], pool->record[s].closing * sim->tick);
    }
}

static Vec3 pull_of(const Sim *sim, int slot)
{
    return vec3_scale(-1.0 / sim->tick, attachment_sums(sim->ties->slot[slot])->impulse);
}

// True if a body's numbers in this tick were bad: what pulled on it says nothing.
static bool was_restored(const Sim *sim, int64_t body)
{
    return body >= 0 && sim->body[body].tuning.bad_in_a_row > 0;
}

void ties_stage(Sim *sim)
{
    const TiePool *pool = sim->ties;
    for (int s = 0; s < pool->capacity; s++) {
        const TieRecord tie = pool->record[s];
        if (pool->live[s] && count_nodes(pool, s) == 0) {
            release(sim, s);
            sim_report(sim, (int)tie.body, "tie_broken", "tie %lld, a %s: its tissue was removed",
                       (long long)tie.number, KINDS[tie.kind]);
            continue;
        }
        if (!pool->live[s] || tie.break_force == 0.0 || was_restored(sim, tie.body) ||
            was_restored(sim, tie.to_body))
            continue;
        const double pull = vec3_length(pull_of(sim, s));
        if (!(pull > tie.break_force))
            continue;
        release(sim, s);
        sim_report(sim, (int)tie.body, "tie_broken", "tie %lld, a %s: %.3g N, at most %g N",
                   (long long)tie.number, KINDS[tie.kind], pull, tie.break_force);
    }
}

// ---------------------------------------------------------------------------------------------
// Queries

int sim_tie_capacity(const Sim *sim)
{
    return sim->options.max_ties;
}

bool sim_describe_tie(const Sim *sim, int slot, char *text, size_t size)
{
    if (sim->ties->record[slot].number == 0)
        return false;
    describe(sim, slot, text, size);
    return true;
}

bool sim_find_tie(const Sim *sim, int number, TieFigures *figures)
{
    const int slot = sim->ties != NULL && number > 0 ? find_slot(sim->ties, number) : -1;
    if (slot < 0)
        return false;
    const TieRecord *tie = &sim->ties->record[slot];
    *figures = (TieFigures){.kind = (TieKind)tie->kind,
                            .body = (int)tie->body,
                            .to_body = (int)tie->to_body,
                            .tool = (int)tie->tool,
                            .nodes = count_nodes(sim->ties, slot),
                            .pull = pull_of(sim, slot)};
    return true;
}
