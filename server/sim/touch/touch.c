// SPDX-License-Identifier: MIT
// The law of contact between bodies (server/sim/README.md, "Contact between bodies"): points of
// each surface against the faces of the other.
#include "base/check.h"
#include "sim/bristle.h"
#include "sim/contact/contact.h"
#include "sim/facet.h"
#include "sim/touch/touch_data.h"

#include <stdio.h>
#include <string.h>

// Time in which surfaces that were too near become as thick as they are, or part by an edge [s].
static const double TOUCH_GROWTH = 0.1;

// Distances to faces around one edge or corner differ by rounding only.
static const double TIE = 1e-7, TIE_LEAST = 1e-13; // relative; [m]

// ---------------------------------------------------------------------------------------------
// Distance

static void gather(const Vec3 *x, const TouchPair *pair, Vec3 corner[3])
{
    for (int k = 0; k < 3; k++)
        corner[k] = x[pair->corner[k]];
}

static Vec3 normal_of(const Vec3 corner[3])
{
    return vec3_unit(vec3_cross(vec3_sub(corner[1], corner[0]), vec3_sub(corner[2], corner[0])));
}

// True if the nearest point of a face lies on a border of its surface.
static bool is_on_border(const TouchPair *pair, const double weight[3])
{
    int corners = 0, corner = 0, missing = 0;
    for (int k = 0; k < 3; k++) {
        corners += weight[k] > 0.0;
        corner = weight[k] > 0.0 ? k : corner;
        missing = weight[k] > 0.0 ? missing : k;
    }
    if (corners == 3)
        return false;
    // The edge opposite the missing corner, or the corner.
    const int bit = corners == 2 ? (missing + 1) % 3 : 3 + corner;
    return (pair->border >> bit & 1U) != 0;
}

bool touch_gap(const Vec3 *x, Vec3 at, const TouchPair *pair, int count, int patch, int side,
               double moved, TouchGap *gap)
{
    ClosestPair nearest = {.distance = (double)INFINITY};
    Vec3 corner[3], normal = {0.0, 0.0, 0.0};
    gap->pair = NULL;
    for (int i = 0; i < count; i++) {
        ClosestPair one;
        if (pair[i].patch != patch || pair[i].least - moved > nearest.distance)
            continue;
        gather(x, &pair[i], corner);
        distance_point_triangle(at, corner, &one);
        if (one.distance < nearest.distance) {
            nearest = one;
            gap->pair = &pair[i];
        }
    }
    gap->distance = nearest.distance;
    if (gap->pair == NULL || is_on_border(gap->pair, nearest.weight))
        return false;
    memcpy(gap->weight, nearest.weight, sizeof gap->weight);
    const Vec3 away = vec3_sub(at, nearest.on_triangle);
    gather(x, gap->pair, corner);
    normal = normal_of(corner);
    double along = vec3_dot(away, normal);
    const bool inside =
        nearest.weight[0] > 0.0 && nearest.weight[1] > 0.0 && nearest.weight[2] > 0.0;
    // At an edge or a corner the face decides that is seen most from above or below.
    const double as_near = nearest.distance * (1.0 + TIE) + TIE_LEAST;
    for (int i = 0; i < count && !inside; i++) {
        ClosestPair one;
        if (pair[i].patch != patch || &pair[i] == gap->pair || pair[i].least - moved > as_near)
            continue;
        gather(x, &pair[i], corner);
        distance_point_triangle(at, corner, &one);
        const double other = vec3_dot(away, normal_of(corner));
        if (one.distance <= as_near && fabs(other) > fabs(along))
            along = other;
    }
    const double sign = along < 0.0 ? -side : side;
    gap->distance = sign * nearest.distance;
    gap->out = inside || !(nearest.distance > TIE_LEAST)
                   ? vec3_scale(side, normal)
                   : vec3_scale(sign / nearest.distance, away);
    return true;
}

// ---------------------------------------------------------------------------------------------
// Forces

// Returns the square of how far a node of an end moved since the search [m2].
static double way_squared(const TouchEnd *end, int number)
{
    const Vec3 way = vec3_sub(end->x[number], end->from[number]);
    return vec3_dot(way, way);
}

