// SPDX-License-Identifier: MIT
// One evaluation of a body with levels against a plain sum over its leaves, at random states: every
// variant of the kernels for such bodies, at every instruction-set level and precision.
#include "base/isa.h"
#include "detail_bench.h"

#include "test.h"
#include "fixture.h"
#include "random.h"

#include <setjmp.h>
#include <stdarg.h>

#include <cmocka.h>

// A sum and the sizes of its terms, which rounding is relative to.
typedef struct Sum {
    Vec3 value;
    double size;
} Sum;

static void add(Sum *sum, Vec3 term)
{
    sum->value = vec3_add(sum->value, term);
    sum->size += vec3_length(term);
}

typedef struct Plain {
    DetailBench *bench;
    const SurfaceOptions *options;
    Vec3 *rest, *x, *v; // of nodes that are on; hanging ones in the middle of their masters
    Sum *force;
} Plain;

// By ascending number: masters come before what hangs on them.
static void place_nodes(Plain *plain)
{
    const Detail *detail = plain->bench->detail;
    const SurfaceModel *model = plain->bench->model;
    for (int i = 0; i < detail->set.node_count; i++) {
        if (detail->set.status[i] == NODE_OFF)
            continue;
        if (detail->set.status[i] == NODE_FREE) {
            plain->rest[i] = detail->set.levels.position[i];
            rows_read(&model->basis, model->rows[model->current], model->slot[i], &plain->x[i],
                      &plain->v[i]);
            continue;
        }
        int parent[2];
        levels_parents(&detail->set.levels, i, parent);
        Vec3 *const field[3] = {plain->rest, plain->x, plain->v};
        for (int k = 0; k < 3; k++)
            field[k][i] = vec3_scale(0.5, vec3_add(field[k][parent[0]], field[k][parent[1]]));
    }
}

// A spring between two nodes, pulling both.
static void pull(Plain *plain, int a, int b, double k)
{
    double beta = plain->bench->model->damping_time;
    double r =
        vec3_length(vec3_sub(plain->rest[a], plain->rest[b])) * (1.0 - plain->options->prestress);
    Vec3 d = vec3_sub(plain->x[a], plain->x[b]), u = vec3_sub(plain->v[a], plain->v[b]);
    double length = vec3_length(d);
    const Vec3 part[3] = {vec3_scale(-k, d), vec3_scale(k * r / length, d),
                          vec3_scale(-k * beta * vec3_dot(u, d) / (length * length), d)};
    for (int c = 0; c < 3; c++) {
        add(&plain->force[a], part[c]);
        add(&plain->force[b], vec3_scale(-1.0, part[c]));
    }
}

// A hinge between the left face (a, b, c) and the right face (b, a, d).
static void fold(Plain *plain, int a, int b, int c, int d, double stiffness)
{
    const int node[4] = {a, b, c, d};
    Vec3 gradient[4];
    double angle[2], k = 0.0, least = 1.0;
    double square[2][2]; // [at rest, now][face] of twice the areas
    for (int now = 0; now < 2; now++) {
        const Vec3 *x = now ? plain->x : plain->rest;
        Vec3 e = vec3_sub(x[b], x[a]);
        Vec3 left = vec3_cross(e, vec3_sub(x[c], x[a])),
             right = vec3_cross(vec3_sub(x[d], x[a]), e);
        double length = vec3_length(e);
        square[now][0] = vec3_dot(left, left);
        square[now][1] = vec3_dot(right, right);
        angle[now] = atan2(vec3_dot(vec3_cross(left, right), e) / length, vec3_dot(left, right));
        if (!now)
            k = stiffness * length * length / (0.5 * (sqrt(square[0][0]) + sqrt(square[0][1])));
        // Shares of the third nodes' feet on the edge.
        double s = vec3_dot(vec3_sub(x[c], x[a]), e) / (length * length),
               t = vec3_dot(vec3_sub(x[d], x[a]), e) / (length * length);
        gradient[2] = vec3_scale(-length / square[now][0], left);
        gradient[3] = vec3_scale(-length / square[now][1], right);
        gradient[0] = vec3_add(vec3_scale(s - 1.0, gradient[2]), vec3_scale(t - 1.0, gradient[3]));
        gradient[1] = vec3_add(vec3_scale(-s, gradient[2]), vec3_scale(-t, gradient[3]));
    }
    for (int side = 0; side < 2; side++)
        least = fmin(least, square[1][side] / (0.5 * square[0][side]));
    double change = angle[1] - angle[0], speed = 0.0;
    for (int i = 0; i < 4; i++)
        speed += vec3_dot(gradient[i], plain->v[node[i]]);
    double beta = plain->bench->model->damping_time;
    for (int i = 0; i < 4; i++) {
        Sum *to = &plain->force[node[i]];
        add(to, vec3_scale(-k * least * change, gradient[i]));
        add(to, vec3_scale(-k * least * beta * speed, gradient[i]));
        // Angles are differences of terms of their size, and of the folds of all faces.
        to->size += k * least * vec3_length(gradient[i]);
    }
}

