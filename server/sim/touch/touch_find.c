// SPDX-License-Identifier: MIT
// Finds the points and faces of a touch that can meet in the next ticks (server/sim/README.md,
// "Contact between bodies"): boxes of both bodies, a grid over the faces where they overlap
// (touch_grid.c), then the nearest faces of each point, and with touch_patch.c the sides of them
// that it is on. Step thread, at most once a tick.
#include "base/sets.h"
#include "sim/touch/touch_look.h"

#include <string.h>

enum {
    BUDGET = 16, // exact distances in a search for each node, at most
    AHEAD = 8,   // ticks that a search covers, at most,
};
static const double AHEAD_WAY = 0.1; // and edges on which bodies come nearer meanwhile
static const double SPEEDUP = 1.5;   // speeds may become as many times what they are within a tick
// Bodies that are apart may speed up by this before they are looked at again [m/s].
static const double SPARE_SPEED = 0.5;
// What the places of nodes on a smooth surface move by at most, relative to vertices, where these
// move along one line: by their own, and by the offset of at most 0.45 cells along each of three
// axes times what opposite sides of cells move against each other, twice as much.
static const double FIT_BEYOND = 2.6; // 1 + 0.45 * 2 * sqrt(3)
// Offsets may be stretched so many times.
static const double FIT_STRETCH = 2.0;
// Overlap beyond which a point is forgotten, relative to the longest edge.
static const double DEEPEST = 4.0;

// ---------------------------------------------------------------------------------------------
// Bodies

// Finds the pieces of a surface: nodes that are connected by faces.
static void list_pieces(const TouchEnd *end)
{
    const BodySurface *surface = &end->body->surface;
    int *piece = end->piece;
    union_find_reset(piece, surface->node_count);
    for (int i = 0; i < end->used_count; i++)
        for (int k = surface->node_face_start[end->used[i]];
             k < surface->node_face_end[end->used[i]]; k++) {
            const int *corner = surface->face[surface->node_face[k]];
            union_find_join(piece, corner[0], end->used[i]);
        }
    for (int i = 0; i < end->used_count; i++)
        piece[end->used[i]] = union_find_root(piece, end->used[i]);
}

void touch_list_nodes(TouchEnd *end)
{
    const BodySurface *surface = &end->body->surface;
    end->used_count = 0;
    for (int i = 0; i < surface->node_count; i++)
        if (surface->node_face_end[i] > surface->node_face_start[i])
            end->used[end->used_count++] = i;
    double mass = 0.0, area = 0.0;
    for (int i = 0; i < end->used_count; i++) {
        if (end->body->ops->is_fixed(end->body->model, end->used[i]))
            continue;
        mass += surface->node_mass[end->used[i]];
        area += surface->node_area[end->used[i]];
    }
    // A body of which all is fixed is as heavy as need be.
    end->density = area > 0.0 ? mass / area : 1e9;
    if (end->piece != NULL)
        list_pieces(end);
}

// Reads all nodes of a body and the largest speed. Returns how far any moved since the search [m].
static double read_body(TouchEnd *end)
{
    const Body *body = end->body;
    body->ops->read_nodes(body->model, end->used, end->used_count, end->packed_place,
                          end->packed_speed);
    double fastest = 0.0, farthest = 0.0;
    for (int i = 0; i < end->used_count; i++) {
        const Vec3 v = end->packed_speed[i],
                   way = vec3_sub(end->packed_place[i], end->start[end->used[i]]);
        const double speed = vec3_dot(v, v), far = vec3_dot(way, way);
        fastest = speed > fastest ? speed : fastest;
        farthest = far > farthest ? far : farthest;
    }
    end->fastest = fmin(sqrt(fastest), TOUCH_MOST_SPEED);
    // Nodes follow the vertices around their own as well.
    const double beyond = end->fit != NULL ? FIT_BEYOND : 1.0;
    end->fastest = fmin(beyond * end->fastest, TOUCH_MOST_SPEED);
    return beyond * sqrt(farthest);
}

