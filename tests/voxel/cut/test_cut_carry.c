// SPDX-License-Identifier: MIT
// Bodies that adapt: the points that are shown while elements merge and are divided, and what a
// change keeps of mass, momentum and energy.
#include "test.h"
#include "cut_world.h"
#include "effort.h"
#include "sim_steps.h"

enum { BODIES = 3 };

// A cube of which all elements are whole, a ball and a part of three materials, whose surface
// elements are partly filled.
// Merges that a trial must have at least; short ones have some.
enum { ENOUGH = PLIANT_EFFORT == 1 ? 21 : 1 };

static VoxelWorldOptions options_of(int body)
{
    VoxelWorldOptions options = body == 0   ? voxel_world_cube(16)
                                : body == 1 ? voxel_world_ball()
                                            : voxel_world_corner();
    options.body.body.levels = 2;
    options.body.surface_level = 2;
    options.body.split_budget = 8;
    return options;
}

// --- at rest ---

// Reads what is published.
static void read_shown(const CutWorld *world, float (*x)[3])
{
    world->body->ops->snapshot(world->body->model, x[0], NULL);
}

TEST(an_untouched_body_shows_the_points_of_one_that_does_not_adapt)
{
    for (int k = 0; k < BODIES; k++) {
        VoxelWorldOptions options = options_of(k), plain = options_of(k);
        plain.body.surface_level = 0;
        SCOPED(cut_world_destroy) CutWorld world;
        SCOPED(cut_world_destroy) CutWorld fine;
        cut_world_create(&world, &options);
        cut_world_create(&fine, &plain);
        const BodyMesh *a = &world.body->mesh, *b = &fine.body->mesh;
        assert_int_equal(a->node_count, b->node_count);
        assert_int_equal(a->triangle_count, b->triangle_count);
        assert_memory_equal(a->triangle, b->triangle,
                            (size_t)a->triangle_count * sizeof *a->triangle);
        assert_memory_equal(a->id, b->id, (size_t)a->node_count * sizeof *a->id);
        assert_memory_equal(a->piece, b->piece, (size_t)a->node_count * sizeof *a->piece);
        float(*x)[3] = calloc((size_t)a->node_count, sizeof *x);
        float(*y)[3] = calloc((size_t)a->node_count, sizeof *y);
        read_shown(&world, x);
        read_shown(&fine, y);
        assert_memory_equal(x, y, (size_t)a->node_count * sizeof *x);
        free(x);
        free(y);
        // What tools meet is as heavy and as firm.
        const BodySurface *coarse = &world.body->surface, *all = &fine.body->surface;
        for (int s = 0; s < a->node_count; s++) {
            const int v = world.model->node[s], w = fine.model->node[s];
            assert_true(all->node_area[w] > 0.0);
            expect_near(coarse->node_area[v], all->node_area[w], 0.0);
            expect_near(coarse->node_mass[v], all->node_mass[w], 1e-12 * all->node_mass[w]);
            expect_near(coarse->node_firmness[v], all->node_firmness[w], 1e-12);
        }
        cut_world_check_masses(&world);
        print_message("%d of %d elements, %d carried of %d\n", world.body->element_count,
                      fine.body->element_count, cut_carry_count(world.cuts->carry), a->node_count);
        assert_true(2 * world.body->element_count < fine.body->element_count);
    }
}

// --- changes ---

// Elements change when a test says so, and only then.
static bool stay(Body *body, int64_t step, double tick, TopologyChange *change)
{
    (void)body, (void)step, (void)tick;
    *change = (TopologyChange){0};
    return false;
}

static void create(CutWorld *world, VoxelWorldOptions *options)
{
    static BodyOps ops;
    cut_world_create(world, options);
    ops = *world->body->ops;
    ops.adapt = stay;
    world->body->ops = &ops;
}

typedef struct Merging {
    VoxelCuts *cuts;
    uint64_t *seed;
    int odds; // one of so many that can is merged
    double limit, largest;
    int count, most;
} Merging;

