// SPDX-License-Identifier: MIT
// What approaches a body, in each tick. All of it follows from the state of the tick, so that
// replays and restored runs repeat it. Step thread; no allocation except in ahead_create.
#include "sim/ahead.h"

#include "sim/guard/guard.h"
#include "sim/places.h"

#include <math.h>

// Places of what holds, loads or touches a body move slowly: they are found again every so many
// ticks, each body in another one.
enum {
    PLACES_EVERY = 16,
    // So far ahead bodies are seen to meet: places are found again meanwhile, and as many ticks
    // are left to what is divided there.
    MEETING_TICKS = 2 * PLACES_EVERY,
};
// Strips that cover a place are so wide, if there are not too many of them [cells].
static const double STRIP = 4.0;
// Added to sides before they are cut to whole cells: far from 0 and 1, where sides between corners
// of cells are, and from a half.
static const double ROUND_UP = 0.35;
// A body that moves less meanwhile is at rest [half edges]; none is seen to fall faster [m/s].
static const double LEAST_WAY = 0.1, MOST_SPEED = 2.0;
static const double LARGEST_TURN = 1.0; // [rad] that a predicted path may turn a tool by

// ---------------------------------------------------------------------------------------------
// Lists

// Returns the distance of a point from the axis [m].
static double distance_from(const Approach *approach, Vec3 x)
{
    const Region axis = {.from = approach->from, .to = approach->to};
    return region_distance(&axis, x);
}

// Returns a capsule around two others: its axis joins two of their ends, those farthest apart.
static Approach unite(const Approach *a, const Approach *b)
{
    const Vec3 end[4] = {a->from, a->to, b->from, b->to};
    const double radius[4] = {a->radius, a->radius, b->radius, b->radius},
                 reach[4] = {a->reach, a->reach, b->reach, b->reach};
    Approach both = {.from = end[0], .to = end[0], .begin = fmin(a->begin, b->begin)};
    double farthest = 0.0;
    for (int i = 0; i < 4; i++)
        for (int k = 0; k < i; k++) {
            const double length = vec3_length(vec3_sub(end[i], end[k]));
            if (length <= farthest)
                continue;
            farthest = length;
            both.from = end[k];
            both.to = end[i];
        }
    // Lists have either tools or places.
    const bool places = a->reach > 0.0;
    for (int i = 0; i < 4; i++) {
        const double off = distance_from(&both, end[i]);
        both.radius = places ? 0.0 : fmax(both.radius, off + radius[i]);
        both.reach = places ? fmax(both.reach, off + reach[i]) : 0.0;
    }
    return both;
}

// The volume of a capsule without the factor pi [m3].
static double bulk(const Approach *a)
{
    const double radius = fmax(a->radius, a->reach);
    return radius * radius * (vec3_length(vec3_sub(a->to, a->from)) + 4.0 / 3.0 * radius);
}

int ahead_add(Approach *list, int count, int most, const Approach *approach)
{
    if (count < most) {
        list[count] = *approach;
        return count + 1;
    }
    // No room: the one that grows least takes it in.
    int best = 0;
    double least = (double)INFINITY;
    Approach united = list[0];
    for (int i = 0; i < count; i++) {
        const Approach both = unite(&list[i], approach);
        const double more = bulk(&both) - bulk(&list[i]);
        if (more >= least)
            continue;
        least = more;
        best = i;
        united = both;
    }
    list[best] = united;
    return count;
}