void touch_find_box(TouchEnd *end)
{
    end->box = box_empty();
    for (int i = 0; i < end->used_count; i++)
        box_add(&end->box, end->start[end->used[i]]);
    if (end->fit != NULL)
        box_grow(&end->box, FIT_STRETCH * end->body->mesh.fit.reach);
}

// Sets where the vertices of a body are for a search, and the box of its nodes.
static void place_body(TouchEnd *end)
{
    for (int i = 0; i < end->used_count; i++) {
        end->start[end->used[i]] = end->packed_place[i];
        end->speed[end->used[i]] = end->packed_speed[i];
    }
    touch_find_box(end);
}

// Sets where the nodes of a smooth surface are that a search looks at; others stay with their
// vertices. A search that is repeated has the places.
static void place_nodes(const Touch *touch, TouchEnd *end, const Box *box)
{
    Box wide = *box;
    end->fit->search++;
    // Nothing is remembered that is deeper.
    box_grow(&wide, touch->deepest + 2.0 * end->body->surface.longest_edge);
    for (int i = 0; i < end->used_count; i++) {
        const int node = end->used[i];
        const Vec3 vertex = end->packed_place[i];
        if (!touch->repeats)
            end->place[node] = box_has(&wide, vertex) ? carriers_place(end->fit, node) : vertex;
        end->packed_place[i] = end->place[node];
    }
}

void touch_forget_numbers(TouchEnd *end)
{
    for (int i = 0; i < end->count; i++)
        end->number[end->node[i]] = -1;
    end->count = 0;
}

static int number_of(TouchEnd *end, int node)
{
    if (end->number[node] < 0) {
        end->number[node] = end->count;
        end->from[end->count] = end->place[node];
        end->node[end->count++] = node;
    }
    return end->number[node];
}

// ---------------------------------------------------------------------------------------------
// Faces near a point

static Vec3 point_normal(const TouchEnd *end, int node)
{
    const BodySurface *surface = &end->body->surface;
    Vec3 sum = {0.0, 0.0, 0.0};
    for (int k = surface->node_face_start[node]; k < surface->node_face_end[node]; k++) {
        const int *corner = surface->face[surface->node_face[k]];
        const Vec3 a = end->place[corner[0]];
        sum = vec3_add(sum, vec3_cross(vec3_sub(end->place[corner[1]], a),
                                       vec3_sub(end->place[corner[2]], a)));
    }
    return vec3_unit(sum);
}

// True if a node of a hollow body's surface and a face of it are neighbours or have one in common:
// they bend, and do not touch.
static bool is_around(const BodySurface *surface, int node, int face)
{
    for (int k = surface->node_face_start[node]; k < surface->node_face_end[node]; k++)
        if (touch_is_beside(surface, surface->node_face[k], face))
            return true;
    return false;
}

// Finds which ways a point faces: in its own body by one normal, in another solid by those of its
// faces, since a corner meets more than what its mean normal shows.
static void find_normals(const TouchHalf *half, TouchLook *look)
{
    const BodySurface *own = &half->points->body->surface;
    look->normal_count = 0;
    if (half->points == half->faces)
        look->normal[look->normal_count++] = point_normal(half->points, look->node);
    for (int k = own->node_face_start[look->node];
         k < own->node_face_end[look->node] && half->one_sided && own->solid &&
         look->normal_count < TOUCH_NORMALS;
         k++)
        look->normal[look->normal_count++] = touch_face_normal(half->points, own->node_face[k]);
}

// True for a face that faces the same way as a point: in solids the back of a thin part, in a
// hollow body a part of its own piece.
static bool is_aligned(const TouchHalf *half, const TouchLook *look, int face, Vec3 normal)
{
    const int *piece = half->faces->piece;
    for (int i = 0; i < look->normal_count; i++)
        if (!(vec3_dot(look->normal[i], normal) > TOUCH_ALIGNED))
            return false;
    return look->normal_count > 0 &&
           (piece == NULL || piece[half->faces->body->surface.face[face][0]] == piece[look->node]);
}

