// SPDX-License-Identifier: MIT
// Conjugate gradients on a patch, for three directions of the tool at once, a few steps per tick.
// Step thread, except stiffness_create.
#include "sim/contact/stiffness.h"

#include "sim/contact/contact_data.h"

#include <string.h>

static const double RATE = 60.0;   // most estimates of a contact per second [Hz]
static const double TIME = 0.1;    // t [s]: the body does not respond to faster motion of a hand
static const double WIDTH = 0.02;  // the patch's radius [m], at least; 2.5 radii, two faces
static const double ENOUGH = 1e-3; // of the residual
static const double SHARE = 0.04;  // of a tick, approximately, if a block takes BLOCK_TIME
static const double BLOCK_TIME = 12e-9; // [s]
static const double SHRINK = 0.8;       // factor on the radius if a patch exceeds the capacity

// The slope of the force over ways of the tool:
static const double WAY = 1e-4;                    // at least so long [m]
static const double QUICKEST = 0.004, REST = 0.25; // duration of a way; longer, the tool rests [s]
static const double STRAIGHT = 0.5;                // cosine to the normal, at least
static const double SLOW = 0.03;                   // speed up to which a way counts wholly [m/s]
static const double MEMORY = 5e-4;                 // of ways [m]
static const double DOUBT = 2e-4;    // way after which what is felt outweighs what is solved [m]
static const double EVEN = 4e-3;     // changes of speed below this tell nothing of damping [m/s]
static const double HARDENING = 1.2; // of what is felt, which is behind where the slope rises

enum {
    STEPS = 30, // of conjugate gradients, at most
    SPRINGS = 1024,
    SPRING_CARRIERS = 3 * CONTACT_MAIN * PATCH_CARRIERS,
};

typedef enum Phase { PHASE_IDLE, PHASE_GATHER, PHASE_SOLVE } Phase;

// Least squares of force = -k x - b v over the last ways: means, and sums about them.
typedef struct Felt {
    double weight;     // [m]
    Vec3 x, v, f;      // means
    double xx, xv, vv; // sums
    double xf, vf;     // of the opposite of the force
} Felt;

// Data of one contact. The last solution is the start of the next.
typedef struct Estimate {
    bool valid, is_solved;
    ContactStiffness stiffness;
    Sym3 solved;          // by the patch
    bool whole;           // the patch is as large as it should be
    Vec3 normal;          // mean
    Vec3 along;           // the last way that counted, unit; before the first, the normal
    double age;           // of the start of the way [s]; negative: none
    Vec3 position, force; // of the tool at the start
    Vec3 speed;           // of the way before
    Felt felt;
    int64_t begun;       // tick of the last start, plus 1; 0: never
    int count;           // of `node` and `moved`
    int *node;           // [PATCH_NODES]
    PatchColumns *moved; // [PATCH_NODES] of a node, by the tool's direction
} Estimate;

struct StiffnessEstimator {
    Contact *const *contact;
    int count;
    double tick;        // [s]
    int period;         // ticks between two estimates of a contact
    int budget;         // blocks per tick
    Estimate *estimate; // [count]
    Patch *patch;

    // --- the current estimate ---
    Phase phase;
    int at;         // contact
    int next_block; // of the current product
    bool failed;    // the current system is not positive
    bool whole;     // the patch has not been shrunk
    int topology;   // of its body at the start
    int spring_count, step_count;
    ContactSpring spring[SPRINGS];
    ContactCarriers *carried;  // [SPRINGS] with a fitted surface, else NULL
    Sym3 tangent[SPRINGS];     // of a spring's force, by its length and by its direction
    Sym3 kc;                   // their sum
    Vec3 normal;               // mean
    Sym3 inverse[PATCH_NODES]; // of the diagonal blocks
    PatchColumns u[PATCH_NODES], r[PATCH_NODES], d[PATCH_NODES], q[PATCH_NODES], b[PATCH_NODES];
    double size[3]; // r . z of each direction
    double first[3];
};

static int slots_of(const Body *body)
{
    int surface = body->surface.node_count;
    return surface > body->state_capacity ? surface : body->state_capacity;
}

