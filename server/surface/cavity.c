// SPDX-License-Identifier: MIT
// The cavity of a wall: its constants, the volume from evaluation to evaluation, leaks.
#include "surface/cavity.h"

#include "base/check.h"
#include "base/sets.h"
#include "surface/detail/detail.h"

#include <math.h>
#include <stdlib.h>

static const double WATER = 1000.0, AIR = 1.2; // density [kg/m3]
// Contraction of a jet through a sharp-edged hole (Lamb, Hydrodynamics, art. 24: 0.61 to 0.64).
static const double DISCHARGE = 0.62;
// What the bound of the time step leaves room for: the wall's faces may grow to twice their edges,
// a gas be compressed to 0.7 of its volume, and SET double the pressure.
static const double ROOM = 2.0;
// A gas in less than this part of its volume at rest is compressed no further: the wall is turned
// inside out.
static const double LEAST_VOLUME = 1e-2;
static const double NOTHING_MOVES = 1e5; // [Pa]
static const double PRESSURE_MOST = 1e6; // as in a scene [Pa]
static const double EASE = 0.05;         // in which most of what SET asked for has come [s]

// ---------------------------------------------------------------------------------------------
// Load time

// Returns the volume [m3]; adds its gradient [m2] and the lengths of the edges around each node
// [m], unless NULL. Positions count from the first node, which keeps digits.
static double measure_mesh(const TriMesh *mesh, Vec3 *gradient, double *around)
{
    double volume = 0.0;
    for (int f = 0; f < mesh->triangle_count; f++) {
        const int *node = mesh->triangle[f];
        Vec3 x[3];
        for (int k = 0; k < 3; k++)
            x[k] = vec3_sub(mesh->position[node[k]], mesh->position[0]);
        const Vec3 area = vec3_cross(vec3_sub(x[1], x[0]), vec3_sub(x[2], x[0]));
        volume += vec3_dot(x[0], area) / 6.0;
        for (int k = 0; k < 3 && gradient != NULL; k++) {
            gradient[node[k]] = vec3_add(gradient[node[k]], vec3_scale(1.0 / 6.0, area));
            around[node[k]] += vec3_length(vec3_sub(x[(k + 1) % 3], x[(k + 2) % 3]));
        }
    }
    return volume;
}

bool cavity_fits(const SurfaceOptions *options, const TriMesh *mesh, const WingedMesh *winged,
                 Status *status)
{
    if (options->body.integrator == INTEGRATOR_IMPLICIT)
        return status_fail(status, STATUS_INVALID,
                           "cavity needs an integrator with explicit steps, not \"implicit\"");
    if (options->body.levels > 0 && options->adjust == ADJUST_CHOI2005)
        return status_fail(status, STATUS_INVALID,
                           "cavity needs adjust = \"continuum\", with hanging nodes in the middle "
                           "of their edges: with \"choi2005\" the wall has gaps");
    const double bulk = options->cavity.fluid ? options->cavity.bulk_modulus : 0.0;
    if (bulk > 0.0 && options->cavity.pressure > 0.5 * bulk)
        return status_fail(status, STATUS_INVALID,
                           "cavity: a pressure of %g Pa is more than half of the bulk_modulus, %g "
                           "Pa: what gives way so far is a gas",
                           options->cavity.pressure, bulk);
    // Closed, with its outside outside.
    int borders = 0;
    for (int e = 0; e < winged->edge_count; e++)
        borders += winged->edge[e].face[0] < 0 || winged->edge[e].face[1] < 0;
    if (borders > 0)
        return status_fail(status, STATUS_INVALID,
                           "cavity needs a closed mesh: this one has %d edges with one face only",
                           borders);
    for (int i = 0; i < mesh->node_count && surface_changes(options); i++)
        if (winged_valence(winged, i) > CAVITY_RING)
            return status_fail(status, STATUS_INVALID,
                               "cavity: node %d has %d faces; of a body that refines or is cut at "
                               "most %d",
                               i, winged_valence(winged, i), CAVITY_RING);
    const double volume = measure_mesh(mesh, NULL, NULL);
    if (volume > 0.0)
        return true;
    return status_fail(status, STATUS_INVALID,
                       "cavity needs faces that are counter-clockwise seen from outside: this mesh "
                       "encloses %.3g m3",
                       volume);
}

