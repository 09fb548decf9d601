// SPDX-License-Identifier: MIT
#include "sim/hold/attachment_data.h"

#include "base/bits.h"
#include "base/check.h"
#include "base/sets.h"

#include <stdlib.h>
#include <string.h>

void attachment_bounds(const Body *body, double stiffness, double damping_ratio, double *lambda,
                       double *damping)
{
    *lambda = stiffness * body->contact_lambda;
    *damping = 2.0 * damping_ratio * sqrt(*lambda);
}

// ---------------------------------------------------------------------------------------------
// Creation

static bool is_free_node(const Body *body, int node)
{
    const BodySurface *surface = &body->surface;
    return surface->node_face_end[node] > surface->node_face_start[node] &&
           !body->ops->is_fixed(body->model, node);
}

// Finds the outer nodes whose ids the state shows at a region's positions, with their copies.
// Returns how many ids have none.
static int find_by_id(const Body *body, const FixedRegion *region, bool *inside)
{
    // Ids are those of the state, nodes those of the surface: positions tell which belong together.
    size_t slots = (size_t)body->state_capacity;
    int *id = calloc(slots + 1, sizeof *id), missing = 0;
    Vec3 *x = calloc(slots + 1, sizeof *x), *v = calloc(slots + 1, sizeof *v);
    ASSERT(id != NULL && x != NULL && v != NULL);
    int count = body->ops->read_state(body->model, id, x, v);
    // Each wanted node must lie on the outside, in one slot or (a plane body) in two.
    for (int k = 0; k < region->node_count; k++) {
        bool any = false;
        for (int s = 0; s < count; s++) {
            for (int i = 0; i < body->surface.node_count && id[s] == region->node[k]; i++) {
                Vec3 at;
                if (body->surface.node_face_end[i] <= body->surface.node_face_start[i])
                    continue;
                body->ops->read_nodes(body->model, &i, 1, &at, NULL);
                const Vec3 away = vec3_sub(at, x[s]);
                // Of a plane body both nodes of a vertex are meant, one on either side.
                bool same = away.x == 0.0 && away.y == 0.0 && fabs(away.z) == body->half_thickness;
                inside[i] |= same;
                any |= same;
            }
        }
        missing += !any;
    }
    free(id);
    free(x);
    free(v);
    return missing;
}

// Finds the free outer nodes in the region, ascending, in memory that the caller frees (also after
// a failure). Returns false with a status if there are none, or for invalid node numbers.
static bool find_region(const Body *body, const FixedRegion *region, int **node, int *count,
                        Status *status)
{
    // Nodes that the region names are marked first; a box or sphere decides by position.
    const int nodes = body->surface.node_count;
    bool *inside = calloc((size_t)nodes + 1, sizeof *inside);
    *node = calloc((size_t)nodes + 1, sizeof **node);
    ASSERT(inside != NULL && *node != NULL);
    *count = 0;
    int missing = region->kind == FIXED_NODES ? find_by_id(body, region, inside) : 0, held = 0;
    // Outer nodes in the region, fixed ones apart.
    for (int i = 0; i < nodes; i++) {
        Vec3 x;
        if (body->surface.node_face_end[i] <= body->surface.node_face_start[i])
            continue;
        body->ops->read_nodes(body->model, &i, 1, &x, NULL);
        if (!(region->kind == FIXED_NODES ? inside[i] : fixed_contains(region, x)))
            continue;
        held += !is_free_node(body, i);
        if (is_free_node(body, i))
            (*node)[(*count)++] = i;
    }
    free(inside);
    qsort(*node, (size_t)*count, sizeof **node, compare_ints); // the state holds them ascending
    // Say why nothing can be held.
    if (missing > 0)
        return status_fail(status, STATUS_INVALID,
                           "nodes: %d of %d are not on the outside of body %s", missing,
                           region->node_count, body->name);
    if (*count == 0)
        return status_fail(status, STATUS_INVALID, "no free node of body %s lies in the region%s",
                           body->name, held > 0 ? ": all that do are fixed" : "");
    return true;
}

// Returns the capacity for the nodes that `count` nodes may become.
static int region_capacity(const Body *body, int count)
{
    enum { MOST_OF_ONE = 64 }; // nodes that a node may become, by three divisions of faces
    const int nodes = body->surface.node_count;
    if (!body_changes(body))
        return count;
    return count < nodes / MOST_OF_ONE ? MOST_OF_ONE * count : nodes;
}