static bool is_measurable(const Contact *contact)
{
    return contact->body->ops->gather_patch != NULL && contact->law->has_springs &&
           contact->tool->kind != TOOL_STATIC;
}

StiffnessEstimator *stiffness_create(Contact *const *contact, int count, double tick, Arena *arena)
{
    int slots = 0;
    for (int i = 0; i < count; i++)
        if (is_measurable(contact[i]) && slots_of(contact[i]->body) > slots)
            slots = slots_of(contact[i]->body);
    if (slots == 0)
        return NULL;
    StiffnessEstimator *all =
        arena_allocate(arena, ARENA_CONTACT, 1, sizeof *all, "stiffness/estimator");
    all->contact = contact;
    all->count = count;
    all->tick = tick;
    all->period = (int)fmax(1.0, ceil(1.0 / RATE / tick - 1e-9));
    all->budget = (int)fmin(1e6, ceil(SHARE * tick / BLOCK_TIME));
    all->patch = patch_create(slots, "stiffness", arena);
    all->estimate = arena_allocate(arena, ARENA_CONTACT, (size_t)count, sizeof *all->estimate,
                                   "stiffness/estimates");
    for (int i = 0; i < count; i++) {
        if (!is_measurable(contact[i]))
            continue;
        if (all->carried == NULL && contact[i]->fit != NULL)
            all->carried = arena_allocate(arena, ARENA_CONTACT, SPRINGS, sizeof *all->carried,
                                          "stiffness/carriers");
        Estimate *estimate = &all->estimate[i];
        estimate->node = arena_allocate(arena, ARENA_CONTACT, PATCH_NODES, sizeof *estimate->node,
                                        "stiffness/nodes");
        estimate->moved = arena_allocate(arena, ARENA_CONTACT, PATCH_NODES, sizeof *estimate->moved,
                                         "stiffness/solution");
    }
    return all;
}

// ---------------------------------------------------------------------------------------------
// Symmetric matrices

static void add_outer(Sym3 *k, double s, Vec3 n)
{
    *k = sym3_madd(*k, 1.0, sym3_outer(s, n));
}

// Roots of the characteristic polynomial by the cosine of a third of an angle (Smith 1961).
void stiffness_eigenvalues(Sym3 k, double *least, double *most)
{
    double mean = sym3_trace(k) / 3.0;
    double a = k.xx - mean, b = k.yy - mean, c = k.zz - mean;
    double spread =
        sqrt((a * a + b * b + c * c + 2.0 * (k.yz * k.yz + k.zx * k.zx + k.xy * k.xy)) / 6.0);
    double angle = 0.0;
    if (spread > 0.0) {
        double half = 0.5 *
                      (a * (b * c - k.yz * k.yz) - k.xy * (k.xy * c - k.yz * k.zx) +
                       k.zx * (k.xy * k.yz - b * k.zx)) /
                      (spread * spread * spread);
        angle = acos(fmax(-1.0, fmin(1.0, half))) / 3.0;
    }
    *most = mean + 2.0 * spread * cos(angle);
    *least = mean + 2.0 * spread * cos(angle + 2.0 * 3.14159265358979323846 / 3.0);
}

// ---------------------------------------------------------------------------------------------
// Start

static Vec3 spring_point(const Contact *contact, const ContactSpring *spring)
{
    Vec3 x[3], at = {0.0, 0.0, 0.0};
    contact->body->ops->read_nodes(contact->body->model, spring->node, 3, x, NULL);
    for (int k = 0; k < 3; k++)
        at = vec3_madd(at, spring->weight[k], x[k]);
    return at;
}

// Returns the largest distance of the springs' points from a point.
static Vec3 farthest_from(const StiffnessEstimator *all, const Contact *contact, Vec3 from)
{
    Vec3 best = from;
    double most = -1.0;
    for (int i = 0; i < all->spring_count; i++) {
        Vec3 at = spring_point(contact, &all->spring[i]);
        double far = vec3_length(vec3_sub(at, from));
        if (far > most) {
            most = far;
            best = at;
        }
    }
    return best;
}