// True for a face around a point of the same body.
static bool is_own(const TouchHalf *half, const TouchLook *look, int face)
{
    const BodySurface *surface = &half->faces->body->surface;
    return half->points == half->faces &&
           (half->faces->piece == NULL ? touch_has_corner(surface, face, look->node)
                                       : is_around(surface, look->node, face));
}

bool touch_ignores(const TouchHalf *half, const TouchLook *look, int face)
{
    return is_own(half, look, face) ||
           (look->normal_count > 0 &&
            is_aligned(half, look, face, touch_face_normal(half->faces, face)));
}

// Adds a face in the order of distance; drops the farthest if there is no space.
static void insert_near(TouchLook *look, int face, const ClosestPair *at)
{
    const bool full = look->count == TOUCH_NEAR;
    if (full && at->distance >= look->near[TOUCH_NEAR - 1].at.distance)
        return;
    int i = full ? TOUCH_NEAR - 1 : look->count++;
    for (; i > 0 && look->near[i - 1].at.distance > at->distance; i--)
        look->near[i] = look->near[i - 1];
    look->near[i] = (TouchNear){.face = face, .at = *at, .patch = -1};
}

static double distance_to(const TouchHalf *half, Vec3 at, int face, ClosestPair *pair)
{
    Vec3 x[3];
    touch_read_corners(half->faces, face, x);
    distance_point_triangle(at, x, pair);
    return pair->distance;
}

static bool is_known(const TouchLook *look, int face)
{
    for (int i = 0; i < look->count; i++)
        if (look->near[i].face == face)
            return true;
    return false;
}

// Goes from a remembered face to the nearest around it, again and again: also deep inside, a point
// finds the surface that it came through. Returns that face, or -1 if it is too far.
static int walk(const Touch *touch, const TouchHalf *half, const TouchLook *look, int face,
                ClosestPair *nearest)
{
    enum { STEPS = 16 };
    const BodySurface *surface = &half->faces->body->surface;
    double least = distance_to(half, look->at, face, nearest);
    if (touch_ignores(half, look, face))
        least = (double)INFINITY;
    for (int step = 0, from = -1; step < STEPS && from != face; step++) {
        const ClosestPair here = *nearest;
        from = face;
        // Above the inside of a face no step is nearer at once.
        const bool inside = here.weight[0] > 0.0 && here.weight[1] > 0.0 && here.weight[2] > 0.0;
        for (int c = 0; c < 3 && !(inside && least < (double)INFINITY); c++) {
            const int node = surface->face[from][c];
            const bool away = here.weight[c] == 0.0 && least < (double)INFINITY;
            for (int k = surface->node_face_start[node]; k < surface->node_face_end[node] && !away;
                 k++) {
                const int other = surface->node_face[k];
                ClosestPair at;
                if (other == from || touch_ignores(half, look, other) ||
                    !(distance_to(half, look->at, other, &at) < least))
                    continue;
                least = at.distance;
                *nearest = at;
                face = other;
            }
        }
    }
    return least < touch->deepest ? face : -1;
}

// Returns how much nearer a point and a face may come until the next search [m]. One that holds for
// its tick only looks at how fast they are to each other.
static double slack_of(const Touch *touch, const TouchHalf *half, const TouchLook *look, int face)
{
    if (!touch->fast)
        return touch->slack;
    const Vec3 *speed = half->faces->speed, own = half->points->speed[look->node];
    const int *corner = half->faces->body->surface.face[face];
    double fastest = 0.0;
    for (int k = 0; k < 3; k++) {
        const Vec3 v = vec3_sub(speed[corner[k]], own);
        fastest = fmax(fastest, vec3_dot(v, v));
    }
    return fmin(touch->slack, SPEEDUP * touch->tick * sqrt(fastest) + touch->least_slack);
}

