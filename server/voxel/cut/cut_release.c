// SPDX-License-Identifier: MIT
#include "voxel/cut/cut_release.h"

#include "base/sym3.h"

#include <math.h>
#include <string.h>

static const double TIME = 0.016; // that a force acts [s]
enum { TICKS_MOST = 1024 };

void cut_release_create(CutRelease *release, const CutMasses *masses, const char *name,
                        Arena *arena, StateList *state)
{
    const int capacity = masses->lattice->vertex_capacity;
    *release = (CutRelease){.masses = masses, .ticks = TICKS_MOST};
    release->count = ALLOCATE(ARENA_STEP, 1, int64_t, "number of fading forces");
    release->known = ALLOCATE(ARENA_STEP, 1, int64_t, "known accelerations");
    release->before = arena_allocate(arena, ARENA_STEP, (size_t)capacity, sizeof *release->before,
                                     "%s/velocities before", name);
    release->force = ALLOCATE(ARENA_STEP, RELEASE_FORCES, ReleaseForce, "fading forces");
    state_add(state, release->count, sizeof *release->count, "%s/release", name);
    state_add(state, release->known, sizeof *release->known, "%s/release_known", name);
    state_add(state, release->before, (size_t)capacity * sizeof *release->before,
              "%s/release_before", name);
    state_add(state, release->force, RELEASE_FORCES * sizeof *release->force, "%s/release_forces",
              name);
}

// Shortens the list, without a trace in the state.
static void shorten(CutRelease *release, int count)
{
    memset(release->force + count, 0,
           (size_t)((int)*release->count - count) * sizeof *release->force);
    *release->count = count;
}

void cut_release_begin(CutRelease *release, double tick)
{
    ReleaseForce *force = release->force;
    int ended = 0;
    for (int k = 0; k < (int)*release->count; k++)
        ended += --force[k].left == 0;
    const int left = (int)*release->count - ended;
    if (ended > 0)
        memmove(force, force + ended, (size_t)left * sizeof *force);
    shorten(release, left);
    release->begun = left;
    release->tick = *release->known ? tick : 0.0;
    release->ticks = (int)fmax(1.0, fmin(TICKS_MOST, ceil(TIME / tick)));
}

static void forget_velocities(CutRelease *release)
{
    if (*release->known)
        memset(release->before, 0,
               (size_t)release->masses->lattice->vertex_capacity * sizeof *release->before);
    *release->known = 0;
}

void cut_release_note(CutRelease *release, bool soon)
{
    const Vertices *vertices = release->masses->vertices;
    const void *row = vertices_row(vertices);
    if (!soon) {
        forget_velocities(release);
        return;
    }
    *release->known = 1;
    const bool single = vertices->rows.precision == PRECISION_SINGLE;
    float(*before)[3] = release->before;
    for (int r = 0; r < vertices->run_count; r++) {
        const long first = vertices->run[r][0], end = vertices->run[r][1];
        // Four numbers each and eight at a time, which is cheaper, but for the last ones.
        long v = first;
        for (; v + 8 < end && single; v += 8)
            for (int k = 0; k < 8; k++)
                memcpy((float *)before + 3 * (v + k), (const float *)row + (v + k) * ROW + 4,
                       4 * sizeof(float));
        for (; v < end && single; v++)
            memcpy(before[v], (const float *)row + v * ROW + 4, sizeof *before);
        for (; v < end && !single; v++)
            for (int c = 0; c < 3; c++)
                before[v][c] = (float)((const double *)row)[v * ROW + 4 + c];
    }
}

void cut_release_forget(CutRelease *release, bool whole)
{
    shorten(release, 0);
    release->begun = 0;
    if (whole)
        forget_velocities(release);
}