int ahead_cover(const Box *box, double size, bool flat, int most, Approach *list)
{
    if (box_is_empty(box))
        return 0;
    // Sides by length in whole cells, the longest first. Places at rest tremble by rounding, and
    // are often as long one way as the other: strips that changed with that would divide and merge
    // elements for ever.
    int axis[3] = {0, 1, 2};
    double side[3], cells[3];
    for (int c = 0; c < 3; c++) {
        side[c] = box->high[c] - box->low[c];
        cells[c] = floor(side[c] / size + ROUND_UP);
    }
    // A body that goes bad is the guard's; no width would be enough.
    if (!isfinite(cells[0] + cells[1] + cells[2]))
        return 0;
    for (int i = 1; i < 3; i++)
        for (int k = i; k > 0 && cells[axis[k]] > cells[axis[k - 1]]; k--) {
            const int swap = axis[k];
            axis[k] = axis[k - 1];
            axis[k - 1] = swap;
        }
    // Strips across the others, so wide that there are not too many.
    int count[2];
    double width = STRIP;
    for (;; width *= 1.25) {
        for (int i = 0; i < 2; i++)
            count[i] = (int)fmax(1.0, fmin(ceil(cells[axis[i + 1]] / width), most + 1.0));
        if (count[0] * count[1] <= most)
            break;
    }
    double half = 0.0;
    for (int i = 0; i < 2; i++)
        half = hypot(half, 0.5 * side[axis[i + 1]] / count[i]);
    // A node alone is within an element.
    const double reach = fmax(half, size),
                 thick = flat ? 0.5 * (side[axis[2]] / count[1] + size) : 0.0;
    const Vec3 across = vec3(axis[2] == 0, axis[2] == 1, axis[2] == 2);
    int found = 0;
    for (int i = 0; i < count[0]; i++)
        for (int k = 0; k < count[1]; k++) {
            double at[3];
            at[axis[1]] = box->low[axis[1]] + (i + 0.5) / count[0] * side[axis[1]];
            at[axis[2]] = box->low[axis[2]] + (k + 0.5) / count[1] * side[axis[2]];
            at[axis[0]] = box->low[axis[0]];
            const Vec3 from = vec3(at[0], at[1], at[2]);
            at[axis[0]] = box->high[axis[0]];
            list[found++] = (Approach){.from = from,
                                       .to = vec3(at[0], at[1], at[2]),
                                       .reach = reach,
                                       .across = across,
                                       .thick = thick};
        }
    return found;
}

// ---------------------------------------------------------------------------------------------
// Tools

// The placements of a tool between which a path leads: as the tick begins, and when it goes on as
// it moves now. Without the noise of poses, and at rest if none come any more.
typedef struct ToolPath {
    ToolPlacement now, soon;
} ToolPath;

static ToolPath predict(const ToolMotion *motion)
{
    ToolPath path = {0};
    tool_motion_at(motion, 0.0, &path.now.position, &path.now.orientation);
    const double turn = APPROACH_TIME * vec3_length(motion->calm_angular);
    const double part = turn > LARGEST_TURN ? LARGEST_TURN / turn : 1.0;
    const Quat turned = quat_from_rotation(vec3_scale(part * APPROACH_TIME, motion->calm_angular));
    path.soon.position = vec3_madd(path.now.position, APPROACH_TIME, motion->calm_linear);
    path.soon.orientation = quat_unit(quat_multiply(turned, path.now.orientation));
    return path;
}

static Vec3 placed(const ToolPlacement *at, Vec3 local)
{
    return vec3_add(at->position, quat_rotate(at->orientation, local));
}

// Adds what a capsule in the tool frame sweeps: the ways of its ends, and its axis now and soon.
static int add_capsule(Approach *list, int count, const ToolPath *path, const Capsule *capsule)
{
    enum { MOST = APPROACH_MOST - AHEAD_PLACES };
    const Vec3 from = placed(&path->now, capsule->from), to = placed(&path->now, capsule->to);
    const Vec3 from_soon = placed(&path->soon, capsule->from),
               to_soon = placed(&path->soon, capsule->to);
    const bool sphere = !(vec3_length(vec3_sub(capsule->to, capsule->from)) > 0.0);
    // The ways of its ends, then its axis now and soon.
    const Vec3 way[4][2] = {{from, from_soon}, {to, to_soon}, {from, to}, {from_soon, to_soon}};
    for (int i = 0; i < (sphere ? 1 : 4); i++) {
        const double length = vec3_length(vec3_sub(way[i][1], way[i][0]));
        const Approach approach = {.from = way[i][0],
                                   .to = way[i][1],
                                   .radius = capsule->radius,
                                   .speed = i < 2 ? length / APPROACH_TIME : 0.0,
                                   .begin = i == 3 ? APPROACH_TIME : 0.0};
        count = ahead_add(list, count, MOST, &approach);
    }
    return count;
}