// Adds a face that is no farther than `off`, besides how it may move.
static void try_face(const Touch *touch, const TouchHalf *half, TouchLook *look, int face,
                     double off)
{
    ClosestPair at;
    if (face < 0 || is_known(look, face) || touch_ignores(half, look, face) ||
        distance_to(half, look->at, face, &at) > off + 2.0 * slack_of(touch, half, look, face))
        return;
    look->least = fmin(look->least, at.distance);
    insert_near(look, face, &at);
}

// Adds a face and those around it that may be the nearest meanwhile. A point of these within
// reach lies at most `clear` from the nearest point of the face, so that only its corners and edges
// nearer than that count; twice that, for folds.
static void add_around(const Touch *touch, const TouchHalf *half, TouchLook *look, int face,
                       const ClosestPair *nearest)
{
    const BodySurface *surface = &half->faces->body->surface;
    const double off = nearest->distance, clear = 4.0 * (off + touch->slack);
    Vec3 x[3];
    touch_read_corners(half->faces, face, x);
    try_face(touch, half, look, face, off);
    for (int c = 0; c < 3; c++) {
        const int node = surface->face[face][c];
        const Vec3 arm = vec3_sub(nearest->on_triangle, x[c]);
        const bool around = vec3_dot(arm, arm) <= clear * clear;
        for (int k = surface->node_face_start[node]; k < surface->node_face_end[node] && around;
             k++)
            try_face(touch, half, look, surface->node_face[k], off);
        if (distance_point_segment(nearest->on_triangle, x[c], x[(c + 1) % 3]) <= clear)
            try_face(touch, half, look, surface->face_neighbor[face][c], off);
    }
}

static double square(double x)
{
    return x * x;
}

// Finds the faces that may be the nearest until the next search.
static void find_near(Touch *touch, const TouchHalf *half, TouchLook *look, const int *near,
                      int count)
{
    for (int i = 0; i < count && touch->budget > 0; i++) {
        const TouchFace *face = &half->face[near[i]];
        const Vec3 arm = vec3_sub(look->at, face->center);
        // Two walls may both count, of a solid the nearest face alone.
        const double most =
            half->one_sided ? fmin(touch->thickness, look->least) : touch->thickness;
        const double overlap = half->one_sided ? touch->overlap : 0.0; // walls have no inside
        double limit = most + 2.0 * touch->slack + overlap;
        const double far = vec3_dot(arm, arm), plane = fabs(vec3_dot(arm, face->normal));
        if (far > square(limit + face->radius) || plane > limit ||
            is_aligned(half, look, face->face, face->normal))
            continue;
        limit = most + 2.0 * slack_of(touch, half, look, face->face) + overlap;
        if (far > square(limit + face->radius) || plane > limit || is_own(half, look, face->face) ||
            is_known(look, face->face))
            continue;
        touch->budget--;
        ClosestPair at;
        if (distance_to(half, look->at, face->face, &at) > limit)
            continue;
        look->least = fmin(look->least, at.distance);
        insert_near(look, face->face, &at);
    }
    // The limit fell meanwhile.
    const double limit = look->least + 2.0 * touch->slack;
    while (half->one_sided && look->count > 0 && look->near[look->count - 1].at.distance > limit)
        look->count--;
}

// ---------------------------------------------------------------------------------------------
// Points

// Returns the thickness at a point [m]. What folds is no thicker than half of what its faces are
// wide, so that a flat surface does not feel itself.
static double thickness_of(const Touch *touch, const TouchHalf *half, int node)
{
    const BodySurface *surface = &half->points->body->surface;
    return half->points->piece != NULL
               ? fmin(touch->thickness, 0.5 * sqrt(surface->node_area[node]))
               : touch->thickness;
}

// Returns the stiffness of a point before corners are shared.
static double stiffness_of(const Touch *touch, const TouchHalf *half, int node)
{
    const Body *own = half->points->body, *other = half->faces->body;
    const double mass = own->surface.node_mass[node], area = own->surface.node_area[node];
    // Where others carry it too, share_stiffness knows what these can bear.
    const double carried = half->points->fit != NULL ? half->points->density * area : mass;
    const double from_own = own->contact_lambda * carried,
                 from_other = other->contact_lambda * half->faces->density * area;
    return touch->options.stiffness / 6.0 * (mass > 0.0 ? fmin(from_own, from_other) : from_other);
}