// Forces that began together go together, where one of their vertices ended.
static void forget_ended(CutRelease *release)
{
    const CutLattice *lattice = release->masses->lattice;
    ReleaseForce *force = release->force;
    int kept = 0;
    for (int k = 0, end; k < (int)*release->count; k = end) {
        bool whole = true;
        for (end = k; end < (int)*release->count && force[end].left == force[k].left; end++)
            whole &= lattice->vertex_id[force[end].vertex] >= 0 &&
                     !cut_lattice_is_carried(lattice, force[end].vertex);
        if (!whole)
            continue;
        memmove(force + kept, force + k, (size_t)(end - k) * sizeof *force);
        kept += end - k;
    }
    shorten(release, kept);
    release->begun = kept;
}

static bool is_free(const Vertices *vertices, int vertex)
{
    return rows_get(&vertices->rows, vertices->inverse_mass, vertex) != 0.0;
}

static Vec3 vector_of(const ReleaseForce *force)
{
    return vec3((double)force->force[0], (double)force->force[1], (double)force->force[2]);
}

static void put_force(ReleaseForce *force, Vec3 f)
{
    force->force[0] = (float)f.x;
    force->force[1] = (float)f.y;
    force->force[2] = (float)f.z;
}

// Lists the accelerations of the tick before, of all vertices of changed elements.
static void note_accelerations(CutRelease *release)
{
    const CutMasses *masses = release->masses;
    const CutChanges *changes = &masses->lattice->changes;
    const Vertices *vertices = masses->vertices;
    const int first = (int)*release->count;
    ReleaseForce *force = release->force;
    if (masses->touched_count > RELEASE_FORCES - first)
        return;
    for (int t = 0; t < masses->touched_count; t++) {
        const int vertex = masses->touched[t];
        const float *before = release->before[vertex];
        const Vec3 gained =
            vec3_sub(rows_vector(&vertices->rows, vertices_row(vertices), vertex, 4),
                     vec3((double)before[0], (double)before[1], (double)before[2]));
        masses->next[vertex] = first + t;
        force[first + t] = (ReleaseForce){.vertex = vertex, .left = release->ticks};
        put_force(&force[first + t], vec3_scale(1.0 / release->tick, gained));
    }
    *release->count += masses->touched_count;
    // New ones would have moved as those between which they are, which come before them.
    for (int b = 0; b < changes->birth_count; b++) {
        const CutBirth *birth = &changes->birth[b];
        Vec3 sum = {0.0, 0.0, 0.0};
        for (int p = 0; p < birth->parent_count; p++) {
            const int parent = birth->parent[p], at = masses->next[parent];
            if (at >= first && at < (int)*release->count && force[at].vertex == parent)
                sum = vec3_add(sum, vector_of(&force[at]));
        }
        put_force(&force[masses->next[birth->vertex]],
                  vec3_scale(1.0 / fmax(1.0, birth->parent_count), sum));
    }
}

void cut_release_follow(CutRelease *release, bool divided)
{
    const CutChanges *changes = &release->masses->lattice->changes;
    // What is cut is free at once.
    if (changes->face_count > 0 || changes->lost_count > 0)
        cut_release_forget(release, false);
    else if (changes->ended_count > 0)
        forget_ended(release);
    if (divided && release->tick > 0.0 && changes->ended_count == 0)
        note_accelerations(release);
}

static Vec3 acts_on(const Vertices *vertices, int vertex)
{
    double f[3];
    for (int c = 0; c < 3; c++) {
        f[c] = rows_get(&vertices->rows, vertices->force, 4L * vertex + c);
        if (vertices->more != NULL)
            f[c] += rows_get(&vertices->rows, vertices->more, 4L * vertex + c);
    }
    return vec3(f[0], f[1], f[2]);
}