void cavity_start(Cavity *cavity, const SurfaceOptions *options, const TriMesh *mesh,
                  const SpringNetwork *network)
{
    const SurfaceCavity *asked = &options->cavity;
    Vec3 *gradient = calloc((size_t)mesh->node_count + 1, sizeof *gradient);
    double *around = calloc((size_t)mesh->node_count + 1, sizeof *around);
    ASSERT(gradient != NULL && around != NULL);
    *cavity = (Cavity){.options = *asked, .rest_volume = measure_mesh(mesh, gradient, around)};
    if (!(asked->density > 0.0))
        cavity->options.density = asked->gas ? AIR : WATER;

    // The volume's gradient g makes a rank-one stiffness -dp/dV g g^T, whose largest eigenvalue is
    // exactly that times the sum of g^2 / m. The pressure itself turns with the wall: moving a
    // neighbour changes the force on a node by p / 6 times the distance of the two nodes beside it,
    // and all of them at most by p / 3 times the edges around the node.
    double whole = 0.0, turned = 0.0;
    for (int i = 0; i < mesh->node_count; i++) {
        if (network->fixed[i])
            continue;
        whole += vec3_dot(gradient[i], gradient[i]) / network->mass[i];
        turned = fmax(turned, around[i] / (3.0 * network->mass[i]));
    }
    // Masses are those of level 0; each level halves the edges and has a quarter of the mass.
    // Against the linear law: what stiffens or relaxes is no harder to fill.
    const double springs = network->finest_linear;
    double volume = 0.0; // -dp/dV [Pa/m3]
    if (asked->gas)
        volume = ROOM * (asked->ambient + fmax(0.0, asked->pressure)) / cavity->rest_volume;
    if (asked->fluid) {
        // As stiff as costs the square root of two in the time step; any, where nothing can move.
        const double most =
            whole > 0.0 ? springs * cavity->rest_volume / (ROOM * whole) : NOTHING_MOVES;
        cavity->bulk_modulus = asked->bulk_modulus > 0.0 ? asked->bulk_modulus : most;
        volume = ROOM * cavity->bulk_modulus / cavity->rest_volume;
    }
    // At least a twentieth of the springs' bound is left for pressures that SET asks for.
    const double per_pascal = ROOM * ldexp(turned, options->body.levels),
                 room = fmax(ROOM * per_pascal * fabs(asked->pressure), 0.05 * springs);
    cavity->lambda = whole * volume + room;
    cavity->pressure_limit = per_pascal > 0.0 ? room / per_pascal : PRESSURE_MOST;
    free(gradient);
    free(around);
}

Cavity *cavity_create(const Cavity *start, const char *name, Arena *arena, StateList *state)
{
    Cavity *cavity = ALLOCATE(ARENA_STEP, 1, Cavity, "cavity");
    *cavity = *start;
    cavity->state = ALLOCATE(ARENA_STEP, 1, CavityState, "state of the cavity");
    state_add(state, cavity->state, sizeof *cavity->state, "%s/cavity", name);
    cavity->state->content = cavity->state->wanted = cavity->options.pressure;
    cavity->state->supplied = 1;
    return cavity;
}