// Adds a point that can meet the other surface until the next search; returns false without space.
static bool add_point(Touch *touch, TouchHalf *half, int node, const int side[TOUCH_PATCHES],
                      const TouchPair *pair, int count, const TouchGap gap[TOUCH_PATCHES],
                      double thickness, double clear)
{
    if (half->point_count == half->point_capacity || half->pair_count + count > half->pair_capacity)
        return false;
    TouchPoint *point = &half->point[half->point_count++];
    *point = (TouchPoint){.node = node,
                          .own = number_of(half->points, node),
                          .first = half->pair_count,
                          .count = count,
                          .thickness = thickness,
                          .clear = clear - thickness};
    memcpy(point->side, side, sizeof point->side);
    point->stiffness = stiffness_of(touch, half, node);
    for (int i = 0; i < count; i++) {
        TouchPair *own = &half->pair[half->pair_count++];
        *own = pair[i];
        for (int k = 0; k < 3; k++)
            own->corner[k] = number_of(half->faces, pair[i].corner[k]);
    }
    for (int patch = 0; patch < TOUCH_PATCHES; patch++)
        for (int k = 0; k < 3 && gap[patch].pair != NULL; k++) {
            point->under[point->under_count] = number_of(half->faces, gap[patch].pair->corner[k]);
            point->weight[point->under_count++] = gap[patch].weight[k];
        }
    return true;
}

// Looks around one point. Returns true if it can meet anything until the next search.
static bool look_around(Touch *touch, TouchHalf *half, int node, const int *near, int near_count)
{
    TouchMemory *memory = &half->memory[node];
    TouchLook look = {.node = node, .at = half->points->place[node], .least = (double)INFINITY};
    TouchPair pair[TOUCH_NEAR];
    int side[TOUCH_PATCHES];
    find_normals(half, &look);
    bool inside = false; // what it came through decides alone
    for (int patch = 0; patch < TOUCH_PATCHES; patch++) {
        const int face = memory->face[patch] - 1;
        ClosestPair at;
        const int now = face >= 0 ? walk(touch, half, &look, face, &at) : -1;
        memory->face[patch] = now + 1;
        if (now < 0)
            continue;
        add_around(touch, half, &look, now, &at);
        inside |= half->one_sided && vec3_dot(vec3_sub(look.at, at.on_triangle),
                                              touch_face_normal(half->faces, now)) < 0.0;
    }
    if (!inside)
        find_near(touch, half, &look, near, near_count);
    if (look.count == 0) {
        *memory = (TouchMemory){.face = {0, 0}};
        return false;
    }
    const int count = touch_find_patches(touch, half, &look, memory, side, pair);
    const double thickness = thickness_of(touch, half, node);
    // What it can meet of them.
    TouchGap gap[TOUCH_PATCHES];
    double distance[TOUCH_PATCHES], nearest = (double)INFINITY;
    double clear = (double)INFINITY; // borders included, which may become faces
    for (int patch = 0; patch < TOUCH_PATCHES; patch++) {
        const bool meets = touch_gap(half->faces->place, look.at, pair, count, patch, side[patch],
                                     0.0, &gap[patch]);
        clear = fmin(clear, gap[patch].distance);
        distance[patch] = gap[patch].distance;
        nearest = meets ? fmin(nearest, gap[patch].distance) : nearest;
        if (!meets || !(gap[patch].distance < touch->slack + thickness))
            gap[patch].pair = NULL;
    }
    touch_remember(touch, memory, side, distance, thickness, pair, count);
    if (!(nearest < touch->reach))
        *memory = (TouchMemory){.face = {0, 0}};
    if (!(nearest < touch->slack + thickness))
        return false;
    const bool added = add_point(touch, half, node, side, pair, count, gap, thickness, clear);
    touch->refused += !added;
    return added;
}