static bool merge(Sim *sim, int body, void *context, TopologyChange *change)
{
    Merging *merging = context;
    CutLattice *lattice = &merging->cuts->lattice;
    merging->count = 0;
    merging->largest = 0.0;
    // Residuals of the state before any of them.
    for (int e = lattice->level_first[1]; e < lattice->element_count; e++) {
        if (merging->count == merging->most || !cut_lattice_can_merge(lattice, e) ||
            random_below(merging->seed, merging->odds) > 0)
            continue;
        const double residual = cut_masses_residual(&merging->cuts->masses, e);
        if (residual > merging->limit)
            continue;
        merging->largest = fmax(merging->largest, residual);
        cut_lattice_merge(lattice, e);
        merging->count++;
    }
    *change = (TopologyChange){0};
    return merging->count > 0 &&
           cut_body_follow(merging->cuts, &sim->body[body], true, false, change);
}

// Merges some of what can where nothing would move farther than `limit` [cells], at most so many.
// Returns how many.
static int merge_most(CutWorld *world, Merging merging, double *largest)
{
    merging.cuts = world->cuts;
    change_body(world->sim, 0, merge, &merging);
    if (largest != NULL)
        *largest = merging.largest;
    return merging.count;
}

static int merge_some(CutWorld *world, uint64_t *seed, int odds, double limit, double *largest)
{
    return merge_most(world, (Merging){.seed = seed, .odds = odds, .limit = limit, .most = INT_MAX},
                      largest);
}

static int merge_one(CutWorld *world, uint64_t *seed, double limit, double *largest)
{
    return merge_most(world, (Merging){.seed = seed, .odds = 5, .limit = limit, .most = 1},
                      largest);
}

// --- what is shown ---

// Reads the places of all kept vertices.
static void read_kept(const CutWorld *world, Vec3 *x)
{
    for (int v = 0; v < world->cuts->lattice.kept_end; v++)
        world->body->ops->read_nodes(world->model, &v, 1, &x[v], NULL);
}

static double largest_move(const CutWorld *world, const Vec3 *from, const Vec3 *to)
{
    double most = 0.0;
    for (int v = 0; v < world->cuts->lattice.kept_end; v++)
        if (cut_lattice_is_kept(&world->cuts->lattice, v))
            most = fmax(most, vec3_length(vec3_sub(to[v], from[v])));
    return most / world->lattice.size;
}

static Vec3 affine(Vec3 x)
{
    return vec3(0.01 + 1.02 * x.x - 0.3 * x.y + 0.1 * x.z, 0.3 * x.x + 0.9 * x.y - 0.02,
                0.05 * x.x + 1.1 * x.z);
}

// A turn, a stretch and a shear at once: exact but for rounding, whatever the elements.
TEST(shown_points_follow_uniform_strains)
{
    uint64_t seed = 51;
    for (int k = 0; k < BODIES; k++) {
        VoxelWorldOptions options = options_of(k);
        SCOPED(cut_world_destroy) CutWorld world;
        create(&world, &options);
        Vertices *vertices = &world.model->vertices;
        const CutLattice *lattice = &world.cuts->lattice;
        Vec3 *before = calloc((size_t)lattice->kept_end, sizeof *before);
        Vec3 *after = calloc((size_t)lattice->kept_end, sizeof *after);
        for (int round = 0; round < 12; round++) {
            for (int v = 0; v < vertices->count; v++)
                if (lattice->vertex_id[v] >= 0 && !cut_lattice_is_carried(lattice, v))
                    rows_write(&vertices->rows, vertices->row[vertices->current], v,
                               affine(rows_rest(&vertices->rows, v)), vec3(0.0, 0.0, 0.0));
            cut_carry_forget(world.cuts->carry);
            read_kept(&world, before);
            for (int v = 0; v < lattice->kept_end; v++)
                if (cut_lattice_is_kept(lattice, v))
                    expect_near(
                        vec3_length(vec3_sub(before[v], affine(rows_rest(&vertices->rows, v)))),
                        0.0, 1e-13);
            // Nor does a change move them.
            if (round % 3 == 2)
                merge_some(&world, &seed, 2, 1e-9, NULL);
            else
                cut_world_divide_some(&world, &seed, 6);
            read_kept(&world, after);
            expect_near(largest_move(&world, before, after), 0.0, 1e-11);
            cut_world_check_masses(&world);
        }
        free(before);
        free(after);
    }
}