// Takes resultant and moment from the forces that begin, as a rigid acceleration.
static void balance(CutRelease *release)
{
    const Vertices *vertices = release->masses->vertices;
    const int first = release->begun, end = (int)*release->count;
    double mass = 0.0;
    Vec3 middle = {0.0, 0.0, 0.0}, sum = middle, moment = middle;
    for (int k = first; k < end; k++) {
        const int vertex = release->force[k].vertex;
        mass += vertices->mass[vertex];
        middle = vec3_madd(middle, vertices->mass[vertex],
                           rows_local(&vertices->rows, vertices->present, vertex));
        sum = vec3_add(sum, vector_of(&release->force[k]));
    }
    middle = vec3_scale(1.0 / mass, middle);
    Sym3 second = {0};
    for (int k = first; k < end; k++) {
        const int vertex = release->force[k].vertex;
        const Vec3 x = vec3_sub(rows_local(&vertices->rows, vertices->present, vertex), middle);
        second = sym3_madd(second, vertices->mass[vertex], sym3_outer(1.0, x));
        moment = vec3_add(moment, vec3_cross(x, vector_of(&release->force[k])));
    }
    // Of inertia: the trace less the second moment.
    const double trace = second.xx + second.yy + second.zz;
    double determinant;
    const Sym3 inertia = {.xx = trace - second.xx,
                          .yy = trace - second.yy,
                          .zz = trace - second.zz,
                          .xy = -second.xy,
                          .yz = -second.yz,
                          .zx = -second.zx};
    const Sym3 adjugate = sym3_adjugate(inertia, &determinant);
    const Vec3 spin = vec3_scale(1.0 / determinant, sym3_times(adjugate, moment));
    for (int k = first; k < end; k++) {
        ReleaseForce *force = &release->force[k];
        const Vec3 x =
            vec3_sub(rows_local(&vertices->rows, vertices->present, force->vertex), middle);
        const Vec3 rigid = vec3_madd(vec3_cross(spin, x), 1.0 / mass, sum);
        put_force(force, vec3_madd(vector_of(force), -vertices->mass[force->vertex], rigid));
    }
}

// Finds the forces that make up for the change of those of the elements.
static void begin_forces(CutRelease *release, Vec3 gravity)
{
    const Vertices *vertices = release->masses->vertices;
    int end = release->begun;
    bool fixed = false;
    for (int k = release->begun; k < (int)*release->count; k++) {
        const ReleaseForce *force = &release->force[k];
        const double mass = vertices->mass[force->vertex];
        if (!is_free(vertices, force->vertex)) {
            fixed = true;
            continue;
        }
        ReleaseForce *to = &release->force[end++];
        *to = *force;
        put_force(to, vec3_sub(vec3_scale(mass, vec3_sub(vector_of(to), gravity)),
                               acts_on(vertices, to->vertex)));
    }
    shorten(release, end);
    if (!fixed && end > release->begun)
        balance(release);
    release->begun = end;
}

static void add(const CutRelease *release, int first, int end)
{
    const Vertices *vertices = release->masses->vertices;
    const bool single = vertices->rows.precision == PRECISION_SINGLE;
    const float by = 1.0F / (float)release->ticks;
    for (int k = first; k < end; k++) {
        const ReleaseForce *force = &release->force[k];
        const float share = (float)force->left * by;
        float *f = (float *)vertices->force + 4L * force->vertex;
        double *g = (double *)vertices->force + 4L * force->vertex;
        for (int c = 0; c < 3 && single; c++)
            f[c] += share * force->force[c];
        for (int c = 0; c < 3 && !single; c++)
            g[c] += (double)(share * force->force[c]);
    }
}

void cut_release_add(CutRelease *release, Vec3 gravity)
{
    const int begun = release->begun;
    add(release, 0, begun);
    if (begun < (int)*release->count)
        begin_forces(release, gravity);
    add(release, begun, (int)*release->count);
}

bool cut_release_check(const CutRelease *release)
{
    const CutLattice *lattice = release->masses->lattice;
    const int64_t count = *release->count;
    if (count < 0 || count > RELEASE_FORCES || *release->known < 0 || *release->known > 1)
        return false;
    int last = 1;
    for (int k = 0; k < (int)count; k++) {
        const ReleaseForce *force = &release->force[k];
        if (force->left < last || force->left > TICKS_MOST || force->vertex < 0 ||
            force->vertex >= cut_lattice_used(lattice) || lattice->vertex_id[force->vertex] < 0 ||
            cut_lattice_is_carried(lattice, force->vertex) ||
            !isfinite(force->force[0] + force->force[1] + force->force[2]))
            return false;
        last = force->left;
    }
    return true;
}
