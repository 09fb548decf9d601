// SPDX-License-Identifier: MIT
// The criteria of refinement and simplification (Choi et al. 2005, "Criterion for Refinement and
// Simplification", as the dimensionless indicators of README.md, "Refinement criteria"): force
// concentration, velocity, change of curvature. A leaf is divided when one of them is above 1; a
// face is coarsened when all indicators of its four children have been below CALM for HOLD seconds.
// Step thread.
//
// The faces of level 0 are swept check_hz times per second, those of a small body in one tick and
// those of a large one in slices, so that topology changes once per sweep and not in every tick;
// leaves that a tool presses or a new load acts on are examined in the same tick. Refined faces are
// looked at in fewer sweeps: twice per HOLD, and once to learn which of them are calm.
#include "surface/detail/detail.h"

#include <math.h>

#define CALM 0.35 // below a half, because an indicator doubles when its leaf is coarsened
#define HOLD 0.05 // [s]
// Below this a face of level 0 is looked at in every fourth sweep only: the presses of
// tests/accuracy refine the same faces at the same time as if it were looked at in all.
#define QUIET 0.2

static const double PERIOD_MOST = 0.01; // [s] of which a sweep may use the budget at once

enum {
    FACES_PER_SECOND = 16000, // divided, and as many coarsened: bounds the work of a tick
    FACES_LEAST = 16,         // per tick
    COARSEN_MOST = 256,       // in one tick
    SLICE = 2048,             // leaves examined in one tick, at most, if ticks are short
};

// Limits that a sweep compares with, computed from the thresholds.
typedef struct Marks {
    double per_force[LEVELS_MAX + 1]; // one over the traction that requires more [m2/N]
    // square of displacements that cannot bend a leaf enough, to be divided and not to be calm [m2]
    double still2_divide[LEVELS_MAX + 1], still2_calm[LEVELS_MAX + 1];
    double per_speed2[LEVELS_MAX + 1]; // one over the square of the limiting speed [s2/m2]
    double cos_divide, cos_calm;
    int64_t pass;                   // number of this pass over the body
    int level;                      // finest that may be used
    int64_t step, hold;             // [ticks]
    Vec3 center, velocity, angular; // of the rigid motion of the body
} Marks;

typedef enum Verdict { VERDICT_CALM, VERDICT_KEEP, VERDICT_DIVIDE } Verdict;

// Reads a slot's position [m] and velocity [m/s].
static void read_row(const SurfaceModel *model, int slot, Vec3 *x, Vec3 *v)
{
    const void *rows = model->rows[model->current];
    if (model->basis.precision == PRECISION_SINGLE) {
        const float *row = (const float *)rows + (long)slot * ROW;
        *x = vec3_add((Vec3){(double)row[0], (double)row[1], (double)row[2]},
                      model_rest(model, slot));
        *v = (Vec3){(double)row[4], (double)row[5], (double)row[6]};
        return;
    }
    const double *row = (const double *)rows + (long)slot * ROW;
    *x = (Vec3){row[0], row[1], row[2]};
    *v = (Vec3){row[4], row[5], row[6]};
}

// Returns |f| over the area that a node represents [N/m2].
static double traction_of(const SurfaceModel *model, int node, double force)
{
    const Detail *detail = model->detail;
    double area = detail->set.status[node] == NODE_HANGING
                      ? detail->faces.node_area[node]
                      : model->mass[node] / detail->rules.areal_density;
    return area > 0.0 ? force / area : 0.0;
}

// Returns the size of the loads on a node [N]; a node created in this sweep has no lane yet.
static double load_on(const SurfaceModel *model, int slot)
{
    if (model->lane[slot] < 0)
        return 0.0;
    long at = model_lane(model->lane[slot]);
    Vec3 f = {model_get(model, model->external, at), model_get(model, model->external, at + LANES),
              model_get(model, model->external, at + 2L * LANES)};
    return f.x == 0.0 && f.y == 0.0 && f.z == 0.0 ? 0.0 : vec3_length(f);
}