// Allocates what is held, which is part of the state: springs to frames and to bodies.
static void create_frames(Attachment *attachment, const char *name, Arena *arena, StateList *state)
{
    const int capacity = attachment->capacity;
    attachment->node = ALLOCATE(ARENA_CONTACT, capacity, int, "held");
    attachment->held = ALLOCATE(ARENA_CONTACT, capacity, HeldNode, "held at");
    state_add(state, attachment->hold, sizeof *attachment->hold, "%s/hold", name);
    state_add(state, attachment->node, (size_t)capacity * sizeof(int), "%s/nodes", name);
    state_add(state, attachment->held, (size_t)capacity * sizeof(HeldNode), "%s/places", name);
    if (attachment->grasper) { // only these hold points of faces
        attachment->point = ALLOCATE(ARENA_CONTACT, HELD_POINTS, HeldPoint, "held points");
        attachment->before = ALLOCATE(ARENA_CONTACT, HELD_POINTS, Vec3, "points before");
        state_add(state, attachment->point, HELD_POINTS * sizeof(HeldPoint), "%s/points", name);
    }
}

static void create_ties(Attachment *attachment, const char *name, Arena *arena, StateList *state)
{
    const int capacity = attachment->capacity;
    attachment->ties = ALLOCATE(ARENA_CONTACT, 1, int64_t, "count");
    attachment->tie = ALLOCATE(ARENA_CONTACT, capacity, Tie, "ties");
    attachment->before = ALLOCATE(ARENA_CONTACT, capacity, Vec3, "ends before");
    state_add(state, attachment->ties, sizeof *attachment->ties, "%s/count", name);
    state_add(state, attachment->tie, (size_t)capacity * sizeof(Tie), "%s/ties", name);
}

// Allocates what is kept from an evaluation until its forces are applied, after those of others.
// Returns its most entries.
static int create_evaluation(Attachment *attachment, const char *name, Arena *arena)
{
    const int ends = attachment_node_capacity(attachment, attachment->body);
    attachment->carrier = ALLOCATE(ARENA_CONTACT, ends, int, "carriers");
    attachment->demand = ALLOCATE(ARENA_CONTACT, ends, double, "held masses");
    attachment->x = ALLOCATE(ARENA_CONTACT, ends, Vec3, "positions");
    attachment->f = ALLOCATE(ARENA_CONTACT, ends, Vec3, "forces");
    return ends;
}

// Allocates what attachments of ties share.
static void create_scratch(Attachment *attachment, const char *name, Arena *arena)
{
    const int nodes = attachment->body->surface.node_count, corners = 3 * attachment->capacity;
    const int ends = create_evaluation(attachment, name, arena);
    attachment->v = ALLOCATE(ARENA_CONTACT, ends, Vec3, "velocities");
    attachment->found = ALLOCATE(ARENA_CONTACT, nodes, int, "found");
    attachment->mark = ALLOCATE(ARENA_CONTACT, bits_words(nodes), uint64_t, "marks");
    if (attachment->changes)
        attachment->given = arena_allocate(arena, ARENA_CONTACT, (size_t)nodes,
                                           attachment->row->size, "%s/held before", name);
    if (attachment->grasper)
        attachment->unused = ALLOCATE(ARENA_CONTACT, ends, Vec3, "unused");
    if (attachment->other == NULL)
        return;
    attachment->corner = ALLOCATE(ARENA_CONTACT, corners, int, "corners");
    attachment->corner_x = ALLOCATE(ARENA_CONTACT, corners, Vec3, "corners' positions");
    attachment->corner_v = ALLOCATE(ARENA_CONTACT, corners, Vec3, "corners' velocities");
    attachment->corner_f = ALLOCATE(ARENA_CONTACT, corners, Vec3, "corners' forces");
    attachment->pulls =
        ALLOCATE(ARENA_CONTACT, attachment->other->surface.node_count, double, "pulls");
}

