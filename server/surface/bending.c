// Hinges between the faces of a surface body. Step thread, except for creation.
#include "surface/bending.h"

#include "base/check.h"
#include "surface/model.h"

#include <stdlib.h>
#include <string.h>

// A face smaller than this share of its rest area, squared, weakens its hinges.
static const double FADES_BELOW = 0.5;

typedef struct Hinge {
    int slot[4];          // both ends of the edge, the third nodes of its left and right face
    double stiffness;     // k [N m]
    double angle;         // at rest [rad]
    double twice_area[2]; // of the faces at rest, squared [m4]
} Hinge;

struct Bending {
    int count;
    Hinge *hinge;       // [count] in the order of the edges
    double (*force)[3]; // [slots] [N]
    void *external;     // Real [chunk][3][LANES] what the kernel reads [N]
};

// The angle between two faces and how it changes with their nodes.
typedef struct Fold {
    double angle;     // [rad] in (-pi, pi]
    double square[2]; // of twice the areas [m4]
    Vec3 gradient[4]; // [1/m]; zero if a face has no area
} Fold;

static void fold_at(const Vec3 x[4], Fold *fold)
{
    *fold = (Fold){0};
    Vec3 edge = vec3_sub(x[1], x[0]), c = vec3_sub(x[2], x[0]), d = vec3_sub(x[3], x[0]);
    Vec3 left = vec3_cross(edge, c), right = vec3_cross(d, edge);
    double length = vec3_length(edge);
    fold->square[0] = vec3_dot(left, left);
    fold->square[1] = vec3_dot(right, right);
    // Also refuses numbers that are not finite: the kernel reports those.
    if (!(length > 0.0 && fold->square[0] > 0.0 && fold->square[1] > 0.0))
        return;
    fold->angle = atan2(vec3_dot(vec3_cross(left, right), edge) / length, vec3_dot(left, right));
    // Turning a face about the edge moves its third node by its height; the ends of the edge
    // balance forces and moments.
    double square = length * length;
    double s = vec3_dot(c, edge) / square, t = vec3_dot(d, edge) / square;
    Vec3 third = vec3_scale(-length / fold->square[0], left);
    Vec3 fourth = vec3_scale(-length / fold->square[1], right);
    fold->gradient[1] = vec3_scale(-1.0, vec3_add(vec3_scale(s, third), vec3_scale(t, fourth)));
    fold->gradient[2] = third;
    fold->gradient[3] = fourth;
    fold->gradient[0] = vec3_scale(-1.0, vec3_add(fold->gradient[1], vec3_add(third, fourth)));
}

// Returns a change of an angle in [-pi, pi].
static double turn_of(double angle)
{
    const double pi = 3.14159265358979323846;
    return angle > pi ? angle - 2.0 * pi : angle < -pi ? angle + 2.0 * pi : angle;
}

// Returns the share of its moment that a hinge keeps.
static double share_of(const Hinge *hinge, const Fold *fold)
{
    double least =
        fmin(fold->square[0] / hinge->twice_area[0], fold->square[1] / hinge->twice_area[1]);
    return fmin(1.0, least / FADES_BELOW);
}

double bending_stiffness(const SurfaceMaterial *material)
{
    if (material->bending_stiffness > 0.0)
        return material->bending_stiffness;
    // E t^3 / (12 (1 - nu^2)) with E t = E2D and nu = 1/3.
    return material->youngs_modulus_2d * material->thickness * material->thickness * 9.0 / 96.0;
}

// Finds the nodes of the hinge at an edge and its fold at rest. False at a border.
static bool hinge_at(const TriMesh *mesh, const WingedMesh *winged, int edge, int node[4],
                     Fold *fold)
{
    const WingedEdge *at = &winged->edge[edge];
    if (at->face[0] < 0 || at->face[1] < 0)
        return false;
    node[0] = at->node[0];
    node[1] = at->node[1];
    for (int side = 0; side < 2; side++) {
        const int *face = mesh->triangle[at->face[side]];
        node[2 + side] = face[0] + face[1] + face[2] - node[0] - node[1];
    }
    Vec3 x[4];
    for (int k = 0; k < 4; k++)
        x[k] = mesh->position[node[k]];
    fold_at(x, fold);
    return true;
}

// Returns k of a hinge [N m]: D l^2 / (A_1 + A_2).
static double hinge_stiffness(const TriMesh *mesh, const int node[4], const Fold *fold,
                              double stiffness)
{
    Vec3 edge = vec3_sub(mesh->position[node[1]], mesh->position[node[0]]);
    double areas = 0.5 * (sqrt(fold->square[0]) + sqrt(fold->square[1]));
    return areas > 0.0 ? stiffness * vec3_dot(edge, edge) / areas : 0.0;
}

double bending_bound(const TriMesh *mesh, const WingedMesh *winged, double stiffness,
                     const double *mass, const bool *fixed)
{
    double *sum = calloc((size_t)mesh->node_count + 1, sizeof *sum);
    ASSERT(sum != NULL);
    // The block of two nodes of a hinge is k g_i g_j^T, of norm k |g_i| |g_j|.
    for (int e = 0; e < winged->edge_count; e++) {
        int node[4];
        Fold fold;
        if (!hinge_at(mesh, winged, e, node, &fold))
            continue;
        double k = hinge_stiffness(mesh, node, &fold, stiffness), total = 0.0;
        for (int i = 0; i < 4; i++)
            total += vec3_length(fold.gradient[i]);
        for (int i = 0; i < 4; i++)
            sum[node[i]] += k * vec3_length(fold.gradient[i]) * total;
    }
    // Over the free nodes, as for springs.
    bool any_free = false;
    double most = 0.0;
    for (int i = 0; i < mesh->node_count; i++)
        any_free |= !fixed[i];
    for (int i = 0; i < mesh->node_count; i++)
        if (!fixed[i] || !any_free)
            most = fmax(most, sum[i] / mass[i]);
    free(sum);
    return most / FADES_BELOW;
}