// Computes the indicators' inputs at a node, once per pass for all leaves around it.
static const NodeLook *look_at(const SurfaceModel *model, int node, const Marks *marks)
{
    const Detail *detail = model->detail;
    NodeLook *look = &detail->adapt.look[node];
    // Computed once per pass.
    if (look->pass == marks->pass)
        return look;
    int slot = model->slot[node];
    // Position and displacement.
    Vec3 slip;
    look->pass = marks->pass;
    read_row(model, slot, &look->position, &slip);
    look->moved = vec3_sub(look->position, model_rest(model, slot));
    Vec3 center = marks->center, velocity = marks->velocity, angular = marks->angular;
    if (detail->frames != NULL) { // relative to its own piece
        const FramePose *pose = detail_frames_pose(model, node);
        center = (Vec3){pose->center[0], pose->center[1], pose->center[2]};
        velocity = (Vec3){pose->velocity[0], pose->velocity[1], pose->velocity[2]};
        angular = (Vec3){pose->angular[0], pose->angular[1], pose->angular[2]};
    }
    // Speed beyond the rigid motion.
    if (model->basis.rigid != NULL) {
        slip = vec3_sub(slip, velocity);
        slip = vec3_sub(slip, vec3_cross(angular, vec3_sub(look->position, center)));
    }
    look->slip2 = vec3_dot(slip, slip);
    // Forces of tools and loads.
    double force = detail->adapt.felt_force[node];
    if (*model->loaded != 0 && detail->set.status[node] == NODE_FREE)
        force += load_on(model, slot);
    look->traction = force > 0.0 ? traction_of(model, node, force) : 0.0;
    return look;
}

// Leaves across those edges of a leaf at which both require refinement: once it is divided, the
// edge is between two levels, and they would no longer see its angle.
typedef struct Bent {
    int count, face[3];
} Bent;

// True if two corners have moved so alike that a leaf cannot have tilted far by them.
static bool is_still(Vec3 a, Vec3 b, double still2)
{
    Vec3 ab = vec3_sub(b, a);
    return vec3_dot(ab, ab) < still2;
}

// What a sweep wants to know of a leaf, as bits.
typedef enum Question {
    ASK_DIVIDE = 1, // whether to divide it: angles that it does not leave to the leaf across
    ASK_CALM = 2,   // whether it is calm: all its angles
} Question;

// True if the other criteria could only say the same.
static bool answers(Verdict verdict, int question)
{
    return question == ASK_CALM && verdict > VERDICT_CALM;
}

// Judges the angles at the edges of a leaf.
static Verdict judge_curvature(SurfaceModel *model, int level, int face, const Vec3 now[3],
                               const Vec3 moved[3], const Marks *marks, int question, Bent *bent)
{
    const Detail *detail = model->detail;
    const LeafSet *set = &detail->set;
    const Level *at = &set->levels.level[level];
    const int *corner = at->face[face];
    const bool asks_calm = (question & ASK_CALM) != 0;
    const double still2 = asks_calm ? marks->still2_calm[level] : marks->still2_divide[level];
    Verdict verdict = VERDICT_CALM;
    bool still = is_still(moved[0], moved[1], still2) && is_still(moved[0], moved[2], still2) &&
                 is_still(moved[1], moved[2], still2);
    // To divide two leaves one that has moved looks at their angle, the lower number of two.
    if (still && !asks_calm)
        return verdict;
    // Skip borders, leaves of other levels and broken edges: they have no angle.
    for (int k = 0; k < 3 && !answers(verdict, question); k++) {
        int edge = at->face_edge[face][k];
        int across = levels_beyond(at, edge, face);
        if (across < 0 || !detail_is_leaf(set, level, across) ||
            detail_is_broken(set, level, face, k))
            continue;
        // The two faces at the edge, by the corners that an angle needs.
        int opposite = 0;
        while (at->face_edge[across][opposite] != edge)
            opposite++;
        const int node[4] = {corner[k], corner[(k + 1) % 3], corner[(k + 2) % 3],
                             at->face[across][(opposite + 2) % 3]};
        const NodeLook *beyond = look_at(model, node[3], marks);
        // Two still leaves have not turned.
        bool still_across = is_still(moved[k], beyond->moved, still2) &&
                            is_still(moved[(k + 1) % 3], beyond->moved, still2);
        if (asks_calm ? still && still_across : across < face && !still_across)
            continue;
        const Vec3 x[4] = {now[k], now[(k + 1) % 3], now[(k + 2) % 3], beyond->position};
        // How far they have turned against each other since rest.
        double cosine = detail_cos_of_turn(model, level, edge, node, x);
        if (cosine >= marks->cos_calm)
            continue;
        Verdict pair = cosine < marks->cos_divide ? VERDICT_DIVIDE : VERDICT_KEEP;
        if (pair == VERDICT_DIVIDE)
            bent->face[bent->count++] = across;
        verdict = verdict > pair ? verdict : pair;
    }
    return verdict;
}