// True if the distance to a patch changed by more than point and face moved since the search: then
// it is that to another surface. So is what a crease shows that folds beyond half a turn.
static bool has_jumped(const Touch *touch, const TouchHalf *half, const TouchPoint *point,
                       const TouchGap *gap, int patch)
{
    double farthest = 0.0;
    for (int k = 0; k < 3; k++) {
        const double way = way_squared(half->faces, gap->pair->corner[k]);
        farthest = way > farthest ? way : farthest;
    }
    const double change = gap->distance - half->memory[point->node].gap[patch];
    return fabs(change) >
           sqrt(way_squared(half->points, point->own)) + sqrt(farthest) + touch->margin;
}

// Adds friction: a bristle per point (server/sim/README.md, "Friction").
static void rub(const Touch *touch, TouchHalf *half, TouchPoint *point, const TouchGap *gap,
                double push, double dt)
{
    TouchEnd *points = half->points, *faces = half->faces;
    const double cap = touch->options.friction * push;
    Vec3 x[3], v[3], on[3];
    FacetPlace place;
    for (int c = 0; c < 3; c++) {
        x[c] = faces->x[gap->pair->corner[c]];
        v[c] = faces->v[gap->pair->corner[c]];
    }
    const Facet facet = facet_of(x);
    if (!(cap > 0.0) || !facet_place(&facet, x[0], points->x[point->own], &place))
        return;
    Vec3 slip = vec3_sub(points->v[point->own], facet_velocity(&facet, &place, v));
    slip = vec3_madd(slip, -vec3_dot(slip, gap->out), gap->out);
    point->trial = half->memory[point->node].bristle;
    const Vec3 force = bristle_force(&point->trial, slip, gap->out, point->stiffness,
                                     touch->damping_time, cap, dt);
    facet_distribute(&facet, &place, force, on);
    points->f[point->own] = vec3_add(points->f[point->own], force);
    for (int c = 0; c < 3; c++) {
        Vec3 *f = &faces->f[gap->pair->corner[c]];
        *f = vec3_sub(*f, on[c]);
    }
}

// Adds the push of a point and one of its patches. Returns the push [N].
static double push_apart(Touch *touch, TouchHalf *half, const TouchPoint *point,
                         const TouchGap *gap, double depth)
{
    TouchEnd *points = half->points, *faces = half->faces;
    Vec3 speed = points->v[point->own];
    for (int c = 0; c < 3; c++)
        speed = vec3_madd(speed, -gap->weight[c], faces->v[gap->pair->corner[c]]);
    const double leaving = vec3_dot(speed, gap->out);
    const double push = point->stiffness * (depth - touch->damping_time * leaving);
    touch->depth = depth > touch->depth ? depth : touch->depth;
    touch->energy += 0.5 * point->stiffness * depth * depth;
    if (!(push > 0.0)) // damping does not pull
        return 0.0;
    points->f[point->own] = vec3_madd(points->f[point->own], push, gap->out);
    for (int c = 0; c < 3; c++) {
        Vec3 *f = &faces->f[gap->pair->corner[c]];
        *f = vec3_madd(*f, -push * gap->weight[c], gap->out);
    }
    return push;
}

// Returns how far any node of an end moved since the search [m].
static double way_of(const TouchEnd *end)
{
    double most = 0.0;
    for (int i = 0; i < end->count; i++) {
        const double way = way_squared(end, i);
        most = way > most ? way : most;
    }
    return sqrt(most);
}

// True if no node moved since the gaps of points were found: lips of a cut that rest on each other
// cost as much as pressed ones where every evaluation finds the same again.
static bool is_known(Touch *touch)
{
    bool known = touch->looked;
    for (int e = 0; e < touch->count && known; e++) {
        const TouchEnd *end = &touch->end[e];
        known = end->count == 0 ||
                memcmp(end->x, end->looked, (size_t)end->count * sizeof *end->x) == 0;
    }
    for (int e = 0; e < touch->count && !known; e++) {
        const TouchEnd *end = &touch->end[e];
        if (end->count > 0)
            memcpy(end->looked, end->x, (size_t)end->count * sizeof *end->x);
    }
    touch->looked = true;
    touch->looks += !known;
    return known;
}