// --- readers ---

// Where a kept vertex is, and how fast, by the vertices of elements alone.
static void place_now(const CutWorld *world, int vertex, Vec3 *x, Vec3 *v)
{
    const Vertices *vertices = &world->model->vertices;
    FitWeight weight[NODE_COUNT] = {{vertex, 1.0}};
    const int count = cut_lattice_is_carried(&world->cuts->lattice, vertex)
                          ? cut_carry_weights(world->cuts->carry, vertex, weight)
                          : 1;
    *x = *v = vec3(0.0, 0.0, 0.0);
    for (int w = 0; w < count; w++) {
        Vec3 at, speed;
        rows_read(&vertices->rows, vertices_row(vertices), weight[w].vertex, &at, &speed);
        *x = vec3_madd(*x, weight[w].weight, at);
        *v = vec3_madd(*v, weight[w].weight, speed);
    }
}

// Looks at some carried vertices by one of the ways by which others do.
static void expect_current(const CutWorld *world, int way, uint64_t *seed)
{
    enum { SOME = 40 };
    const CutLattice *lattice = &world->cuts->lattice;
    const Body *body = world->body;
    const int nodes = (int)*world->model->node_count;
    const double near = 1e-6 * world->lattice.size; // floats are published
    FREED float *shown = calloc(6 * (size_t)nodes + 2, sizeof *shown);
    FREED int *found = calloc((size_t)nodes + 1, sizeof *found);
    if (way == 0) {
        FREED float *alone = calloc(3 * (size_t)nodes + 1, sizeof *alone);
        body->ops->snapshot(body->model, shown, shown + 3 * nodes);
        body->ops->snapshot(body->model, alone, NULL);
        assert_memory_equal(alone, shown, 3 * (size_t)nodes * sizeof *alone);
    }
    for (int k = 0; k < SOME; k++) {
        const int slot = random_below(seed, nodes), vertex = world->model->node[slot];
        Vec3 x, v, y, w;
        place_now(world, vertex, &x, &v);
        if (way == 0) {
            const float *at = shown + 3 * slot, *speed = at + 3 * nodes;
            y = vec3((double)at[0], (double)at[1], (double)at[2]);
            w = vec3((double)speed[0], (double)speed[1], (double)speed[2]);
        } else if (way == 1) {
            body->ops->read_nodes(body->model, &vertex, 1, &y, &w);
        } else {
            // Within a hair around where it is now, and nowhere else.
            const Region region = {.from = x, .to = x, .radius = near};
            const int count = body->ops->find_nodes(body->model, &region, found, nodes);
            bool there = false;
            for (int i = 0; i < count; i++)
                there |= found[i] == vertex;
            assert_true(there || !cut_lattice_is_kept(lattice, vertex));
            continue;
        }
        expect_near(vec3_length(vec3_sub(x, y)), 0.0, near);
        expect_near(vec3_length(vec3_sub(v, w)), 0.0, 1e-6 * (1.0 + vec3_length(v)));
    }
}

// Whoever reads carried vertices first after a tick, a change or a reset finds them where they are
// now, and their own rows hold nothing.
TEST(no_reader_meets_carried_vertices_of_another_time)
{
    uint64_t seed = 58;
    for (int k = 0; k < BODIES; k++) {
        VoxelWorldOptions options = options_of(k);
        SCOPED(cut_world_destroy) CutWorld world;
        create(&world, &options);
        const Vertices *vertices = &world.model->vertices;
        int carried = 0;
        for (int round = 0; round < EFFORT(150); round++) {
            if (round % 30 == 0)
                cut_world_shake(&world, 0.2, &seed);
            // Somebody knows the state before.
            expect_current(&world, random_below(&seed, 3), &seed);
            switch (random_below(&seed, 8)) {
            case 0:
                world.body->ops->restore(world.model, RESTORE_POSITIONS);
                break;
            case 1:
            case 2:
                cut_world_divide_some(&world, &seed, 4);
                break;
            case 3:
            case 4:
                merge_some(&world, &seed, 4, 1e9, NULL);
                break;
            default:
                sim_step(world.sim);
            }
            expect_current(&world, random_below(&seed, 3), &seed);
            for (int v = 0; v < world.cuts->lattice.kept_end; v++) {
                if (!cut_lattice_is_carried(&world.cuts->lattice, v))
                    continue;
                carried++;
                for (int c = 0; c < 2 * ROW; c++)
                    assert_true(rows_get(&vertices->rows, vertices->row[c / ROW],
                                         (long)v * ROW + c % ROW) == 0.0);
            }
        }
        assert_true(carried > EFFORT(150) * 20);
    }
}