static Verdict worse(Verdict a, Verdict b)
{
    return a > b ? a : b;
}

static Verdict judge_number(double eta)
{
    return eta > 1.0 ? VERDICT_DIVIDE : eta > CALM ? VERDICT_KEEP : VERDICT_CALM;
}

static Verdict judge(SurfaceModel *model, int level, int face, const Marks *marks, int question,
                     Bent *bent)
{
    const Detail *detail = model->detail;
    const int *corner = detail->set.levels.level[level].face[face];
    Vec3 now[3], moved[3];
    Verdict verdict = VERDICT_CALM;
    for (int k = 0; k < 3; k++) {
        const NodeLook *look = look_at(model, corner[k], marks);
        now[k] = look->position;
        moved[k] = look->moved;
        // Velocity, then traction of each corner.
        double eta2 = look->slip2 * marks->per_speed2[level];
        verdict = worse(verdict, eta2 > 1.0           ? VERDICT_DIVIDE
                                 : eta2 > CALM * CALM ? VERDICT_KEEP
                                                      : VERDICT_CALM);
        verdict = worse(verdict, judge_number(look->traction * marks->per_force[level]));
        if (answers(verdict, question))
            return verdict;
    }
    return worse(verdict, judge_curvature(model, level, face, now, moved, marks, question, bent));
}

// True if nothing happens at a leaf: all indicators are far below what would divide it.
static bool is_quiet(const SurfaceModel *model, int level, int face, const Marks *marks)
{
    const int *corner = model->detail->set.levels.level[level].face[face];
    const NodeLook *look[3];
    for (int k = 0; k < 3; k++) {
        look[k] = look_at(model, corner[k], marks);
        if (look[k]->slip2 * marks->per_speed2[level] > QUIET * QUIET ||
            look[k]->traction * marks->per_force[level] > QUIET)
            return false;
    }
    double still2 = marks->still2_calm[level];
    return is_still(look[0]->moved, look[1]->moved, still2) &&
           is_still(look[0]->moved, look[2]->moved, still2) &&
           is_still(look[1]->moved, look[2]->moved, still2);
}

// --- forces of tools ---

void detail_reserve_felt(DetailAdapt *adapt, const char *name, int count, Arena *arena,
                         StateList *state)
{
    adapt->felt_capacity = count;
    adapt->felt = arena_allocate(arena, ARENA_CONTACT, (size_t)count, sizeof *adapt->felt,
                                 "%s/felt forces", name);
    state_add(state, adapt->felt, (size_t)count * sizeof *adapt->felt, "%s/felt", name);
}

void detail_feel(DetailAdapt *adapt, int node, Vec3 force)
{
    if (*adapt->felt_count < adapt->felt_capacity)
        adapt->felt[(*adapt->felt_count)++] = (Felt){node, force};
}

// --- the sweep ---

typedef struct SweepPass {
    SurfaceModel *model;
    Marks marks;
    int64_t left;   // faces that may still be divided in this tick
    bool asks_calm; // this sweep asks which leaves are calm
    bool asks_fine; // this sweep looks below level 0
} SweepPass;

static void divide_one(SweepPass *pass, int level, int face)
{
    Detail *detail = pass->model->detail;
    int64_t before = detail->adapt.sweep->refined;
    detail_refine(pass->model, level, face);
    pass->left -= detail->adapt.sweep->refined - before;
}

// Divides a leaf. With the continuum rule a leaf of level 0 takes those around its corners along:
// its halo, so that what is pressed does not end at what cannot bend.
static void divide_leaf(SweepPass *pass, int level, int face)
{
    const LeafSet *set = &pass->model->detail->set;
    divide_one(pass, level, face);
    if (level > 0 || !set->constrained)
        return;
    const int *corner = set->levels.level[0].face[face];
    for (int k = 0; k < 3; k++) {
        int node = detail_original(set, corner[k]);
        for (int i = set->root_ring_start[node]; i < set->root_ring_start[node + 1]; i++)
            divide_one(pass, 0, set->root_ring[i]);
    }
}