// Chooses a region around all contact points, so large that the fixed surroundings matter little.
static Region choose_region(const StiffnessEstimator *all, const Contact *contact)
{
    double edge = 0.0;
    for (int i = 0; i < all->spring_count; i++) {
        Vec3 x[3];
        contact->body->ops->read_nodes(contact->body->model, all->spring[i].node, 3, x, NULL);
        for (int k = 0; k < 3; k++)
            edge = fmax(edge, vec3_length(vec3_sub(x[(k + 1) % 3], x[k])));
    }
    Region region = {.kind = REGION_CAPSULE};
    region.from = farthest_from(all, contact, spring_point(contact, &all->spring[0]));
    region.to = farthest_from(all, contact, region.from);
    region.radius = fmax(WIDTH, fmax(2.5 * contact->largest_radius, 2.0 * edge));
    return region;
}

// Computes how a spring's force on the tool falls as the tool moves away from its point: by its
// length and, where the point does not slide along with the tool, by its direction: at a corner,
// and where it stays, for all sideways motion, at an edge across it, inside a face for none.
static void find_tangent(const Contact *contact, const ContactSpring *spring, bool turns,
                         Sym3 *tangent)
{
    const Vec3 axis[3] = {{1.0, 0.0, 0.0}, {0.0, 1.0, 0.0}, {0.0, 0.0, 1.0}};
    Vec3 n = spring->normal, x[3];
    *tangent = sym3_outer(spring->stiffness, n);
    if (!turns)
        return;
    int corners = 0, off = 0; // corners that carry the point; the last one that does not
    for (int k = 0; k < 3; k++) {
        corners += spring->weight[k] > 0.0;
        off = spring->weight[k] > 0.0 ? off : k;
    }
    if (corners == 1 || spring->stays) {
        for (int c = 0; c < 3; c++)
            add_outer(tangent, -spring->yield, axis[c]);
        add_outer(tangent, spring->yield, n);
    } else if (corners == 2) {
        contact->body->ops->read_nodes(contact->body->model, spring->node, 3, x, NULL);
        Vec3 along = vec3_sub(x[(off + 2) % 3], x[(off + 1) % 3]);
        Vec3 across = vec3_unit(vec3_cross(along, n));
        add_outer(tangent, -spring->yield, across);
    }
}

// `turns`: with the turning of the springs, which can leave the system without balance.
static void find_tangents(StiffnessEstimator *all, bool turns)
{
    all->kc = (Sym3){0};
    for (int i = 0; i < all->spring_count; i++) {
        find_tangent(all->contact[all->at], &all->spring[i], turns, &all->tangent[i]);
        all->kc = sym3_madd(all->kc, 1.0, all->tangent[i]);
    }
}

static bool is_touching(const Contact *contact)
{
    return contact_is_near(contact) && contact_sums(contact)->weight > 0.0;
}

// Starts the next contact that is due.
static void begin_next(StiffnessEstimator *all, int64_t step)
{
    for (int k = 1; k <= all->count; k++) {
        int at = (all->at + k) % all->count;
        const Contact *contact = all->contact[at];
        Estimate *estimate = &all->estimate[at];
        if (estimate->node == NULL || !is_touching(contact) ||
            (estimate->is_solved && step + 1 - estimate->begun < all->period))
            continue;
        all->spring_count = contact_springs(all->contact[at], all->spring, SPRINGS);
        if (all->spring_count <= 0)
            continue;
        all->at = at;
        for (int i = 0; i < all->spring_count && contact->fit != NULL; i++)
            contact_find_carriers(contact, &all->spring[i], &all->carried[i]);
        find_tangents(all, !(contact_friction(contact) > 0.0));
        all->normal = (Vec3){0.0, 0.0, 0.0};
        for (int i = 0; i < all->spring_count; i++)
            all->normal = vec3_madd(all->normal, all->spring[i].stiffness, all->spring[i].normal);
        all->normal = vec3_unit(all->normal);
        Region region = choose_region(all, contact);
        patch_begin(all->patch, &region, TIME, false);
        all->whole = true;
        all->topology = contact->body->mesh.topology;
        estimate->begun = step + 1;
        all->phase = PHASE_GATHER;
        return;
    }
}