// Finds which patches of a point count, and how far it is from them.
static void look(const Touch *touch, const TouchHalf *half, TouchPoint *point, double moved)
{
    for (int patch = 0; patch < TOUCH_PATCHES; patch++) {
        TouchGap *gap = &point->gap[patch];
        point->meets[patch] =
            point->clear <= moved && point->side[patch] != 0 &&
            touch_gap(half->faces->x, half->points->x[point->own], &half->pair[point->first],
                      point->count, patch, point->side[patch], moved, gap) &&
            gap->distance < touch->thickness && // it rests no farther
            (half->one_sided || !has_jumped(touch, half, point, gap, patch));
    }
}

void touch_evaluate(Touch *touch, double dt)
{
    const bool known = is_known(touch);
    const double moved =
        known ? 0.0 : way_of(&touch->end[0]) + way_of(&touch->end[touch->count - 1]);
    touch->depth = touch->energy = 0.0;
    for (int e = 0; e < touch->count; e++)
        if (touch->end[e].count > 0)
            memset(touch->end[e].f, 0, (size_t)touch->end[e].count * sizeof(Vec3));
    for (int k = 0; k < touch->count; k++) {
        TouchHalf *half = &touch->half[k];
        for (int i = 0; i < half->point_count; i++) {
            TouchPoint *point = &half->point[i];
            const double *rest = half->memory[point->node].rest;
            bool rubbed = false; // one bristle: on the first patch that pushes
            point->trial = (Vec3){0.0, 0.0, 0.0};
            if (!known)
                look(touch, half, point, moved);
            for (int patch = 0; patch < TOUCH_PATCHES; patch++) {
                const TouchGap *gap = &point->gap[patch];
                if (!point->meets[patch] || !(gap->distance < rest[patch]))
                    continue;
                const double push =
                    push_apart(touch, half, point, gap, rest[patch] - gap->distance);
                if (!rubbed && touch->options.friction > 0.0)
                    rub(touch, half, point, gap, push, dt);
                rubbed = true;
            }
        }
    }
}

void touch_apply(Touch *touch, double dt)
{
    for (int e = 0; e < touch->count; e++) {
        const TouchEnd *end = &touch->end[e];
        if (end->count > 0)
            carriers_read(&end->carriers, end->count, end->x, end->v);
    }
    touch_evaluate(touch, dt);
    for (int e = 0; e < touch->count && touch->depth > 0.0; e++) {
        const TouchEnd *end = &touch->end[e];
        if (end->count > 0)
            carriers_give(&end->carriers, end->count, end->f);
    }
}

void touch_end_substep(Touch *touch)
{
    for (int k = 0; k < touch->count && touch->options.friction > 0.0; k++)
        for (int i = 0; i < touch->half[k].point_count; i++)
            touch->half[k].memory[touch->half[k].point[i].node].bristle =
                touch->half[k].point[i].trial;
}

static bool can_stretch(Vec3 bristle)
{
    return vec3_dot(bristle, bristle) < 1e12; // no body is that large
}

bool touch_can_rub(const Touch *touch)
{
    for (int k = 0; k < touch->count && touch->options.friction > 0.0; k++)
        for (int i = 0; i < touch->half[k].point_count; i++)
            if (!can_stretch(touch->half[k].memory[touch->half[k].point[i].node].bristle))
                return false;
    return true;
}

void touch_forget_friction(Touch *touch)
{
    for (int k = 0; k < touch->count && touch->options.friction > 0.0; k++) {
        const TouchHalf *half = &touch->half[k];
        for (int i = 0; i < half->points->body->surface.node_count; i++)
            half->memory[i].bristle = half->before[i].bristle = (Vec3){0.0, 0.0, 0.0};
    }
}

// ---------------------------------------------------------------------------------------------
// Ticks

// Returns the longest damping time for a body [s]: the scene's, but at most that of the damping
// ratio 0.2 of what contact alone may add (from which bouncing gains nothing, contact_create.c), so
// that it dictates no steps.
static double damping_time(const TouchOptions *options, const Body *body)
{
    return fmin(body->contact_damping, 0.4 / sqrt(options->stiffness * body->contact_lambda));
}