void cavity_create_tables(SurfaceModel *model, const char *name, Arena *arena)
{
    Cavity *cavity = model->cavity;
    const size_t lanes = (size_t)model->lane_count;
    // The volume, if the pressure depends on it; displacements need the places that they count
    // from.
    const bool varies = cavity->options.gas || cavity->options.fluid;
    if (varies) {
        cavity->pass.volume = model_allocate_reals(model, lanes, name, "parts of volume", arena);
        cavity->pass.change = model_allocate_reals(model, lanes, name, "changes of volume", arena);
    }
    if (varies && model->basis.precision == PRECISION_SINGLE)
        cavity->place = model_allocate_reals(model, 3 * lanes, name, "places of nodes", arena);
    cavity->pass.place = cavity->place;
    if (model->detail == NULL) {
        for (int s = 0; s < model->basis.count; s++)
            cavity_put_place(model, s, s);
        return;
    }
    if (model->detail->set.cut == NULL)
        return;
    // Borders, as many as cuts can make.
    const int nodes = model->detail->set.node_count, faces = model->detail->set.face_count;
    cavity->node_count = nodes;
    cavity->edge = arena_allocate(arena, ARENA_TOPOLOGY, 3 * (size_t)faces, sizeof *cavity->edge,
                                  "%s/edges of openings", name);
    cavity->root = ALLOCATE(ARENA_TOPOLOGY, nodes, int, "borders of openings");
    cavity->border = ALLOCATE(ARENA_TOPOLOGY, nodes, CavityBorder, "openings");
}

void cavity_put_place(SurfaceModel *model, int lane, int slot)
{
    for (int c = 0; c < 3 && model->cavity->place != NULL; c++)
        model_put(model, model->cavity->place, model_lane(lane) + c * LANES,
                  model->basis.rest[slot][c]);
}

int cavity_ring(int own, int count, const int (*side)[2], int *ring)
{
    ASSERT(count <= CAVITY_RING);
    bool used[CAVITY_RING] = {false};
    int length = 0;
    for (int left = count; left > 0;) {
        // A run of faces starts where none comes before, else anywhere.
        int start = -1;
        for (int i = 0; i < count; i++) {
            bool follows = false;
            for (int k = 0; k < count && !used[i]; k++)
                follows |= !used[k] && side[k][1] == side[i][0];
            if (!used[i] && (start < 0 || !follows))
                start = i;
            if (!used[i] && !follows)
                break;
        }
        int corner = side[start][0];
        for (int next = start; next >= 0; left--) {
            used[next] = true;
            ring[length++] = side[next][0];
            corner = side[next][1];
            next = -1;
            for (int k = 0; k < count && next < 0; k++)
                if (!used[k] && side[k][0] == corner)
                    next = k;
        }
        // Closed by the padding, if it is the whole ring.
        if (corner == side[start][0] && length == count)
            continue;
        ring[length++] = corner;
        ring[length++] = own;
    }
    return length;
}

// ---------------------------------------------------------------------------------------------
// What is inside

// Returns the volume that the pressure follows from [m3], holes closed.
static double closed_volume(const Cavity *cavity)
{
    return cavity->state->flow.volume + cavity->state->cap;
}

// Returns the pressure of a jet that lets out a volume in the time of a tick (Bernoulli); infinite
// through no opening.
static double jet_pressure(const CavityState *state, double density, double volume)
{
    const double speed = volume / (DISCHARGE * state->opening * state->flow.tick);
    return 0.5 * density * speed * speed;
}

static double pressure_in(const Cavity *cavity, double volume)
{
    const SurfaceCavity *options = &cavity->options;
    const CavityState *state = cavity->state;
    const double content = state->content, least = LEAST_VOLUME * cavity->rest_volume;
    double pressure = content, more = 0.0;
    if (state->supplied != 0 || !(options->gas || options->fluid))
        return content;
    if (options->gas) {
        pressure = content / fmax(volume, least) - options->ambient;
        more = content / fmax(options->ambient, 1.0) - volume;
    } else {
        pressure = cavity->bulk_modulus * (1.0 - volume / content);
        more = content - volume;
    }
    // What leaves within a tick presses no harder than it must, a wide opening is no bulkhead; nor
    // harder than before: pressed further, an open wall gives way.
    if (state->opening > 0.0)
        pressure = fmin(fmax(0.0, fmin(pressure, state->held)),
                        jet_pressure(state, options->density, more));
    return pressure;
}

double cavity_pressure(const Cavity *cavity)
{
    return pressure_in(cavity, closed_volume(cavity));
}

// Returns the content of a gas or fluid that has a pressure in a volume. None has a fluid bear more
// than its modulus, which it would have where it fills nothing.
static double content_of(const Cavity *cavity, double pressure, double volume)
{
    return cavity->options.gas ? (cavity->options.ambient + pressure) * volume
                               : volume / fmax(LEAST_VOLUME, 1.0 - pressure / cavity->bulk_modulus);
}