// Notes a leaf to be divided when the sweep has judged all of them.
static void want(DetailAdapt *adapt, int level, int face)
{
    if (adapt->want_count < adapt->want_capacity)
        adapt->want[adapt->want_count++] = (Leaf){level, face, 0};
}

static void divide_wanted(SweepPass *pass)
{
    DetailAdapt *adapt = &pass->model->detail->adapt;
    for (int i = 0; i < adapt->want_count; i++)
        divide_leaf(pass, adapt->want[i].level, adapt->want[i].face);
    adapt->want_count = 0;
}

// True if a refined face has been calm for HOLD seconds.
static bool has_rested(const Detail *detail, const Marks *marks, int level, int face)
{
    int64_t since = detail->adapt.calm_since[detail->set.face_base[level] + face];
    return since > 0 && (marks->step + 1 - since >= marks->hold || level >= marks->level);
}

// Judges the leaves of a face, notes those to be divided, and tracks how long the four children
// have been calm. Returns the verdict on a leaf, KEEP for others. `asks_calm`: the caller needs to
// know whether it is calm.
static Verdict sweep_face(SweepPass *pass, int level, int face, bool asks_calm)
{
    SurfaceModel *model = pass->model;
    Detail *detail = model->detail;
    DetailAdapt *adapt = &detail->adapt;
    const LeafSet *set = &detail->set;
    const Marks *marks = &pass->marks;
    if (detail_is_gone(set, level, face))
        return VERDICT_KEEP;
    // A leaf: divide it if a criterion asks for it, and what it is bent against.
    if (!detail_is_refined(set, level, face)) {
        if (level > marks->level)
            return VERDICT_CALM; // the next level may not exist
        Bent bent = {0};
        const int question = (level < marks->level ? ASK_DIVIDE : 0) | (asks_calm ? ASK_CALM : 0);
        if (question == 0)
            return VERDICT_KEEP;
        Verdict verdict = judge(model, level, face, marks, question, &bent);
        if (verdict == VERDICT_DIVIDE && level < marks->level) {
            want(adapt, level, face);
            for (int k = 0; k < bent.count; k++)
                want(adapt, level, bent.face[k]);
        }
        return verdict;
    }
    // A refined face: coarsen it after HOLD seconds in which all four children were calm leaves.
    bool leaves = true;
    for (int k = 0; k < 4; k++)
        leaves &= !detail_is_refined(set, level + 1, 4 * face + k);
    // One child that is not calm decides for all four; those of the coarsest level stay.
    bool calm = leaves && pass->asks_calm && level >= detail->options.adapt.coarsest;
    for (int k = 0; k < 4; k++)
        if (calm || !leaves || level + 1 < marks->level)
            calm &= sweep_face(pass, level + 1, 4 * face + k, calm) == VERDICT_CALM;
    if (!pass->asks_calm)
        return VERDICT_KEEP;
    // The time since when it has been calm.
    int64_t *since = &adapt->calm_since[set->face_base[level] + face];
    if (!calm) {
        *since = 0;
        return VERDICT_KEEP;
    }
    if (*since == 0)
        *since = marks->step + 1;
    if (has_rested(detail, marks, level, face) && adapt->calm_count < adapt->calm_capacity)
        adapt->calm[adapt->calm_count++] = (Leaf){level, face, 0};
    return VERDICT_KEEP;
}

// Sweeps a face of level 0, unless it is quiet and its turn has not come.
static void sweep_root(SweepPass *pass, int face)
{
    const Detail *detail = pass->model->detail;
    const LeafSet *set = &detail->set;
    unsigned char *skip = &detail->adapt.skip[face];
    // What is refined is looked at in fewer sweeps.
    const bool refined = detail_is_refined(set, 0, face),
               waits = refined ? !pass->asks_fine : *skip > 0;
    if (waits && detail->adapt.sweep->urgent == 0) {
        *skip -= *skip > 0;
        return;
    }
    *skip = 0;
    sweep_face(pass, 0, face, false);
    if (!detail_is_refined(set, 0, face) && is_quiet(pass->model, 0, face, &pass->marks))
        *skip = SKIP_MOST;
}

