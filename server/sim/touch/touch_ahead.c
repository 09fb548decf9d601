// SPDX-License-Identifier: MIT
// Where a body is touched, or will be soon as bodies move now: for bodies that are finer there.
// Step thread; a function of the state alone.
#include "sim/touch/touch_data.h"

// Bodies that are apart may speed up by this, both together, before they are looked at [m/s].
static const double SPARE_SPEED = 1.0;
static const double LEAST_WAY = 0.25; // of a cell: bodies that come no nearer are at rest

// The nodes of an end in chunks, with where they are and how they move.
typedef struct Chunk {
    int next, count;
    Vec3 x[PLACES_AT_ONCE], v[PLACES_AT_ONCE];
} Chunk;

static bool read_next(const TouchEnd *end, Chunk *chunk)
{
    const int left = end->used_count - chunk->next;
    chunk->count = left < PLACES_AT_ONCE ? left : PLACES_AT_ONCE;
    end->body->ops->read_nodes(end->body->model, end->used + chunk->next, chunk->count, chunk->x,
                               chunk->v);
    chunk->next += chunk->count;
    return chunk->count > 0;
}

// Adds what a box holds of a way.
static void add_inside(Box *all, const Box *box, Vec3 from, Vec3 way)
{
    const double start[3] = {from.x, from.y, from.z}, by[3] = {way.x, way.y, way.z};
    double in = 0.0, out = 1.0;
    for (int d = 0; d < 3; d++) {
        if (by[d] == 0.0) {
            out = start[d] < box->low[d] || start[d] > box->high[d] ? -1.0 : out;
            continue;
        }
        const double a = (box->low[d] - start[d]) / by[d], b = (box->high[d] - start[d]) / by[d];
        in = fmax(in, fmin(a, b));
        out = fmin(out, fmax(a, b));
    }
    if (in > out)
        return;
    box_add(all, vec3_madd(from, in, way));
    box_add(all, vec3_madd(from, out, way));
}

// Returns the box of what the nodes of an end sweep inside another box [m]. `velocity`: of what
// they are seen from.
static Box sweep(const TouchEnd *end, Vec3 velocity, double ahead, const Box *inside)
{
    Box box = box_empty();
    for (Chunk chunk = {0}; read_next(end, &chunk);)
        for (int i = 0; i < chunk.count; i++)
            add_inside(&box, inside, chunk.x[i], vec3_scale(ahead, vec3_sub(chunk.v[i], velocity)));
    return box;
}

// True if bodies can meet within a time, by what the last search saw.
static bool can_meet(const Touch *touch, double ahead, double size)
{
    const TouchKept *kept = touch->kept;
    const double speed = kept->fastest[0] + kept->fastest[1];
    if (kept->searches == 0)
        return true;
    // That may be so many ticks ago.
    const double time = ahead + TOUCH_MOST_WAIT * touch->tick;
    return speed * ahead > LEAST_WAY * size &&
           box_gap(&touch->end[0].box, &touch->end[1].box) < (speed + SPARE_SPEED) * time;
}

// Adds where the surface of one body is that the other will meet.
static void add_meeting(const Touch *touch, int own, double ahead, Places *places)
{
    const TouchEnd *end = &touch->end[own], *other = &touch->end[1 - own];
    const double size = end->body->surface.longest_edge / sqrt(2.0);
    if (!can_meet(touch, ahead, size))
        return;
    Vec3 velocity = {0.0, 0.0, 0.0};
    Box all = box_empty();
    for (Chunk chunk = {0}; read_next(end, &chunk);)
        for (int i = 0; i < chunk.count; i++) {
            velocity = vec3_madd(velocity, 1.0 / end->used_count, chunk.v[i]);
            box_add(&all, chunk.x[i]);
        }
    // The part of the surface that is in what the other sweeps, and then what it sweeps there: of a
    // ball above a floor the cap alone. Between nodes there are faces.
    const double margin = fmax(size, 0.5 * other->body->surface.longest_edge);
    box_grow(&all, margin);
    Box swept = sweep(other, velocity, ahead, &all), near = box_empty();
    if (box_is_empty(&swept))
        return;
    box_grow(&swept, margin);
    for (Chunk chunk = {0}; read_next(end, &chunk);)
        for (int i = 0; i < chunk.count; i++)
            if (box_has(&swept, chunk.x[i]))
                box_add(&near, chunk.x[i]);
    if (box_is_empty(&near))
        return;
    Box wide = near;
    box_grow(&wide, margin);
    swept = sweep(other, velocity, ahead, &wide);
    const Box met = box_common(&near, &swept, 0.0);
    if (box_is_empty(&met))
        return;
    box_add(&places->box, box_low(&met));
    box_add(&places->box, box_high(&met));
}

// Adds what something is near.
static void add_touched(const TouchHalf *half, Places *places)
{
    const Body *points = half->points->body, *faces = half->faces->body;
    for (int i = 0; i < points->surface.node_used; i++)
        for (int p = 0; p < TOUCH_PATCHES && half->memory[i].face[p] != 0; p++) {
            if (points == places->body && p == 0)
                places_add(places, i);
            for (int c = 0; c < 3 && faces == places->body; c++)
                places_add(places, faces->surface.face[half->memory[i].face[p] - 1][c]);
        }
}

void touch_add_places(const Touch *touch, double ahead, Places *places)
{
    const bool apart = touch->count == 2 && touch->kept->wait > 0; // nothing is near then
    for (int k = 0; k < touch->count && !apart; k++)
        add_touched(&touch->half[k], places);
    for (int own = 0; own < 2 && touch->count == 2; own++)
        if (touch->body[own] == places->body)
            add_meeting(touch, own, ahead, places);
}