// ---------------------------------------------------------------------------------------------
// A tick

// Returns the volume of these rows [m3]: as the kernel, in double precision.
static double measure(const SurfaceModel *model, const void *rows)
{
    const SpringTable *springs = &model->springs;
    double volume = 0.0;
    for (int s = 0; s < model->basis.count; s++) {
        const int lane = model->node[s] < 0 ? -1 : model_lane_of(model, s);
        if (lane < 0)
            continue;
        const Vec3 own = rows_local(&model->basis, rows, s);
        Vec3 first = {0.0, 0.0, 0.0}, before = first, area = first;
        for (int e = springs->start[lane / LANES]; e < springs->end[lane / LANES]; e++) {
            const int other = springs->neighbour[(long)e * LANES + lane % LANES];
            const Vec3 d = vec3_sub(own, rows_local(&model->basis, rows, other));
            first = e == springs->start[lane / LANES] ? d : first;
            area = vec3_add(area, vec3_cross(before, d));
            before = d;
        }
        area = vec3_add(area, vec3_cross(before, first));
        volume += vec3_dot(own, area);
    }
    return volume / 18.0;
}

double cavity_volume(const SurfaceModel *model)
{
    return measure(model, model->rows[model->current]) + model->cavity->state->cap;
}

double cavity_energy(const SurfaceModel *model)
{
    const Cavity *cavity = model->cavity;
    const SurfaceCavity *options = &cavity->options;
    const double content = cavity->state->content, volume = cavity_volume(model),
                 least = LEAST_VOLUME * cavity->rest_volume;
    // The negative integral of the pressure over the volume.
    if (cavity->state->supplied == 0 && options->gas)
        return options->ambient * volume -
               content * (log(fmax(volume, least) / cavity->rest_volume) +
                          fmin(0.0, volume - least) / least);
    if (cavity->state->supplied == 0 && options->fluid)
        return 0.5 * cavity->bulk_modulus * (content - volume) * (content - volume) / content;
    return -content * volume;
}

// Disconnects a gas or fluid from its supply.
static void seal(Cavity *cavity, double volume)
{
    CavityState *state = cavity->state;
    if (state->supplied == 0 || !(cavity->options.gas || cavity->options.fluid))
        return;
    state->supplied = 0;
    state->content = state->wanted = content_of(cavity, state->content, volume);
}

void cavity_set(SurfaceModel *model, BodyParameter parameter, double value)
{
    Cavity *cavity = model->cavity;
    CavityState *state = cavity->state;
    // Between ticks, and perhaps before the first.
    const double volume = cavity_volume(model);
    if (parameter == BODY_PRESSURE) {
        state->content = pressure_in(cavity, volume);
        state->supplied = 1;
        state->wanted = value;
        return;
    }
    // A wall that tore while the scene came to rest stays as it is.
    if (parameter == BODY_VOLUME || cavity->edge_count == 0)
        seal(cavity, volume);
    if (parameter == BODY_VOLUME)
        state->wanted = cavity->options.gas ? cavity->options.ambient * value : value;
}

bool cavity_get(const SurfaceModel *model, BodyParameter parameter, double *value)
{
    const Cavity *cavity = model->cavity;
    const CavityState *state = cavity->state;
    const bool supplied = state->supplied != 0;
    if (parameter == BODY_PRESSURE) {
        *value = supplied ? state->wanted : cavity_pressure(cavity);
        return true;
    }
    if (parameter != BODY_VOLUME || !(cavity->options.gas || cavity->options.fluid))
        return false;
    const double content =
        supplied ? content_of(cavity, state->content, cavity_volume(model)) : state->wanted;
    *value = cavity->options.gas ? content / cavity->options.ambient : content;
    return true;
}