static void set_marks(const SurfaceModel *model, int64_t step, double tick, Marks *marks)
{
    Detail *detail = model->detail;
    DetailAdapt *adapt = &detail->adapt;
    const Sweep *sweep = adapt->sweep;
    const double pi = 3.14159265358979323846;
    // Thresholds with their scales.
    const double scale = sweep->scale / adapt->drive->fineness;
    double turn = sweep->thresholds[2] * scale;
    double speed = sweep->thresholds[1] * scale * adapt->wave_speed;
    double force = sweep->thresholds[0] * scale * adapt->modulus / adapt->edge_length;
    *marks = (Marks){
        .cos_divide = turn < pi ? cos(turn) : -2.0,
        .cos_calm = CALM * turn < pi ? cos(CALM * turn) : -2.0,
        .pass = ++adapt->look_passes,
        .level = (int)sweep->level,
        .step = step,
        .hold = (int64_t)ceil(HOLD / tick),
    };
    for (int l = 0; l <= detail->set.levels.finest; l++) {
        marks->per_force[l] = ldexp(1.0 / force, -l);
        // Relative to the third corner, a corner that moves by d tilts its leaf by at most asin(d /
        // height): two corners of each of two leaves, and a tenth as a margin for rounding.
        double height = 0.9 * detail->folds.least_height[l];
        double divide = height * sin(fmin(turn, pi) / 4.0);
        double calm = height * sin(fmin(CALM * turn, pi) / 4.0);
        marks->still2_divide[l] = divide * divide;
        marks->still2_calm[l] = calm * calm;
        marks->per_speed2[l] = ldexp(1.0 / (speed * speed), -2 * l);
    }
    // The motion against which speeds are measured.
    if (model->basis.rigid != NULL) {
        const FramePose *pose = &model->basis.rigid->pose;
        marks->center = (Vec3){pose->center[0], pose->center[1], pose->center[2]};
        marks->velocity = (Vec3){pose->velocity[0], pose->velocity[1], pose->velocity[2]};
        marks->angular = (Vec3){pose->angular[0], pose->angular[1], pose->angular[2]};
    }
}

// Wants the leaves that a tool presses.
static void look_at_felt(SweepPass *pass)
{
    SurfaceModel *model = pass->model;
    Detail *detail = model->detail;
    DetailAdapt *adapt = &detail->adapt;
    const LeafSet *set = &detail->set;
    for (int64_t i = 0; i < *adapt->felt_count; i++) {
        int node = (int)adapt->felt[i].node;
        if (set->status[node] == NODE_OFF)
            continue;
        // Leaves around a pressed node, as many as a tick may divide.
        Leaf *leaf = set->ring[LEVELS_MAX];
        int count = detail_leaves_around(set, node, leaf);
        for (int k = 0; k < count && adapt->want_count < pass->left; k++)
            if (leaf[k].level < pass->marks.level &&
                traction_of(model, node, adapt->felt_force[node]) *
                        pass->marks.per_force[leaf[k].level] >
                    1.0)
                want(adapt, leaf[k].level, leaf[k].face);
    }
}

// True if a face is in the halo of one that has not rested; what a cut holds refined has none.
static bool is_in_halo(const Detail *detail, const Marks *marks, const Leaf *leaf)
{
    const LeafSet *set = &detail->set;
    if (leaf->level > 0 || !set->constrained)
        return false;
    const int *corner = set->levels.level[0].face[leaf->face];
    for (int k = 0; k < 3; k++) {
        int node = detail_original(set, corner[k]);
        for (int i = set->root_ring_start[node]; i < set->root_ring_start[node + 1]; i++) {
            int face = set->root_ring[i];
            bool held = set->cut != NULL && set->cut->locked[face] != 0;
            if (detail_is_refined(set, 0, face) && !held && !has_rested(detail, marks, 0, face))
                return true;
        }
    }
    return false;
}

static void coarsen_calm(SweepPass *pass)
{
    Detail *detail = pass->model->detail;
    DetailAdapt *adapt = &detail->adapt;
    for (int i = 0; i < adapt->calm_count; i++) {
        const Leaf *calm = &adapt->calm[i];
        if (pass->left > 0 && detail_is_refined(&detail->set, calm->level, calm->face) &&
            !is_in_halo(detail, &pass->marks, calm) &&
            detail_may_coarsen(&detail->set, calm->level, calm->face)) {
            detail_coarsen(pass->model, calm->level, calm->face);
            pass->left--;
        }
    }
    adapt->calm_count = 0;
}