void bending_create(SurfaceModel *model, const TriMesh *mesh, const WingedMesh *winged,
                    double stiffness, const char *name, Arena *arena)
{
    int count = 0;
    for (int e = 0; e < winged->edge_count; e++)
        count += winged->edge[e].face[0] >= 0 && winged->edge[e].face[1] >= 0;
    struct Bending *bending = ALLOCATE(ARENA_STEP, 1, struct Bending, "bending");
    bending->hinge = ALLOCATE(ARENA_STEP, count + 1, Hinge, "hinges");
    bending->force = arena_allocate(arena, ARENA_STEP, (size_t)model->basis.count,
                                    sizeof *bending->force, "%s/bending forces", name);
    bending->external = model_allocate_reals(model, 3 * (size_t)model->basis.count, name,
                                             "bending and outside forces", arena);
    model->bending = bending;
    // In the order of the edges, so that the sums have one order.
    for (int e = 0; e < winged->edge_count; e++) {
        int node[4];
        Fold fold;
        if (!hinge_at(mesh, winged, e, node, &fold))
            continue;
        Hinge *hinge = &bending->hinge[bending->count];
        hinge->stiffness = hinge_stiffness(mesh, node, &fold, stiffness);
        // A face without area has no angle, and no hinge.
        if (!(fold.square[0] > 0.0 && fold.square[1] > 0.0))
            continue;
        bending->count++;
        // The angle of the positions that the rows are relative to: no force at rest, to the bit.
        Vec3 x[4];
        for (int k = 0; k < 4; k++) {
            hinge->slot[k] = model->slot[node[k]];
            x[k] = model_rest(model, hinge->slot[k]);
        }
        fold_at(x, &fold);
        hinge->angle = fold.angle;
        hinge->twice_area[0] = fold.square[0];
        hinge->twice_area[1] = fold.square[1];
    }
}

static void read_hinge(const SurfaceModel *model, const void *rows, const Hinge *hinge, Vec3 x[4])
{
    for (int k = 0; k < 4; k++) {
        const int slot = hinge->slot[k];
        const long at = (long)slot * ROW;
        x[k] = (Vec3){model_get(model, rows, at), model_get(model, rows, at + 1),
                      model_get(model, rows, at + 2)};
        if (model->basis.displaced)
            x[k] = vec3_add(x[k], model_rest(model, slot));
    }
}

// Returns the angular velocity of a fold [rad/s].
static double fold_speed(const SurfaceModel *model, const void *rows, const Hinge *hinge,
                         const Fold *fold)
{
    double speed = 0.0;
    for (int k = 0; k < 4; k++) {
        const long at = (long)hinge->slot[k] * ROW + 4;
        speed += vec3_dot(fold->gradient[k],
                          (Vec3){model_get(model, rows, at), model_get(model, rows, at + 1),
                                 model_get(model, rows, at + 2)});
    }
    return speed;
}

void bending_evaluate(const SurfaceModel *model, SpringPass *pass, bool external)
{
    const struct Bending *bending = model->bending;
    memset(bending->force, 0, (size_t)model->basis.count * sizeof *bending->force);
    for (int h = 0; h < bending->count; h++) {
        const Hinge *hinge = &bending->hinge[h];
        Vec3 x[4];
        Fold fold;
        read_hinge(model, pass->present, hinge, x);
        fold_at(x, &fold);
        // Damped as the springs are: by the same time.
        double change = turn_of(fold.angle - hinge->angle);
        if (model->damped)
            change += pass->damping_time * fold_speed(model, pass->present, hinge, &fold);
        double moment = -pass->stiffness_scale * hinge->stiffness * share_of(hinge, &fold) * change;
        for (int k = 0; k < 4; k++) {
            double *force = bending->force[hinge->slot[k]];
            force[0] += moment * fold.gradient[k].x;
            force[1] += moment * fold.gradient[k].y;
            force[2] += moment * fold.gradient[k].z;
        }
    }
    // The kernel reads them with the external forces.
    for (int s = 0; s < model->basis.count; s++)
        for (int c = 0; c < 3; c++) {
            const long at = model_lane(s) + c * LANES;
            const double outer = external ? model_get(model, model->external, at) : 0.0;
            model_put(model, bending->external, at, outer + bending->force[s][c]);
        }
    pass->external = bending->external;
}

double bending_energy(const SurfaceModel *model, const void *rows)
{
    double energy = 0.0;
    for (int h = 0; h < model->bending->count; h++) {
        const Hinge *hinge = &model->bending->hinge[h];
        Vec3 x[4];
        Fold fold;
        read_hinge(model, rows, hinge, x);
        fold_at(x, &fold);
        double change = turn_of(fold.angle - hinge->angle);
        energy += 0.5 * hinge->stiffness * share_of(hinge, &fold) * change * change;
    }
    return energy;
}

int bending_hinges(const SurfaceModel *model)
{
    return model->bending->count;
}