// Surfaces that were nearer than their thickness when they were first seen part slowly, and so do
// bodies that overlapped at the start.
static void grow_thick(Touch *touch)
{
    const double share = touch->tick / TOUCH_GROWTH;
    for (int k = 0; k < touch->count; k++)
        for (int i = 0; i < touch->half[k].point_count; i++) {
            const TouchPoint *point = &touch->half[k].point[i];
            double *rest = touch->half[k].memory[point->node].rest;
            for (int patch = 0; patch < TOUCH_PATCHES; patch++)
                if (point->side[patch] != 0)
                    rest[patch] = fmin(
                        rest[patch] + share * (rest[patch] < 0.0 ? touch->edge : touch->thickness),
                        point->thickness);
        }
}

// True if a node fades, or did in the last tick.
static bool fades(const BodyFit *fit, int64_t step)
{
    return fit->fade_last > 0 && step - fit->fade_last <= fit->fade_steps + 1;
}

// While nodes fade, what carries them changes from tick to tick.
static void follow_fades(Touch *touch, int64_t step)
{
    for (int e = 0; e < touch->count; e++) {
        const TouchEnd *end = &touch->end[e];
        if (end->fit == NULL)
            continue;
        end->fit->step = step;
        if (!fades(&end->body->mesh.fit, step))
            continue;
        carriers_forget(end->fit);
        touch->kept->wait = touch->kept->holds = 0;
    }
}

// True if any point can be pushed: of a body's own back, no side is known.
static bool has_sides(const TouchHalf *half)
{
    for (int i = 0; i < half->point_count; i++)
        for (int patch = 0; patch < TOUCH_PATCHES; patch++)
            if (half->point[i].side[patch] != 0)
                return true;
    return false;
}

bool touch_begin_tick(Touch *touch, int64_t step)
{
    follow_fades(touch, step);
    const Body *a = touch->body[0], *b = touch->body[1];
    touch->damping_time = fmin(damping_time(&touch->options, a), damping_time(&touch->options, b));
    touch_search(touch);
    grow_thick(touch);
    touch->acts = touch->whole && has_sides(&touch->half[0]);
    const bool before = touch->shortened;
    touch->shortened = touch_shortens(touch);
    return touch->shortened != before;
}

bool touch_is_near(const Touch *touch)
{
    return touch->half[0].point_count + touch->half[1].point_count > 0; // the second may be empty
}

bool touch_shortens(const Touch *touch)
{
    return !touch->whole || touch->acts;
}

const TouchOptions *touch_options(const Touch *touch)
{
    return &touch->options;
}

int64_t touch_refused(const Touch *touch)
{
    return touch->refused;
}

// ---------------------------------------------------------------------------------------------
// Topology and state

// Lists what a change of faces made of each: 1 + the slot of an heir, -1 for none.
static void list_heirs(int *heir, const TopologyChange *change)
{
    for (int i = 0; i < change->face_count; i++)
        heir[change->face[i].face] = -1;
    for (int i = 0; i < change->face_count; i++)
        if (change->face[i].from >= 0)
            heir[change->face[i].from] = change->face[i].face + 1;
}

static void forget_heirs(int *heir, const TopologyChange *change)
{
    for (int i = 0; i < change->face_count; i++) {
        heir[change->face[i].face] = 0;
        if (change->face[i].from >= 0)
            heir[change->face[i].from] = 0;
    }
}

// True for a body with itself that was never cut: a solid has no new faces, a hollow body no copies
// of nodes, nor lacks any tissue.
static bool is_whole(const Touch *touch)
{
    const Body *body = touch->body[0];
    const BodyMesh *mesh = &body->mesh;
    if (touch->count == 2 || body->surface.solid)
        return touch->count == 1 && body->surface.face_used == touch->whole_faces;
    for (int i = 0; i < mesh->node_count; i++)
        if (mesh->id[i] >= 0 && mesh->origin[i] != mesh->id[i])
            return false;
    TissueAccount tissue = {0};
    if (body->ops->account != NULL)
        body->ops->account(body->model, &tissue, 1);
    return !(tissue.removed > 0.0);
}