// ---------------------------------------------------------------------------------------------
// The system

// Finds the moving nodes under a spring, with their shares.
static int spring_carriers(const StiffnessEstimator *all, int index, short local[SPRING_CARRIERS],
                           double share[SPRING_CARRIERS])
{
    const ContactSpring *spring = &all->spring[index];
    const ContactCarriers *carried =
        all->contact[all->at]->fit != NULL ? &all->carried[index] : NULL;
    int count = 0;
    for (int k = 0; k < (carried != NULL ? carried->count : 3); k++) {
        const int node = carried != NULL ? carried->vertex[k] : spring->node[k];
        const double weight = carried != NULL ? (double)carried->share[k] : spring->weight[k];
        int more = patch_carriers(all->patch, node, local + count, share + count);
        for (int i = count; i < count + more; i++)
            share[i] *= weight;
        count += more;
    }
    return count;
}

static void add_springs(StiffnessEstimator *all)
{
    memset(all->b, 0, (size_t)all->patch->node_count * sizeof *all->b);
    for (int i = 0; i < all->spring_count; i++) {
        double m[9];
        sym3_full(all->tangent[i], m);
        short local[SPRING_CARRIERS];
        double share[SPRING_CARRIERS];
        int count = spring_carriers(all, i, local, share);
        patch_add_form(all->patch, count, local, share, m);
        for (int e = 0; e < count; e++)
            for (int c = 0; c < 3; c++)
                all->b[local[e]].of[c] = vec3_madd(all->b[local[e]].of[c], share[e],
                                                   vec3(m[3 * c], m[3 * c + 1], m[3 * c + 2]));
    }
}

static double dot(const StiffnessEstimator *all, const PatchColumns *a, const PatchColumns *b,
                  int c, int e)
{
    double sum = 0.0;
    for (int i = 0; i < all->patch->node_count; i++)
        sum += vec3_dot(a[i].of[c], b[i].of[e]);
    return sum;
}

// Starts nodes of the last solution with their values.
static void warm_start(StiffnessEstimator *all)
{
    const Estimate *last = &all->estimate[all->at];
    const Patch *patch = all->patch;
    memset(all->u, 0, (size_t)patch->node_count * sizeof *all->u);
    for (int i = 0; i < last->count; i++) {
        int local = last->node[i] < patch->slot_count ? patch->local[last->node[i]] : -1;
        if (local >= 0)
            all->u[local] = last->moved[i];
    }
}

// d = z = P r, and r . z.
static void precondition(StiffnessEstimator *all, double size[3])
{
    for (int c = 0; c < 3; c++)
        size[c] = 0.0;
    for (int i = 0; i < all->patch->node_count; i++)
        for (int c = 0; c < 3; c++) {
            all->q[i].of[c] = sym3_times(all->inverse[i], all->r[i].of[c]);
            size[c] += vec3_dot(all->r[i].of[c], all->q[i].of[c]);
        }
}

static Sym3 inverse_of(Sym3 k)
{
    double determinant;
    const Sym3 adjugate = sym3_adjugate(k, &determinant);
    return sym3_scale(1.0 / determinant, adjugate);
}

static void begin_solving(StiffnessEstimator *all)
{
    Patch *patch = all->patch;
    add_springs(all);
    if (patch->full) {
        all->phase = PHASE_IDLE; // no capacity for the coupling of faces: not reported
        return;
    }
    for (int i = 0; i < patch->node_count; i++)
        all->inverse[i] = inverse_of(patch->diagonal[i]);
    // The residual of zero, as the reference.
    memcpy(all->r, all->b, (size_t)patch->node_count * sizeof *all->r);
    precondition(all, all->first);
    warm_start(all);
    patch_multiply(patch, all->u, all->q, 0, patch->block_count);
    for (int c = 0; c < 3; c++) {
        // A start that is worse than zero: its energy u . A u / 2 - b . u is positive.
        bool worse = 0.5 * dot(all, all->u, all->q, c, c) - dot(all, all->b, all->u, c, c) > 0.0;
        for (int i = 0; i < patch->node_count; i++) {
            if (worse)
                all->u[i].of[c] = all->q[i].of[c] = (Vec3){0.0, 0.0, 0.0};
            all->r[i].of[c] = vec3_sub(all->b[i].of[c], all->q[i].of[c]);
        }
    }
    precondition(all, all->size);
    memcpy(all->d, all->q, (size_t)patch->node_count * sizeof *all->d);
    all->step_count = all->next_block = 0;
    all->failed = false;
    all->phase = PHASE_SOLVE;
}