// Corner of a face that is neither end of an edge.
static int opposite(const int corner[3], const int end[2])
{
    return corner[0] + corner[1] + corner[2] - end[0] - end[1];
}

// Edge by edge of all levels: a hinge between two leaves; an edge that only one side has divided
// has a hinge at each half, where the whole leaf is as wide as the half.
static void fold_all(Plain *plain, double stiffness)
{
    const LeafSet *set = &plain->bench->detail->set;
    for (int l = 0; l <= set->levels.finest; l++) {
        const Level *level = &set->levels.level[l];
        for (int e = 0; e < level->edge_count; e++) {
            const int *face = level->edge_face[e], *end = level->edge[e];
            if (face[0] < 0 || face[1] < 0)
                continue;
            const bool leaf[2] = {detail_is_leaf(set, l, face[0]), detail_is_leaf(set, l, face[1])};
            if (leaf[0] && leaf[1])
                fold(plain, end[0], end[1], opposite(level->face[face[0]], end),
                     opposite(level->face[face[1]], end), stiffness);
            for (int side = 0; side < 2; side++) {
                if (!leaf[side] || !detail_is_refined(set, l, face[1 - side]))
                    continue;
                const int middle = level->node_count + e;
                const int whole = opposite(level->face[face[side]], end);
                for (int h = 0; h < 2; h++) {
                    // The child at this end of the edge: its third node is the midpoint of the
                    // parent's other edge there.
                    const int *corner = level->face[face[1 - side]];
                    const int q = corner[0] == end[h] ? 0 : corner[1] == end[h] ? 1 : 2;
                    const int *around = level->face_edge[face[1 - side]];
                    const int other = around[q] == e ? around[(q + 2) % 3] : around[q];
                    const int third = level->node_count + other;
                    const int half[2] = {h == 0 ? end[0] : middle, h == 0 ? middle : end[1]};
                    fold(plain, half[0], half[1], side == 0 ? whole : third,
                         side == 0 ? third : whole, stiffness);
                }
            }
        }
    }
}

// Every leaf pulls along its edges with what it adds to their springs; with choi2005 a spring
// belongs to the edge, and to the first of its leaves here.
static void pull_all(Plain *plain)
{
    const Detail *detail = plain->bench->detail;
    for (int l = 0; l <= detail->set.levels.finest; l++) {
        const Level *level = &detail->set.levels.level[l];
        for (int f = 0; f < level->face_count; f++) {
            if (!detail_is_leaf(&detail->set, l, f))
                continue;
            for (int k = 0; k < 3; k++) {
                int a = level->face[f][k], b = level->face[f][(k + 1) % 3];
                int edge = level->face_edge[f][k], across = levels_beyond(level, edge, f);
                double length = vec3_length(vec3_sub(plain->rest[a], plain->rest[b]));
                double area = level_rules_area(&detail->rules, l, f);
                if (detail->set.constrained)
                    pull(plain, a, b, 80.0 * area / (length * length));
                else if (detail_midpoint(&detail->set, l, edge) < 0 &&
                         (across < f || !detail_is_leaf(&detail->set, l, across)))
                    pull(plain, a, b, detail->rules.stiffness[l]);
            }
        }
    }
}

// The pressure on every leaf, a third at each corner.
static void press(Plain *plain, double pressure)
{
    const Detail *detail = plain->bench->detail;
    for (int l = 0; l <= detail->set.levels.finest; l++)
        for (int f = 0; f < detail->set.levels.level[l].face_count; f++) {
            if (!detail_is_leaf(&detail->set, l, f))
                continue;
            const int *corner = detail->set.levels.level[l].face[f];
            const Vec3 *x = plain->x;
            const Vec3 twice = vec3_cross(vec3_sub(x[corner[1]], x[corner[0]]),
                                          vec3_sub(x[corner[2]], x[corner[0]]));
            for (int k = 0; k < 3; k++)
                add(&plain->force[corner[k]], vec3_scale(pressure / 6.0, twice));
        }
}