static void search_half(Touch *touch, TouchHalf *half, const Box *box)
{
    const TouchEnd *points = half->points;
    half->point_count = half->pair_count = 0;
    touch_grid_build(half, box, touch->reach);
    for (int i = 0; i < points->used_count; i++) {
        const Vec3 x = points->packed_place[i];
        const int *near = NULL;
        const int count = box_has(box, x) ? touch_grid_at(half, x, &near) : 0;
        TouchMemory *memory = &half->memory[points->used[i]];
        if (count == 0 && memory->face[0] == 0 && memory->face[1] == 0)
            continue;
        if (!look_around(touch, half, points->used[i], near, count))
            memory->bristle = (Vec3){0.0, 0.0, 0.0};
    }
}

// Adds what a point asks of the carriers of a node [N/m].
static void ask(const TouchEnd *end, double *demand, int number, double stiffness)
{
    CarrierWeight own;
    int count;
    const CarrierWeight *weight = carriers_of(&end->carriers, number, &own, &count);
    for (int w = 0; w < count; w++)
        demand[weight[w].carrier] += fabs(weight[w].weight) * stiffness;
}

// Finds what all points ask of the corners beneath them, and of their own carriers.
static void find_demand(TouchHalf *half)
{
    const Carriers *faces = &half->faces->carriers, *points = &half->points->carriers;
    memset(half->demand, 0, (size_t)faces->count * sizeof *half->demand);
    if (half->own_demand != NULL)
        memset(half->own_demand, 0, (size_t)points->count * sizeof *half->own_demand);
    for (int i = 0; i < half->point_count; i++) {
        const TouchPoint *point = &half->point[i];
        double most = 1.0;
        for (int k = 0; k < point->under_count; k++)
            most = fmax(most, carriers_size(faces, point->under[k]));
        const double asked = 0.5 * (carriers_size(points, point->own) + most) * point->stiffness;
        for (int k = 0; k < point->under_count; k++)
            ask(half->faces, half->demand, point->under[k], point->weight[k] * asked);
        if (half->own_demand != NULL)
            ask(half->points, half->own_demand, point->own, asked);
    }
}

// Returns what share of its demand the carriers of a node can bear, at most `least`. `each`: of
// their stiffness, what they may get.
static double bearable(const TouchEnd *end, const double *demand, int number, double each,
                       double least)
{
    const Body *body = end->body;
    CarrierWeight own;
    int count;
    const CarrierWeight *weight = carriers_of(&end->carriers, number, &own, &count);
    for (int w = 0; w < count; w++) {
        const int v = end->carriers.node[weight[w].carrier];
        const double mass = body->surface.node_mass[v], asked = demand[weight[w].carrier];
        if (mass > 0.0 && asked > 0.0 && !body->ops->is_fixed(body->model, v))
            least = fmin(least, each * body->contact_lambda * mass / asked);
    }
    return least;
}

// Softens points whose corners, or whose own carriers, would get more than the bound of their body
// allows (server/sim/README.md, "Contact between bodies").
static void share_stiffness(Touch *touch, TouchHalf *half)
{
    const double g = touch->options.stiffness;
    // Points between two walls ask twice.
    const double share = half->faces->body->surface.solid ? 1.0 / 3.0 : 1.0 / 6.0;
    find_demand(half);
    for (int i = 0; i < half->point_count; i++) {
        TouchPoint *point = &half->point[i];
        double least = 1.0;
        for (int k = 0; k < point->under_count; k++)
            least = bearable(half->faces, half->demand, point->under[k], share * g, least);
        if (half->own_demand != NULL)
            least = bearable(half->points, half->own_demand, point->own, g / 6.0, least);
        point->stiffness *= least;
        // What presses gets no stiffer by a search, which would add energy.
        double *kept = &half->memory[point->node].stiffness;
        const bool presses = point->clear < 0.0;
        if (presses && *kept > 0.0)
            point->stiffness = fmin(point->stiffness, *kept);
        *kept = presses ? point->stiffness : 0.0;
    }
}