// Returns the number of faces of level 0 to sweep in this tick. A new load sweeps all of them;
// else it waits until a slice is due. `share`: of the faces that one sweep may divide.
static int64_t find_quota(const Detail *detail, double tick, double *share)
{
    const DetailAdapt *adapt = &detail->adapt;
    Sweep *sweep = adapt->sweep;
    const int roots = detail->set.levels.level[0].face_count;
    double leaves = 0.0;
    for (int l = 0; l <= detail->set.levels.finest; l++)
        leaves += detail->set.leaf_count[l];
    const double slice = fmin(roots, ceil(roots * (SLICE / leaves)));
    // Halves allow for the rounding of sums of ticks.
    sweep->credit = fmin(sweep->credit + roots * detail->options.adapt.check_hz * tick, roots);
    if (adapt->again_count > 0)
        sweep->credit = roots;
    int64_t due = sweep->credit >= slice - 0.5 ? (int64_t)floor(sweep->credit + 0.5) : 0;
    int64_t urgent = sweep->urgent < roots ? sweep->urgent : roots;
    int64_t quota = due > urgent ? due : urgent;
    *share = fmin((double)quota, slice) / roots;
    return quota;
}

bool detail_sweep(Body *body, int64_t step, double tick)
{
    SurfaceModel *model = body->model;
    Detail *detail = model->detail;
    DetailAdapt *adapt = &detail->adapt;
    Sweep *sweep = adapt->sweep;
    const int roots = detail->set.levels.level[0].face_count;
    const double check_hz = detail->options.adapt.check_hz;
    double share;
    const int64_t quota = find_quota(detail, tick, &share);
    if (quota == 0 && *adapt->felt_count == 0)
        return false;
    // A sweep may use the budget of the time since the last one.
    const double span = fmax(tick, fmin(PERIOD_MOST, 1.0 / check_hz) * share);
    const int64_t budget = (int64_t)fmax(FACES_LEAST, ceil((double)FACES_PER_SECOND * span));
    const int64_t calm_sweeps = (int64_t)fmax(1.0, fmin(floor(HOLD * check_hz), 1e6));
    const int64_t fine_sweeps = calm_sweeps > 1 ? calm_sweeps / 2 : 1;
    SweepPass pass = {.model = model, .left = budget};
    const int64_t before = sweep->refined;
    const bool urgent = sweep->urgent > 0;

    detail_begin_change(model);
    set_marks(model, step, tick, &pass.marks);
    for (int64_t i = 0; i < *adapt->felt_count; i++)
        adapt->felt_force[adapt->felt[i].node] += vec3_length(adapt->felt[i].force);
    look_at_felt(&pass);

    for (int64_t i = 0; i < quota && adapt->want_count < pass.left;
         i++) { // the sweep continues here with the next slice
        pass.asks_calm = sweep->count % calm_sweeps == 0 || body->finest_level > sweep->level;
        pass.asks_fine = pass.asks_calm || sweep->count % fine_sweeps == 0;
        sweep_root(&pass, (int)sweep->root);
        sweep->root = (sweep->root + 1) % roots;
        sweep->count += sweep->root == 0;
        sweep->credit = fmax(sweep->credit - 1.0, 0.0);
        sweep->urgent -= sweep->urgent > 0;
    }
    divide_wanted(&pass);
    // Coarsening has a budget of its own, so that refinement cannot starve it: that of all sweeps
    // since leaves were last asked, if a tick allows it.
    pass.left = budget * calm_sweeps;
    pass.left = pass.left < COARSEN_MOST ? pass.left : COARSEN_MOST;
    coarsen_calm(&pass);
    for (int64_t i = 0; i < *adapt->felt_count; i++)
        adapt->felt_force[adapt->felt[i].node] = 0.0;
    *adapt->felt_count = 0;
    // If a tick is at least as long as a sweep's period, a new load gets all its levels in one
    // tick.
    bool whole = check_hz * tick >= 1.0;
    bool divided = sweep->refined > before;
    adapt->again = whole && divided && urgent && adapt->again_count < detail->set.levels.finest;
    adapt->again_count = adapt->again ? adapt->again_count + 1 : 0;
    return detail_end_change(body);
}

// ---------------------------------------------------------------------------------------------
// Angles between leaves, now and at rest, for the curvature criterion: between leaves whose corners
// are where the butterfly has put them the rest angle is known since load

// Two faces (a, b, c) and (b, a, d) at an edge: the squared product of their normals' lengths, and
// the cosine and sine of the angle between them, multiplied by that product.
typedef struct Fold {
    double size2, cosine, sine;
} Fold;