static bool is_solved(const StiffnessEstimator *all)
{
    for (int c = 0; c < 3; c++)
        if (all->size[c] > ENOUGH * ENOUGH * all->first[c])
            return false;
    return true;
}

// One step of conjugate gradients, each direction separately; q = A d is known.
static void advance(StiffnessEstimator *all)
{
    const int count = all->patch->node_count;
    double size[3];
    all->next_block = 0;
    for (int c = 0; c < 3; c++) {
        double along = dot(all, all->d, all->q, c, c);
        double alpha = along > 0.0 ? all->size[c] / along : 0.0;
        all->failed |= along < 0.0 || all->size[c] < 0.0;
        for (int i = 0; i < count; i++) {
            all->u[i].of[c] = vec3_madd(all->u[i].of[c], alpha, all->d[i].of[c]);
            all->r[i].of[c] = vec3_madd(all->r[i].of[c], -alpha, all->q[i].of[c]);
        }
    }
    precondition(all, size);
    for (int c = 0; c < 3; c++) {
        double beta = all->size[c] > 0.0 ? size[c] / all->size[c] : 0.0;
        for (int i = 0; i < count; i++)
            all->d[i].of[c] = vec3_madd(all->q[i].of[c], beta, all->d[i].of[c]);
        all->size[c] = size[c];
    }
    all->step_count++;
}

// ---------------------------------------------------------------------------------------------
// Result

// Finds the body's damping in a motion as slow as the tool's: u^T C u, with C that of the nodes
// and, for the links between them, the relaxation times their stiffness: u^T A u without the parts
// of nodes and contact. Returns false if that stiffness is negative: compressed links are about to
// buckle, and what is solved is a way out of hardly any resistance, which no tool goes.
static bool find_damping(const StiffnessEstimator *all, double *damping)
{
    const Patch *patch = all->patch;
    const double n[3] = {all->normal.x, all->normal.y, all->normal.z};
    double of_nodes = 0.0, links = 0.0;
    for (int i = 0; i < patch->node_count; i++) {
        Vec3 u = {0.0, 0.0, 0.0}, au = u;
        for (int c = 0; c < 3; c++) {
            u = vec3_madd(u, n[c], all->u[i].of[c]);
            au = vec3_madd(au, n[c], vec3_sub(all->b[i].of[c], all->r[i].of[c]));
        }
        of_nodes += patch->drag[i] * vec3_dot(u, u);
        links += vec3_dot(u, vec3_madd(au, -patch->mass[i], u));
    }
    for (int i = 0; i < all->spring_count; i++) {
        short local[SPRING_CARRIERS];
        double share[SPRING_CARRIERS];
        Vec3 moved = {0.0, 0.0, 0.0};
        int count = spring_carriers(all, i, local, share);
        for (int e = 0; e < count; e++)
            for (int c = 0; c < 3; c++)
                moved = vec3_madd(moved, share[e] * n[c], all->u[local[e]].of[c]);
        links -= sym3_along(all->tangent[i], moved);
    }
    *damping = of_nodes + patch->relaxation * fmax(0.0, links);
    return links >= 0.0;
}