// Returns how much nearer bodies come in a tick, by half more than at their speeds now [m].
static double way_of_tick(const Touch *touch)
{
    return SPEEDUP * touch->tick * (touch->end[0].fastest + touch->end[touch->count - 1].fastest);
}

// Sets how far a search reaches: over a tick, or several of slow bodies.
static void set_reach(Touch *touch)
{
    const Body *a = touch->body[0], *b = touch->body[1];
    const double longest = fmax(a->surface.longest_edge, b->surface.longest_edge),
                 edge = fmin(a->surface.longest_edge, b->surface.longest_edge);
    const double way = way_of_tick(touch);
    touch->edge = edge;
    touch->margin = 0.01 * edge;
    touch->fast = touch->end[0].piece != NULL && way > AHEAD_WAY * edge;
    touch->least_slack = AHEAD_WAY * edge + 2.0 * touch->margin;
    touch->slack = fmax(way, fmin(AHEAD * way, AHEAD_WAY * edge)) + 2.0 * touch->margin;
    touch->overlap = touch->count == 2 && touch->kept->searches == 1 ? edge : 0.0;
    touch->reach = 2.0 * touch->slack + touch->thickness + touch->overlap;
    touch->deepest = DEEPEST * longest;
}

// Searches from where the nodes are placed.
static void search(Touch *touch)
{
    for (int e = 0; e < touch->count; e++)
        touch_forget_numbers(&touch->end[e]);
    const TouchEnd *first = &touch->end[0], *second = &touch->end[touch->count - 1];
    touch->expires = touch->looked = false;
    touch->budget = BUDGET * (int64_t)(first->used_count + second->used_count);
    const Box box = box_common(&first->box, &second->box, touch->reach);
    for (int e = 0; e < touch->count; e++)
        if (touch->end[e].fit != NULL)
            place_nodes(touch, &touch->end[e], &box);
    for (int k = 0; k < touch->count; k++)
        search_half(touch, &touch->half[k], &box);
    touch->refused += touch->budget <= 0;
    for (int e = 0; e < touch->count; e++) {
        TouchEnd *end = &touch->end[e];
        touch->refused += carriers_list(&end->carriers, end->node, end->count);
    }
    for (int k = 0; k < touch->count; k++)
        share_stiffness(touch, &touch->half[k]);
}

// True if a body that touches itself needs no look at its nodes, by a bound on how they move: what
// the last search found still serves, or it is a whole solid whose parts have not come near each
// other.
static bool is_quiet(Touch *touch)
{
    const TouchEnd *end = &touch->end[0];
    const Body *body = end->body;
    double displacement, speed;
    if (touch->count == 2 || body->ops->bound_motion == NULL)
        return false;
    body->ops->bound_motion(body->model, &displacement, &speed);
    speed *= end->fit != NULL ? FIT_BEYOND : 1.0;
    // The last tick at its faster end, then this one.
    const double way = 2.0 * SPEEDUP * touch->tick;
    touch->drift += way * fmax(touch->speed, speed);
    touch->speed = speed;
    if (touch->kept->holds != 0)
        return touch->drift + way * speed + touch->margin <= touch->slack;
    const double apart =
        touch->rest_gap - 2.0 * (end->fit != NULL ? FIT_BEYOND : 1.0) * displacement;
    if (!touch->whole || !body->surface.solid || !(apart > 0.0))
        return false;
    touch_forget_numbers(&touch->end[0]);
    touch->half[0].point_count = touch->half[0].pair_count = 0;
    touch->kept->wait =
        (int64_t)fmin(apart / (touch->tick * 2.0 * (speed + SPARE_SPEED)), TOUCH_MOST_WAIT);
    return true;
}