static Fold fold_of(const Vec3 x[4])
{
    Vec3 edge = vec3_sub(x[1], x[0]);
    Vec3 n = vec3_cross(edge, vec3_sub(x[2], x[0])), m = vec3_cross(vec3_sub(x[3], x[0]), edge);
    // n x m is parallel to the edge.
    double along = vec3_dot(edge, vec3_cross(n, m));
    return (Fold){vec3_dot(n, n) * vec3_dot(m, m), vec3_dot(n, m),
                  along / sqrt(vec3_dot(edge, edge))};
}

static double least_height(const Level *level, const Vec3 *x)
{
    double least = (double)INFINITY;
    for (int f = 0; f < level->face_count; f++) {
        const int *corner = level->face[f];
        for (int k = 0; k < 3; k++) {
            Vec3 side = vec3_sub(x[corner[(k + 1) % 3]], x[corner[k]]);
            Vec3 normal = vec3_cross(side, vec3_sub(x[corner[(k + 2) % 3]], x[corner[k]]));
            least = fmin(least, vec3_length(normal) / vec3_length(side));
        }
    }
    return least;
}

// Returns which side of a face an edge is.
static int side_of(const Level *level, int face, int edge)
{
    const int *edges = level->face_edge[face];
    return edges[0] == edge ? 0 : edges[1] == edge ? 1 : 2;
}

void detail_measure_fold(DetailFolds *folds, int level, int edge)
{
    const LeafSet *set = folds->set;
    const Level *at = &set->levels.level[level];
    const Vec3 *rest = set->levels.position;
    const int *face = at->edge_face[edge];
    if (face[0] < 0 || face[1] < 0)
        return;
    // The four corners at rest.
    int k = side_of(at, face[0], edge), j = side_of(at, face[1], edge);
    const int *corner = detail_uncut(set, level, face[0]);
    const Vec3 x[4] = {rest[corner[k]], rest[corner[(k + 1) % 3]], rest[corner[(k + 2) % 3]],
                       rest[detail_uncut(set, level, face[1])[(j + 2) % 3]]};
    Fold fold = fold_of(x);
    double size = fold.size2 > 0.0 ? 1.0 / sqrt(fold.size2) : 0.0;
    // Cosine and sine alone.
    float *known = folds->rest_fold[set->edge_base[level] + edge];
    known[0] = (float)(size * fold.cosine);
    known[1] = (float)(size * fold.sine);
}

void detail_folds_create(DetailFolds *folds, const LeafSet *set, const char *name, Arena *arena)
{
    const size_t edges = (size_t)set->edge_base[set->levels.finest + 1];
    folds->set = set;
    folds->rest_fold = arena_allocate(arena, ARENA_TOPOLOGY, edges, sizeof *folds->rest_fold,
                                      "%s/rest angles", name);
    const Vec3 *rest = set->levels.position;
    for (int l = 0; l <= set->levels.finest; l++) {
        const Level *at = &set->levels.level[l];
        folds->least_height[l] = least_height(at, rest);
        for (int e = 0; e < at->edge_count; e++)
            detail_measure_fold(folds, l, e);
    }
}

// Computes the rest angle of the leaves as they are now: hanging nodes are not where the butterfly
// would put them.
static Fold rest_fold(const SurfaceModel *model, int level, int edge, const int node[4])
{
    const Detail *detail = model->detail;
    bool smooth = true;
    Vec3 rest[4];
    for (int k = 0; k < 4; k++)
        smooth &= detail->set.status[node[k]] == NODE_FREE;
    if (smooth) {
        const float *known = detail->folds.rest_fold[detail->set.edge_base[level] + edge];
        return (Fold){1.0, (double)known[0], (double)known[1]};
    }
    for (int k = 0; k < 4; k++)
        rest[k] = model_rest(model, model->slot[node[k]]);
    return fold_of(rest);
}

double detail_cos_of_turn(const SurfaceModel *model, int level, int edge, const int node[4],
                          const Vec3 x[4])
{
    Fold now = fold_of(x), rest = rest_fold(model, level, edge, node);
    double size2 = now.size2 * rest.size2;
    return size2 > 0.0 ? (now.cosine * rest.cosine + now.sine * rest.sine) / sqrt(size2) : 1.0;
}