// What is remembered of faces passes to their heirs: a point looks among faces around it.
static void follow_faces(TouchHalf *half, const TopologyChange *change)
{
    if (half->heir == NULL)
        return;
    list_heirs(half->heir, change);
    for (int i = 0; i < half->points->body->surface.node_count; i++)
        for (int patch = 0; patch < TOUCH_PATCHES; patch++) {
            int *face = &half->memory[i].face[patch];
            const int heir = *face > 0 ? half->heir[*face - 1] : 0;
            if (heir == 0)
                continue;
            *face = heir > 0 ? heir : 0;
            if (heir < 0) {
                half->memory[i].side[patch] = 0;
                half->memory[i].gap[patch] = half->memory[i].rest[patch] = 0.0;
            }
        }
    forget_heirs(half->heir, change);
}

// New points remember what the first of their parents does.
static void follow_points(TouchHalf *half, const TopologyChange *change)
{
    for (int i = 0; i < change->gone_count; i++)
        half->memory[change->gone[i]] = (TouchMemory){.face = {0, 0}};
    for (int i = 0; i < change->born_count; i++) {
        const NodeBirth *born = &change->born[i];
        half->memory[born->node] = half->memory[born->parent[0]];
    }
}

// Forgets what the last search found.
static void clear(Touch *touch)
{
    touch->drift = (double)INFINITY;
    touch->looked = false;
    for (int k = 0; k < touch->count; k++) {
        touch_forget_numbers(&touch->end[k]);
        touch->half[k].point_count = touch->half[k].pair_count = 0;
    }
}

// Lists nodes again. Those that come into use have not moved since the last search.
static void list_nodes_anew(TouchEnd *end)
{
    const int before = end->used_count;
    int *former = end->node; // free while nothing is found
    memcpy(former, end->used, (size_t)before * sizeof *former);
    for (int i = 0; i < before; i++)
        end->number[former[i]] = 0;
    touch_list_nodes(end);
    for (int i = 0; i < end->used_count; i++) {
        const int node = end->used[i];
        if (end->number[node] < 0)
            end->body->ops->read_nodes(end->body->model, &node, 1, &end->start[node], NULL);
    }
    for (int i = 0; i < before; i++)
        end->number[former[i]] = -1;
}

// True if a body's own state, from which the places of its nodes follow, is sound.
static bool is_sound(const Body *body)
{
    return body->ops->check == NULL || body->ops->check(body->model);
}

void touch_restored(Touch *touch, int64_t step)
{
    clear(touch);
    touch->whole = is_whole(touch);
    for (int e = 0; e < touch->count; e++) {
        touch_list_nodes(&touch->end[e]);
        touch_find_box(&touch->end[e]);
        carriers_forget(&touch->end[e].carriers);
        // That of the search: while a node fades there is one in each tick, afterwards all are
        // alike.
        touch->end[e].carriers.step = step - 1;
    }
    // A state from elsewhere is not checked yet.
    if (touch->kept->holds != 0 && touch_check(touch) && is_sound(touch->body[0]) &&
        is_sound(touch->body[1]))
        touch_search_again(touch);
}

void touch_topology_changed(Touch *touch, int which, const TopologyChange *change)
{
    for (int k = 0; k < touch->count; k++) {
        if (touch->half[k].faces == &touch->end[which])
            follow_faces(&touch->half[k], change);
        if (touch->half[k].points == &touch->end[which])
            follow_points(&touch->half[k], change);
    }
    touch->kept->wait = touch->kept->holds = 0;
    clear(touch);
    carriers_forget(&touch->end[which].carriers);
    list_nodes_anew(&touch->end[which]);
    touch->whole = is_whole(touch);
    // The time step follows at once: the next tick compares with what it was chosen by.
    touch->shortened = touch_shortens(touch);
}

// True if what a point remembers can be.
static bool check_memory(const TouchMemory *memory, const BodySurface *faces, double thickness)
{
    for (int patch = 0; patch < TOUCH_PATCHES; patch++) {
        const int face = memory->face[patch] - 1, side = memory->side[patch];
        if (face < -1 || face >= faces->face_count || side < -1 || side > 1 ||
            !(fabs(memory->gap[patch]) < 1e6) ||
            !(memory->rest[patch] >= -1e6 && memory->rest[patch] <= thickness))
            return false;
        for (int c = 0; c < 3 && face >= 0; c++)
            if (faces->face[face][c] < 0 || faces->face[face][c] >= faces->node_count)
                return false;
    }
    return memory->stiffness >= 0.0 && isfinite(memory->stiffness) && can_stretch(memory->bristle);
}