// --- what a change keeps ---

static void expect_same_momentum(const WorldMomentum *before, const WorldMomentum *after)
{
    expect_near(vec3_length(vec3_sub(after->linear, before->linear)), 0.0,
                1e-12 * before->linear_sum);
    expect_near(vec3_length(vec3_sub(after->angular, before->angular)), 0.0,
                1e-12 * before->angular_sum);
}

static double world_energy(const CutWorld *world)
{
    const BodyMeasure measure = measure_of(world->body);
    return measure.elastic + measure.kinetic;
}

// Of bodies that move and are bent, whatever merges: a merge may throw away motion that the larger
// element cannot follow, never momentum.
TEST(merges_and_divisions_keep_momentum_and_mass)
{
    uint64_t seed = 52;
    for (int k = 0; k < BODIES; k++) {
        VoxelWorldOptions options = options_of(k);
        SCOPED(cut_world_destroy) CutWorld world;
        create(&world, &options);
        int merged = 0, divided = 0;
        for (int round = 0; round < EFFORT(40); round++) {
            const int leaves = world.cuts->lattice.leaf_count;
            if (round % 10 == 0)
                cut_world_shake(&world, 0.2, &seed);
            WorldMomentum before = cut_world_momentum(&world), after;
            cut_world_divide_some(&world, &seed, 4);
            after = cut_world_momentum(&world);
            expect_same_momentum(&before, &after);
            cut_world_check_masses(&world);
            divided += world.cuts->lattice.leaf_count > leaves;
            before = after;
            merged += merge_some(&world, &seed, 4, 1e9, NULL);
            after = cut_world_momentum(&world);
            expect_same_momentum(&before, &after);
            cut_world_check_masses(&world);
            sim_step(world.sim);
            assert_int_equal(sim_resets(world.sim), 0);
        }
        print_message("%d merged, %d times divided\n", merged, divided);
        assert_true(merged >= ENOUGH && divided >= ENOUGH / 2 + 1);
        assert_true(world.body->ops->check(world.model));
    }
}

// A cell that is to go, and how often what was to be divided for it ended vertices.
typedef struct Exposing {
    VoxelCuts *cuts;
    int cell, ended;
} Exposing;

static bool expose(Sim *sim, int body, void *context, TopologyChange *change)
{
    Exposing *exposing = context;
    CutLattice *lattice = &exposing->cuts->lattice;
    int count = 1;
    *change = (TopologyChange){0};
    if (cut_lattice_expose(lattice, &exposing->cell, &count, 1000) == 0)
        return false;
    for (int i = 0; i < lattice->changes.ended_count; i++) {
        const int child = cut_lattice_first_child(lattice, lattice->changes.ended[i].element);
        exposing->ended += !cut_lattice_is_leaf(lattice, child);
    }
    return cut_body_follow(exposing->cuts, &sim->body[body], true, false, change);
}

// What is in the way of a cell that goes is divided down to it at once: also elements that have
// just come, and their corners in void end.
TEST(elements_divided_twice_in_a_change_keep_momentum_and_mass)
{
    uint64_t seed = 57;
    int ended = 0;
    for (int k = 0; k < BODIES; k++) {
        VoxelWorldOptions options = options_of(k);
        SCOPED(cut_world_destroy) CutWorld world;
        create(&world, &options);
        CutLattice *lattice = &world.cuts->lattice;
        for (int round = 0; round < EFFORT(80); round++) {
            cut_world_shake(&world, 0.2, &seed);
            Exposing exposing = {.cuts = world.cuts,
                                 .cell = random_below(&seed, lattice->level_first[1])};
            const WorldMomentum before = cut_world_momentum(&world);
            change_body(world.sim, 0, expose, &exposing);
            const WorldMomentum after = cut_world_momentum(&world);
            expect_same_momentum(&before, &after);
            cut_world_check_masses(&world);
            ended += exposing.ended;
            for (int n = 0; n < 8; n++)
                merge_some(&world, &seed, 1, 1e9, NULL);
        }
    }
    print_message("%d vertices ended of elements whose first child was divided, too\n", ended);
    assert_true(ended > 0);
}