bool cavity_range(const Cavity *cavity, BodyParameter parameter, double *low, double *high)
{
    const SurfaceCavity *options = &cavity->options;
    const bool pressure = parameter == BODY_PRESSURE,
               has_volume = options->fluid || (options->gas && options->ambient > 0.0);
    *low = !pressure      ? 0.0
           : options->gas ? fmax(-options->ambient, -cavity->pressure_limit)
                          : -cavity->pressure_limit;
    // The wall's edges are then 1.44 times as long: within ROOM.
    *high = pressure ? cavity->pressure_limit : has_volume ? 3.0 * cavity->rest_volume : 0.0;
    // Nothing comes into a wall that has been cut.
    return cavity->edge_count == 0 && *high > 0.0;
}

void cavity_drift(Cavity *cavity, double dt)
{
    CavityFlow *flow = &cavity->state->flow;
    flow->volume += dt * flow->rate + flow->due;
    flow->due = 0.0;
}

// Measures the holes in these rows.
static void measure_openings(const SurfaceModel *model, const void *rows)
{
    Cavity *cavity = model->cavity;
    for (int i = 0; i < cavity->edge_count; i++)
        cavity->border[cavity->root[cavity->edge[i][0]]] = (CavityBorder){0};
    for (int i = 0; i < cavity->edge_count; i++) {
        const int *node = cavity->edge[i];
        CavityBorder *border = &cavity->border[cavity->root[node[0]]];
        const Vec3 a = rows_local(&model->basis, rows, model->slot[node[0]]),
                   b = rows_local(&model->basis, rows, model->slot[node[1]]);
        border->area = vec3_add(border->area, vec3_scale(0.5, vec3_cross(a, b)));
        border->sum = vec3_add(border->sum, a);
        border->count++;
    }
    // A cone from its middle closes each.
    CavityState *state = cavity->state;
    state->opening = state->cap = 0.0;
    for (int i = 0; i < cavity->edge_count; i++) {
        CavityBorder *border = &cavity->border[cavity->root[cavity->edge[i][0]]];
        if (border->count == 0)
            continue;
        state->opening += vec3_length(border->area);
        state->cap -= vec3_dot(border->sum, border->area) / (3.0 * border->count);
        border->count = 0; // once
    }
}

void cavity_begin(SurfaceModel *model, const Evaluation *evaluation, double h)
{
    Cavity *cavity = model->cavity;
    CavityState *state = cavity->state;
    if (state->known == 0 && cavity->pass.volume != NULL) {
        state->known = 1;
        cavity->measured = true;
        state->flow.volume = measure(model, model->present);
        state->flow.more = state->cap_rate = 0.0;
        measure_openings(model, model->present);
    }
    // Cones over the borders move with them: without that, a piece that falls would change the
    // volume, by the way times a third of its opening.
    const double moved = state->cap_rate * (state->flow.time + evaluation->at * h);
    cavity->pass.pressure = pressure_in(cavity, closed_volume(cavity) + moved);
}

// Adds a chunk's parts to the sums of the lanes.
static void add_chunk(const SurfaceModel *model, const void *part, int chunk, double sum[LANES])
{
    const long at = (long)chunk * LANES;
    if (model->basis.precision == PRECISION_SINGLE)
        for (int lane = 0; lane < LANES; lane++)
            sum[lane] += (double)((const float *)part)[at + lane];
    else
        for (int lane = 0; lane < LANES; lane++)
            sum[lane] += ((const double *)part)[at + lane];
}

// Returns the sum of the parts of all nodes, in one order at every width and on any threads.
static double sum_up(const SurfaceModel *model, const void *part)
{
    double sum[LANES] = {0.0}, total = 0.0;
    if (model->detail == NULL)
        for (int chunk = 0; chunk < model->springs.chunk_count; chunk++)
            add_chunk(model, part, chunk, sum);
    for (int k = 0; model->detail != NULL && k < model->detail->lists.free_chunk_count; k++)
        add_chunk(model, part, model->detail->lists.free_chunk[k], sum);
    for (int k = 0; model->detail != NULL && k < model->detail->lists.hanging_chunk_count; k++)
        add_chunk(model, part, model->detail->lists.hanging_chunk[k], sum);
    for (int lane = 0; lane < LANES; lane++)
        total += sum[lane];
    return total;
}