// Finds the nearest positive matrix with eigenvalues of at most `limit`, by rotating pairs of axes
// until it is diagonal (Jacobi's method).
static void clamp_eigenvalues(Sym3 *k, double limit)
{
    double a[3][3] = {{k->xx, k->xy, k->zx}, {k->xy, k->yy, k->yz}, {k->zx, k->yz, k->zz}};
    double v[3][3] = {{1.0, 0.0, 0.0}, {0.0, 1.0, 0.0}, {0.0, 0.0, 1.0}}; // axes as columns
    for (int turn = 0; turn < 24; turn++) {
        int p = turn % 3, q = (p + 1) % 3;
        if (a[p][q] == 0.0)
            continue;
        double half = 0.5 * (a[q][q] - a[p][p]) / a[p][q];
        double t = (half < 0.0 ? -1.0 : 1.0) / (fabs(half) + sqrt(half * half + 1.0));
        double c = 1.0 / sqrt(t * t + 1.0), s = t * c;
        for (int i = 0; i < 3; i++) {
            double x = a[i][p], y = a[i][q];
            a[i][p] = c * x - s * y, a[i][q] = s * x + c * y;
            x = v[i][p], y = v[i][q];
            v[i][p] = c * x - s * y, v[i][q] = s * x + c * y;
        }
        for (int i = 0; i < 3; i++) {
            double x = a[p][i], y = a[q][i];
            a[p][i] = c * x - s * y, a[q][i] = s * x + c * y;
        }
    }
    *k = (Sym3){0};
    for (int i = 0; i < 3; i++) {
        Vec3 axis = {v[0][i], v[1][i], v[2][i]};
        add_outer(k, fmin(limit, fmax(0.0, a[i][i])), axis);
    }
}

// Returns the slope along the ways: what is solved, until enough is felt. Damping, told by changes
// of speed, is no part of it.
static double find_slope(const Estimate *estimate, double solved)
{
    const Felt *felt = &estimate->felt;
    const double doubt = DOUBT * DOUBT * DOUBT / 12.0; // the sum over a way of that length
    const double share = felt->xv / (felt->vv + felt->weight * EVEN * EVEN);
    const double prior = estimate->is_solved ? solved : felt->xf / felt->xx;
    const double more = vec3_dot(estimate->along, estimate->normal) < 0.0 ? HARDENING : 1.0;
    return fmax(0.0, (more * (felt->xf - share * felt->vf) + doubt * prior) /
                         (felt->xx - share * felt->xv + doubt));
}

// Publishes the solved stiffness, of the size that was felt along the last way; one alone if the
// other is not known. What is felt less makes all of it less. What is felt more is added along the
// way: where little is solved along it, a factor would have no bound, and sideways no sense.
static void publish(Estimate *estimate)
{
    Sym3 *k = &estimate->stiffness.k;
    const bool is_felt = estimate->felt.xx > 0.0;
    const double along = estimate->is_solved ? sym3_along(estimate->solved, estimate->along) : 0.0,
                 slope = is_felt ? find_slope(estimate, along) : along,
                 share = along > slope ? slope / along : 1.0;
    estimate->valid = estimate->is_solved || is_felt;
    *k = estimate->is_solved ? sym3_scale(share, estimate->solved) : (Sym3){0};
    add_outer(k, slope - share * along, estimate->along);
}

static void add_place(Felt *felt, double weight, Vec3 x, Vec3 v, Vec3 f)
{
    const Vec3 dx = vec3_sub(x, felt->x), dv = vec3_sub(v, felt->v), df = vec3_sub(f, felt->f);
    const double share = weight / (felt->weight + weight), pair = felt->weight * share;
    felt->xx += pair * vec3_dot(dx, dx);
    felt->xv += pair * vec3_dot(dx, dv);
    felt->vv += pair * vec3_dot(dv, dv);
    felt->xf -= pair * vec3_dot(dx, df);
    felt->vf -= pair * vec3_dot(dv, df);
    felt->x = vec3_madd(felt->x, share, dx);
    felt->v = vec3_madd(felt->v, share, dv);
    felt->f = vec3_madd(felt->f, share, df);
    felt->weight += weight;
}

static void fade(Felt *felt, double keep)
{
    felt->weight *= keep;
    felt->xx *= keep;
    felt->xv *= keep;
    felt->vv *= keep;
    felt->xf *= keep;
    felt->vf *= keep;
}