static int add_tool(const Sim *sim, int t, Approach *list, int count)
{
    const ToolOptions *tool = &sim->tool[t];
    const ToolMotion *motion = &sim->motion[t];
    if (tool->kind != TOOL_STATIC && !motion->active)
        return count;
    // A static tool is in the world frame, and never moves.
    const ToolPlacement still = {.orientation = QUAT_NONE};
    const ToolPath path =
        tool->kind == TOOL_STATIC ? (ToolPath){.now = still, .soon = still} : predict(motion);
    for (int k = 0; k < tool->capsule_count; k++)
        count = add_capsule(list, count, &path, &tool->capsule[k]);
    // What cuts or takes tissue away needs no capsule.
    if (tool->kind == TOOL_BLADE)
        count =
            add_capsule(list, count, &path, &(Capsule){.from = tool->edge[0], .to = tool->edge[1]});
    if (tool->kind == TOOL_REMOVER)
        count = add_capsule(list, count, &path, &tool->mouth);
    return count;
}

// ---------------------------------------------------------------------------------------------
// Places

// Returns how far above a plane the lowest of some nodes is that reach it within a time; 0: one is
// there, or none comes.
static double height_above(const Body *body, const Plane *plane, double ahead, const int *node,
                           int count)
{
    double lowest = (double)INFINITY;
    bool comes = false;
    for (int i = 0; i < count; i++) {
        Vec3 x, v;
        body->ops->read_nodes(body->model, &node[i], 1, &x, &v);
        const double height = vec3_dot(vec3_sub(x, plane->point), plane->normal);
        lowest = fmin(lowest, height);
        comes |= height + ahead * vec3_dot(v, plane->normal) < 0.0;
    }
    return comes ? fmax(lowest, 0.0) : 0.0;
}

// Adds the nodes of a body that are on a plane or near it, and of one that falls the lowest ones.
static void add_plane(const Sim *sim, int b, const Plane *plane, Places *places)
{
    const Body *body = &sim->body[b];
    const double near = 0.5 * body->surface.longest_edge, ahead = MEETING_TICKS * sim->tick;
    int *found = sim->ahead->found, count;
    double displacement, speed = 0.0;
    Region region = {
        .kind = REGION_BELOW_PLANE, .from = plane->point, .to = plane->normal, .radius = near};
    if (body->ops->bound_motion != NULL)
        body->ops->bound_motion(body->model, &displacement, &speed);
    const double way = ahead * fmin(speed, MOST_SPEED);
    if (way > LEAST_WAY * near) {
        region.radius = near + way;
        count = body->ops->find_nodes(body->model, &region, found, body->surface.node_count);
        region.radius = near + height_above(body, plane, ahead, found, count);
    }
    count = body->ops->find_nodes(body->model, &region, found, body->surface.node_count);
    places->flat = true;
    for (int i = 0; i < count; i++)
        places_add(places, found[i]);
}

// Finds what acts on a body at source number `source`; returns false if there is none so high.
static bool find_source(const Sim *sim, int b, int source, Places *places)
{
    const Body *body = &sim->body[b];
    const int held = sim->attachment_start[b + 1] - sim->attachment_start[b];
    *places = places_of(body);
    // Attachments and graspers, then ties and joints,
    if (source < held) {
        attachment_add_places(sim->attachment[sim->attachment_start[b] + source], body, places);
        return true;
    }
    source -= held;
    if (source < sim->joint_count) {
        attachment_add_places(sim->joint[source], body, places);
        return true;
    }
    source -= sim->joint_count;
    // loads,
    const int loads = sim->loads.count != NULL ? (int)*sim->loads.count : 0;
    if (source < loads) {
        int first = 0;
        for (int k = 0; k < b; k++)
            first += sim->body[k].surface.node_count;
        loads_add_places(&sim->loads, source, first, places);
        return true;
    }
    source -= loads;
    // other bodies, and planes.
    if (source < sim->touch_count) {
        touch_add_places(sim->touch[source], MEETING_TICKS * sim->tick, places);
        return true;
    }
    source -= sim->touch_count;
    if (source >= sim->tool_count)
        return false;
    if (sim->tool[source].has_plane)
        add_plane(sim, b, &sim->tool[source].plane, places);
    return true;
}