static void hand_over(Plain *plain)
{
    const Detail *detail = plain->bench->detail;
    for (int i = detail->set.node_count - 1; i >= 0; i--) { // finest first
        if (detail->set.status[i] != NODE_HANGING)
            continue;
        int parent[2];
        levels_parents(&detail->set.levels, i, parent);
        for (int k = 0; k < 2; k++) {
            Sum *to = &plain->force[parent[k]];
            to->value = vec3_madd(to->value, 0.5, plain->force[i].value);
            to->size += 0.5 * plain->force[i].size;
        }
    }
}

// Shape springs of 50 rad/s and damping ratio 0.1, in the world or on the fitted frame.
static void add_shape(const Plain *plain, int node, Sum *a)
{
    const SurfaceModel *model = plain->bench->model;
    Vec3 target = plain->rest[node], follow = {0.0, 0.0, 0.0};
    if (model->shape == SHAPE_FRAME_BODY) {
        const FramePose *f = &model->basis.rigid->pose;
        const Vec3 origin = model->basis.rest_origin; // the rows' coordinates
        Vec3 center = {f->center[0], f->center[1], f->center[2]};
        Vec3 from = {f->rest_center[0], f->rest_center[1], f->rest_center[2]};
        Vec3 arm = vec3_sub(vec3_sub(plain->rest[node], origin), from);
        const double part[3] = {arm.x, arm.y, arm.z};
        double turned[3] = {0.0, 0.0, 0.0};
        for (int i = 0; i < 3; i++)
            for (int j = 0; j < 3; j++)
                turned[i] += f->rotation[i][j] * part[j];
        target = vec3_add(vec3_add(origin, center), (Vec3){turned[0], turned[1], turned[2]});
        Vec3 spin = {f->angular[0], f->angular[1], f->angular[2]};
        Vec3 away = vec3_sub(vec3_sub(plain->x[node], origin), center);
        follow = vec3_add((Vec3){f->velocity[0], f->velocity[1], f->velocity[2]},
                          vec3_cross(spin, away));
    }
    const Vec3 spring = vec3_sub(plain->x[node], target);
    if (model->shape == SHAPE_FRAME_WORLD_RADIAL) // all else is carried along
        follow = vec3_madd(plain->v[node],
                           -vec3_dot(plain->v[node], spring) / vec3_dot(spring, spring), spring);
    add(a, vec3_scale(-2500.0, spring));
    add(a, vec3_scale(-2.0 * 0.1 * 50.0, vec3_sub(plain->v[node], follow)));
}

static void shake(Plain *plain, uint64_t *random)
{
    SurfaceModel *model = plain->bench->model;
    const Detail *detail = plain->bench->detail;
    for (int i = 0; i < detail->set.node_count; i++) {
        if (detail->set.status[i] != NODE_FREE)
            continue;
        Vec3 x = vec3_madd(detail->set.levels.position[i], 0.0005, random_vec3(random));
        Vec3 v = detail->fixed[i] ? (Vec3){0.0, 0.0, 0.0} : random_vec3(random);
        rows_write(&model->basis, model->rows[model->current], model->slot[i], x, v);
    }
    detail_hang(&model->detail->lists, model->basis.precision, model->rows[model->current]);
}