void touch_find_gap(Touch *touch)
{
    TouchEnd *end = &touch->end[0];
    const BodySurface *surface = &end->body->surface;
    TouchHalf *half = &touch->half[0];
    touch->whole_faces = surface->face_used;
    touch->rest_gap = TOUCH_MOST_GAP * surface->longest_edge;
    read_body(end);
    place_body(end);
    if (end->fit != NULL)
        place_nodes(touch, end, &end->box);
    touch_grid_build(half, &end->box, touch->rest_gap);
    for (int i = 0; i < end->used_count; i++) {
        const int node = end->used[i], *near = NULL;
        const Vec3 x = end->packed_place[i], out = point_normal(end, node);
        const int count = touch_grid_at(half, x, &near);
        for (int k = 0; k < count; k++) {
            // In front of each other.
            const TouchFace *face = &half->face[near[k]];
            const Vec3 arm = vec3_sub(face->center, x);
            if (vec3_dot(arm, out) > 0.0 && vec3_dot(arm, face->normal) < 0.0 &&
                !(vec3_dot(out, face->normal) > TOUCH_ALIGNED) &&
                !touch_has_corner(surface, face->face, node))
                touch->rest_gap = fmin(touch->rest_gap, vec3_length(arm) - face->radius);
        }
    }
    // A body may start out of shape.
    double displacement = (double)INFINITY, speed;
    if (end->body->ops->bound_motion != NULL)
        end->body->ops->bound_motion(end->body->model, &displacement, &speed);
    touch->rest_gap -= touch->thickness + 2.0 * displacement;
}

void touch_search(Touch *touch)
{
    TouchKept *kept = touch->kept;
    if (kept->wait > 0) { // nothing is near
        kept->wait--;
        return;
    }
    if (is_quiet(touch))
        return;
    double moved = read_body(&touch->end[0]);
    moved += touch->count == 2 ? read_body(&touch->end[1]) : moved;
    touch->drift = moved;
    if (kept->holds != 0 && moved + way_of_tick(touch) + touch->margin <= touch->slack)
        return;
    touch->drift = 0.0;
    // What a search depends on is kept, so that it can be repeated.
    kept->moved = moved;
    kept->searches += kept->searches < 2;
    for (int e = 0; e < touch->count; e++) {
        place_body(&touch->end[e]);
        kept->fastest[e] = touch->end[e].fastest;
        memcpy(touch->half[e].before, touch->half[e].memory,
               (size_t)touch->half[e].points->body->surface.node_count * sizeof(TouchMemory));
    }
    set_reach(touch);
    search(touch);
    // Far apart: nothing until they can have met.
    const double apart =
        box_gap(&touch->end[0].box, &touch->end[touch->count - 1].box) - touch->reach;
    const double speed = kept->fastest[0] + kept->fastest[1] + 2.0 * SPARE_SPEED;
    const bool far = apart > 0.0 && !touch_is_near(touch);
    if (far)
        kept->wait = (int64_t)fmin(apart / (touch->tick * speed), TOUCH_MOST_WAIT);
    kept->holds = !far && !touch->expires && !touch->fast && touch->overlap == 0.0;
}

void touch_search_again(Touch *touch)
{
    const int64_t refused = touch->refused;
    for (int e = 0; e < touch->count; e++) {
        TouchEnd *end = &touch->end[e];
        TouchHalf *half = &touch->half[e];
        end->fastest = touch->kept->fastest[e];
        for (int i = 0; i < end->used_count; i++)
            end->packed_place[i] = end->start[end->used[i]];
        place_body(end);
        for (int i = 0; i < half->points->body->surface.node_count; i++) {
            memcpy(half->memory[i].face, half->before[i].face, sizeof half->memory[i].face);
            memcpy(half->memory[i].side, half->before[i].side, sizeof half->memory[i].side);
            memcpy(half->memory[i].gap, half->before[i].gap, sizeof half->memory[i].gap);
            half->memory[i].stiffness = half->before[i].stiffness;
        }
    }
    set_reach(touch);
    touch->repeats = true;
    search(touch);
    touch->repeats = false;
    touch->refused = refused; // counted when it was done first
}