static void find_places(Sim *sim, int b)
{
    AheadPlaces *kept = sim->ahead->places[b];
    const double size = sim->body[b].surface.longest_edge / sqrt(2.0);
    Approach list[AHEAD_PLACES];
    Places places;
    *kept = (AheadPlaces){0};
    for (int source = 0; find_source(sim, b, source, &places); source++) {
        places_read(&places);
        // Each has the room that is left, and a few of those before it give way.
        const int room = AHEAD_PLACES - (int)kept->count;
        const int found = ahead_cover(&places.box, size, places.flat, room > 1 ? room : 1, list);
        for (int i = 0; i < found; i++)
            kept->count = ahead_add(kept->place, (int)kept->count, AHEAD_PLACES, &list[i]);
    }
}

// ---------------------------------------------------------------------------------------------

void ahead_create(Sim *sim)
{
    int most = 0;
    for (int b = 0; b < sim->body_count; b++)
        if (sim->body[b].ops->approach != NULL && sim->body[b].surface.node_count > most)
            most = sim->body[b].surface.node_count;
    if (most == 0)
        return;
    Ahead *ahead = arena_allocate(sim->arena, ARENA_STEP, 1, sizeof *ahead, "sim/ahead");
    ahead->found =
        arena_allocate(sim->arena, ARENA_STEP, (size_t)most, sizeof *ahead->found, "sim/found");
    sim->ahead = ahead;
    for (int b = 0; b < sim->body_count; b++) {
        if (sim->body[b].ops->approach == NULL)
            continue;
        ahead->places[b] = arena_allocate(sim->arena, ARENA_STEP, 1, sizeof *ahead->places[b],
                                          "%s/places", sim->body[b].name);
        state_add(sim->state, ahead->places[b], sizeof *ahead->places[b], "%s/places",
                  sim->body[b].name);
    }
}

void ahead_tell(Sim *sim, int b)
{
    const Body *body = &sim->body[b];
    if ((sim->clock->step + b) % PLACES_EVERY == 0)
        find_places(sim, b);
    const AheadPlaces *places = sim->ahead->places[b];
    Approach list[APPROACH_MOST];
    int count = 0;
    for (int t = 0; t < sim->tool_count; t++)
        count = add_tool(sim, t, list, count);
    for (int i = 0; i < (int)places->count; i++)
        list[count++] = places->place[i];
    body->ops->approach(body->model, list, count);
}

static bool is_sensible(const Approach *approach)
{
    // Numbers that are not finite fail.
    return vec3_length(approach->from) < 1e9 && vec3_length(approach->to) < 1e9 &&
           approach->reach > 0.0 && approach->reach < 1e9 && approach->radius == 0.0 &&
           approach->speed == 0.0 && approach->begin == 0.0 &&
           vec3_length(approach->across) < 2.0 && approach->thick >= 0.0 && approach->thick < 1e9;
}

bool ahead_check(const Sim *sim)
{
    for (int b = 0; sim->ahead != NULL && b < sim->body_count; b++) {
        const AheadPlaces *places = sim->ahead->places[b];
        if (places == NULL)
            continue;
        if (places->count < 0 || places->count > AHEAD_PLACES)
            return false;
        for (int i = 0; i < (int)places->count; i++)
            if (!is_sensible(&places->place[i]))
                return false;
    }
    return true;
}