// Adds the end of a way, and of one that comes to rest, where the force of damping ends. Else, as
// sideways, in a jump or still at rest, the force changed for another reason: all before moves
// along.
static void add_way(Estimate *estimate, Vec3 position, Vec3 force)
{
    Felt *felt = &estimate->felt;
    const Vec3 step = vec3_sub(position, estimate->position);
    const double way = vec3_length(step), age = estimate->age;
    const bool rests = age > REST,
               straight = fabs(vec3_dot(step, estimate->normal)) > STRAIGHT * way;
    const Vec3 speed = rests ? (Vec3){0.0, 0.0, 0.0} : vec3_scale(1.0 / age, step);
    const double jerk = vec3_length(vec3_sub(speed, estimate->speed));
    const bool counts = rests ? jerk > 0.0 && felt->weight > 0.0 : straight && jerk < SLOW;
    // Quickly, the tool feels the wall's mass too: such ways count less, and make less forgotten.
    const double slow = straight && !rests ? fmin(1.0, SLOW * age / way) : 1.0;
    const double weight = way * slow * slow;
    fade(felt, MEMORY / (MEMORY + weight));
    estimate->speed = speed;
    if (!counts) {
        felt->x = vec3_add(felt->x, step);
        felt->f = vec3_add(felt->f, vec3_sub(force, estimate->force));
        return;
    }
    if (!(felt->weight > 0.0))
        *felt =
            (Felt){.weight = 0.5 * WAY, .x = estimate->position, .v = speed, .f = estimate->force};
    add_place(felt, rests ? WAY : weight, position, speed, force);
    if (!rests)
        estimate->along = vec3_scale(1.0 / way, step);
}

// Forgets at rest what was felt with mass and friction: more than is solved, or, unless the patch
// is too small, quickly.
static void rest(Estimate *estimate)
{
    const Felt *felt = &estimate->felt;
    const double solved = sym3_along(estimate->solved, estimate->along);
    if (!(felt->xx > 0.0) || !estimate->is_solved)
        return;
    if (find_slope(estimate, solved) > solved || (estimate->whole && vec3_length(felt->v) > SLOW)) {
        estimate->felt = (Felt){0};
        estimate->speed = (Vec3){0.0, 0.0, 0.0}; // its end is no beginning of others
    }
}

// Follows the force over the tool's ways: it is known sooner than what is solved, which is too
// stiff where a press has bent the body, where a patch is too small for a wide contact, and with
// friction. A hand that holds still or moves sideways changes nothing of it.
static void feel(const StiffnessEstimator *all, const Contact *contact, Estimate *estimate)
{
    const ContactSums *sums = contact_sums(contact);
    Vec3 position;
    Quat orientation;
    contact_proxy(contact, &position, &orientation);
    const Vec3 force = vec3_scale(1.0 / all->tick, sums->impulse);
    const bool begins = estimate->age < 0.0;
    if (!estimate->is_solved)
        estimate->normal = vec3_unit(sums->normal);
    if (begins)
        estimate->along = estimate->normal;
    estimate->age = begins ? 0.0 : estimate->age + all->tick;
    if (!begins && estimate->age <= REST &&
        (estimate->age < QUICKEST || vec3_length(vec3_sub(position, estimate->position)) < WAY))
        return;
    if (!begins) {
        if (estimate->age > REST)
            rest(estimate);
        add_way(estimate, position, force);
        publish(estimate);
    }
    estimate->age = 0.0;
    estimate->position = position;
    estimate->force = force;
}

static void forget(Estimate *estimate)
{
    estimate->valid = estimate->is_solved = false;
    estimate->age = -1.0;
    estimate->felt = (Felt){0};
    estimate->speed = (Vec3){0.0, 0.0, 0.0};
    estimate->stiffness.damping = 0.0;
}