// The residual is the bound of what a merge moves, shown points included; a division moves none.
TEST(no_shown_point_moves_farther_than_the_residual)
{
    uint64_t seed = 53;
    for (int k = 0; k < BODIES; k++) {
        VoxelWorldOptions options = options_of(k);
        SCOPED(cut_world_destroy) CutWorld world;
        create(&world, &options);
        const int kept = world.cuts->lattice.kept_end;
        Vec3 *before = calloc((size_t)kept, sizeof *before);
        Vec3 *after = calloc((size_t)kept, sizeof *after);
        double farthest = 0.0, gained = 0.0, lost = 0.0, most = 0.0;
        int merged = 0;
        for (int tick = 0; tick < EFFORT(200); tick++) {
            if (tick % 50 == 0)
                cut_world_shake(&world, 0.05, &seed);
            sim_step(world.sim);
            read_kept(&world, before);
            cut_world_divide_some(&world, &seed, 2);
            read_kept(&world, after);
            // By the same sums in another order.
            expect_near(largest_move(&world, before, after), 0.0, 1e-12);
            // One by one: where two merge beside each other, what is between them moves by both.
            // Those that stay take over at most as much as the others leave: twice as far; with
            // twelve other seeds 1.19 times.
            double residual;
            const double energy = world_energy(&world);
            for (int n = 0; n < 3; n++) {
                const int count = merge_one(&world, &seed, 0.05, &residual);
                read_kept(&world, before);
                merged += count;
                farthest = fmax(farthest, largest_move(&world, before, after));
                expect_near(largest_move(&world, before, after), 0.0, 2.0 * residual + 1e-12);
                memcpy(after, before, (size_t)kept * sizeof *after);
            }
            const double more = world_energy(&world) - energy;
            gained += fmax(more, 0.0), lost += fmin(more, 0.0);
            most = fmax(most, fabs(more) / energy);
        }
        print_message(
            "%d merged: by %.3g cells at most; energy %.3g J, +%.3g -%.3g J, %.3g at once\n",
            merged, farthest, world_energy(&world), gained, lost, most);
        assert_true(merged >= ENOUGH);
        free(before);
        free(after);
    }
}

// A single cell has no larger element around it.
TEST(a_body_of_one_cell_adapts_in_nothing)
{
    VoxelWorldOptions options = voxel_world_block(1, 1, 1, 0.01);
    options.body.body.levels = 0;
    options.body.surface_level = 2;
    SCOPED(cut_world_destroy) CutWorld world;
    cut_world_create(&world, &options);
    for (int tick = 0; tick < 20; tick++)
        sim_step(world.sim);
    assert_int_equal(sim_resets(world.sim), 0);
    assert_int_equal(world.body->element_count, 1);
    sim_restored(world.sim);
    assert_true(world.body->ops->check(world.model));
}

// --- states ---

// One tick of a body that is thrown about: merges and divisions, and now and then a cut.
static void live_on(CutWorld *world, int tick, uint64_t *seed)
{
    if (tick % 40 == 20) {
        CutOutcome outcome;
        const CutOptions cut = cut_world_random(world, seed);
        cut_world_cut(world, &cut, &outcome);
    }
    if (tick % 3 == 0)
        cut_world_divide_some(world, seed, 2);
    else
        merge_some(world, seed, 3, 0.1, NULL);
    sim_step(world->sim);
    assert_int_equal(sim_resets(world->sim), 0);
}