Attachment *attachment_create(const char *name, const AttachmentOptions *options,
                              const ToolOptions *tool, Body *body, Body *other, Arena *arena,
                              StateList *state, Status *status)
{
    // A region is searched once, and holds its own nodes and those that they become; a grasper
    // searches when it closes, and may hold any.
    const int nodes = body->surface.node_count;
    int *node = NULL, count = 0;
    if (options->to != ATTACH_GRASPER &&
        !find_region(body, &options->region, &node, &count, status)) {
        free(node);
        return NULL;
    }
    // It belongs to its bodies for good.
    Attachment *attachment = ALLOCATE(ARENA_CONTACT, 1, Attachment, "attachment");
    attachment->hold = ALLOCATE(ARENA_CONTACT, 1, HoldState, "hold");
    attachment_assign(attachment, options, tool, body, other);
    attachment->capacity = node != NULL         ? region_capacity(body, count)
                           : nodes < HELD_NODES ? nodes
                                                : HELD_NODES;
    (other != NULL ? create_ties : create_frames)(attachment, name, arena, state);
    create_scratch(attachment, name, arena);
    // All nodes of a region are held from now on, or as soon as the tool is active.
    const bool ok = other == NULL || joint_tie(attachment, node, count, status);
    if (other == NULL)
        attachment_hold(attachment, node, count);
    free(node);
    return ok ? attachment : NULL;
}

// ---------------------------------------------------------------------------------------------
// Ties by message

size_t attachment_row_size(void)
{
    return sizeof(Tie) > sizeof(HeldNode) ? sizeof(Tie) : sizeof(HeldNode);
}

Attachment *attachment_reserve(const char *name, int capacity, const TieScratch *scratch,
                               Arena *arena, StateList *state)
{
    Attachment *attachment = ALLOCATE(ARENA_CONTACT, 1, Attachment, "attachment");
    attachment->hold = ALLOCATE(ARENA_CONTACT, 1, HoldState, "hold");
    attachment->of_tie = true;
    attachment->capacity = capacity;
    create_frames(attachment, name, arena, state);
    create_ties(attachment, name, arena, state);
    create_evaluation(attachment, name, arena);
    attachment->found = scratch->found;
    attachment->mark = scratch->mark;
    attachment->given = scratch->given;
    attachment->pulls = scratch->pulls;
    attachment->v = scratch->v;
    attachment->corner = scratch->corner;
    attachment->corner_x = scratch->corner_x;
    attachment->corner_v = scratch->corner_v;
    attachment->corner_f = scratch->corner_f;
    return attachment;
}

void attachment_assign(Attachment *attachment, const AttachmentOptions *options,
                       const ToolOptions *tool, Body *body, Body *other)
{
    attachment->options = *options;
    attachment->tool = tool;
    attachment->body = body;
    attachment->other = other;
    attachment->row = other != NULL ? &FACET_ROW : &FRAME_ROW;
    attachment->grasper = options->to == ATTACH_GRASPER;
    attachment->changes = body_changes(body);
}

void attachment_hold(Attachment *attachment, const int *node, int count)
{
    ASSERT(count <= attachment->capacity);
    for (int i = 0; i < count; i++) {
        attachment->node[i] = node[i];
        attachment->held[i] = (HeldNode){.share = 1.0};
    }
    attachment->hold->count = count;
    attachment->sums = (ContactSums){0};
}

void attachment_drop(Attachment *attachment)
{
    const size_t count = (size_t)attachment->hold->count;
    memset(attachment->node, 0, count * sizeof *attachment->node);
    memset(attachment->held, 0, count * sizeof *attachment->held);
    memset(attachment->tie, 0, (size_t)*attachment->ties * sizeof *attachment->tie);
    *attachment->hold = (HoldState){0};
    *attachment->ties = 0;
    attachment->sums = (ContactSums){0};
}

bool attachment_is_empty(const Attachment *attachment)
{
    static const HoldState NOTHING = {0};
    return memcmp(attachment->hold, &NOTHING, sizeof NOTHING) == 0 &&
           (attachment->ties == NULL || *attachment->ties == 0);
}