bool touch_check(const Touch *touch)
{
    const TouchKept *kept = touch->kept;
    for (int k = 0; k < touch->count; k++) {
        const TouchHalf *half = &touch->half[k];
        const BodySurface *faces = &half->faces->body->surface;
        for (int i = 0; i < half->points->body->surface.node_count; i++)
            if (!check_memory(&half->memory[i], faces, touch->thickness) ||
                !check_memory(&half->before[i], faces, touch->thickness) ||
                !(vec3_dot(half->points->place[i], half->points->place[i]) < 1e12) ||
                !(vec3_dot(half->points->start[i], half->points->start[i]) < 1e12))
                return false;
    }
    for (int k = 0; k < 2; k++)
        if (!(kept->fastest[k] >= 0.0 && kept->fastest[k] <= TOUCH_MOST_SPEED))
            return false;
    return kept->moved >= 0.0 && kept->moved < 1e6 && kept->searches >= 0 && kept->searches <= 2 &&
           kept->wait >= 0 && kept->wait <= TOUCH_MOST_WAIT &&
           (kept->holds == 0 || (kept->holds == 1 && kept->wait == 0));
}

// ---------------------------------------------------------------------------------------------
// Creation

double touch_thickness(const TouchOptions *options, const Body *first)
{
    const bool folds = touch_bodies(options) == 1 && !first->surface.solid;
    if (options->thickness >= 0.0)
        return options->thickness;
    return folds ? TOUCH_THICKNESS * first->surface.longest_edge : 0.0;
}

void touch_bounds(const TouchOptions *options, const Body *body, double *lambda, double *damping)
{
    *lambda =
        options->stiffness * body->contact_lambda * contact_bounce_of(body, options->stiffness);
    *damping = damping_time(options, body) * *lambda;
}

static void create_end(TouchEnd *end, bool itself, const char *name, Body *body, Arena *arena,
                       StateList *state)
{
    const int nodes = body->surface.node_count;
    end->body = body;
    end->node = ALLOCATE(ARENA_CONTACT, nodes, int, "nodes");
    end->number = ALLOCATE(ARENA_CONTACT, nodes, int, "numbers");
    end->x = ALLOCATE(ARENA_CONTACT, nodes, Vec3, "positions");
    end->v = ALLOCATE(ARENA_CONTACT, nodes, Vec3, "velocities");
    end->f = ALLOCATE(ARENA_CONTACT, nodes, Vec3, "forces");
    end->from = ALLOCATE(ARENA_CONTACT, nodes, Vec3, "starts");
    end->looked = ALLOCATE(ARENA_CONTACT, nodes, Vec3, "looked at");
    end->used = ALLOCATE(ARENA_CONTACT, nodes, int, "used");
    end->place = ALLOCATE(ARENA_CONTACT, nodes, Vec3, "places");
    if (itself && !body->surface.solid)
        end->piece = ALLOCATE(ARENA_CONTACT, nodes, int, "pieces");
    end->speed = ALLOCATE(ARENA_CONTACT, nodes, Vec3, "speeds");
    end->packed_place = ALLOCATE(ARENA_CONTACT, nodes, Vec3, "packed places");
    end->packed_speed = ALLOCATE(ARENA_CONTACT, nodes, Vec3, "packed speeds");
    for (int i = 0; i < nodes; i++)
        end->number[i] = -1;
    touch_list_nodes(end);
    state_add(state, end->place, (size_t)nodes * sizeof *end->place, "%s/places", name);
    end->start = end->place;
    end->carriers = (Carriers){.body = body, .node = end->node};
    if (body->mesh.fit.row_count == 0)
        return;
    end->start = ALLOCATE(ARENA_CONTACT, nodes, Vec3, "starts of vertices");
    state_add(state, end->start, (size_t)nodes * sizeof *end->start, "%s/starts", name);
    end->fit = &end->carriers;
    carriers_create(end->fit, body, nodes, body->state_capacity, true, name, arena);
    end->fit->v = ALLOCATE(ARENA_CONTACT, body->state_capacity, Vec3, "carrier velocities");
}

// Returns the number of nodes and other vertices that forces may act on.
static int vertices_of(const TouchEnd *end)
{
    return end->fit != NULL ? end->body->state_capacity : end->body->surface.node_count;
}