void cavity_end(SurfaceModel *model, const SpringPass *pass)
{
    Cavity *cavity = model->cavity;
    CavityFlow *flow = &cavity->state->flow;
    const Evaluation *evaluation = &pass->evaluation;
    const bool kicks = evaluation->rule == EVALUATION_KICK;
    if (kicks || evaluation->rule == EVALUATION_RK4_LAST)
        flow->time += pass->h;
    if (cavity->pass.volume == NULL)
        return;
    // What was expected of the rows evaluated missed what the gradient leaves out: the square of
    // the way.
    const double volume = sum_up(model, cavity->pass.volume),
                 change = sum_up(model, cavity->pass.change);
    flow->more = kicks ? flow->more + volume - flow->volume : 0.0;
    // The rows written. A tick ends after a part of the way, and the next begins with the rest.
    const double part = evaluation->last ? evaluation->advance * evaluation->advance : 1.0;
    flow->volume = volume + change + part * flow->more;
    if (kicks && evaluation->last) {
        flow->rate = change / (evaluation->advance * pass->h);
        flow->due = (1.0 - part) * flow->more;
    }
}

// Returns exp(-x) to x^3 / 6, with the same bits on every machine.
static double decay(double x)
{
    return 1.0 / (1.0 + x + 0.5 * x * x);
}

// Lets out what flows through the holes: a jet of speed sqrt(2 p / density) (Bernoulli, Torricelli)
// whose section is DISCHARGE times the hole's. It never ends beyond the pressure outside.
static void leak(Cavity *cavity)
{
    CavityState *state = cavity->state;
    const SurfaceCavity *options = &cavity->options;
    const double volume = closed_volume(cavity);
    seal(cavity, volume); // the supply has ended
    const double pressure = cavity_pressure(cavity),
                 out = DISCHARGE * state->opening * copysign(1.0, pressure) *
                       sqrt(2.0 * fabs(pressure) / options->density) * state->flow.time; // [m3]
    double even = 0.0; // the content at the pressure outside
    if (options->gas) {
        even = options->ambient * volume;
        state->content -= (options->ambient + fmax(0.0, pressure)) * out;
    } else if (options->fluid) {
        even = volume;
        state->content -= out;
    } else {
        // A pressure without a law: it falls as that of a gas in a vacuum would.
        state->content *= decay(fabs(out) / fmax(volume, LEAST_VOLUME * cavity->rest_volume));
    }
    state->content = pressure > 0.0 ? fmax(state->content, even) : fmin(state->content, even);
    // A fluid's volume divides: a wall turned inside out leaves a little.
    if (options->fluid)
        state->content = fmax(state->content, LEAST_VOLUME * cavity->rest_volume);
    state->wanted = state->content;
}

void cavity_commit(SurfaceModel *model)
{
    Cavity *cavity = model->cavity;
    CavityState *state = cavity->state;
    state->flow.tick = state->flow.time;
    if (cavity->edge_count > 0) {
        state->flow.volume = measure(model, model->rows[model->current]);
        const double before = state->cap;
        measure_openings(model, model->rows[model->current]);
        state->cap_rate = (state->cap - before) / state->flow.time;
        leak(cavity);
    }
    state->held = fmax(0.0, cavity_pressure(cavity));
    // What SET asked for comes gently: a fluid that grew at once would burst the wall.
    state->content += (state->wanted - state->content) * (1.0 - decay(state->flow.time / EASE));
    state->flow.time = 0.0;
    cavity->committed = state->flow;
    cavity->measured = false;
}

void cavity_abandon(Cavity *cavity)
{
    CavityState *state = cavity->state;
    state->flow = cavity->committed;
    if (cavity->measured)
        state->known = 0;
    cavity->measured = false;
}

static double most_volume(const Cavity *cavity)
{
    return 1e6 * cavity->rest_volume;
}

bool cavity_can_flow(const Cavity *cavity)
{
    const CavityFlow *flow = &cavity->state->flow;
    const double most = most_volume(cavity);
    return fabs(flow->volume) <= most && fabs(flow->more) <= most && fabs(flow->due) <= most &&
           isfinite(flow->rate);
}