void attachment_add_shares(Attachment *attachment, const Body *of, double share, double *sum)
{
    for (int64_t i = 0; i < attachment->hold->count && attachment->body == of; i++)
        sum[attachment->node[i]] += share;
    for (int64_t i = 0; i < *attachment->ties && attachment->body == of; i++)
        sum[attachment->tie[i].node] += share;
    if (attachment->other != of)
        return;
    // A corner has its share once, however many springs divide it.
    memset(attachment->pulls, 0, (size_t)of->surface.node_count * sizeof *attachment->pulls);
    for (int64_t i = 0; i < *attachment->ties; i++) {
        for (int k = 0; k < 3; k++) {
            const int corner = of->surface.face[attachment->tie[i].face][k];
            sum[corner] += attachment->pulls[corner] == 0.0 ? share : 0.0;
            attachment->pulls[corner] = 1.0;
        }
    }
}

static void add_corners(const Body *of, int64_t face, Places *places)
{
    for (int k = 0; k < 3; k++)
        places_add(places, of->surface.face[face][k]);
}

void attachment_add_places(const Attachment *attachment, const Body *of, Places *places)
{
    const HoldState *hold = attachment->hold;
    const int64_t ties = attachment->ties != NULL ? *attachment->ties : 0;
    for (int64_t i = 0; i < hold->count && attachment->body == of; i++)
        if (hold->holding && attachment->held[i].share > 0.0)
            places_add(places, attachment->node[i]);
    for (int64_t i = 0; i < hold->points && attachment->body == of; i++)
        add_corners(of, attachment->point[i].face, places);
    for (int64_t i = 0; i < ties && attachment->body == of; i++)
        places_add(places, (int)attachment->tie[i].node);
    for (int64_t i = 0; i < ties && attachment->other == of; i++)
        add_corners(of, attachment->tie[i].face, places);
}

const AttachmentOptions *attachment_options(const Attachment *attachment)
{
    return &attachment->options;
}

int attachment_node_capacity(const Attachment *attachment, const Body *of)
{
    const int points = attachment->point != NULL ? HELD_POINTS : 0, nodes = attachment->capacity;
    return (of == attachment->body ? nodes + 3 * points : 0) +
           (attachment->other != NULL && of == attachment->other ? 3 * nodes : 0);
}

// ---------------------------------------------------------------------------------------------
// Once per tick

// Closes and opens graspers by their grip, with hysteresis.
static void follow_grip(Attachment *attachment, bool active, double grip, Vec3 position,
                        Quat orientation, double tick)
{
    // A tool that has been withdrawn holds nothing.
    HoldState *hold = attachment->hold;
    if (!active) {
        attachment_release(attachment);
        hold->closed = hold->muted = 0;
        return;
    }
    // The grip decides, with hysteresis.
    if (hold->closed == 0 && grip >= GRIP_CLOSES) {
        hold->closed = 1;
        attachment_take(attachment, position, orientation);
        hold->muted |= hold->holding;
    } else if (hold->closed != 0 && grip < GRIP_OPENS) {
        hold->closed = 0;
        grip_open(attachment, position, orientation);
    } else if (hold->holding != 0) {
        grip_begin_tick(attachment, position, orientation, tick);
    }
    // Contact comes back when the released nodes are out of the capsules.
    if (hold->muted != 0 && hold->holding == 0 &&
        attachment_is_clear(attachment, position, orientation))
        hold->muted = 0;
}

void attachment_begin_tick(Attachment *attachment, bool active, double grip, Vec3 position,
                           Quat orientation, double tick)
{
    attachment->sums = (ContactSums){.about = position};
    HoldState *hold = attachment->hold;
    if (attachment->grasper)
        follow_grip(attachment, active, grip, position, orientation, tick);
    else if (hold->holding == 0 && active)
        attachment_take(attachment, position, orientation);
    else if (hold->holding != 0 && !active)
        attachment_release(attachment);
}

bool attachment_is_holding(const Attachment *attachment)
{
    return attachment->hold->holding != 0;
}

bool attachment_mutes_contact(const Attachment *attachment)
{
    return attachment->hold->muted != 0;
}

// ---------------------------------------------------------------------------------------------
// Queries

Vec3 attachment_force(const Attachment *attachment)
{
    return attachment->force;
}

const ContactSums *attachment_sums(const Attachment *attachment)
{
    return &attachment->sums;
}

void attachment_clear(Attachment *attachment)
{
    if (attachment->grasper)
        attachment_release(attachment);
    attachment->sums = (ContactSums){.about = attachment->sums.about};
}