// What follows from the state: the same, however it came about.
static void expect_derived(CutWorld *world)
{
    const VoxelCuts *cuts = world->cuts;
    const CutLattice *lattice = &cuts->lattice;
    const Vertices *vertices = &world->model->vertices;
    const size_t rows = (size_t)vertices->count, faces = 2 * (size_t)*cuts->faces.shown;
    const size_t kept = (size_t)lattice->kept_end, elements = (size_t)lattice->element_count;
    FREED double *mass = malloc(rows * sizeof *mass), *node = malloc(rows * sizeof *node);
    FREED int *lane = malloc(elements * sizeof *lane), *leaf = malloc(kept * sizeof *leaf);
    FREED int(*face)[3] = malloc(faces * sizeof *face);
    memcpy(mass, vertices->mass, rows * sizeof *mass);
    memcpy(node, cuts->masses.node_mass, rows * sizeof *node);
    for (size_t e = 0; e < elements; e++)
        lane[e] = cut_windows_lane(&cuts->windows, (int)e);
    memcpy(leaf, cuts->carry->leaf_of, kept * sizeof *leaf);
    memcpy(face, cuts->faces.face, faces * sizeof *face);
    const int carried = cut_carry_count(cuts->carry);
    world->body->ops->restored(world->body);
    assert_true(cuts->sound);
    assert_memory_equal(mass, vertices->mass, rows * sizeof *mass);
    assert_memory_equal(node, cuts->masses.node_mass, rows * sizeof *node);
    for (size_t e = 0; e < elements; e++)
        assert_int_equal(lane[e], cut_windows_lane(&cuts->windows, (int)e));
    assert_memory_equal(leaf, cuts->carry->leaf_of, kept * sizeof *leaf);
    assert_memory_equal(face, cuts->faces.face, faces * sizeof *face);
    assert_int_equal(carried, cut_carry_count(cuts->carry));
}

TEST(a_state_of_a_body_that_adapts_goes_on_in_the_same_bits)
{
    for (int k = 0; k < BODIES; k++) {
        VoxelWorldOptions options = options_of(k);
        options.body.body.precision = k == 1 ? PRECISION_SINGLE : PRECISION_DOUBLE;
        options.body.branch_count = 1;
        options.body.branch[0] = (MaxwellBranch){.share = 0.5, .time = 0.05, .volumetric = true};
        SCOPED(cut_world_destroy) CutWorld world;
        create(&world, &options);
        uint64_t seed = 54;
        cut_world_shake(&world, 0.1, &seed);
        int tick = 0;
        for (; tick < EFFORT(60); tick++) {
            live_on(&world, tick, &seed);
            if (tick % 6 == 0) {
                cut_world_check_masses(&world);
                expect_derived(&world);
            }
        }
        FREED void *middle = copy_state(&world.state);
        uint64_t hash = 0;
        for (int run = 0; run < 2; run++) {
            uint64_t again = seed;
            if (run > 0)
                resume(&world.state, world.sim, middle);
            for (int t = 0; t < 60; t++)
                live_on(&world, tick + t, &again);
            assert_true(run == 0 || state_hash(&world.state) == hash);
            hash = state_hash(&world.state);
        }
    }
}

// Carried points are no bodies of their own: they fall, fly and turn with what carries them, in a
// frame that falls too (single precision), with drag on the deformation.
TEST(a_free_body_falls_with_all_its_points)
{
    uint64_t seed = 55;
    for (int k = 0; k < 2 * BODIES; k++) {
        VoxelWorldOptions options = options_of(k / 2);
        options.body.body.precision = k % 2 == 0 ? PRECISION_DOUBLE : PRECISION_SINGLE;
        options.body.body.gravity = vec3(0.0, 0.0, -9.81);
        options.body.drag = 20.0;
        SCOPED(cut_world_destroy) CutWorld world;
        create(&world, &options);
        const Vertices *vertices = &world.model->vertices;
        const CutLattice *lattice = &world.cuts->lattice;
        FREED Vec3 *start = calloc((size_t)lattice->kept_end, sizeof *start);
        FREED Vec3 *now = calloc((size_t)lattice->kept_end, sizeof *now);
        read_kept(&world, start);
        for (int tick = 0; tick < 100; tick++) {
            if (tick % 4 == 0)
                cut_world_divide_some(&world, &seed, 3);
            else
                merge_some(&world, &seed, 3, 0.05, NULL);
            sim_step(world.sim);
        }
        // Steps of h fall by g h^2 n (n + 1) / 2.
        const double h = world.body->h, n = 100.0 * world.body->substeps;
        const Vec3 way = vec3(0.0, 0.0, -9.81 * h * h * n * (n + 1.0) / 2.0);
        read_kept(&world, now);
        double off = 0.0;
        for (int v = 0; v < lattice->kept_end; v++)
            if (cut_lattice_is_kept(lattice, v))
                off = fmax(off, vec3_length(vec3_sub(vec3_sub(now[v], start[v]), way)));
        // Of single precision: displacements of rounding, of rows of a hundredth of a metre.
        expect_near(off, 0.0, (k % 2 == 0 ? 1e-9 : 1e-4) * world.lattice.size);
        // Nothing is left in free rows.
        for (int v = 0; v < vertices->count; v++)
            for (int c = 0; c < ROW && lattice->vertex_id[v] < 0; c++)
                assert_true(rows_get(&vertices->rows, vertices_row(vertices), (long)v * ROW + c) ==
                            0.0);
    }
}