// A kick of one second and no drift: the velocity gains the acceleration.
static void check(DetailBench *bench, const SurfaceOptions *options, bool loaded, uint64_t *random)
{
    size_t nodes = (size_t)bench->detail->set.node_count;
    Plain plain = {.bench = bench, .options = options};
    plain.rest = calloc(nodes, sizeof *plain.rest);
    plain.x = calloc(nodes, sizeof *plain.x);
    plain.v = calloc(nodes, sizeof *plain.v);
    plain.force = calloc(nodes, sizeof *plain.force);
    shake(&plain, random);
    place_nodes(&plain);
    const Evaluation kick = {EVALUATION_KICK, 0.0, 1.0, 0.0, true};
    const Vec3 push = {0.2, -0.1, 0.3}; // on every tenth node, also on those that hang
    const BodyOps *ops = bench->body->ops;
    SurfaceModel *model = bench->model;
    ops->drift(model, 0.0);
    for (int i = 0; loaded && i < bench->detail->set.node_count; i += 10)
        if (bench->detail->set.status[i] != NODE_OFF) {
            ops->add_forces(model, &i, 1, &push);
            add(&plain.force[i], push);
        }
    pull_all(&plain);
    if (options->material.bending_stiffness > 0.0)
        fold_all(&plain, options->material.bending_stiffness);
    if (options->cavity.wanted)
        press(&plain, options->cavity.pressure);
    hand_over(&plain);
    ops->evaluate(model, &kick, 1.0);
    assert_true(ops->commit(model));
    double most = 0.0;
    for (int i = 0; i < bench->detail->set.node_count; i++) {
        if (bench->detail->set.status[i] != NODE_FREE)
            continue;
        Vec3 x, v;
        rows_read(&model->basis, model->rows[model->current], model->slot[i], &x, &v);
        if (bench->detail->fixed[i]) {
            assert_true(vec3_length(v) == 0.0);
            continue;
        }
        double per_mass = 1.0 / model->mass[i];
        Sum a = {vec3_scale(per_mass, plain.force[i].value), per_mass * plain.force[i].size};
        add(&a, plain.v[i]);
        if (options->shape.wanted)
            add_shape(&plain, i, &a);
        // Some ten terms of a dozen roundings each, of 1e-16 or 6e-8; in single precision
        // extensions come from displacements, whose terms are smaller than those summed up here.
        double close = options->body.precision == PRECISION_DOUBLE ? 1e-13 : 1e-5;
        expect_at_most(vec3_length(vec3_sub(v, a.value)), close * a.size);
        most = fmax(most, vec3_length(a.value));
    }
    assert_true(most > 10.0);
    free(plain.rest);
    free(plain.x);
    free(plain.v);
    free(plain.force);
}

static void check_variant(const SurfaceOptions *options, int organ, uint64_t seed)
{
    TriMesh mesh;
    SCOPED(bench_destroy) DetailBench bench;
    uint64_t random = seed;
    if (organ)
        fixture_organ(&mesh);
    else
        fixture_sheet(&mesh);
    const ToolOptions touch = {
        .id = 1, .kind = TOOL_PROBE, .capsule_count = 1, .capsule = {{.radius = 0.5}}};
    bench_create(&bench, BENCH_ADAPTIVE, &mesh, options, &touch, NULL);
    for (int i = 0; i < 25; i++)
        bench_change_at_random(&bench, &random, 9);
    assert_true(!bench.detail->set.constrained || bench.detail->lists.hanging_count > 16);
    check(&bench, options, false, &random);
    check(&bench, options, true, &random);
}

TEST(every_variant_agrees_with_a_plain_sum)
{
    const FixedRegion held = {.kind = FIXED_SPHERE, .center = {0.0, 0.0, 0.0}, .radius = 0.03};
    const char *const *isa = isa_available();
    for (int level = 0; isa[level] != NULL; level++)
        for (int precision = 0; precision < 2; precision++)
            for (int variant = 0; variant < 2 * 2 * SHAPE_VARIANTS; variant++)
                for (int adjust = 0; adjust < 2; adjust++) {
                    SurfaceOptions options = bench_options(3, 0);
                    options.body.isa = isa[level];
                    options.body.precision = (Precision)precision;
                    options.adjust = (SurfaceAdjust)adjust;
                    options.body.integrator = INTEGRATOR_SYMPLECTIC_EULER;
                    options.prestress = variant & 1 ? 0.05 : 0.0;
                    options.material.damping_time = variant & 2 ? 2e-4 : 0.0;
                    options.shape.wanted = variant / 4 != SHAPE_FRAME_NONE;
                    options.shape.frame =
                        variant / 4 == SHAPE_FRAME_BODY ? SHAPE_BODY : SHAPE_WORLD;
                    options.shape.direction = variant / 4 == SHAPE_FRAME_WORLD_RADIAL
                                                  ? SHAPE_DAMPS_RADIAL
                                                  : SHAPE_DAMPS_ALL;
                    options.body.fixed = &held;
                    options.body.fixed_count = variant / 4 != SHAPE_FRAME_NONE;
                    // Every second body bends, as stiff as the springs of its faces.
                    if (adjust == ADJUST_CONTINUUM && variant % 2 == 0)
                        options.material.bending_stiffness = 1e-3;
                    check_variant(&options, variant % 3 > 0, 40 + (uint64_t)variant);
                    // A closed body under pressure, which pushes as hard as springs pull.
                    if (adjust != ADJUST_CONTINUUM)
                        continue;
                    options.cavity = (SurfaceCavity){.wanted = true, .pressure = 2000.0};
                    check_variant(&options, 1, 80 + (uint64_t)variant);
                }
}