void cavity_forget(Cavity *cavity)
{
    CavityState *state = cavity->state;
    // The next tick measures the volume: nothing of one that cannot be must stay until then.
    if (!cavity_can_flow(cavity))
        state->flow = cavity->committed =
            (CavityFlow){.volume = cavity->rest_volume, .tick = state->flow.tick};
    state->known = 0;
    state->flow.rate = state->flow.due = state->flow.time = 0.0;
}

void cavity_refill(Cavity *cavity)
{
    CavityState *state = cavity->state;
    const double pressure = cavity->edge_count > 0 ? 0.0 : cavity->options.pressure;
    const bool varies = cavity->options.gas || cavity->options.fluid;
    state->content = state->supplied != 0 || !varies
                         ? pressure
                         : content_of(cavity, pressure, cavity->rest_volume);
    state->wanted = state->content;
    cavity_forget(cavity);
}

void cavity_restored(Cavity *cavity)
{
    cavity->committed = cavity->state->flow;
}

void cavity_find_borders(SurfaceModel *model)
{
    Cavity *cavity = model->cavity;
    const DetailFaces *faces = &model->detail->faces;
    cavity->edge_count = 0;
    const DetailCut *cut = model->detail->set.cut;
    if (cavity->edge == NULL || (*cut->copies == 0 && cut->gone_count == 0))
        return;
    union_find_reset(cavity->root, cavity->node_count);
    for (int i = 0; i < cavity->node_count; i++)
        for (int at = faces->node_face_start[i]; at < faces->node_face_end[i]; at++) {
            const int f = faces->node_face[at], *corner = faces->face[f];
            for (int k = 0; k < 3; k++) {
                if (corner[k] != i || faces->face_neighbor[f][k] >= 0)
                    continue;
                const int to = corner[(k + 1) % 3];
                cavity->edge[cavity->edge_count][0] = i;
                cavity->edge[cavity->edge_count++][1] = to;
                union_find_join(cavity->root, i, to);
            }
        }
    for (int i = 0; i < cavity->node_count; i++)
        cavity->root[i] = union_find_root(cavity->root, i);
}

bool cavity_check(const Cavity *cavity)
{
    const CavityState *state = cavity->state;
    const CavityFlow *flow = &state->flow;
    const SurfaceCavity *options = &cavity->options;
    // What is inside is a pressure, or a gas or fluid that is there.
    double least = -2.0 * PRESSURE_MOST, most = 2.0 * PRESSURE_MOST;
    if (state->supplied == 0 && (options->gas || options->fluid)) {
        least = 0.0;
        most = (options->gas ? options->ambient + PRESSURE_MOST : 1.0) * most_volume(cavity);
    }
    return state->content >= least && state->content <= most && state->wanted >= least &&
           state->wanted <= most && (least < 0.0 || !options->fluid || state->content > 0.0) &&
           cavity_can_flow(cavity) && flow->tick >= 0.0 && flow->tick <= 1e3 && flow->time == 0.0 &&
           state->opening >= 0.0 && isfinite(state->opening) && isfinite(state->cap) &&
           isfinite(state->cap_rate) && state->held >= 0.0 && isfinite(state->held) &&
           (state->known == 0 || state->known == 1) &&
           (state->supplied == 0 || state->supplied == 1);
}

void cavity_explain(const SurfaceModel *model, FILE *out)
{
    const Cavity *cavity = model->cavity;
    const double volume = cavity_volume(model);
    const SurfaceCavity *options = &cavity->options;
    fprintf(out, "    cavity: %.4g m3 at rest, now %.4g m3 at %.4g Pa; ", cavity->rest_volume,
            volume, pressure_in(cavity, volume));
    if (cavity->state->supplied != 0 || !(options->gas || options->fluid))
        fprintf(out, "constant pressure\n");
    else if (options->gas)
        fprintf(out, "gas, %g Pa outside\n", options->ambient);
    else
        fprintf(out, "fluid, bulk modulus %.3g Pa\n", cavity->bulk_modulus);
}