static bool is_used_node(const BodySurface *surface, int64_t node)
{
    return node >= 0 && node < surface->node_count &&
           surface->node_face_end[node] > surface->node_face_start[node];
}

bool attachment_is_face(const BodySurface *surface, int64_t face)
{
    if (face < 0 || face >= surface->face_count)
        return false;
    for (int k = 0; k < 3; k++) // a free slot has no corners, or the same one three times
        if (!is_used_node(surface, surface->face[face][k]) ||
            surface->face[face][k] == surface->face[face][(k + 1) % 3])
            return false;
    return true;
}

// True for positions within any possible distance of a tool and a body.
static bool is_position(Vec3 local)
{
    return vec3_length(local) < 1e9;
}

// True if counts are within their limits; a grasper that holds nothing knows nothing.
static bool check_hold(const Attachment *attachment)
{
    const HoldState *hold = attachment->hold;
    const bool grasper = attachment->grasper;
    return hold->holding >= 0 && hold->holding <= 1 && hold->closed >= 0 &&
           hold->closed <= grasper && hold->muted >= 0 && hold->muted <= grasper &&
           hold->count >= 0 && hold->count <= attachment->capacity && hold->points >= 0 &&
           hold->points <= (grasper ? HELD_POINTS : 0) &&
           (!grasper || hold->holding == 1 || hold->count + hold->points == 0) &&
           hold->ease >= 0.0 && hold->ease <= GRIP_EASE_TIME && hold->strength >= 0.0 &&
           isfinite(hold->strength) && (hold->ease == 0.0 || (grasper && hold->holding == 1));
}

static bool check_frames(const Attachment *attachment)
{
    const BodySurface *surface = &attachment->body->surface;
    if (!check_hold(attachment) || (attachment->ties != NULL && *attachment->ties != 0))
        return false;
    // Nodes exist, ascend and are held wholly or not at all, but for those that leave jaws.
    for (int64_t i = 0; i < attachment->hold->count; i++) {
        const HeldNode *held = &attachment->held[i];
        if (!is_used_node(surface, attachment->node[i]) || !is_position(held->local) ||
            !(held->share >= 0.0 && held->share <= 1.0) ||
            (!attachment->grasper && held->share != floor(held->share)) ||
            (i > 0 && attachment->node[i] <= attachment->node[i - 1]))
            return false;
    }
    // Points lie in existing faces.
    for (int64_t i = 0; i < attachment->hold->points; i++) {
        const HeldPoint *point = &attachment->point[i];
        if (!attachment_is_face(surface, point->face) || !is_position(point->local) ||
            !(held_point_share(point) > 0.0))
            return false;
        for (int k = 0; k < 3; k++)
            if (!(point->weight[k] >= 0.0 && point->weight[k] <= 1.0))
                return false;
    }
    return true;
}

static bool check_ties(const Attachment *attachment)
{
    static const HoldState NOTHING = {0};
    const int64_t ties = *attachment->ties;
    if (memcmp(attachment->hold, &NOTHING, sizeof NOTHING) != 0 || ties < 0 ||
        ties > attachment->capacity)
        return false;
    // Nodes and faces exist, and nodes ascend.
    for (int64_t i = 0; i < ties; i++) {
        const Tie *tie = &attachment->tie[i];
        if (!is_used_node(&attachment->body->surface, tie->node) ||
            (i > 0 && tie->node <= tie[-1].node) ||
            !attachment_is_face(&attachment->other->surface, tie->face) || !joint_is_sensible(tie))
            return false;
    }
    return true;
}

bool attachment_check(const Attachment *attachment)
{
    return attachment->other != NULL ? check_ties(attachment) : check_frames(attachment);
}

int attachment_held(const Attachment *attachment, bool *points)
{
    *points = attachment->hold->points > 0;
    if (*points)
        return (int)attachment->hold->points;
    int count = attachment->other != NULL ? (int)*attachment->ties : 0;
    for (int64_t i = 0; i < attachment->hold->count; i++)
        count += attachment->held[i].share > 0.0;
    return count;
}

int64_t attachment_taken(const Attachment *attachment)
{
    return attachment->taken;
}

int64_t attachment_slipped(const Attachment *attachment)
{
    return attachment->slipped;
}

int64_t attachment_refused(const Attachment *attachment)
{
    return attachment->refused;
}