// A force on a carried point acts on what carries it: momentum grows by it, and angular momentum by
// its moment about the place that is shown.
TEST(forces_on_carried_points_keep_their_resultant_and_moment)
{
    uint64_t seed = 56;
    for (int k = 0; k < BODIES; k++) {
        VoxelWorldOptions options = options_of(k);
        SCOPED(cut_world_destroy) CutWorld world;
        create(&world, &options);
        cut_world_shake(&world, 0.2, &seed);
        const CutLattice *lattice = &world.cuts->lattice;
        int carried = 0;
        Vec3 linear = {0.0, 0.0, 0.0}, angular = {0.0, 0.0, 0.0};
        Vertices *vertices = &world.model->vertices;
        for (int v = 0; v < lattice->kept_end; v += 3) {
            const Vec3 force = random_vec3(&seed);
            Vec3 x, speed;
            if (!cut_lattice_is_kept(lattice, v))
                continue;
            world.body->ops->read_nodes(world.model, &v, 1, &x, &speed);
            world.body->ops->add_forces(world.model, &v, 1, &force);
            linear = vec3_add(linear, force);
            angular = vec3_add(angular, vec3_cross(x, force));
            carried += cut_lattice_is_carried(lattice, v);
        }
        assert_true(carried > 20);
        double sum = 0.0;
        for (int v = 0; v < vertices->count; v++) {
            const double *f = (const double *)vertices->force + 4L * v;
            Vec3 x, force = vec3(f[0], f[1], f[2]);
            if (lattice->vertex_id[v] < 0 || cut_lattice_is_carried(lattice, v)) {
                assert_true(vec3_length(force) == 0.0);
                continue;
            }
            rows_read(&vertices->rows, vertices_row(vertices), v, &x, NULL);
            if (vertices->rows.turned)
                force = quat_rotate(vertices->rows.frame->turn, force);
            linear = vec3_sub(linear, force);
            angular = vec3_sub(angular, vec3_cross(x, force));
            sum += vec3_length(force);
        }
        // Sums of some hundred forces, of points about a decimetre from the origin.
        expect_near(vec3_length(linear), 0.0, 1e-14 * sum);
        expect_near(vec3_length(angular), 0.0, 1e-14 * sum);
    }
}

// --- room ---

// Keeps those elements of a list that are leaves, each once.
static int keep_leaves(const CutLattice *lattice, int *element, int count)
{
    int kept = 0;
    for (int k = 0; k < count; k++) {
        bool known = !cut_lattice_is_leaf(lattice, element[k]);
        for (int j = 0; j < kept; j++)
            known |= element[j] == element[k];
        if (!known)
            element[kept++] = element[k];
    }
    return kept;
}

// Tries what waits again until nothing of it is divided any more. Returns how many still wait.
static int divide_waiting(CutWorld *world, int *element, int waiting)
{
    const CutLattice *lattice = &world->cuts->lattice;
    for (int leaves = -1; leaves != lattice->leaf_count;) {
        leaves = lattice->leaf_count;
        cut_world_divide(world, element, waiting);
        waiting = keep_leaves(lattice, element, waiting);
    }
    return waiting;
}