static void create_half(TouchHalf *half, const char *name, Arena *arena, StateList *state)
{
    // A node touches four faces on the whole surface, or more on a part of it. A crumpled wall has
    // layers on both sides everywhere.
    enum {
        PAIRS = 4,
        PAIRS_FOLDED = 16,
        LEAST = 256,
        ENTRIES = 12,
        LEAST_ENTRIES = 4096,
        CELLS = 2
    };
    const BodySurface *points = &half->points->body->surface, *faces = &half->faces->body->surface;
    half->one_sided = faces->solid && half->points != half->faces;
    half->point_capacity = points->node_count;
    half->pair_capacity =
        (half->points->piece != NULL ? PAIRS_FOLDED : PAIRS) * points->node_count + LEAST;
    half->cell_capacity = CELLS * faces->face_count + LEAST;
    half->entry_capacity = ENTRIES * faces->face_count + LEAST_ENTRIES;
    half->memory = ALLOCATE(ARENA_CONTACT, points->node_count, TouchMemory, "memory");
    half->point = ALLOCATE(ARENA_CONTACT, half->point_capacity, TouchPoint, "points");
    half->pair = ALLOCATE(ARENA_CONTACT, half->pair_capacity, TouchPair, "pairs");
    half->demand = ALLOCATE(ARENA_CONTACT, vertices_of(half->faces), double, "demand");
    if (half->points->fit != NULL)
        half->own_demand =
            ALLOCATE(ARENA_CONTACT, vertices_of(half->points), double, "points' demand");
    half->face = ALLOCATE(ARENA_CONTACT, faces->face_count, TouchFace, "faces");
    half->in = ALLOCATE(ARENA_CONTACT, faces->face_count, TouchCells, "faces' cells");
    half->stamp = ALLOCATE(ARENA_CONTACT, faces->face_count, int64_t, "stamps");
    half->cell_start = ALLOCATE(ARENA_CONTACT, half->cell_capacity + 2, int, "cells");
    half->cell_face = ALLOCATE(ARENA_CONTACT, half->entry_capacity, int, "cells' faces");
    if (body_changes(half->faces->body))
        half->heir = ALLOCATE(ARENA_CONTACT, faces->face_count, int, "heirs");
    if (half->points == half->faces && !faces->solid)
        half->cell_smooth = ALLOCATE(ARENA_CONTACT, half->cell_capacity, bool, "smooth cells");
    half->before = ALLOCATE(ARENA_CONTACT, points->node_count, TouchMemory, "memory before");
    state_add(state, half->memory, (size_t)points->node_count * sizeof *half->memory, "%s/memory",
              name);
    state_add(state, half->before, (size_t)points->node_count * sizeof *half->before, "%s/before",
              name);
}

Touch *touch_create(const char *name, const TouchOptions *options, Body *first, Body *second,
                    double tick, Arena *arena, StateList *state)
{
    Touch *touch = ALLOCATE(ARENA_CONTACT, 1, Touch, "touch");
    touch->options = *options;
    touch->count = touch_bodies(options);
    touch->body[0] = first;
    touch->body[1] = second;
    touch->tick = tick;
    touch->thickness = touch_thickness(options, first);
    touch->kept = ALLOCATE(ARENA_CONTACT, 1, TouchKept, "kept");
    state_add(state, touch->kept, sizeof *touch->kept, "%s/kept", name);
    for (int k = 0; k < touch->count; k++) {
        char part[48];
        snprintf(part, sizeof part, "%.34s%d", name, k);
        create_end(&touch->end[k], touch->count == 1, part, touch->body[k], arena, state);
    }
    for (int k = 0; k < touch->count; k++) {
        char part[48];
        TouchHalf *half = &touch->half[k];
        snprintf(part, sizeof part, "%.34s%d", name, k);
        half->points = &touch->end[k];
        half->faces = &touch->end[touch->count - 1 - k];
        create_half(half, part, arena, state);
    }
    touch->drift = (double)INFINITY;
    touch->whole_faces = -1;
    if (touch->count == 1 && first->surface.solid)
        touch_find_gap(touch);
    touch->whole = is_whole(touch);
    touch->shortened = touch_shortens(touch);
    return touch;
}

int touch_node_capacity(const Touch *touch, int which)
{
    return vertices_of(&touch->end[which]);
}