// For any u, solved or not, Kc - (B^T u + u^T B - u^T A u) = K + (u - A^-1 B)^T A (u - A^-1 B):
// what is left of the residual makes it stiffer, never softer. B - A u = r.
static void finish(StiffnessEstimator *all)
{
    Estimate *estimate = &all->estimate[all->at];
    const Patch *patch = all->patch;
    double less[3][3], least, most;
    for (int c = 0; c < 3; c++)
        for (int f = c; f < 3; f++)
            less[c][f] = 0.5 * (dot(all, all->b, all->u, c, f) + dot(all, all->u, all->r, c, f) +
                                dot(all, all->b, all->u, f, c) + dot(all, all->u, all->r, f, c));
    estimate->solved =
        sym3_madd(all->kc, -1.0,
                  (Sym3){less[0][0], less[1][1], less[2][2], less[1][2], less[0][2], less[0][1]});
    stiffness_eigenvalues(all->kc, &least, &most);
    clamp_eigenvalues(&estimate->solved, most);
    estimate->is_solved = true;
    estimate->normal = all->normal;
    estimate->whole = all->whole;
    if (!(estimate->felt.xx > 0.0))
        estimate->along = all->normal;
    publish(estimate);
    estimate->count = patch->node_count;
    memcpy(estimate->node, patch->node, (size_t)patch->node_count * sizeof *patch->node);
    memcpy(estimate->moved, all->u, (size_t)patch->node_count * sizeof *all->u);
    all->phase = PHASE_IDLE;
}

// ---------------------------------------------------------------------------------------------

static void gather(StiffnessEstimator *all)
{
    const Body *body = all->contact[all->at]->body;
    Patch *patch = all->patch;
    if (!body->ops->gather_patch(body->model, patch, all->budget))
        return;
    if (!patch->full) {
        begin_solving(all);
        return;
    }
    Region smaller = patch->region;
    smaller.radius *= SHRINK;
    all->whole = false;
    patch_begin(patch, &smaller, patch->time, patch->tensed);
}

static void solve(StiffnessEstimator *all)
{
    const Patch *patch = all->patch;
    for (int budget = all->budget; budget > 0;) {
        if (all->failed) { // out of balance: compressed parts are about to buckle
            Region region = patch->region;
            find_tangents(all, false);
            patch_begin(all->patch, &region, patch->time, true);
            all->phase = PHASE_GATHER;
            return;
        }
        if (all->step_count == STEPS || is_solved(all)) {
            double damping;
            all->failed = !find_damping(all, &damping) && !patch->tensed;
            if (all->failed)
                continue;
            all->estimate[all->at].stiffness.damping = damping;
            finish(all);
            return;
        }
        int first = all->next_block, left = patch->block_count - first;
        int last = first + (left < budget ? left : budget);
        patch_multiply(patch, all->d, all->q, first, last);
        all->next_block = last;
        budget -= last - first;
        if (last < patch->block_count)
            return;
        advance(all);
        budget -= 4 * patch->node_count + 1; // the sums
    }
}

void stiffness_step(StiffnessEstimator *all, int64_t step)
{
    for (int i = 0; i < all->count; i++)
        if (all->estimate[i].node != NULL && is_touching(all->contact[i]))
            feel(all, all->contact[i], &all->estimate[i]);
        else
            forget(&all->estimate[i]);
    if (all->phase != PHASE_IDLE) {
        const Contact *contact = all->contact[all->at];
        if (contact->body->mesh.topology != all->topology || !is_touching(contact)) {
            all->estimate[all->at].count = 0;
            all->phase = PHASE_IDLE;
        }
    }
    if (all->phase == PHASE_IDLE)
        begin_next(all, step);
    else if (all->phase == PHASE_GATHER)
        gather(all);
    else
        solve(all);
}

const ContactStiffness *stiffness_get(const StiffnessEstimator *all, int index)
{
    return all->estimate[index].valid ? &all->estimate[index].stiffness : NULL;
}

void stiffness_forget(StiffnessEstimator *all)
{
    all->phase = PHASE_IDLE;
    for (int i = 0; i < all->count; i++) {
        forget(&all->estimate[i]);
        all->estimate[i].count = 0;
        all->estimate[i].begun = 0;
    }
}