// What does not fit waits, keeps nothing that is behind it waiting, and finds room when others have
// merged. Rows, leaves and batches never exceed what there is: their owners assert that.
TEST(what_does_not_fit_waits_until_others_have_merged)
{
    uint64_t seed = 57;
    VoxelWorldOptions roomy = options_of(0), options = options_of(0);
    SCOPED(cut_world_destroy) CutWorld wide;
    cut_world_create(&wide, &roomy);
    options.body.body.node_capacity = cut_lattice_used(&wide.cuts->lattice) + 60;
    SCOPED(cut_world_destroy) CutWorld world;
    cut_world_create(&world, &options);
    const CutLattice *lattice = &world.cuts->lattice;
    const int rest = lattice->leaf_count;
    assert_int_equal(rest, wide.cuts->lattice.leaf_count);
    enum { EACH = 40 };
    FREED int *element = malloc(((size_t)lattice->element_count + EACH) * sizeof *element);
    int waiting = 0, refused = 0, divided = 0, found_room = 0;
    for (int round = 0; round < 40; round++) { // with a sixth of them none would be behind
        // What waited before, then others behind what still has no room.
        const int waited = waiting;
        waiting = divide_waiting(&world, element, waiting);
        found_room += waited - waiting;
        const int leaves = lattice->leaf_count, still = waiting;
        waiting += cut_world_random_leaves(&world, &seed, EACH, element + waiting);
        cut_world_divide(&world, element, waiting);
        divided += still > 0 && lattice->leaf_count > leaves;
        waiting = keep_leaves(lattice, element, waiting);
        refused += waiting > 0;
        assert_int_equal(lattice->wanted_count, 0); // nothing is broken
        assert_in_range(cut_lattice_used(lattice), 1, lattice->vertex_capacity);
        cut_world_check_masses(&world);
        if (round % 4 == 3)
            merge_some(&world, &seed, 2, 1e9, NULL);
        waiting = keep_leaves(lattice, element, waiting); // others are no leaves any more
        sim_step(world.sim);
        assert_int_equal(sim_resets(world.sim), 0);
    }
    print_message("%d rounds with what does not fit, in %d of them others behind it were divided; "
                  "%d found room later\n",
                  refused, divided, found_room);
    assert_true(refused > 0 && divided > 0 && found_room > 0);
    // Everything merges to the state at rest, and what had no room has it.
    while (merge_some(&world, &seed, 1, 1e9, NULL) > 0)
        ;
    assert_int_equal(lattice->leaf_count, rest);
    cut_world_divide_some(&world, &seed, 40);
    assert_true(lattice->leaf_count > rest);
}

// From the coarsest level on, until nothing fits any more: what is divided merges again, and no row
// that it takes for it is missing.
TEST(what_fills_a_body_can_merge)
{
    uint64_t seed = 58;
    for (int more = 0; more < 4; more++) {
        VoxelWorldOptions roomy = options_of(0), options = options_of(0);
        roomy.body.body.levels = roomy.body.surface_level = 3;
        options.body.body.levels = options.body.surface_level = 3;
        SCOPED(cut_world_destroy) CutWorld wide;
        cut_world_create(&wide, &roomy);
        options.body.body.node_capacity = cut_lattice_used(&wide.cuts->lattice) + 300 * (1 + more);
        SCOPED(cut_world_destroy) CutWorld world;
        cut_world_create(&world, &options);
        const CutLattice *lattice = &world.cuts->lattice;
        const int rest = lattice->leaf_count;
        FREED int *element = malloc((size_t)lattice->element_count * sizeof *element);
        for (int level = lattice->levels; level > 0; level--) {
            int count = 0;
            for (int e = lattice->level_first[level]; e < lattice->level_first[level + 1]; e++)
                element[count++] = e;
            divide_waiting(&world, element, keep_leaves(lattice, element, count));
        }
        assert_true(lattice->leaf_count > 40 * rest);
        while (merge_some(&world, &seed, 1, 1e9, NULL) > 0)
            ;
        assert_int_equal(lattice->leaf_count, rest);
    }
}
